// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "axiscal/calib/verdict.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

struct Calibration;
struct DriftCheck;

/// The limits of one parameter.
struct Limit {
  std::string parameter;  ///< see evaluate()
  std::optional<double> low;
  std::optional<double> high;
};

/// The requirements for a unit (formats.md, Limits).
struct Limits {
  std::string path;             ///< path of the file, for messages
  std::string rule = "simple";  ///< "simple" or "guarded"
  /// If true, rule `guarded` rejects a bias that comes from only one block of readings.
  bool intermediate = false;
  std::vector<Limit> limits;
};

/// @return true if a limit may be stated for a parameter of that name: a coefficient, the angle
///         between two axes, `AXIS.residual_sd`, `levelness.x`, `pitch_error_deg`, `drift_p_value`,
///         or the number of `readings` or `design_points` of a calibration.
[[nodiscard]] AXISCAL_EXPORT bool is_limit_parameter(std::string_view name,
                                                     const std::vector<std::string>& axes);

/// Reads limits from JSON.
/// @throws DataError  if the text is invalid; the message starts with `PATH: /json/pointer: `.
[[nodiscard]] AXISCAL_EXPORT Limits parse_limits(std::string_view text, const std::string& path);
[[nodiscard]] AXISCAL_EXPORT Limits read_limits(const std::string& path);

/// Accepts or rejects a unit (JCGM 106:2012).
///
/// Rule `simple` accepts a value within its limits and ignores its uncertainty. Rule `guarded`
/// accepts a value whose distance from the limits is at least its guard band. The guard band is the
/// expanded uncertainty (95 %). For a residual_sd the guard band is the distance from the value to
/// its upper 95 % bound (chi-squared distribution). Each verdict states the probability that the
/// true value is within the limits. This probability uses no prior knowledge of the true value.
///
/// With rule `guarded`, a bias from only one block of readings gets a note. If Limits::intermediate
/// is true, such a bias fails.
///
/// A parameter is a coefficient's name ("x.sensitivity.x", "z.bias.d"), an axis's residual_sd, an
/// intrinsic parameter ("x.sensitivity", "angle.x.y" in rad), "levelness.x", "levelness.y",
/// "pitch_error_deg" or "drift_p_value". "pitch_error_deg" of a check is the largest error of the
/// pitch that the drift causes; "pitch_error_deg" of a calibration is the expanded uncertainty of
/// the pitch. "drift_p_value" exists only for a check.
///
/// @param check  the check to which the limits apply; null if they apply to the calibration.
/// @throws DomainError  if a limit's parameter does not exist; the message lists all parameters.
/// @par Source
/// JCGM 106:2012, secs. 7.2, 8.3; method.md, section 9.
[[nodiscard]] AXISCAL_EXPORT Verdict evaluate(const Limits& limits,
                                              const Calibration& calibration,
                                              const DriftCheck* check = nullptr);

/// @return the reasons why a unit fails, in one line; empty if it passes.
[[nodiscard]] AXISCAL_EXPORT std::string reason_of(const Verdict& verdict);

}  // namespace axiscal
