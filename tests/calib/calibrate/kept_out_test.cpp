// SPDX-License-Identifier: Apache-2.0
// Tests by readings that are not in the fit: confirmation, size of the field, later labelled
// readings.
#include <algorithm>
#include <cmath>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/labelled_check.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

constexpr double run_noise = 1e-4;

// A run of 24 points; every third reading has `confirm`.
Observations with_confirmation(const SensorModel& truth, std::uint64_t seed) {
  Observations all =
      observe(truth, {.points = 24, .slope = {0.003, -0.002}, .noise_sd = run_noise, .seed = seed});
  for (std::size_t i = 2; i < all.readings.size(); i += 3) {
    all.readings[i].confirm = true;
  }
  return all;
}

Experiment experiment_by_joint(const SensorModel& truth) {
  Experiment experiment = experiment_for(truth);
  experiment.fit.method = Method::joint;
  return experiment;
}

TEST(Confirmation, KeepsItsReadingsOutOfTheFit) {
  const SensorModel truth = accelerometer_truth();
  Observations all = with_confirmation(truth, 1);
  const Calibration before = calibrate(experiment_by_joint(truth), all);
  ASSERT_TRUE(before.findings.confirmation);
  EXPECT_EQ(before.findings.confirmation->readings.size(), 8U);
  EXPECT_TRUE(before.findings.confirmation->passed);
  EXPECT_EQ(before.fit.statistics->observations, 16);
  EXPECT_FALSE(before.fit.residuals[2].used);
  all.response.row(2).array() += 10.0 * run_noise;
  all.response.row(5).array() -= 10.0 * run_noise;
  const Calibration after = calibrate(experiment_by_joint(truth), all);
  EXPECT_MATRIX_NEAR(after.sensor.response.sensitivity, before.sensor.response.sensitivity, 0.0);
  EXPECT_FALSE(after.findings.confirmation->passed);
  EXPECT_FALSE(after.findings.confirmation->readings.front().within);
}

// If the field is known, the intervals are those of a linear regression's prediction (Draper &
// Smith, sec. 3.1).
TEST(Confirmation, HasTheIntervalsOfATextbook) {
  const SensorModel truth = accelerometer_truth();
  Observations all = observe(truth, {.points = 24, .noise_sd = run_noise, .seed = 4});
  all.readings[7].confirm = true;
  Experiment experiment = experiment_for(truth);
  experiment.fit.method = Method::known;
  const Calibration found = calibrate(experiment, all);
  Eigen::MatrixXd X(23, 4);
  Eigen::VectorXd y(23);
  Eigen::RowVector4d x;
  double v = 0.0;
  for (std::size_t i = 0, row = 0; i < 24; ++i) {
    const Eigen::Vector3d f =
        Positioner().rotation_table_from_positioner(*all.readings[i].point).transpose().col(2);
    const Eigen::RowVector4d one(1.0, f.x(), f.y(), f.z());
    if (i == 7) {
      x = one;
      v = all.response(7, 0);
    } else {
      X.row(static_cast<Eigen::Index>(row)) = one;
      y(static_cast<Eigen::Index>(row++)) = all.response(static_cast<Eigen::Index>(i), 0);
    }
  }
  const Eigen::Matrix4d C = (X.transpose() * X).inverse();
  const Eigen::Vector4d b = C * (X.transpose() * y);
  const double s = std::sqrt((y - X * b).squaredNorm() / 19.0);
  const ConfirmationReading& reading = found.findings.confirmation->readings.front();
  EXPECT_NEAR(reading.error(0), v - x.dot(b), 1e-12);
  EXPECT_NEAR(reading.half_width(0),
              student_t_factor(0.95, 19.0) * s * std::sqrt(1.0 + (x * C * x.transpose())(0)), 1e-9);
}

TEST(Confirmation, IsStoredAndReadAgain) {
  const SensorModel truth = accelerometer_truth();
  const Calibration found = calibrate(experiment_by_joint(truth), with_confirmation(truth, 2));
  const std::string text = calibration_json(found);
  EXPECT_EQ(calibration_json(parse_calibration(text, "record")), text);
  EXPECT_THAT(text, testing::HasSubstr("\"confirmation\""));
}

TEST(Confirmation, NeedsReadingsForTheFit) {
  const SensorModel truth = accelerometer_truth();
  Observations all = with_confirmation(truth, 2);
  for (Reading& reading : all.readings) {
    reading.confirm = true;
  }
  EXPECT_THROW(static_cast<void>(calibrate(experiment_by_joint(truth), all)), RefusedError);
}

