// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/reading_set.hpp"

namespace axiscal {

/// Readings against what the others predict of them, each axis by the scatter that the others have
/// on it (method.md, section 5). All is linear in the readings: what is left out is taken off sums
/// that were made once.
class DeletionFit {
 public:
  /// @param set          with design points; must outlive it.
  /// @param field        in the table, as fitted or given.
  /// @param known_field  whether it is given.
  DeletionFit(const ReadingSet& set, const TableField& field, bool known_field);

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
  // Sums over an axis's readings: J^T J, J^T y, y^T y.
  struct Sums {
    Eigen::MatrixXd G;
    Eigen::VectorXd b;
    double squares = 0.0;
    double readings = 0.0;
  };
  struct Axis {
    Eigen::MatrixXd J;  // n x c, weighted; the columns of other axes are left out
    Eigen::VectorXd y;  // n: weighted residuals
    Sums sums;
  };
  struct Others;

  [[nodiscard]] Sums sums_without(const std::vector<std::size_t>& readings, Eigen::Index k) const;
  [[nodiscard]] std::optional<Others> without(const std::vector<std::size_t>& readings) const;

  // Contrasts of an axis's readings as the others see them: not weighted.
  struct LeftOut;
  [[nodiscard]] LeftOut left_out(const std::vector<std::size_t>& readings,
                                 const Eigen::MatrixXd& contrasts,
                                 const Others& others,
                                 Eigen::Index axis) const;

  const ReadingSet& set_;
  Eigen::MatrixXd root_weights_;
  Eigen::VectorXd smallest_;  // m variances: each axis's rounding
  Eigen::Index own_ = 0;      // p columns of each axis
  Eigen::Index shared_ = 0;   // D directions
  std::vector<Axis> axes_;
};

}  // namespace axiscal
