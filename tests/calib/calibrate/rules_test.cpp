// SPDX-License-Identifier: Apache-2.0
// Each warning rule, tested with a record that is changed so that the rule applies.
#include <algorithm>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "axiscal/calib/calibrate.hpp"
#include "calib/calibrate/src/rules/rule.hpp"
#include "calib/calibrate/warning_rule.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

class Rule : public testing::Test {
 protected:
  Rule()
      : record_(calibrate(
            test::experiment_for(test::accelerometer_truth()),
            test::observe(test::accelerometer_truth(),
                          {.points = 12, .replicates = 2, .noise_sd = 2e-4, .seed = 3}))) {}

  // The warnings of one rule.
  [[nodiscard]] std::vector<CalibrationWarning> found_by(const WarningRule& rule) const {
    Warnings found;
    rule.find({.calibration = record_,
               .estimate = estimate_,
               .tests = tests_,
               .mistakes = mistakes_,
               .taken_in = taken_in_,
               .searched = searched_,
               .unpaired_runs = unpaired_,
               .field_varies = false},
              found);
    return found.all;
  }

  void expect_one(const WarningRule& rule, WarningCode code, const std::string& words) const {
    const std::vector<CalibrationWarning> found = found_by(rule);
    ASSERT_EQ(found.size(), 1U) << rule.name;
    EXPECT_EQ(found.front().code, code);
    EXPECT_THAT(found.front().message, HasSubstr(words));
  }

  Calibration record_;
  Estimate estimate_;
  FitTests tests_;
  MistakeSearch mistakes_;
  std::vector<CalibrationWarning> taken_in_;
  bool searched_ = false;
  std::vector<int> unpaired_;
};

TEST_F(Rule, IsSilentForAGoodRun) {
  for (const WarningRule& rule : warning_rules()) {
    EXPECT_TRUE(found_by(rule).empty()) << rule.name;
  }
  EXPECT_EQ(record_.findings.status, CalibrationStatus::ok);
}

TEST_F(Rule, NamesAnUncertainDirection) {
  estimate_.direction.se_rad = 0.049;
  EXPECT_TRUE(found_by(uncertain_direction_rule()).empty());
  estimate_.direction.se_rad = 0.2;
  expect_one(uncertain_direction_rule(), WarningCode::uncertain_direction, "0.2 rad");
}

TEST_F(Rule, NamesTwoSolutions) {
  estimate_.direction.ambiguity = "another direction fits";
  expect_one(two_solutions_rule(), WarningCode::two_solutions, "another direction fits; give");
}

TEST_F(Rule, NamesReadingsThatDoNotSettle) {
  estimate_.sight.unsettled = true;
  expect_one(one_sided_unsettled_rule(), WarningCode::one_sided_unsettled,
             "almost perpendicular to a one-sided axis");
}

TEST_F(Rule, NamesAGap) {
  record_.fit.orientations.emplace();
  record_.fit.orientations->largest_gap_rad = 2.0;
  record_.fit.orientations->gap = -Eigen::Vector3d::UnitZ();
  expect_one(gap_rule(), WarningCode::coverage, "leave a gap");
}

TEST_F(Rule, NamesAxesThatNoFieldReached) {
  estimate_.sight.seen = Eigen::Matrix3d::Identity().leftCols(2);
  expect_one(unseen_axes_rule(), WarningCode::coverage, "axis z");
}

TEST_F(Rule, NamesAnUncertainSensitivity) {
  estimate_.direction.se_rad = 0.01;
  record_.fit.statistics->sensitivity_se.row(1).setConstant(
      0.2 * record_.sensor.response.sensitivity.row(1).norm());
  expect_one(uncertain_sensitivity_rule(), WarningCode::uncertain_sensitivity, "axis y");
  mistakes_.culprit.emplace();  // it replaces this warning
  EXPECT_TRUE(found_by(uncertain_sensitivity_rule()).empty());
}

TEST_F(Rule, NamesAPoorFit) {
  ReadingResidual& one = record_.fit.residuals[4];
  one.response(2) = 0.5 * record_.sensor.response.sensitivity.row(2).norm();
  const std::vector<CalibrationWarning> found = found_by(poor_fit_rule());
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found.front().code, WarningCode::poor_fit);
  EXPECT_EQ(found.front().runs, std::vector<int>{one.run});
  for (ReadingResidual& residual : record_.fit.residuals) {
    residual.response(2) = one.response(2);
  }
  expect_one(poor_fit_rule(), WarningCode::no_fit, "axis z");
}

TEST_F(Rule, NamesATableThatWasMoved) {
  record_.fit.levelness->block_p_value = 1e-4;
  expect_one(moved_table_rule(), WarningCode::table_moved, "('level_by')");
}

