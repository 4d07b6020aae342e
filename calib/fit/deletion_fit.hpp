// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "calib/fit/model.hpp"
#include "calib/fit/reading_set.hpp"
#include "calib/fit/solved_readings.hpp"

namespace axiscal {

/// Compares readings with the prediction of all other readings (method.md, section 5). Each axis is
/// judged by the scatter of the others.
///
/// The others need no fit of their own. Let Q be the basis of an axis's own columns, Q_d its rows
/// at the d readings, and M = (1 - Q_d^T Q_d)^-1. The fit of all readings leaves y_d there; the fit
/// of the others leaves y_d + Q_d M Q_d^T y_d.
///
/// @par Source
/// Cook & Weisberg, Residuals and Influence in Regression (1982), sec. 3.6.
class DeletionFit {
 public:
  /// @param set          with design points; must outlive it.
  /// @param field        in the table, as fitted or given.
  /// @param known_field  whether it is given.
  DeletionFit(const ReadingSet& set, const TableField& field, bool known_field);

  /// @param run  must outlive it.
  DeletionFit(const SolvedReadings& run, const TableField& field);

  /// The probability of contrasts of some readings, given the others: F(q, nu_k) for each axis, the
  /// axes combined by Fisher's method.
  ///
  /// @param readings   d positions in the set.
  /// @param contrasts  q x d.
  /// @param loss       of degrees of freedom (dof_reduction_factor()); 1: the axes are independent.
  /// @return `nullopt` if the others do not determine the contrasts.
  [[nodiscard]] std::optional<double> p_value(const std::vector<std::size_t>& readings,
                                              const Eigen::MatrixXd& contrasts,
                                              double loss = 1.0) const;

  /// As above, with the tails of the noise of the other readings (NoiseTails). Fisher's method
  /// combines contrasts and axes.
  [[nodiscard]] std::optional<double> p_value_by_tails(const std::vector<std::size_t>& readings,
                                                       const Eigen::MatrixXd& contrasts,
                                                       double loss = 1.0) const;

  /// The error of the others' prediction of one reading, for each axis. `sd` includes the noise of
  /// the reading and the uncertainty of the prediction.
  struct Prediction {
    Eigen::VectorXd error;               ///< m; NaN if the axis does not use the reading
    Eigen::VectorXd sd;                  ///< m
    Eigen::VectorXd degrees_of_freedom;  ///< m
  };

  /// @param readings  positions in the set; all of them are left out.
  /// @return one for each; `nullopt` if the others do not determine it.
  [[nodiscard]] std::optional<std::vector<Prediction>> predictions(
      const std::vector<std::size_t>& readings) const;

 private:
  const ReadingSet& set_;
  std::shared_ptr<const Solution> solution_;
  Eigen::VectorXd smallest_;  // m variances: the rounding of each axis
};

}  // namespace axiscal
