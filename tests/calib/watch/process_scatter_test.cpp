// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/history.hpp"
#include "axiscal/calib/simulate.hpp"
#include "axiscal/core/random.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using test::accelerometer_truth;
using test::experiment_for;

constexpr double noise = 1e-4;
constexpr double block_sd = 5e-4;

Calibration calibrated(const std::string& serial,
                       int blocks,
                       std::uint64_t seed,
                       std::optional<ProcessScatter> process = {}) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  experiment.fit.method = Method::joint;
  experiment.instrument.serial = serial;
  experiment.instrument.model = "M1";
  experiment.fit.process = std::move(process);
  World world;
  world.block_sd = block_sd;
  return calibrate(experiment, simulate(truth, make_run_sheet(standard_design(12), blocks, seed),
                                        {.noise_sd = noise, .world = world, .seed = seed}));
}

TEST(ProcessScatter, PoolsTheBlocksOfEarlierRecords) {
  std::vector<Calibration> records;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    records.push_back(calibrated("A", 3, seed));
  }
  records.push_back(calibrated("B", 3, 50));
  Instrument unit = records.front().sensor.instrument;
  unit.model.clear();
  const std::optional<ProcessScatter> process = process_scatter(records, unit);
  ASSERT_TRUE(process);
  EXPECT_EQ(process->records, 12);
  EXPECT_EQ(process->degrees_of_freedom, 24.0);
  // M includes the scatter of the readings: block_sd^2 + noise^2 / 12.
  for (Eigen::Index k = 0; k < 3; ++k) {
    EXPECT_NEAR(std::sqrt(process->mean_square(k)) / block_sd, 1.0, 0.35);
  }
  unit.model = "M1";  // the records of both units are used
  EXPECT_EQ(process_scatter(records, unit)->records, 13);
  unit.axes = {"a", "b", "c"};
  EXPECT_FALSE(process_scatter(records, unit));
}

TEST(ProcessScatter, OfOneBlockRecordsIsTheScatterBetweenThem) {
  std::vector<Calibration> records;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    records.push_back(calibrated("A", 1, seed));
  }
  const std::optional<ProcessScatter> process =
      process_scatter(records, records.front().sensor.instrument);
  ASSERT_TRUE(process);
  EXPECT_EQ(process->degrees_of_freedom, 19.0);
  EXPECT_NEAR(std::sqrt(process->mean_square(0)) / block_sd, 1.0, 0.4);
  // The record of the run itself is not an earlier record.
  records.front().provenance.inputs = {{.path = "run.csv", .sha256 = "abc"}};
  EXPECT_EQ(
      process_scatter(records, records.front().sensor.instrument, records.front().provenance.inputs)
          ->degrees_of_freedom,
      18.0);
}

// One block does not show the scatter between blocks. With the scatter of the process its interval
// covers the bias.
TEST(ProcessScatter, CoversTheBiasesOfOneBlock) {
  const ProcessScatter process{
      .mean_square = Eigen::Vector3d::Constant(block_sd * block_sd + noise * noise / 12.0),
      .degrees_of_freedom = 10.0,
      .records = 5};
  const SensorModel truth = accelerometer_truth();
  int held = 0;
  int without = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const Calibration one = calibrated("A", 1, seed, process);
    const Calibration plain = calibrated("A", 1, seed);
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double error = std::abs(one.sensor.response.bias(k) - truth.response.bias(k));
      held += error <= one.fit.statistics->interval_95(4 * k) ? 1 : 0;
      without += error <= plain.fit.statistics->interval_95(4 * k) ? 1 : 0;
    }
  }
  EXPECT_GE(held, 276);     // 92 % of 300
  EXPECT_LE(without, 150);  // without the process
  const Calibration one = calibrated("A", 1, 1, process);
  EXPECT_TRUE(one.fit.conditions.intermediate);
  EXPECT_EQ(one.fit.conditions.earlier, 5);
  EXPECT_THAT(one.findings.notes, test::HasNote(testing::HasSubstr("5 earlier calibrations")));
  EXPECT_THAT(one.findings.notes,
              testing::Not(test::HasNote(testing::HasSubstr("repeatability only"))));
  const std::string text = calibration_json(one);
  EXPECT_EQ(calibration_json(parse_calibration(text, "again.json")), text);
}

// If the run scatters far more than the process, only the run is used.
TEST(ProcessScatter, IsPassedOverWhereTheRunScattersFarMore) {
  const ProcessScatter small{
      .mean_square = Eigen::Vector3d::Constant(1e-12), .degrees_of_freedom = 10.0, .records = 5};
  const Calibration with = calibrated("A", 4, 3, small);
  const Calibration without = calibrated("A", 4, 3);
  EXPECT_MATRIX_NEAR(with.fit.statistics->interval_95, without.fit.statistics->interval_95, 1e-12);
  const std::string text = calibration_json(without);
  EXPECT_EQ(parse_calibration(text, "again.json").fit.conditions.block_degrees_of_freedom, 3.0);
}

}  // namespace
}  // namespace axiscal
