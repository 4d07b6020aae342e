// SPDX-License-Identifier: Apache-2.0
#include "other_process.hpp"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/input_file.hpp"

namespace axiscal {
namespace {

void append_bytes(std::string& text, const void* bytes, std::size_t size) {
  text.append(static_cast<const char*>(bytes), size);
}

void append_size(std::string& text, std::size_t size) {
  append_bytes(text, &size, sizeof size);
}

// What the process answers: '1', names and columns, or '0' and why there are none.
std::string answer_of(const std::string& path, SeriesTables (*read)(const std::string& path)) {
  SeriesTables::Table table;
  try {
    table = read(path).take_largest("");
  } catch (const DataError& error) {
    return std::string("0") + (error.what() + 2);  // without the empty path
  } catch (const Error& error) {
    return std::string("0") + error.what();
  }
  std::string text = "1";
  append_size(text, table.names.size());
  append_size(text, table.data.front().size());
  for (std::size_t c = 0; c < table.names.size(); ++c) {
    append_size(text, table.names[c].size());
    text += table.names[c];
    append_bytes(text, table.data[c].data(), table.data[c].size() * sizeof(double));
  }
  return text;
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool has_shadow_memory = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
constexpr bool has_shadow_memory = true;
#else
constexpr bool has_shadow_memory = false;
#endif
#else
constexpr bool has_shadow_memory = false;
#endif

// Bytes of address space that this process has.
std::size_t address_space() {
  const std::string text = read_whole_file("/proc/self/statm");
  return static_cast<std::size_t>(std::strtoull(text.c_str(), nullptr, 10)) *
         static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

// @param memory  that it may have [bytes of address space]; @param seconds  of the processor.
[[noreturn]] void answer_and_exit(const std::string& path,
                                  SeriesTables (*read)(const std::string& path),
                                  int descriptor,
                                  rlim_t memory,
                                  rlim_t seconds) try {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // nobody else wants the answer
  // Nobody is to hear of what goes wrong here but by our silence.
  for (const int signal : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGTERM, SIGINT, SIGPIPE}) {
    std::signal(signal, SIG_DFL);
  }
  const int nowhere = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  ::dup2(nowhere, STDOUT_FILENO);
  ::dup2(nowhere, STDERR_FILENO);
  if (!has_shadow_memory) {
    const rlimit space{memory, memory};
    ::setrlimit(RLIMIT_AS, &space);
  }
  const rlimit time{seconds, seconds};
  ::setrlimit(RLIMIT_CPU, &time);
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  const std::string text = answer_of(path, read);
  for (std::string_view rest = text; !rest.empty();) {
    const ssize_t count = ::write(descriptor, rest.data(), rest.size());
    if (count <= 0) {
      ::_exit(1);
    }
    rest.remove_prefix(static_cast<std::size_t>(count));
  }
  ::_exit(0);
} catch (...) {
  ::_exit(1);
}

// Runs it; nothing where it died, as it took more memory or time than any good file does.
std::optional<std::string> ask_another_process(const std::string& path,
                                               SeriesTables (*read)(const std::string& path),
                                               std::size_t file_size) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw DataError(path, std::string("cannot be read: ") + std::strerror(errno));
  }
  constexpr std::size_t basis = 256U << 20U;
  constexpr std::size_t by_packing = 200;  // numbers are packed, and held several times
  const rlim_t memory = address_space() + basis + by_packing * file_size;
  constexpr rlim_t basis_s = 60;
  constexpr std::size_t bytes_a_second = 1U << 20U;
  const rlim_t seconds = basis_s + file_size / bytes_a_second;
  const pid_t child = ::fork();
  if (child == 0) {
    ::close(ends[0]);
    answer_and_exit(path, read, ends[1], memory, seconds);
  }
  ::close(ends[1]);
  std::string text;
  std::vector<char> block(1U << 16U);
  bool whole = child > 0;
  while (whole) {
    const ssize_t count = ::read(ends[0], block.data(), block.size());
    if (count < 0 && errno == EINTR) {
      continue;
    }
    if (count <= 0) {
      whole = count == 0;
      break;
    }
    text.append(block.data(), static_cast<std::size_t>(count));
  }
  ::close(ends[0]);
  int status = 0;
  if (child > 0) {
    if (!whole) {
      ::kill(child, SIGKILL);
    }
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
  }
  return whole && WIFEXITED(status) && WEXITSTATUS(status) == 0 ? std::optional(text)
                                                                : std::nullopt;
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

std::unique_ptr<LogFile::Source> read_in_another_process(
    const std::string& path,
    const std::string& name,
    SeriesTables (*read)(const std::string& path),
    const char* kind) {
  std::error_code none;
  const std::optional<std::string> text = ask_another_process(
      path, read, static_cast<std::size_t>(std::filesystem::file_size(path, none)));
  if (!text || text->empty()) {
    throw DataError(name,
                    formatted("the {} is damaged, or its variables are far larger than it", kind));
  }
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

}  // namespace axiscal
