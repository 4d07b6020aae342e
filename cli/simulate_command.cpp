// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/calib/simulate.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/positioner/positioner_json.hpp"
#include "commands.hpp"
#include "input.hpp"

namespace axiscal::cli {

int run(const SimulateCommand& command) {
  forbid_overwriting(command.output, command.truth);
  SimulationOptions options;
  options.seed = seed_of(command.sheet);
  if (command.noise) {
    options.noise_sd = number_of("--noise", *command.noise);
    if (options.noise_sd < 0.0) {
      throw UsageError("--noise: must not be negative");
    }
  }
  if (command.slope) {
    const std::vector<double> slope = numbers_of("--slope", *command.slope, 2);
    options.slope = Eigen::Vector2d(slope[0], slope[1]);
    if (!(options.slope.norm() < 1.0)) {
      throw UsageError("--slope: X^2 + Y^2 must be less than 1");
    }
  }
  const std::vector<RunSheetRow> sheet = make_sheet(command.sheet);
  const Calibration truth = read_calibration(command.truth);
  if (command.positioner) {
    options.positioner = read_positioner(*command.positioner);
  }
  if (command.fence_azimuth) {
    options.fence_azimuth_rad = number_of("--fence-azimuth", *command.fence_azimuth) * rad_per_deg;
  }
  write_whole_file(command.output,
                   observations_csv(simulate(truth, sheet, options), truth.instrument.axes));
  return 0;
}

}  // namespace axiscal::cli
