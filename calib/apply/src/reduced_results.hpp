// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/reduction.hpp"

namespace axiscal {

/// The number of results before the derived values: three components and the residual.
inline constexpr Eigen::Index fixed_results = 4;

/// @return the results of a reading as one vector: components, residual, derived values.
/// @param derived  the number of derived values, which derived_count() returns.
[[nodiscard]] Eigen::VectorXd results_of(const ReducedReading& reduced, std::size_t derived);

/// @return the number of derived values (see InstrumentKind::derive).
/// @param has_up  true if the upward vertical is known from an accelerometer.
[[nodiscard]] std::size_t derived_count(const Reducer& reducer, bool has_up);

/// @return the names of the entries of results_of(), if the upward vertical is unknown.
[[nodiscard]] std::vector<std::string> names_of_results(const Reducer& reducer);

/// @return true if a result is an angle in degrees, so that differences are taken modulo 360.
[[nodiscard]] bool result_is_angle(const Reducer& reducer, Eigen::Index result);

/// @return a - b. For angles, it is the difference in degrees modulo 360, in -180 .. 180.
[[nodiscard]] double difference_of_results(double a, double b, bool angle);

/// Computes the derivative of the results with respect to one argument x, by finite differences.
/// `below`, `at` and `above` are the results at x - step, x and x + step. If a result is NaN on one
/// side, only the other side is used.
[[nodiscard]] Eigen::VectorXd slope_of_results(const Reducer& reducer,
                                               const Eigen::VectorXd& below,
                                               const Eigen::VectorXd& at,
                                               const Eigen::VectorXd& above,
                                               double step);

}  // namespace axiscal
