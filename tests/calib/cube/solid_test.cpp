// SPDX-License-Identifier: Apache-2.0
// Calibrations with exact geometry of the cube: feet, leaning fence, slots, a slope for each block.
#include <cmath>

#include <Eigen/Geometry>

#include "axiscal/calib/assembly.hpp"
#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/simulate.hpp"
#include "axiscal/calib/tolerance.hpp"
#include "axiscal/core/error.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

// A roughly made cube: the normals are off by 3 mrad, and the fence leans.
Positioner rough_cube(std::uint64_t seed) {
  RandomStream random(seed);
  return random_positioner(
      feet_of_frame({}), {.fence_lean_rad = 0.004},
      {.foot_height_m = 6e-5, .ball_radius_m = 2e-5, .squareness_rad = 3e-3, .fence_rad = 2e-3},
      random);
}

double worst_error(const Calibration& found, const SensorModel& truth) {
  return std::max(
      (found.sensor.response.bias - truth.response.bias).cwiseAbs().maxCoeff(),
      (found.sensor.response.sensitivity - truth.response.sensitivity).cwiseAbs().maxCoeff());
}

Observations concatenated_blocks(const SensorModel& truth,
                                 const std::vector<Eigen::Vector2d>& slopes,
                                 const SimulationOptions& common,
                                 int points = 12) {
  std::vector<Observations> parts;
  SimulationOptions options = common;
  for (const Eigen::Vector2d& slope : slopes) {
    options.slope = slope;
    ++options.seed;
    parts.push_back(
        simulate(truth, make_run_sheet(standard_design(points), 1, options.seed), options));
  }
  return concatenate(parts);
}

struct SolidCase {
  Method method;
  int points;
};

class SolidRun : public testing::TestWithParam<SolidCase> {};

TEST_P(SolidRun, ComesBackExactlyWhereThePositionerIsKnown) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.method = GetParam().method;
  for (std::uint64_t seed = 1; seed <= 25; ++seed) {
    experiment.positioner = rough_cube(seed);
    const Eigen::Vector2d slope(0.02 * std::cos(static_cast<double>(seed)), 0.013);
    const Observations run =
        simulate(truth, make_run_sheet(standard_design(GetParam().points), 1, seed),
                 {.slope = slope, .positioner = experiment.positioner});
    const Calibration found = calibrate(experiment, run);
    EXPECT_LT(worst_error(found, truth), 1e-12);
    EXPECT_NEAR(found.fit.levelness->mean_x, slope.x(), 1e-12);
    EXPECT_NEAR(found.fit.levelness->mean_y, slope.y(), 1e-12);
    EXPECT_EQ(found.findings.status, CalibrationStatus::ok);
    // If only the face normals are known, the headings are slightly wrong, and so are the results.
    experiment.positioner = Positioner(experiment.positioner.normals());
    const double by_normals = worst_error(calibrate(experiment, run), truth);
    EXPECT_GT(by_normals, 1e-9);
    EXPECT_LT(by_normals, 1e-3);
    experiment.positioner = Positioner();
    EXPECT_GT(worst_error(calibrate(experiment, run), truth), 1e-4);
  }
}

INSTANTIATE_TEST_SUITE_P(Methods,
                         SolidRun,
                         testing::Values(SolidCase{Method::paired, 12},
                                         SolidCase{Method::paired, 24},
                                         SolidCase{Method::joint, 12},
                                         SolidCase{Method::joint, 24}),
                         [](const testing::TestParamInfo<SolidCase>& test_case) {
                           return std::string(method_name(test_case.param.method)) +
                                  std::to_string(test_case.param.points);
                         });

TEST(SolidRunNotes, SayWhichSeatsRock) {
  BallFrame frame;
  frame.foot_positions_m = {Eigen::Vector2d(0.025, 0.025), Eigen::Vector2d(-0.025, 0.025),
                            Eigen::Vector2d(0.0, -0.025)};
  CubeFeet feet = feet_of_frame(frame);
  feet[static_cast<std::size_t>(Face::plus_y)][2].centre_m.y() += 1e-4;
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.positioner = Positioner(feet);
  const Calibration found =
      calibrate(experiment, simulate(truth, make_run_sheet(standard_design(12), 1, 1),
                                     {.slope = {0.01, 0.0}, .positioner = experiment.positioner}));
  EXPECT_LT(worst_error(found, truth), 1e-12);
  EXPECT_THAT(found.findings.notes, test::HasNote(HasSubstr("rest +X, fence +Y: the cube rocks")));
  EXPECT_EQ(found.findings.status, CalibrationStatus::ok);
}

