// SPDX-License-Identifier: Apache-2.0
// Levels a table on three screws. It takes readings and turns the screws in several rounds, until
// the remaining turns are too small to be made by hand.
#include <axiscal/calib/calibrate.hpp>
#include <axiscal/calib/simulate.hpp>
#include <axiscal/field/gravity_field.hpp>
#include <axiscal/positioner/surface.hpp>
#include <cmath>
#include <cstdio>

int main() {
  axiscal::SensorModel truth;  // the true instrument, which the calibration does not know
  truth.instrument.kind = "inclinometer";
  truth.field.kind = "gravity";
  truth.field.unit = "g";
  truth.response.bias = Eigen::Vector3d(0.02, -0.01, 0.03);
  truth.response.sensitivity = Eigen::Matrix3d::Identity();

  axiscal::Surface table;
  table.adjusters_m = {{0.1, 0.0}, {-0.1, 0.08}, {-0.1, -0.08}};
  table.thread_pitch_m = 0.5e-3;
  const double smallest_turn = 0.005;  // smallest turn of a screw by hand [revolutions]

  axiscal::Experiment experiment;
  experiment.instrument = truth.instrument;
  experiment.field = axiscal::GravityField();
  Eigen::Vector2d slope(0.004, -0.006);  // true slope, which the calibration does not know
  for (std::uint64_t round = 1; round <= 5; ++round) {
    axiscal::SimulationOptions options;
    options.noise_sd = 1e-5;
    options.slope = slope;
    options.seed = round;
    const axiscal::Calibration found = axiscal::calibrate(
        experiment,
        axiscal::simulate(truth, axiscal::make_run_sheet(axiscal::standard_design(12), 1, round),
                          options));
    const axiscal::Levelness& level = *found.fit.levelness;
    const Eigen::Vector2d measured(level.mean_x, level.mean_y);
    const Eigen::Vector2d u(level.standard_error_x, level.standard_error_y);
    std::printf("round %d: slope of the table %.0f +- %.0f urad\n", static_cast<int>(round),
                1e6 * measured.norm(), 1e6 * u.maxCoeff());
    const std::vector<axiscal::AdjusterMove> moves =
        axiscal::level_table(measured, u.cwiseAbs2().asDiagonal(), table);
    Eigen::Vector3d raised;
    for (std::size_t i = 0; i < moves.size(); ++i) {
      const double turns = std::round(*moves[i].turns / smallest_turn) * smallest_turn;
      raised(static_cast<Eigen::Index>(i)) = turns * *table.thread_pitch_m;
      std::printf(
          "  turn the screw at (%+.2f, %+.2f) m by %.3f turns (positive raises the "
          "table)\n",
          moves[i].position_m.x(), moves[i].position_m.y(), turns);
    }
    if (raised.isZero()) {
      std::printf("all remaining turns are smaller than the smallest turn of a screw\n");
      break;
    }
    // The amounts by which the screws were raised define a plane. The slope of this plane is added
    // to the slope of the table.
    const double along_x = (0.5 * (raised(1) + raised(2)) - raised(0)) / -0.2;
    const double along_y = (raised(1) - raised(2)) / 0.16;
    slope += Eigen::Vector2d(along_x, along_y);
  }
  return 0;
}
