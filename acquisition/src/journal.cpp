// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/journal.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "axiscal/acquisition/settings.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/input_protection.hpp"
#include "core/descriptor.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"

namespace axiscal {
namespace {

std::string reason() {
  return std::strerror(errno);
}

void lock(const std::string& path, int descriptor) {
  if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
    throw OutputError(path + ": another session is writing this journal");
  }
}

// The largest length of a line of a journal [bytes]. It is large because all raw samples that
// waited while the disk was full are written in one line.
constexpr std::size_t longest_entry = 64U << 20U;

// Checks that a file is a journal, because Journal::open() must not shorten any other file.
void check_first_line(const std::string& path, std::string_view line) {
  parse_json(line, path).require_format(journal_format);
}

}  // namespace

Journal::Journal(std::string path, int descriptor, long long size)
    : path_(std::move(path)), descriptor_(descriptor), size_(size) {}

Journal::Journal(Journal&& other) noexcept
    : path_(std::move(other.path_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      size_(other.size_) {}

Journal::~Journal() {
  if (descriptor_ >= 0) {
    ::close(descriptor_);
  }
}

Journal Journal::create(const std::string& path) {
  const int descriptor =
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0600);
  if (descriptor < 0) {
    if (errno == EEXIST) {
      throw OutputError(path +
                            ": this journal exists already; resume its session, or choose "
                            "another name",
                        {settings::resume, settings::journal});
    }
    throw OutputError(formatted("{}: cannot be created: {}", path, reason()));
  }
  Journal journal(path, descriptor, 0);
  lock(path, descriptor);
  protect_input(descriptor);
  // The name of a new file is on the disk only after its folder was synchronised.
  sync_folder(std::filesystem::absolute(path).parent_path());
  return journal;
}

Journal Journal::open(const std::string& path, std::vector<std::string>& lines) {
  if (std::error_code none;
      std::filesystem::exists(path, none) && !std::filesystem::is_regular_file(path, none)) {
    throw DataError(path, "is not a journal: it is not a regular file");
  }
  static_cast<void>(InputFile(path));  // throws an error with the reason if the file cannot be read
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (descriptor < 0) {
    throw OutputError(formatted("{}: cannot be written: {}", path, reason()));
  }
  Journal journal(path, descriptor, 0);
  lock(path, descriptor);
  lines.clear();
  bool is_cut = false;
  for_each_line(
      path,
      [&](std::string_view line, bool is_whole) {
        is_cut = !is_whole;
        if (is_whole) {
          if (lines.empty()) {
            check_first_line(path, line);
          }
          lines.emplace_back(line);
          journal.size_ += static_cast<long long>(line.size()) + 1;
        }
      },
      longest_entry);
  // A file with an incomplete first line is not a journal of Axiscal; it stays unchanged.
  if (lines.empty()) {
    throw DataError(path, "is not a journal: its first line is missing or incomplete");
  }
  if (is_cut && ::ftruncate(descriptor, journal.size_) != 0) {
    throw OutputError(
        formatted("{}: the last line is incomplete and cannot be removed: {}", path, reason()));
  }
  return journal;
}

std::string Journal::append(std::string_view line) {
  return write(line, true);
}

std::string Journal::append_without_sync(std::string_view line) {
  return write(line, false);
}

std::string Journal::write(std::string_view line, bool wait) {
  std::string text(line);
  text += '\n';
  if (!write_all(descriptor_, text)) {
    std::string why = formatted("{}: {}", path_, reason());
    if (::ftruncate(descriptor_, size_) != 0) {
      why += "; an incomplete line remains at the end of the file";
    }
    return why;
  }
  if (wait && ::fsync(descriptor_) != 0) {
    std::string why = formatted("{}: {}", path_, reason());
    if (::ftruncate(descriptor_, size_) != 0) {
      why += "; the last line of the file may not be on the disk";
    }
    return why;
  }
  size_ += static_cast<long long>(text.size());
  return "";
}

}  // namespace axiscal
