// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"

namespace axiscal {

/// The names of two sources of uncertainty: the field's magnitude, and the electrical reference of
/// the readings (for example the voltage reference).
inline constexpr const char* field_magnitude_source = "field magnitude";
inline constexpr const char* reference_source = "reference of the readings";

/// One source of a calibration's uncertainty, and its effect on every parameter.
struct UncertaintySource {
  std::string name;          ///< "fit", "positioner", "levelness", "field magnitude", ...
  std::string type;          ///< "A" for the scatter of the readings, "B" for other sources
  std::string distribution;  ///< "t", "normal", "rectangular"
  double input_u = 0.0;      ///< standard uncertainty of the input quantity; NaN for several inputs
  std::string input_unit;    ///< the unit of input_u; empty if input_u is not stated
  /// Degrees of freedom: infinite for type B; NaN for the fit, because they differ between axes.
  double degrees_of_freedom = 0.0;
  /// Covariance of the parameters, in the order of FitStatistics::parameter_names; empty for the
  /// fit, whose covariance is FitStatistics::covariance.
  Eigen::MatrixXd covariance;
};

/// The uncertainty budget of a calibration according to the GUM (method.md, section 8). It contains
/// the scatter of the fit, and the sources whose errors do not increase this scatter.
struct UncertaintyBudget {
  std::vector<UncertaintySource> sources;
  double resolution = 0.0;     ///< stated resolution of the readings [unit]; 0: not stated
  double temperature_u = 0.0;  ///< stated standard uncertainty of the temperature output
};

}  // namespace axiscal
