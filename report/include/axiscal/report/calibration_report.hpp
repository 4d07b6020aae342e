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
  /// The readings of the calibration, for their values and times; may be null.
  const Observations* observations = nullptr;
  /// Histories of units. The report shows the drift from the first history that has the serial
  /// number of the calibrated instrument.
  std::vector<UnitHistory> history;
  /// Positions of the table's adjusters. The report then states the turns that level the table.
  std::optional<Surface> table;
  /// The noise of the instrument at rest, for its Allan deviations; may be null.
  const LogNoise* noise = nullptr;
};

/// The largest expanded uncertainty (95 %) of a direction that one reading gives, over all
/// directions of the field.
struct WorstAngleUncertainty {
  std::string quantity;       ///< "pitch", "roll", "yaw", or "direction of the field"
  double expanded_deg = 0.0;  ///< NaN if the record does not state uncertainties
};

/// @param calibration  a record of three axes or more.
/// @return for instruments with pitch and roll: the larger of their uncertainties, up to 80 degrees
///         of pitch, so that roll is defined. For other instruments: the uncertainty of the angle
///         between the field and the reduced reading.
[[nodiscard]] WorstAngleUncertainty worst_angle_uncertainty(const Calibration& calibration);

/// A report of a calibration as one HTML page. The page does not load other files.
///
/// Sections: verdict, instrument and run, the cube in its design points, coefficients, residuals,
/// levelness, uncertainty, temperature, orientations, drift. Each plot has a drawing, a description
/// in words and a data table. A script, if this build has it, adds readouts and turns the cube. All
/// text from the record is escaped.
///
/// @return an HTML page, UTF-8.
[[nodiscard]] std::string calibration_report(const Calibration& calibration,
                                             const ReportOptions& options = {});

}  // namespace axiscal
