// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/output_file.hpp"

#include <cerrno>
#include <csignal>
#include <cstring>
#include <dirent.h>
#include <filesystem>
#include <memory>
#include <mutex>
#include <set>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/input_protection.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/descriptor.hpp"
#include "core/formatted.hpp"
#include "core/redirected_streams.hpp"
#include "core/unfinished_names.hpp"

namespace axiscal {
namespace {

// Returns the target of a chain of symbolic links. The target need not exist.
std::string followed(std::filesystem::path path) {
  std::error_code none;
  for (int links = 0; links < 40 && std::filesystem::is_symlink(path, none); ++links) {
    // If the link's target is an absolute path, operator/ returns only the target.
    path = path.parent_path() / std::filesystem::read_symlink(path, none);
  }
  return path.string();
}

// The name of a temporary file contains the id of the process that writes it. That process also
// holds a lock on the file.
constexpr std::string_view temporary_prefix = ".axiscal-";

std::string temporary_name(int attempt) {
  return formatted("{}{}-{}", temporary_prefix, ::getpid(), attempt);
}

// Returns the process id in the name of a temporary file; 0 if the file is not such a file.
pid_t process_in(std::string_view name) {
  if (!name.starts_with(temporary_prefix)) {
    return 0;
  }
  const std::string_view rest = name.substr(temporary_prefix.size());
  const std::size_t parting = rest.find('-');
  if (parting == std::string_view::npos) {
    return 0;
  }
  const std::optional<int> process = parse_integer(rest.substr(0, parting));
  const std::optional<int> attempt = parse_integer(rest.substr(parting + 1));
  return process && attempt && *process > 0 ? *process : 0;
}

// True if a killed process left the file: the process in its name does not exist, we own the file,
// and its lock is free. The lock protects the files of a running process in another container that
// shares the folder.
bool is_orphan(const std::filesystem::path& path) {
  const pid_t process = process_in(path.filename().string());
  if (process == 0 || ::kill(process, 0) == 0 || errno != ESRCH) {
    return false;
  }
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) {
    return false;
  }
  struct stat status {};
  const bool orphan = ::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode) &&
                      status.st_uid == ::geteuid() && ::flock(descriptor, LOCK_EX | LOCK_NB) == 0;
  ::close(descriptor);
  return orphan;
}

// Removes the temporary files that killed processes left in a folder. Each process searches a
// folder only once.
void remove_orphans(const std::filesystem::path& folder) {
  static std::mutex mutex;
  static std::set<std::string> seen;
  {
    const std::lock_guard lock(mutex);
    if (!seen.insert(folder.string()).second) {
      return;
    }
  }
  // readdir() is used because std::filesystem makes a path for each file. In a folder with
  // thousands of files that takes longer than writing the output.
  const std::unique_ptr<DIR, int (*)(DIR*)> all(::opendir(folder.c_str()), ::closedir);
  for (const dirent* entry = nullptr; all && (entry = ::readdir(all.get())) != nullptr;) {
    if (process_in(entry->d_name) != 0 && is_orphan(folder / entry->d_name)) {
      ::unlink((folder / entry->d_name).c_str());
    }
  }
}

// Returns a path by which linkat() can give a name to an open file that has none.
std::string link_of(int descriptor) {
  return formatted("/proc/self/fd/{}", descriptor);
}

}  // namespace

OutputFile::OutputFile(std::string path, Mode mode) : path_(std::move(path)) {
  if (path_ == "-" && RedirectedStreams::current() != nullptr) {
    return;
  }
  if (path_ == "-") {
    descriptor_ = STDOUT_FILENO;
    forbid_replacing_input(descriptor_, "standard output");
    return;
  }
  struct stat status {};
  const bool exists = ::stat(path_.c_str(), &status) == 0;
  if (exists && S_ISDIR(status.st_mode)) {
    errno = EISDIR;
    fail("cannot be written");
  }
  forbid_replacing_input(path_);
  if (mode == Mode::direct || (exists && !S_ISREG(status.st_mode))) {
    descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (descriptor_ < 0) {
      fail("cannot be written");
    }
    return;
  }
  // A rename needs write permission only for the folder, so the file's own permission is checked
  // here.
  if (exists && ::faccessat(AT_FDCWD, path_.c_str(), W_OK, AT_EACCESS) != 0) {
    fail("cannot be written");
  }
  target_ = followed(path_);
  if (target_.empty()) {
    errno = ENOENT;
    fail("cannot be written");
  }
  if (std::error_code none; std::filesystem::is_symlink(target_, none)) {
    errno = ELOOP;
    fail("cannot be written");
  }
  open_unnamed();
  if (descriptor_ < 0) {
    open_beside();
  }
  if (exists && ::fchmod(descriptor_, status.st_mode & 07777U) != 0) {
    const int reason = errno;
    discard();
    errno = reason;
    fail("cannot be given the permissions of the file that it replaces");
  }
}

