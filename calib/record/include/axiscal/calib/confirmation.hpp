// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"

namespace axiscal {

/// A reading that was kept out of a fit, and its prediction by the fit.
struct ConfirmationReading {
  int run = 1;
  Eigen::VectorXd error;       ///< reading less prediction, m entries [unit]; NaN: not seen
  Eigen::VectorXd half_width;  ///< of the interval that holds 95 % of such errors [unit]
  bool within = true;          ///< whether every axis's error is within its interval
};

/// The comparison of a fit with readings that were kept out (method.md, section 5).
struct Confirmation {
  std::vector<ConfirmationReading> readings;
  double p_value =
      1.0;  ///< the probability of such distances from the prediction by chance, for all together
  bool passed = true;  ///< not below 0.05
};

}  // namespace axiscal
