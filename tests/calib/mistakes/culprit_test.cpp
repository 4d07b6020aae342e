// SPDX-License-Identifier: Apache-2.0
// Small tests of the search for mistakes. bench/culprit_rates.cpp has the large ones
// (docs/accuracy.md).
#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/run.hpp"
#include "matchers.hpp"
#include "mistakes.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

using testing::HasSubstr;

constexpr double noise = 1e-4;
const Eigen::Vector3d equal(1.0, 1.0, 1.0);

Experiment experiment_of_run(const RandomRun& run, std::optional<Method> method = {}) {
  Experiment experiment = experiment_for(run.truth);
  experiment.field.in_table.reset();
  experiment.fit.method = method;
  return experiment;
}

struct MistakeCase {
  Mistake mistake = Mistake::none;
  double sigmas = 0.0;
  int least_named = 0;  // out of 40
};

class SeededMistakes : public testing::TestWithParam<MistakeCase> {};

TEST_P(SeededMistakes, AreCaughtAndNamed) {
  RandomStream random(17, static_cast<std::uint32_t>(GetParam().mistake));
  int named = 0;
  for (int t = 0; t < 40; ++t) {
    const RandomRun run = random_run(noise * equal, random);
    const SeededMistake seeded =
        seed_mistake(GetParam().mistake, GetParam().sigmas * noise, run.truth, run.good, random);
    const Method method = t % 2 == 0 ? Method::paired : Method::joint;
    Experiment experiment = experiment_of_run(run, method);
    experiment.fit.drift = DriftSetup::none;  // otherwise a drift becomes a term of the fit
    named += judge(calibrate(experiment, seeded.observations), seeded).named ? 1 : 0;
  }
  EXPECT_GE(named, GetParam().least_named);
}

INSTANTIATE_TEST_SUITE_P(Rates,
                         SeededMistakes,
                         testing::Values(MistakeCase{Mistake::wrong_face, 0, 40},
                                         MistakeCase{Mistake::upside_down, 0, 40},
                                         MistakeCase{Mistake::wrong_way_round, 0, 40},
                                         MistakeCase{Mistake::exchanged, 0, 40},
                                         MistakeCase{Mistake::unit_factor, 0, 40},
                                         MistakeCase{Mistake::repeat, 0, 40},
                                         MistakeCase{Mistake::columns, 0, 39},
                                         MistakeCase{Mistake::sign, 0, 38},
                                         // A lower rate: t(3) noise looks so in 1 %.
                                         MistakeCase{Mistake::tilt, 20, 34},
                                         MistakeCase{Mistake::table_moved, 15, 38},
                                         MistakeCase{Mistake::drift, 20, 38},
                                         MistakeCase{Mistake::saturation, 15, 38}));

// @return code and first run of the first warning, or "none".
std::string first_code(const Experiment& experiment, const Observations& observations) {
  const Calibration result = calibrate(experiment, observations);
  return result.findings.warnings.empty()
             ? std::string("none")
             : std::string(warning_name(result.findings.warnings.front().code)) + " " +
                   std::to_string(result.findings.warnings.front().runs.front());
}

// A run with more than 200 readings of an accelerometer, and its experiment.
struct ManyReadings {
  ManyReadings(int replicates, LevelBy level_by)
      : good(observe(
            truth,
            {.replicates = replicates, .slope = {0.003, -0.002}, .noise_sd = noise, .seed = 5})),
        experiment(experiment_for(truth)) {
    experiment.field.in_table.reset();
    experiment.fit.level_by = level_by;
  }

  SensorModel truth = accelerometer_truth();
  Observations good;
  Experiment experiment;
};

void expect_one_reading_is_found(const ManyReadings& run) {
  ASSERT_GT(run.good.readings.size(), 200U);
  EXPECT_TRUE(calibrate(run.experiment, run.good).findings.warnings.empty());
  Observations bad = run.good;
  bad.response(100, 1) += 0.7;
  EXPECT_EQ(first_code(run.experiment, bad),
            "outlier " + std::to_string(run.good.readings[100].run));
  bad = run.good;
  const DesignPoint usual(Face::plus_x, Face::plus_y);
  bad.readings[150].point =
      *bad.readings[150].point == usual ? DesignPoint(Face::minus_z, Face::plus_x) : usual;
  EXPECT_EQ(first_code(run.experiment, bad),
            "wrong_pose " + std::to_string(run.good.readings[150].run));
}

