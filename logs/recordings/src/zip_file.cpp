// SPDX-License-Identifier: Apache-2.0
// Zip archives: NumPy's .npz, spreadsheets, and archives of tables that apps on phones write.
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"
#include "logs/recordings/src/opened.hpp"

#ifdef AXISCAL_MINIZIP
#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <minizip/unzip.h>

#include <sys/stat.h>
#endif

namespace axiscal {

#ifdef AXISCAL_MINIZIP
namespace {

using Archive = std::shared_ptr<void>;

Archive open_archive(const std::string& path, const std::string& name) {
  void* const opened = unzOpen64(path.c_str());
  if (opened == nullptr) {
    throw DataError(name, "the zip archive is damaged");
  }
  return {opened, unzClose};
}

struct Member {
  std::string name;
  bool is_file = true;  // false for a folder, a link or a device
  bool is_encrypted = false;
};

Member current_member(const Archive& archive, const std::string& name) {
  unz_file_info64 info{};
  constexpr std::size_t longest = std::numeric_limits<std::uint16_t>::max();
  Member member{.name = std::string(longest, '\0')};
  if (unzGetCurrentFileInfo64(archive.get(), &info, member.name.data(), longest, nullptr, 0,
                              nullptr, 0) != UNZ_OK) {
    throw DataError(name, "the zip archive is damaged");
  }
  member.name.resize(std::min<std::size_t>(info.size_filename, longest));
  // The attributes of some archives contain permissions, but no file type.
  constexpr unsigned unix_host = 3;
  const auto type = static_cast<mode_t>(info.external_fa >> 16U) & S_IFMT;
  const bool has_type = info.version >> 8U == unix_host && type != 0;
  member.is_file = !member.name.ends_with('/') && (!has_type || S_ISREG(type));
  member.is_encrypted = (info.flag & 1U) != 0;
  return member;
}

std::vector<std::string> members_of(const std::string& path,
                                    const std::string& name,
                                    const ReadBudget& budget) {
  const Archive archive = open_archive(path, name);
  std::vector<std::string> members;
  for (int status = unzGoToFirstFile(archive.get()); status == UNZ_OK;
       status = unzGoToNextFile(archive.get())) {
    budget.spend(ReadCost::members, 1.0);
    Member member = current_member(archive, name);
    if (member.is_file) {
      members.push_back(std::move(member.name));
    }
  }
  return members;
}

// @return the content of a member of the archive. It is unpacked as it is read.
ByteSource bytes_of(const std::string& path,
                    const std::string& name,
                    const std::string& member,
                    const ReadBudget& budget) {
  const Archive archive = open_archive(path, name);
  const std::string full = name + ":" + member;
  constexpr int by_case = 1;
  if (unzLocateFile(archive.get(), member.c_str(), by_case) != UNZ_OK) {
    throw DataError(full, "is not in the archive");
  }
  if (current_member(archive, name).is_encrypted) {
    throw DataError(full, "is encrypted; unpack it first");
  }
  const char* const damaged = "the archive is damaged or cut short";
  if (unzOpenCurrentFile(archive.get()) != UNZ_OK) {
    throw DataError(full, damaged);
  }
  return {full,
          [archive, full, budget, damaged](char* buffer, std::size_t size) {
            constexpr std::size_t most = 1U << 30U;
            const int count = unzReadCurrentFile(archive.get(), buffer,
                                                 static_cast<unsigned>(std::min(size, most)));
            // At the end of the member, unzCloseCurrentFile() verifies its checksum.
            const bool is_bad = count < 0 || (count == 0 && size > 0 &&
                                              unzCloseCurrentFile(archive.get()) == UNZ_CRCERROR);
            if (is_bad) {
              throw DataError(full, damaged);
            }
            budget.spend(ReadCost::unpacked, static_cast<std::size_t>(count));
            return static_cast<std::size_t>(count);
          },
          budget.within()};
}

// Reads all bytes of a source into memory.
std::string text_of(ByteSource bytes) {
  return read_up_to(std::numeric_limits<std::size_t>::max(), [&](char* buffer, std::size_t size) {
    const std::size_t count = bytes.read(buffer, size);
    bytes.budget().spend(ReadCost::memory, 2 * count);  // a growing string may need twice its size
    return count;
  });
}

// A table whose columns come from several arrays with the same number of rows. The arrays are read
// block by block.
class ArraysAsTable final : public LogFile::Source {
 public:
  void add(const std::string& name, std::unique_ptr<LogFile::Source> array) {
    const std::size_t count = array->columns.size();
    for (std::size_t c = 0; c < count; ++c) {
      places_.push_back({.array = arrays_.size(), .column = c});
      columns.push_back(count == 1 ? name : formatted("{}_{}", name, c + 1));
      selected_.push_back(selected_.size());
    }
    rows = array->rows;
    arrays_.push_back(std::move(array));
  }

