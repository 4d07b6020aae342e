// SPDX-License-Identifier: Apache-2.0
#include "run_command.hpp"

#include <csignal>
#include <cstdio>
#include <exception>

#include <fcntl.h>
#include <unistd.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/input_protection.hpp"
#include "axiscal/core/kept_memory.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/printable_text.hpp"
#include "axiscal/formulas/formula_field.hpp"
#include "column_advice.hpp"
#include "command_line.hpp"
#include "option_names.hpp"
#include "usage_error.hpp"

namespace axiscal::cli {
namespace {

enum ExitStatus { done = 0, refused = 1, wrong_usage = 2, bad_input = 3, output_not_written = 4 };

int fail(ExitStatus status, const std::string& message) {
  std::fprintf(stderr, "%s\n", printable_text(message).c_str());
  return status;
}

extern "C" void remove_output_and_die(int signal) {
  remove_unfinished_output();
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

// Opens /dev/null for each standard stream that is closed. Otherwise the next opened file could get
// the descriptor of standard output, and results would be printed into that file. /dev/null is
// opened for reading only, so that printing a result is an error.
void open_missing_standard_files() {
  int descriptor = ::open("/dev/null", O_RDONLY);
  while (descriptor >= 0 && descriptor <= STDERR_FILENO) {
    descriptor = ::open("/dev/null", O_RDONLY);
  }
  ::close(descriptor);
}

void set_signals() {
  // Ignores these signals, so that write() reports a closed pipe or a file that is too large.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    if (std::signal(signal, remove_output_and_die) == SIG_IGN) {
      std::signal(signal, SIG_IGN);
    }
  }
}

}  // namespace

int run_command(const std::vector<std::string>& arguments,
                const std::vector<Subcommand>& subcommands) {
  const InputProtection no_input_is_overwritten;
  try {
    const Action action = parse_command_line(arguments, subcommands);
    return action();
  } catch (const UsageError& error) {
    return fail(wrong_usage, "axiscal: " + with_options(error));
  } catch (const SetupError& error) {
    return fail(wrong_usage, "axiscal: " + with_options(error));
  } catch (const InputOverwriteError& error) {
    return fail(wrong_usage, "axiscal: " + with_options(error));
  } catch (const DataError& error) {
    return fail(bad_input, with_marked_cell(with_options(error)));
  } catch (const ClosedPipe&) {  // no error: the reader of the results has closed the pipe
    return done;
  } catch (const OutputError& error) {
    return fail(output_not_written, "axiscal: " + with_options(error));
  } catch (const Error& error) {
    return fail(refused, "axiscal: " + with_options(error));
  } catch (const std::exception& error) {
    return fail(refused, std::string("axiscal: ") + error.what());
  }
}

int run_main(int count, char** arguments, const std::vector<Subcommand>& subcommands) {
  open_missing_standard_files();
  set_signals();
  keep_freed_memory();
  add_formula_field();
  return run_command(std::vector<std::string>(arguments + 1, arguments + count), subcommands);
}

}  // namespace axiscal::cli
