// SPDX-License-Identifier: Apache-2.0
// Properties of the readings' form on which the result must not depend.
#include <algorithm>
#include <numeric>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/core/random.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using test::accelerometer_truth;
using test::experiment_for;
using test::observe;

class Invariance : public testing::TestWithParam<Method> {
 protected:
  Invariance() {
    experiment_.fit.method = GetParam();
    if (GetParam() == Method::known) {
      experiment_.table.slope = {0.004, -0.003};
    }
  }

  const SensorModel truth_ = accelerometer_truth();
  Experiment experiment_ = experiment_for(truth_);
  const Observations observations_ =
      observe(truth_, {.replicates = 2, .slope = {0.004, -0.003}, .noise_sd = 1e-4, .seed = 77});
};

TEST_P(Invariance, OfTheOrderOfRows) {
  std::vector<std::size_t> order(observations_.readings.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  RandomStream(3).shuffle(std::span(order));
  Observations permuted = observations_;
  for (std::size_t i = 0; i < order.size(); ++i) {
    permuted.readings[i] = observations_.readings[order[i]];
    permuted.response.row(static_cast<Eigen::Index>(i)) =
        observations_.response.row(static_cast<Eigen::Index>(order[i]));
  }
  const Calibration a = calibrate(experiment_, observations_);
  const Calibration b = calibrate(experiment_, permuted);
  EXPECT_MATRIX_NEAR(a.sensor.response.sensitivity, b.sensor.response.sensitivity, 1e-13);
  EXPECT_MATRIX_NEAR(a.sensor.response.bias, b.sensor.response.bias, 1e-13);
  EXPECT_MATRIX_NEAR(a.fit.statistics->covariance, b.fit.statistics->covariance, 1e-16);
  EXPECT_NEAR(a.fit.levelness->p_value, b.fit.levelness->p_value, 1e-8);
}

TEST_P(Invariance, OfTheNamesOfTheAxes) {
  // The columns are written in the order z, x, y. The rows of S have the same order.
  const std::vector<Eigen::Index> from = {2, 0, 1};
  Experiment experiment = experiment_;
  Observations observations = observations_;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::Index old = from[static_cast<std::size_t>(k)];
    experiment.instrument.axes[static_cast<std::size_t>(k)] =
        experiment_.instrument.axes[static_cast<std::size_t>(old)];
    observations.response.col(k) = observations_.response.col(old);
  }
  const Calibration a = calibrate(experiment_, observations_);
  const Calibration b = calibrate(experiment, observations);
  EXPECT_EQ(b.findings.status, CalibrationStatus::ok)
      << "the axes are named, so that none is exchanged";
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::Index old = from[static_cast<std::size_t>(k)];
    EXPECT_MATRIX_NEAR(b.sensor.response.sensitivity.row(k), a.sensor.response.sensitivity.row(old),
                       1e-12);
    EXPECT_NEAR(b.fit.statistics->residual_sd(k), a.fit.statistics->residual_sd(old), 1e-12);
  }
}

TEST_P(Invariance, OfTheUnitOfTheReadings) {
  Experiment experiment = experiment_;
  Observations observations = observations_;
  observations.response *= 1000.0;
  experiment.instrument.unit = "mV";
  const Calibration a = calibrate(experiment_, observations_);
  const Calibration b = calibrate(experiment, observations);
  EXPECT_MATRIX_NEAR(b.sensor.response.sensitivity / 1000.0, a.sensor.response.sensitivity, 1e-12);
  EXPECT_MATRIX_NEAR(b.fit.statistics->sensitivity_se / 1000.0, a.fit.statistics->sensitivity_se,
                     1e-14);
  EXPECT_NEAR(b.fit.levelness->mean_x, a.fit.levelness->mean_x, 1e-13);
}

TEST_P(Invariance, OfTheUnitOfTheField) {
  Experiment experiment = experiment_;
  experiment.field.unit = "m/s^2";
  experiment.field.magnitude = 9.80665;
  const Calibration a = calibrate(experiment_, observations_);
  const Calibration b = calibrate(experiment, observations_);
  EXPECT_MATRIX_NEAR(b.sensor.response.sensitivity * 9.80665, a.sensor.response.sensitivity, 1e-12);
  EXPECT_MATRIX_NEAR(b.sensor.response.bias, a.sensor.response.bias, 1e-13);
  EXPECT_MATRIX_NEAR(*b.sensor.field.in_table / 9.80665, *a.sensor.field.in_table, 1e-13);
}

// The instrument is turned by G in the cube and the faces are relabelled by G. S becomes S G^T.
TEST_P(Invariance, OfHowTheInstrumentSitsInTheCube) {
  const Positioner cube;
  const Eigen::Matrix3d G = cube.rotation_table_from_positioner({Face::plus_x, Face::minus_z});
  const auto turned = [&](Face face) {
    const Eigen::Vector3d normal = G * nominal_normal(face);
    return *std::find_if(all_faces.begin(), all_faces.end(),
                         [&](Face other) { return nominal_normal(other) == normal; });
  };
  Observations observations = observations_;
  for (Reading& reading : observations.readings) {
    reading.point = DesignPoint(turned(reading.point->rest()), turned(reading.point->fence()));
  }
  const Calibration a = calibrate(experiment_, observations_);
  const Calibration b = calibrate(experiment_, observations);
  EXPECT_MATRIX_NEAR(b.sensor.response.sensitivity * G, a.sensor.response.sensitivity, 1e-12);
  EXPECT_MATRIX_NEAR(b.sensor.response.bias, a.sensor.response.bias, 1e-12);
  EXPECT_NEAR(b.fit.levelness->mean_x, a.fit.levelness->mean_x, 1e-12);
  EXPECT_NEAR(b.fit.levelness->mean_y, a.fit.levelness->mean_y, 1e-12);
  // If the mount states the turn (rotation_sensor_from_positioner = G^T), S does not change.
  Experiment mounted = experiment_;
  mounted.rotation_sensor_from_positioner = G.transpose();
  const Calibration c = calibrate(mounted, observations);
  EXPECT_MATRIX_NEAR(c.sensor.response.sensitivity, a.sensor.response.sensitivity, 1e-12);
}

TEST_P(Invariance, OfTheNumbersOfTheBlocks) {
  Observations observations = observations_;
  for (Reading& reading : observations.readings) {
    reading.block = 10 - reading.block;
  }
  const Calibration a = calibrate(experiment_, observations_);
  const Calibration b = calibrate(experiment_, observations);
  EXPECT_MATRIX_NEAR(a.sensor.response.sensitivity, b.sensor.response.sensitivity, 1e-13);
}

INSTANTIATE_TEST_SUITE_P(Methods,
                         Invariance,
                         testing::Values(Method::paired, Method::joint, Method::known),
                         [](const testing::TestParamInfo<Method>& test_case) {
                           return std::string(method_name(test_case.param));
                         });

}  // namespace
}  // namespace axiscal
