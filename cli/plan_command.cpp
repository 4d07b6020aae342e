// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/core/output_file.hpp"
#include "commands.hpp"
#include "input.hpp"

namespace axiscal::cli {

int run(const PlanCommand& command) {
  write_whole_file(command.output, run_sheet_csv(make_sheet(command.sheet)));
  return 0;
}

}  // namespace axiscal::cli
