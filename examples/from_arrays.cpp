// SPDX-License-Identifier: Apache-2.0
// The program of README.md with arrays instead of a file: twelve design points and twelve readings.
#include <axiscal/axiscal.hpp>
#include <cstdio>
#include <vector>

int main() {
  // The data that a data acquisition system would provide: the pose of the cube, and the readings
  // of the axes [V].
  std::vector<axiscal::DesignPoint> points;
  for (const axiscal::DesignEntry& entry : axiscal::standard_design(12)) {
    points.push_back(entry.point);
  }
  Eigen::MatrixXd volts(12, 3);
  const axiscal::Positioner cube;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d up =
        cube.rotation_table_from_positioner(points[i]).transpose() * Eigen::Vector3d::UnitZ();
    const double wiggle = i % 2 == 0 ? 2e-5 : -2e-5;
    volts.row(static_cast<Eigen::Index>(i)) =
        (2.5 * up + Eigen::Vector3d(0.010 + wiggle, -0.004, 0.007 - wiggle)).transpose();
  }

  const axiscal::Calibration cal = axiscal::calibrate(
      axiscal::make_run(points, volts), axiscal::accelerometer("V"), axiscal::gravity());
  const axiscal::Quantity sensitivity = cal.parameter("z.sensitivity.z");
  std::printf("sensitivity of z %.5f +- %.5f %s (95 %%)\n", sensitivity.value, sensitivity.U,
              sensitivity.unit.c_str());
  const axiscal::Reducer reduce(cal);
  const double reading[] = {0.880, -0.004, 2.345};
  const axiscal::ReducedReading reduced = reduce(reading);
  std::printf("pitch %.2f, roll %.2f degrees\n", reduced["pitch_deg"], reduced["roll_deg"]);
}
