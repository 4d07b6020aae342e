// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/instruments/instrument.hpp"

namespace axiscal {

/// One sensing axis in the notation of the wind-tunnel literature.
struct PolarForm {
  double sensitivity = 0.0;       ///< s [unit per field unit], with the sign of T_k (see below)
  double coning_angle_rad = 0.0;  ///< Omega: angle between nominal and true axis, 0 to pi/2
  double azimuth_rad = 0.0;       ///< A: azimuth of the true axis, in (-pi, pi]; 0 if Omega = 0
};

/// Computes sensitivity, coning angle and azimuth of one axis from its row of S.
///
/// T is the row of S in forward-right-down axes. k is the index of the nominal axis; k+1 and k+2
/// are the next two axes in the cyclic order x, y, z.
///
///     s = sign(T_k) |T|
///     Omega = atan2(hypot(T_k+1, T_k+2), |T_k|)
///     A = atan2(T_k+2 / s, T_k+1 / s)
///
/// If the convention is forward-left-up, T is the row times diag(1, -1, -1). Therefore, as in the
/// source, s is negative for an axis y or z that is not reversed.
///
/// @param sensitivity   the axis's row of S [unit per field unit], frame sensor.
/// @param nominal_axis  k, the nominal direction of the axis: 0, 1, 2 for x, y, z.
/// @param convention    the convention of the sensor's axes.
/// @throws DomainError  if `nominal_axis` is not 0, 1 or 2.
/// @par Source
/// Tripp and Tcheng, NASA/TP-1999-209835; US 7,467,536; method.md, section 3.1.
[[nodiscard]] AXISCAL_EXPORT PolarForm polar_from_sensitivity(const Eigen::Vector3d& sensitivity,
                                                              int nominal_axis,
                                                              AxisConvention convention);

/// Computes the row of S of one axis, as the inverse of polar_from_sensitivity(). With the unit
/// vectors e_k of the axes,
///
///     T = s (cos(Omega) e_k + sin(Omega) (cos(A) e_k+1 + sin(A) e_k+2))
///
/// @return the axis's row of S [unit per field unit], frame sensor.
/// @throws DomainError  if `nominal_axis` is not 0, 1 or 2.
/// @par Source
/// method.md, section 3.1.
[[nodiscard]] AXISCAL_EXPORT Eigen::Vector3d sensitivity_from_polar(const PolarForm& polar,
                                                                    int nominal_axis,
                                                                    AxisConvention convention);

}  // namespace axiscal
