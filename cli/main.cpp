// SPDX-License-Identifier: Apache-2.0
#include <csignal>
#include <string>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

#include "axiscal/core/kept_memory.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/formulas/formula_field.hpp"
#include "run_command.hpp"

namespace {

extern "C" void remove_output_and_die(int signal) {
  axiscal::remove_unfinished_output();
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

// If standard output is closed, a file that we open would take its number, and be printed into. A
// file that cannot be written to takes the number instead: a result that is lost is an error.
void open_missing_standard_files() {
  int descriptor = ::open("/dev/null", O_RDONLY);
  while (descriptor >= 0 && descriptor <= STDERR_FILENO) {
    descriptor = ::open("/dev/null", O_RDONLY);
  }
  ::close(descriptor);
}

void set_signals() {
  // A closed pipe and a limit on file size are then reported by write().
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    if (std::signal(signal, remove_output_and_die) == SIG_IGN) {
      std::signal(signal, SIG_IGN);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  open_missing_standard_files();
  set_signals();
  axiscal::keep_freed_memory();
  axiscal::add_formula_field();
  return axiscal::cli::run_command(std::vector<std::string>(argv + 1, argv + argc));
}
