// SPDX-License-Identifier: Apache-2.0
#include <csignal>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

#include "axiscal/calib/experiment.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_protection.hpp"
#include "axiscal/core/kept_memory.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/shown_text.hpp"
#include "axiscal/formulas/formula_field.hpp"
#include "column_advice.hpp"
#include "command_line.hpp"
#include "option_names.hpp"
#include "subcommands.hpp"
#include "usage_error.hpp"

namespace {

enum ExitStatus { done = 0, refused = 1, wrong_usage = 2, bad_input = 3, output_not_written = 4 };

extern "C" void remove_output_and_die(int signal) {
  axiscal::remove_unfinished_output();
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

// Without standard output a file that we open would take its number, and be printed into. What is
// opened instead cannot be written to, so that a result which is lost there is an error.
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

int fail(ExitStatus status, const std::string& message) {
  std::fprintf(stderr, "%s\n", axiscal::shown_text(message).c_str());
  return status;
}

// In the order of the help.
std::vector<axiscal::cli::Subcommand> subcommands() {
  using namespace axiscal::cli;
  return {field_subcommand(),        log_subcommand(),      calibrate_subcommand(),
          segment_subcommand(),      noise_subcommand(),    apply_subcommand(),
          plan_subcommand(),         simulate_subcommand(), level_subcommand(),
          characterize_subcommand(), check_subcommand(),    budget_subcommand(),
          study_subcommand(),        export_subcommand(),   import_subcommand(),
          acquire_subcommand(),      report_subcommand(),   template_subcommand()};
}

}  // namespace

int main(int argc, char** argv) {
  open_missing_standard_files();
  set_signals();
  axiscal::keep_freed_memory();
  const axiscal::InputProtection no_input_is_overwritten;
  axiscal::add_formula_field();
  try {
    const axiscal::cli::Action action = axiscal::cli::parse_command_line(
        std::vector<std::string>(argv + 1, argv + argc), subcommands());
    return action();
  } catch (const axiscal::cli::UsageError& error) {
    return fail(wrong_usage, "axiscal: " + axiscal::cli::with_options(error));
  } catch (const axiscal::SetupError& error) {
    return fail(wrong_usage, "axiscal: " + axiscal::cli::with_options(error));
  } catch (const axiscal::InputOverwriteError& error) {
    return fail(wrong_usage, "axiscal: " + axiscal::cli::with_options(error));
  } catch (const axiscal::DataError& error) {
    return fail(bad_input, axiscal::cli::with_marked_cell(axiscal::cli::with_options(error)));
  } catch (const axiscal::ClosedPipe&) {  // of a stream of results, which has no verdict
    return done;
  } catch (const axiscal::OutputError& error) {
    return fail(output_not_written, "axiscal: " + axiscal::cli::with_options(error));
  } catch (const axiscal::Error& error) {
    return fail(refused, "axiscal: " + axiscal::cli::with_options(error));
  } catch (const std::exception& error) {
    return fail(refused, std::string("axiscal: ") + error.what());
  }
}
