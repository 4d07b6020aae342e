// SPDX-License-Identifier: Apache-2.0
// The first readings of poses are left out if they have not settled. They are kept if there is a
// drift or correlated noise only.
#include "calib/calibrate/src/unsettled_readings.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "axiscal/calib/calibrate.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

constexpr double reading_noise = 2e-4;
constexpr int rows_each = 5;

// A run of 12 poses with five readings each. Each reading has its own noise.
Observations rows_of_poses(std::uint64_t seed) {
  const Observations run = test::observe(test::accelerometer_truth(), {.noise_sd = 0.0});
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < run.readings.size(); ++i) {
    rows.insert(rows.end(), rows_each, i);
  }
  Observations all = select_rows(run, rows);
  RandomStream random(seed, 0);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    all.readings[i].run = static_cast<int>(i) + 1;
    const Eigen::Vector3d noise = random.normals<3>();
    all.response.row(static_cast<Eigen::Index>(i)) += reading_noise * noise.transpose();
  }
  return all;
}

// Adds an error that decays within each pose. Its sign differs between poses.
void unsettle(double size, Observations& run) {
  for (Eigen::Index i = 0; i < run.size(); ++i) {
    const Eigen::Index laying = i / rows_each;
    const double sign = laying % 3 == 0 ? -1.0 : 1.0;
    run.response.row(i).array() +=
        sign * size * std::exp(-static_cast<double>(i % rows_each) / 0.4);
  }
}

bool names_unsettled(const Observations& run) {
  const Experiment experiment = test::experiment_for(test::accelerometer_truth());
  return find_unsettled(PreparedRun(experiment, run)).has_value();
}

TEST(Unsettled, LeavesOutTheFirstReadingsOfEachPose) {
  Observations run = rows_of_poses(1);
  unsettle(10.0 * reading_noise, run);
  const Calibration record = calibrate(test::experiment_for(test::accelerometer_truth()), run);
  ASSERT_FALSE(record.findings.warnings.empty());
  const CalibrationWarning& warning = record.findings.warnings.front();
  EXPECT_EQ(warning.code, WarningCode::unsettled);
  EXPECT_THAT(warning.message, testing::HasSubstr("the first reading differs"));
  EXPECT_EQ(warning.runs.size(), 12U);
  EXPECT_EQ(warning.runs[1], 6);
  const Eigen::VectorXd off =
      record.sensor.response.bias - test::accelerometer_truth().response.bias;
  EXPECT_LT(off.cwiseAbs().maxCoeff(), 5.0 * reading_noise / std::sqrt(48.0));
}

TEST(Unsettled, AreNotReadingsThatDriftOrAreCorrelated) {
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Observations run = rows_of_poses(seed);
    RandomStream random(seed, 1);
    Eigen::Vector3d slow = Eigen::Vector3d::Zero();
    for (Eigen::Index i = 0; i < run.size(); ++i) {
      const Eigen::Vector3d step = random.normals<3>();
      slow = 0.9 * slow + 2.0 * reading_noise * step;
      run.response.row(i) += slow.transpose();
      run.response.row(i).array() += 0.1 * reading_noise * static_cast<double>(i);
    }
    found += names_unsettled(run) ? 1 : 0;
  }
  EXPECT_LE(found, 2);
}

// A run that the experiment already leaves out is not reported as left out.
TEST(Unsettled, MayBeLeftOutByTheExperimentToo) {
  Observations run = rows_of_poses(1);
  unsettle(10.0 * reading_noise, run);
  Experiment experiment = test::experiment_for(test::accelerometer_truth());
  experiment.leave_out = {1, 7};
  const Calibration record = calibrate(experiment, run);
  ASSERT_FALSE(record.findings.warnings.empty());
  EXPECT_EQ(record.findings.warnings.front().code, WarningCode::unsettled);
}

TEST(Unsettled, NeedsFourReadingsOfAPose) {
  const Observations run =
      test::observe(test::accelerometer_truth(), {.replicates = 4, .noise_sd = reading_noise});
  EXPECT_FALSE(names_unsettled(run));
}

}  // namespace
}  // namespace axiscal
