// SPDX-License-Identifier: Apache-2.0
// Tests ten thousand units of one design in a factory. The matrix of the design is factored only
// once. The fit of a unit then needs only a few products, and one vector instruction serves several
// units. A unit that fails is calibrated in full.
#include <axiscal/calib/calibrate.hpp>
#include <axiscal/calib/repeated_design.hpp>
#include <axiscal/calib/simulate.hpp>
#include <axiscal/core/random.hpp>
#include <axiscal/field/gravity_field.hpp>
#include <cmath>
#include <cstdio>

int main() {
  constexpr Eigen::Index units = 10000;
  const std::vector<axiscal::RunSheetRow> sheet =
      axiscal::make_run_sheet(axiscal::standard_design(12), 1, 1);
  axiscal::SensorModel ideal;
  ideal.instrument.kind = "accelerometer";
  ideal.field = {.kind = "gravity", .unit = "g", .magnitude = 1.0};
  ideal.response.bias = Eigen::Vector3d::Zero();
  ideal.response.sensitivity = Eigen::Matrix3d::Identity();
  const Eigen::MatrixXd fields = axiscal::simulate(ideal, sheet).response;  // 12 x 3

  // Readings of all units, with one row per design point and three columns per unit.
  axiscal::RandomStream random(7);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> readings(12, 3 * units);
  for (Eigen::Index column = 0; column < 3 * units; ++column) {
    Eigen::Vector3d row = 0.01 * random.normals<3>();
    row(column % 3) += 2.5;
    const bool is_bad = column == 4711 * 3 + 1;  // one axis of one unit is noisy
    for (Eigen::Index i = 0; i < 12; ++i) {
      readings(i, column) =
          0.02 + fields.row(i).dot(row) + (is_bad ? 5e-3 : 1e-4) * random.normal();
    }
  }

  Eigen::Matrix<double, 12, 4> X;
  X << Eigen::VectorXd::Ones(12), fields;
  const axiscal::RepeatedDesign design = axiscal::repeated_design(X);
  std::vector<double> estimates(4 * 3 * units);
  std::vector<double> rss(3 * units);
  axiscal::fit_repeatedly(design, {readings.data(), static_cast<std::size_t>(readings.size())},
                          estimates, rss);

  constexpr double largest_residual_sd = 4e-4;
  int failed = 0;
  for (Eigen::Index unit = 0; unit < units; ++unit) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const double sd = std::sqrt(rss[static_cast<std::size_t>(3 * unit + axis)] / 8.0);
      if (sd > largest_residual_sd) {
        ++failed;
        axiscal::Experiment experiment;
        experiment.instrument.kind = "accelerometer";
        experiment.field = axiscal::GravityField();
        axiscal::Observations own;
        own.readings = axiscal::simulate(ideal, sheet).readings;
        own.response = readings.middleCols(3 * unit, 3);
        const axiscal::Calibration full = axiscal::calibrate(experiment, own);
        std::printf(
            "unit %d fails: residual sd of axis %c %.1e; calibrate() gives %.1e (status %s)\n",
            static_cast<int>(unit), "xyz"[axis], sd, full.fit.statistics->residual_sd(axis),
            std::string(axiscal::status_name(full.findings.status)).c_str());
      }
    }
  }
  std::printf("yield: %.2f %% of %d units\n", 100.0 * static_cast<double>(units - failed) / units,
              static_cast<int>(units));
  return 0;
}
