// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/model.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "axiscal/core/rotation.hpp"
#include "calib/fit/response_system.hpp"
#include "calib/regression/factor.hpp"

namespace axiscal {
namespace {

// Returns an orthonormal basis of the vectors whose `count` elements sum to 0, as columns.
Eigen::MatrixXd contrasts(std::size_t count) {
  return orthogonal_complement(Eigen::VectorXd::Ones(static_cast<Eigen::Index>(count)));
}

// Returns 1 / sigma^2 of each axis.
Eigen::VectorXd weights_of(const Eigen::VectorXd& sigma) {
  return sigma.cwiseAbs2().cwiseInverse();
}

// Returns the change of the coefficients of the temperature scales, m x order. It is computed from
// the coefficients of the columns d^j (S f), see TemperatureTerms.
Eigen::MatrixXd change_of_scale(const ReadingSet& set, const Solution& solution) {
  const int order = set.temperature.order;
  Eigen::MatrixXd change = Eigen::MatrixXd::Zero(set.axis_count(), order);
  for (Eigen::Index k = 0; k < set.axis_count() && order > 0; ++k) {
    const Eigen::VectorXd& own = solution.axes[static_cast<std::size_t>(k)].estimate;
    const Eigen::RowVector3d along = solution.place.along.row(k);
    const double unit = along.dot(own.segment<3>(1)) / along.squaredNorm();
    if (unit != 0.0) {
      change.row(k) = own.segment(set.base_column_count() + order, order).transpose() / unit;
    }
  }
  return change;
}

// Returns a basis B of the shared unknowns that the readings determine. It satisfies B^T N B = 1; N
// is the information matrix.
Eigen::MatrixXd open_basis(const Solution& solution, const Eigen::VectorXd& sigma) {
  const Eigen::VectorXd weights = weights_of(sigma);
  const Eigen::MatrixXd information = solution.sums.information_at(weights);
  const double whole = (solution.shared_squares * weights).sum();
  // If more than this fraction of the squared norms remains after projection, `information` is
  // accurate enough.
  constexpr double clear = 1e-6;
  const PositiveFactor cholesky(information);
  if (cholesky.is_determined(clear) && (information.diagonal().array() > clear * whole).all()) {
    return cholesky.root_of_inverse();
  }
  const Eigen::Index n = solution.axes.front().projected.rows();
  Eigen::MatrixXd projected(n * sigma.size(), solution.shared_count());
  for (Eigen::Index k = 0; k < sigma.size(); ++k) {
    projected.middleRows(n * k, n) =
        solution.axes[static_cast<std::size_t>(k)].projected / sigma(k);
  }
  return root_of_pseudo_inverse(projected, Model::open_below * std::sqrt(whole));
}

// A model as a problem for gauss_newton(), with each axis in units of its sigma.
class ModelProblem {
 public:
  using State = std::shared_ptr<const Solution>;
  using Linear = Linearised;

  ModelProblem(const Model& model, const Eigen::VectorXd& sigma) : model_(model), sigma_(sigma) {}

  void linearise(const State& at, Linear& linear) const {
    const Eigen::Index n = at->axes.front().residuals.size();
    linear.residuals.resize(n * sigma_.size());
    linear.jacobian.resize(n * sigma_.size(), at->shared_count());
    for (Eigen::Index k = 0; k < sigma_.size(); ++k) {
      const AxisSolution& axis = at->axes[static_cast<std::size_t>(k)];
      linear.residuals.segment(n * k, n) = -axis.residuals / sigma_(k);
      linear.jacobian.middleRows(n * k, n) = axis.projected / sigma_(k);
    }
    const double whole = (at->shared_squares * weights_of(sigma_)).sum();
    // The limit is 0 if there are added columns, because they may have any unit. The caller rejects
    // the fit if these columns are not determined.
    linear.open_below = at->place.added.size() > 0 ? 0.0 : Model::open_below * std::sqrt(whole);
  }

  [[nodiscard]] State moved(const State& at, const Eigen::VectorXd& step) const {
    return model_.at(model_.moved(*at, step));
  }

  [[nodiscard]] double cost(const State& at, const Linear& /*linear*/) const {
    return at->sums.squares.dot(weights_of(sigma_));
  }