// A cube that tips over on -Z and does not stay at the fence with face -Z.
Positioner tipping_cube() {
  CubeFeet feet = feet_of_frame({});
  Feet& bottom = feet[static_cast<std::size_t>(Face::minus_z)];
  bottom[0].centre_m.head<2>() = Eigen::Vector2d(0.03, 0.01);
  bottom[1].centre_m.head<2>() = Eigen::Vector2d(0.005, 0.03);
  bottom[2].centre_m.head<2>() = Eigen::Vector2d(0.03, -0.02);
  return Positioner(feet);
}

TEST(SolidRunSeats, OfReadingsLeftOutDoNotMatter) {
  const SensorModel truth = test::accelerometer_truth();
  const Observations run = test::observe(truth, {.points = 24});
  Experiment experiment = test::experiment_for(truth);
  experiment.positioner = tipping_cube();
  EXPECT_THAT(
      test::complaint_of<RefusedError>([&] { static_cast<void>(calibrate(experiment, run)); }),
      HasSubstr("cannot lie in this way"));
  for (const Reading& reading : run.readings) {
    if (!experiment.positioner.seat(*reading.point).defect.empty()) {
      experiment.leave_out.push_back(reading.run);
    }
  }
  ASSERT_FALSE(experiment.leave_out.empty());
  const Calibration found = calibrate(experiment, run);
  EXPECT_LT(worst_error(found, truth), 1e-12);
  for (const ReadingResidual& residual : found.fit.residuals) {
    EXPECT_EQ(residual.used, residual.response.allFinite());
  }
}

TEST(SolidRunSeats, ThatCannotBeAreNotAdvised) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.positioner = tipping_cube();
  Observations run = test::observe(truth, {});
  Observations few;
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < run.size(); ++i) {
    const Reading& reading = run.readings[static_cast<std::size_t>(i)];
    if (axis_of(reading.point->rest()) == 0) {
      few.readings.push_back(reading);
      rows.push_back(i);
    }
  }
  few.response = run.response(rows, Eigen::seqN(0, run.response.cols()));
  for (const Method method : {Method::paired, Method::joint, Method::known}) {
    experiment.fit.method = method;
    const std::string complaint = test::complaint_of<RankDeficientError>(
        [&] { static_cast<void>(calibrate(experiment, few)); });
    EXPECT_THAT(complaint, HasSubstr("do not determine"));
    EXPECT_THAT(complaint, testing::Not(HasSubstr("rest -Z")));
  }
}

// ---- a levelness for each block ----

class LevelByBlock : public testing::TestWithParam<Method> {};

TEST_P(LevelByBlock, IsExactForATableThatWasMoved) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.method = GetParam();
  experiment.positioner = rough_cube(3);
  const std::vector<Eigen::Vector2d> slopes = {{0.004, -0.002}, {-0.01, 0.003}, {0.02, 0.015}};
  const Observations run =
      concatenated_blocks(truth, slopes, {.positioner = experiment.positioner});
  EXPECT_GT(worst_error(calibrate(experiment, run), truth), 1e-6);
  experiment.fit.level_by = LevelBy::block;
  const Calibration found = calibrate(experiment, run);
  EXPECT_LT(worst_error(found, truth), 1e-12);
  EXPECT_EQ(found.findings.status, CalibrationStatus::ok);
  ASSERT_EQ(found.fit.levelness->blocks.size(), 3U);
  for (std::size_t b = 0; b < 3; ++b) {
    EXPECT_EQ(found.fit.levelness->blocks[b].block, static_cast<int>(b) + 1);
    EXPECT_NEAR(found.fit.levelness->blocks[b].x, slopes[b].x(), 1e-12);
    EXPECT_NEAR(found.fit.levelness->blocks[b].y, slopes[b].y(), 1e-12);
  }
  for (const ReadingResidual& residual : found.fit.residuals) {
    EXPECT_LT(residual.response.cwiseAbs().maxCoeff(), 1e-12);
  }
  const std::string text = calibration_json(found);
  EXPECT_EQ(calibration_json(parse_calibration(text, "again.json")), text);
}

