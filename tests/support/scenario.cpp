// SPDX-License-Identifier: Apache-2.0
#include "scenario.hpp"

#include "axiscal/calib/observations_csv.hpp"

namespace axiscal::test {

SensorModel truth_of(const LinearResponse& response, const std::string& kind) {
  SensorModel truth;
  truth.instrument.kind = kind;
  truth.instrument.unit = "V";
  truth.instrument.axes.clear();
  for (Eigen::Index k = 0; k < response.bias.size(); ++k) {
    std::string name(1, k < 3 ? "xyz"[k] : 'a');
    if (k >= 3) {
      name += std::to_string(k);
    }
    truth.instrument.axes.push_back(name);
  }
  truth.field = {.kind = "gravity", .unit = "g", .magnitude = 1.0};
  truth.response = response;
  return truth;
}

SensorModel accelerometer_truth() {
  LinearResponse response{.bias = Eigen::Vector3d(0.012, -0.034, 0.005),
                          .sensitivity = Eigen::Matrix3d::Zero()};
  // clang-format off
  response.sensitivity << 2.50,  0.010, -0.020,
                          0.015, 2.48,   0.030,
                         -0.010, 0.020,  2.52;
  // clang-format on
  return truth_of(response, "accelerometer");
}

Experiment experiment_for(const SensorModel& truth) {
  Experiment experiment;
  experiment.instrument = truth.instrument;
  experiment.field = setup_of(truth.field, true);
  return experiment;
}

Observations observe(const SensorModel& truth, const Run& run) {
  SimulationOptions options;
  options.noise_sd = run.noise_sd;
  options.slope = run.slope;
  options.seed = run.seed;
  return simulate(truth, make_run_sheet(standard_design(run.points), run.replicates, run.seed),
                  options);
}

std::string observations_text(const SensorModel& truth, const Run& run) {
  return observations_csv(observe(truth, run), truth.instrument.axes);
}

Positioner uncertain_cube(double u) {
  PositionerDescription description;
  NormalCovariance C = NormalCovariance::Zero();
  const Positioner nominal;
  for (const Face face : all_faces) {
    const auto i = static_cast<std::size_t>(face);
    description.faces[i].normal = nominal.normal(face);
    const Eigen::Vector3d n = nominal.normal(face);
    C.block<3, 3>(3 * static_cast<Eigen::Index>(i), 3 * static_cast<Eigen::Index>(i)) =
        u * u * (Eigen::Matrix3d::Identity() - n * n.transpose());
  }
  description.normal_covariance = C;
  return Positioner(std::move(description));
}

}  // namespace axiscal::test
