// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// @return the suffix of the name of a temperature term: ".d" for power 1, ".d2" for power 2, ...
[[nodiscard]] std::string power_suffix(int power);

/// @return the name suffixes of an axis's temperature terms up to the power `order`:
///         ".bias.d", ".bias.d2", .., ".scale.d", ..
[[nodiscard]] std::vector<std::string> temperature_suffixes(int order);

/// @return the names of all parameters of the axes, axis by axis.
[[nodiscard]] std::vector<std::string> parameter_names(
    const std::vector<std::string>& axes,
    const std::vector<std::string>& also_kinds = {},
    int temperature_order = 0);

/// @return the names of these parameters of each axis, axis by axis.
/// @param columns  indices of the parameters of one axis. The order is: bias, sensitivities along
///                 x, y, z, responses to additional fields.
[[nodiscard]] std::vector<std::string> names_of_columns(
    const std::vector<std::string>& axes,
    const std::vector<Eigen::Index>& columns,
    const std::vector<std::string>& also_kinds = {});

/// Sets interval_dof to the degrees of freedom of each axis, and sets interval_95. Does nothing if
/// interval_dof already has the right size.
void fill_intervals(FitStatistics& statistics);

/// Sets interval_95 from covariance and interval_dof.
void put_intervals(FitStatistics& statistics);

/// Adds a scatter component to the covariance. If this increases the variance of a parameter, the
/// parameter's interval is computed again by combine().
void add_component(ScatterComponent component, FitStatistics& statistics);

/// Sets parameter names, standard errors, coverage factors and intervals of a record from the
/// covariance of its statistics.
void add_intervals(Calibration& calibration);

}  // namespace axiscal