TEST_F(Rule, NamesAxesThatAreExchangedOrReversed) {
  record_.sensor.response.sensitivity.row(0).swap(record_.sensor.response.sensitivity.row(1));
  std::vector<CalibrationWarning> found = found_by(axes_rule());
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found.front().code, WarningCode::axis_swapped);
  record_.sensor.response.sensitivity.row(0).swap(record_.sensor.response.sensitivity.row(1));
  record_.sensor.response.sensitivity.row(2) *= -1.0;
  expect_one(axes_rule(), WarningCode::axis_reversed, "axis z");
}

TEST_F(Rule, NamesALackOfFitButForACulprit) {
  ASSERT_FALSE(record_.fit.statistics->lack_of_fit.empty());
  record_.fit.statistics->lack_of_fit[1].p_value = 1e-6;
  expect_one(lack_of_fit_rule(), WarningCode::lack_of_fit, "axis y");
  mistakes_.culprit.emplace();
  mistakes_.culprit->correction.code = WarningCode::outlier;
  EXPECT_TRUE(found_by(lack_of_fit_rule()).empty());
  mistakes_.culprit->correction.code = WarningCode::saturated;
  EXPECT_EQ(found_by(lack_of_fit_rule()).size(), 1U);
}

TEST_F(Rule, NamesAResponseThatBends) {
  tests_.curvature = CurvatureTest{.p_value = 1e-4, .bends = Eigen::Vector3d(0.0, 1e-3, 0.0)};
  expect_one(nonlinearity_rule(), WarningCode::nonlinearity, "axis y");
  // With the component field_noise the noise grows towards the ends of an axis, so no curvature is
  // reported.
  record_.fit.statistics->components.push_back({.name = "field_noise"});
  EXPECT_TRUE(found_by(nonlinearity_rule()).empty());
}

TEST_F(Rule, NamesASlopeThatContradictsTheGivenField) {
  record_.fit.method = Method::known;
  record_.fit.levelness->mean_x = 0.02;
  expect_one(slope_rule(), WarningCode::slope, "correct the stated slope");
}

TEST_F(Rule, NamesUnpairedReadings) {
  unpaired_ = {3, 7};
  const std::vector<CalibrationWarning> found = found_by(unpaired_rule());
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found.front().runs, unpaired_);
}

TEST_F(Rule, NamesFieldsOfAnotherLength) {
  record_.fit.method = Method::known;
  record_.sensor.field.in_table.reset();
  estimate_.mean_field = 1.2 * record_.sensor.field.magnitude;
  expect_one(field_magnitude_rule(), WarningCode::field_magnitude, "correct the unit");
  estimate_.mean_field = 1.02 * record_.sensor.field.magnitude;
  EXPECT_TRUE(found_by(field_magnitude_rule()).empty());
}

TEST_F(Rule, NamesAPoorDesign) {
  record_.fit.statistics->condition_number = 31.0;
  expect_one(condition_rule(), WarningCode::ill_conditioned, "31");
  record_.fit.statistics->degrees_of_freedom(1) = 0.0;
  expect_one(no_redundancy_rule(), WarningCode::no_redundancy, "equals the number of coefficients");
}

TEST_F(Rule, NamesASaturatedAxis) {
  tests_.saturated = {{.axis = 1, .value = 2.5, .runs = {4, 9}}};
  expect_one(saturated_rule(), WarningCode::saturated, "axis y stop at 2.5");
}

TEST_F(Rule, NamesAFaceUnlessTheReadingsWereSearched) {
  record_.fit.levelness->suspect =
      LevelnessEstimate{.point = *record_.fit.residuals.front().point, .block = 1};
  record_.fit.levelness->p_value = 1e-3;
  expect_one(levelness_rule(), WarningCode::levelness,
             "disagrees with the slope from the other faces");
  searched_ = true;
  EXPECT_TRUE(found_by(levelness_rule()).empty());
}

TEST_F(Rule, NamesOutliersUnlessTheReadingsWereSearched) {
  record_.fit.statistics->studentized(5, 0) = 40.0;
  const std::vector<CalibrationWarning> found = found_by(outliers_rule());
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found.front().code, WarningCode::outlier);
  EXPECT_EQ(found.front().runs, record_.fit.statistics->rows[5].runs);
  searched_ = true;
  EXPECT_TRUE(found_by(outliers_rule()).empty());
}

TEST_F(Rule, SaysWhatTheSearchFound) {
  mistakes_.culprit.emplace();
  mistakes_.culprit->warnings = {{.code = WarningCode::sign, .runs = {2}, .message = "run 2"}};
  expect_one(mistake_rule(), WarningCode::sign, "run 2");
}

}  // namespace
}  // namespace axiscal
