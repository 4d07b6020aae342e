// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/output_file.hpp"

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include <climits>
#include <fcntl.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

#include "axiscal/core/error.hpp"

namespace axiscal {
namespace {

// The temporary file that a signal handler must remove. One at a time is all that the command has.
std::array<char, PATH_MAX> unfinished_path;
std::atomic<bool> unfinished = false;

void announce_unfinished(const std::string& path) {
  if (path.size() < unfinished_path.size() && !unfinished) {
    std::memcpy(unfinished_path.data(), path.c_str(), path.size() + 1);
    unfinished = true;
  }
}

void withdraw_unfinished(const std::string& path) {
  if (unfinished && path == unfinished_path.data()) {
    unfinished = false;
  }
}

// Where a chain of links ends, whether or not a file is there yet.
std::string followed(std::filesystem::path path) {
  std::error_code none;
  for (int links = 0; links < 40 && std::filesystem::is_symlink(path, none); ++links) {
    path = path.parent_path() / std::filesystem::read_symlink(path, none);  // absolute ones replace
  }
  return path.string();
}

}  // namespace

OutputFile::OutputFile(std::string path, Mode mode) : path_(std::move(path)) {
  if (path_ == "-") {
    descriptor_ = STDOUT_FILENO;
    return;
  }
  struct stat status {};
  const bool exists = ::stat(path_.c_str(), &status) == 0;
  if (exists && S_ISDIR(status.st_mode)) {
    errno = EISDIR;
    fail("cannot be written");
  }
  if (mode == Mode::direct || (exists && !S_ISREG(status.st_mode))) {
    descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (descriptor_ < 0) {
      fail("cannot be written");
    }
    return;
  }
  const std::string target = followed(path_);
  if (std::error_code none; std::filesystem::is_symlink(target, none)) {
    errno = ELOOP;
    fail("cannot be written");
  }
  open_beside(target);
  if (exists && ::fchmod(descriptor_, status.st_mode & 07777U) != 0) {
    fail("cannot be written with the permissions of the earlier file");
  }
}

void OutputFile::open_beside(const std::string& target) {
  // Announced first, so that a signal finds it; created so that the usual permissions hold.
  for (int attempt = 0; attempt < 1000; ++attempt) {
    const std::string name =
        ".axiscal-" + std::to_string(::getpid()) + "-" + std::to_string(attempt);
    temporary_ = (std::filesystem::path(target).parent_path() / name).string();
    announce_unfinished(temporary_);
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor_ >= 0) {
      target_ = target;
      return;
    }
    withdraw_unfinished(temporary_);
    if (errno != EEXIST) {
      break;
    }
  }
  temporary_.clear();
  fail(errno == ENOENT ? "cannot be written: is its folder there?" : "cannot be written");
}

OutputFile::~OutputFile() {
  if (path_ != "-" && descriptor_ >= 0) {
    ::close(descriptor_);
  }
  if (!temporary_.empty()) {
    ::unlink(temporary_.c_str());
    withdraw_unfinished(temporary_);
  }
}

void OutputFile::fail(std::string_view action) const {
  const int reason = errno;
  const std::string name = path_ == "-" ? "standard output" : path_;
  if (reason == EPIPE) {
    throw ClosedPipe(name + ": closed by its reader");
  }
  throw OutputError(name + ": " + std::string(action) + " (" + std::strerror(reason) + ")");
}

void OutputFile::write(std::string_view text) {
  while (!text.empty()) {
    const ssize_t count = ::write(descriptor_, text.data(), text.size());
    if (count < 0 && errno == EINTR) {
      continue;
    }
    if (count < 0) {
      fail("cannot be written");
    }
    text.remove_prefix(static_cast<std::size_t>(count));
    written_ += static_cast<std::size_t>(count);
  }
#ifdef SYNC_FILE_RANGE_WRITE
  // The disk starts on large files while we still compute, so that commit() waits less.
  constexpr std::size_t large = 8U << 20U;
  if (!temporary_.empty() && written_ - handed_to_disk_ >= large) {
    ::sync_file_range(descriptor_, static_cast<off64_t>(handed_to_disk_),
                      static_cast<off64_t>(written_ - handed_to_disk_), SYNC_FILE_RANGE_WRITE);
    handed_to_disk_ = written_;
  }
#endif
}

void OutputFile::commit() {
  if (temporary_.empty()) {
    return;
  }
  if (::fsync(descriptor_) != 0) {
    fail("cannot be written to the disk");
  }
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) {
    fail("cannot be put into its place");
  }
  withdraw_unfinished(temporary_);
  temporary_.clear();
}

void write_whole_file(const std::string& path, std::string_view content) {
  OutputFile file(path);
  file.write(content);
  file.commit();
}

void remove_unfinished_output() noexcept {
  if (unfinished) {
    ::unlink(unfinished_path.data());
  }
}

}  // namespace axiscal
