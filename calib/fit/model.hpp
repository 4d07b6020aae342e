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

/// A function that returns the columns that a hypothesis adds to the model. The coefficients of
/// these columns are shared by all axes.
///
/// @param field         the field at which the model is linearised.
/// @param coefficients  p x m: the coefficients of the axes' own columns at this field.
/// @return (n m) x q, not weighted: n rows for the first axis, then n rows for the second axis, and
///         so on.
using AddedColumns =
    std::function<Eigen::MatrixXd(const TableField& field, const Eigen::MatrixXd& coefficients)>;

/// Values of the unknowns that enter the model nonlinearly.
struct Place {
  TableField field;              ///< the field in the table's frame
  Eigen::MatrixXd scale = {};    ///< m x order: the coefficients c of TemperatureTerms
  SensitivityMatrix along = {};  ///< m x 3: the sensitivity S in TemperatureTerms
  /// rotation of the instrument in each mount, by mount number
  std::map<int, Eigen::Matrix3d> mounts = {};
  Eigen::VectorXd added = {};         ///< q: coefficients of the added columns
  Eigen::MatrixXd coefficients = {};  ///< p x m: coefficients for AddedColumns; may be empty
};

/// The fit of one axis at a Place. Its own p coefficients are fitted by linear regression. The s
/// shared unknowns are steps of the field's directions, of the mounts' rotations and of the
/// coefficients of added columns.
struct AxisSolution {
  [[nodiscard]] const Eigen::MatrixXd& X() const { return *columns; }
  [[nodiscard]] const Eigen::VectorXd& root_weights() const { return design->root_weights(); }

  // Axes with the same columns and weights share the next two objects.
  std::shared_ptr<const Eigen::MatrixXd> columns;  ///< X, n x p, not weighted
  std::shared_ptr<const FactoredDesign> design;
  /// p coefficients: bias, sensitivities, temperature terms, effects of the run
  Eigen::VectorXd estimate;
  Eigen::VectorXd residuals;  ///< weighted, n
  /// weighted, n x s: change of the readings per unit step of each shared unknown
  Eigen::MatrixXd shared;
  Eigen::MatrixXd projected;  ///< n x s: `shared` minus its projection on the columns of X
  Eigen::MatrixXd take_up;  ///< p x s: decrease of `estimate` per unit step of each shared unknown
};

/// The solutions of all axes at a place.
struct Solution {
  Place place;
  std::vector<TableField::Tangents> tangents;  ///< empty if the directions are known
  std::vector<AxisSolution> axes;
  SharedSums sums;                 ///< of the axes' `projected` and `residuals`
  Eigen::MatrixXd shared_squares;  ///< s x m: squared lengths of the columns of the axes' `shared`

  /// Computes `sums` and `shared_squares` from `axes`.
  void find_sums();

  [[nodiscard]] const TableField& field() const { return place.field; }

  /// @return the index of the first shared unknown for the direction of field vector number
  ///         `vector`.
  [[nodiscard]] Eigen::Index first_direction(std::size_t vector) const;

  /// @return the number of shared unknowns for the directions of all field vectors.
  [[nodiscard]] Eigen::Index direction_count() const { return first_direction(tangents.size()); }

  [[nodiscard]] Eigen::Index shared_count() const { return axes.front().shared.cols(); }

  /// @return the estimates of all axes, p x m.
  [[nodiscard]] Eigen::MatrixXd coefficients() const;
};

/// @return the readings with the temperature scales of a place; `nullopt` if the place has no
///         scales.
[[nodiscard]] std::optional<ReadingSet> with_scales_of(const ReadingSet& readings,
                                                       const Place& place);

/// The covariance of the shared unknowns, and the degrees of freedom that remain for each axis.
struct SharedCost {
  Eigen::MatrixXd covariance;  ///< s x s
  /// m entries: the number of readings minus p, minus the part of the s shared unknowns that this
  /// axis determines
  Eigen::VectorXd degrees_of_freedom;
};

/// Standard deviation of the noise of each axis, estimated by restricted likelihood.
struct AxisNoise {
  Eigen::VectorXd sigma;               ///< m
  Eigen::VectorXd degrees_of_freedom;  ///< m
};

/// The model of a run (method.md, section 4): the readings, and the unknowns that are fitted.
///
/// A reading of axis k is v = x_k b_k + e. The row x_k contains 1, the field in the sensor's frame,
/// the temperature terms and the effects of the run. The field in the sensor's frame depends on the
/// directions of the field in the table and on the rotations of the mounts. These unknowns are
/// shared by all axes. For any Place, linear regression gives the axes' own coefficients b_k
/// (variable projection), so gauss_newton() searches only the shared unknowns.
///
/// @par Source
/// Golub & Pereyra, SIAM J. Numer. Anal. 10 (1973) 413-432; Kaufman, BIT 15 (1975) 49-57.
class Model {
 public:
  /// A direction of the field counts as undetermined if less than this fraction of its effect on
  /// the readings remains after subtracting the projection on the own columns.
  static constexpr double open_below = 1e-9;

  /// @param readings          must outlive the model.
  /// @param directions_known  true if the field's directions are given.
  /// @param weights           n x m, used instead of readings.weights; must outlive the model.
  Model(const ReadingSet& readings, bool directions_known, const Eigen::MatrixXd& weights)
      : readings_(readings), weights_(weights), directions_known_(directions_known) {}
  Model(const ReadingSet& readings, bool directions_known)
      : Model(readings, directions_known, readings.weights) {}

  /// @return the same model with the columns of a hypothesis.
  [[nodiscard]] Model with(AddedColumns added) const;

  /// @return the same model with the rotation of the instrument in each mount as a further unknown.
  ///         The rotation vectors of all mounts sum to 0.
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

  /// Fits all unknowns by least squares with gauss_newton(). The residuals of each axis are divided
  /// by its sigma.
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
