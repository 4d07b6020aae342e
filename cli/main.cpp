// SPDX-License-Identifier: Apache-2.0
#include "core/own_program.hpp"
#include "run_command.hpp"
#include "store_client.hpp"
#include "subcommands.hpp"

namespace axiscal::cli {
namespace {

constexpr OwnProgram acquire_program{.name = "axiscal-acquire", .package = "axiscal-acquire"};
constexpr OwnProgram exchange_program{.name = "axiscal-exchange", .package = "axiscal"};
constexpr OwnProgram report_program{.name = "axiscal-report", .package = "axiscal-report"};

// Returns a subcommand whose options are parsed here, but which another program runs.
Subcommand run_by(const OwnProgram& program, const Subcommand& subcommand) {
  Subcommand elsewhere = subcommand;
  elsewhere.define = [=](OptionSet& options) -> Action {
    const Action reads = subcommand.define(options);  // keeps the variables of the options alive
    return [program, reads, arguments = options.typed()]() -> int { become(program, arguments); };
  };
  elsewhere.program = program;
  return elsewhere;
}

}  // namespace
}  // namespace axiscal::cli

int main(int argc, char** argv) {
  using namespace axiscal::cli;
  return run_main(argc, argv,
                  {field_subcommand(),
                   log_subcommand(),
                   calibrate_subcommand(),
                   segment_subcommand(),
                   noise_subcommand(),
                   apply_subcommand(),
                   plan_subcommand(),
                   simulate_subcommand(),
                   level_subcommand(),
                   merge_subcommand(),
                   characterize_subcommand(),
                   check_subcommand(),
                   budget_subcommand(),
                   study_subcommand(),
                   run_by(exchange_program, export_subcommand(nullptr)),
                   run_by(exchange_program, import_subcommand(nullptr)),
                   run_by(acquire_program, acquire_subcommand(nullptr)),
                   run_by(report_program, report_subcommand(nullptr)),
                   run_by(store_program, store_subcommand(nullptr)),
                   template_subcommand()});
}
