// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/estimation.hpp"

namespace axiscal {

void set_coefficients(const ReadingSet& set,
                      Eigen::Index axis,
                      const Eigen::VectorXd& coefficients,
                      Estimate& estimate) {
  const Eigen::Index m = set.axis_count();
  const int order = set.temperature.order;
  if (estimate.response.bias.size() != m) {
    estimate.response.bias.resize(m);
    estimate.response.sensitivity.resize(m, 3);
    estimate.also.assign(set.also_in_table.size(), SensitivityMatrix::Zero(m, 3));
    estimate.temperature.bias.resize(m, order);
    estimate.temperature.scale.resize(m, order);
    estimate.effects.resize(set.effects.columns.cols(), m);
  }
  estimate.effects.col(axis) = coefficients.tail(estimate.effects.rows());
  const Eigen::RowVector3d S = coefficients.segment<3>(1).transpose();
  estimate.response.bias(axis) = coefficients(0);
  estimate.response.sensitivity.row(axis) = S;
  for (std::size_t a = 0; a < estimate.also.size(); ++a) {
    estimate.also[a].row(axis) = coefficients.segment<3>(4 + 3 * static_cast<Eigen::Index>(a));
  }
  if (order > 0) {
    estimate.temperature.bias.row(axis) = coefficients.segment(set.base_column_count(), order);
    // The coefficients of the columns d^j (S f), divided by `unit`, are the change of the
    // temperature scale's coefficients c_j (see TemperatureTerms).
    const auto along = set.temperature.along.row(axis);
    const double unit = along.dot(S) / along.squaredNorm();
    estimate.temperature.scale.row(axis) =
        set.temperature.scale.row(axis) +
        coefficients.segment(set.base_column_count() + order, order).transpose() / unit;
  }
}

ReadingSet exclude_unpaired_readings(ReadingSet set, const Estimate& estimate) {
  for (const std::size_t i : estimate.unpaired) {
    set.weights.row(static_cast<Eigen::Index>(i)).setZero();
  }
  return set;
}

ReadingSet at_reference(ReadingSet set, const Estimate& estimate) {
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
      double shift =
          set.effects.names.empty() ? 0.0 : set.effects.row(i, k).dot(estimate.effects.col(k));
      double factor = 1.0;
      double power = 1.0;
      for (int j = 0; j < set.temperature.order; ++j) {
        power *= set.temperature.d(i, k);
        shift += estimate.temperature.bias(k, j) * power;
        factor += estimate.temperature.scale(k, j) * power;
      }
      const double bias = estimate.response.bias(k);
      set.response(i, k) = bias + (set.response(i, k) - bias - shift) / factor;
    }
  }
  return set;
}

}  // namespace axiscal