TEST_P(LevelByBlock, StatesItsUncertainty) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.method = GetParam();
  experiment.fit.level_by = LevelBy::block;
  const std::vector<Eigen::Vector2d> slopes = {{0.004, -0.002}, {-0.006, 0.003}};
  int covered = 0;
  int levels = 0;
  int within = 0;
  int intervals = 0;
  int warned = 0;
  constexpr int trials = 600;
  for (int trial = 0; trial < trials; ++trial) {
    const Calibration found = calibrate(
        experiment,
        concatenated_blocks(truth, slopes,
                            {.noise_sd = 2e-4, .seed = 10 * static_cast<std::uint64_t>(trial)}));
    warned += found.findings.status == CalibrationStatus::ok ? 0 : 1;
    const double t = student_t_factor(0.95, found.fit.levelness->degrees_of_freedom);
    for (std::size_t b = 0; b < 2; ++b) {
      const BlockLevelness& block = found.fit.levelness->blocks[b];
      covered += std::abs(block.x - slopes[b].x()) <= t * block.standard_error_x ? 1 : 0;
      covered += std::abs(block.y - slopes[b].y()) <= t * block.standard_error_y ? 1 : 0;
      levels += 2;
    }
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double half = found.fit.statistics->interval_95(4 * k);
      within += std::abs(found.sensor.response.bias(k) - truth.response.bias(k)) <= half ? 1 : 0;
      ++intervals;
    }
  }
  EXPECT_NEAR(static_cast<double>(covered) / levels, 0.95, 0.015);
  // Two blocks give a rough estimate of the scatter between blocks, so the intervals are wide.
  EXPECT_GT(static_cast<double>(within) / intervals, 0.932);
  EXPECT_LE(warned, 12);  // 2 % of the runs
}

INSTANTIATE_TEST_SUITE_P(Methods,
                         LevelByBlock,
                         testing::Values(Method::paired, Method::joint),
                         [](const testing::TestParamInfo<Method>& test_case) {
                           return std::string(method_name(test_case.param));
                         });

TEST(LevelByBlockSetup, HasTheStatedDegreesOfFreedom) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.level_by = LevelBy::block;
  experiment.fit.seats = SeatSetup::none;
  const Observations run =
      concatenated_blocks(truth, {{0.001, 0.0}, {0.0, 0.001}}, {.noise_sd = 1e-4});
  experiment.fit.method = Method::paired;
  // 12 averages less 4 coefficients and one shift between the blocks.
  EXPECT_MATRIX_NEAR(calibrate(experiment, run).fit.statistics->degrees_of_freedom,
                     Eigen::Vector3d::Constant(7.0), 1e-9);
  experiment.fit.method = Method::joint;
  // 72 readings less 12 coefficients, 3 shifts between the blocks and two directions with 2
  // unknowns each.
  EXPECT_NEAR(calibrate(experiment, run).fit.statistics->degrees_of_freedom.sum(),
              72.0 - 12.0 - 3.0 - 4.0, 1e-9);
  experiment.fit.method = Method::known;
  EXPECT_THAT(
      test::complaint_of<SetupError>([&] { static_cast<void>(calibrate(experiment, run)); }),
      HasSubstr("('level_by') requires the method 'paired' or 'joint'"));
}

TEST(LevelByBlockSetup, OneBlockIsTheSameAsTheRun) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  const Observations run = test::observe(truth, {.slope = {0.01, 0.0}, .noise_sd = 1e-4});
  for (const Method method : {Method::paired, Method::joint}) {
    experiment.fit.method = method;
    experiment.fit.level_by = LevelBy::run;
    const Calibration by_run = calibrate(experiment, run);
    experiment.fit.level_by = LevelBy::block;
    const Calibration by_block = calibrate(experiment, run);
    EXPECT_EQ(by_run.sensor.response.bias, by_block.sensor.response.bias);
    EXPECT_EQ(by_run.sensor.response.sensitivity, by_block.sensor.response.sensitivity);
  }
}

