// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/repeated_design.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/parallel.hpp"
#include "calib/plan/src/study_blocks.hpp"
#include "calib/record/parameter_names.hpp"
#include "kernels/regression_trials.hpp"

namespace axiscal {
namespace {

// Returns the field of each reading in the sensor's frame. It is simulated as the reading of an
// ideal instrument.
Eigen::MatrixXd fields_in_sensor(const StudySetup& setup) {
  SensorModel ideal = setup.truth;
  ideal.instrument.axes = {"x", "y", "z"};
  ideal.response.bias = Eigen::Vector3d::Zero();
  ideal.response.sensitivity = Eigen::Matrix3d::Identity();
  SimulationOptions options = setup.simulation;
  options.noise_sd = 0.0;
  options.resolution = 0.0;
  options.positioner = setup.experiment.positioner;
  options.rotation_sensor_from_positioner = setup.experiment.rotation_sensor_from_positioner;
  return simulate(ideal, make_run_sheet(setup.design, setup.replicates, 1), options).response;
}

RegressionTrials trials_of(const StudySetup& setup) {
  const LinearResponse& response = setup.truth.response;
  const Eigen::MatrixXd fields = fields_in_sensor(setup);
  const Eigen::Index n = fields.rows();
  const Eigen::Index m = response.bias.size();
  if (n <= 4) {
    throw DomainError("a study of only the regression needs more than four readings");
  }
  Eigen::MatrixXd X(n, 4);
  X << Eigen::VectorXd::Ones(n), fields;
  RegressionTrials trials{.at = repeated_design(X, parameter_names({"axis"})),
                          .responses = static_cast<std::size_t>(m)};
  // (X^T X)^-1 is the pseudo-inverse times its transpose. The pseudo-inverse is stored by rows.
  const Eigen::Map<const Eigen::MatrixXd> rows(trials.at.pseudo_inverse.data(), n, 4);
  for (Eigen::Index j = 0; j < 4; ++j) {
    trials.unscaled_variance.push_back(rows.col(j).squaredNorm());
  }
  for (Eigen::Index k = 0; k < m; ++k) {
    trials.truth.push_back(response.bias(k));
    for (int j = 0; j < 3; ++j) {
      trials.truth.push_back(response.sensitivity(k, j));
    }
    trials.noise_sd.push_back(setup.noise_sd.size() > 0 ? setup.noise_sd(k)
                                                        : setup.simulation.noise_sd);
  }
  trials.coverage_factor = student_t_factor(0.95, static_cast<double>(n - 4));
  return trials;
}

}  // namespace

void run_regression_study(const StudySetup& setup,
                          const Shard& shard,
                          const std::function<void(std::int64_t)>& progress,
                          Study& study) {
  if (setup.truth.temperature || !setup.truth.also.empty() || setup.truth.instrument.one_sided ||
      setup.drawing || setup.random_normals || setup.slope_sd > 0.0 ||
      setup.simulation.resolution > 0.0 || !setup.simulation.world.is_white() || setup.alarms) {
    throw DomainError(
        "a study of only the regression simulates nothing but noise. Leave out the other simulated "
        "effects ('world'), alarms, temperature terms, second fields, one-sided axes, resolution, "
        "random slopes and random cubes");
  }
  const RegressionTrials trials = trials_of(setup);
  study.parameters = parameter_names(setup.truth.instrument.axes);
  study.block = static_cast<std::int64_t>(regression_trials_block);
  study.blocks = blocks_of_shard(study, shard);
  study.sums.resize(study.blocks.size());
  ProgressReport report(progress);
  for_each_in_parallel(study.blocks.size(), [&](std::size_t i) {
    const std::int64_t block = study.blocks[i];
    const std::int64_t count = std::min(study.block, study.trials - block * study.block);
    for (const RegressionTrialSums& one :
         run_regression_trials(trials, study.seed, static_cast<std::uint64_t>(block),
                               static_cast<std::size_t>(count))) {
      study.sums[i].push_back({.trials = static_cast<double>(count),
                               .error = one.error,
                               .error_squared = one.error_squared,
                               .u_squared = one.u_squared,
                               .covered = one.covered});
    }
    report.add(count);
  });
}

}  // namespace axiscal
