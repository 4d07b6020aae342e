// SPDX-License-Identifier: Apache-2.0
// Simulated recordings and the intervals of their calibrations. The large studies are in
// docs/accuracy.md.
#include "axiscal/calib/recording.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "axiscal/calib/study.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/units.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

SensorModel gyroscope_truth() {
  Eigen::Matrix3d S;
  S << 1.02, 0.01, -0.02, 0.015, 0.97, 0.01, -0.01, 0.02, 1.01;
  SensorModel truth =
      test::truth_of({.bias = Eigen::Vector3d(0.012, -0.007, 0.03), .sensitivity = S}, "gyroscope");
  truth.instrument.unit = "rad/s";
  truth.field = {.kind = "induced_rotation", .unit = "rad/s", .magnitude = 1.0};
  return truth;
}

StudySetup study_of(const SensorModel& truth, const Recording& recording, const char* world) {
  StudySetup setup;
  setup.truth = truth;
  setup.experiment.instrument = truth.instrument;
  setup.experiment.field.of = make_field(truth.field.kind);
  setup.experiment.field.magnitude = truth.field.magnitude;
  setup.design = standard_design(12);
  setup.recording = recording;
  setup.simulation.world = world_of(world);
  setup.angles = false;
  return setup;
}

struct Coverage {
  double bias = 0.0;
  double sensitivity = 0.0;
};

Coverage coverage_of(const StudySetup& setup, int trials) {
  Coverage mean;
  for (const StudyResult& result : results_of(run_study(setup, trials, 5))) {
    const bool is_bias = result.parameter.ends_with(".bias");
    (is_bias ? mean.bias : mean.sensitivity) += result.coverage_95 / (is_bias ? 3.0 : 9.0);
  }
  return mean;
}

struct TurnsCase {
  const char* name;
  const char* world;
  double noise = 0.0;
};

class TurnsOfGyroscope : public testing::TestWithParam<TurnsCase> {};

// 100 Hz; errors by the noise of the gyroscope, the seats and the Earth's rotation.
TEST_P(TurnsOfGyroscope, AreCovered) {
  StudySetup setup = study_of(gyroscope_truth(), {.kind = RecordingKind::turns, .samples = 5400},
                              GetParam().world);
  setup.noise_sd = Eigen::Vector3d::Constant(GetParam().noise);
  setup.experiment.table.site = Site{.latitude_deg = 40.0};
  const Coverage coverage = coverage_of(setup, 250);
  EXPECT_GE(coverage.sensitivity, 0.925);
  EXPECT_LE(coverage.sensitivity, 0.985);
  EXPECT_GE(coverage.bias, 0.90);
}

INSTANTIATE_TEST_SUITE_P(Worlds,
                         TurnsOfGyroscope,
                         testing::Values(TurnsCase{"noise", "", 3e-3},
                                         TurnsCase{"quiet", "", 1e-4},
                                         TurnsCase{"seats", "seat_rad=3e-4", 3e-4},
                                         TurnsCase{"both", "seat_rad=2e-4", 2e-3}),
                         [](const testing::TestParamInfo<TurnsCase>& test_case) {
                           return test_case.param.name;
                         });

// If a rate starts and ends with a corner at a sample, the trapezium rule gives 1 - pi^2 / (12 *
// 150^2) of the angle in every turn. The scatter does not show this error, so it is a source of the
// budget.
TEST(Turns, SamplingIsInTheBudget) {
  const SensorModel truth = gyroscope_truth();
  const std::vector<RunSheetRow> sheet = make_run_sheet(standard_design(12), 1, 3);
  const Recording recording{.kind = RecordingKind::turns, .samples = 5400};
  SimulatedTurns turns =
      simulate_turns(truth, sheet, recording, Eigen::Vector3d::Zero(), {.noise_sd = 1e-6});
  const auto error_and_source = [&](SimulatedTurns& taken) {
    const Calibration found = calibrate_turns(taken, sheet, truth.instrument, Positioner(),
                                              Eigen::Matrix3d::Identity(), std::nullopt);
    const auto sampling =
        std::find_if(found.fit.uncertainty->sources.begin(), found.fit.uncertainty->sources.end(),
                     [](const UncertaintySource& source) { return source.name == "sampling"; });
    return std::pair(found.sensor.response.sensitivity(0, 0) - truth.response.sensitivity(0, 0),
                     std::sqrt(sampling->covariance(1, 1)));
  };
  const auto [smooth_error, smooth_u] = error_and_source(turns);
  EXPECT_LT(std::abs(smooth_error), 5e-6);
  EXPECT_LT(smooth_u, 5e-6);
  for (std::size_t r = 0; r + 1 < sheet.size(); ++r) {
    const Eigen::Matrix3d from = Positioner().rotation_table_from_positioner(sheet[r].entry.point);
    const Eigen::Matrix3d to =
        Positioner().rotation_table_from_positioner(sheet[r + 1].entry.point);
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(from.transpose() * to));
    const std::size_t first = turns.rests[r].first + turns.rests[r].second - 1;
    for (int i = 1; i < 150; ++i) {
      const double speed =
          0.5 * std::numbers::pi * std::sin(std::numbers::pi * i / 150.0) / 1.5 * turn.angle();
      turns.readings.row(static_cast<Eigen::Index>(first) + i) =
          truth.response.at(speed * turn.axis()).transpose();
    }
  }
  const auto [error, u] = error_and_source(turns);
  EXPECT_NEAR(error / truth.response.sensitivity(0, 0), -3.6554e-5, 3e-6);
  EXPECT_NEAR(u, std::abs(error), 0.1 * std::abs(error));
}

