// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The biases and sensitivities of a record, with its date, serial number and axes.
struct FittedParameters {
  std::string date;  ///< date of the calibration, as Provenance::date()
  std::string serial;
  std::vector<std::string> axes;  ///< names of the m axes
  /// Axis by axis: bias [reading unit] and sensitivity along x, y, z [reading unit / field unit];
  /// 4 m entries.
  Eigen::VectorXd values;
  Eigen::VectorXd u;  ///< combined standard uncertainties of values; NaN if unknown
};

/// Reads the fitted parameters from the text of a record, many times as fast as
/// parse_calibration(). It does not check the other members of the record.
/// @param name  name of the record, for messages.
/// @throws DataError  as parse_calibration().
[[nodiscard]] AXISCAL_EXPORT FittedParameters parse_fitted_parameters(std::string_view text,
                                                                      const std::string& name);

}  // namespace axiscal
