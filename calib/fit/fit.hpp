// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "calib/fit/estimation.hpp"
#include "calib/fit/model.hpp"
#include "calib/fit/reading_set.hpp"
#include "calib/fit/solved_readings.hpp"

namespace axiscal {

/// A model that is linearised about a solution. J is the Jacobian of the readings with respect to
/// the unknowns, and r contains the residuals. Both are divided by the sigma of the axis.
///
/// J has m rows for each reading, one for each axis. Its first columns are the own columns of each
/// axis: those of its coefficients and of the effects of the run. The shared columns follow (see
/// Model). J is stored axis by axis, because the own columns of an axis are 0 in the rows of all
/// other axes. The hat matrix is Q Q^T + P P^T with the bases Q of basis_of_axis() and P of
/// shared_basis_of_axis().
///
/// The causes of scatter (method.md, section 4), the tests of single readings (section 5) and the
/// effects of shared errors are computed from this model.
class Fit {
 public:
  /// @param set       the readings. They (or run.set() in the other constructors) must outlive this
  ///                  object.
  /// @param solution  the solution about which the model is linearised.
  /// @param sigma     m entries: the standard deviation of a reading of weight 1 of each axis.
  Fit(const ReadingSet& set, std::shared_ptr<const Solution> solution, Eigen::VectorXd sigma);

  /// Linearises the model about the best coefficients for a field.
  Fit(const SolvedReadings& run, const TableField& field, Eigen::VectorXd sigma);

  /// Linearises the model about an estimate. Sigma is the estimate's residual_sd, but at least
  /// ReadingSet::rounding() of the axis.
  Fit(const SolvedReadings& run, const Estimate& estimate);

  [[nodiscard]] const ReadingSet& set() const { return set_; }
  [[nodiscard]] const std::shared_ptr<const Solution>& solution() const { return solution_; }
  [[nodiscard]] Eigen::Index readings() const { return set_.size(); }
  [[nodiscard]] Eigen::Index axes() const { return set_.axis_count(); }
  [[nodiscard]] Eigen::Index row_count() const { return r_.size(); }
  [[nodiscard]] Eigen::Index column_count() const { return x_.size(); }

  /// @return the index of the row of J for one reading of one axis.
  [[nodiscard]] Eigen::Index row_of(Eigen::Index reading, Eigen::Index axis) const {
    return axes() * reading + axis;
  }

  /// @return the indices of the rows of J for one axis.
  [[nodiscard]] auto rows_of_axis(Eigen::Index axis) const {
    return Eigen::seqN(axis, readings(), axes());
  }

  /// @return the index of the column of J for coefficient j of an axis.
  [[nodiscard]] Eigen::Index column_of(Eigen::Index axis, Eigen::Index j) const {
    return set_.column_count() * axis + j;
  }

  /// @return the index of the first shared column.
  [[nodiscard]] Eigen::Index first_shared() const { return set_.column_count() * axes(); }

  /// @return the number s of shared columns.
  [[nodiscard]] Eigen::Index shared() const { return x_.size() - first_shared(); }

  /// @return sigma of an axis.
  [[nodiscard]] double sigma(Eigen::Index axis) const { return sigma_(axis); }

  /// @return the residuals r, n m entries; they are orthogonal to the columns of J.
  [[nodiscard]] const Eigen::VectorXd& residuals() const { return r_; }

  [[nodiscard]] double residual(Eigen::Index reading, Eigen::Index axis) const {
    return r_(row_of(reading, axis));
  }

  /// @return the unknowns, q entries: the coefficients of each axis, then the step of the shared
  ///         unknowns.
  [[nodiscard]] const Eigen::VectorXd& unknowns() const { return x_; }

  /// @return the name of each column; consecutive columns may have the same name.
  [[nodiscard]] std::vector<std::string> names() const;

  /// @return J, (n m) x q. It is assembled at each call.
  [[nodiscard]] Eigen::MatrixXd columns() const;

  /// @return J^T J, q x q.
  [[nodiscard]] Eigen::MatrixXd information() const;

  /// @return the rows of J for one axis, in its own columns and in the shared columns; n x (p + s).
  [[nodiscard]] Eigen::MatrixXd columns_of_axis(Eigen::Index axis) const;

  /// @return the rows of J for one axis, in the shared columns; n x s.
  [[nodiscard]] Eigen::MatrixXd shared_columns_of_axis(Eigen::Index axis) const;

  /// @return the given columns minus their projection on the axis's own columns, n x c.
  [[nodiscard]] Eigen::MatrixXd orthogonal_to_own_columns(Eigen::Index axis,
                                                          const Eigen::MatrixXd& columns) const;

  /// @return Q, n x p: an orthonormal basis of the weighted own columns of an axis.
  [[nodiscard]] const Eigen::MatrixXd& basis_of_axis(Eigen::Index axis) const {
    return axis_of(axis).design->basis();
  }

  /// @return true if J has full rank and there are more rows than columns.
  [[nodiscard]] bool is_determined() const { return has_full_rank_ && degrees_of_freedom() > 0.0; }

  /// @return the number of residuals with weight above 0, minus the number of columns.
  [[nodiscard]] double degrees_of_freedom() const { return rows_ - static_cast<double>(x_.size()); }

  // The functions from here to root_of_axis() need full rank.

  /// @return P, n x s: the rows that belong to one axis in an orthonormal basis of the shared
  ///         columns. The basis is orthogonal to the own columns of all axes.
  [[nodiscard]] const Eigen::MatrixXd& shared_basis_of_axis(Eigen::Index axis) const {
    return shared_basis_[static_cast<std::size_t>(axis)];
  }