  // Returns the largest of three measures of a step: its rotations [rad], its change of the
  // temperature scales relative to the response, and its relative change of the readings by the
  // added columns.
  [[nodiscard]] double length(const State& at,
                              const Eigen::VectorXd& step,
                              const Linear& linear) const {
    const Eigen::Index added = at->place.added.size();
    double length = step.head(step.size() - added).norm();
    const ReadingSet& set = model_.readings();
    const Eigen::MatrixXd change = change_of_scale(set, *at);
    for (Eigen::Index j = 0; j < change.cols(); ++j) {
      const double span = std::pow(set.temperature.d.cwiseAbs().maxCoeff(), j + 1);
      length = std::max(length, span * change.col(j).cwiseAbs().maxCoeff());
    }
    if (added > 0) {
      const double all = (at->place.coefficients.row(0).transpose().cwiseQuotient(sigma_)).norm() +
                         at->place.coefficients.middleRows<3>(1).norm() * at->field().magnitude() /
                             sigma_.minCoeff();
      length = std::max(length, (linear.jacobian.rightCols(added) * step.tail(added)).norm() / all);
    }
    return length;
  }

 private:
  const Model& model_;
  const Eigen::VectorXd& sigma_;
};

}  // namespace

void Solution::find_sums() {
  const auto m = static_cast<Eigen::Index>(axes.size());
  sums = SharedSums(shared_count(), m);
  shared_squares.resize(shared_count(), m);
  for (Eigen::Index k = 0; k < m; ++k) {
    const AxisSolution& axis = axes[static_cast<std::size_t>(k)];
    sums.information_of(k).noalias() = axis.projected.transpose() * axis.projected;
    sums.gradient.col(k).noalias() = axis.projected.transpose() * axis.residuals;
    sums.squares(k) = axis.residuals.squaredNorm();
    sums.degrees_of_freedom(k) = static_cast<double>(axis.design->observations() - axis.X().cols());
    shared_squares.col(k) = axis.shared.colwise().squaredNorm().transpose();
  }
}

Eigen::Index Solution::first_direction(std::size_t vector) const {
  Eigen::Index first = 0;
  for (std::size_t s = 0; s < vector; ++s) {
    first += tangents[s].cols();
  }
  return first;
}

Eigen::MatrixXd Solution::coefficients() const {
  Eigen::MatrixXd all(axes.front().estimate.size(), static_cast<Eigen::Index>(axes.size()));
  for (std::size_t k = 0; k < axes.size(); ++k) {
    all.col(static_cast<Eigen::Index>(k)) = axes[k].estimate;
  }
  return all;
}

std::optional<ReadingSet> with_scales_of(const ReadingSet& readings, const Place& place) {
  if (place.scale.size() == 0) {
    return std::nullopt;
  }
  ReadingSet set = readings;
  set.temperature.scale = place.scale;
  set.temperature.along = place.along;
  return set;
}

Model Model::with(AddedColumns added) const {
  Model model = *this;
  model.added_ = std::move(added);
  return model;
}

Model Model::with_free_mounts() const {
  std::set<int> numbers;
  for (const Reading& reading : readings_.readings) {
    numbers.insert(reading.mount);
  }
  Model model = *this;
  model.free_mounts_.assign(numbers.begin(), numbers.end());
  return model;
}

bool Model::is_linear() const {
  return directions_known_ && !added_ && free_mounts_.empty() && readings_.temperature.order == 0;
}

Place Model::start(TableField field) const {
  Place place{.field = std::move(field)};
  const Eigen::Index m = readings_.axis_count();
  if (readings_.temperature.order > 0) {
    ReadingSet without = readings_;
    without.temperature = {};
    const std::shared_ptr<const Solution> plain =
        Model(without, true, weights_).at({.field = place.field});
    place.scale = Eigen::MatrixXd::Zero(m, readings_.temperature.order);
    place.along = plain->coefficients().middleRows<3>(1).transpose();
  }
  for (const int mount : free_mounts_) {
    place.mounts.emplace(mount, Eigen::Matrix3d::Identity());
  }
  return place;
}

// Returns the readings with the temperature scales and the mounts' rotations of `place`; nullopt if
// `place` has neither.
std::optional<ReadingSet> Model::readings_at(const Place& place) const {
  if (place.scale.size() == 0 && place.mounts.empty()) {
    return std::nullopt;
  }
  ReadingSet set = with_scales_of(readings_, place).value_or(readings_);
  for (std::size_t i = 0; i < set.readings.size() && !place.mounts.empty(); ++i) {
    set.rotation_sensor_from_table.put(
        i, place.mounts.at(set.readings[i].mount) * readings_.rotation_sensor_from_table[i]);
  }
  return set;
}

// Returns the derivatives of the field with respect to the rotations of the mounts. A rotation
// vector d of the instrument changes the field f in the sensor's frame by d cross f = -(f cross d).
Eigen::MatrixXd Model::changes_with_mounts(const ReadingSet& set, const Place& place) const {
  const Eigen::MatrixXd C = contrasts(free_mounts_.size());
  Eigen::MatrixXd changes(3 * set.size(), 3 * C.cols());
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const auto mount =
        std::lower_bound(free_mounts_.begin(), free_mounts_.end(), set.readings[at].mount) -
        free_mounts_.begin();
    const Eigen::Matrix3d change =
        -cross_matrix(set.rotation_sensor_from_table[at] * set.field_in_table(i, place.field));
    for (Eigen::Index c = 0; c < C.cols(); ++c) {
      changes.block<3, 3>(3 * i, 3 * c) = C(mount, c) * change;
    }
  }
  return changes;
}