// Of many readings only the most suspicious ones are fitted by deletion, to limit the memory. The
// mistakes are still found.
TEST(Culprit, IsFoundAmongManyReadings) {
  const ManyReadings run(25, LevelBy::run);
  expect_one_reading_is_found(run);
  Observations bad = run.good;
  bad.response.row(60) *= 9.80665;
  EXPECT_EQ(first_code(run.experiment, bad),
            "unit_factor " + std::to_string(run.good.readings[60].run));
  // The table moves by 20 sigma after reading 200 of 300.
  bad = run.good;
  const Observations moved = observe(
      run.truth, {.replicates = 25, .slope = {0.005, -0.002}, .noise_sd = noise, .seed = 5});
  bad.response.bottomRows(100) = moved.response.bottomRows(100);
  EXPECT_THAT(first_code(run.experiment, bad), testing::StartsWith("table_moved"));
}

// With a slope for each block fewer deletions are fitted.
TEST(Culprit, IsFoundWhereManyTablesAreLevelled) {
  expect_one_reading_is_found(ManyReadings(17, LevelBy::block));
}

TEST(Culprit, GoodRunsHaveNone) {
  RandomStream random(23);
  int alarms = 0;
  for (int t = 0; t < 300; ++t) {
    const RandomRun run =
        random_run(noise * (t % 2 == 0 ? equal : Eigen::Vector3d(1.0, 1.0, 3.0)), random);
    alarms += calibrate(experiment_of_run(run), run.good).findings.warnings.empty() ? 0 : 1;
  }
  EXPECT_LE(alarms, 6);  // expected: 3, by 1 %
}

// One of many readings is moved in a random direction. 15 sigma gives a warning. 12 sigma, which
// heavy tails also cause, gives a warning or a note.
TEST(Culprit, IsFoundAmongManyAtAnyNoise) {
  RandomStream random(31);
  const Eigen::Vector3d unequal(1.0, 3.0, 10.0);
  for (const int replicates : {2, 8}) {
    const int trials = replicates == 2 ? 40 : 16;
    int caught = 0;
    int noted = 0;
    int alarms = 0;
    for (int t = 0; t < trials; ++t) {
      const Eigen::Vector3d sd = noise * (t % 2 == 0 ? equal : unequal);
      const RandomRun run = random_run(sd, random, replicates);
      alarms += calibrate(experiment_of_run(run), run.good).findings.warnings.empty() ? 0 : 1;
      const SeededMistake far = move_reading(15.0 * sd, run.good, random);
      caught += judge(calibrate(experiment_of_run(run), far.observations), far).caught ? 1 : 0;
      const SeededMistake near = move_reading(12.0 * sd, run.good, random);
      const Calibration found = calibrate(experiment_of_run(run), near.observations);
      noted += judge(found, near).caught ||
                       testing::Value(found.findings.notes, HasNote(HasSubstr("heavy tails")))
                   ? 1
                   : 0;
    }
    EXPECT_GE(caught, trials - 3) << replicates;
    EXPECT_GE(noted, trials - 3) << replicates;
    EXPECT_LE(alarms, 3) << replicates;
  }
}

TEST(Culprit, SaysWhatToDoAndRefusesWhatCannotBeTrusted) {
  const SensorModel truth = accelerometer_truth();
  Observations observations = observe(truth, {.slope = {0.003, -0.002}, .noise_sd = 2e-4});
  const DesignPoint taken = *observations.readings[6].point;
  const Face wrong = face_of(axis_of(taken.rest()), !is_positive(taken.rest()));
  observations.readings[6].point = DesignPoint(wrong, taken.fence());
  const Calibration result = calibrate(experiment_for(truth), observations);
  ASSERT_FALSE(result.findings.warnings.empty());
  const CalibrationWarning& first = result.findings.warnings.front();
  EXPECT_EQ(first.code, WarningCode::wrong_pose);
  EXPECT_EQ(first.runs, std::vector<int>{7});
  EXPECT_THAT(first.message, HasSubstr("run 7 fits "));
  EXPECT_THAT(first.message,
              HasSubstr("times better as rest " + std::string(face_name(taken.rest())) +
                        " instead of " + std::string(face_name(wrong))));
  EXPECT_THAT(first.message, HasSubstr("Check the face, or take the reading again."));
  EXPECT_EQ(result.findings.status, CalibrationStatus::refused);
  ASSERT_TRUE(result.findings.suggestion);

  const Calibration mended = calibrate_with_suggestions(experiment_for(truth), observations);
  EXPECT_EQ(mended.findings.status, CalibrationStatus::ok);
  ASSERT_EQ(mended.findings.corrections.size(), 1U);
  EXPECT_EQ(mended.findings.corrections[0].runs, std::vector<int>{7});
  EXPECT_MATRIX_NEAR(mended.sensor.response.sensitivity, truth.response.sensitivity, 1e-3);
  EXPECT_THAT(mended.findings.notes, test::HasNote(HasSubstr("corrected as suggested: run 7")));
  const std::string text = calibration_json(mended);
  EXPECT_EQ(calibration_json(parse_calibration(text, "t.json")), text);
}

