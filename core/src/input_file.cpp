// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/input_file.hpp"

#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "axiscal/core/error.hpp"

namespace axiscal {

InputFile::InputFile(std::string path) : path_(std::move(path)) {
  descriptor_ = path_ == "-" ? STDIN_FILENO : ::open(path_.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0) {
    throw DataError(path_, errno == ENOENT ? "no such file" : std::strerror(errno));
  }
  struct stat status {};
  if (::fstat(descriptor_, &status) == 0 && S_ISDIR(status.st_mode)) {
    if (path_ != "-") {
      ::close(descriptor_);
    }
    throw DataError(path_, "is a directory, not a file");
  }
}

InputFile::~InputFile() {
  if (path_ != "-") {
    ::close(descriptor_);
  }
}

std::size_t InputFile::read(char* buffer, std::size_t size) {
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

std::string read_whole_file(const std::string& path) {
  InputFile file(path);
  std::string content;
  std::vector<char> block(1U << 16U);
  for (std::size_t count = file.read(block.data(), block.size()); count > 0;
       count = file.read(block.data(), block.size())) {
    content.append(block.data(), count);
  }
  return content;
}

}  // namespace axiscal
