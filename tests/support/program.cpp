// SPDX-License-Identifier: Apache-2.0
#include "program.hpp"

#include <array>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#ifndef AXISCAL_COMMAND
#define AXISCAL_COMMAND ""
#endif

namespace axiscal::test {
namespace {

// Tests run the programs in the build folder, for example axiscal-read.
const bool knows_programs = ::setenv("AXISCAL_LIBEXEC", AXISCAL_PROGRAMS, 0) == 0;

struct Pipe {
  Pipe() {
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
      throw std::runtime_error("pipe failed");
    }
  }
  std::array<int, 2> ends{};
};

std::string drained(int descriptor) {
  std::string text;
  std::array<char, 65536> block{};
  for (ssize_t n = ::read(descriptor, block.data(), block.size()); n > 0;
       n = ::read(descriptor, block.data(), block.size())) {
    text.append(block.data(), static_cast<std::size_t>(n));
  }
  ::close(descriptor);
  return text;
}

void feed(int descriptor, const std::string& text) {
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t n = ::write(descriptor, text.data() + done, text.size() - done);
    if (n <= 0) {
      break;
    }
    done += static_cast<std::size_t>(n);
  }
  ::close(descriptor);
}

}  // namespace

std::string command_path() {
  return AXISCAL_COMMAND;
}

ProgramResult run_axiscal(const std::vector<std::string>& arguments, const ProgramInput& input) {
  std::signal(SIGPIPE, SIG_IGN);
  const Pipe in;
  const Pipe out;
  const Pipe err;
  std::vector<std::string> words = {command_path()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) {
    argv.push_back(word.data());
  }
  argv.push_back(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    ::dup2(in.ends[0], STDIN_FILENO);
    const int target = input.stdout_path.empty()
                           ? out.ends[1]
                           : ::open(input.stdout_path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    ::dup2(target, STDOUT_FILENO);
    ::dup2(err.ends[1], STDERR_FILENO);
    if (input.file_size_limit) {
      const rlimit limit{*input.file_size_limit, *input.file_size_limit};
      ::setrlimit(RLIMIT_FSIZE, &limit);
    }
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  ::close(in.ends[0]);
  ::close(out.ends[1]);
  ::close(err.ends[1]);
  ProgramResult result;
  std::thread writer([&] { feed(in.ends[1], input.stdin_text); });
  std::thread errors([&] { result.err = drained(err.ends[0]); });
  result.out = drained(out.ends[0]);
  errors.join();
  writer.join();
  int status = 0;
  ::waitpid(child, &status, 0);
  result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result;
}

ScratchFolder::ScratchFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "axiscal-test-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) {
    throw std::runtime_error("mkdtemp failed");
  }
  path_ = name;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::string ScratchFolder::write(const std::string& name, const std::string& content) const {
  std::ofstream(path(name), std::ios::binary) << content;
  return path(name);
}

std::size_t ScratchFolder::file_count() const {
  const std::filesystem::directory_iterator files(path_);
  return static_cast<std::size_t>(std::distance(begin(files), end(files)));
}

std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

nlohmann::json read_json(const std::string& path) {
  return nlohmann::json::parse(read_file(path));
}

std::vector<std::vector<std::string>> csv_cells(const std::string& text) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> cells;
    std::size_t from = 0;
    for (;;) {
      const std::size_t comma = line.find(',', from);
      cells.push_back(line.substr(from, comma - from));
      if (comma == std::string::npos) {
        break;
      }
      from = comma + 1;
    }
    rows.push_back(cells);
  }
  return rows;
}

}  // namespace axiscal::test
