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

/// Compares readings with the prediction of all other readings (method.md, section 5). The noise of
/// each axis is estimated from the scatter of the other readings.
///
/// The other readings are not fitted again. Let Q be an orthonormal basis of the design columns
/// that belong to one axis alone, and Q_d its rows at the d readings that are left out. Let y_d be
/// the residuals of these readings in the fit of all readings. With M = (1 - Q_d^T Q_d)^-1, the
/// errors of the prediction are y_d + Q_d M Q_d^T y_d.
///
/// @par Source
/// Cook & Weisberg, Residuals and Influence in Regression (1982), sec. 3.6.
class DeletionFit {
 public:
  /// @param set          readings with design points; must outlive this object.
  /// @param field        the fitted or given field in the table's frame.
  /// @param known_field  true if the field is given, not fitted.
  DeletionFit(const ReadingSet& set, const TableField& field, bool known_field);

  /// @param run  the readings with their solution; run.set() must outlive this object.
  DeletionFit(const SolvedReadings& run, const TableField& field);

  /// Tests whether contrasts (linear combinations) of some readings agree with the prediction from
  /// all other readings. Each axis is tested with F(q, nu_k); Fisher's method combines the axes.
  ///
  /// @param readings   indices in the set of the d readings that are left out.
  /// @param contrasts  q x d: q contrasts of these readings, one in each row.
  /// @param loss       divisor of the degrees of freedom, from dof_reduction_factor(); 1 if the
  ///                   noise of the axes is independent.
  /// @return the p-value; `nullopt` if the other readings do not determine the contrasts.
  [[nodiscard]] std::optional<double> p_value(const std::vector<std::size_t>& readings,
                                              const Eigen::MatrixXd& contrasts,
                                              double loss = 1.0) const;

  /// Like p_value(), but for noise that need not be normal: the tails of its distribution are
  /// estimated from the residuals of the other readings (NoiseTails). Fisher's method combines the
  /// contrasts and the axes.
  [[nodiscard]] std::optional<double> p_value_by_tails(const std::vector<std::size_t>& readings,
                                                       const Eigen::MatrixXd& contrasts,
                                                       double loss = 1.0) const;

  /// The error of the prediction of one reading from the other readings, for each axis. `sd`
  /// includes the noise of the reading and the uncertainty of the prediction.
  struct Prediction {
    Eigen::VectorXd error;  ///< one entry for each axis; NaN if the axis does not use the reading
    Eigen::VectorXd sd;     ///< one entry for each axis
    Eigen::VectorXd degrees_of_freedom;  ///< one entry for each axis
  };

  /// @param readings  indices in the set of the readings that are left out together.
  /// @return one prediction for each of these readings; `nullopt` if the other readings do not
  ///         determine all predictions.
  [[nodiscard]] std::optional<std::vector<Prediction>> predictions(
      const std::vector<std::size_t>& readings) const;

 private:
  const ReadingSet& set_;
  std::shared_ptr<const Solution> solution_;
  // m entries: the smallest noise variance of each axis, which is its squared rounding error
  Eigen::VectorXd smallest_;
};

}  // namespace axiscal
