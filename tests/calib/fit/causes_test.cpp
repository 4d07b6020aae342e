// SPDX-License-Identifier: Apache-2.0
// Each cause of scatter, tested separately: it makes the affected intervals longer and no other
// interval.
#include "calib/fit/src/causes/causes.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/rotation.hpp"
#include "calib/fit/cause.hpp"
#include "calib/fit/method_fit.hpp"
#include "calib/fit/reading_source.hpp"
#include "calib/record/parameter_names.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

constexpr double run_noise = 2e-4;

// An accelerometer's run that is fitted by method joint. counted() applies one cause.
class OneCause {
 public:
  OneCause(Experiment experiment, Observations observations)
      : experiment_(std::move(experiment)),
        observations_(std::move(observations)),
        source_(ReadingSource(experiment_, observations_, Weighting::none, false)
                    .with({.effects = {.blocks = true}})),
        set_(source_.set(resolve_field(experiment_), {})),
        estimate_(method_fit(Method::joint).fitted(set_, false)) {
    fill_intervals(estimate_.statistics);
  }

  [[nodiscard]] CountedEstimate counted(const Cause& cause) const {
    const SolvedReadings readings(set_, false, estimate_.solution);
    const std::map<int, Eigen::Matrix3d> mounts;
    return cause.counted({.experiment = experiment_,
                          .fitted = readings,
                          .judged = readings,
                          .method = method_kind(Method::joint),
                          .mounts = mounts},
                         {.estimate = estimate_, .weighed = {}});
  }

  [[nodiscard]] const Estimate& estimate() const { return estimate_; }

 private:
  Experiment experiment_;
  Observations observations_;
  ReadingSource source_;
  ReadingSet set_;
  Estimate estimate_;
};

Experiment experiment() {
  return test::experiment_for(test::accelerometer_truth());
}

Observations good_run(int replicates, std::uint64_t seed) {
  Observations observations = test::observe(test::accelerometer_truth(), {.points = 12,
                                                                          .replicates = replicates,
                                                                          .slope = {0.002, -0.001},
                                                                          .noise_sd = run_noise,
                                                                          .seed = seed});
  return observations;
}

// @return the indices of the parameters whose intervals became longer. The order is b, S_x, S_y,
// S_z for each axis.
std::vector<Eigen::Index> longer(const Estimate& before, const Estimate& after) {
  std::vector<Eigen::Index> all;
  for (Eigen::Index p = 0; p < before.statistics.interval_95.size(); ++p) {
    EXPECT_GE(after.statistics.interval_95(p), before.statistics.interval_95(p) * (1.0 - 1e-12));
    if (after.statistics.interval_95(p) > 1.001 * before.statistics.interval_95(p)) {
      all.push_back(p);
    }
  }
  return all;
}

bool is_component(const Estimate& estimate, std::string_view name) {
  const auto& all = estimate.statistics.components;
  return std::any_of(all.begin(), all.end(),
                     [&](const ScatterComponent& one) { return one.name == name; });
}

TEST(BlocksCause, CountsBiasesThatDifferBetweenBlocks) {
  Observations observations = good_run(3, 1);
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    const double shift = 20.0 * run_noise * (observations.readings[i].block - 2);
    observations.response.row(static_cast<Eigen::Index>(i)).array() += shift;
  }
  const OneCause run(experiment(), observations);
  const CountedEstimate counted = run.counted(blocks_cause());
  EXPECT_EQ(longer(run.estimate(), counted.estimate), (std::vector<Eigen::Index>{0, 4, 8}));
  EXPECT_TRUE(is_component(counted.estimate, "blocks"));
  EXPECT_EQ(counted.estimate.blocks.degrees_of_freedom, 2.0);
  // The shifts are -20, 0 and 20 sigma, so the root of their mean square (2 degrees of freedom) is
  // 20 sigma.
  EXPECT_NEAR(std::sqrt(counted.estimate.blocks.mean_square(0)), 20.0 * run_noise, 2.0 * run_noise);
}

TEST(BlocksCause, SaysNothingOfOneBlock) {
  const OneCause run(experiment(), good_run(1, 2));
  const CountedEstimate counted = run.counted(blocks_cause());
  EXPECT_TRUE(longer(run.estimate(), counted.estimate).empty());
  EXPECT_EQ(counted.estimate.blocks.mean_square.size(), 0);
}

TEST(BlocksCause, TakesEarlierCalibrations) {
  Experiment with = experiment();
  with.fit.process = ProcessScatter{
      .mean_square = Eigen::Vector3d::Constant(1e-6), .degrees_of_freedom = 12.0, .records = 5};
  const OneCause run(with, good_run(1, 3));
  const CountedEstimate counted = run.counted(blocks_cause());
  EXPECT_EQ(longer(run.estimate(), counted.estimate), (std::vector<Eigen::Index>{0, 4, 8}));
  EXPECT_EQ(counted.estimate.blocks.earlier, 5);
}

TEST(BlockSensitivitiesCause, CountsGainsThatDifferBetweenBlocks) {
  Observations observations = good_run(4, 4);
  const SensorModel truth = test::accelerometer_truth();
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    const double gain = 1.0 + 2e-3 * (observations.readings[i].block - 2.5);
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::RowVectorXd sensed =
        observations.response.row(row) - truth.response.bias.transpose();
    observations.response.row(row) = truth.response.bias.transpose() + gain * sensed;
  }
  const OneCause run(experiment(), observations);
  const CountedEstimate counted = run.counted(block_sensitivities_cause());
  EXPECT_TRUE(counted.gains_differ);
  EXPECT_TRUE(is_component(counted.estimate, "block_sensitivities"));
  const std::vector<Eigen::Index> found = longer(run.estimate(), counted.estimate);
  for (const Eigen::Index main : {1, 6, 11}) {
    EXPECT_TRUE(std::find(found.begin(), found.end(), main) != found.end()) << main;
  }
  for (const Eigen::Index bias : {0, 4, 8}) {
    EXPECT_TRUE(std::find(found.begin(), found.end(), bias) == found.end()) << bias;
  }
}

