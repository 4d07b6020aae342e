// SPDX-License-Identifier: Apache-2.0
// The components of scatter of a run, compared with numbers that are computed here.
#include <algorithm>
#include <array>
#include <cmath>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/simulate.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/field/gravity_field.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;
using testing::Not;

bool has_component(const Calibration& calibration, const std::string& name) {
  const auto& all = calibration.fit.statistics->components;
  return std::any_of(all.begin(), all.end(), [&](const auto& one) { return one.name == name; });
}

std::string notes_of(const Calibration& calibration) {
  std::string text;
  for (const CalibrationNote& note : calibration.findings.notes) {
    text += note.message + "\n";
  }
  return text;
}

// Four blocks of the standard design. The sensitivity of axis x is multiplied by a known gain in
// each block.
Observations run_with_gains(const SensorModel& truth, const std::array<double, 4>& gains) {
  Observations run =
      simulate(truth, make_run_sheet(standard_design(12), 4, 3), {.noise_sd = 1e-6, .seed = 3});
  for (Eigen::Index i = 0; i < run.size(); ++i) {
    const auto block = static_cast<std::size_t>(run.readings[static_cast<std::size_t>(i)].block);
    double& x = run.response(i, 0);
    x = truth.response.bias(0) + gains.at(block - 1) * (x - truth.response.bias(0));
  }
  return run;
}

TEST(BlockSensitivities, ScatterAsTheBlocksDo) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.method = Method::joint;
  const std::array gains = {1.001, 0.999, 1.0005, 0.9995};
  const Calibration found = calibrate(experiment, run_with_gains(truth, gains));
  const double S = truth.response.sensitivity(0, 0);
  const double M = S * S * (2.0 * 1e-6 + 2.0 * 0.25e-6) / 3.0;
  const CalibrationConditions& conditions = found.fit.conditions;
  EXPECT_NEAR(conditions.sensitivity_mean_square(0, 0), M, 0.02 * M);
  EXPECT_EQ(conditions.sensitivity_degrees_of_freedom, 3.0);
  EXPECT_TRUE(has_component(found, "block_sensitivities"));
  EXPECT_THAT(notes_of(found), HasSubstr("the sensitivities differ between blocks"));
  EXPECT_NEAR(found.sensor.response.sensitivity(0, 0), S, 1e-5);
  const double expected = student_t_factor(0.95, 3.0) * std::sqrt(M / 4.0);
  EXPECT_NEAR(found.fit.statistics->interval_95(1), expected, 0.02 * expected);
  // The intervals of the other axes are short, as their sensitivities do not change.
  EXPECT_LT(found.fit.statistics->interval_95(6), 0.01 * expected);
}

// The last block has no readings on +Y and -Y, so it determines the sensitivities to y only by the
// slope of the table.
TEST(BlockSensitivities, OfABlockThatLacksTwoFacesCountByTheirInformation) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.method = Method::joint;
  constexpr double noise = 1e-4;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Observations run = simulate(truth, make_run_sheet(standard_design(12), 4, seed),
                                {.noise_sd = noise, .slope = {0.004, -0.003}, .seed = seed});
    std::vector<std::size_t> rows;
    for (std::size_t i = 0; i < run.readings.size(); ++i) {
      if (run.readings[i].block < 4 || axis_of(run.readings[i].point->rest()) != 1) {
        rows.push_back(i);
      }
    }
    run = select_rows(run, rows);
    const Calibration found = calibrate(experiment, run);
    const double off =
        (found.sensor.response.sensitivity - truth.response.sensitivity).cwiseAbs().maxCoeff();
    EXPECT_LT(off, 4.0 * noise) << seed;
  }
}

TEST(BlockSensitivities, AskForAMountWhereTheAxesPointOtherwise) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.method = Method::joint;
  const Observations run =
      simulate(truth, make_run_sheet(standard_design(12), 4, 5),
               {.noise_sd = 1e-5, .world = world_of("remount_rad=1e-3"), .seed = 5});
  EXPECT_EQ(run.readings.back().mount, run.readings.front().mount);
  const Calibration found = calibrate(experiment, run);
  EXPECT_THAT(notes_of(found), HasSubstr("mounted again"));
  EXPECT_GT(found.fit.statistics->interval_95(2), 10.0 * found.fit.statistics->interval_95(1));
}

