// SPDX-License-Identifier: Apache-2.0
// A program adds its own mistake, cause of scatter, method and rule (docs/extend.md).
#include <algorithm>
#include <string>

#include <gtest/gtest.h>

#include "axiscal/calib/calibrate.hpp"
#include "calib/calibrate/warning_rule.hpp"
#include "calib/fit/cause.hpp"
#include "calib/fit/method_fit.hpp"
#include "calib/mistakes/src/mistake_kind.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

// Number of calls of each of the four since the last reset.
struct Asked {
  int mistake = 0;
  int cause = 0;
  int method = 0;
  int rule = 0;
};
Asked asked;         // NOLINT: plain functions change it
bool warns = false;  // NOLINT: whether the rule warns

double quick_p_of_dummy(const SuspectRun& /*run*/, const HypothesisFit& /*fit*/) {
  ++asked.mistake;
  return 1.0;
}

CountedEstimate counted_dummy(const ScatterAnalysisInput& run, CountedEstimate so_far) {
  ++asked.cause;
  if (run.method.name == "dummy") {
    so_far.estimate.notes.push_back({NoteCode::conditions, "the dummy cause was counted"});
  }
  return so_far;
}

Estimate fitted_dummy(const ReadingSet& readings, bool by_field) {
  ++asked.method;
  return method_fit(Method::known).fitted(readings, by_field);
}

void find_dummy(const JudgedRun& run, Warnings& found) {
  ++asked.rule;
  if (warns) {
    found.add(WarningCode::ill_conditioned, {},
              std::to_string(run.calibration.fit.residuals.size()) + " readings");
  }
}

class Extend : public testing::TestWithParam<int> {
 protected:
  static void SetUpTestSuite() {
    add_mistake_kind({.advice = {}, .quick_p = quick_p_of_dummy});
    add_cause({.name = "dummy", .counted = counted_dummy});
    add_warning_rule({.name = "dummy", .find = find_dummy});
    dummy_ = add_method({.name = "dummy", .by_pose = true, .directions_known = true}, fitted_dummy);
  }

  // A good run of `count` readings.
  [[nodiscard]] static Observations readings(int count) {
    return test::observe(test::accelerometer_truth(),
                         {.points = 12, .replicates = count / 12, .noise_sd = 2e-4, .seed = 4});
  }

  static Method dummy_;
};

Method Extend::dummy_ = Method::joint;

TEST_P(Extend, AsksEachOfAProgramsOwn) {
  Experiment experiment = test::experiment_for(test::accelerometer_truth());
  experiment.fit.method = dummy_;
  asked = {};
  warns = true;
  const Calibration found = calibrate(experiment, readings(GetParam()));
  warns = false;
  EXPECT_GE(asked.mistake, 1);
  EXPECT_EQ(asked.cause, 1);
  EXPECT_EQ(asked.method, 1);
  EXPECT_EQ(asked.rule, 1);
  EXPECT_EQ(method_name(found.fit.method), "dummy");
  ASSERT_EQ(found.findings.warnings.size(), 1U);
  EXPECT_EQ(found.findings.warnings.front().message, std::to_string(GetParam()) + " readings");
  EXPECT_TRUE(std::any_of(
      found.findings.notes.begin(), found.findings.notes.end(),
      [](const CalibrationNote& note) { return note.message == "the dummy cause was counted"; }));
}

// The added method, cause and rule do not change a run of another method.
TEST_P(Extend, LeavesOtherRunsAlone) {
  const Experiment experiment = test::experiment_for(test::accelerometer_truth());
  asked = {};
  const Calibration found = calibrate(experiment, readings(GetParam()));
  EXPECT_EQ(asked.method, 0);
  EXPECT_EQ(asked.rule, 1);
  EXPECT_EQ(found.findings.status, CalibrationStatus::ok);
}

INSTANTIATE_TEST_SUITE_P(Readings, Extend, testing::Values(12, 120));

}  // namespace
}  // namespace axiscal
