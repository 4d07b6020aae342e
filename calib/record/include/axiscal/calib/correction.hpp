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

/// The remedy for a mistake in the readings. It is applied only on request.
struct Correction {
  WarningCode code = WarningCode::other;                   ///< which warning suggests it
  std::string message;                                     ///< the finding of that warning
  std::vector<int> runs;                                   ///< the readings concerned
  std::vector<std::pair<int, DesignPoint>> points;         ///< run and the point it was taken at
  std::vector<std::pair<int, Eigen::VectorXd>> responses;  ///< the run and the proposed value
  std::vector<std::pair<int, FieldLevel>> levels;          ///< run and the level it was taken at
  std::vector<int> leave_out;                              ///< runs that only leaving out mends
};

/// @return the observations with points, responses and levels corrected. Readings to be left out
///         are still in it.
[[nodiscard]] AXISCAL_EXPORT Observations corrected(Observations observations,
                                                    const Correction& correction);

}  // namespace axiscal
