// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "axiscal/instruments/instrument.hpp"

namespace axiscal {

/// The uncertainty of a record's coefficients, and the quantities that scale it.
struct RecordErrors {
  // Covariance of the biases and sensitivities, axis by axis, 4m x 4m; zero if the record has none.
  Eigen::MatrixXd covariance;
  // Degrees of freedom of `covariance`, summed over the axes; 0: infinite.
  double degrees_of_freedom = 0.0;
  SensitivityMatrix sensitivity;  // sensitivities of the record, m x 3
  double F = 1.0;                 // magnitude of the field at level 1
};

/// The covariance of the errors of an instrument's record, before the readings in the new cube are
/// used (the prior of the fit).
struct RecordPrior {
  Eigen::MatrixXd root;             // covariance = root root^T, 4m x rank
  double degrees_of_freedom = 0.0;  // degrees of freedom of the covariance; 0: infinite
};

/// Computes the priors of several instruments from their records.
///
/// Variances with few degrees of freedom are inaccurate, and weights from them favour an axis whose
/// variance is small by chance. Therefore each axis's variance is shrunk towards the mean variance
/// of all axes of all comparable instruments. This mean has a weight of 20 degrees of freedom
/// (empirical Bayes; Smyth, Stat. Appl. Genet. Mol. Biol. 3 (2004) art. 3). If the variance of an
/// instrument is significantly larger than that of the other instruments (p < 0.01), the variances
/// of its axes are shrunk towards its own mean variance.
[[nodiscard]] std::vector<RecordPrior> record_priors(const std::vector<RecordErrors>& records);

}  // namespace axiscal
