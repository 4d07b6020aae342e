// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/least_squares.hpp"
#include "calib/fit/reading_set.hpp"
#include "calib/regression/gauss_newton.hpp"
#include "calib/regression/shared_fit.hpp"

namespace axiscal {

/// Columns that a hypothesis adds to the model, shared by all axes.
///
/// @param field         the field at which the model is linearised.
/// @param coefficients  p x m: the coefficients of the axes' own columns at this field.
/// @return (n m) x q, axis below axis, not weighted.
using AddedColumns =
    std::function<Eigen::MatrixXd(const TableField& field, const Eigen::MatrixXd& coefficients)>;

/// The values of the unknowns in which the model is not linear.
struct Place {
  TableField field;                            ///< the field in the table's frame
  Eigen::MatrixXd scale = {};                  ///< m x order: c of TemperatureTerms::scale
  SensitivityMatrix along = {};                ///< m x 3: the sensitivity S that c multiplies
  std::map<int, Eigen::Matrix3d> mounts = {};  ///< turn of the instrument in each mount
  Eigen::VectorXd added = {};                  ///< q: coefficients of the added columns
  Eigen::MatrixXd coefficients = {};           ///< p x m: argument of AddedColumns; or empty
};

/// One axis at a place. Its own p coefficients are fitted. The s shared unknowns are the steps of
/// the field's directions, of the mounts' turns and of the added coefficients.
struct AxisSolution {
  [[nodiscard]] const Eigen::MatrixXd& X() const { return *columns; }
  [[nodiscard]] const Eigen::VectorXd& root_weights() const { return design->root_weights(); }

  /// Computes `sums` and `shared_squares` from the other members.
  void find_sums();

  // Axes with the same columns and weights share these two.
  std::shared_ptr<const Eigen::MatrixXd> columns;  ///< X, n x p, not weighted
  std::shared_ptr<const FactoredDesign> design;
  Eigen::VectorXd estimate;        ///< b, S, second fields, temperature, effects; p
  Eigen::VectorXd residuals;       ///< weighted, n
  Eigen::MatrixXd shared;          ///< weighted, n x s: change of the readings per unit step
  Eigen::MatrixXd projected;       ///< n x s: `shared` after projection off X
  Eigen::MatrixXd take_up;         ///< p x s: change of the estimate per unit step, negated
  ResponseSums sums;               ///< sums of products of `projected` and `residuals`
  Eigen::VectorXd shared_squares;  ///< s: squared lengths of the columns of `shared`
};

/// The solutions of all axes at a place.
struct Solution {
  Place place;
  std::vector<TableField::Tangents> tangents;  ///< empty if the directions are known
  std::vector<AxisSolution> axes;

  [[nodiscard]] const TableField& field() const { return place.field; }

  /// @return the index of the first shared unknown of a vector's tangents.
  [[nodiscard]] Eigen::Index first_direction(std::size_t vector) const;

  /// @return the number of the tangents of all vectors.
  [[nodiscard]] Eigen::Index direction_count() const { return first_direction(tangents.size()); }

  [[nodiscard]] Eigen::Index shared_count() const { return axes.front().shared.cols(); }

  /// @return the estimates of all axes, p x m.
  [[nodiscard]] Eigen::MatrixXd coefficients() const;
};

/// @return the readings with the temperature scales of a place; `nullopt` if the place has no
///         scales.
[[nodiscard]] std::optional<ReadingSet> with_scales_of(const ReadingSet& readings,
                                                       const Place& place);

/// Covariance and degrees of freedom of the shared unknowns.
struct SharedCost {
  Eigen::MatrixXd covariance;  ///< s x s
  /// m: the number of readings minus p, minus the axis's share of the s shared unknowns
  Eigen::VectorXd degrees_of_freedom;
};

/// Standard deviations of the axes by restricted likelihood.
struct AxisNoise {
  Eigen::VectorXd sigma;               ///< m
  Eigen::VectorXd degrees_of_freedom;  ///< m
};

/// The model of a run (method.md, section 4): the readings, and the unknowns that are fitted.
///
/// A reading of axis k is v = x_k b_k + e, where the row x_k contains 1, the field in the sensor's
/// frame, the temperature terms and the effects of the run. The field in the sensor's frame depends
/// on the directions of the field in the table and on the turns of the mounts. These unknowns are
/// shared by all axes. For any Place the axes' own coefficients b_k follow by linear regression
/// (variable projection), so gauss_newton() searches only the shared unknowns.
///
/// @par Source
/// Golub & Pereyra, SIAM J. Numer. Anal. 10 (1973) 413-432; Kaufman, BIT 15 (1975) 49-57.
class Model {
 public:
  /// A direction is undetermined if less than this fraction of its effect on the readings remains
  /// after projection off the own columns.
  static constexpr double open_below = 1e-9;

