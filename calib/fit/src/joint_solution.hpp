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

/// The result of method joint, before it is described.
struct JointSolution {
  std::shared_ptr<const Solution> state;
  Eigen::VectorXd sigma;
  SharedCost shares;
  bool weights_are_estimated = false;
};

/// The best of the solutions from all starts, and a description of others that fit equally well.
struct BestSolution {
  JointSolution solution;
  std::string ambiguity;
};
[[nodiscard]] BestSolution best_solution(const ReadingSet& set,
                                         const Model& model,
                                         const std::vector<TableField>& starts);

/// Throws if the readings do not determine coefficients and directions together.
/// @throws RankDeficientError  the message names the undetermined coefficients, and points to add.
/// @param run  the run linearised about the solution; its condition number is large.
void require_direction(const Fit& run, const JointSolution& solution);

/// Throws if an axis has no spare degree of freedom. Its uncertainty would be unknown, the fit
/// could not be checked, and noise could determine the direction.
/// @throws RankDeficientError
void require_degrees_of_freedom(const ReadingSet& set, const JointSolution& solution);

/// The estimate at a solution, with leverages, standard errors and covariance.
/// @param robust_weights  n x m; empty unless robust.
[[nodiscard]] Estimate describe_joint(const ReadingSet& set,
                                      const JointSolution& solution,
                                      const Eigen::MatrixXd& robust_weights);

}  // namespace axiscal
