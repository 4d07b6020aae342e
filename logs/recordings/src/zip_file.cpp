// SPDX-License-Identifier: Apache-2.0
// Zip archives: NumPy's .npz, spreadsheets, and the tables that phones' programs pack together.
#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/late_library.hpp"
#include "axiscal/core/number_text.hpp"
#include "opened.hpp"
#include "series_tables.hpp"

#ifdef AXISCAL_LIBARCHIVE
#include <algorithm>
#include <archive.h>
#include <archive_entry.h>
#include <map>
#endif

namespace axiscal {

#ifdef AXISCAL_LIBARCHIVE
namespace {

#ifdef AXISCAL_LIBARCHIVE_LATE
AXISCAL_LATE_LIBRARY(libarchive, AXISCAL_LIBARCHIVE)
AXISCAL_LATE(libarchive, archive_entry_filetype)
AXISCAL_LATE(libarchive, archive_entry_pathname)
AXISCAL_LATE(libarchive, archive_read_data)
AXISCAL_LATE(libarchive, archive_read_free)
AXISCAL_LATE(libarchive, archive_read_new)
AXISCAL_LATE(libarchive, archive_read_next_header)
AXISCAL_LATE(libarchive, archive_read_open_filename)
AXISCAL_LATE(libarchive, archive_read_support_format_zip)
#endif

struct FreeArchive {
  void operator()(archive* a) const { archive_read_free(a); }
};
using Archive = std::unique_ptr<archive, FreeArchive>;

constexpr std::size_t most_members = 1000;
constexpr std::size_t largest_part = 512U << 20U;

Archive open_archive(const std::string& path, const std::string& name) {
  Archive opened(archive_read_new());
  archive_read_support_format_zip(opened.get());
  constexpr std::size_t block = 1U << 16U;
  if (archive_read_open_filename(opened.get(), path.c_str(), block) != ARCHIVE_OK) {
    throw DataError(name, "the zip archive is damaged");
  }
  return opened;
}

std::vector<std::string> members_of(const std::string& path, const std::string& name) {
  const Archive opened = open_archive(path, name);
  std::vector<std::string> members;
  archive_entry* entry = nullptr;
  while (members.size() < most_members &&
         archive_read_next_header(opened.get(), &entry) == ARCHIVE_OK) {
    const char* const member = archive_entry_pathname(entry);
    if (member != nullptr && archive_entry_filetype(entry) == AE_IFREG) {
      members.emplace_back(member);
    }
  }
  return members;
}

// A member of the archive, unpacked as it is read.
ByteSource bytes_of(const std::string& path, const std::string& name, const std::string& member) {
  const std::shared_ptr<archive> opened(open_archive(path, name));
  const std::string full = name + ":" + member;
  archive_entry* entry = nullptr;
  while (archive_read_next_header(opened.get(), &entry) == ARCHIVE_OK) {
    const char* const here = archive_entry_pathname(entry);
    if (here != nullptr && member == here) {
      return {full, [opened, full](char* buffer, std::size_t size) {
                const la_ssize_t count = archive_read_data(opened.get(), buffer, size);
                if (count < 0) {
                  throw DataError(full, "the archive is damaged or cut short");
                }
                return static_cast<std::size_t>(count);
              }};
    }
  }
  throw DataError(full, "is not in the archive");
}

std::string text_of(const std::string& path, const std::string& name, const std::string& member) {
  ByteSource bytes = bytes_of(path, name, member);
  std::string text = read_up_to(
      largest_part, [&](char* buffer, std::size_t size) { return bytes.read(buffer, size); });
  if (text.size() == largest_part) {
    throw DataError(name + ":" + member, "unpacks to more than 512 MiB");
  }
  return text;
}

// All arrays of an .npz; those of as many rows are one table.
OpenedFile open_npz(const std::string& path,
                    const std::string& name,
                    const std::vector<std::string>& members) {
  SeriesTables tables;
  std::map<std::string, int> of_stem;
  for (const std::string& member : members) {
    ++of_stem[stem_of(member)];
  }
  for (const std::string& member : members) {
    ByteSource bytes = bytes_of(path, name, member);
    const std::unique_ptr<LogFile::Source> array = open_npy_log(std::move(bytes), {});
    LogBlock all(array->columns.size());
    LogBlock block;
    constexpr std::size_t rows_at_once = 65536;
    while (array->read(block, rows_at_once) > 0) {
      for (std::size_t c = 0; c < all.size(); ++c) {
        all[c].insert(all[c].end(), block[c].begin(), block[c].end());
      }
    }
    const std::size_t rows = all.front().size();
    std::vector<double> values;
    for (const std::vector<double>& column : all) {
      values.insert(values.end(), column.begin(), column.end());
    }
    // With its folders, as NumPy names it, only where they tell it from another.
    const std::string stem = stem_of(member);
    tables.add(of_stem[stem] == 1 ? stem : member.substr(0, member.rfind('.')), rows, all.size(),
               values);
  }
  OpenedFile opened{.format = "npy", .table_name = stem_of(name)};
  opened.table = std::move(tables).largest(name);
  return opened;
}

// Metadata.csv, meta/device.csv and the like say nothing over time.
bool is_metadata(const std::string& member) {
  return member.starts_with("meta/") || member.find("/meta/") != std::string::npos ||
         member.starts_with("__MACOSX") || stem_of(member) == "Metadata" ||
         stem_of(member) == "Annotation" || member.ends_with(".json") || member.ends_with(".png") ||
         member.ends_with(".jpg");
}

}  // namespace

OpenedFile open_zip(const std::string& path, const std::string& name) {
  const std::vector<std::string> members = members_of(path, name);
  const auto has = [&](std::string_view member) {
    return std::find(members.begin(), members.end(), member) != members.end();
  };
  if (has("xl/workbook.xml")) {
    const std::string text = csv_of_workbook(name, [&](const std::string& part) {
      return has(part) ? text_of(path, name, part) : std::string();
    });
    OpenedFile opened{.format = "xlsx", .table_name = stem_of(name)};
    opened.text = bytes_of_text(name, text);
    return opened;
  }
  const bool is_npz = !members.empty() &&
                      std::all_of(members.begin(), members.end(), [](const std::string& member) {
                        return member.ends_with(".npy");
                      });
  if (is_npz) {
    return open_npz(path, name, members);
  }
  std::vector<OpenedFile> opened;
  std::vector<std::string> good;
  std::string why;
  for (const std::string& member : members) {
    if (is_metadata(member)) {
      continue;
    }
    try {
      OpenedFile one = open_recording(bytes_of(path, name, member));
      read_table(one, {});  // what holds no numbers is passed over
      good.push_back(member);
      opened.push_back(std::move(one));
    } catch (const DataError& error) {
      why = error.what();
    }
  }
  if (opened.empty()) {
    throw DataError(name, members.empty() ? "the zip archive is empty or damaged"
                          : why.empty()
                              ? "the zip archive holds no table and no log: " + joined(members)
                              : "the zip archive holds nothing that can be read; the last: " + why);
  }
  if (opened.size() == 1) {  // once more, as its cells may be asked for
    return open_recording(bytes_of(path, name, good.front()));
  }
  return joined_recordings(std::move(opened));
}
#else
OpenedFile open_zip(const std::string&, const std::string& name) {
  throw DataError(name,
                  "is a zip archive, and this axiscal was built without libarchive; unpack it");
}
#endif

}  // namespace axiscal