// The scatter of the seats is separated from the noise of the gyroscope, because consecutive turns
// share a rest.
TEST(Turns, TheSeatsScatterIsFound) {
  const SensorModel truth = gyroscope_truth();
  const std::vector<RunSheetRow> sheet = make_run_sheet(standard_design(24), 2, 3);
  const SimulationOptions options{.noise_sd = 1e-3, .world = world_of("seat_rad=5e-4"), .seed = 4};
  const Calibration found = calibrate_turns(
      simulate_turns(truth, sheet, {.kind = RecordingKind::turns, .samples = 21600},
                     Eigen::Vector3d::Zero(), options),
      sheet, truth.instrument, Positioner(), Eigen::Matrix3d::Identity(), std::nullopt);
  const std::string& note = found.findings.notes.front().message;
  const std::size_t at = note.find("turns share, causes ");
  ASSERT_NE(at, std::string::npos) << note;
  EXPECT_NEAR(std::stod(note.substr(at + std::string("turns share, causes ").size())) * rad_per_deg,
              5e-4, 1e-4);
}

// A recording of an instrument that is turned by hand. Its noise is correlated.
TEST(FreeRecording, IsCoveredUnderCorrelation) {
  for (const char* world : {"", "ar=0.8", "ar=0.99"}) {
    StudySetup setup =
        study_of(test::accelerometer_truth(), {.samples = 4000, .rate_hz = 50.0}, world);
    setup.noise_sd = Eigen::Vector3d::Constant(2e-3);
    setup.experiment.fit.method = Method::magnitude;
    const Coverage coverage = coverage_of(setup, 60);
    EXPECT_GE(coverage.bias, 0.90) << world;
    EXPECT_GE(coverage.sensitivity, 0.90) << world;
  }
}

TEST(FreeRecording, TurnsTheTruthIntoTheShape) {
  const SensorModel truth = gyroscope_truth();
  const Eigen::Matrix3d S = truth.response.sensitivity;
  const Eigen::Matrix3d symmetric =
      rotated_to_shape(truth, MagnitudeShape::symmetric).response.sensitivity;
  const Eigen::Matrix3d triangular =
      rotated_to_shape(truth, MagnitudeShape::triangular).response.sensitivity;
  EXPECT_MATRIX_NEAR(symmetric, Eigen::Matrix3d(symmetric.transpose()), 1e-12);
  EXPECT_MATRIX_NEAR(Eigen::Vector3d(triangular(1, 0), triangular(2, 0), triangular(2, 1)),
                     Eigen::Vector3d::Zero().eval(), 1e-12);
  EXPECT_MATRIX_NEAR(symmetric * symmetric.transpose(), Eigen::Matrix3d(S * S.transpose()), 1e-12);
  EXPECT_MATRIX_NEAR(triangular * triangular.transpose(), Eigen::Matrix3d(S * S.transpose()),
                     1e-12);
}

TEST(SweptRecording, GoesUpAndDownOnce) {
  const SimulatedRun run = simulate_recording(
      test::accelerometer_truth(),
      {.kind = RecordingKind::sweep, .samples = 1001, .temperatures = {-20.0, 60.0}});
  EXPECT_EQ(*run.observations.readings.front().temperature, -20.0);
  EXPECT_NEAR(run.observations.readings[500].temperature->mean(), 60.0, 1e-9);
  EXPECT_NEAR(run.observations.readings.back().temperature->mean(), -20.0, 1e-9);
}

TEST(Recording, TooFewSamplesAreRefused) {
  EXPECT_THAT(test::complaint_of<DomainError>([] {
                static_cast<void>(simulate_recording(test::accelerometer_truth(), {.samples = 99}));
              }),
              testing::HasSubstr("100 samples or more"));
  EXPECT_THAT(test::complaint_of<DomainError>([] {
                static_cast<void>(simulate_turns(
                    gyroscope_truth(), make_run_sheet(standard_design(12), 1, 1),
                    {.kind = RecordingKind::turns, .samples = 300}, Eigen::Vector3d::Zero()));
              }),
              testing::HasSubstr("360 samples or more"));
}

}  // namespace
}  // namespace axiscal
