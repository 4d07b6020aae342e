// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/estimation.hpp"
#include "axiscal/calib/joint_fit.hpp"
#include "axiscal/calib/reading_set.hpp"
#include "axiscal/calib/state_of_run.hpp"

namespace axiscal {

/// A run's readings about a fit, linear in all that is fitted: r = J x + e, the residuals of all
/// axes, each in its sigma. Rows go reading by reading, m for each; columns axis by axis (the
/// coefficients and the run's effects), then what all axes share, the field's directions. J is kept
/// by axis: an axis has no other's columns. Every look at what the residuals hold beyond white
/// noise (method.md, section 4), at single readings (section 5) and at errors that readings share
/// is a look at this.
class LinearisedRun {
 public:
  // Any number of readings and columns.

  /// @param set    must outlive it, as for the others.
  /// @param state  coefficients fitted for given fields; without directions where those were given.
  /// @param sigma  m: what each axis takes as 1.
  LinearisedRun(const ReadingSet& set,
                std::shared_ptr<const JointState> state,
                Eigen::VectorXd sigma);

  /// The same about the best coefficients for a field.
  LinearisedRun(StateOfRun& run, const TableField& field, Eigen::VectorXd sigma);

  /// The same about an estimate: sigma is its residual_sd, at least the axis's rounding.
  LinearisedRun(StateOfRun& run, const Estimate& estimate);

  [[nodiscard]] const ReadingSet& set() const { return set_; }
  [[nodiscard]] Eigen::Index readings() const { return set_.size(); }
  [[nodiscard]] Eigen::Index axes() const { return set_.axis_count(); }

  /// @return J, (n m) x q, put together anew each time.
  [[nodiscard]] Eigen::MatrixXd columns() const;
  [[nodiscard]] Eigen::Index column_count() const { return x_.size(); }
  [[nodiscard]] Eigen::Index row_count() const { return r_.size(); }

  /// @return the rows of an axis in the columns that it has, its own and the shared, n x (p + D).
  [[nodiscard]] Eigen::MatrixXd columns_of_axis(Eigen::Index axis) const;

  /// @param by  n x m: how each reading's residuals are combined, z_i = sum_k by_ik r_ik.
  /// @return J of such combinations, n x q.
  [[nodiscard]] Eigen::MatrixXd combined_columns(const Eigen::MatrixXd& by) const;

  /// @return the shared among them alone, n x D.
  [[nodiscard]] Eigen::MatrixXd shared_columns_of_axis(Eigen::Index axis) const;

  /// @return what an axis's own columns leave of columns of its rows, n x c.
  [[nodiscard]] Eigen::MatrixXd left_by_own(Eigen::Index axis,
                                            const Eigen::MatrixXd& columns) const;

  /// @return Q, n x p: an orthonormal basis of an axis's own weighted columns.
  [[nodiscard]] const Eigen::MatrixXd& basis_of_axis(Eigen::Index axis) const {
    return axis_of(axis).design->basis();
  }

  /// What follows needs full rank (is_determined()).

  /// @return P, n x D: an axis's rows of an orthonormal basis of what the axes' own columns leave
  ///         of the shared. With those of all axes the two span J.
  [[nodiscard]] Eigen::MatrixXd shared_basis_of_axis(Eigen::Index axis) const;

  /// @param by  as combined_columns().
  /// @return B, n x q, with B B^T what the fit takes of such combinations: of each axis's basis
  ///         and of the shared.
  [[nodiscard]] Eigen::MatrixXd combined_basis(const Eigen::MatrixXd& by) const;

  /// The rows of an axis's coefficients in R with R R^T = (J^T J)^-1 and J R the bases.
  struct RootOfAxis {
    Eigen::MatrixXd own;     ///< p x p, beside the axis's basis
    Eigen::MatrixXd shared;  ///< p x D
  };
  [[nodiscard]] RootOfAxis root_of_axis(Eigen::Index axis) const;

  /// @return J^T J, q x q.
  [[nodiscard]] Eigen::MatrixXd information() const;

  /// @return r, n m entries, square to J.
  [[nodiscard]] const Eigen::VectorXd& residuals() const { return r_; }

  [[nodiscard]] double residual(Eigen::Index reading, Eigen::Index axis) const {
    return r_(row_of(reading, axis));
  }

  /// @return where they are so: each axis's coefficients, and a step of the field's tangents; q.
  [[nodiscard]] const Eigen::VectorXd& solution() const { return x_; }

