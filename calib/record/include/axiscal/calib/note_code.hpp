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
  imported,       ///< contents and gaps of a file that other software wrote
  axes,           ///< limits of an instrument with fewer than three axes
  unseen,         ///< parameters that the readings do not determine
  method,         ///< the method that was used, or a better one
  conditions,     ///< a single block, differences between blocks, earlier calibrations
  correlation,    ///< correlated readings, recordings that are too short for their noise
  not_counted,    ///< inputs without a stated uncertainty: the intervals do not include them
  stated,         ///< stated inputs that the readings contradict
  rounding,       ///< steps of the readings that are wider than their noise
  seats,          ///< repeatability of placing the cube on the table, or the instrument in the cube
  face_normals,   ///< errors of the cube's faces that the uncertainties do not include
  mount,          ///< the frame of the coefficients
  temperature,    ///< the order of the temperature polynomials, readings that deviate from them
  hysteresis,     ///< biases that differ between rising and falling temperature
  drift,          ///< a drift that is a term of the fit
  field,          ///< magnitude, unit and uncertainty of the field
  pose,           ///< method `bias`: the unknown part of the pose
  weights,        ///< weights of the readings, readings with robust weight 0
  tails,          ///< a reading that is wrong, or noise with heavy tails
  corrected,      ///< a mistake that was corrected as suggested
  estimate_bias,  ///< method `magnitude`: the error of the estimator itself
  turns,          ///< method `turns`: attitude errors, omitted rotations, g-sensitivity
  other           ///< a note of a user's program, or of a record from another version
};

/// @return the name of the code in records, for example "conditions".
[[nodiscard]] AXISCAL_EXPORT std::string_view note_name(NoteCode code);

/// @return the code of that name; nullopt for an unknown name.
[[nodiscard]] AXISCAL_EXPORT std::optional<NoteCode> parse_note_code(std::string_view name);

/// A remark about a calibration that does not require action.
struct CalibrationNote {
  NoteCode code = NoteCode::other;
  std::string message;

  friend bool operator==(const CalibrationNote&, const CalibrationNote&) = default;
};

}  // namespace axiscal
