// SPDX-License-Identifier: Apache-2.0
#include "core/child_program.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <spawn.h>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "axiscal/core/error.hpp"
#include "core/descriptor.hpp"
#include "core/formatted.hpp"

namespace axiscal {

ChildProgram::ChildProgram(const OwnProgram& program,
                           const std::vector<std::string>& arguments,
                           const Streams& streams) {
  std::string file = own_program(program);
  const auto fail = [&](int error) {
    throw RefusedError(formatted("{} cannot be started: {}", file, std::strerror(error)));
  };
  const bool writes = streams.pipe == Pipe::standard_input;
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
    fail(errno);
  }
  const int own = ends[writes ? 1 : 0];
  const int others = ends[writes ? 0 : 1];
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, others, writes ? STDIN_FILENO : STDOUT_FILENO);
  if (!streams.input_file.empty()) {
    ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, streams.input_file.c_str(), O_RDONLY,
                                       0);
  }
  if (streams.hides_errors) {
    ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  }
  std::vector<std::string> words = arguments;
  std::vector<char*> argv = {file.data()};
  for (std::string& word : words) {
    argv.push_back(word.data());
  }
  argv.push_back(nullptr);
  const int failure = ::posix_spawn(&pid_, file.c_str(), &actions, nullptr, argv.data(), ::environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(others);
  if (failure != 0) {
    ::close(own);
    fail(failure);
  }
  pipe_ = own;
}

ChildProgram::~ChildProgram() {
  static_cast<void>(wait());
}

bool ChildProgram::write(std::string_view bytes) const {
  return write_all(pipe_, bytes);
}

std::size_t ChildProgram::read(char* buffer, std::size_t size) const {
  ssize_t count = ::read(pipe_, buffer, size);
  while (count < 0 && errno == EINTR) {
    count = ::read(pipe_, buffer, size);
  }
  return count > 0 ? static_cast<std::size_t>(count) : 0;
}

std::string ChildProgram::read_all() const {
  std::string text;
  std::vector<char> block(1U << 16U);
  for (std::size_t count = read(block.data(), block.size()); count > 0;
       count = read(block.data(), block.size())) {
    text.append(block.data(), count);
  }
  return text;
}

int ChildProgram::wait() {
  if (pipe_ >= 0) {
    ::close(pipe_);
    pipe_ = -1;
    while (::waitpid(pid_, &status_, 0) < 0 && errno == EINTR) {
    }
  }
  return status_;
}

}  // namespace axiscal