  /// @param readings          must outlive the model.
  /// @param directions_known  whether the field's directions are given.
  /// @param weights           n x m, used instead of readings.weights; must outlive the model.
  Model(const ReadingSet& readings, bool directions_known, const Eigen::MatrixXd& weights)
      : readings_(readings), weights_(weights), directions_known_(directions_known) {}
  Model(const ReadingSet& readings, bool directions_known)
      : Model(readings, directions_known, readings.weights) {}

  /// @return the same model with the columns of a hypothesis.
  [[nodiscard]] Model with(AddedColumns added) const;

  /// @return the same model with a turn of the instrument in each mount as an unknown. The turns
  ///         sum to 0.
  [[nodiscard]] Model with_free_mounts() const;

  [[nodiscard]] const ReadingSet& readings() const { return readings_; }

  /// @return a starting place. The coefficients in its `scale` are 0, and its `along` is the
  ///         sensitivity from a fit without temperature terms.
  /// @throws RankDeficientError  as at().
  [[nodiscard]] Place start(TableField field) const;

  /// @return the axes' own coefficients at a place, and the derivatives of the readings with
  ///         respect to the shared unknowns.
  /// @throws RankDeficientError  if the own columns of an axis are dependent.
  [[nodiscard]] std::shared_ptr<const Solution> at(const Place& place) const;

  /// @return the place after a step of the shared unknowns.
  /// @param step  changes of the s shared unknowns.
  [[nodiscard]] Place moved(const Solution& from, const Eigen::VectorXd& step) const;

  /// Least squares over all unknowns, each axis in units of its sigma, by gauss_newton().
  /// @param sigma  standard deviation of each axis, m.
  /// @return the solution; `converged` is false if the steps do not converge.
  /// @throws RankDeficientError  as at().
  [[nodiscard]] GaussNewtonResult<std::shared_ptr<const Solution>> solved(
      std::shared_ptr<const Solution> start,
      const Eigen::VectorXd& sigma,
      const GaussNewtonOptions& options = {.most_rounds = 50}) const;

  /// Estimates the axes' variances by restricted likelihood, with the model linearised about a
  /// solution.
  /// @param sigma     m starting values.
  /// @param smallest  m lower limits.
  /// @return `nullopt` if the readings do not determine the shared unknowns.
  [[nodiscard]] static std::optional<AxisNoise> noise(const Solution& solution,
                                                      const Eigen::VectorXd& sigma,
                                                      const Eigen::VectorXd& smallest);

  /// @param sigma  standard deviation of each axis, m.
  [[nodiscard]] static SharedCost cost_of_shared(const Solution& solution,
                                                 const Eigen::VectorXd& sigma);

 private:
  [[nodiscard]] bool is_linear() const;
  [[nodiscard]] std::optional<ReadingSet> readings_at(const Place& place) const;
  [[nodiscard]] Eigen::MatrixXd changes_with_mounts(const ReadingSet& set,
                                                    const Place& place) const;

  const ReadingSet& readings_;
  const Eigen::MatrixXd& weights_;
  bool directions_known_;
  AddedColumns added_;
  std::vector<int> free_mounts_;  // mount numbers, ascending
};

}  // namespace axiscal
