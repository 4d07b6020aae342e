// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace axiscal {

/// What a note of a record is about (docs/messages.md). A note asks for nothing.
enum class NoteCode {
  input,          ///< what of the files was taken, joined or left out
  imported,       ///< what another software's file held, and lacked
  axes,           ///< what fewer than three axes can say
  unseen,         ///< parameters that no reading shows
  method,         ///< which method was taken, or would do better
  conditions,     ///< repeatability only, how blocks differ, earlier calibrations
  correlation,    ///< readings that are alike, recordings that are short for their noise
  rounding,       ///< steps of the readings that are wider than their noise
  seats,          ///< how the cube, or the instrument in it, lies anew
  face_normals,   ///< errors of the cube's faces that are not counted
  mount,          ///< in which frame the instrument is described
  temperature,    ///< the order of its terms, soaks off their curve
  hysteresis,     ///< biases on the way up and on the way down
  drift,          ///< a drift that is part of the fit
  field,          ///< its magnitude, unit and uncertainty
  pose,           ///< method bias: what is not known of the pose
  weights,        ///< readings that the robust regression gives none
  tails,          ///< a reading that is wrong, or noise with heavy tails
  corrected,      ///< a mistake that was mended as suggested
  estimate_bias,  ///< method magnitude: what its estimate is off by itself
  turns,          ///< method turns: attitude errors, turns left out, g-sensitivity
  other           ///< a program's own, or of an earlier version
};

/// @return the code as records spell it, as "conditions".
[[nodiscard]] std::string_view note_name(NoteCode code);

/// @return the code of that name.
[[nodiscard]] std::optional<NoteCode> parse_note_code(std::string_view name);

/// A remark about a calibration that asks for nothing.
struct CalibrationNote {
  NoteCode code = NoteCode::other;
  std::string message;

  friend bool operator==(const CalibrationNote&, const CalibrationNote&) = default;
};

}  // namespace axiscal
