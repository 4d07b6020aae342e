// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/reduction.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/QR>

#include "axiscal/core/error.hpp"

namespace axiscal {
namespace {

// Rows of S in units of their axis's scatter; all alike where that is not known.
Eigen::VectorXd row_weights(const Calibration& calibration) {
  const Eigen::Index m = calibration.response.bias.size();
  if (m > 3 && calibration.statistics) {
    const Eigen::VectorXd& sd = calibration.statistics->residual_sd;
    if ((sd.array() > 0.0).all()) {
      return sd.cwiseInverse() / sd.cwiseInverse().maxCoeff();
    }
  }
  return Eigen::VectorXd::Ones(m);
}

}  // namespace

Reducer::Reducer(const Calibration& calibration, const ReductionOptions& options)
    : kind_(&find_instrument_kind(calibration.instrument.kind)),
      magnitude_(options.magnitude.value_or(calibration.field.magnitude)),
      inclination_(options.inclination) {
  inclination_.convention = calibration.instrument.convention;
  if (!(magnitude_ > 0.0) || !std::isfinite(magnitude_)) {
    throw DomainError("Reducer: the field's magnitude must be positive");
  }
  const SensitivityMatrix& S = calibration.response.sensitivity;
  const Eigen::Index m = S.rows();
  if (m == 0 || calibration.response.bias.size() != m || calibration.instrument.axis_count() != m) {
    throw DomainError("Reducer: bias, sensitivity and axes must be of one number");
  }
  for (Eigen::Index k = 0; k < m; ++k) {
    bias_.push_back(calibration.response.bias(k));
    length_.push_back(S.row(k).norm());
    if (!(length_.back() > 0.0)) {
      throw DomainError("Reducer: axis '" +
                        calibration.instrument.axes[static_cast<std::size_t>(k)] +
                        "' has no sensitivity");
    }
  }
  const Eigen::VectorXd weights = row_weights(calibration);
  const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> qr(weights.asDiagonal() * S);
  if (m >= 3 && qr.rank() < 3) {
    throw DomainError(
        "Reducer: the axes' sensitivities lie in one plane, so that readings do not determine the "
        "field");
  }
  const Eigen::MatrixXd inverse = qr.solve(Eigen::MatrixXd(weights.asDiagonal()));
  for (Eigen::Index k = 0; k < m; ++k) {
    inverse_.emplace_back(inverse.col(k));
  }
}

ReducedReading Reducer::reduce(std::span<const double> readings) const noexcept {
  ReducedReading result;
  for (std::size_t k = 0; k < bias_.size(); ++k) {
    result.field_in_sensor += inverse_[k] * (readings[k] - bias_[k]);
  }
  result.residual = result.field_in_sensor.norm() - magnitude_;
  if (kind_->derive != nullptr) {
    result.derived = kind_->derive(result.field_in_sensor, magnitude_, inclination_);
  }
  return result;
}

ReducedAxis Reducer::reduce_axis(std::size_t axis, double reading) const noexcept {
  ReducedAxis result{.component = (reading - bias_[axis]) / length_[axis]};
  if (kind_->has_axis_elevation) {
    const AxisElevation elevation = elevation_of_axis(result.component, magnitude_);
    result.angle_rad = elevation.angle_rad;
    result.clamped = elevation.clamped;
  }
  return result;
}

double Reducer::unseen_component(double first, double second) const {
  if (bias_.size() != 2) {
    throw DomainError("Reducer::unseen_component: the instrument must have two axes");
  }
  const Eigen::Vector3d seen = inverse_[0] * (first - bias_[0]) + inverse_[1] * (second - bias_[1]);
  return std::sqrt(std::max(0.0, magnitude_ * magnitude_ - seen.squaredNorm()));
}

}  // namespace axiscal
