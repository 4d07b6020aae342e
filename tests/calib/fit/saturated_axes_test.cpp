// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/saturated_axes.hpp"

#include <cmath>
#include <random>
#include <utility>

#include <gtest/gtest.h>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/positioner/design.hpp"

namespace axiscal {
namespace {

Experiment on_a_table() {
  Experiment experiment;
  experiment.instrument = {.kind = "accelerometer", .axes = {"x", "y", "z"}, .unit = "V"};
  experiment.field.of = make_field("gravity");
  return experiment;
}

// Readings of an accelerometer of 1 V/g with noise of `sd`. `change` is applied to each value.
template <typename Change>
Observations readings_of(int blocks, double sd, std::mt19937_64& random, Change change) {
  std::normal_distribution<double> normal(0.0, sd);
  Observations observations;
  observations.response.resize(12 * blocks, 3);
  Eigen::Index i = 0;
  for (int block = 1; block <= blocks; ++block) {
    for (const DesignEntry& entry : standard_design(12)) {
      const Eigen::Vector3d f =
          Positioner().rotation_table_from_positioner(entry.point).transpose() *
          Eigen::Vector3d(0.003, -0.002, 1.0).normalized();
      for (Eigen::Index k = 0; k < 3; ++k) {
        observations.response(i, k) = change(0.01 + f(k) + normal(random));
      }
      ++i;
      observations.readings.push_back(
          {.run = static_cast<int>(i), .block = block, .point = entry.point});
    }
  }
  return observations;
}

bool says_saturated(const Calibration& calibration) {
  for (const CalibrationWarning& warning : calibration.findings.warnings) {
    if (warning.code == WarningCode::saturated) {
      return true;
    }
  }
  return false;
}

// At most 0.2 % of good runs may be called saturated. With an earlier rule (three equal extremes)
// it was 72 % at a step of two standard deviations.
TEST(SaturatedAxes, AreNotSeenInDigitalReadings) {
  std::mt19937_64 random(1907);
  constexpr double sd = 1e-4;
  for (const double steps : {0.2, 0.5, 1.0, 2.0, 5.0, 10.0}) {
    const double step = steps * sd;
    int false_alarms = 0;
    for (int run = 0; run < 150; ++run) {
      const Observations observations =
          readings_of(2, sd, random, [&](double v) { return step * std::round(v / step); });
      false_alarms += says_saturated(calibrate(on_a_table(), observations)) ? 1 : 0;
    }
    EXPECT_LE(false_alarms, 1) << "step of " << steps << " standard deviations";
  }
}

TEST(SaturatedAxes, AreSeenWhereReadingsStopShort) {
  std::mt19937_64 random(1908);
  int found = 0;
  for (int run = 0; run < 50; ++run) {
    const Observations observations =
        readings_of(2, 1e-4, random, [](double v) { return std::min(v, 1.01 - 10e-4); });
    found += says_saturated(calibrate(on_a_table(), observations)) ? 1 : 0;
  }
  EXPECT_GE(found, 49);  // 100 % in a study of 1,000 runs
}

// Means of equal values over different numbers of samples may differ in their last bit.
TEST(SaturatedAxes, AreSeenWhereTheEndDiffersInItsLastBit) {
  std::mt19937_64 random(1910);
  constexpr double end = 1.65 + 0.08 * (1.01 - 20e-4);
  double next_end = end;
  const Observations observations = readings_of(1, 1e-4, random, [&](double v) {
    const double volts = 1.65 + 0.08 * v;
    return volts < end ? volts : std::exchange(next_end, std::nextafter(next_end, 0.0));
  });
  EXPECT_NE(next_end, end);
  EXPECT_TRUE(says_saturated(calibrate(on_a_table(), observations)));
}

TEST(SaturatedAxes, AreSeenWithoutDirections) {
  std::mt19937_64 random(1909);
  std::normal_distribution<double> normal(0.0, 1.0);
  Experiment experiment = on_a_table();
  experiment.fit.method = Method::magnitude;
  for (const double limit : {2.0, 0.97}) {
    Observations observations;
    observations.response.resize(200, 3);
    for (Eigen::Index i = 0; i < 200; ++i) {
      const Eigen::Vector3d f =
          Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
      for (Eigen::Index k = 0; k < 3; ++k) {
        const double v = std::min(f(k) + 1e-3 * normal(random), limit);
        observations.response(i, k) = 1e-3 * std::round(1e3 * v);
      }
      observations.readings.push_back({.run = static_cast<int>(i) + 1});
    }
    EXPECT_EQ(says_saturated(calibrate(experiment, observations)), limit < 1.0);
  }
}

}  // namespace
}  // namespace axiscal
