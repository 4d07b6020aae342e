// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/small_run.hpp"

#include <algorithm>
#include <string_view>

#include "axiscal/calib/scaled_cholesky.hpp"
#include "axiscal/core/rotation.hpp"

namespace axiscal {
namespace {

// Below this part of its square nothing is left of a column beside others, as LinearisedRun has it.
constexpr double dependent = 1e-12;

}  // namespace

bool SmallState::can_be(const ReadingSet& set) {
  return set.axis_count() == 3 && set.size() <= most_readings && set.column_count() == 4 &&
         set.size() > set.column_count() && !set.robust && !set.field.is_sum() &&
         set.visible.empty() && set.seen.cols() == 0 && !set.rotation_sensor_from_table.empty() &&
         set.field_then.empty() && (set.weights.array() == 1.0).all();
}

std::optional<SmallState> SmallState::of(const ReadingSet& set, const JointState& state) {
  const JointAxis& first = state.axes.front();
  const bool one_design =
      std::all_of(state.axes.begin(), state.axes.end(),
                  [&](const JointAxis& axis) { return axis.design == first.design; });
  if (!can_be(set) || !one_design || state.field.size() != 1 ||
      !(first.design->smallest_pivot() * first.design->smallest_pivot() > dependent)) {
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
  shared_basis_ = Columns<6>::Zero(readings(), 6);
  if (!directions) {
    has_full_rank_ = true;
    return;
  }
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  Eigen::Vector2d squares = Eigen::Vector2d::Zero();
  for (Eigen::Index k = 0; k < 3; ++k) {
    auto own = shared_basis_.middleCols<2>(2 * k);
    own = state.projected().middleCols<2>(2 * k) / sigma(k);
    information.noalias() += own.transpose().lazyProduct(own);
    gradient.noalias() += own.transpose().lazyProduct(residuals_.col(k));
    squares +=
        (state.tangents().middleCols<2>(2 * k) / sigma(k)).colwise().squaredNorm().transpose();
  }
  const ScaledCholeskyOf<Eigen::Matrix2d> cholesky(information);
  has_full_rank_ = cholesky.is_determined(dependent) &&
                   (information.diagonal().array() > dependent * squares.array()).all();
  if (!has_full_rank_) {
    return;
  }
  root_of_shared_ = cholesky.root_of_inverse();
  step_ = root_of_shared_ * (root_of_shared_.transpose() * gradient);
  for (Eigen::Index k = 0; k < 3; ++k) {
    auto own = shared_basis_.middleCols<2>(2 * k);
    residuals_.col(k) -= own.lazyProduct(step_);
    own = (own * root_of_shared_).eval();
  }
}

double SmallRun::degrees_of_freedom() const {
  return static_cast<double>(3 * (readings() - 4)) - (has_directions_ ? 2.0 : 0.0);
}

}  // namespace axiscal