  void select(const std::vector<std::size_t>& selected) override { selected_ = selected; }

  std::size_t read(LogBlock& block, std::size_t most) override {
    constexpr std::size_t rows_at_once = 4096;
    const std::size_t wanted = std::min({most, rows_at_once, rows - done_});
    std::vector<LogBlock> parts;
    for (const std::unique_ptr<LogFile::Source>& array : arrays_) {
      parts.push_back(next_rows(*array, wanted));
    }
    block.clear();
    for (const std::size_t column : selected_) {
      block.push_back(parts[places_[column].array][places_[column].column]);
    }
    done_ += wanted;
    return wanted;
  }

 private:
  struct Place {
    std::size_t array, column;
  };

  static LogBlock next_rows(LogFile::Source& array, std::size_t wanted) {
    LogBlock all(array.columns.size());
    LogBlock block;
    for (std::size_t done = 0; done < wanted;) {
      done += array.read(block, wanted - done);
      for (std::size_t c = 0; c < all.size(); ++c) {
        all[c].insert(all[c].end(), block[c].begin(), block[c].end());
      }
    }
    return all;
  }

  std::vector<std::unique_ptr<LogFile::Source>> arrays_;
  std::vector<Place> places_;  // for each column of the table: an array, and a column of that array
  std::vector<std::size_t> selected_;
  std::size_t done_ = 0;
};

// Transposes an array in memory if it has fewer rows than columns, so that its columns are series.
std::unique_ptr<LogFile::Source> upright(std::unique_ptr<LogFile::Source> array,
                                         const std::string& name,
                                         const ReadBudget& budget) {
  if (array->rows >= array->columns.size()) {
    return array;
  }
  budget.spend(ReadCost::memory, array->rows * array->columns.size() * sizeof(double));
  LogBlock data(array->rows);
  LogBlock block;
  for (std::size_t row = 0; row < data.size();) {
    const std::size_t count = array->read(block, data.size() - row);
    for (std::size_t i = 0; i < count; ++i, ++row) {
      for (const std::vector<double>& column : block) {
        data[row].push_back(column[i]);
      }
    }
  }
  return std::make_unique<LogInMemory>(column_names(name, {}, data.size()), std::move(data));
}

// Opens an .npz. Arrays with the same number of rows form one table, and the largest table is read.
OpenedFile open_npz(const std::string& path,
                    const std::string& name,
                    const std::vector<std::string>& members,
                    const ReadBudget& budget) {
  std::map<std::string, int> of_stem;
  std::map<std::size_t, std::vector<std::string>> of_rows;
  // Key: number of rows. Value: number of values in all arrays with this number of rows.
  std::map<std::size_t, double> numbers;
  for (const std::string& member : members) {
    ++of_stem[stem_of(member)];
    const std::unique_ptr<LogFile::Source> array =
        open_npy_log(bytes_of(path, name, member, budget), {});
    const std::size_t rows = std::max(array->rows, array->columns.size());
    of_rows[rows].push_back(member);
    numbers[rows] += static_cast<double>(array->rows) * static_cast<double>(array->columns.size());
  }
  numbers.erase(1);
  const auto largest = std::max_element(
      numbers.begin(), numbers.end(),
      [](const auto& one, const auto& other) { return one.second < other.second; });
  if (largest == numbers.end()) {
    throw DataError(name, "the file contains no column of numbers");
  }
  const std::vector<std::string>& chosen = of_rows[largest->first];
  constexpr std::size_t most_arrays = 500;  // each array opens the archive again
  if (chosen.size() > most_arrays) {
    throw DataError(name,
                    formatted("contains {} arrays of {} rows, but a table may consist of at most "
                              "{} arrays",
                              chosen.size(), largest->first, most_arrays));
  }
  auto table = std::make_unique<ArraysAsTable>();
  for (const std::string& member : chosen) {
    // If arrays in different folders have the same name, their names in the table include the
    // folder.
    const std::string stem = stem_of(member);
    ByteSource bytes = bytes_of(path, name, member, budget);
    table->add(of_stem[stem] == 1 ? stem : member.substr(0, member.rfind('.')),
               upright(open_npy_log(std::move(bytes), {}), name, budget));
  }
  OpenedFile opened{.format = "npy", .table_name = stem_of(name)};
  opened.table = std::move(table);
  return opened;
}

// @return true for members that are not time series, such as Metadata.csv and meta/device.csv.
bool is_metadata(const std::string& member) {
  return member.starts_with("meta/") || member.find("/meta/") != std::string::npos ||
         member.starts_with("__MACOSX") || stem_of(member) == "Metadata" ||
         stem_of(member) == "Annotation" || member.ends_with(".json") || member.ends_with(".png") ||
         member.ends_with(".jpg");
}

}  // namespace

OpenedFile open_zip(const std::string& path, const std::string& name, const ReadBudget& budget) {
  const std::vector<std::string> members = members_of(path, name, budget);
  const auto has = [&](std::string_view member) {
    return std::find(members.begin(), members.end(), member) != members.end();
  };
  if (has("xl/workbook.xml")) {
    const std::string text = csv_of_workbook(
        name,
        [&](const std::string& part) {
          return has(part) ? text_of(bytes_of(path, name, part, budget)) : std::string();
        },
        budget);
    OpenedFile opened{.format = "xlsx", .table_name = stem_of(name)};
    opened.text = bytes_of_text(name, text, budget);
    return opened;
  }
  const bool is_npz = !members.empty() &&
                      std::all_of(members.begin(), members.end(), [](const std::string& member) {
                        return member.ends_with(".npy");
                      });
  if (is_npz) {
    return open_npz(path, name, members, budget);
  }
  std::vector<OpenedFile> opened;
  std::vector<std::string> good;
  std::string why;
  for (const std::string& member : members) {
    if (is_metadata(member)) {
      continue;
    }
    try {
      OpenedFile one = open_recording(bytes_of(path, name, member, budget));
      read_table(one, {});  // members without numbers are skipped
      good.push_back(member);
      opened.push_back(std::move(one));
    } catch (const LimitError&) {
      throw;
    } catch (const DataError& error) {
      why = error.what();
    }
  }
  if (opened.empty()) {
    throw DataError(name, members.empty() ? "the zip archive is empty or damaged"
                          : why.empty()
                              ? "the zip archive contains no table or log; its files "
                                "are: " +
                                    joined(members)
                              : "no file in the zip archive can be read; the error for the last "
                                "file is: " +
                                    why);
  }
  if (opened.size() == 1) {  // opened again, because its cells may be needed as text
    return open_recording(bytes_of(path, name, good.front(), budget));
  }
  return joined_recordings(std::move(opened));
}
#else
OpenedFile open_zip(const std::string&, const std::string& name, const ReadBudget&) {
  throw DataError(
      name,
      "is a zip archive, but this axiscal was built without minizip; unpack the archive first");
}
#endif

}  // namespace axiscal
