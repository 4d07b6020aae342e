// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/reading_step.hpp"

#include <cmath>

#include "axiscal/core/random.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

// Readings with noise of sd 1 about 12 values. They are rounded to `step` and printed with the last
// digit `digits`; 0: neither.
std::vector<double> readings_of(double step, double digits, std::uint32_t seed) {
  RandomStream random(seed);
  std::vector<double> readings;
  for (int i = 0; i < 24; ++i) {
    double value = 1000.0 * (i % 12) + random.normal();
    if (step > 0.0) {
      value = step * std::round(value / step);
    }
    readings.push_back(digits > 0.0 ? std::round(value / digits) * digits : value);
  }
  return readings;
}

TEST(ReadingStep, OfLastDigitsIsFound) {
  EXPECT_EQ(detect_rounding_step({1.25, 2.5, 3.75, 5.0, 7.5, 11.25, 20.0, 26.25}, 0.0), 1.25);
  // Four even readings are too few to infer a step of 2.
  EXPECT_EQ(detect_rounding_step({2.0, 4.0, 8.0, 14.0}, 0.0, 0.1), 1.0);
  EXPECT_EQ(detect_rounding_step({2.0, 4.0, 8.0, 14.0}, 0.5), 0.5) << "it was stated";
}

TEST(ReadingStep, OfCountsTimesAFactorIsFound) {
  for (const double step : {1.3, std::sqrt(2.0), 4.7}) {
    for (std::uint32_t seed = 1; seed <= 5; ++seed) {
      const auto exact = detect_rounding_step(readings_of(step, 0.0, seed), 0.0, 1.0);
      ASSERT_TRUE(exact);
      EXPECT_NEAR(*exact, step, 1e-9);
      const auto printed = detect_rounding_step(readings_of(step, 1e-4, seed), 0.0, 1.0);
      ASSERT_TRUE(printed);
      EXPECT_NEAR(*printed, step, 1e-4);
    }
  }
}

TEST(ReadingStep, OfContinuousReadingsIsNoMoreThanTheirLastDigit) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    EXPECT_FALSE(detect_rounding_step(readings_of(0.0, 0.0, seed), 0.0, 1.0));
    EXPECT_NEAR(detect_rounding_step(readings_of(0.0, 1e-3, seed), 0.0, 1.0).value_or(0.0), 1e-3,
                1e-12);
  }
}

// Readings of a meter that changes its range: the step is 2.5 mV above 0.5 V and 0.25 mV below.
TEST(StepsOfResponses, FindsAWiderStepOfLargeReadings) {
  const Eigen::MatrixXd response = (Eigen::MatrixXd(8, 3) << 2.5175, -0.01225, 0.04875,  //
                                    -2.4925, 0.0215, -0.03775,                           //
                                    2.515, -0.01475, 0.05225,                            //
                                    0.0315, 2.6025, -0.0105,                             //
                                    -0.02775, -2.5875, 0.00825,                          //
                                    0.03675, 2.605, -0.00625,                            //
                                    0.01425, -0.06175, 2.3975,                           //
                                    -0.01675, 0.05825, -2.4025)
                                       .finished();
  const Eigen::MatrixXd steps = detect_rounding_steps(response, Eigen::MatrixXd::Ones(8, 3), 0.0,
                                                      Eigen::Vector3d::Constant(1e-4));
  for (Eigen::Index i = 0; i < 8; ++i) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double expected = std::abs(response(i, k)) > 0.5 ? 2.5e-3 : 2.5e-4;
      EXPECT_NEAR(steps(i, k), expected, 1e-9) << i << ' ' << k;
    }
  }
}

// On a level table each axis has only four values. They do not show the step of 0.005, but those of
// all axes do.
TEST(StepsOfResponses, FindsAStepThatOnlyAllAxesShow) {
  Eigen::MatrixXd response(4, 3);
  response << 2.545, 0.035, -0.02,  //
      -2.455, 0.015, 0.065,         //
      0.01, 2.36, 0.03,             //
      0.005, -2.485, 2.51;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::VectorXd axis = response.col(k);
    EXPECT_LT(detect_rounding_step({axis.begin(), axis.end()}, 0.0).value_or(0.0), 0.002);
  }
  const Eigen::MatrixXd steps = detect_rounding_steps(response, Eigen::MatrixXd::Ones(4, 3), 0.0,
                                                      Eigen::Vector3d::Constant(2e-4));
  EXPECT_MATRIX_NEAR(steps, Eigen::MatrixXd::Constant(4, 3, 0.005), 1e-9);
}

TEST(StepsOfResponses, IsOneStepIfAllReadingsHaveIt) {
  Eigen::MatrixXd response = Eigen::MatrixXd::Random(30, 3);
  response = (response.array() / 0.004).round() * 0.004;
  const Eigen::MatrixXd steps = detect_rounding_steps(response, Eigen::MatrixXd::Ones(30, 3), 0.0,
                                                      Eigen::Vector3d::Constant(1e-3));
  EXPECT_NEAR(steps.minCoeff(), 0.004, 1e-9);
  EXPECT_NEAR(steps.maxCoeff(), 0.004, 1e-9);
}

}  // namespace
}  // namespace axiscal
