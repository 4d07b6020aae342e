// SPDX-License-Identifier: Apache-2.0
// Recordings with correlated consecutive readings.
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <gmock/gmock.h>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/drift_check.hpp"
#include "axiscal/core/random.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using test::accelerometer_truth;

// A recording of an instrument that is turned by hand. The noise of each axis is AR(1) with the
// coefficient `rho`.
Observations hand_motion(const SensorModel& truth, Eigen::Index n, double rho, std::uint64_t seed) {
  RandomStream random(seed);
  Observations run;
  run.response.resize(n, 3);
  Eigen::Vector3d e = random.normals<3>();
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  Eigen::Vector3d rate = random.normals<3>();
  constexpr double step_s = 0.02;
  for (Eigen::Index i = 0; i < n; ++i) {
    rate += 0.2 * random.normals<3>() - 0.02 * rate;
    q = (q * Eigen::Quaterniond(Eigen::AngleAxisd(step_s * rate.norm(), rate.normalized())))
            .normalized();
    e = rho * e + std::sqrt(1.0 - rho * rho) * random.normals<3>();
    run.readings.push_back({.run = static_cast<int>(i) + 1});
    run.response.row(i) = truth.response.at(q.conjugate() * Eigen::Vector3d::UnitZ()) + 1e-3 * e;
  }
  return run;
}

Experiment magnitude_experiment(const SensorModel& truth) {
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.method = Method::magnitude;
  return experiment;
}

TEST(LongRecording, StatesIntervalsThatHoldForCorrelatedNoise) {
  const SensorModel truth = accelerometer_truth();
  int held = 0;
  int all = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const Calibration found =
        calibrate(magnitude_experiment(truth), hand_motion(truth, 4000, 0.9, seed));
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double error = found.sensor.response.bias(k) - truth.response.bias(k);
      held += std::abs(error) <= found.fit.statistics->interval_95(4 * k) ? 1 : 0;
      ++all;
    }
    EXPECT_EQ(found.fit.statistics->components.front().name, "correlation");
  }
  EXPECT_GE(static_cast<double>(held) / all, 0.90);  // nominal: 95 %
}

TEST(LongRecording, HalvesAgree) {
  const SensorModel truth = accelerometer_truth();
  int drifted = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Observations run = hand_motion(truth, 8000, 0.95, seed);
    std::vector<std::size_t> first;
    std::vector<std::size_t> second;
    for (std::size_t i = 0; i < 8000; ++i) {
      (i < 4000 ? first : second).push_back(i);
    }
    const Experiment experiment = magnitude_experiment(truth);
    const DriftCheck check = check_drift(calibrate(experiment, select_rows(run, first)),
                                         calibrate(experiment, select_rows(run, second)));
    drifted += check.drifted ? 1 : 0;
  }
  EXPECT_LE(drifted, 3);
}

TEST(LongRecording, SaysWhenItIsShortForItsNoise) {
  const SensorModel truth = accelerometer_truth();
  const Calibration found =
      calibrate(magnitude_experiment(truth), hand_motion(truth, 1500, 0.995, 3));
  EXPECT_THAT(found.findings.notes,
              test::HasNote(testing::HasSubstr("short relative to the correlation of its noise")));
  const std::string text = calibration_json(found);
  EXPECT_EQ(calibration_json(parse_calibration(text, "again.json")), text);
}

// A thermal sweep up and down. The bias has a hysteresis.
Observations sweep(double hysteresis, double rho, std::uint64_t seed) {
  RandomStream random(seed);
  Observations run;
  constexpr Eigen::Index n = 4000;
  run.response.resize(n, 3);
  Eigen::Vector3d e = random.normals<3>();
  for (Eigen::Index i = 0; i < n; ++i) {
    const double along = static_cast<double>(i) / (n - 1);
    const bool up = along < 0.5;
    const double u = up ? 4.0 * along - 1.0 : 3.0 - 4.0 * along;
    e = rho * e + std::sqrt(1.0 - rho * rho) * random.normals<3>();
    Reading reading{.run = static_cast<int>(i) + 1};
    reading.temperature = 25.0 + 30.0 * u;
    run.readings.push_back(reading);
    const double behind = (up ? hysteresis : -hysteresis) * (1.0 - u * u);
    run.response.row(i) =
        Eigen::RowVector3d::Constant(0.1 * u + 0.02 * u * u + behind) + 1e-3 * e.transpose();
  }
  return run;
}

Calibration swept(const Observations& run) {
  Experiment experiment;
  experiment.instrument.kind = "gyroscope";
  experiment.instrument.unit = "deg/s";
  experiment.field.of = make_field("earth_rotation");
  experiment.field.magnitude = 1.0;
  experiment.fit.method = Method::bias;
  experiment.fit.temperature.automatic = false;
  experiment.fit.temperature.order = 2;
  return calibrate(experiment, run);
}

TEST(ThermalSweep, CountsHysteresisAndNamesIt) {
  const Calibration found = swept(sweep(0.05, 0.5, 1));
  const auto& components = found.fit.statistics->components;
  ASSERT_EQ(components.size(), 2U);
  EXPECT_EQ(components.back().name, "hysteresis");
  EXPECT_NEAR(components.back().sd(0), 0.05, 0.01);
  // At 25 degrees both legs differ from the mean by 0.05, which is within the interval.
  EXPECT_GE(found.fit.statistics->interval_95(0), 0.05);
  EXPECT_LE(found.fit.statistics->interval_95(0), 0.12);
  EXPECT_THAT(found.findings.notes,
              test::HasNote(testing::HasSubstr("hysteresis: the biases at rising")));
  const std::string text = calibration_json(found);
  EXPECT_EQ(calibration_json(parse_calibration(text, "again.json")), text);
}

TEST(ThermalSweep, WithoutHysteresisHasNone) {
  int named = 0;
  int held = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const Calibration found = swept(sweep(0.0, 0.9, seed));
    named += found.fit.statistics->components.size() > 1 ? 1 : 0;
    for (Eigen::Index k = 0; k < 3; ++k) {
      held += std::abs(found.sensor.response.bias(k)) <= found.fit.statistics->interval_95(3 * k)
                  ? 1
                  : 0;
    }
  }
  EXPECT_LE(named, 6);
  EXPECT_GE(held, 160);  // out of 180
}

}  // namespace
}  // namespace axiscal