TEST(LevelByBlockSetup, RefusesABlockWithoutOpposites) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.method = Method::paired;
  experiment.fit.level_by = LevelBy::block;
  Observations run = concatenated_blocks(truth, {{0.001, 0.0}, {0.0, 0.001}}, {});
  for (Eigen::Index i = 12; i < 24; ++i) {
    Reading& reading = run.readings[static_cast<std::size_t>(i)];
    reading.block = is_positive(reading.point->fence()) ? 2 : 3;
  }
  EXPECT_THAT(
      test::complaint_of<RefusedError>([&] { static_cast<void>(calibrate(experiment, run)); }),
      HasSubstr("('level_by'): a block has too few opposite readings"));
}

// ---- assemblies ----

// Simultaneous readings of several instruments, each in its mount.
std::vector<SlotObservations> read_together(const std::vector<SensorModel>& truths,
                                            const std::vector<Mount>& mounts,
                                            const SimulationOptions& common) {
  std::vector<SlotObservations> slots;
  SimulationOptions options = common;
  for (std::size_t s = 0; s < truths.size(); ++s) {
    options.rotation_sensor_from_positioner = mounts[s].rotation_sensor_from_positioner;
    options.stream = static_cast<std::uint32_t>(s);
    slots.push_back(
        {.slot = mounts[s].slot,
         .observations =
             simulate(truths[s], make_run_sheet(standard_design(12), 1, options.seed), options)});
  }
  return slots;
}

TEST(CalibrateAssembly, ReturnsEachInstrumentInItsOwnFrame) {
  SensorModel other = test::accelerometer_truth();
  other.response.bias *= -2.0;
  other.response.sensitivity *= 1.1;
  const std::vector<SensorModel> truths = {test::accelerometer_truth(), other};
  for (const WebAxis axis : {WebAxis::x, WebAxis::y}) {
    const std::vector<Mount> mounts = h_shaped_mounts("L", "R", axis);
    Experiment experiment = test::experiment_for(truths[0]);
    experiment.positioner = rough_cube(4).with_mounts(mounts);
    const std::vector<Calibration> found = calibrate_assembly(
        experiment, read_together(truths, mounts,
                                  {.slope = {0.01, -0.02}, .positioner = experiment.positioner}));
    ASSERT_EQ(found.size(), 2U);
    for (std::size_t s = 0; s < 2; ++s) {
      EXPECT_LT(worst_error(found[s], truths[s]), 1e-12);
      EXPECT_EQ(found[s].provenance.slot, mounts[s].slot);
      const CombinedLevelness& combined = *found[s].fit.levelness->combined;
      EXPECT_NEAR(combined.x, 0.01, 1e-12);
      EXPECT_NEAR(combined.y, -0.02, 1e-12);
      EXPECT_TRUE(combined.consistent);
    }
    const std::string text = calibration_json(found[1]);
    EXPECT_EQ(calibration_json(parse_calibration(text, "again.json")), text);
  }
}

TEST(CalibrateAssembly, CombinesTheSlopesByTheirVariances) {
  const std::vector<SensorModel> truths(3, test::accelerometer_truth());
  const std::vector<Mount> mounts = parallel_mounts({"A", "B", "C"});
  Experiment experiment = test::experiment_for(truths[0]);
  int within = 0;
  int warned = 0;
  double squares = 0.0;
  double stated = 0.0;
  constexpr int trials = 500;
  for (int trial = 0; trial < trials; ++trial) {
    const std::vector<Calibration> found = calibrate_assembly(
        experiment, read_together(truths, mounts,
                                  {.noise_sd = 2e-4,
                                   .slope = {0.003, 0.001},
                                   .seed = static_cast<std::uint64_t>(trial) + 1}));
    const CombinedLevelness& combined = *found[0].fit.levelness->combined;
    const double dof = 3.0 * found[0].fit.levelness->degrees_of_freedom;
    within +=
        std::abs(combined.x - 0.003) <= student_t_factor(0.95, dof) * combined.standard_error_x ? 1
                                                                                                : 0;
    squares += std::pow(combined.x - 0.003, 2);
    stated += std::pow(combined.standard_error_x, 2);
    warned += combined.consistent ? 0 : 1;
  }
  EXPECT_NEAR(static_cast<double>(within) / trials, 0.95, 0.03);
  EXPECT_NEAR(std::sqrt(squares / stated), 1.0, 0.12);
  EXPECT_LE(warned, 4);
}

