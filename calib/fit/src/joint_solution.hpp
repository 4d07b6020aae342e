// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "calib/fit/estimation.hpp"
#include "calib/fit/fit.hpp"
#include "calib/fit/model.hpp"

namespace axiscal {

/// The result of method joint, before describe_joint() computes its statistics.
struct JointSolution {
  std::shared_ptr<const Solution> state;
  Eigen::VectorXd sigma;
  SharedCost shares;
  bool weights_are_estimated = false;
};

/// The best of the solutions from all starts. If another solution fits equally well, `ambiguity`
/// describes it; otherwise `ambiguity` is empty.
struct BestSolution {
  JointSolution solution;
  std::string ambiguity;
};
[[nodiscard]] BestSolution best_solution(const ReadingSet& set,
                                         const Model& model,
                                         const std::vector<TableField>& starts);

/// Throws if the readings do not determine the coefficients and the field's directions together.
/// @throws RankDeficientError  The message names the undetermined coefficients and the design
///                             points to add.
/// @param run  the model linearised about the solution; its condition number is large.
void require_direction(const Fit& run, const JointSolution& solution);

/// Throws if an axis has no spare degree of freedom. Its uncertainty would be unknown, the fit
/// could not be checked, and noise could determine the direction.
/// @throws RankDeficientError
void require_degrees_of_freedom(const ReadingSet& set, const JointSolution& solution);

/// Returns the estimate at a solution, with leverages, standard errors and covariance.
/// @param robust_weights  n x m; empty if the fit is not robust.
[[nodiscard]] Estimate describe_joint(const ReadingSet& set,
                                      const JointSolution& solution,
                                      const Eigen::MatrixXd& robust_weights);

}  // namespace axiscal
