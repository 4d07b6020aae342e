// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "axiscal/instruments/instrument.hpp"

namespace axiscal {

/// The errors that a record states.
struct RecordErrors {
  Eigen::MatrixXd covariance;       // of b and S by axis, 4m x 4m; zero if the record has none
  double degrees_of_freedom = 0.0;  // of the covariance, sum over the axes; 0: it is exact
  SensitivityMatrix sensitivity;    // m x 3
  double F = 1.0;                   // field at level 1
};

/// The prior covariance of an instrument's errors, before its readings in the new cube.
struct RecordPrior {
  Eigen::MatrixXd root;             // covariance = root root^T, 4m x rank
  double degrees_of_freedom = 0.0;  // of the covariance; 0: it is exact
};

/// Priors of several instruments.
///
/// Variances with few degrees of freedom are inaccurate, and weights from them favour an axis whose
/// variance is small by chance. Therefore each axis's variance is shrunk towards the mean of all
/// axes of all comparable instruments. The mean has a weight of 20 degrees of freedom (empirical
/// Bayes; Smyth, Stat. Appl. Genet. Mol. Biol. 3 (2004) art. 3). If the variance of an instrument
/// is significantly larger than the others' (p < 0.01), its axes are shrunk towards its own mean.
[[nodiscard]] std::vector<RecordPrior> record_priors(const std::vector<RecordErrors>& records);

}  // namespace axiscal
