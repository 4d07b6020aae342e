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

/// Refuses readings that do not determine coefficients and directions together.
/// @throws RankDeficientError  naming what is open, and points that would close it.
/// @param run  linear about the solution; of no small condition number.
void require_direction(const Fit& run, const JointSolution& solution);

/// Without a spare degree of freedom for each axis the uncertainty and the check are missing, and
/// noise alone may set the direction.
/// @throws RankDeficientError
void require_degrees_of_freedom(const ReadingSet& set, const JointSolution& solution);

/// Leverages, standard errors and covariance at the solution, by the given weights.
/// @param robust_weights  n x m; empty unless robust.
[[nodiscard]] Estimate describe_joint(const ReadingSet& set,
                                      const JointSolution& solution,
                                      const Eigen::MatrixXd& robust_weights);

}  // namespace axiscal
