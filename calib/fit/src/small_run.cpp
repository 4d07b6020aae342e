// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/small_run.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include <Eigen/Eigenvalues>

#include "axiscal/calib/scaled_cholesky.hpp"
#include "axiscal/core/rotation.hpp"

namespace axiscal {
namespace {

// Below this part of its square nothing is left of a column beside others, as LinearisedRun has it.
constexpr double dependent = 1e-12;

}  // namespace

bool SmallState::can_be(const ReadingSet& set) {
  return set.axis_count() == 3 && set.size() <= most_readings && set.column_count() == 4 &&
         set.size() > set.column_count() && !set.robust && set.field.vector_count() == 1 &&
         set.visible.empty() && set.seen.cols() == 0 && !set.rotation_sensor_from_table.empty() &&
         set.field_then.empty() && (set.weights.array() == 1.0).all();
}

std::optional<SmallState> SmallState::of(const ReadingSet& set, const JointState& state) {
  if (!can_be(set)) {
    return std::nullopt;
  }
  const JointAxis& first = state.axes.front();
  const double pivot = first.design->smallest_pivot();
  if (!(pivot * pivot > dependent) ||
      !std::all_of(state.axes.begin(), state.axes.end(),
                   [&](const JointAxis& axis) { return axis.design == first.design; })) {
    return std::nullopt;
  }
  std::optional<SmallState> small = SmallState(set, state.direction_count() > 0);
  small->basis_ = first.design->basis();
  small->field_met_ = first.X().middleCols<3>(1);
  small->residuals_.resize(set.size(), 3);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const JointAxis& axis = state.axes[static_cast<std::size_t>(k)];
    small->residuals_.col(k) = axis.residuals;
    small->sensitivity_.row(k) = axis.estimate.segment<3>(1).transpose();
  }
  small->field_magnitude_ = state.field.magnitude();
  small->find_tangents(state.field);
  return small;
}

void SmallState::find_tangents(const TableField& field) {
  const Eigen::Matrix<double, 3, 2> steps = field.step_unit(0) * tangents_of(field.vector(0));
  const std::string_view level = field.parts().front().level_name();
  tangents_.resize(readings(), 6);
  for (Eigen::Index i = 0; i < readings(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Eigen::Matrix<double, 3, 2> changes =
        set_->readings[at].level.of(level) *
        (sensitivity_ * (set_->rotation_sensor_from_table[at] * steps));
    for (Eigen::Index k = 0; k < 3; ++k) {
      tangents_.row(i).segment<2>(2 * k) = changes.row(k);
    }
  }
  const Eigen::Matrix<double, 4, 6> in_basis = basis_.transpose().lazyProduct(tangents_);
  projected_ = tangents_ - basis_.lazyProduct(in_basis);
}

SmallRun::SmallRun(const SmallState& state, const Eigen::Vector3d& sigma, bool directions)
    : state_(state), sigma_(sigma), has_directions_(directions), residuals_(state.residuals()) {
  residuals_.array().rowwise() /= sigma.transpose().array();
  shared_basis_.resize(readings(), 6);
  if (!directions) {
    shared_basis_.setZero();
    has_full_rank_ = true;
    return;
  }
  const Eigen::Vector3d per_sigma = sigma.cwiseInverse();
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  Eigen::Vector2d squares = Eigen::Vector2d::Zero();
  for (Eigen::Index k = 0; k < 3; ++k) {
    for (Eigen::Index i = 0; i < readings(); ++i) {
      const Eigen::Vector2d left(per_sigma(k) * state.projected()(i, 2 * k),
                                 per_sigma(k) * state.projected()(i, 2 * k + 1));
      const Eigen::Vector2d whole(per_sigma(k) * state.tangents()(i, 2 * k),
                                  per_sigma(k) * state.tangents()(i, 2 * k + 1));
      information(0, 0) += left(0) * left(0);
      information(1, 0) += left(1) * left(0);
      information(1, 1) += left(1) * left(1);
      gradient += residuals_(i, k) * left;
      squares += whole.cwiseAbs2();
    }
  }
  information(0, 1) = information(1, 0);
  const ScaledCholeskyOf<Eigen::Matrix2d> cholesky(information);
  has_full_rank_ = cholesky.is_determined(dependent) &&
                   (information.diagonal().array() > dependent * squares.array()).all();
  if (!has_full_rank_) {
    return;
  }
  root_of_shared_ = cholesky.root_of_inverse();
  const Eigen::Vector2d in_root = root_of_shared_.transpose() * gradient;
  step_ = root_of_shared_ * in_root;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::Matrix2d root = per_sigma(k) * root_of_shared_;
    for (Eigen::Index i = 0; i < readings(); ++i) {
      const double first = state.projected()(i, 2 * k);
      const double second = state.projected()(i, 2 * k + 1);
      const Eigen::Vector2d basis(first * root(0, 0) + second * root(1, 0),
                                  first * root(0, 1) + second * root(1, 1));
      shared_basis_(i, 2 * k) = basis(0);
      shared_basis_(i, 2 * k + 1) = basis(1);
      residuals_(i, k) -= basis.dot(in_root);
    }
  }
}