std::filesystem::path OutputFile::folder() const {
  const std::filesystem::path parent = std::filesystem::path(target_).parent_path();
  return parent.empty() ? "." : parent;
}

// A file without a name disappears when its process ends, even if the process is killed.
void OutputFile::open_unnamed() {
  remove_orphans(folder());
#ifdef O_TMPFILE
  descriptor_ = ::open(folder().c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);
  if (descriptor_ >= 0 && ::access(link_of(descriptor_).c_str(), F_OK) != 0) {
    ::close(descriptor_);  // without /proc the file could not be named later
    descriptor_ = -1;
  }
#endif
}

// Creates a file with a temporary name. `make` receives the path and returns true if it created the
// file; otherwise it sets errno as open() does. The path is registered first, so that the signal
// handler can remove the file.
template <typename Make>
bool OutputFile::make_temporary(const Make& make) {
  for (int attempt = 0; attempt < 1000; ++attempt) {
    temporary_ = (folder() / temporary_name(attempt)).string();
    register_unfinished_file(temporary_);
    if (make(temporary_)) {
      return true;
    }
    const int reason = errno;
    unregister_unfinished_file(temporary_);
    temporary_.clear();
    errno = reason;
    if (reason != EEXIST) {
      return false;
    }
  }
  return false;
}

void OutputFile::open_beside() {
  // open() creates the file with the usual permissions. Before the file is locked, a program in
  // another container may remove it as an orphan. Then another name is tried.
  const bool made = make_temporary([&](const std::string& name) {
    descriptor_ = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor_ < 0) {
      return false;
    }
    ::flock(descriptor_, LOCK_EX | LOCK_NB);
    if (::access(name.c_str(), F_OK) != 0) {
      ::close(std::exchange(descriptor_, -1));
      errno = EEXIST;
      return false;
    }
    return true;
  });
  if (!made) {
    fail(errno == ENOENT ? "cannot be written, because its folder does not exist"
                         : "cannot be written");
  }
}

OutputFile::~OutputFile() {
  discard();
}

void OutputFile::discard() noexcept {
  if (path_ != "-" && descriptor_ >= 0) {
    ::close(descriptor_);
  }
  if (!temporary_.empty()) {
    ::unlink(temporary_.c_str());
    unregister_unfinished_file(temporary_);
  }
}

void OutputFile::fail(std::string_view action) const {
  const int reason = errno;
  const std::string name = path_ == "-" ? "standard output" : path_;
  if (reason == EPIPE) {
    throw ClosedPipe(name + ": was closed by the program that reads it");
  }
  throw OutputError(formatted("{}: {} ({})", name, action, std::strerror(reason)));
}

void OutputFile::rewrite_start(std::string_view text) {
  if (::pwrite(descriptor_, text.data(), text.size(), 0) != static_cast<ssize_t>(text.size())) {
    fail("the header of the output cannot be rewritten: write to a regular file");
  }
}

void OutputFile::write(std::string_view text) {
  if (path_ == "-" && RedirectedStreams::current() != nullptr) {
    RedirectedStreams::current()->output += text;
    return;
  }
  if (!write_all(descriptor_, text)) {
    fail("cannot be written");
  }
  written_ += text.size();
#ifdef SYNC_FILE_RANGE_WRITE
  // Starts to write a large file to the disk before commit(), so that commit() waits less.
  constexpr std::size_t large = 8U << 20U;
  if (!target_.empty() && written_ - handed_to_disk_ >= large) {
    ::sync_file_range(descriptor_, static_cast<off_t>(handed_to_disk_),
                      static_cast<off_t>(written_ - handed_to_disk_), SYNC_FILE_RANGE_WRITE);
    handed_to_disk_ = written_;
  }
#endif
}

void OutputFile::commit() {
  if (target_.empty()) {
    return;
  }
  if (::fsync(descriptor_) != 0) {
    fail("cannot be written to the disk");
  }
  forbid_replacing_input(target_);  // the target may have been read since the constructor's check
  if (temporary_.empty()) {
    ::flock(descriptor_, LOCK_EX | LOCK_NB);
    const bool named = make_temporary([&](const std::string& name) {
      return ::linkat(AT_FDCWD, link_of(descriptor_).c_str(), AT_FDCWD, name.c_str(),
                      AT_SYMLINK_FOLLOW) == 0;
    });
    if (!named) {
      fail("cannot be created in its folder");
    }
  }
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) {
    fail("the temporary file cannot be renamed to this name");
  }
  unregister_unfinished_file(temporary_);
  temporary_.clear();
  sync_folder(folder());  // otherwise a power failure may restore the earlier file
  target_.clear();
  protect_output(descriptor_);
}

void write_whole_file(const std::string& path, std::string_view content) {
  OutputFile file(path);
  try {
    file.write(content);
  } catch (const ClosedPipe&) {
    return;
  }
  file.commit();
}

}  // namespace axiscal
