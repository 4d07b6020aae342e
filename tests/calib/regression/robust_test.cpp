// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/robust.hpp"

#include <cmath>

#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using test::accelerometer_truth;
using test::experiment_for;
using test::observe;

TEST(BisquareWeights, FollowTheirFormula) {
  Eigen::VectorXd residuals(9);
  residuals << -0.4, 0.1, 0.2, -0.1, 0.3, -0.2, 0.05, 20.0, -0.3;
  const Eigen::VectorXd leverage = Eigen::VectorXd::Constant(9, 0.19);  // sqrt(1 - h) = 0.9
  const BisquareWeights result = bisquare_weights(residuals, leverage, 1.0);
  const double s = 0.2 / 0.9 / 0.6745;  // the median of nine absolute residuals is 0.2
  EXPECT_NEAR(result.scale, s, 1e-15);
  const double u = -0.4 / 0.9 / (4.685 * s);
  EXPECT_NEAR(result.weights(0), std::pow(1.0 - u * u, 2), 1e-15);
  EXPECT_EQ(result.weights(7), 0.0);
  EXPECT_THROW(static_cast<void>(bisquare_weights(residuals, leverage, 9.0)), DomainError);
}

TEST(BisquareWeights, LeaveExactDataAlone) {
  const BisquareWeights result =
      bisquare_weights(Eigen::VectorXd::Zero(6), Eigen::VectorXd::Constant(6, 0.5), 3.0);
  EXPECT_EQ(result.weights, Eigen::VectorXd::Ones(6));
}

class RobustCalibration : public testing::TestWithParam<Method> {};

TEST_P(RobustCalibration, ResistsAnOutlierAndCostsLittleWithout) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  experiment.fit.method = GetParam();
  if (GetParam() == Method::known) {
    experiment.table.slope = {0.002, -0.001};
  }
  Observations observations =
      observe(truth, {.replicates = 3, .slope = {0.002, -0.001}, .noise_sd = 1e-4, .seed = 5});
  const auto error = [&](bool robust) {
    experiment.fit.robust = robust;
    const Calibration result = calibrate(experiment, observations);
    EXPECT_EQ(result.fit.robust, robust);
    return (result.sensor.response.sensitivity - truth.response.sensitivity).cwiseAbs().maxCoeff();
  };
  EXPECT_LT(error(true), 3.0 * error(false) + 1e-5);
  observations.response(4, 1) += 0.5;
  EXPECT_GT(error(false), 1e-2);
  EXPECT_LT(error(true), 2e-4);
  const Calibration result = calibrate(experiment, observations);
  // The wrong reading has weight 0. The other weights are large.
  EXPECT_EQ((result.fit.statistics->robust_weight.col(1).array() == 0.0).count(), 1);
  ASSERT_EQ(result.findings.notes.size(), 2U);  // the other note is on inputs that are not counted
  EXPECT_THAT(result.findings.notes[0].message,
              testing::HasSubstr("robust regression ignores the readings of axis y"));
  EXPECT_GT(result.fit.statistics->studentized.col(1).cwiseAbs().maxCoeff(), 100.0)
      << "what has no weight must show in the residuals";
  EXPECT_LT(result.fit.statistics->residual_sd(1), 3e-4);
}

INSTANTIATE_TEST_SUITE_P(Methods,
                         RobustCalibration,
                         testing::Values(Method::paired, Method::joint, Method::known),
                         [](const testing::TestParamInfo<Method>& test_case) {
                           return std::string(method_name(test_case.param));
                         });

TEST(RobustCalibration, NeedsReadingsToSpare) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  experiment.fit.robust = true;
  experiment.fit.method = Method::known;
  Observations observations = observe(truth, {.points = 6});
  experiment.leave_out = {1};
  EXPECT_THROW(static_cast<void>(calibrate(experiment, observations)), RefusedError);
}

}  // namespace
}  // namespace axiscal
