// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// The subject of a record's note (docs/messages.md). A note does not require action.
enum class NoteCode {
  input,          ///< the parts of the files that were used, joined or left out
  imported,       ///< the contents and gaps of another software's file
  axes,           ///< the limits of fewer than three axes
  unseen,         ///< parameters that no reading shows
  method,         ///< which method was taken, or would do better
  conditions,     ///< repeatability only, how blocks differ, earlier calibrations
  correlation,    ///< readings that are alike, recordings that are short for their noise
  not_counted,    ///< inputs without a stated uncertainty: the intervals do not include them
  stated,         ///< stated inputs that the readings contradict
  rounding,       ///< steps of the readings that are wider than their noise
  seats,          ///< the repeatability of the cube's seat, or of the instrument in it
  face_normals,   ///< errors of the cube's faces that are not counted
  mount,          ///< in which frame the instrument is described
  temperature,    ///< the order of its terms, soaks off their curve
  hysteresis,     ///< biases on the way up and on the way down
  drift,          ///< a drift that is part of the fit
  field,          ///< its magnitude, unit and uncertainty
  pose,           ///< method bias: the unknown part of the pose
  weights,        ///< readings that the robust regression gives none
  tails,          ///< a reading that is wrong, or noise with heavy tails
  corrected,      ///< a mistake that was mended as suggested
  estimate_bias,  ///< method magnitude: the error of the estimator itself
  turns,          ///< method turns: attitude errors, turns left out, g-sensitivity
  other           ///< a program's own, or of an earlier version
};

/// @return the code as records spell it, as "conditions".
[[nodiscard]] AXISCAL_EXPORT std::string_view note_name(NoteCode code);

/// @return the code of that name.
[[nodiscard]] AXISCAL_EXPORT std::optional<NoteCode> parse_note_code(std::string_view name);

/// A remark about a calibration that asks for nothing.
struct CalibrationNote {
  NoteCode code = NoteCode::other;
  std::string message;

  friend bool operator==(const CalibrationNote&, const CalibrationNote&) = default;
};

}  // namespace axiscal