// The magnitude of the field wanders by twice the noise of a reading, or does not. The best test of
// this level finds it in 78 to 85 % of runs of 24 readings (scripts/power.py).
TEST(AFieldThatWanders, IsToldInMostRunsOf24Readings) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.method = Method::joint;
  const double noise = 1e-4 * truth.response.sensitivity.row(0).norm();
  const auto told = [&](const std::string& world) {
    int runs = 0;
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
      const Calibration found = calibrate(
          experiment, simulate(truth, make_run_sheet(standard_design(24), 1, seed),
                               {.noise_sd = noise, .world = world_of(world), .seed = seed}));
      runs += notes_of(found).find("magnitude of the field") != std::string::npos ? 1 : 0;
    }
    return runs;
  };
  EXPECT_GE(told("wander=2e-4"), 124);
  EXPECT_GE(told("jitter=2e-4"), 160);
  EXPECT_LE(told("wander=0"), 10);
}

// Readings that are taken again in a later block have their own bias. They do not change the bias
// of the run.
TEST(AFewReadingsTakenAgain, HaveABiasOfTheirOwn) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.method = Method::joint;
  Observations run =
      simulate(truth, make_run_sheet(standard_design(12), 1, 2), {.noise_sd = 1e-5, .seed = 2});
  const Calibration once = calibrate(experiment, run);
  const Observations first = run;
  run.response.conservativeResize(15, 3);
  for (Eigen::Index i = 0; i < 3; ++i) {
    Reading reading = first.readings[static_cast<std::size_t>(i)];
    reading.run = static_cast<int>(13 + i);
    reading.block = 2;
    run.readings.push_back(reading);
    run.response.row(12 + i) = first.response.row(i).array() + 5e-3;
  }
  const Calibration again = calibrate(experiment, run);
  EXPECT_EQ(again.findings.status, CalibrationStatus::ok);
  EXPECT_NEAR(again.sensor.response.bias(0), once.sensor.response.bias(0), 1e-5);
  EXPECT_LT(again.fit.statistics->interval_95(0), 1.2 * once.fit.statistics->interval_95(0));
  EXPECT_EQ(again.fit.conditions.blocks, 1);
}

// One reading with an error from 0 to 40 sigma: first nothing, then the note, then the warning.
TEST(AReadingThatStandsOut, IsNotedBeforeItIsWarnedOf) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.method = Method::joint;
  const Observations good =
      simulate(truth, make_run_sheet(standard_design(24), 1, 2), {.noise_sd = 1e-5, .seed = 11});
  int noted = 0;
  int warned = 0;
  for (double off = 0.0; off <= 40.0; off += 0.1) {
    Observations run = good;
    run.response(7, 0) += off * 1e-5;
    const Calibration found = calibrate(experiment, run);
    const bool note = notes_of(found).find("heavy tails") != std::string::npos;
    const bool warning = !found.findings.warnings.empty();
    EXPECT_FALSE(note && warning) << off;
    EXPECT_FALSE(note && warned > 0) << off;
    EXPECT_TRUE(warning || warned == 0) << off;
    EXPECT_FALSE(off < 4.0 && (note || warning)) << off;
    noted += note ? 1 : 0;
    warned += warning ? 1 : 0;
  }
  EXPECT_GE(noted, 1);
  EXPECT_GE(warned, 20);
}

