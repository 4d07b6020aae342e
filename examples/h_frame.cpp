// SPDX-License-Identifier: Apache-2.0
// Calibrates two instruments in one run. They are mounted on the two sides of the web of an
// H-shaped frame.
#include <axiscal/calib/assembly.hpp>
#include <axiscal/calib/simulate.hpp>
#include <axiscal/field/gravity_field.hpp>
#include <cstdio>

int main() {
  const std::vector<axiscal::Mount> mounts = axiscal::h_shaped_mounts("left", "right");
  axiscal::Experiment experiment;
  experiment.instrument.kind = "accelerometer";
  experiment.instrument.unit = "V";
  experiment.field = axiscal::GravityField();
  experiment.positioner = axiscal::Positioner().with_mounts(mounts);

  // Both instruments are read at the same 12 design points. A data logger would write the columns
  // left.x, left.y, ..
  std::vector<axiscal::SlotObservations> readings;
  for (const axiscal::Mount& mount : mounts) {
    axiscal::SensorModel truth;
    truth.instrument = experiment.instrument;
    truth.field.kind = "gravity";
    truth.field.unit = "g";
    const double sign = mount.slot == "left" ? 1.0 : -1.0;
    truth.response.bias = sign * Eigen::Vector3d(0.1, 0.2, 0.3);
    truth.response.sensitivity = (2.5 + 0.1 * sign) * Eigen::Matrix3d::Identity();
    axiscal::SimulationOptions options;
    options.noise_sd = 1e-4;
    options.slope = {0.002, 0.001};
    options.rotation_sensor_from_positioner = mount.rotation_sensor_from_positioner;
    options.stream = static_cast<std::uint32_t>(readings.size());
    readings.push_back(
        {mount.slot,
         axiscal::simulate(truth, axiscal::make_run_sheet(axiscal::standard_design(12), 2, 1),
                           options)});
  }

  for (const axiscal::Calibration& found : axiscal::calibrate_assembly(experiment, readings)) {
    std::printf("%-5s: sensitivity of z %.3f V/g, bias of z %+.3f V, table slope %.2f, %.2f mrad\n",
                found.provenance.slot.c_str(), found.parameter("z.sensitivity.z").value,
                found.parameter("z.bias").value, 1e3 * found.fit.levelness->mean_x,
                1e3 * found.fit.levelness->mean_y);
    if (found.provenance.slot == "right") {
      const axiscal::CombinedLevelness& both = *found.fit.levelness->combined;
      std::printf("both : table slope %.2f, %.2f mrad, %s\n", 1e3 * both.x, 1e3 * both.y,
                  both.consistent ? "they agree" : "they DISAGREE");
    }
  }
  return 0;
}
