// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/polar_fit.hpp"

#include <cmath>
#include <numbers>

#include "axiscal/calib/minimum_norm.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"

namespace axiscal {
namespace {

// Bias, sensitivity, coning angle, azimuth.
using PolarParameters = Eigen::Vector4d;

Eigen::Vector3d row_of(const PolarParameters& p, int axis, AxisConvention convention) {
  return sensitivity_from_polar(
      {.sensitivity = p(1), .coning_angle_rad = p(2), .azimuth_rad = p(3)}, axis, convention);
}

}  // namespace

PolarFit fit_polar_form(const Eigen::Matrix<double, Eigen::Dynamic, 3>& field_in_sensor,
                        const Eigen::VectorXd& response,
                        int nominal_axis,
                        AxisConvention convention) {
  const Eigen::Index n = response.size();
  if (field_in_sensor.rows() != n || n < 4) {
    throw DomainError("fit_polar_form: four readings or more, each with its field");
  }
  // A rough start: the mean, the spread along the nominal axis, a small cone to leave the singular
  // point.
  const Eigen::VectorXd along = field_in_sensor.col(nominal_axis);
  const double spread = (along.array() - along.mean()).matrix().squaredNorm();
  const double slope = (along.array() - along.mean()).matrix().dot(response) / spread;
  const Eigen::Vector3d straight =
      sensitivity_from_polar({.sensitivity = 1.0}, nominal_axis, convention);
  PolarParameters p(response.mean(), slope / straight(nominal_axis), 1e-3, 0.5);
  const auto residuals = [&](const PolarParameters& at) -> Eigen::VectorXd {
    return response - (field_in_sensor * row_of(at, nominal_axis, convention)).eval() -
           Eigen::VectorXd::Constant(n, at(0));
  };
  PolarFit fit;
  Eigen::VectorXd r = residuals(p);
  double damping = 1e-3;
  constexpr int most_rounds = 200;
  for (; fit.rounds < most_rounds && !fit.converged; ++fit.rounds) {
    Eigen::MatrixXd J(n + 4, 4);
    J.setZero();
    J.col(0).head(n).setOnes();
    // The row is linear in s, and its changes with the angles are rows of other angles.
    PolarParameters unit = p;
    unit(1) = 1.0;
    J.col(1).head(n) = field_in_sensor * row_of(unit, nominal_axis, convention);
    PolarParameters turned = p;
    turned(2) += 0.5 * std::numbers::pi;  // d/dOmega of (cos, sin)
    J.col(2).head(n) = field_in_sensor * row_of(turned, nominal_axis, convention);
    PolarParameters flat = p;
    flat(2) = 0.5 * std::numbers::pi;
    flat(3) += 0.5 * std::numbers::pi;
    J.col(3).head(n) = std::sin(p(2)) * (field_in_sensor * row_of(flat, nominal_axis, convention));
    const Eigen::Vector4d length = J.colwise().norm().cwiseMax(1e-300);
    for (int j = 0; j < 4; ++j) {
      J(n + j, j) = std::sqrt(damping) * length(j);
    }
    Eigen::VectorXd b = Eigen::VectorXd::Zero(n + 4);
    b.head(n) = r;
    const PolarParameters step = minimum_norm_solution(J, b);
    const PolarParameters next = p + step;
    const Eigen::VectorXd left = residuals(next);
    if (left.squaredNorm() <= r.squaredNorm() * (1.0 + 1e-14)) {
      const double change = (length.asDiagonal() * step).norm();
      fit.converged = change <= 1e-13 * response.norm();
      p = next;
      r = left;
      damping = std::max(0.1 * damping, 1e-15);
    } else {
      damping *= 10.0;
      fit.converged = damping > 1e12;  // nothing is left to gain
    }
  }
  fit.bias = p(0);
  // The same row in the one form that is stated: coning angle from 0 to pi/2.
  fit.form = polar_from_sensitivity(row_of(p, nominal_axis, convention), nominal_axis, convention);
  fit.residual_sd = n > 4 ? std::sqrt(r.squaredNorm() / static_cast<double>(n - 4)) : not_a_number;
  return fit;
}

}  // namespace axiscal
