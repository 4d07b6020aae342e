// SPDX-License-Identifier: Apache-2.0
// MATLAB's .mat files of version 7.3, which are HDF5, through matio. Neither is safe with damaged
// files (a failed allocation is not looked at, sizes are believed), so they run in a process of
// their own: what happens there is an answer or none, and its memory is in proportion to the file.
#include "axiscal/core/error.hpp"
#include "log_source.hpp"

#ifdef AXISCAL_MATIO
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <matio.h>
#include <optional>
#include <string_view>

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "axiscal/core/formatted.hpp"
#include "axiscal/core/input_file.hpp"
#include "series_tables.hpp"
#endif

namespace axiscal {

#ifdef AXISCAL_MATIO
namespace {

struct CloseFile {
  void operator()(mat_t* file) const { Mat_Close(file); }
};
struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};

template <typename Number>
std::vector<double> doubles_of(const matvar_t& variable, std::size_t count) {
  const auto* const data = static_cast<const Number*>(variable.data);
  return std::vector<double>(data, data + count);
}

// Empty for what is no array of real numbers.
std::vector<double> values_of(const matvar_t& variable, std::size_t count) {
  if (variable.isComplex != 0 || variable.data == nullptr ||
      variable.nbytes != count * static_cast<std::size_t>(variable.data_size)) {
    return {};
  }
  switch (variable.class_type) {
    case MAT_C_DOUBLE:
      return doubles_of<double>(variable, count);
    case MAT_C_SINGLE:
      return doubles_of<float>(variable, count);
    case MAT_C_INT64:
      return doubles_of<std::int64_t>(variable, count);
    case MAT_C_UINT64:
      return doubles_of<std::uint64_t>(variable, count);
    case MAT_C_INT32:
      return doubles_of<std::int32_t>(variable, count);
    case MAT_C_UINT32:
      return doubles_of<std::uint32_t>(variable, count);
    case MAT_C_INT16:
      return doubles_of<std::int16_t>(variable, count);
    case MAT_C_UINT16:
      return doubles_of<std::uint16_t>(variable, count);
    case MAT_C_INT8:
      return doubles_of<std::int8_t>(variable, count);
    case MAT_C_UINT8:
      return doubles_of<std::uint8_t>(variable, count);
    default:
      return {};
  }
}

// NOLINTNEXTLINE(misc-no-recursion): structures hold structures
void add_variable(const matvar_t& variable, const std::string& name, SeriesTables& tables) {
  if (variable.class_type == MAT_C_STRUCT) {
    const unsigned fields = Mat_VarGetNumberOfFields(const_cast<matvar_t*>(&variable));
    const char* const* const names = Mat_VarGetStructFieldnames(&variable);
    for (unsigned f = 0; f < fields; ++f) {
      const matvar_t* const field =
          Mat_VarGetStructFieldByIndex(const_cast<matvar_t*>(&variable), f, 0);
      if (field != nullptr) {
        add_variable(*field, formatted("{}.{}", name, names[f]), tables);
      }
    }
    return;
  }
  if (variable.rank != 2) {
    return;
  }
  const std::vector<double> values = values_of(variable, variable.dims[0] * variable.dims[1]);
  if (!values.empty()) {
    tables.add(name, variable.dims[0], variable.dims[1], values);
  }
}

// Whether a variable of numbers has none, though its sizes say that there are.
bool is_lost(const matvar_t& variable) {
  const bool is_numeric =
      variable.class_type >= MAT_C_DOUBLE && variable.class_type <= MAT_C_UINT64;
  std::size_t size = 1;
  for (int d = 0; d < variable.rank; ++d) {
    size *= variable.dims[d];
  }
  return is_numeric && size > 0 && variable.data == nullptr;
}

void append_bytes(std::string& text, const void* bytes, std::size_t size) {
  text.append(static_cast<const char*>(bytes), size);
}

void append_size(std::string& text, std::size_t size) {
  append_bytes(text, &size, sizeof size);
}

// What the process answers: '1', names and columns, or '0' and why there are none.
std::string answer_of(const std::string& path) {
  const std::unique_ptr<mat_t, CloseFile> file(Mat_Open(path.c_str(), MAT_ACC_RDONLY));
  if (!file) {
    return "0the .mat file is damaged";
  }
  SeriesTables tables;
  std::size_t count = 0;
  char* const* const names = Mat_GetDir(file.get(), &count);
  for (std::size_t i = 0; i < count; ++i) {
    if (names[i] == nullptr) {
      continue;
    }
    // What the file lists must be there; matio says of neither that it is missing.
    const std::unique_ptr<matvar_t, FreeVariable> variable(Mat_VarRead(file.get(), names[i]));
    if (!variable || is_lost(*variable)) {
      return formatted("0the .mat file is damaged: variable '{}' cannot be read", names[i]);
    }
    add_variable(*variable, names[i], tables);
  }
  SeriesTables::Table table;
  try {
    table = std::move(tables).take_largest("");
  } catch (const DataError& error) {
    return std::string("0") + (error.what() + 2);  // without the empty path
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
  const std::string text = answer_of(path);
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
std::optional<std::string> ask_another_process(const std::string& path, std::size_t file_size) {
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
    answer_and_exit(path, ends[1], memory, seconds);
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

std::unique_ptr<LogFile::Source> open_mat73_log(const std::string& path) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none)) {
    throw DataError(path, "a .mat file of version 7.3 must be a file, not a pipe; give its name");
  }
  const std::optional<std::string> text =
      ask_another_process(path, static_cast<std::size_t>(std::filesystem::file_size(path, none)));
  if (!text || text->empty()) {
    throw DataError(path, "the .mat file is damaged, or its variables are far larger than it");
  }
  if (text->front() == '0') {
    throw DataError(path, text->substr(1));
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
    throw DataError(path, "the .mat file is damaged");
  }
}
#else
std::unique_ptr<LogFile::Source> open_mat73_log(const std::string& path) {
  throw DataError(
      path,
      "is a .mat file of version 7.3, and this axiscal was built without matio; save it "
      "with -v7, or as CSV");
}
#endif

}  // namespace axiscal
