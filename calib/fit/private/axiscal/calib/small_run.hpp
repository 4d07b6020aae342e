// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "axiscal/calib/joint_fit.hpp"
#include "axiscal/calib/reading_set.hpp"

namespace axiscal {

/// The readings of a small, plain run about a field, in matrices that need no memory of their own.
/// It has three axes of weight 1 and few readings of one field that lies one way in the table, and
/// nothing is fitted of an axis but its coefficients [b, S]. Of such runs there are many: of a
/// factory, of a study.
class SmallState {
 public:
  static constexpr int most_readings = 48;

  /// A row for each reading.
  template <int Count>
  using Columns =
      Eigen::Matrix<double, Eigen::Dynamic, Count, Eigen::ColMajor, most_readings, Count>;

  /// @return whether a set has such readings.
  [[nodiscard]] static bool can_be(const ReadingSet& set);

  /// @param set    must outlive it.
  /// @param state  of the set.
  /// @return nothing where the run is not so.
  [[nodiscard]] static std::optional<SmallState> of(const ReadingSet& set, const JointState& state);

  [[nodiscard]] const ReadingSet& set() const { return *set_; }
  [[nodiscard]] Eigen::Index readings() const { return residuals_.rows(); }

  /// @return whether the field's directions are fitted, not given.
  [[nodiscard]] bool has_directions() const { return has_directions_; }

  /// @return Q, n x 4: the basis of each axis's own columns.
  [[nodiscard]] const Columns<4>& basis() const { return basis_; }

  /// @return what these leave of the readings about the field; n x 3.
  [[nodiscard]] const Columns<3>& residuals() const { return residuals_; }

  /// @return how the readings change with the field's directions [per rad], two columns for each
  ///         axis, and what an axis's own columns leave of that; n x 6.
  [[nodiscard]] const Columns<6>& tangents() const { return tangents_; }
  [[nodiscard]] const Columns<6>& projected() const { return projected_; }

  [[nodiscard]] double field_magnitude() const { return field_magnitude_; }

  /// @return S, a row for each axis, about the field.
  [[nodiscard]] const Eigen::Matrix3d& sensitivity() const { return sensitivity_; }

  /// @return the field that each reading met, frame sensor; n x 3.
  [[nodiscard]] const Columns<3>& field_met() const { return field_met_; }

 private:
  SmallState(const ReadingSet& set, bool has_directions)
      : set_(&set), has_directions_(has_directions) {}
  void find_tangents(const TableField& field);

  const ReadingSet* set_;
  bool has_directions_;
  double field_magnitude_ = 0.0;
  Columns<4> basis_;
  Columns<3> residuals_;
  Columns<6> tangents_;
  Columns<6> projected_;
  Eigen::Matrix3d sensitivity_;
  Columns<3> field_met_;
};

/// Such a run linear about a fit, as LinearisedRun has it of any: each axis in its sigma. Where the
/// directions are given their columns are 0.
class SmallRun {
 public:
  static constexpr int most_readings = SmallState::most_readings;
  static constexpr int shared_width = 2;  // of those that all share
  template <int Count>
  using Columns = SmallState::Columns<Count>;

  /// @param state       must outlive it.
  /// @param sigma       what each axis takes as 1.
  /// @param directions  whether the field's are fitted with the rest.
  SmallRun(const SmallState& state, const Eigen::Vector3d& sigma, bool directions);

  [[nodiscard]] const SmallState& state() const { return state_; }
  [[nodiscard]] Eigen::Index readings() const { return state_.readings(); }
  [[nodiscard]] double sigma(Eigen::Index axis) const { return sigma_(axis); }

  /// @return whether the directions are fitted with the rest; else the axes share nothing.
  [[nodiscard]] bool has_directions() const { return has_directions_; }

  /// @return whether the columns have full rank and something is left over.
  [[nodiscard]] bool is_determined() const { return has_full_rank_ && degrees_of_freedom() > 0.0; }

  /// What follows needs full rank.

  /// @return what the fit leaves of the readings, square to all columns; n x 3.
  [[nodiscard]] const Columns<3>& residuals() const { return residuals_; }

  /// @return two columns for each axis: its rows of an orthonormal basis of what the axes' own
  ///         columns leave of the directions; n x 6.
  [[nodiscard]] const Columns<6>& shared_basis() const { return shared_basis_; }

  /// @return the same of an axis, and its own basis, as LinearisedRun has them.
  [[nodiscard]] auto shared_basis_of_axis(Eigen::Index axis) const {
    return shared_basis_.middleCols<2>(2 * axis);
  }
  [[nodiscard]] const Columns<4>& basis_of_axis(Eigen::Index /*axis*/) const {
    return state_.basis();
  }
  [[nodiscard]] double residual(Eigen::Index reading, Eigen::Index axis) const {
    return residuals_(reading, axis);
  }

  /// @return how far the directions went from the field to where the residuals are so [rad].
  [[nodiscard]] const Eigen::Vector2d& step() const { return step_; }

  /// @return T with T T^T the covariance of that step.
  [[nodiscard]] const Eigen::Matrix2d& root_of_shared() const { return root_of_shared_; }

  /// @return residuals less columns.
  [[nodiscard]] double degrees_of_freedom() const;

  /// @return the condition number of all columns, each divided by its length; nothing where it is
  ///         not small, as small_condition_of() has it.
  [[nodiscard]] std::optional<double> small_condition() const;

 private:
  const SmallState& state_;
  Eigen::Vector3d sigma_;
  bool has_directions_;
  bool has_full_rank_ = false;
  Columns<3> residuals_;
  Columns<6> shared_basis_;
  Eigen::Vector2d step_ = Eigen::Vector2d::Zero();
  Eigen::Matrix2d root_of_shared_ = Eigen::Matrix2d::Zero();
};

}  // namespace axiscal
