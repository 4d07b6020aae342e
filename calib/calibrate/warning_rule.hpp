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

/// Tests of a fit that its uncertainty does not depend on.
struct FitTests {
  std::vector<SaturatedAxis> saturated;
  std::optional<CurvatureTest> curvature;
};

/// A finished fit that is judged.
struct JudgedRun {
  const Calibration& calibration;  ///< with coefficients, statistics and residuals
  const Estimate& estimate;
  const FitTests& tests;
  const MistakeSearch& mistakes;
  const std::vector<CalibrationWarning>& taken_in;  ///< of mistakes that the fit has terms for
  bool searched = false;           ///< true if the readings were searched for mistakes
  std::vector<int> unpaired_runs;  ///< left out by method paired
  bool field_varies = false;       ///< true if the readings bring fields of different lengths
};

/// The warnings that rules find.
struct Warnings {
  void add(WarningCode code, std::vector<int> runs, std::string message) {
    all.push_back({.code = code, .runs = std::move(runs), .message = std::move(message)});
  }

  std::vector<CalibrationWarning> all;
};

/// A test of a finished fit: its level, and its words. Each is one file and one line in
/// warning_rules(). Codes and levels are listed in docs/messages.md.
struct WarningRule {
  std::string_view name;
  void (*find)(const JudgedRun& run, Warnings& found) = nullptr;
};

/// @return all rules, the gravest first.
[[nodiscard]] std::span<const WarningRule> warning_rules();

/// Adds a rule of a program's own behind the others. Not while other threads calibrate.
void add_warning_rule(const WarningRule& rule);

/// @return the warnings of all rules, in their order; empty for a good run.
[[nodiscard]] std::vector<CalibrationWarning> find_warnings(const JudgedRun& run);

}  // namespace axiscal
