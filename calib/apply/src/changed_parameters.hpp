// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// Takes all covariances of a record's parameters to parameters T theta.
/// @param T  p x p; the record has statistics. Covariances of another size stay.
inline void change_parameters(const Eigen::MatrixXd& T, CalibrationFit& fit) {
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
}

}  // namespace axiscal
