// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/history.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/logs/noise_json.hpp"
#include "axiscal/positioner/surface.hpp"

namespace axiscal {

struct ReportOptions {
  /// Observations of the calibration, for the values and times of the readings; may be null.
  const Observations* observations = nullptr;
  /// Histories of instruments. The report shows the drift from the first history whose serial
  /// number is that of the calibrated instrument.
  std::vector<UnitHistory> history;
  /// Positions of the table's adjusters (levelling screws). If set, the report states how far each
  /// adjuster must be turned to level the table.
  std::optional<Surface> table;
  /// Noise of the instrument at rest, for a chart of the Allan deviations; may be null.
  const LogNoise* noise = nullptr;
};

/// The expanded uncertainty (95 %) of an angle that is computed from one reading. It is the largest
/// value over the directions of the field.
struct WorstAngleUncertainty {
  std::string quantity;       ///< "pitch", "roll", or "direction of the field"
  double expanded_deg = 0.0;  ///< NaN if the record does not state uncertainties
};

/// @param calibration  a record of three axes or more.
/// @return the larger of the uncertainties of pitch and roll, for instruments that measure them.
///         Only pitch angles up to 80 degrees count, because roll is undefined near 90 degrees. For
///         other instruments, the uncertainty of the field's direction computed from a reading.
[[nodiscard]] WorstAngleUncertainty worst_angle_uncertainty(const Calibration& calibration);

/// Writes a report of a calibration as one HTML page. The page does not load other files.
///
/// Sections: verdict, instrument and run, the cube at its design points, coefficients, residuals,
/// levelness, uncertainty, temperature, orientations, drift. Each plot has a drawing, a description
/// in words and a data table. If this build contains the script of the page, the script shows
/// values at the pointer and turns the cube. All text from the record is escaped.
///
/// @return an HTML page, UTF-8.
[[nodiscard]] std::string calibration_report(const Calibration& calibration,
                                             const ReportOptions& options = {});

}  // namespace axiscal
