// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
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

/// Reads them from a record's text, many times as fast as parse_calibration(). It does not check
/// the other members of the record.
/// @param name  of the record, for messages.
/// @throws DataError  as parse_calibration().
[[nodiscard]] AXISCAL_EXPORT FittedParameters parse_fitted_parameters(std::string_view text,
                                                                      const std::string& name);

}  // namespace axiscal