// If the points have the same order in each block, a periodic disturbance changes the coefficients
// and does not show in the residuals.
TEST(PointsInOneOrder, AreNoted) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.method = Method::joint;
  const auto note_of = [&](int blocks, bool shuffled) {
    std::vector<RunSheetRow> sheet = make_run_sheet(standard_design(12), 1, 3);
    std::vector<RunSheetRow> all;
    for (int block = 1; block <= blocks; ++block) {
      for (RunSheetRow row :
           shuffled ? make_run_sheet(standard_design(12), 1, static_cast<std::uint64_t>(3 + block))
                    : sheet) {
        row.block = block;
        row.run = static_cast<int>(all.size()) + 1;
        all.push_back(row);
      }
    }
    const Observations run =
        simulate(truth, all, {.noise_sd = 1e-5, .world = world_of("periodic=3e-5"), .seed = 3});
    return notes_of(calibrate(experiment, run));
  };
  EXPECT_THAT(note_of(4, false), HasSubstr("in the same order in each block"));
  EXPECT_THAT(note_of(4, true), Not(HasSubstr("in the same order")));
  EXPECT_THAT(note_of(1, true), Not(HasSubstr("own order")));
}

Observations hand_motion(int sessions, Eigen::Index each, double shift, std::uint64_t seed) {
  RandomStream random(seed);
  Observations all;
  all.response.resize(sessions * each, 3);
  for (int session = 0; session < sessions; ++session) {
    const Eigen::Vector3d bias = shift * random.normals<3>();
    for (Eigen::Index i = 0; i < each; ++i) {
      const Eigen::Vector3d u = random.normals<3>().normalized();
      all.response.row(session * each + i) = (u + bias + 1e-3 * random.normals<3>()).transpose();
      all.readings.push_back(
          {.run = static_cast<int>(all.readings.size()) + 1, .block = session + 1});
    }
  }
  all.has_block = true;
  return all;
}

Experiment by_hand() {
  Experiment experiment = test::experiment_for(test::accelerometer_truth());
  experiment.fit.method = Method::magnitude;
  experiment.field = FieldSetup();
  experiment.field.of = std::make_shared<const GravityField>();
  experiment.field.magnitude = 1.0;
  return experiment;
}

TEST(Sessions, AreBlocks) {
  const Experiment experiment = by_hand();
  const Calibration found = calibrate(experiment, hand_motion(4, 60, 3e-3, 4));
  EXPECT_EQ(found.fit.conditions.blocks, 4);
  EXPECT_TRUE(found.fit.conditions.intermediate);
  EXPECT_TRUE(has_component(found, "sessions"));
  // The interval is that of the scatter of four sessions: t(3) 3e-3 / sqrt(4) = 4.8e-3.
  EXPECT_GT(found.fit.statistics->interval_95(0), 1e-3);
  const Calibration alike = calibrate(experiment, hand_motion(4, 60, 0.0, 4));
  EXPECT_LT(alike.fit.statistics->interval_95(0), 1e-3);
}

TEST(BentResponse, IsToldByMagnitudeAndFittedOnWish) {
  Experiment experiment = by_hand();
  Observations run = hand_motion(1, 200, 0.0, 6);
  constexpr double k2 = 0.02;
  run.response.col(0).array() += k2 * run.response.col(0).array().square();
  const Calibration straight = calibrate(experiment, run);
  const auto& warnings = straight.findings.warnings;
  ASSERT_FALSE(warnings.empty());
  EXPECT_EQ(warnings.front().code, WarningCode::nonlinearity);
  EXPECT_GT(std::abs(straight.sensor.response.bias(0)), 1e-3);
  experiment.fit.squares = true;
  const Calibration bent = calibrate(experiment, run);
  EXPECT_TRUE(bent.findings.warnings.empty());
  EXPECT_NEAR(bent.sensor.response.bias(0), 0.0, bent.fit.statistics->interval_95(0));
  const std::string notes = notes_of(bent);
  EXPECT_THAT(notes, HasSubstr("squared terms were fitted"));
  // The squared term k2 (S f)^2 adds k2 S^2 to the reading at full field.
  const std::size_t at = notes.find("the squared terms are");
  ASSERT_NE(at, std::string::npos) << notes;
  const double S = bent.sensor.response.sensitivity(0, 0);
  EXPECT_NEAR(std::stod(notes.substr(at + std::string("the squared terms are").size())), k2 * S * S,
              0.1 * k2 * S * S);
  experiment.fit.robust = true;  // the fit of squares has no robust weights
  EXPECT_THROW(static_cast<void>(calibrate(experiment, run)), SetupError);
}

}  // namespace
}  // namespace axiscal
