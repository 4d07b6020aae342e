// SPDX-License-Identifier: Apache-2.0
#include "culprit_fit.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "axiscal/calib/minimum_norm.hpp"
#include "axiscal/calib/response_system.hpp"
#include "axiscal/calib/scaled_qr.hpp"

namespace axiscal {
namespace {

// Rounds until the fields stay; a mistake of one radian takes some more.
constexpr int most_rounds = 30;

// The main axis alone, and no scale: [P]'s linear form.
void start_temperature(ReadingSet& set) {
  set.temperature.scale.setZero(set.axis_count(), set.temperature.order);
  set.temperature.along = SensitivityMatrix::Zero(set.axis_count(), 3);
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const std::optional<int>& nominal = set.nominal[static_cast<std::size_t>(k)];
    set.temperature.along(k, nominal.value_or(static_cast<int>(k % 3))) = 1.0;
  }
}

// Takes what the columns d^j (S f) found into the scales.
// @return the change of the scale over the run's temperatures.
double fold_scales(Eigen::MatrixXd& coefficients, ReadingSet& set) {
  const int order = set.temperature.order;
  const double span = set.temperature.d.cwiseAbs().maxCoeff();
  double change = 0.0;
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const Eigen::RowVector3d S = coefficients.col(k).segment<3>(1).transpose();
    const auto along = set.temperature.along.row(k);
    const double unit = along.dot(S) / along.squaredNorm();
    if (unit == 0.0) {
      continue;
    }
    const Eigen::RowVectorXd found = coefficients.col(k).tail(order).transpose() / unit;
    for (int j = 0; j < order; ++j) {
      change = std::max(change, std::abs(found(j)) * std::pow(span, j + 1));
    }
    set.temperature.scale.row(k) += found;
    set.temperature.along.row(k) = S;
    coefficients.col(k).tail(order).setZero();
  }
  return change;
}

// Moves the fields by a step of their directions, cut to what a linear step is good for.
// @return the largest turn [rad].
double turn_fields(const std::vector<TableField::Tangents>& tangents,
                   Eigen::VectorXd turn,
                   TableField& field) {
  double turned = 0.0;
  Eigen::Index first = 0;
  for (const TableField::Tangents& of_field : tangents) {
    constexpr double longest_step_rad = 0.5;
    auto part = turn.segment(first, of_field.cols());
    part *= std::min(1.0, longest_step_rad / std::max(part.norm(), 1e-300));
    turned = std::max(turned, part.norm());
    first += of_field.cols();
  }
  field = field.moved(tangents, turn);
  return turned;
}

}  // namespace

// In the axes' scale; n x m.
Eigen::MatrixXd HypothesisFitter::roots_of_weights(const ReadingSet& set,
                                                   const std::vector<std::size_t>& without) const {
  Eigen::MatrixXd root = set.weights.cwiseSqrt();
  root.array().rowwise() /= scale_.transpose().array();
  for (const std::size_t i : without) {
    root.row(static_cast<Eigen::Index>(i)).setZero();
  }
  return root;
}

HypothesisFitter HypothesisFitter::by_scatter_of(const HypothesisFit& fit) const {
  const Eigen::VectorXd own =
      scale_.array() * (fit.rss.array() / fit.degrees_of_freedom.array().max(0.5)).sqrt();
  return {fit.field, known_field_, own};
}

HypothesisFit HypothesisFitter::again(const ReadingSet& set,
                                      const HypothesisFit& fit,
                                      const HypothesisFitter& whose) const {
  if (!known_field_) {
    return this->fit(set);
  }
  // Axes that share no direction do not weigh on each other.
  HypothesisFit scaled = fit;
  for (Eigen::Index k = 0; k < scale_.size(); ++k) {
    const double factor = whose.scale_(k) / scale_(k);
    scaled.residuals.col(k) *= factor;
    scaled.rss(k) *= factor * factor;
  }
  return scaled;
}

// What is said of a fit that has settled.
// @param A, inverse  the weighted system, and the root of its covariance.
// @param added       what the added columns came to.
void HypothesisFitter::describe(const ReadingSet& set,
                                const Eigen::MatrixXd& root,
                                const Eigen::MatrixXd& A,
                                const Eigen::MatrixXd& inverse,
                                const Eigen::VectorXd& added,
                                HypothesisFit& result) const {
  const Eigen::Index n = set.size();
  const Eigen::Index m = set.axis_count();
  result.fitted = true;
  result.added = added;
  result.information.resize(added.size());
  for (Eigen::Index j = 0; j < added.size(); ++j) {
    result.information(j) = 1.0 / inverse.row(inverse.rows() - added.size() + j).squaredNorm();
  }
  result.rss.resize(m);
  result.degrees_of_freedom.resize(m);
  result.basis = A * inverse;
  for (Eigen::Index k = 0; k < m; ++k) {
    const auto used = static_cast<double>((root.col(k).array() > 0.0).count());
    const double least = std::pow(set.rounding(k) / scale_(k), 2);
    result.degrees_of_freedom(k) = used - result.basis.middleRows(n * k, n).squaredNorm();
    result.rss(k) = std::max(result.residuals.col(k).squaredNorm(),
                             least * std::max(result.degrees_of_freedom(k), 0.0));
  }
}