TEST(CalibrateAssembly, NamesTheSlotThatDisagreesAboutTheSlope) {
  const std::vector<SensorModel> truths(3, test::accelerometer_truth());
  const std::vector<Mount> mounts = parallel_mounts({"A", "B", "C"});
  Experiment experiment = test::experiment_for(truths[0]);
  const SimulationOptions options{.noise_sd = 2e-4, .slope = {0.01, -0.02}, .seed = 3};
  // The table yields under B: its slope differs by 0.3 mrad.
  std::vector<SlotObservations> slots = read_together(truths, mounts, options);
  SimulationOptions tilted = options;
  tilted.slope = {0.0103, -0.02};
  slots[1] = read_together(truths, mounts, tilted)[1];
  const std::vector<Calibration> found = calibrate_assembly(experiment, slots);
  EXPECT_FALSE(found[0].fit.levelness->combined->consistent);
  EXPECT_EQ(found[0].fit.levelness->combined->suspect, "B");
  EXPECT_EQ(found[0].findings.status, CalibrationStatus::ok);
  ASSERT_EQ(found[1].findings.status, CalibrationStatus::warning);
  EXPECT_EQ(found[1].findings.warnings.back().code, WarningCode::slot_levelness);
  EXPECT_THAT(found[1].findings.warnings.back().message,
              HasSubstr("in slot B measures a different slope"));
  slots.pop_back();
  const std::vector<Calibration> two = calibrate_assembly(experiment, slots);
  EXPECT_FALSE(two[0].fit.levelness->combined->consistent);
  EXPECT_EQ(two[0].fit.levelness->combined->suspect, "");
  EXPECT_EQ(two[0].findings.warnings.back().code, WarningCode::slot_levelness);
  EXPECT_EQ(two[1].findings.warnings.back().code, WarningCode::slot_levelness);
}

TEST(CalibrateAssembly, RefusesOneFieldForSeveralInstruments) {
  const SensorModel truth = test::accelerometer_truth();
  std::vector<SlotObservations> slots =
      read_together({truth, truth}, parallel_mounts({"A", "B"}), {});
  for (SlotObservations& slot : slots) {
    for (Reading& reading : slot.observations.readings) {
      reading.field_in_sensor = Eigen::Vector3d(0.0, 0.0, 1.0);
    }
  }
  EXPECT_THAT(test::complaint_of<SetupError>([&] {
                static_cast<void>(calibrate_assembly(test::experiment_for(truth), slots));
              }),
              HasSubstr("fx, fy, fz"));
}

TEST(MountRotation, IsThatOfTheSlotOrOfTheOnlyMount) {
  const std::vector<Mount> h = h_shaped_mounts("L", "R");
  const Positioner cube = Positioner().with_mounts(h);
  EXPECT_EQ(mount_rotation(cube, "R"), h[1].rotation_sensor_from_positioner);
  EXPECT_EQ(mount_rotation(cube, ""), Eigen::Matrix3d::Identity());
  EXPECT_THROW(static_cast<void>(mount_rotation(cube, "X")), SetupError);
  EXPECT_EQ(mount_rotation(Positioner().with_mounts({h[1]}), ""),
            h[1].rotation_sensor_from_positioner);
  EXPECT_EQ(mount_rotation(Positioner(), "any"), Eigen::Matrix3d::Identity());
  // A mount that characterize() wrote is used only if its slot is stated.
  PositionerDescription measured = Positioner().with_mounts({h[1]}).description();
  measured.from = {{.slot = "R", .record = "r.json", .observations = "r.csv"}};
  EXPECT_EQ(mount_rotation(Positioner(measured), ""), Eigen::Matrix3d::Identity());
  EXPECT_EQ(mount_rotation(Positioner(measured), "R"), h[1].rotation_sensor_from_positioner);
  EXPECT_THROW(static_cast<void>(split_by_slot({})), DomainError);
  EXPECT_THROW(static_cast<void>(combine_levelness({})), DomainError);
}

}  // namespace
}  // namespace axiscal