std::shared_ptr<const Solution> Model::at(const Place& place) const {
  const std::optional<ReadingSet> own = readings_at(place);
  const ReadingSet& set = own ? *own : readings_;
  const auto result = std::make_shared<Solution>(
      Solution{.place = place, .tangents = {}, .axes = {}, .sums = {}, .shared_squares = {}});
  Solution& solution = *result;
  if (!directions_known_ && place.field.has_vectors()) {
    solution.tangents = place.field.tangents();
  }
  const AxisDesigns designs(set, place.field);
  const Eigen::Index n = set.size();
  const Eigen::Index m = set.axis_count();
  const Eigen::Index directions = solution.direction_count();
  const Eigen::Index turns =
      free_mounts_.empty() ? 0 : 3 * (static_cast<Eigen::Index>(free_mounts_.size()) - 1);
  if (added_ && place.coefficients.size() == 0) {
    Model without = *this;
    without.added_ = {};
    solution.place.coefficients = without.at(place)->coefficients();
  }
  Eigen::MatrixXd Z(n * m, 0);
  if (added_) {
    Z = added_(place.field, solution.place.coefficients);
    if (place.added.size() == 0) {
      solution.place.added = Eigen::VectorXd::Zero(Z.cols());
    }
  }
  const Eigen::Index s = directions + turns + Z.cols();
  FieldChanges field_changes;
  solution.axes.reserve(static_cast<std::size_t>(m));
  for (Eigen::Index first = 0; first < m;) {
    const Eigen::Index count = set.end_of_alike(first, weights_) - first;
    if (directions + turns > 0 && (first == 0 || !set.visible.empty())) {
      field_changes.resize(3 * n, directions + turns);
      if (directions > 0) {
        field_changes.leftCols(directions) =
            field_direction_derivatives(set, place.field, solution.tangents, first);
      }
      if (turns > 0) {
        field_changes.rightCols(turns) = changes_with_mounts(set, place);
      }
    }
    const auto columns =
        std::make_shared<const Eigen::MatrixXd>(set.all_columns(designs.of(first), first));
    const Eigen::MatrixXd& X = *columns;
    const auto design = std::make_shared<const FactoredDesign>(
        X, weights_.col(first), [&] { return set.names_of_axis(first); });
    Eigen::MatrixXd response = set.response.middleCols(first, count);
    if (Z.cols() > 0) {
      response -= (Z.middleRows(n * first, n * count) * solution.place.added).reshaped(n, count);
    }
    const Eigen::MatrixXd estimates = design->estimates(response);
    const Eigen::MatrixXd residuals =
        design->root_weights().asDiagonal() * (response - X * estimates);
    Eigen::MatrixXd shared(n, s * count);  // the shared columns of `count` axes, side by side
    for (Eigen::Index a = 0; a < count && s > 0; ++a) {
      if (directions + turns > 0) {
        shared.middleCols(s * a, directions + turns) = response_changes(
            set, first + a, estimates.col(a).segment<3>(1).transpose(), field_changes);
      }
      shared.middleCols(s * a + directions + turns, Z.cols()) = Z.middleRows(n * (first + a), n);
    }
    if (first + count == m) {
      field_changes.resize(0, 0);  // frees memory; the matrix is large for a long run
    }
    shared.array().colwise() *= design->root_weights().array();
    const Eigen::MatrixXd in_basis = design->basis().transpose() * shared;
    const Eigen::MatrixXd take_up = design->root_of_covariance() * in_basis;
    const Eigen::MatrixXd projected = shared - design->basis() * in_basis;
    for (Eigen::Index a = 0; a < count; ++a) {
      AxisSolution& axis = solution.axes.emplace_back();
      axis.columns = columns;
      axis.design = design;
      axis.estimate = estimates.col(a);
      axis.residuals = residuals.col(a);
      axis.shared = shared.middleCols(s * a, s);
      axis.take_up = take_up.middleCols(s * a, s);
      axis.projected = projected.middleCols(s * a, s);
    }
    first += count;
  }
  solution.find_sums();
  return result;
}

