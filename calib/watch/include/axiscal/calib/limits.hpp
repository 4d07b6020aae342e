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

/// One tolerance.
struct Limit {
  std::string parameter;  ///< see evaluate()
  std::optional<double> low;
  std::optional<double> high;
};

/// The requirements for a unit (formats.md, Limits).
struct Limits {
  std::string path;             ///< of their file, for messages
  std::string rule = "simple";  ///< "simple" or "guarded"
  bool intermediate = false;    ///< biases must be known between days or mounts, not by one block
  std::vector<Limit> limits;
};

/// @return true if a limit may be stated for a parameter of that name: a coefficient, the angle
///         between two axes, `AXIS.residual_sd`, `levelness.x`, `pitch_error_deg`, `drift_p_value`,
///         or the number of `readings` or `design_points` of a calibration.
[[nodiscard]] AXISCAL_EXPORT bool is_limit_parameter(std::string_view name,
                                                     const std::vector<std::string>& axes);

/// Reads limits from JSON.
/// @throws DataError  `PATH: /json/pointer: ...`.
[[nodiscard]] AXISCAL_EXPORT Limits parse_limits(std::string_view text, const std::string& path);
[[nodiscard]] AXISCAL_EXPORT Limits read_limits(const std::string& path);

/// Accepts or rejects (JCGM 106:2012). `simple`: the value is within its limits, whatever its
/// uncertainty. `guarded`: it is within them by a guard band of its expanded uncertainty (95 %), so
/// that of the units that pass hardly one is outside; a residual_sd by the quantile of chi-squared
/// that its 95 % bound has. Each verdict states the probability that the true value conforms, with
/// nothing known beforehand.
///
/// A guarded limit on a bias that one block of readings found passes with a note, or where the
/// limits ask for intermediate conditions not at all.
///
/// A parameter is a coefficient's name ("x.sensitivity.x", "z.bias.d"), an axis's residual_sd, an
/// intrinsic parameter ("x.sensitivity", "angle.x.y" in rad), "levelness.x", "levelness.y",
/// "pitch_error_deg" or "drift_p_value". "pitch_error_deg" of a check is the largest error of the
/// pitch from the drift; for a calibration it is the expanded uncertainty of the pitch.
/// "drift_p_value" belongs to a check.
///
/// @param check  where the limits are applied to a check; else null.
/// @throws DomainError  for a parameter that there is not; the message lists what there is.
/// @par Source
/// JCGM 106:2012, secs. 7.2, 8.3; method.md, section 9.
[[nodiscard]] AXISCAL_EXPORT Verdict evaluate(const Limits& limits,
                                              const Calibration& calibration,
                                              const DriftCheck* check = nullptr);

/// @return "" for a unit that passes, else why it does not, in a line.
[[nodiscard]] AXISCAL_EXPORT std::string reason_of(const Verdict& verdict);

}  // namespace axiscal
