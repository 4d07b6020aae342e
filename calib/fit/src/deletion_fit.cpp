// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/deletion_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Cholesky>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/heavy_tails.hpp"
#include "axiscal/calib/joint_fit.hpp"
#include "axiscal/core/not_a_number.hpp"

namespace axiscal {

// The fit of the other readings.
struct DeletionFit::Others {
  Eigen::VectorXd variance;            // m
  Eigen::VectorXd degrees_of_freedom;  // m
  Eigen::MatrixXd covariance;          // of all coefficients and directions
  Eigen::VectorXd estimate;            // likewise, as change from the fit of all
};

DeletionFit::DeletionFit(const ReadingSet& set, const TableField& field, bool known_field)
    : set_(set), root_weights_(set.weights.cwiseSqrt()), own_(set.column_count()) {
  const JointState state = JointFit(set, set.weights).at(field);
  shared_ = known_field ? 0 : state.direction_count();
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const JointAxis& joint = state.axes[static_cast<std::size_t>(k)];
    Axis& axis = axes_.emplace_back();
    axis.J.resize(set.size(), own_ + shared_);
    axis.J << joint.root_weights.asDiagonal() * joint.X, joint.tangents.leftCols(shared_);
    axis.y = joint.residuals;
    axis.G = axis.J.transpose() * axis.J;
    axis.b = axis.J.transpose() * axis.y;
    axis.squares = axis.y.squaredNorm();
    axis.readings = static_cast<double>(joint.design->observations());
  }
}

std::vector<Eigen::Index> DeletionFit::places_of(Eigen::Index axis) const {
  std::vector<Eigen::Index> places(static_cast<std::size_t>(own_ + shared_));
  std::iota(places.begin(), places.begin() + own_, own_ * axis);
  std::iota(places.begin() + own_, places.end(), own_ * set_.axis_count());
  return places;
}

std::optional<DeletionFit::Others> DeletionFit::without(
    const std::vector<std::size_t>& readings) const {
  const Eigen::Index m = set_.axis_count();
  const Eigen::Index c = own_ * m + shared_;
  std::vector<Axis> left;
  for (const Axis& axis : axes_) {
    Axis& one = left.emplace_back(Axis{.J = {},
                                       .y = {},
                                       .G = axis.G,
                                       .b = axis.b,
                                       .squares = axis.squares,
                                       .readings = axis.readings});
    for (const std::size_t i : readings) {
      const auto row = static_cast<Eigen::Index>(i);
      const Eigen::RowVectorXd j = axis.J.row(row);
      one.G -= j.transpose() * j;
      one.b -= j.transpose() * axis.y(row);
      one.squares -= axis.y(row) * axis.y(row);
      one.readings -=
          set_.weights(row, static_cast<Eigen::Index>(left.size()) - 1) > 0.0 ? 1.0 : 0.0;
    }
  }
  Others others{.variance = Eigen::VectorXd(m), .degrees_of_freedom = Eigen::VectorXd(m)};
  for (Eigen::Index k = 0; k < m; ++k) {
    const Axis& axis = left[static_cast<std::size_t>(k)];
    others.variance(k) =
        std::max(axis.squares / std::max(axis.readings - 4.0, 1.0), std::pow(set_.rounding(k), 2));
  }
  constexpr int most_rounds = 100;
  constexpr double still = 1e-6;
  for (int round = 0; round < most_rounds; ++round) {
    Eigen::MatrixXd N = Eigen::MatrixXd::Zero(c, c);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(c);
    for (Eigen::Index k = 0; k < m; ++k) {
      const std::vector<Eigen::Index> at = places_of(k);
      N(at, at) += left[static_cast<std::size_t>(k)].G / others.variance(k);
      right(at) += left[static_cast<std::size_t>(k)].b / others.variance(k);
    }
    const Eigen::VectorXd scale = N.diagonal().cwiseSqrt().cwiseInverse();
    if (!scale.allFinite()) {
      return std::nullopt;
    }
    const Eigen::LLT<Eigen::MatrixXd> cholesky(scale.asDiagonal() * N * scale.asDiagonal());
    constexpr double open_below = 1e-11;
    if (cholesky.info() != Eigen::Success || !(cholesky.rcond() > open_below)) {
      return std::nullopt;
    }
    others.covariance = scale.asDiagonal() * cholesky.solve(Eigen::MatrixXd(scale.asDiagonal()));
    others.estimate = others.covariance * right;
    double change = 0.0;
    for (Eigen::Index k = 0; k < m; ++k) {
      const std::vector<Eigen::Index> at = places_of(k);
      const Axis& axis = left[static_cast<std::size_t>(k)];
      const Eigen::VectorXd z = others.estimate(at);
      const Eigen::MatrixXd C = others.covariance(at, at);
      others.degrees_of_freedom(k) =
          axis.readings - C.cwiseProduct(axis.G).sum() / others.variance(k);
      if (!(others.degrees_of_freedom(k) > 0.5)) {
        return std::nullopt;
      }
      const double squares = axis.squares - 2.0 * z.dot(axis.b) + z.dot(axis.G * z);
      const double next =
          std::max(squares / others.degrees_of_freedom(k), std::pow(set_.rounding(k), 2));
      change = std::max(change, std::abs(next / others.variance(k) - 1.0));
      others.variance(k) = next;
    }
    if (change < still) {
      break;
    }
  }
  return others;
}

struct DeletionFit::LeftOut {
  bool seen = true;               // whether the axis uses them all
  Eigen::VectorXd error;          // d: reading less prediction
  Eigen::VectorXd own;            // d: their own variances
  Eigen::MatrixXd of_prediction;  // d x d: the prediction's covariance
};