// Over many runs the scatter of |f| equals the part that noise explains, and alarms are rare.
TEST(FieldSize, IsExplainedByTheNoise) {
  const SensorModel truth = accelerometer_truth();
  double ratio = 0.0;
  int alarms = 0;
  constexpr int runs = 60;
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {
    const Calibration found = calibrate(
        experiment_by_joint(truth),
        observe(truth,
                {.points = 24, .slope = {0.003, -0.002}, .noise_sd = run_noise, .seed = seed}));
    ASSERT_TRUE(found.fit.field_size);
    const FieldSizeCheck& check = *found.fit.field_size;
    EXPECT_EQ(check.orientations, 24);
    EXPECT_EQ(check.by_inputs, 0.0);
    ratio += std::pow(check.relative_sd / check.by_noise, 2) / runs;
    alarms += check.p_value < 0.05 ? 1 : 0;
  }
  EXPECT_NEAR(ratio, 1.0, 0.12);
  EXPECT_LE(alarms, 8);
}

// If repeats determine the noise, the test reports a cube that is worse than stated, and accepts
// one that is as stated.
TEST(FieldSize, ShowsACubeThatIsWorseThanStated) {
  const SensorModel truth = accelerometer_truth();
  const auto check_with = [&](double error_rad, double stated_rad) {
    std::vector<Face> faces(all_faces.begin(), all_faces.end());
    std::array<Eigen::Vector3d, 6> normals;
    RandomStream random(3);
    for (std::size_t f = 0; f < 6; ++f) {
      const Eigen::Vector3d n = nominal_normal(all_faces[f]);
      const Eigen::Vector3d turn = error_rad * random.normals<3>();
      normals[f] = (n + turn.cross(n)).normalized();
    }
    SimulationOptions options{.noise_sd = 1e-6};
    options.positioner = Positioner(normals);
    const Observations readings =
        simulate(truth, make_run_sheet(standard_design(24), 3, 5), options);
    Experiment experiment = experiment_by_joint(truth);
    experiment.positioner = stated_rad > 0.0 ? uncertain_cube(stated_rad) : Positioner();
    return *calibrate(experiment, readings).fit.field_size;
  };
  const FieldSizeCheck worse = check_with(3e-4, 3e-6);
  EXPECT_LT(worse.p_value, 0.001);
  const FieldSizeCheck stated = check_with(3e-4, 3e-4);
  EXPECT_GT(stated.p_value, 0.01);
  EXPECT_GT(stated.by_inputs, 0.3 * stated.relative_sd);
}

TEST(CheckLabelled, TakesThreeReadings) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_by_joint(truth);
  Calibration record;
  int alarms = 0;
  constexpr int runs = 100;
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {  // few degrees of freedom: many runs
    experiment.fit.method = seed % 2 == 0 ? Method::paired : Method::joint;
    record = calibrate(experiment, observe(truth, {.points = 24,
                                                   .slope = {0.003, -0.002},
                                                   .noise_sd = run_noise,
                                                   .seed = 1000 + seed}));
    const Observations all = observe(
        truth, {.points = 12, .slope = {-0.004, 0.001}, .noise_sd = run_noise, .seed = 100 + seed});
    const Observations three = select_rows(all, {0, 4, 8});
    const DriftCheck check = check_labelled(record, experiment, three, 0.05);
    alarms += check.drifted ? 1 : 0;
  }
  EXPECT_LE(alarms, 12);  // expected: 5
  Observations shifted =
      select_rows(observe(truth, {.points = 12, .noise_sd = run_noise, .seed = 300}), {0, 1, 4, 8});
  shifted.response.col(1).array() += 20.0 * run_noise;
  const DriftCheck drifted = check_labelled(record, experiment, shifted);
  EXPECT_TRUE(drifted.drifted);
  EXPECT_EQ(drifted.changes[1].parameter, "y.bias");
  EXPECT_NEAR(drifted.changes[1].new_value - drifted.changes[1].old_value, 20.0 * run_noise,
              4.0 * drifted.changes[1].u);
  EXPECT_THROW(static_cast<void>(check_labelled(record, experiment, select_rows(shifted, {0}))),
               RefusedError);
  // Three readings of one point do not determine the direction. Faces without a fence do not
  // determine the pose.
  EXPECT_THROW(
      static_cast<void>(check_labelled(record, experiment, select_rows(shifted, {0, 0, 0}))),
      RefusedError);
  shifted.has_fence = false;
  EXPECT_THROW(static_cast<void>(check_labelled(record, experiment, shifted)), RefusedError);
}

}  // namespace
}  // namespace axiscal::test