double SmallRun::degrees_of_freedom() const {
  return static_cast<double>(3 * (readings() - 4)) - (has_directions_ ? 2.0 : 0.0);
}

namespace {

// The scaled normal equations of axes of one design X, where each has the same N = X^T X and shares
// columns with the others: in the eigenvectors of N they are its eigenvalues, and how the shared
// columns couple to each is known by the products over the axes.
class CoupledNormal {
 public:
  explicit CoupledNormal(const SmallRun& run) {
    const SmallState& state = run.state();
    const Eigen::Index n = run.readings();
    Eigen::Matrix4d N = Eigen::Matrix4d::Zero();
    std::array<Eigen::Matrix<double, 4, 2>, 3> across;
    across.fill(Eigen::Matrix<double, 4, 2>::Zero());
    for (Eigen::Index i = 0; i < n; ++i) {
      Eigen::Vector4d row;
      row << 1.0, state.field_met().row(i).transpose();
      N.noalias() += row.lazyProduct(row.transpose());
      for (Eigen::Index k = 0; k < 3; ++k) {
        const Eigen::RowVector2d shared = state.tangents().row(i).segment<2>(2 * k) / run.sigma(k);
        across[static_cast<std::size_t>(k)].noalias() += row.lazyProduct(shared);
        shared_.noalias() += shared.transpose().lazyProduct(shared);
      }
    }
    const Eigen::Vector4d per_length = N.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::Vector2d per_shared =
        shared_.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(
        Eigen::Matrix4d(per_length.asDiagonal() * N * per_length.asDiagonal()));
    own_ = solver.eigenvalues();
    shared_ = per_shared.asDiagonal() * shared_ * per_shared.asDiagonal();
    coupled_.fill(Eigen::Matrix2d::Zero());
    for (const Eigen::Matrix<double, 4, 2>& of_axis : across) {
      const Eigen::Matrix<double, 4, 2> turned = solver.eigenvectors().transpose() *
                                                 per_length.asDiagonal() * of_axis *
                                                 per_shared.asDiagonal();
      for (Eigen::Index j = 0; j < 4; ++j) {
        coupled_[static_cast<std::size_t>(j)].noalias() +=
            turned.row(j).transpose().lazyProduct(turned.row(j));
      }
    }
  }

  // How many eigenvalues are less than mu: those of N, three times each, and what the shared
  // columns have beside them (Sylvester's law of inertia).
  [[nodiscard]] int count_below(double mu) const {
    int count = 0;
    Eigen::Matrix2d left = shared_ - mu * Eigen::Matrix2d::Identity();
    for (Eigen::Index j = 0; j < 4; ++j) {
      count += own_(j) < mu ? 3 : 0;
      left -= coupled_[static_cast<std::size_t>(j)] / (own_(j) - mu);
    }
    const double determinant = left(0, 0) * left(1, 1) - left(1, 0) * left(0, 1);
    if (determinant < 0.0) {
      return count + 1;
    }
    return left.trace() < 0.0 ? count + 2 : count;
  }

  static constexpr int columns = 14;  // four of each axis and two that they share

  // The eigenvalue that has so many below it.
  [[nodiscard]] double eigenvalue(int below) const {
    double low = 0.0;
    double high = columns;  // as the diagonal is of ones
    constexpr int digits = 60;
    for (int round = 0; round < digits; ++round) {
      const double middle = 0.5 * (low + high);
      (count_below(middle) > below ? high : low) = middle;
    }
    return 0.5 * (low + high);
  }

 private:
  Eigen::Vector4d own_;                               // eigenvalues of N
  Eigen::Matrix2d shared_ = Eigen::Matrix2d::Zero();  // of the shared columns
  std::array<Eigen::Matrix2d, 4> coupled_;            // of each eigenvector, over the axes
};

}  // namespace

std::optional<double> SmallRun::small_condition() const {
  const CoupledNormal normal(*this);
  constexpr double most = 1e4;  // the condition number's square
  const double ratio = normal.eigenvalue(CoupledNormal::columns - 1) / normal.eigenvalue(0);
  return ratio > 0.0 && ratio < most ? std::optional(std::sqrt(ratio)) : std::nullopt;
}

}  // namespace axiscal