Place Model::moved(const Solution& from, const Eigen::VectorXd& step) const {
  Place place = from.place;
  Eigen::VectorXd turn = step.head(from.direction_count());
  for (std::size_t v = 0; v < from.tangents.size(); ++v) {
    constexpr double longest_step_rad = 0.5;  // a longer linear step is unreliable
    auto part = turn.segment(from.first_direction(v), from.tangents[v].cols());
    part *= std::min(1.0, longest_step_rad / std::max(part.norm(), 1e-300));
  }
  if (!from.tangents.empty()) {
    place.field = place.field.moved(from.tangents, turn);
  }
  if (place.scale.size() > 0) {
    place.scale += change_of_scale(readings_, from);
    place.along = from.coefficients().middleRows<3>(1).transpose();
  }
  if (!free_mounts_.empty()) {
    const Eigen::MatrixXd C = contrasts(free_mounts_.size());
    const Eigen::Matrix3Xd turns =
        step.segment(turn.size(), 3 * C.cols()).reshaped(3, C.cols()) * C.transpose();
    Eigen::Index mount = 0;
    for (auto& [number, rotation] : place.mounts) {
      rotation = rotation_by(turns.col(mount++)) * rotation;
    }
  }
  if (place.added.size() > 0) {
    place.added += step.tail(place.added.size());
    place.coefficients = from.coefficients();
    for (std::size_t k = 0; k < from.axes.size(); ++k) {
      place.coefficients.col(static_cast<Eigen::Index>(k)) -= from.axes[k].take_up * step;
    }
  }
  return place;
}

GaussNewtonResult<std::shared_ptr<const Solution>> Model::solved(
    std::shared_ptr<const Solution> start,
    const Eigen::VectorXd& sigma,
    const GaussNewtonOptions& options) const {
  if (is_linear() || (start->shared_count() == 0 && readings_.temperature.order == 0)) {
    return {.state = std::move(start), .rounds = 0, .left_to_go = 0.0, .converged = true};
  }
  // With temperature terms, the cost may increase slightly. The columns d^j (S f) already fit a
  // change of the temperature scale, but moved() stores this change only afterwards.
  GaussNewtonOptions own = options;
  own.slack = readings_.temperature.order > 0 ? 0.01 : options.slack;
  return gauss_newton(ModelProblem(*this, sigma), std::move(start), own);
}

std::optional<AxisNoise> Model::noise(const Solution& solution,
                                      const Eigen::VectorXd& sigma,
                                      const Eigen::VectorXd& smallest) {
  const Eigen::MatrixXd basis = open_basis(solution, sigma);
  const SharedSums& all = solution.sums;
  SharedSums sums(basis.cols(), all.responses());
  for (Eigen::Index k = 0; k < all.responses(); ++k) {
    sums.information_of(k) = basis.transpose() * all.information_of(k) * basis;
  }
  sums.gradient = basis.transpose() * all.gradient;
  sums.squares = all.squares;
  sums.degrees_of_freedom = all.degrees_of_freedom;
  const std::optional<SharedFit> fit = fit_shared(sums, sigma.cwiseAbs2(), smallest.cwiseAbs2());
  if (!fit) {
    return std::nullopt;
  }
  return AxisNoise{.sigma = fit->variance.cwiseSqrt(),
                   .degrees_of_freedom = fit->degrees_of_freedom};
}

SharedCost Model::cost_of_shared(const Solution& solution, const Eigen::VectorXd& sigma) {
  const Eigen::MatrixXd root = open_basis(solution, sigma);
  SharedCost cost{.covariance = root * root.transpose(),
                  .degrees_of_freedom = Eigen::VectorXd(sigma.size())};
  for (Eigen::Index k = 0; k < sigma.size(); ++k) {
    const double left =
        solution.sums.degrees_of_freedom(k) -
        solution.sums.information_of(k).cwiseProduct(cost.covariance).sum() / (sigma(k) * sigma(k));
    // Rounding errors must not make 0 degrees of freedom positive.
    const double whole = std::round(left);
    cost.degrees_of_freedom(k) = std::abs(left - whole) < 1e-9 ? whole : left;
  }
  return cost;
}

}  // namespace axiscal
