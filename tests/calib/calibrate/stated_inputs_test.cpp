// SPDX-License-Identifier: Apache-2.0
// Notes on inputs that are not stated or contradict the readings; the lag of a filter.
#include <cmath>
#include <memory>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/field/custom_field.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

int count_of(const Calibration& record, NoteCode code) {
  int count = 0;
  for (const CalibrationNote& note : record.findings.notes) {
    count += note.code == code ? 1 : 0;
  }
  return count;
}

TEST(StatedInputs, AResolutionThatTheReadingsContradictIsTold) {
  Observations run = test::observe(test::accelerometer_truth(),
                                   {.slope = {0.004, -0.003}, .noise_sd = 1e-3, .seed = 3});
  run.response = (run.response.array() / 1e-3).round() * 1e-3;
  Experiment experiment = test::experiment_for(test::accelerometer_truth());
  experiment.stated.resolution = 1e-3;
  EXPECT_EQ(count_of(calibrate(experiment, run), NoteCode::stated), 0);
  experiment.stated.resolution = 5e-3;
  EXPECT_EQ(count_of(calibrate(experiment, run), NoteCode::stated), 1);
}

TEST(StatedInputs, ThoseWithoutAnUncertaintyAreNamed) {
  const Observations run =
      test::observe(test::accelerometer_truth(), {.noise_sd = 2e-4, .seed = 3});
  const Calibration record = calibrate(test::experiment_for(test::accelerometer_truth()), run);
  ASSERT_EQ(count_of(record, NoteCode::not_counted), 1);
}

// 300 readings of a field of length 1, which turns by 0.01 to 0.2 rad between readings. If
// `filtered`, each reading is the mean of the present and the previous one.
Observations filtered_turns(bool filtered) {
  constexpr int count = 300;
  Observations run;
  run.response.resize(count, 3);
  RandomStream random(7, 0);
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  double turned = 0.0;
  for (int i = 0; i < count; ++i) {
    turned += 0.1 + 0.09 * std::sin(0.37 * i);
    const double height = std::cos(0.31 * turned);
    const double side = std::sqrt(1.0 - height * height);
    const Eigen::Vector3d noise = random.normals<3>();
    const Eigen::Vector3d reading =
        Eigen::Vector3d(side * std::cos(turned), side * std::sin(turned), height) +
        Eigen::Vector3d(0.1, -0.2, 0.05) + 2e-4 * noise;
    run.response.row(i) =
        (filtered && i > 0 ? Eigen::Vector3d(0.5 * (reading + before)) : reading).transpose();
    before = reading;
    Reading& one = run.readings.emplace_back();
    one.run = i + 1;
  }
  return run;
}

TEST(StatedInputs, TheLagOfAFilterIsFitted) {
  Experiment experiment;
  experiment.instrument.kind = "magnetometer";
  experiment.field = std::make_shared<CustomField>();
  experiment.field.magnitude = 1.0;
  experiment.fit.method = Method::magnitude;
  for (const bool filtered : {false, true}) {
    const Calibration record = calibrate(experiment, filtered_turns(filtered));
    bool is_told = false;
    for (const CalibrationNote& note : record.findings.notes) {
      is_told = is_told || note.message.find("lag behind the field") != std::string::npos;
    }
    EXPECT_EQ(is_told, filtered);
    const Eigen::Matrix3d off =
        Eigen::Matrix3d(record.sensor.response.sensitivity) - Eigen::Matrix3d::Identity();
    EXPECT_LT(off.cwiseAbs().maxCoeff(), 3e-4) << filtered;
  }
}

}  // namespace
}  // namespace axiscal