DeletionFit::LeftOut DeletionFit::left_out(const std::vector<std::size_t>& readings,
                                           const Others& others,
                                           Eigen::Index k) const {
  const Axis& axis = axes_[static_cast<std::size_t>(k)];
  const auto d = static_cast<Eigen::Index>(readings.size());
  Eigen::MatrixXd J(d, axis.J.cols());
  LeftOut left{.seen = true, .error = Eigen::VectorXd(d), .own = Eigen::VectorXd(d)};
  for (Eigen::Index i = 0; i < d; ++i) {
    const auto row = static_cast<Eigen::Index>(readings[static_cast<std::size_t>(i)]);
    const double root = root_weights_(row, k);
    left.seen = left.seen && root > 0.0;
    J.row(i) = axis.J.row(row) / root;
    left.error(i) = axis.y(row) / root;
    left.own(i) = others.variance(k) / (root * root);
  }
  const std::vector<Eigen::Index> at = places_of(k);
  left.error -= J * others.estimate(at);
  left.of_prediction = J * others.covariance(at, at) * J.transpose();
  return left;
}

std::optional<double> DeletionFit::p_value(const std::vector<std::size_t>& readings,
                                           const Eigen::MatrixXd& contrasts) const {
  const std::optional<Others> others = without(readings);
  if (!others) {
    return std::nullopt;
  }
  const auto q = static_cast<double>(contrasts.rows());
  double sum = 0.0;
  double axes = 0.0;
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    const LeftOut left = left_out(readings, *others, k);
    if (!left.seen) {
      continue;
    }
    const Eigen::VectorXd e = contrasts * left.error;
    const Eigen::MatrixXd V = contrasts *
                              (Eigen::MatrixXd(left.own.asDiagonal()) + left.of_prediction) *
                              contrasts.transpose();
    const double f = std::max(e.dot(V.ldlt().solve(e)) / q, 1e-12);
    sum -= 2.0 * std::log(std::max(f_upper_p(f, q, others->degrees_of_freedom(k)), 1e-300));
    axes += 1.0;
  }
  return axes > 0.0 ? std::optional(chi_squared_upper_p(std::max(sum, 1e-12), 2.0 * axes))
                    : std::nullopt;
}

std::optional<double> DeletionFit::p_value_by_tails(const std::vector<std::size_t>& readings,
                                                    const Eigen::MatrixXd& contrasts) const {
  const std::optional<Others> others = without(readings);
  if (!others) {
    return std::nullopt;
  }
  NoiseTails tails;
  std::vector<double> deviations;  // of the contrasts, square to each other, of variance 1
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    const LeftOut own = left_out(readings, *others, k);
    if (!own.seen) {
      continue;
    }
    const Eigen::LLT<Eigen::MatrixXd> root(
        contrasts * (Eigen::MatrixXd(own.own.asDiagonal()) + own.of_prediction) *
        contrasts.transpose());
    const Eigen::VectorXd whitened = root.matrixL().solve(contrasts * own.error);
    deviations.insert(deviations.end(), whitened.begin(), whitened.end());
    const Axis& axis = axes_[static_cast<std::size_t>(k)];
    const std::vector<Eigen::Index> at = places_of(k);
    const Eigen::VectorXd left = axis.y - axis.J * others->estimate(at);
    const Eigen::MatrixXd C = others->covariance(at, at) / others->variance(k);
    const Eigen::VectorXd free = 1.0 - (axis.J * C).cwiseProduct(axis.J).rowwise().sum().array();
    for (Eigen::Index i = 0; i < left.size(); ++i) {
      constexpr double least_left = 1e-6;
      const bool is_other = std::find(readings.begin(), readings.end(),
                                      static_cast<std::size_t>(i)) == readings.end();
      if (is_other && root_weights_(i, k) > 0.0) {
        tails.add(left(i) / std::sqrt(others->variance(k) * std::max(free(i), least_left)));
      }
    }
  }
  if (deviations.empty()) {
    return std::nullopt;
  }
  double p = 0.0;
  const auto weights = tails.weights();
  for (std::size_t v = 0; v < weights.size(); ++v) {
    double sum = 0.0;
    for (const double t : deviations) {
      sum -=
          2.0 * std::log(std::max(NoiseTails::two_sided_p_of(NoiseTails::freedoms[v], t), 1e-300));
    }
    p += weights[v] *
         chi_squared_upper_p(std::max(sum, 1e-12), 2.0 * static_cast<double>(deviations.size()));
  }
  return p;
}

std::optional<std::vector<DeletionFit::Prediction>> DeletionFit::predictions(
    const std::vector<std::size_t>& readings) const {
  const std::optional<Others> others = without(readings);
  if (!others) {
    return std::nullopt;
  }
  const Eigen::Index m = set_.axis_count();
  std::vector<Prediction> all;
  for (const std::size_t reading : readings) {
    Prediction& one =
        all.emplace_back(Prediction{.error = Eigen::VectorXd::Constant(m, not_a_number),
                                    .sd = Eigen::VectorXd::Constant(m, not_a_number),
                                    .degrees_of_freedom = others->degrees_of_freedom});
    for (Eigen::Index k = 0; k < m; ++k) {
      if (root_weights_(static_cast<Eigen::Index>(reading), k) > 0.0) {
        const LeftOut left = left_out({reading}, *others, k);
        one.error(k) = left.error(0);
        one.sd(k) = std::sqrt(left.own(0) + left.of_prediction(0, 0));
      }
    }
  }
  return all;
}

}  // namespace axiscal
