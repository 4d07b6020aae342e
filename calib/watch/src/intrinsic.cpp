// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/intrinsic.hpp"

#include <algorithm>
#include <cmath>

#include "core/formatted.hpp"

namespace axiscal {

IntrinsicParameters intrinsic_parameters(const Calibration& calibration) {
  const SensitivityMatrix& S = calibration.sensor.response.sensitivity;
  const Eigen::Index m = S.rows();
  const std::vector<std::string>& axes = calibration.sensor.instrument.axes;
  IntrinsicParameters result;
  const bool has_u =
      calibration.fit.statistics &&
      calibration.fit.statistics->covariance.rows() ==
          static_cast<Eigen::Index>(calibration.fit.statistics->parameter_names.size()) &&
      calibration.fit.statistics->covariance.size() > 0 &&
      calibration.fit.statistics->covariance.allFinite();
  const Eigen::Index parameters = has_u ? calibration.fit.statistics->covariance.rows() : 0;
  std::vector<double> values;
  std::vector<Eigen::RowVectorXd> gradients;
  const auto put = [&](Eigen::RowVectorXd& gradient, Eigen::Index axis, const std::string& what,
                       double value) {
    if (has_u) {
      const auto at =
          calibration.fit.statistics->position_of(axes[static_cast<std::size_t>(axis)] + what);
      if (at) {
        gradient(*at) += value;
      }
    }
  };
  const auto add = [&](std::string name, double value, Eigen::RowVectorXd gradient) {
    result.names.push_back(std::move(name));
    values.push_back(value);
    gradients.push_back(std::move(gradient));
  };
  const auto put_row = [&](Eigen::RowVectorXd& gradient, Eigen::Index axis,
                           const Eigen::Vector3d& by) {
    for (int j = 0; j < 3; ++j) {
      put(gradient, axis, ".sensitivity." + std::string(1, "xyz"[j]), by(j));
    }
  };
  for (Eigen::Index k = 0; k < m; ++k) {
    const std::string& axis = axes[static_cast<std::size_t>(k)];
    Eigen::RowVectorXd of_bias = Eigen::RowVectorXd::Zero(parameters);
    put(of_bias, k, ".bias", 1.0);
    add(axis + ".bias", calibration.sensor.response.bias(k), of_bias);
    const Eigen::Vector3d row = S.row(k);
    Eigen::RowVectorXd of_length = Eigen::RowVectorXd::Zero(parameters);
    put_row(of_length, k, row.normalized());
    add(axis + ".sensitivity", row.norm(), of_length);
  }
  for (Eigen::Index k = 0; k < m; ++k) {
    for (Eigen::Index l = k + 1; l < m; ++l) {
      const Eigen::Vector3d a = S.row(k);
      const Eigen::Vector3d b = S.row(l);
      const Eigen::Vector3d u = a.normalized();
      const Eigen::Vector3d v = b.normalized();
      const double cosine = std::clamp(u.dot(v), -1.0, 1.0);
      const double sine = std::max(std::sqrt(1.0 - cosine * cosine), 1e-12);
      Eigen::RowVectorXd gradient = Eigen::RowVectorXd::Zero(parameters);
      put_row(gradient, k, -(v - cosine * u) / (a.norm() * sine));
      put_row(gradient, l, -(u - cosine * v) / (b.norm() * sine));
      add(formatted("angle.{}.{}", axes[static_cast<std::size_t>(k)],
                    axes[static_cast<std::size_t>(l)]),
          std::acos(cosine), gradient);
    }
  }
  result.values =
      Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  if (has_u) {
    // A bias is also a parameter of the record, so its stated uncertainty is used.
    const std::vector<ParameterUncertainty> stated = parameter_uncertainties(calibration);
    const auto uncertainty_of = [&](const std::string& name, const Eigen::RowVectorXd& gradient) {
      const auto own =
          std::find_if(stated.begin(), stated.end(),
                       [&](const ParameterUncertainty& one) { return one.name == name; });
      return own == stated.end() ? propagate(calibration, gradient) : own->uncertainty;
    };
    Eigen::MatrixXd G(result.values.size(), parameters);
    for (std::size_t i = 0; i < gradients.size(); ++i) {
      G.row(static_cast<Eigen::Index>(i)) = gradients[i];
      result.uncertainty.push_back(uncertainty_of(result.names[i], gradients[i]));
    }
    result.covariance = G * parameter_covariance(calibration) * G.transpose();
  }
  return result;
}

double e_n_score(double value_1, double expanded_1, double value_2, double expanded_2) {
  return (value_1 - value_2) / std::hypot(expanded_1, expanded_2);
}

}  // namespace axiscal
