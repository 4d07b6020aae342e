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

/// A finding that the user must look at.
struct CalibrationWarning {
  WarningCode code = WarningCode::other;
  std::vector<int> runs;  ///< run numbers of the readings concerned; may be empty
  std::string message;    ///< the finding and the recommended action
};

/// The findings of a calibration: its status, its warnings and its notes.
struct Findings {
  CalibrationStatus status = CalibrationStatus::ok;
  std::optional<Verdict> verdict;            ///< nullopt if no limits were applied
  std::optional<Confirmation> confirmation;  ///< nullopt if no readings were kept out of the fit
  std::vector<CalibrationWarning> warnings;
  std::optional<Correction> suggestion;  ///< the proposed correction, if a mistake was found
  std::vector<Correction> corrections;   ///< corrections that were made on request; a record file
                                         ///< does not store the corrected values
  std::vector<CalibrationNote> notes;
};

/// An input file of a calibration.
struct InputFileDigest {
  std::string path;
  std::string sha256;
  /// True: a sensor log, from whose periods at rest the readings are computed. False: a table of
  /// readings.
  bool is_log = false;
};

/// The origin of a calibration: its dates, software, input files and experiment.
struct Provenance {
  std::string created;      ///< time of the computation; ISO 8601, UTC
  std::string measured;     ///< time of the last reading; ISO 8601, UTC; empty if not stated
  std::string software;     ///< e.g. "axiscal 0.1.0"
  std::string operated_by;  ///< name of the person who took the readings; empty if not stated
  std::vector<InputFileDigest> inputs;
  /// The experiment as written by experiment_json(); empty if unknown.
  std::string experiment;
  std::string positioner;  ///< identifier of the positioner; empty for the nominal cube
  std::string slot;        ///< slot of the instrument in an assembly; may be empty
  int instance = 0;        ///< zero-based index among the sensors of the same kind in a log
  std::string device;      ///< identifier of the sensor in the vehicle's software; may be empty

  /// @return the date of the readings; if it is not stated, the date of the computation.
  [[nodiscard]] const std::string& date() const { return measured.empty() ? created : measured; }
};

/// The value of one quantity of a result, with its uncertainty and unit.
struct Quantity {
  double value = 0.0;
  double u = 0.0;    ///< combined standard uncertainty; NaN if unknown
  double U = 0.0;    ///< expanded uncertainty, half the width of the 95 % interval; NaN if unknown
  double dof = 0.0;  ///< effective degrees of freedom; NaN if unknown
  std::string unit;  ///< the unit of value, u and U
};

/// The result of a calibration: the content of a record file (formats.md, Record). Reductions need
/// only `sensor`. `fit` describes the quality of the fit.
struct AXISCAL_EXPORT Calibration {
  SensorModel sensor;
  CalibrationFit fit;
  Findings findings;
  Provenance provenance;

  /// @return the status: ok, warning or refused.
  [[nodiscard]] CalibrationStatus status() const { return findings.status; }

  /// @param name  "x.bias", "x.sensitivity.y", "z.scale.d2", ...
  /// @return the parameter of that name. Its uncertainty includes the scatter of the readings and
  ///         the stated uncertainties of the inputs.
  /// @throws DomainError  if the record lacks that parameter; the message suggests a name.
  [[nodiscard]] Quantity parameter(const std::string& name) const;
};

/// Tells a function how to treat a refused calibration: `no` throws an error, `yes` accepts the
/// calibration.
enum class Force { no, yes };

/// @throws RefusedError  if the calibration was refused and `force` is `no`; the message contains
///                       its first warning.
AXISCAL_EXPORT void require_unrefused(const Calibration& calibration, Force force = Force::no);

/// @return true if the record converts readings to the field. A record of method bias without
///         sensitivities from another record cannot, because its biases include the response to
///         the field.
[[nodiscard]] AXISCAL_EXPORT bool gives_field(const Calibration& calibration);

/// @return true if the SHA-256 of an input file of the record equals the SHA-256 of one of
///         these files.
[[nodiscard]] AXISCAL_EXPORT bool is_made_from(const Calibration& calibration,
                                               const std::vector<InputFileDigest>& inputs);

/// @return the coefficients, expressed as the quantities that are usual for this kind of
///         instrument, for example hard iron or responsivity.
[[nodiscard]] AXISCAL_EXPORT std::vector<KindQuantity> quantities_of(
    const Calibration& calibration);

}  // namespace axiscal
