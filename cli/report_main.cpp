// SPDX-License-Identifier: Apache-2.0
// The program axiscal-report. `axiscal report` replaces its process with this program.
#include "report_options.hpp"
#include "run_command.hpp"
#include "subcommands.hpp"

int main(int argc, char** argv) {
  using namespace axiscal::cli;
  return run_main(argc, argv, {report_subcommand(&run_report)});
}
