// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/input_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/input_protection.hpp"
#include "core/formatted.hpp"
#include "core/redirected_streams.hpp"

namespace axiscal {

InputFile::InputFile(std::string path) : path_(std::move(path)) {
  if (path_ == "-" && RedirectedStreams::current() != nullptr) {
    return;
  }
  descriptor_ = path_ == "-" ? STDIN_FILENO : ::open(path_.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0) {
    throw DataError(path_, errno == ENOENT ? "no such file" : std::strerror(errno));
  }
  struct stat status {};
  if (::fstat(descriptor_, &status) == 0) {
    if (S_ISDIR(status.st_mode)) {
      if (path_ != "-") {
        ::close(descriptor_);
      }
      throw DataError(path_, "is a directory, not a file");
    }
    size_ = S_ISREG(status.st_mode) ? static_cast<std::size_t>(status.st_size) : 0;
    protect_input(status);
  }
}

InputFile::~InputFile() {
  if (path_ != "-") {
    ::close(descriptor_);
  }
}

std::size_t InputFile::read(char* buffer, std::size_t size) {
  if (path_ == "-" && RedirectedStreams::current() != nullptr) {
    return RedirectedStreams::current()->read(buffer, size);
  }
  for (;;) {
    const ssize_t count = ::read(descriptor_, buffer, size);
    if (count >= 0) {
      return static_cast<std::size_t>(count);
    }
    if (errno != EINTR) {
      throw DataError(path_, std::string("cannot be read: ") + std::strerror(errno));
    }
  }
}

bool can_be_read_again(const std::string& path) {
  std::error_code none;
  return path != "-" && std::filesystem::is_regular_file(path, none);
}

std::string read_whole_file(const std::string& path) {
  InputFile file(path);
  std::string content;
  std::size_t size = 0;
  // There is room for one byte more than the file's size, so that the first read shows whether the
  // file has grown.
  std::size_t room = std::min(file.size(), largest_whole_file) + 1;
  for (;;) {
    content.resize(size + room);
    const std::size_t count = file.read(content.data() + size, room);
    size += count;
    if (size > largest_whole_file) {
      throw DataError(path, "is larger than 256 MiB, the limit for files of this kind");
    }
    if (count == 0 || size == file.size()) {
      content.resize(size);
      return content;
    }
    room = std::size_t{1} << 16U;
  }
}

void for_each_line(const std::string& path,
                   const std::function<void(std::string_view line, bool is_whole)>& take,
                   std::size_t longest) {
  InputFile file(path);
  std::string line;  // the part of the current line read so far
  std::size_t number = 1;
  std::vector<char> block(1U << 16U);
  for (std::size_t count = file.read(block.data(), block.size()); count > 0;
       count = file.read(block.data(), block.size())) {
    std::string_view rest(block.data(), count);
    for (std::size_t end = rest.find('\n'); end != std::string_view::npos; end = rest.find('\n')) {
      line += rest.substr(0, end);
      take(line, true);
      line.clear();
      rest.remove_prefix(end + 1);
      ++number;
    }
    line += rest;
    if (line.size() > longest) {
      throw DataError(
          path, number,
          formatted("a line of more than {} MiB: is this a text file?", longest >> 20U));
    }
  }
  if (!line.empty()) {
    take(line, false);
  }
}

}  // namespace axiscal
