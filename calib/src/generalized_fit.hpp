// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/positioner/positioner.hpp"
#include "estimation.hpp"

namespace axiscal {

/// How a reading's field in the sensor changes with the normals of rest and fence face; 3 x 18,
/// faces in the order of Face.
///
/// With z = -n_r, y = n_f less its part along z, x = y cross z (METHOD 2):
/// dz = -dn_r,  dy = x (x . dn_f) - z (y . dz),  dx = -y (x . dn_f) - z (x . dz).
///
/// @param rotation_table_from_positioner  rows x, y, z.
/// @param field_in_table  at the reading's level.
[[nodiscard]] Eigen::Matrix<double, 3, 18> change_with_normals(
    const Eigen::Matrix3d& rotation_table_from_positioner,
    const DesignPoint& point,
    const Eigen::Vector3d& field_in_table);

/// Fits again with face normals that are uncertain: generalised least squares,
/// V = diag(sigma_k^2 / w) + H C H^T, sigma_k by restricted likelihood (METHOD 8).
///
/// Done as a mixed model: the errors of the normals are unknowns with a prior, so that only one
/// regression of readings on coefficients, directions and normals is needed. All readings enter,
/// with the field's direction unknown unless the method knows it.
///
/// @param set         the readings; weight 0 leaves one out.
/// @param estimate    of the ordinary fit; coefficients, fields, residual_sd, degrees of freedom
/// and
///                    covariance (of the scatter alone) are replaced.
/// @param known_field whether the directions in estimate.fields are given.
/// @return what the normals leave in the coefficients' covariance; nothing, and the estimate as it
///         was, where the readings do not determine all of it.
/// @par Source
/// Searle, Casella & McCulloch, Variance Components (1992), secs. 6.6, 7.6.
[[nodiscard]] std::optional<Eigen::MatrixXd> fit_with_uncertain_normals(
    const ReadingSet& set,
    const Positioner& positioner,
    const Eigen::Matrix3d& rotation_sensor_from_positioner,
    bool known_field,
    Estimate& estimate);

}  // namespace axiscal
