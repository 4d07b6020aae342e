// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <utility>

#include "axiscal/core/not_a_number.hpp"
#include "instruments/src/kinds/kinds.hpp"

namespace axiscal {
namespace {

// Writes b and S into one vector, axis by axis. response_of() is the inverse.
Eigen::VectorXd parameters_of(const LinearResponse& response) {
  const Eigen::Index m = response.bias.size();
  Eigen::VectorXd all(4 * m);
  for (Eigen::Index k = 0; k < m; ++k) {
    all.segment<4>(4 * k) << response.bias(k), response.sensitivity.row(k).transpose();
  }
  return all;
}

LinearResponse response_of(const Eigen::VectorXd& all) {
  const Eigen::Index m = all.size() / 4;
  LinearResponse response{.bias = Eigen::VectorXd(m), .sensitivity = SensitivityMatrix(m, 3)};
  for (Eigen::Index k = 0; k < m; ++k) {
    response.bias(k) = all(4 * k);
    response.sensitivity.row(k) = all.segment<3>(4 * k + 1);
  }
  return response;
}

// Computes the derivatives by central differences. steps() returns steps that are so small that the
// quantity is nearly linear within them.
Eigen::MatrixXd jacobian(const Eigen::VectorXd& at,
                         const Eigen::VectorXd& step,
                         const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& of) {
  Eigen::MatrixXd J;
  for (Eigen::Index j = 0; j < at.size(); ++j) {
    Eigen::VectorXd more = at;
    Eigen::VectorXd less = at;
    more(j) += step(j);
    less(j) -= step(j);
    const Eigen::VectorXd change = (of(more) - of(less)) / (2.0 * step(j));
    if (J.size() == 0) {
      J.resize(change.size(), at.size());
    }
    J.col(j) = change;
  }
  return J;
}

Eigen::VectorXd steps(const Eigen::VectorXd& at, const Eigen::MatrixXd& covariance) {
  const double smallest = 1e-7 * at.cwiseAbs().maxCoeff();
  return (0.1 * covariance.diagonal().cwiseSqrt()).cwiseMax(smallest);
}

}  // namespace

std::vector<double> propagated(const CalibratedInstrument& calibrated,
                               const std::function<Eigen::VectorXd(const LinearResponse&)>& of) {
  const Eigen::VectorXd at = parameters_of(calibrated.response);
  const Eigen::MatrixXd& C = calibrated.covariance;
  if (C.rows() != at.size() || !C.allFinite()) {
    return std::vector<double>(static_cast<std::size_t>(of(calibrated.response).size()),
                               not_a_number);
  }
  const Eigen::MatrixXd J =
      jacobian(at, steps(at, C), [&](const Eigen::VectorXd& all) { return of(response_of(all)); });
  const Eigen::VectorXd u = (J * C * J.transpose()).diagonal().cwiseMax(0.0).cwiseSqrt();
  return {u.begin(), u.end()};
}

KindQuantity quantity_of(const CalibratedInstrument& calibrated,
                         std::string name,
                         std::string of_what,
                         std::string unit,
                         const std::function<Eigen::VectorXd(const LinearResponse&)>& of) {
  const Eigen::VectorXd values = of(calibrated.response);
  return {.name = std::move(name),
          .of = std::move(of_what),
          .values = {values.begin(), values.end()},
          .u = propagated(calibrated, of),
          .unit = std::move(unit)};
}

double propagate_field_uncertainty(const CalibratedInstrument& calibrated,
                                   const std::function<double(const Eigen::Vector3d&)>& of) {
  if (!calibrated.in_table || !calibrated.in_table_covariance ||
      !calibrated.in_table_covariance->allFinite()) {
    return not_a_number;
  }
  const Eigen::MatrixXd C = *calibrated.in_table_covariance;
  const Eigen::VectorXd at = *calibrated.in_table;
  const Eigen::MatrixXd J = jacobian(at, steps(at, C), [&](const Eigen::VectorXd& field) {
    return Eigen::VectorXd::Constant(1, of(field));
  });
  return std::sqrt(std::max((J * C * J.transpose())(0, 0), 0.0));
}

KindQuantity angle_of_field(const CalibratedInstrument& calibrated,
                            std::string name,
                            const std::function<double(const Eigen::Vector3d&)>& angle_rad) {
  const auto angle_deg = [&](const Eigen::Vector3d& field) {
    return angle_rad(field) * deg_per_rad;
  };
  return {.name = std::move(name),
          .of = "",
          .values = {angle_deg(*calibrated.in_table)},
          .u = {propagate_field_uncertainty(calibrated, angle_deg)},
          .unit = "degree"};
}

double fence_azimuth_from(const Eigen::Vector3d& in_table) {
  // If the fence's azimuth is psi, the unit vector to the north is (-sin psi, cos psi) in the
  // table's frame.
  return std::atan2(-in_table.x(), in_table.y());
}

}  // namespace axiscal