HypothesisFit HypothesisFitter::fit(const ReadingSet& given,
                                    const std::vector<std::size_t>& without,
                                    const AddedColumns& added) const {
  // What a mistake made of the temperature terms must not stay in them.
  std::optional<ReadingSet> over_temperature;
  if (given.temperature.order > 0) {
    over_temperature = given;
    start_temperature(*over_temperature);
  }
  const ReadingSet& set = over_temperature ? *over_temperature : given;
  const Eigen::Index n = set.size();
  const Eigen::Index m = set.axis_count();
  const Eigen::Index p = set.column_count();
  const Eigen::MatrixXd root = roots_of_weights(set, without);
  HypothesisFit result;
  result.field = field_;
  result.coefficients = Eigen::MatrixXd::Zero(p, m);
  const bool free_field = !known_field_;
  Eigen::MatrixXd A;
  Eigen::VectorXd zeta;
  Eigen::MatrixXd inverse;
  double previous = -1.0;
  bool has_coefficients = known_field_ && !added;  // then the one step is exact from anywhere
  for (int round = 0; round < most_rounds; ++round) {
    const Eigen::MatrixXd base = field_design(set, result.field);
    std::vector<Eigen::MatrixXd> X;
    std::vector<Eigen::MatrixXd> own;
    for (Eigen::Index k = 0; k < m; ++k) {
      const auto w = root.col(k);
      X.push_back(set.all_columns(base, k));
      own.emplace_back(w.asDiagonal() * X.back());
      if (!has_coefficients) {
        result.coefficients.col(k) =
            minimum_norm_solution(own.back(), w.cwiseProduct(set.response.col(k)));
      }
    }
    has_coefficients = true;
    const Eigen::MatrixXd Z =
        added ? added(result.field, result.coefficients) : Eigen::MatrixXd(n * m, 0);
    const Eigen::Index q = Z.cols();
    const std::vector<TableField::Tangents> tangents = result.field.tangents();
    const FieldChanges changes =
        free_field ? changes_with_directions(set, result.field, tangents)
                   : FieldChanges(static_cast<std::size_t>(n), Eigen::Matrix3Xd(3, 0));
    const Eigen::Index D = changes.front().cols();
    std::vector<Eigen::MatrixXd> shared;
    Eigen::VectorXd b(n * m);
    for (Eigen::Index k = 0; k < m; ++k) {
      const auto w = root.col(k);
      const Eigen::VectorXd of_axis = result.coefficients.col(k);
      Eigen::MatrixXd& columns = shared.emplace_back(n, D + q);
      columns << response_changes(set, k, of_axis.segment<3>(1).transpose(), changes),
          Z.middleRows(n * k, n);
      columns = w.asDiagonal() * columns;
      b.segment(n * k, n) =
          w.cwiseProduct(set.response.col(k) - X[static_cast<std::size_t>(k)] * of_axis);
    }
    A = stacked_by_axis(own, shared);
    constexpr double open_below = 1e-7;
    const ScaledQr qr(A, open_below);
    if (!qr.has_full_rank()) {
      return result;  // not determined
    }
    const Eigen::VectorXd step = qr.solve(b);
    const Eigen::VectorXd left = b - A * step;
    result.coefficients += step.head(p * m).reshaped(p, m);
    double turned = 0.0;
    if (free_field) {
      turned = turn_fields(tangents, step.segment(p * m, D), result.field);
    }
    // Coefficients follow the fields exactly; a linear step for both would go astray far from them.
    has_coefficients = turned < 0.02;
    if (over_temperature) {
      turned = std::max(turned, fold_scales(result.coefficients, *over_temperature));
    }
    zeta = step.tail(q);
    result.residuals = left.reshaped(n, m);
    const double now = left.squaredNorm();
    const bool still = turned < 1e-9 || (round > 2 && std::abs(now - previous) <= 1e-10 * now);
    previous = now;
    if (still) {
      inverse = qr.root_of_covariance();
      break;
    }
    if (round + 1 == most_rounds) {
      return result;  // does not settle
    }
  }
  describe(set, root, A, inverse, zeta, result);
  return result;
}

}  // namespace axiscal
