// SPDX-License-Identifier: Apache-2.0
#include "logs/recordings/src/other_process.hpp"

#include <algorithm>
#include <csignal>
#include <cstring>
#include <string_view>
#include <vector>

#include <sys/wait.h>

#include "axiscal/core/error.hpp"
#include "core/child_program.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

struct Outcome {
  std::string text;
  int status = 0;  // exit status from waitpid()
};

Outcome ask_another_process(const std::string& path, const char* format, const ReadBudget& budget) {
  constexpr double bytes_a_second = 1U << 20U;
  constexpr double least_s = 4.0;
  ChildProgram child(reader_program,
                     {format, formatted("{:.0f}", budget.left(ReadCost::memory)),
                      formatted("{:.0f}", least_s + budget.file_bytes() / bytes_a_second)},
                     {.input_file = path, .hides_errors = true});
  Outcome outcome{.text = child.read_all()};
  outcome.status = child.wait();
  return outcome;
}

// Parses the answer of the program axiscal-read. The answer is not trusted, because a damaged file
// may have caused the program to fail.
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
