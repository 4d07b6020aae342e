// SPDX-License-Identifier: Apache-2.0
#include "run_command.hpp"

#include <cstdio>
#include <exception>

#include "axiscal/core/error.hpp"
#include "axiscal/core/input_protection.hpp"
#include "axiscal/core/shown_text.hpp"
#include "column_advice.hpp"
#include "command_line.hpp"
#include "option_names.hpp"
#include "subcommands.hpp"
#include "usage_error.hpp"

namespace axiscal::cli {
namespace {

enum ExitStatus { done = 0, refused = 1, wrong_usage = 2, bad_input = 3, output_not_written = 4 };

int fail(ExitStatus status, const std::string& message) {
  std::fprintf(stderr, "%s\n", shown_text(message).c_str());
  return status;
}

// In the order of the help.
std::vector<Subcommand> subcommands() {
  return {field_subcommand(),        log_subcommand(),      calibrate_subcommand(),
          segment_subcommand(),      noise_subcommand(),    apply_subcommand(),
          plan_subcommand(),         simulate_subcommand(), level_subcommand(),
          characterize_subcommand(), check_subcommand(),    budget_subcommand(),
          study_subcommand(),        export_subcommand(),   import_subcommand(),
          acquire_subcommand(),      report_subcommand(),   template_subcommand()};
}

}  // namespace

int run_command(const std::vector<std::string>& arguments) {
  const InputProtection no_input_is_overwritten;
  try {
    const Action action = parse_command_line(arguments, subcommands());
    return action();
  } catch (const UsageError& error) {
    return fail(wrong_usage, "axiscal: " + with_options(error));
  } catch (const SetupError& error) {
    return fail(wrong_usage, "axiscal: " + with_options(error));
  } catch (const InputOverwriteError& error) {
    return fail(wrong_usage, "axiscal: " + with_options(error));
  } catch (const DataError& error) {
    return fail(bad_input, with_marked_cell(with_options(error)));
  } catch (const ClosedPipe&) {  // by a stream of results: it gives no verdict
    return done;
  } catch (const OutputError& error) {
    return fail(output_not_written, "axiscal: " + with_options(error));
  } catch (const Error& error) {
    return fail(refused, "axiscal: " + with_options(error));
  } catch (const std::exception& error) {
    return fail(refused, std::string("axiscal: ") + error.what());
  }
}

}  // namespace axiscal::cli
