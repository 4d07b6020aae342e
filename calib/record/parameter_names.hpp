// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// ".d", ".d2", .. for a power 1, 2, ... of the temperature.
[[nodiscard]] std::string power_suffix(int power);

/// ".bias.d", ".bias.d2", .., ".scale.d", ..
[[nodiscard]] std::vector<std::string> temperature_suffixes(int order);

/// The names of the parameters of some axes, all columns.
[[nodiscard]] std::vector<std::string> parameter_names(
    const std::vector<std::string>& axes,
    const std::vector<std::string>& also_kinds = {},
    int temperature_order = 0);

/// The names of some columns of [1, f, second fields], for all axes.
[[nodiscard]] std::vector<std::string> names_of_columns(
    const std::vector<std::string>& axes,
    const std::vector<Eigen::Index>& columns,
    const std::vector<std::string>& also_kinds = {});

/// Intervals of the parameters from the covariance and each axis's degrees of freedom, if they are
/// missing.
void fill_intervals(FitStatistics& statistics);

/// Intervals of the parameters by the covariance and the degrees of freedom of each.
void put_intervals(FitStatistics& statistics);

/// Adds a component of the scatter to the covariance, and to the intervals of the parameters that
/// it has a part in, as combine() does.
void add_component(ScatterComponent component, FitStatistics& statistics);

/// From the covariance of a record's statistics: names of the parameters, standard errors, coverage
/// factors, intervals.
void add_intervals(Calibration& calibration);

}  // namespace axiscal
