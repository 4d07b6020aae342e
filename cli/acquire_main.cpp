// SPDX-License-Identifier: Apache-2.0
// The program axiscal-acquire. `axiscal acquire` replaces its process with this program.
#include "acquire_options.hpp"
#include "run_command.hpp"
#include "subcommands.hpp"

int main(int argc, char** argv) {
  using namespace axiscal::cli;
  return run_main(argc, argv, {acquire_subcommand(&run_acquire)});
}
