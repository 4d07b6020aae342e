// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/polar_fit.hpp"

#include <cmath>
#include <numbers>

#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "calib/regression/gauss_newton.hpp"

namespace axiscal {
namespace {

// The parameters in this order: bias, sensitivity, coning angle, azimuth.
using PolarParameters = Eigen::Vector4d;

Eigen::Vector3d row_of(const PolarParameters& p, int axis, AxisConvention convention) {
  return sensitivity_from_polar(
      {.sensitivity = p(1), .coning_angle_rad = p(2), .azimuth_rad = p(3)}, axis, convention);
}

// The problem for gauss_newton(): fits the readings v = b + F s of one axis. The rows of F are the
// fields, and s is the row of the sensitivity matrix, in polar form.
class PolarProblem {
 public:
  using State = PolarParameters;
  using Linear = Linearised;

  PolarProblem(const Eigen::Matrix<double, Eigen::Dynamic, 3>& field,
               const Eigen::VectorXd& response,
               int axis,
               AxisConvention convention)
      : field_(field), response_(response), axis_(axis), convention_(convention) {}

  [[nodiscard]] Eigen::VectorXd residuals(const PolarParameters& at) const {
    return along(at) + Eigen::VectorXd::Constant(response_.size(), at(0)) - response_;
  }

  void linearise(const PolarParameters& at, Linear& linear) const {
    linear.residuals = residuals(at);
    linear.jacobian.resize(response_.size(), 4);
    linear.jacobian.col(0).setOnes();
    // The row of the sensitivity matrix is proportional to the sensitivity. Its derivatives with
    // respect to the two angles have the same form as the row, but with other angles.
    PolarParameters unit = at;
    unit(1) = 1.0;
    linear.jacobian.col(1) = along(unit);
    PolarParameters turned = at;
    turned(2) += 0.5 * std::numbers::pi;  // derivative with respect to the coning angle
    linear.jacobian.col(2) = along(turned);
    PolarParameters flat = at;
    flat(2) = 0.5 * std::numbers::pi;
    flat(3) += 0.5 * std::numbers::pi;
    linear.jacobian.col(3) = std::sin(at(2)) * along(flat);
  }
  [[nodiscard]] static PolarParameters moved(const PolarParameters& at,
                                             const PolarParameters& step) {
    return at + step;
  }
  [[nodiscard]] double cost(const PolarParameters& at, const Linear& /*before*/) const {
    return residuals(at).squaredNorm();
  }
  // Returns the change of the readings by the step, relative to the readings. The length of the
  // step itself is not meaningful, because the azimuth is arbitrary if the coning angle is 0.
  [[nodiscard]] double length(const PolarParameters& /*at*/,
                              const PolarParameters& step,
                              const Linear& there) const {
    const PolarParameters lengths = there.jacobian.colwise().norm();
    return lengths.cwiseProduct(step).norm() / response_.norm();
  }

 private:
  [[nodiscard]] Eigen::VectorXd along(const PolarParameters& at) const {
    return field_ * row_of(at, axis_, convention_);
  }

  const Eigen::Matrix<double, Eigen::Dynamic, 3>& field_;
  const Eigen::VectorXd& response_;
  int axis_;
  AxisConvention convention_;
};

}  // namespace

PolarFit fit_polar_form(const Eigen::Matrix<double, Eigen::Dynamic, 3>& field_in_sensor,
                        const Eigen::VectorXd& response,
                        int nominal_axis,
                        AxisConvention convention) {
  const Eigen::Index n = response.size();
  if (field_in_sensor.rows() != n || n < 4) {
    throw DomainError("fit_polar_form: needs four readings or more, each with its field");
  }
  // An approximate start: the mean, the slope along the nominal axis, and a small coning angle,
  // because the fit is singular at 0.
  const Eigen::VectorXd along = field_in_sensor.col(nominal_axis);
  const double spread = (along.array() - along.mean()).matrix().squaredNorm();
  const double slope = (along.array() - along.mean()).matrix().dot(response) / spread;
  const Eigen::Vector3d straight =
      sensitivity_from_polar({.sensitivity = 1.0}, nominal_axis, convention);
  PolarParameters p(response.mean(), slope / straight(nominal_axis), 1e-3, 0.5);
  constexpr double first_damping = 1e-3;  // near the singular point the azimuth is undetermined
  const PolarProblem problem(field_in_sensor, response, nominal_axis, convention);
  const auto found = gauss_newton(problem, p, {.first_damping = first_damping});
  p = found.state;
  PolarFit fit;
  fit.rounds = found.rounds;
  fit.converged = found.converged;
  fit.bias = p(0);
  // Converts the row to the form that records use, with a coning angle from 0 to pi/2.
  fit.form = polar_from_sensitivity(row_of(p, nominal_axis, convention), nominal_axis, convention);
  fit.residual_sd = n > 4
                        ? std::sqrt(problem.residuals(p).squaredNorm() / static_cast<double>(n - 4))
                        : not_a_number;
  return fit;
}

}  // namespace axiscal
