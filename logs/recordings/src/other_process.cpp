// SPDX-License-Identifier: Apache-2.0
#include "logs/recordings/src/other_process.hpp"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <optional>
#include <spawn.h>
#include <string_view>
#include <vector>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "axiscal/core/error.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Starts the program; its standard output is the pipe's end.
std::optional<pid_t> start(const std::string& path,
                           const char* format,
                           const std::string& memory,
                           const std::string& seconds,
                           int output) {
  const std::string program = own_program(reader_program);
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, path.c_str(), O_RDONLY, 0);
  ::posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
  ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  const std::array<std::string, 4> words = {program, format, memory, seconds};
  std::array<char*, words.size() + 1> arguments{};
  for (std::size_t i = 0; i < words.size(); ++i) {
    arguments[i] = const_cast<char*>(words[i].c_str());
  }
  pid_t child = 0;
  const int status =
      ::posix_spawn(&child, program.c_str(), &actions, nullptr, arguments.data(), ::environ);
  ::posix_spawn_file_actions_destroy(&actions);
  return status == 0 ? std::optional(child) : std::nullopt;
}

struct Outcome {
  std::string text;
  int status = 0;  // in the form of waitpid()
};

Outcome ask_another_process(const std::string& path, const char* format, const ReadBudget& budget) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw DataError(path, std::string("cannot be read: ") + std::strerror(errno));
  }
  constexpr double bytes_a_second = 1U << 20U;
  constexpr double least_s = 4.0;
  const std::optional<pid_t> child =
      start(path, format, formatted("{:.0f}", budget.left(ReadCost::memory)),
            formatted("{:.0f}", least_s + budget.file_bytes() / bytes_a_second), ends[1]);
  ::close(ends[1]);
  Outcome outcome;
  std::vector<char> block(1U << 16U);
  ssize_t count = 1;
  while (child && (count > 0 || (count < 0 && errno == EINTR))) {
    count = ::read(ends[0], block.data(), block.size());
    if (count > 0) {
      outcome.text.append(block.data(), static_cast<std::size_t>(count));
    }
  }
  ::close(ends[0]);
  if (!child) {
    throw RefusedError(std::string(reader_program.name) + " cannot be started");
  }
  while (::waitpid(*child, &outcome.status, 0) < 0 && errno == EINTR) {
  }
  return outcome;
}

// Takes the answer apart; it is ours, but its process may have gone astray before it.
class Answer {
 public:
  explicit Answer(std::string_view text) : rest_(text) {}

  std::size_t size() {
    std::size_t value = 0;
    std::memcpy(&value, bytes(sizeof value).data(), sizeof value);
    return value;
  }

  std::string_view bytes(std::size_t count) {
    if (count > rest_.size()) {
      throw DomainError("too short");
    }
    const std::string_view taken = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return taken;
  }

 private:
  std::string_view rest_;
};

}  // namespace

std::unique_ptr<LogFile::Source> read_in_another_process(const std::string& path,
                                                         const std::string& name,
                                                         const char* format,
                                                         const ReadBudget& budget) {
  const std::string kind = format == std::string_view("hdf5") ? "HDF5 file" : ".mat file";
  const Outcome outcome = ask_another_process(path, format, budget);
  const int status = outcome.status;
  if (WIFEXITED(status) && WEXITSTATUS(status) == reader_lacks_memory) {
    budget.fail(ReadCost::memory);
  }
  if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL)) {
    budget.fail(ReadCost::steps);
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != reader_answered || outcome.text.empty()) {
    throw DataError(name, formatted("the {} is damaged", kind));
  }
  const std::string* const text = &outcome.text;
  if (text->front() == '0') {
    throw DataError(name, text->substr(1));
  }
  try {
    Answer answer(std::string_view(*text).substr(1));
    const std::size_t columns = answer.size();
    const std::size_t rows = std::min(answer.size(), text->size());
    std::vector<std::string> names;
    LogBlock data;
    for (std::size_t c = 0; c < columns; ++c) {
      names.emplace_back(answer.bytes(answer.size()));
      const std::string_view numbers = answer.bytes(rows * sizeof(double));
      data.emplace_back(rows);
      std::memcpy(data.back().data(), numbers.data(), numbers.size());
    }
    return std::make_unique<LogInMemory>(std::move(names), std::move(data));
  } catch (const DomainError&) {
    throw DataError(name, formatted("the {} is damaged", kind));
  }
}

std::unique_ptr<LogFile::Source> open_mat73_log(const std::string& path,
                                                const std::string& name,
                                                const ReadBudget& budget) {
  return read_in_another_process(path, name, "mat73", budget);
}

std::unique_ptr<LogFile::Source> open_hdf5_log(const std::string& path,
                                               const std::string& name,
                                               const ReadBudget& budget) {
  return read_in_another_process(path, name, "hdf5", budget);
}

}  // namespace axiscal
