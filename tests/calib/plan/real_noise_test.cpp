// SPDX-License-Identifier: Apache-2.0
// Coverage and alarms for readings that are not white. The large studies are in docs/accuracy.md.
#include <algorithm>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/study.hpp"
#include "axiscal/core/random.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

constexpr double noise = 1e-4;

struct WorldCase {
  const char* name;
  const char* world;
  int points = 12;
  int replicates = 1;
  double least = 0.92;  // least coverage of biases in 400 runs
  SeatSetup seats = SeatSetup::automatic;
};

StudySetup setup_of(const char* world, int points, int replicates) {
  StudySetup setup;
  setup.truth = test::accelerometer_truth();
  setup.truth.field.in_table = Eigen::Vector3d::UnitZ();
  setup.experiment = test::experiment_for(setup.truth);
  setup.experiment.field.in_table.reset();
  setup.experiment.fit.method = Method::joint;
  setup.design = standard_design(points);
  setup.replicates = replicates;
  setup.noise_sd = Eigen::Vector3d::Constant(noise);
  setup.slope_sd = 1e-3;
  setup.simulation.world = world_of(world);
  setup.angles = false;
  return setup;
}

class RealNoise : public testing::TestWithParam<WorldCase> {};

TEST_P(RealNoise, IsCovered) {
  const WorldCase& one = GetParam();
  StudySetup setup = setup_of(one.world, one.points, one.replicates);
  setup.experiment.fit.seats = one.seats;
  for (const StudyResult& result : results_of(run_study(setup, 300, 3))) {
    const bool is_bias = result.parameter.ends_with(".bias");
    EXPECT_GE(result.coverage_95, is_bias ? one.least : 0.90) << result.parameter;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Worlds,
    RealNoise,
    testing::Values(WorldCase{"blocks2", "block_sd=3e-4", 12, 2},
                    WorldCase{"blocks4", "block_sd=1e-4", 12, 4},
                    WorldCase{"seats24", "seat_rad=4e-4", 24, 1},
                    WorldCase{"seats12", "seat_rad=1.2e-3", 12, 1, 0.91, SeatSetup::fit},
                    WorldCase{"ar24", "ar=0.9", 12, 2},
                    // 12 readings often do not show a correlation.
                    WorldCase{"ar12", "ar=0.5", 12, 1, 0.84},
                    WorldCase{"walk", "walk_sd=1e-4", 12, 2},
                    WorldCase{"drift", "drift=1e-3", 12, 2},
                    WorldCase{"mounts2", "mount_rad=3e-4", 12, 2},
                    WorldCase{"mounts4", "mount_rad=3e-4", 12, 4},
                    WorldCase{"gains4", "gain=3e-4", 12, 4},
                    WorldCase{"remounted4", "remount_rad=3e-4", 12, 4},
                    WorldCase{"jitter12", "jitter=2e-4", 12, 1},
                    WorldCase{"ends24", "ends=3", 24, 1},
                    WorldCase{"rounded", "round=1e-3", 12, 4, 0.95}),
    [](const testing::TestParamInfo<WorldCase>& test_case) { return test_case.param.name; });

// The scatter of the seats is found. The biases are then more precise than with one noise for all.
TEST(Seats, AreFoundAndTakenFromTheNoise) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.method = Method::joint;
  const SimulationOptions options{.noise_sd = noise, .world = world_of("seat_rad=1e-3"), .seed = 4};
  const Observations run = simulate(truth, make_run_sheet(standard_design(24), 1, 4), options);
  const Calibration found = calibrate(experiment, run);
  const auto seats =
      std::find_if(found.fit.statistics->components.begin(), found.fit.statistics->components.end(),
                   [](const ScatterComponent& one) { return one.name == "seats"; });
  ASSERT_NE(seats, found.fit.statistics->components.end());
  EXPECT_NEAR(seats->sd(0), 1e-3, 3e-4);
  EXPECT_EQ(seats->unit, "rad");
  experiment.fit.seats = SeatSetup::none;
  const Calibration plain = calibrate(experiment, run);
  EXPECT_GT(plain.fit.statistics->residual_sd(0), 5.0 * found.fit.statistics->residual_sd(0));
  EXPECT_GT(plain.fit.statistics->interval_95(1), 3.0 * found.fit.statistics->interval_95(1));
  // The record contains all components of the covariance.
  const std::string text = calibration_json(found);
  EXPECT_EQ(calibration_json(parse_calibration(text, "again.json")), text);
}

