// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "calib/fit/estimation.hpp"
#include "calib/fit/saturated_axes.hpp"
#include "calib/mistakes/culprit.hpp"

namespace axiscal {

/// Largest condition number of a design without a warning. A standard design has less than 5.
inline constexpr double largest_good_condition = 30.0;

/// Results of tests that do not affect the uncertainty of a fit.
struct FitTests {
  std::vector<SaturatedAxis> saturated;
  std::optional<CurvatureTest> curvature;
};

/// The input of the warning rules: a finished fit and its tests.
struct JudgedRun {
  const Calibration& calibration;  ///< contains coefficients, statistics and residuals
  const Estimate& estimate;
  const FitTests& tests;
  const MistakeSearch& mistakes;
  /// Warnings of mistakes that the fit models by a term: a drift, a step of the biases, or a memory
  /// (hysteresis).
  const std::vector<CalibrationWarning>& taken_in;
  bool searched = false;           ///< true if the readings were searched for mistakes
  std::vector<int> unpaired_runs;  ///< run numbers of the readings left out by method `paired`
  bool field_varies = false;       ///< true if the field magnitudes stated with readings differ
};

/// The warnings that rules find.
struct Warnings {
  void add(WarningCode code, std::vector<int> runs, std::string message) {
    all.push_back({.code = code, .runs = std::move(runs), .message = std::move(message)});
  }

  std::vector<CalibrationWarning> all;
};

/// A test of a finished fit that can add warnings. Each rule has its own file in src/rules/, and is
/// listed in src/rules/rules.cpp. docs/messages.md lists the codes and the significance levels.
struct WarningRule {
  std::string_view name;
  void (*find)(const JudgedRun& run, Warnings& found) = nullptr;
};

/// @return all rules, the most serious first.
[[nodiscard]] std::span<const WarningRule> warning_rules();

/// Adds a user-defined rule after the existing rules. No other thread may calibrate during the
/// call.
void add_warning_rule(const WarningRule& rule);

/// @return the warnings of all rules, in the order of the rules; empty for a good run.
[[nodiscard]] std::vector<CalibrationWarning> find_warnings(const JudgedRun& run);

}  // namespace axiscal
