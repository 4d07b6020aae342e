// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axiscal/calib/calibration_fit.hpp"
#include "axiscal/calib/confirmation.hpp"
#include "axiscal/calib/correction.hpp"
#include "axiscal/calib/note_code.hpp"
#include "axiscal/calib/sensor_model.hpp"
#include "axiscal/calib/verdict.hpp"
#include "axiscal/calib/warning_code.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// Something that asks for the user's attention.
struct CalibrationWarning {
  WarningCode code = WarningCode::other;
  std::vector<int> runs;  ///< the readings concerned; may be empty
  std::string message;    ///< the finding and the action
};

/// The findings of a calibration: whether it is valid, and the points to look at.
struct Findings {
  CalibrationStatus status = CalibrationStatus::ok;
  std::optional<Verdict> verdict;            ///< where limits were applied
  std::optional<Confirmation> confirmation;  ///< where readings were kept out of the fit for it
  std::vector<CalibrationWarning> warnings;
  std::optional<Correction> suggestion;  ///< the remedy for the run, if a mistake was found
  std::vector<Correction> corrections;   ///< made on request; the corrected readings are
                                         ///< not kept in the file
  std::vector<CalibrationNote> notes;
};

/// A file that went into a calibration.
struct InputFileDigest {
  std::string path;
  std::string sha256;
  bool is_log = false;  ///< true: a log, whose rests are the readings; false: a table of readings
};

/// Where a calibration comes from.
struct Provenance {
  std::string created;      ///< when it was computed; ISO 8601, UTC
  std::string measured;     ///< when the last reading was taken; ISO 8601, UTC; empty if not stated
  std::string software;     ///< e.g. "axiscal 0.1.0"
  std::string operated_by;  ///< who took the readings; empty if not stated
  std::vector<InputFileDigest> inputs;
  /// The experiment as written by experiment_json(); empty if unknown.
  std::string experiment;
  std::string positioner;  ///< its id; empty for the nominal cube
  std::string slot;        ///< where in an assembly the instrument sat; may be empty
  int instance = 0;        ///< number of the sensor among those of its kind in a log
  std::string device;      ///< by which the vehicle's software knows the sensor; may be empty

  /// @return the date of the calibration: that of its readings, or if none is stated that of its
  ///         computation.
  [[nodiscard]] const std::string& date() const { return measured.empty() ? created : measured; }
};

/// One number of a result with its uncertainty.
struct Quantity {
  double value = 0.0;
  double u = 0.0;    ///< combined standard uncertainty; NaN where none is known
  double U = 0.0;    ///< expanded uncertainty, half the width of the 95 % interval; NaN if unknown
  double dof = 0.0;  ///< effective degrees of freedom; NaN if unknown
  std::string unit;  ///< of value, u and U
};

/// The result of a calibration: the content of a record file (formats.md, Record). Each part can be
/// used alone: the sensor to reduce readings, the fit to judge it.
struct AXISCAL_EXPORT Calibration {
  SensorModel sensor;
  CalibrationFit fit;
  Findings findings;
  Provenance provenance;

  /// @return the status: ok, warning or refused.
  [[nodiscard]] CalibrationStatus status() const { return findings.status; }

  /// @param name  "x.bias", "x.sensitivity.y", "z.scale.d2", ...
  /// @return that parameter with its uncertainty, scatter and stated inputs together.
  /// @throws DomainError  for a name that is none of the record's; the message suggests one.
  [[nodiscard]] Quantity parameter(const std::string& name) const;
};

/// The treatment of a refused calibration; `yes` uses it too.
enum class Force { no, yes };

/// @throws RefusedError  if a calibration was refused and `force` is `no`; the message is the first
///                       of its warnings.
AXISCAL_EXPORT void require_unrefused(const Calibration& calibration, Force force = Force::no);

/// @return whether reduced readings are the field: not where a record of method bias, made without
///         another one's sensitivities, has in its biases what the instrument met of the field.
[[nodiscard]] AXISCAL_EXPORT bool gives_field(const Calibration& calibration);

/// @return true if a record was made from one of these files, by their SHA-256.
[[nodiscard]] AXISCAL_EXPORT bool is_made_from(const Calibration& calibration,
                                               const std::vector<InputFileDigest>& inputs);

/// @return the usual names of the coefficients for this kind of instrument: hard iron,
///         responsivity, ...
[[nodiscard]] AXISCAL_EXPORT std::vector<KindQuantity> quantities_of(
    const Calibration& calibration);

}  // namespace axiscal
