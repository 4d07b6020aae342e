// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/reduction.hpp"

namespace axiscal {

/// The results of a reading as one vector: components, residual, then the derived values.
inline constexpr Eigen::Index fixed_results = 4;

/// @param derived  how many derived values are wanted, see derived_count().
[[nodiscard]] Eigen::VectorXd results_of(const ReducedReading& reduced, std::size_t derived);

/// @param has_up  whether the direction of up is known besides.
[[nodiscard]] std::size_t derived_count(const Reducer& reducer, bool has_up);

/// @return the names of results_of(), without a direction of up.
[[nodiscard]] std::vector<std::string> names_of_results(const Reducer& reducer);

/// @return true if a result is an angle [deg]; its differences are then taken modulo 360.
[[nodiscard]] bool result_is_angle(const Reducer& reducer, Eigen::Index result);

/// @return a - b; of angles the short way round [deg].
[[nodiscard]] double difference_of_results(double a, double b, bool angle);

/// @return the change of the results from `below` to `above`, per unit; both are `step` away from
///         `at`. Next to a gap between two angles only one side has the angle.
[[nodiscard]] Eigen::VectorXd slope_of_results(const Reducer& reducer,
                                               const Eigen::VectorXd& below,
                                               const Eigen::VectorXd& at,
                                               const Eigen::VectorXd& above,
                                               double step);

}  // namespace axiscal
