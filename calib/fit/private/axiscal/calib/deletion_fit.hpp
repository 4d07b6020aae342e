// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/joint_fit.hpp"
#include "axiscal/calib/reading_set.hpp"
#include "axiscal/calib/shared_fit.hpp"
#include "axiscal/calib/state_of_run.hpp"

namespace axiscal {

/// Readings against what the others predict of them, each axis by the scatter that the others have
/// on it (method.md, section 5). All is linear in the readings, so that one fit of all of them
/// tells every other: with Q the basis of an axis's own columns, Q_d at the readings that are left
/// out and M = (1 - Q_d^T Q_d)^-1, a fit of the others has of those the errors y_d + Q_d M Q_d^T
/// y_d.
///
/// @par Source
/// Cook & Weisberg, Residuals and Influence in Regression (1982), sec. 3.6.
class DeletionFit {
 public:
  /// @param set          with design points; must outlive it.
  /// @param field        in the table, as fitted or given.
  /// @param known_field  whether it is given.
  DeletionFit(const ReadingSet& set, const TableField& field, bool known_field);

  /// @param run  must outlive it, and is asked for no other field as long as it lives.
  DeletionFit(StateOfRun& run, const TableField& field);

  /// How unlikely contrasts of some readings are by the others: for each axis F(q, nu_k) with the
  /// others' fit, its noise by axis iterated anew, and the axes put together by Fisher's method.
  ///
  /// @param readings   d positions in the set.
  /// @param contrasts  q x d.
  /// @return the probability; nothing where the others do not determine it.
  [[nodiscard]] std::optional<double> p_value(const std::vector<std::size_t>& readings,
                                              const Eigen::MatrixXd& contrasts) const;

  /// How unlikely they are by the others' own tails (NoiseTails): contrasts and axes are put
  /// together by Fisher's method.
  [[nodiscard]] std::optional<double> p_value_by_tails(const std::vector<std::size_t>& readings,
                                                       const Eigen::MatrixXd& contrasts) const;

  /// What the others predict of a reading: for each axis its error, and the standard deviation and
  /// degrees of freedom of such errors, the prediction's own among them.
  struct Prediction {
    Eigen::VectorXd error;               // m; NaN where the axis does not use the reading
    Eigen::VectorXd sd;                  // m
    Eigen::VectorXd degrees_of_freedom;  // m
  };

  /// @param readings  positions in the set of those that are left out together.
  /// @return one for each; nothing where the others do not determine it.
  [[nodiscard]] std::optional<std::vector<Prediction>> predictions(
      const std::vector<std::size_t>& readings) const;

 private:
  // Of so many rows and columns at most matrices need no memory of their own.
  static constexpr int few = 8;
  // Where less than this is left of a square others do not determine it.
  static constexpr double open_below = 1e-11;

  // Each for so many readings and columns at most.
  template <int Most>
  class Own;
  template <int Most>
  struct Others;
  template <int Most>
  struct LeftOut;

  [[nodiscard]] const JointAxis& axis_of(Eigen::Index axis) const {
    return state_->axes[static_cast<std::size_t>(axis)];
  }
  template <int Most>
  [[nodiscard]] std::optional<Others<Most>> without(const std::vector<std::size_t>& readings) const;

  // Contrasts of each axis's readings as the others see them: not weighted.
  template <int Most>
  [[nodiscard]] std::vector<LeftOut<Most>> left_out(const std::vector<std::size_t>& readings,
                                                    const Eigen::MatrixXd& contrasts,
                                                    const Others<Most>& others) const;
  template <int Most>
  [[nodiscard]] std::optional<double> p_value_of(const std::vector<std::size_t>& readings,
                                                 const Eigen::MatrixXd& contrasts) const;

  void find_smallest();

  const ReadingSet& set_;
  std::shared_ptr<const JointState> state_;
  Eigen::VectorXd smallest_;  // m variances: each axis's rounding
};

}  // namespace axiscal