// Consecutive readings at one point belong to one laying.
TEST(Seats, CountConsecutiveReadingsAtAPointAsOneLaying) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.method = Method::joint;
  const SimulationOptions options{.world = world_of("seat_rad=1e-3"), .seed = 5};
  Observations run = simulate(truth, make_run_sheet(standard_design(24), 1, 5), options);
  Observations repeated = run;
  repeated.readings.clear();
  repeated.response.resize(5 * run.size(), 3);
  RandomStream random(5);
  for (Eigen::Index i = 0; i < run.size(); ++i) {
    for (Eigen::Index r = 0; r < 5; ++r) {
      Reading reading = run.readings[static_cast<std::size_t>(i)];
      reading.run = static_cast<int>(5 * i + r) + 1;
      repeated.readings.push_back(reading);
      repeated.response.row(5 * i + r) =
          run.response.row(i) + noise * random.normals<3>().transpose();
    }
  }
  const FitStatistics found = *calibrate(experiment, repeated).fit.statistics;
  ASSERT_EQ(found.components.front().name, "seats");
  EXPECT_NEAR(found.components.front().sd(0), 1e-3, 3e-4);
  EXPECT_NEAR(found.residual_sd(0), noise, 0.2 * noise);
  EXPECT_GT(found.degrees_of_freedom(0), 90.0);
}

// The instrument has another turn in each mount. The fit finds the scatter of the turns, and the
// record states it.
TEST(Mounts, AreFoundAndTakenFromTheNoise) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.method = Method::joint;
  const Observations run =
      simulate(truth, make_run_sheet(standard_design(12), 8, 4),
               {.noise_sd = noise, .world = world_of("mount_rad=1e-3"), .seed = 4});
  EXPECT_EQ(run.readings.back().mount, 8);
  const Calibration found = calibrate(experiment, run);
  EXPECT_EQ(found.fit.conditions.mounts, 8);
  EXPECT_EQ(found.fit.statistics->components.front().name, "mounts");
  EXPECT_NEAR(found.fit.statistics->components.front().sd(0), 1e-3, 4e-4);
  EXPECT_NEAR(found.fit.statistics->residual_sd(0), noise, 0.3 * noise);
  EXPECT_EQ(found.findings.status, CalibrationStatus::ok);
  // The intervals of main sensitivities stay short; those of cross-axis terms become long.
  EXPECT_GT(found.fit.statistics->interval_95(2), 5.0 * found.fit.statistics->interval_95(1));
  const std::string text = calibration_json(found);
  EXPECT_EQ(calibration_json(parse_calibration(text, "again.json")), text);
}

// Errors of face normals with the stated uncertainty, three times the noise, raise no alarm.
TEST(StatedErrors, RaiseNoAlarms) {
  StudySetup setup = setup_of("stated=1", 12, 3);
  setup.alarms = true;
  PositionerDescription description = setup.experiment.positioner.description();
  NormalCovariance C = NormalCovariance::Zero();
  for (const Face face : all_faces) {
    const Eigen::Vector3d n = setup.experiment.positioner.normal(face);
    const Eigen::Index at = 3 * static_cast<Eigen::Index>(face);
    C.block<3, 3>(at, at) = 9e-8 * (Eigen::Matrix3d::Identity() - n * n.transpose());
  }
  description.normal_covariance = C;
  setup.experiment.positioner = Positioner(description);
  const Study study = run_study(setup, 300, 5);
  const auto any = study.warnings.find("any");
  EXPECT_LE(any == study.warnings.end() ? 0 : any->second, 8);
  for (const StudyResult& result : results_of(study)) {
    EXPECT_GE(result.coverage_95, 0.90) << result.parameter;
  }
}

// A drift that is found is a term of the fit and not a warning. A record of one block has the
// condition repeatability.
TEST(Drift, IsATermWhereItIsFound) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.method = Method::joint;
  const Observations run =
      simulate(truth, make_run_sheet(standard_design(12), 1, 6),
               {.noise_sd = noise, .world = world_of("drift=4e-3"), .seed = 6});
  const Calibration found = calibrate(experiment, run);
  EXPECT_EQ(found.findings.status, CalibrationStatus::ok);
  EXPECT_NEAR(found.sensor.response.bias(0), truth.response.bias(0), 5.0 * noise);
  EXPECT_THAT(found.findings.notes,
              test::HasNote(testing::HasSubstr("drift over the run, by x 0.00")));
  EXPECT_THAT(found.findings.notes, test::HasNote(testing::HasSubstr("only repeatability")));
  experiment.fit.drift = DriftSetup::none;
  const Calibration without = calibrate(experiment, run);
  EXPECT_NE(without.findings.status, CalibrationStatus::ok);
  experiment.fit.drift = DriftSetup::linear;
  EXPECT_MATRIX_NEAR(calibrate(experiment, run).sensor.response.bias, found.sensor.response.bias,
                     1e-15);
}

