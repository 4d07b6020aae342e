// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/choices.hpp"
#include "calib/regression/gauss_newton.hpp"

namespace axiscal {

/// Number of parameters: three components of the bias b, and six entries of the matrix A = S^-1.
inline constexpr Eigen::Index ellipsoid_parameters = 9;

using EllipsoidParameters = Eigen::Matrix<double, ellipsoid_parameters, 1>;

/// Row and column of each of the six entries, on and above the diagonal of A.
inline constexpr std::array<std::array<int, 2>, 6> ellipsoid_entries = {
    {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}};

/// The parameters that convert a reading v to the field f = A (v - b). The readings are centred and
/// scaled so that all numbers are near 1.
struct Ellipsoid {
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  Eigen::Matrix3d A = Eigen::Matrix3d::Identity();
};

/// The readings minus their middle, scaled so that the field has a magnitude near 1.
struct EllipsoidCloud {
  Eigen::MatrixXd v;             // n x 3
  Eigen::VectorXd root_weights;  // n
  Eigen::Matrix3d noise;         // covariance of a reading's noise, up to a factor
  MagnitudeShape shape = MagnitudeShape::symmetric;
  std::vector<std::string> names;  // parameter names for error messages

  [[nodiscard]] Eigen::Index size() const { return v.rows(); }
};

/// Returns the ellipsoid after a step of its parameters.
[[nodiscard]] Ellipsoid moved_ellipsoid(const Ellipsoid& from,
                                        const EllipsoidParameters& step,
                                        MagnitudeShape shape);

/// The deviations |f| - 1 and their derivatives, both divided by the standard deviation of |f|.
struct LinearisedEllipsoid : Linearised {
  // n: 1 / standard deviation of |f|, for readings with noise of standard deviation 1
  Eigen::VectorXd scale;
};

[[nodiscard]] LinearisedEllipsoid linearise_ellipsoid(const EllipsoidCloud& cloud,
                                                      const Ellipsoid& at);

/// @param scale  the factors of the deviations, see LinearisedEllipsoid::scale.
/// @return the sum of squares of the weighted deviations |f| - 1.
[[nodiscard]] double ellipsoid_cost(const EllipsoidCloud& cloud,
                                    const Ellipsoid& at,
                                    const Eigen::VectorXd& scale);

/// Fits a sphere to the readings by linear least squares.
[[nodiscard]] Ellipsoid sphere_through(const EllipsoidCloud& cloud);

/// Fits a quadric to the readings by linear least squares. If it is not an ellipsoid, the result is
/// a sphere.
[[nodiscard]] Ellipsoid ellipsoid_start(const EllipsoidCloud& cloud);

/// Fits an ellipsoid by the Gauss-Newton method. The weights are constant within a step and are
/// computed again for the next one.
/// @param robust  weights that multiply those of the readings; empty: all 1.
[[nodiscard]] Ellipsoid converged_ellipsoid(const EllipsoidCloud& cloud,
                                            const Ellipsoid& start,
                                            const Eigen::VectorXd& robust);

}  // namespace axiscal
