// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "axiscal/instruments/instrument.hpp"

namespace axiscal {

/// The errors that a record states.
struct RecordErrors {
  Eigen::MatrixXd covariance;       // covers b, S by axis, 4m x 4m; zero where the record has none
  double degrees_of_freedom = 0.0;  // that covariance's, all axes together; 0: exact
  SensitivityMatrix sensitivity;    // m x 3
  double F = 1.0;                   // field at level 1
};

/// The prior for an instrument's errors before its readings in the new cube.
struct RecordPrior {
  Eigen::MatrixXd root;             // covariance = root root^T, 4m x rank
  double degrees_of_freedom = 0.0;  // its own; 0: exact
};

/// Priors of several instruments.
///
/// Variances that were stated by few degrees of freedom are as wrong as those allow, and weights by
/// them believe the luckiest axis. Each axis's variance is drawn towards the mean of all axes of
/// all comparable instruments, which counts for 20 degrees of freedom (empirical Bayes; Smyth,
/// Stat. Appl. Genet. Mol. Biol. 3 (2004) art. 3). An instrument whose variance is larger than the
/// others' by more than chance allows (p < 0.01) is another sort of calibration: its axes are drawn
/// towards its own mean.
[[nodiscard]] std::vector<RecordPrior> record_priors(const std::vector<RecordErrors>& records);

}  // namespace axiscal
