// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"

namespace axiscal {

/// The scatter of biases between blocks in earlier calibrations of this unit, or of units of its
/// model. It corresponds to the process standard deviation of a check standard (NIST/SEMATECH
/// e-Handbook, 2.4.5).
struct ProcessScatter {
  /// Mean square of the blocks' biases about their mean, m entries [unit^2].
  Eigen::VectorXd mean_square;
  double degrees_of_freedom = 0.0;  ///< degrees of freedom of each entry of mean_square
  int records = 0;                  ///< number of earlier records
};

}  // namespace axiscal
