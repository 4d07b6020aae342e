// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The biases and sensitivities of a record, and whose they are.
struct FittedParameters {
  std::string date;  ///< of the calibration, as Provenance::date()
  std::string serial;
  std::vector<std::string> axes;  ///< m
  /// Of each axis its bias [reading unit] and its sensitivity along x, y, z [reading unit / field
  /// unit]: 4 m entries.
  Eigen::VectorXd values;
  Eigen::VectorXd u;  ///< their combined standard uncertainties; NaN where the record has none
};

/// Reads them from a record's file, many times as fast as read_calibration(): nothing else of the
/// file is looked at, be it right or wrong, but that it is whole.
/// @throws DataError  as read_calibration().
[[nodiscard]] AXISCAL_EXPORT FittedParameters read_fitted_parameters(const std::string& path);

}  // namespace axiscal