TEST(Blocks, AreIntermediateConditions) {
  const SensorModel truth = test::accelerometer_truth();
  const Experiment experiment = test::experiment_for(truth);
  const Calibration found =
      calibrate(experiment, simulate(truth, make_run_sheet(standard_design(12), 3, 7),
                                     {.noise_sd = noise, .world = world_of("block_sd=1e-3")}));
  EXPECT_EQ(found.fit.conditions.blocks, 3);
  EXPECT_TRUE(found.fit.conditions.intermediate);
  ASSERT_FALSE(found.fit.statistics->components.empty());
  const ScatterComponent& blocks = found.fit.statistics->components.front();
  EXPECT_EQ(blocks.name, "blocks");
  EXPECT_EQ(blocks.degrees_of_freedom, 2.0);
  EXPECT_GT(blocks.sd.maxCoeff(), 3e-4);
  EXPECT_LT(blocks.sd.maxCoeff(), 4e-3);
}

double share_of(const Study& study, const std::string& warning) {
  const auto found = study.warnings.find(warning);
  return found == study.warnings.end()
             ? 0.0
             : static_cast<double>(found->second) / static_cast<double>(study.trials);
}

// A squared term of five sigma in one axis is nearly always reported. Straight responses are
// reported in less than 1.5 % of runs.
TEST(Alarms, OfAResponseThatBends) {
  StudySetup bent = setup_of("k2=5e-4:0:0", 24, 1);
  bent.alarms = true;
  EXPECT_GT(share_of(run_study(bent, 200, 8), "any"), 0.97);
  StudySetup straight = setup_of("", 24, 1);
  straight.alarms = true;
  EXPECT_LT(share_of(run_study(straight, 1000, 8), "nonlinearity"), 0.015);
}

// The rate of alarms does not depend on the ratio of the axes' noise.
TEST(Alarms, OfLevelnessHoldTheirLevel) {
  StudySetup setup = setup_of("", 12, 1);
  setup.noise_sd = Eigen::Vector3d(noise, noise, 3.0 * noise);
  int unlevel = 0;
  constexpr int runs = 600;
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {
    const Observations run =
        simulate(setup.truth, make_run_sheet(setup.design, 1, seed),
                 {.noise_sds = setup.noise_sd, .slope = {1e-3, -2e-3}, .seed = seed});
    unlevel += calibrate(setup.experiment, run).fit.levelness->consistent ? 0 : 1;
  }
  EXPECT_LE(unlevel, 12);
}

// A study without `alarms` skips the tests that raise them. Its other results are the same.
TEST(Alarms, ChangeNoFigureOfAStudy) {
  for (const Method method : {Method::known, Method::paired, Method::joint}) {
    for (const char* const world : {"", "ar=0.7", "block_sd=3e-4", "jitter=3e-4", "round=2e-4"}) {
      StudySetup setup = setup_of(world, 12, 2);
      setup.experiment.fit.method = method;
      if (method == Method::known) {
        setup.experiment.field.in_table = Eigen::Vector3d::UnitZ();
        setup.slope_sd = 0.0;
      }
      const Study plain = run_study(setup, 30, 4);
      setup.alarms = true;
      const Study alarmed = run_study(setup, 30, 4);
      ASSERT_EQ(plain.sums.size(), alarmed.sums.size());
      ASSERT_EQ(plain.refused, alarmed.refused) << world;
      for (std::size_t p = 0; p < plain.parameters.size(); ++p) {
        EXPECT_EQ(plain.sums[0][p].error_squared, alarmed.sums[0][p].error_squared) << world;
        EXPECT_EQ(plain.sums[0][p].u_squared, alarmed.sums[0][p].u_squared) << world;
        EXPECT_EQ(plain.sums[0][p].covered, alarmed.sums[0][p].covered) << world;
      }
    }
  }
}

// An error of the slope that agrees with its stated uncertainty raises no alarm.
TEST(Alarms, OfAStatedSlopeCountItsUncertainty) {
  StudySetup setup = setup_of("stated=1", 12, 1);
  setup.experiment.fit.method = Method::known;
  setup.experiment.field.in_table = Eigen::Vector3d::UnitZ();
  setup.experiment.stated.slope_u = 1e-3;
  setup.slope_sd = 0.0;
  setup.alarms = true;
  EXPECT_LT(share_of(run_study(setup, 600, 9), "slope"), 0.02);
}

}  // namespace
}  // namespace axiscal
