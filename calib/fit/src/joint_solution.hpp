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

/// What method joint found, before anything is said of it.
struct JointSolution {
  std::shared_ptr<const Solution> state;
  Eigen::VectorXd sigma;
  SharedCost shares;
  bool weights_are_estimated = false;
};

/// The best of what the starts lead to, and in words what fits as well.
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

/// Without a degree of freedom to spare for each axis there is neither an uncertainty nor a check,
/// and the direction may be anything that noise makes of it.
/// @throws RankDeficientError
void require_degrees_of_freedom(const ReadingSet& set, const JointSolution& solution);

/// Leverages, standard errors and covariance at the solution, by the given weights.
/// @param robust_weights  n x m; empty unless robust.
[[nodiscard]] Estimate describe_joint(const ReadingSet& set,
                                      const JointSolution& solution,
                                      const Eigen::MatrixXd& robust_weights);

}  // namespace axiscal
