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
  /// The readings, for their times and directions; null without them.
  const Observations* observations = nullptr;
  /// Earlier records of the same unit, for its drift; their unit is the one of the report's serial.
  std::vector<UnitHistory> history;
  /// Positions of the table's adjusters, to compute the turns that level it; nullopt without them.
  std::optional<Surface> table;
  /// Of the instrument at rest, for its Allan deviation; null without it.
  const LogNoise* noise = nullptr;
};

/// The largest expanded uncertainty (95 %) of a direction that one reading gives, over all
/// directions of the field.
struct WorstAngleUncertainty {
  std::string quantity;       ///< "pitch", "roll", "yaw", or "direction of the field"
  double expanded_deg = 0.0;  ///< NaN where the record states no uncertainty
};

/// @param calibration  of three axes.
/// @return for instruments with pitch and roll the worst of the two (up to 80 degrees of pitch, to
///         keep roll defined), else the angle between the field and the reduced reading.
[[nodiscard]] WorstAngleUncertainty worst_angle_uncertainty(const Calibration& calibration);

/// A calibration to look at: one page that needs nothing else, no request, no file.
///
/// Verdict, instrument and run, the cube in its design points, coefficients, residuals, levelness,
/// uncertainty, temperature, orientations, drift. Every plot is drawn, told in words and has its
/// table; the page's script (where this build has one) makes the plots and the cube move. All text
/// from the record is escaped.
///
/// @return an HTML page, UTF-8.
[[nodiscard]] std::string calibration_report(const Calibration& calibration,
                                             const ReportOptions& options = {});

}  // namespace axiscal