TEST(Culprit, LeavesSmallMistakesToTheUser) {
  RandomStream random(5);
  const RandomRun run = random_run(noise * equal, random);
  const SeededMistake seeded =
      seed_mistake(Mistake::tilt, 30.0 * noise, run.truth, run.good, random);
  const Calibration result = calibrate(experiment_of_run(run), seeded.observations);
  EXPECT_EQ(result.findings.status, CalibrationStatus::warning);
  const Calibration mended =
      calibrate_with_suggestions(experiment_of_run(run), seeded.observations);
  EXPECT_EQ(mended.findings.status, CalibrationStatus::ok);
  EXPECT_EQ(mended.fit.left_out, seeded.runs);
}

TEST(Culprit, FindsAWrongLevel) {
  SensorModel truth = accelerometer_truth();
  truth.instrument.kind = "gyroscope";
  truth.field = {.kind = "induced_rotation", .unit = "deg/s", .magnitude = 100.0};
  truth.field.in_table = Eigen::Vector3d(0.0, 0.0, 100.0);
  std::vector<DesignEntry> design;
  for (const DesignEntry& entry : standard_design(12)) {
    for (const double level : {-1.0, 1.0}) {
      design.push_back({.point = entry.point, .level = level});
    }
  }
  Observations observations =
      simulate(truth, make_run_sheet(design, 1, 4), {.noise_sd = 0.01, .seed = 4});
  observations.readings[10].level = -observations.readings[10].level.of_all();
  Experiment experiment = experiment_for(truth);
  const Calibration result = calibrate(experiment, observations);
  ASSERT_FALSE(result.findings.warnings.empty());
  // A wrong level of -1 and a cube upside down differ only by the effect of the slope and the bias.
  EXPECT_EQ(result.findings.warnings.front().code, WarningCode::wrong_level);
  EXPECT_EQ(result.findings.warnings.front().runs, std::vector<int>{11});
}

// A run whose columns are all exchanged or in another unit fits well. Only nominal values and axis
// names show it.
TEST(Culprit, WholeRunsShowAgainstNominalValues) {
  const SensorModel truth = accelerometer_truth();
  Observations observations = observe(truth, {.noise_sd = 1e-4});
  observations.response *= 1e3;
  Experiment experiment = experiment_for(truth);
  EXPECT_TRUE(calibrate(experiment, observations).findings.warnings.empty());
  experiment.nominal_sensitivity = 2.5;
  const Calibration result = calibrate(experiment, observations);
  ASSERT_EQ(result.findings.warnings.size(), 3U);
  EXPECT_EQ(result.findings.warnings[0].code, WarningCode::unit_factor);
  EXPECT_THAT(result.findings.warnings[0].message, HasSubstr("a factor of 1000"));
  Observations swapped = observe(truth, {.noise_sd = 1e-4});
  swapped.response.col(0).swap(swapped.response.col(1));
  EXPECT_EQ(calibrate(experiment_for(truth), swapped).findings.warnings.front().code,
            WarningCode::axis_swapped);
}

// Six points determine the slope of the table poorly, so steps become short before the minimum. A
// search over all directions in numpy gives the factor 264.
TEST(FindCulprit, FitsToTheEndWhereTheFieldIsHardlyDetermined) {
  const ScratchFolder folder;
  const axiscal::Run run = read_run(folder.write("run.csv",
                                                 "run,block,rest,fence,x,y,z\n"
                                                 "1,1,+Z,+X,0.02455,-0.06924,-2.51778\n"
                                                 "2,1,-Y,+Z,0.02885,2.44412,0.01827\n"
                                                 "3,1,-Z,+X,-0.01654,0.00203,2.52517\n"
                                                 "4,1,-X,+Y,2.51047,-0.02454,0.00235\n"
                                                 "5,1,+X,+Y,-2.48716,-0.05583,0.00777\n"
                                                 "6,1,+Y,+Z,-0.00434,-2.51458,-0.02261\n"
                                                 "7,2,+Z,+X,0.02586,-0.06963,-2.51512\n"
                                                 "8,2,+X,+Y,-2.48593,-0.05673,0.00893\n"
                                                 "9,2,-Y,+Z,0.02815,2.44869,0.01786\n"
                                                 "10,2,+Y,+Z,-0.00405,-2.51798,-0.02333\n"
                                                 "11,2,-Z,-X,2.51122,-0.02634,0.00052\n"
                                                 "12,2,-Z,+X,-0.01324,0.00264,2.52213\n"));
  Experiment experiment = experiment_for(accelerometer_truth());
  experiment.fit.method = Method::known;
  experiment.table.slope = {0.0, 0.0};
  const Calibration calibration = calibrate(experiment, run.observations);
  ASSERT_TRUE(calibration.findings.suggestion.has_value());
  EXPECT_THAT(calibration.findings.suggestion->message,
              HasSubstr("run 11 fits 262 times better as rest -X, fence +Y"));
}

}  // namespace
}  // namespace axiscal::test
