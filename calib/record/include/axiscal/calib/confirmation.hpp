// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"

namespace axiscal {

/// A reading that was kept out of a fit, and its prediction by the fit.
struct ConfirmationReading {
  int run = 1;
  Eigen::VectorXd error;       ///< reading minus prediction, m entries [unit]; NaN: not available
  Eigen::VectorXd half_width;  ///< half width of the 95 % interval of the errors, m entries [unit]
  bool within = true;          ///< true if the error of every axis is within its interval
};

/// The comparison of a fit with readings that were kept out (method.md, section 5).
struct Confirmation {
  std::vector<ConfirmationReading> readings;
  double p_value = 1.0;  ///< p-value of the joint test of all readings
  bool passed = true;    ///< true if p_value is 0.05 or more
};

}  // namespace axiscal
