// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "calib/record/parameter_names.hpp"

namespace axiscal {

/// Transforms all covariances and intervals of a fit from the parameters theta to the parameters
/// T theta. If T is not diagonal, the intervals are computed from the new covariance.
/// @param T    a p x p matrix. Covariances of another size are not changed.
/// @param fit  the fit to transform; must have statistics.
inline void transform_parameters(const Eigen::MatrixXd& T, CalibrationFit& fit) {
  const auto change = [&](Eigen::MatrixXd& covariance) {
    if (covariance.rows() == T.rows()) {
      covariance = T * covariance * T.transpose();
    }
  };
  change(fit.statistics->covariance);
  for (ScatterComponent& component : fit.statistics->components) {
    change(component.covariance);
  }
  if (fit.uncertainty) {
    for (UncertaintySource& source : fit.uncertainty->sources) {
      change(source.covariance);
    }
  }
  FitStatistics& statistics = *fit.statistics;
  if (statistics.interval_95.size() == T.rows() && T.isDiagonal()) {
    statistics.interval_95 = T.diagonal().cwiseAbs().cwiseProduct(statistics.interval_95);
  } else if (statistics.interval_95.size() == T.rows()) {
    statistics.interval_95.resize(0);
    statistics.interval_dof.resize(0);
    fill_intervals(statistics);
  }
}

}  // namespace axiscal
