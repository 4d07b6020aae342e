// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"

namespace axiscal {

/// The name of the source that is the error of the field's magnitude.
inline constexpr const char* field_magnitude_source = "field magnitude";
inline constexpr const char* reference_source = "reference of the readings";

/// One source of a calibration's uncertainty, and its effect on every parameter.
struct UncertaintySource {
  std::string name;          ///< "fit", "positioner", "levelness", "field magnitude", ...
  std::string type;          ///< "A", from the scatter of the readings, or "B"
  std::string distribution;  ///< "t", "normal", "rectangular"
  double input_u = 0.0;    ///< standard uncertainty of the input quantity; NaN for several at once
  std::string input_unit;  ///< the unit of input_u; empty if input_u is not stated
  double degrees_of_freedom = 0.0;  ///< infinite for type B; of the fit each axis has its own: NaN
  /// Of the parameters, in the order of FitStatistics::covariance; empty for the fit, whose that
  /// is.
  Eigen::MatrixXd covariance;
};

/// The budget of a calibration by the GUM (method.md, section 8): the fit's scatter, and the
/// sources that the fit cannot see.
struct UncertaintyBudget {
  std::vector<UncertaintySource> sources;
  double resolution = 0.0;     ///< as stated, of the readings [unit]; 0: none
  double temperature_u = 0.0;  ///< as stated, of the temperature output
};

}  // namespace axiscal
