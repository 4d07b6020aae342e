// SPDX-License-Identifier: Apache-2.0
// The program axiscal-exchange. `axiscal export` and `axiscal import` replace their process with
// this program.
#include "exchange_options.hpp"
#include "run_command.hpp"
#include "subcommands.hpp"

int main(int argc, char** argv) {
  using namespace axiscal::cli;
  return run_main(argc, argv, {export_subcommand(&run_export), import_subcommand(&run_import)});
}
