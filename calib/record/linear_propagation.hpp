// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/uncertainty.hpp"

namespace axiscal {

/// Computes the variances of linear functions of a record's parameters. Each function is given by
/// its gradient. The parameters' covariance from the scatter of the readings is computed only once.
class LinearPropagation {
 public:
  /// @param calibration  a record with statistics; it must outlive this object.
  explicit LinearPropagation(const Calibration& calibration);

  /// @return the variance from the scatter of the fit, divided into its shares.
  [[nodiscard]] VarianceShares scatter(const Eigen::RowVectorXd& gradient) const;

  /// @return the variance from all sources of the budget, divided into its shares.
  /// @param by_source  receives the standard uncertainty from each source.
  [[nodiscard]] VarianceShares all(const Eigen::RowVectorXd& gradient,
                                   std::vector<double>& by_source) const;

 private:
  // @param places  indices of the parameters on which the function depends.
  [[nodiscard]] VarianceShares scatter(const Eigen::RowVectorXd& gradient,
                                       const std::vector<Eigen::Index>& places) const;

  [[nodiscard]] const FitStatistics& statistics() const { return *calibration_.fit.statistics; }

  const Calibration& calibration_;
  Eigen::MatrixXd of_readings_;
  std::vector<std::vector<Eigen::Index>> own_;  // for each axis, the indices of its parameters
};

}  // namespace axiscal
