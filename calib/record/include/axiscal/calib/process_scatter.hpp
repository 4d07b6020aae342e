// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"

namespace axiscal {

/// The change of a unit's biases from block to block in earlier calibrations, for this unit or for
/// units of its model: the process's standard deviation, found by a check standard (NIST/SEMATECH
/// e-Handbook, 2.4.5).
struct ProcessScatter {
  Eigen::VectorXd mean_square;      ///< m: of blocks' biases about their mean [unit^2]
  double degrees_of_freedom = 0.0;  ///< of each
  int records = 0;                  ///< that it is from
};

}  // namespace axiscal
