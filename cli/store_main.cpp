// SPDX-License-Identifier: Apache-2.0
// The program axiscal-store. `axiscal store` replaces its process with this program.
#include "run_command.hpp"
#include "store_options.hpp"
#include "subcommands.hpp"

int main(int argc, char** argv) {
  using namespace axiscal::cli;
  return run_main(argc, argv, {store_subcommand(&run_store)});
}
