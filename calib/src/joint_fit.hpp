// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/least_squares.hpp"
#include "estimation.hpp"

namespace axiscal {

/// One axis at given directions of the field: b and S fitted, the directions' effect projected.
/// There are two tangents for each levelness, 2 B in all.
struct JointAxis {
  std::shared_ptr<const LeastSquaresDesign> design;
  Eigen::VectorXd root_weights;
  Eigen::Vector4d estimate;   // b, S
  Eigen::VectorXd residuals;  // weighted
  Eigen::MatrixXd tangents;   // n x 2B, weighted: change of the fit per radian
  Eigen::MatrixXd projected;  // the same without what b and S can take up
  Eigen::Matrix<double, 4, Eigen::Dynamic> take_up;  // change of b and S that takes up a tangent
};

struct JointState {
  std::vector<Eigen::Vector3d> fields;  // in the table, one for each levelness
  std::vector<Eigen::Matrix<double, 3, 2>> tangents;
  Eigen::MatrixXd X;  // n x 4, not weighted
  std::vector<JointAxis> axes;

  [[nodiscard]] Eigen::Index direction_count() const {
    return 2 * static_cast<Eigen::Index>(fields.size());
  }
};

/// What the fitted directions cost.
struct DirectionShares {
  Eigen::MatrixXd covariance;  // of the tangents [rad^2], 2B x 2B
  Eigen::VectorXd
      degrees_of_freedom;  // per axis: readings less 4, less its share in the directions
};

/// Least squares in b, S and the field's direction for each levelness (METHOD 4).
class JointFit {
 public:
  /// Directions are as good as open when what they change beyond b and S is smaller than this part
  /// of what they change at all.
  static constexpr double confounded_below = 1e-9;

  /// @param set, weights  must outlive the fit; weights n x m.
  JointFit(const ReadingSet& set, const Eigen::MatrixXd& weights) : set_(set), weights_(weights) {}

  /// b and S fitted for given fields.
  [[nodiscard]] JointState at(const std::vector<Eigen::Vector3d>& fields) const;

  /// Gauss-Newton in the tangents, b and S projected out.
  /// @param sigma  standard deviation of each axis.
  [[nodiscard]] JointState converged(const std::vector<Eigen::Vector3d>& fields,
                                     const Eigen::VectorXd& sigma) const;

  [[nodiscard]] DirectionShares shares(const JointState& state, const Eigen::VectorXd& sigma) const;

  /// The whole Jacobian: 4 columns for each axis, then the tangents; each axis in its sigma.
  [[nodiscard]] Eigen::MatrixXd jacobian(const JointState& state,
                                         const Eigen::VectorXd& sigma) const;

 private:
  [[nodiscard]] static double cost(const JointState& state, const Eigen::VectorXd& sigma);

  // All tangents below each other, each axis in units of its sigma.
  [[nodiscard]] Eigen::MatrixXd stacked(const JointState& state,
                                        const Eigen::VectorXd& sigma,
                                        Eigen::MatrixXd JointAxis::*part) const;

  const ReadingSet& set_;
  const Eigen::MatrixXd& weights_;
};

/// Where [1, vec R_i] has rank 10, M_k = S_k^T f^T follows linearly, and f is the first right
/// singular vector of all of them below each other.
///
/// @param rows  the readings to use.
/// @return a unit vector, its sign open; nothing where the rank is less.
[[nodiscard]] std::optional<Eigen::Vector3d> linear_direction(
    const ReadingSet& set, const std::vector<Eigen::Index>& rows);

}  // namespace axiscal
