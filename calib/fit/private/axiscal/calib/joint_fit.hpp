// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/least_squares.hpp"
#include "axiscal/calib/reading_set.hpp"
#include "axiscal/calib/response_system.hpp"
#include "axiscal/calib/shared_fit.hpp"

namespace axiscal {

/// One axis at given directions of the field: its p coefficients fitted, the directions' effect
/// projected. There are D directions in all: two tangents for each levelness or part of the field,
/// and a third for a part of unknown magnitude, along it.
struct JointAxis {
  [[nodiscard]] const Eigen::MatrixXd& X() const { return *columns; }
  [[nodiscard]] const Eigen::VectorXd& root_weights() const { return design->root_weights(); }

  // Axes that weigh alike share these.
  std::shared_ptr<const Eigen::MatrixXd> columns;  // X, n x p, not weighted
  std::shared_ptr<const FactoredDesign> design;
  Eigen::VectorXd estimate;   // b, S, second fields, temperature; p
  Eigen::VectorXd residuals;  // weighted
  Eigen::MatrixXd tangents;   // n x D, weighted: change of the fit per radian
  Eigen::MatrixXd projected;  // the same without what b and S can take up
  Eigen::MatrixXd take_up;    // p x D: change of the coefficients that takes up a tangent
  // Over the readings: of `projected` and the residuals; and the squares of the tangents, D.
  ResponseSums sums;
  Eigen::VectorXd tangent_squares;

  void find_sums();
};

struct JointState {
  TableField field;  // in the table, one for each levelness or part
  std::vector<TableField::Tangents> tangents;
  std::vector<JointAxis> axes;

  // The first of a vector's columns among the directions.
  [[nodiscard]] Eigen::Index first_direction(std::size_t which) const {
    Eigen::Index first = 0;
    for (std::size_t s = 0; s < which; ++s) {
      first += tangents[s].cols();
    }
    return first;
  }
  [[nodiscard]] Eigen::Index direction_count() const { return first_direction(tangents.size()); }
};

/// What the fitted directions cost.
struct DirectionShares {
  Eigen::MatrixXd covariance;  // how well the tangents are known [rad^2], D x D
  Eigen::VectorXd
      degrees_of_freedom;  // per axis: readings less p, less its share in the directions
};

/// The axes' noise where the readings say all there is to know of it.
struct Reweighting {
  Eigen::VectorXd sigma;               ///< m standard deviations
  Eigen::VectorXd degrees_of_freedom;  ///< m, at sigma
};

/// Least squares in b, S and the field's direction for each levelness (method.md, section 4).
class JointFit {
 public:
  /// Directions are as good as open when what they change beyond b and S is smaller than this part
  /// of what they change at all.
  static constexpr double confounded_below = 1e-9;

  /// @param set, weights  must outlive the fit; weights n x m.
  JointFit(const ReadingSet& set, const Eigen::MatrixXd& weights) : set_(set), weights_(weights) {}

  /// b and S fitted for given fields.
  /// @param directions_given  then the state has none: nothing is to be said of a step of them.
  [[nodiscard]] std::shared_ptr<const JointState> at(const TableField& field,
                                                     bool directions_given = false) const;

  /// The fixed point sigma_k^2 = RSS_k / nu_k of a linearised problem, in which the residuals of
  /// each axis are linear in the step, as fit_shared() has it.
  ///
  /// @param sigma     m standard deviations to begin with.
  /// @param smallest  m, below which none is taken: what rounding leaves.
  /// @return nothing where the readings do not determine the directions.
  [[nodiscard]] std::optional<Reweighting> reweighted(const JointState& state,
                                                      const Eigen::VectorXd& sigma,
                                                      const Eigen::VectorXd& smallest) const;

  /// Gauss-Newton in the tangents, b and S projected out.
  /// @param sigma  standard deviation of each axis.
  [[nodiscard]] std::shared_ptr<const JointState> converged(std::shared_ptr<const JointState> state,
                                                            const Eigen::VectorXd& sigma,
                                                            int most_rounds = 50) const;

  [[nodiscard]] DirectionShares shares(const JointState& state, const Eigen::VectorXd& sigma) const;

 private:
  // Adds axes of the same columns and weights to a state that has its field and tangents.
  // @param field_changes  what those change, where there are any; used up if these axes are the
  // last.
  void add_axes(Eigen::Index first,
                Eigen::Index count,
                const std::shared_ptr<const Eigen::MatrixXd>& columns,
                FieldChanges& field_changes,
                JointState& state) const;

  // The sum of the squares of all residuals, each axis in units of its sigma.
  [[nodiscard]] double cost(const JointState& state, const Eigen::VectorXd& sigma) const;

  // The state that a step of the tangents leads to, halved until the cost does not rise; null
  // where no part of it helps.
  [[nodiscard]] std::shared_ptr<const JointState> advanced(const JointState& state,
                                                           const Eigen::VectorXd& sigma,
                                                           Eigen::VectorXd step) const;

  // The directions that are not confounded with b and S, as orthonormal changes of the residuals:
  // the step is basis * z.
  [[nodiscard]] Eigen::MatrixXd open_basis(const JointState& state,
                                           const Eigen::VectorXd& sigma) const;

  const ReadingSet& set_;
  const Eigen::MatrixXd& weights_;
};

}  // namespace axiscal
