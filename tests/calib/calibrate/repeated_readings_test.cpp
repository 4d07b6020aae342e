// SPDX-License-Identifier: Apache-2.0
// Rows that were pasted twice are named and left out. Readings that are equal by rounding are kept.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "axiscal/calib/calibrate.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

Observations noisy_run(int replicates, std::uint64_t seed = 7) {
  return test::observe(test::accelerometer_truth(),
                       {.points = 12, .replicates = replicates, .noise_sd = 2e-4, .seed = seed});
}

// @return the rows of `run`, followed by copies of the rows `copied`. The run numbers continue.
Observations with_copies(const Observations& run, const std::vector<std::size_t>& copied) {
  std::vector<std::size_t> rows(run.readings.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i] = i;
  }
  rows.insert(rows.end(), copied.begin(), copied.end());
  Observations all = select_rows(run, rows);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    all.readings[i].run = static_cast<int>(i) + 1;
  }
  return all;
}

Calibration calibrated(const Observations& run) {
  return calibrate(test::experiment_for(test::accelerometer_truth()), run);
}

int count_of_repeats(const Calibration& record) {
  int count = 0;
  for (const CalibrationWarning& warning : record.findings.warnings) {
    count += warning.code == WarningCode::repeated_readings ? 1 : 0;
  }
  return count;
}

void round_to(double step, Observations& run) {
  run.response = (run.response.array() / step).round() * step;
}

TEST(RepeatedReadings, NamesABlockThatWasPastedTwiceAndLeavesItOut) {
  const Observations run = noisy_run(1);
  const Calibration plain = calibrated(run);
  const Calibration record = calibrated(with_copies(run, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}));
  ASSERT_FALSE(record.findings.warnings.empty());
  EXPECT_EQ(record.findings.warnings.front().code, WarningCode::repeated_readings);
  EXPECT_THAT(record.findings.warnings.front().message,
              StartsWith("runs 13 to 24 repeat runs 1 to 12 in every digit"));
  EXPECT_EQ(record.findings.status, CalibrationStatus::warning);
  EXPECT_EQ(record.sensor.response.bias, plain.sensor.response.bias);
  EXPECT_EQ(record.fit.statistics->interval_95, plain.fit.statistics->interval_95);
}

TEST(RepeatedReadings, NamesOneRow) {
  const Calibration record = calibrated(with_copies(noisy_run(2), {4}));
  ASSERT_EQ(count_of_repeats(record), 1);
  EXPECT_THAT(record.findings.warnings.front().message,
              StartsWith("run 25 repeats run 5 in every"));
  EXPECT_THAT(record.findings.warnings.front().runs, ElementsAre(25));
}

TEST(RepeatedReadings, NamesRowsIfTheRunNumbersWereCopiedToo) {
  Observations run = with_copies(noisy_run(1), {2, 3, 4});
  for (std::size_t i = 12; i < 15; ++i) {
    run.readings[i].run = run.readings[i - 10].run;
  }
  const Calibration record = calibrated(run);
  ASSERT_EQ(count_of_repeats(record), 1);
  EXPECT_THAT(record.findings.warnings.front().message,
              HasSubstr("runs 13 to 15 repeat runs 3 to 5"));
}

TEST(RepeatedReadings, AreNotReadingsThatRoundingMakesEqual) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    for (const double step : {2e-4, 4e-4, 2e-3}) {
      Observations run = noisy_run(4, seed);
      round_to(step, run);
      EXPECT_EQ(count_of_repeats(calibrated(run)), 0) << step << " seed " << seed;
    }
  }
}

TEST(RepeatedReadings, AreNotReadingsWithoutNoise) {
  const Observations run =
      test::observe(test::accelerometer_truth(), {.points = 12, .replicates = 2, .noise_sd = 0.0});
  EXPECT_EQ(count_of_repeats(calibrated(run)), 0);
}

TEST(RepeatedReadings, AreNotSoughtAmongReadingsThatAreLeftOut) {
  const Observations run = with_copies(noisy_run(2), {4});
  Experiment experiment = test::experiment_for(test::accelerometer_truth());
  experiment.leave_out = {25};
  EXPECT_EQ(count_of_repeats(calibrate(experiment, run)), 0);
}

}  // namespace
}  // namespace axiscal