  /// @return an entry of the hat matrix.
  [[nodiscard]] double hat(Eigen::Index axis,
                           Eigen::Index reading,
                           Eigen::Index other_axis,
                           Eigen::Index other_reading) const;

  /// @return the diagonal of the hat matrix, n x m.
  [[nodiscard]] Eigen::MatrixXd leverage() const;

  /// @return the product [Q, P]^T Z, q x c, where Q contains the bases of all axes. The rows of Z
  ///         are the readings of the first axis, then those of the second axis, and so on, each
  ///         divided by sigma of its axis.
  [[nodiscard]] Eigen::MatrixXd in_basis(const Eigen::MatrixXd& Z) const;

  /// Adds the contribution of one row of Z to `products`, the result of in_basis(Z).
  void add_in_basis(Eigen::Index axis,
                    Eigen::Index reading,
                    const Eigen::Ref<const Eigen::RowVectorXd>& z,
                    Eigen::MatrixXd& products) const;

  /// @return the degrees of freedom of an axis: the number of its readings minus the sum of their
  ///         leverages.
  [[nodiscard]] double degrees_of_freedom_of(Eigen::Index axis) const;

  /// @return the covariance of the shared unknowns, s x s.
  [[nodiscard]] Eigen::MatrixXd covariance_of_shared() const;

  /// @param by  n x m coefficients: row i defines the combination z_i = sum_k by_ik r_ik of the
  ///            residuals of reading i.
  /// @return the Jacobian of the combinations z_i, n x q.
  [[nodiscard]] Eigen::MatrixXd combined_columns(const Eigen::MatrixXd& by) const;

  /// @return B, n x q; B B^T is the hat matrix of the combinations z_i, see combined_columns().
  [[nodiscard]] Eigen::MatrixXd combined_basis(const Eigen::MatrixXd& by) const;

  /// The rows of a matrix R that belong to the coefficients of one axis. R is a root of the
  /// covariance of the unknowns: R R^T = (J^T J)^-1.
  struct RootOfAxis {
    Eigen::MatrixXd own;     ///< p x p: the columns of R that correspond to Q
    Eigen::MatrixXd shared;  ///< p x s: the columns of R that correspond to P
  };
  [[nodiscard]] RootOfAxis root_of_axis(Eigen::Index axis) const;

  /// @param changes  changes of the readings, (n m) x c, with rows as in residuals().
  /// @return the change of the unknowns for these changes, q x c.
  [[nodiscard]] Eigen::MatrixXd solution_change(const Eigen::MatrixXd& changes) const;

  /// @return the row of the fitted sensitivity S for one axis.
  [[nodiscard]] Eigen::RowVector3d sensitivity(Eigen::Index axis) const {
    return sensitivity_.row(axis);
  }

  /// @return the derivative of a weighted reading with respect to the field in the sensor's frame,
  ///         in units of sigma; 1 x 3.
  [[nodiscard]] Eigen::RowVector3d change_with_field(Eigen::Index reading, Eigen::Index axis) const;

  /// @return the response to the field at each reading, in units of sigma; n x m.
  [[nodiscard]] const Eigen::MatrixXd& along_field() const { return along_; }

  /// @return the unweighted columns of an axis: its own columns without those of the run's effects,
  ///         then the shared columns; n x c.
  [[nodiscard]] Eigen::MatrixXd own_columns(Eigen::Index axis) const;

  /// @return the field columns of an axis: the field in the sensor's frame at each reading, times
  ///         the temperature scale; n x 3.
  [[nodiscard]] Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, 3>> field_met(
      Eigen::Index axis) const;

  /// The readings of an axis with a weight above 0, with the part of the design that belongs to the
  /// coefficients.
  struct AxisRows {
    std::vector<Eigen::Index> readings;
    Eigen::MatrixXd design;    ///< the columns [1, f, ...], not weighted
    Eigen::VectorXd response;  ///< [unit]
    Eigen::VectorXd weights;
  };
  [[nodiscard]] AxisRows rows_of(Eigen::Index axis) const;

 private:
  [[nodiscard]] const AxisSolution& axis_of(Eigen::Index axis) const {
    return solution_->axes[static_cast<std::size_t>(axis)];
  }
  void find_root_of_shared();

  const ReadingSet& set_;
  std::shared_ptr<const Solution> solution_;
  Eigen::VectorXd sigma_;
  SensitivityMatrix sensitivity_;
  Eigen::VectorXd r_;
  Eigen::VectorXd x_;
  Eigen::MatrixXd root_of_shared_;             // s x s: root of the covariance of the shared
                                               // unknowns
  std::vector<Eigen::MatrixXd> shared_basis_;  // P of each axis
  bool has_full_rank_ = false;
  Eigen::MatrixXd along_;
  double rows_ = 0.0;  // number of rows with weight above 0
};

/// Lengthens the intervals of some parameters for one cause of scatter. Intervals never become
/// shorter.
class WiderIntervals {
 public:
  WiderIntervals(std::string name, Estimate& estimate);

  /// Lengthens the interval of a parameter to the interval for the given variance and degrees of
  /// freedom. An interval that is already longer does not change.
  void widen(Eigen::Index parameter, double variance, double degrees_of_freedom);

  /// The component of the scatter; the caller sets its sd and unit.
  [[nodiscard]] ScatterComponent& component() { return component_; }

  /// Adds the component to the estimate if it increased a variance.
  /// @return true if the component was added.
  bool put();

 private:
  Estimate& estimate_;
  ScatterComponent component_;
  bool counts_ = false;
};

}  // namespace axiscal