  /// @return what each column is of; neighbours may share a name.
  [[nodiscard]] std::vector<std::string> names() const;

  /// @return whether J has full rank and something is left over.
  [[nodiscard]] bool is_determined() const { return has_full_rank_ && degrees_of_freedom() > 0.0; }

  /// @return residuals of weight less columns.
  [[nodiscard]] double degrees_of_freedom() const { return rows_ - static_cast<double>(x_.size()); }

  /// @return what an axis takes as 1.
  [[nodiscard]] double sigma(Eigen::Index axis) const { return sigma_(axis); }

  /// @return the row of a reading of an axis.
  [[nodiscard]] Eigen::Index row_of(Eigen::Index reading, Eigen::Index axis) const {
    return axes() * reading + axis;
  }

  /// @return the rows of an axis.
  [[nodiscard]] auto rows_of_axis(Eigen::Index axis) const {
    return Eigen::seqN(axis, readings(), axes());
  }

  /// @return the first column of what all axes share, and how many those are.
  [[nodiscard]] Eigen::Index first_shared() const { return set_.column_count() * axes(); }
  [[nodiscard]] Eigen::Index shared() const { return x_.size() - first_shared(); }

  /// @return what changes of the readings make of all that is fitted; q x c.
  /// @param changes  n m x c, as residuals() has them.
  [[nodiscard]] Eigen::MatrixXd taken_up(const Eigen::MatrixXd& changes) const;

  /// @return an axis's sensitivity as the columns have it.
  [[nodiscard]] Eigen::RowVector3d sensitivity(Eigen::Index axis) const {
    return sensitivity_.row(axis);
  }

  /// How a reading of an axis changes with the field in the sensor, in its sigma.
  [[nodiscard]] Eigen::RowVector3d change_with_field(Eigen::Index reading, Eigen::Index axis) const;

  /// @return the column of coefficient j of an axis.
  [[nodiscard]] Eigen::Index column_of(Eigen::Index axis, Eigen::Index j) const {
    return set_.column_count() * axis + j;
  }

  /// How the readings change with the field in the sensor's frame along itself, in their sigma;
  /// n x m.
  [[nodiscard]] const Eigen::MatrixXd& along_field() const { return along_; }

  /// An axis's columns: its coefficients', then the shared, without the run's effects and not
  /// weighted; n x c.
  [[nodiscard]] Eigen::MatrixXd own_columns(Eigen::Index axis) const;

  /// The field that each reading met, as its own axis saw it; n x 3, as long as this lives.
  [[nodiscard]] Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, 3>> field_met(
      Eigen::Index axis) const;

  /// An axis's readings that have weight, and the columns of the instrument's coefficients alone.
  struct AxisRows {
    std::vector<Eigen::Index> readings;
    Eigen::MatrixXd design;    ///< not weighted, [1, f, ...]
    Eigen::VectorXd response;  ///< [unit]
    Eigen::VectorXd weights;
  };
  [[nodiscard]] AxisRows rows_of(Eigen::Index axis) const;

 private:
  [[nodiscard]] const JointAxis& axis_of(Eigen::Index axis) const {
    return state_->axes[static_cast<std::size_t>(axis)];
  }
  void find_root_of_shared();

  const ReadingSet& set_;
  std::shared_ptr<const JointState> state_;
  Eigen::VectorXd sigma_;
  SensitivityMatrix sensitivity_;
  Eigen::VectorXd r_;
  Eigen::VectorXd x_;
  Eigen::MatrixXd root_of_shared_;  // D x D: of the covariance of a step of the shared
  bool has_full_rank_ = false;
  Eigen::MatrixXd along_;
  double rows_ = 0.0;  // of weight
};

/// Longer intervals of some parameters, by a cause that the readings' own scatter does not show:
/// each becomes what the cause says of it, where that is more.
class WiderIntervals {
 public:
  WiderIntervals(std::string name, Estimate& estimate);

  /// Takes for one parameter what a cause makes of its variance, with so many degrees of freedom.
  void widen(Eigen::Index parameter, double variance, double degrees_of_freedom);

  /// The component of the scatter that comes of it, to be described.
  [[nodiscard]] ScatterComponent& component() { return component_; }

  /// @return whether it made anything longer: the component is now among the estimate's.
  bool put();

 private:
  Estimate& estimate_;
  ScatterComponent component_;
  bool counts_ = false;
};

}  // namespace axiscal
