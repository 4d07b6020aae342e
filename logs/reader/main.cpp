// SPDX-License-Identifier: Apache-2.0
// The program `axiscal-read FORMAT MEMORY SECONDS` reads a file from standard input, and writes the
// largest table in it to standard output. read_in_another_process() runs the program, because the
// libraries that read these formats are not safe with damaged files. FORMAT is "hdf5" or "mat73".
// The program limits itself to MEMORY additional bytes of address space and SECONDS of processor
// time.
#include <csignal>
#include <cstdlib>
#include <new>
#include <string>
#include <string_view>

#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "core/descriptor.hpp"
#include "logs/reader/formats.hpp"
#include "logs/recordings/src/other_process.hpp"

namespace axiscal {
namespace {

void append_bytes(std::string& text, const void* bytes, std::size_t size) {
  text.append(static_cast<const char*>(bytes), size);
}

void append_size(std::string& text, std::size_t size) {
  append_bytes(text, &size, sizeof size);
}

// @return '1' followed by the names and columns of the table, or '0' followed by the error.
std::string answer_of(std::string_view format) {
  // Through this path, the libraries open standard input as a file with random access.
  const std::string path = "/proc/self/fd/0";
  SeriesTables::Table table;
  try {
    table = (format == "hdf5" ? read_hdf5(path) : read_mat73(path)).take_largest("");
  } catch (const DataError& error) {
    return std::string("0") + (error.what() + 2);  // skips the ': ' after the empty path
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

// @return the size of the address space of this process in bytes.
std::size_t address_space() {
  const std::string text = read_whole_file("/proc/self/statm");
  return static_cast<std::size_t>(std::strtoull(text.c_str(), nullptr, 10)) *
         static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

void limit_to(int resource, rlim_t most) {
  const rlimit limit{most, most};
  ::setrlimit(static_cast<__rlimit_resource>(resource), &limit);
}

}  // namespace
}  // namespace axiscal

int main(int count, char** arguments) try {
  if (count != 4) {
    return axiscal::reader_failed;
  }
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // the program ends when its parent ends
  if (!axiscal::has_shadow_memory) {
    axiscal::limit_to(RLIMIT_AS,
                      axiscal::address_space() + std::strtoull(arguments[2], nullptr, 10));
  }
  axiscal::limit_to(RLIMIT_CPU, std::strtoull(arguments[3], nullptr, 10));
  axiscal::limit_to(RLIMIT_CORE, 0);
  return axiscal::write_all(STDOUT_FILENO, axiscal::answer_of(arguments[1]))
             ? axiscal::reader_answered
             : axiscal::reader_failed;
} catch (const std::bad_alloc&) {
  return axiscal::reader_lacks_memory;
} catch (...) {
  return axiscal::reader_failed;
}
