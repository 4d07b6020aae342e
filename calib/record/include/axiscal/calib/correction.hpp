// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/observations.hpp"
#include "axiscal/calib/warning_code.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/positioner/design_point.hpp"

namespace axiscal {

/// The correction of a mistake in the readings. It is applied only on request.
struct Correction {
  /// code of the warning that suggests the correction
  WarningCode code = WarningCode::other;
  std::string message;                                     ///< message of that warning
  std::vector<int> runs;                                   ///< run numbers of the readings
  std::vector<std::pair<int, DesignPoint>> points;         ///< run number, corrected design point
  std::vector<std::pair<int, Eigen::VectorXd>> responses;  ///< run number, corrected values
  std::vector<std::pair<int, FieldLevel>> levels;          ///< run number, corrected level
  std::vector<int> leave_out;                              ///< run numbers to leave out
};

/// @return the observations with corrected points, responses and levels. They still include the
///         runs in `leave_out`.
[[nodiscard]] AXISCAL_EXPORT Observations corrected(Observations observations,
                                                    const Correction& correction);

}  // namespace axiscal