TEST(RoundingCause, CountsAStepThatIsWiderThanTheNoise) {
  Observations observations = good_run(2, 5);
  constexpr double step = 5e-3;
  observations.response = (observations.response.array() / step).round() * step;
  const OneCause run(experiment(), observations);
  const CountedEstimate counted = run.counted(rounding_cause());
  EXPECT_TRUE(is_component(counted.estimate, "rounding"));
  EXPECT_FALSE(longer(run.estimate(), counted.estimate).empty());
  const std::vector<CalibrationNote>& notes = counted.estimate.notes;
  EXPECT_TRUE(std::any_of(notes.begin(), notes.end(), [](const CalibrationNote& note) {
    return note.code == NoteCode::rounding;
  }));
}

TEST(RoundingCause, SaysNothingOfFineSteps) {
  const OneCause run(experiment(), good_run(2, 6));
  EXPECT_TRUE(longer(run.estimate(), run.counted(rounding_cause()).estimate).empty());
}

TEST(FieldScatterCause, CountsAFieldWhoseSizeJitters) {
  Observations observations = good_run(4, 7);
  const SensorModel truth = test::accelerometer_truth();
  RandomStream random(8);
  for (Eigen::Index i = 0; i < observations.size(); ++i) {
    const double size = 1.0 + 1e-3 * random.normal();
    const Eigen::RowVectorXd sensed =
        observations.response.row(i) - truth.response.bias.transpose();
    observations.response.row(i) = truth.response.bias.transpose() + size * sensed;
  }
  const OneCause run(experiment(), observations);
  const CountedEstimate counted = run.counted(field_scatter_cause());
  EXPECT_TRUE(is_component(counted.estimate, "field_noise"));
  const std::vector<Eigen::Index> found = longer(run.estimate(), counted.estimate);
  EXPECT_TRUE(std::find(found.begin(), found.end(), 1) != found.end());
}

TEST(CorrelationCause, CountsReadingsThatAreAlike) {
  Observations observations = good_run(4, 9);
  RandomStream random(10);
  double state = 0.0;
  for (Eigen::Index i = 0; i < observations.size(); ++i) {
    state = 0.9 * state + 5.0 * run_noise * random.normal();
    observations.response.row(i).array() += state;
  }
  const OneCause run(experiment(), observations);
  const CountedEstimate counted = run.counted(correlation_cause());
  EXPECT_TRUE(is_component(counted.estimate, "correlation"));
  const std::vector<Eigen::Index> found = longer(run.estimate(), counted.estimate);
  EXPECT_TRUE(std::find(found.begin(), found.end(), 0) != found.end());
  EXPECT_TRUE(std::find(found.begin(), found.end(), 1) == found.end());
}

TEST(MountsCause, SaysNothingWithoutMounts) {
  const OneCause run(experiment(), good_run(2, 11));
  const CountedEstimate counted = run.counted(mounts_cause());
  EXPECT_FALSE(counted.mounts_counted);
  EXPECT_TRUE(longer(run.estimate(), counted.estimate).empty());
}

TEST(InputsAndSeatsCause, SharesUncertainFaceNormals) {
  Experiment with = experiment();
  with.positioner = test::uncertain_cube(5e-4);
  const OneCause run(with, good_run(2, 12));
  const CountedEstimate counted = run.counted(inputs_and_seats_cause());
  ASSERT_EQ(counted.weighed.size(), 1U);
  EXPECT_EQ(counted.weighed.front().name, "positioner");
  EXPECT_EQ(counted.weighed.front().covariance.rows(), 12);
  EXPECT_GT(counted.weighed.front().covariance(0, 0), 0.0);
}

TEST(InputsAndSeatsCause, FindsACubeThatIsLaidAnew) {
  Observations observations = good_run(4, 13);
  const SensorModel truth = test::accelerometer_truth();
  RandomStream random(14);
  for (Eigen::Index i = 0; i < observations.size(); ++i) {
    const Eigen::Vector3d turn = 1e-3 * random.normals<3>();
    const Eigen::Vector3d field = Eigen::Matrix3d(truth.response.sensitivity).inverse() *
                                  (observations.response.row(i).transpose() - truth.response.bias);
    observations.response.row(i) += (truth.response.sensitivity * turn.cross(field)).transpose();
  }
  const OneCause run(experiment(), observations);
  const CountedEstimate counted = run.counted(inputs_and_seats_cause());
  const auto& components = counted.estimate.statistics.components;
  ASSERT_TRUE(is_component(counted.estimate, "seats"));
  EXPECT_NEAR(components.front().sd(0), 1e-3, 2.5e-4);
}

TEST(CausesOfScatter, AreCountedInTheirOrder) {
  const std::span<const Cause> causes = causes_of_scatter();
  ASSERT_GE(causes.size(), 9U);
  EXPECT_EQ(causes[0].name, "inputs_and_seats");
  EXPECT_TRUE(causes[0].changes_fit);
  EXPECT_EQ(causes[1].name, "mounts");
  EXPECT_EQ(causes[8].name, "correlation");
  EXPECT_FALSE(causes[8].changes_fit);
}

}  // namespace
}  // namespace axiscal
