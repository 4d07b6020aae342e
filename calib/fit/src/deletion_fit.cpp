// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/deletion_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/heavy_tails.hpp"
#include "axiscal/calib/linearised_run.hpp"
#include "axiscal/calib/scaled_cholesky.hpp"
#include "axiscal/calib/shared_fit.hpp"
#include "axiscal/core/not_a_number.hpp"

namespace axiscal {

// The fit of the other readings, as change from the fit of all.
struct DeletionFit::Others {
  // An axis's own coefficients at a step z of the shared: own - take_up z.
  struct Axis {
    Eigen::VectorXd own;
    Eigen::MatrixXd inverse;  // of its own J^T J
    Eigen::MatrixXd take_up;  // p x D

    // What is left of rows of J once the shared have changed, in what is shared.
    [[nodiscard]] Eigen::MatrixXd projected(const Eigen::MatrixXd& J) const {
      return J.rightCols(take_up.cols()) - J.leftCols(own.size()) * take_up;
    }
  };

  // What they say of rows of an axis's J.
  [[nodiscard]] Eigen::VectorXd predicted(Eigen::Index k, const Eigen::MatrixXd& J) const {
    const Axis& axis = axes[static_cast<std::size_t>(k)];
    return J.leftCols(axis.own.size()) * axis.own + axis.projected(J) * shared.estimate;
  }

  // Its covariance.
  [[nodiscard]] Eigen::MatrixXd covariance(Eigen::Index k, const Eigen::MatrixXd& J) const {
    const Axis& axis = axes[static_cast<std::size_t>(k)];
    const auto own = J.leftCols(axis.own.size());
    const Eigen::MatrixXd P = axis.projected(J);
    return shared.variance(k) * (own * axis.inverse * own.transpose()) +
           P * shared.covariance * P.transpose();
  }

  [[nodiscard]] Eigen::VectorXd variances(Eigen::Index k, const Eigen::MatrixXd& J) const {
    const Axis& axis = axes[static_cast<std::size_t>(k)];
    const auto own = J.leftCols(axis.own.size());
    const Eigen::MatrixXd P = axis.projected(J);
    return shared.variance(k) * (own * axis.inverse).cwiseProduct(own).rowwise().sum() +
           (P * shared.covariance).cwiseProduct(P).rowwise().sum();
  }

  std::vector<Axis> axes;
  SharedFit shared;
};

DeletionFit::DeletionFit(const ReadingSet& set, const TableField& field, bool known_field)
    : set_(set),
      root_weights_(set.weights.cwiseSqrt()),
      smallest_(set.axis_count()),
      own_(set.column_count()) {
  const LinearisedRun run(set, field, Eigen::VectorXd::Ones(set.axis_count()), known_field);
  shared_ = run.shared();
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    smallest_(k) = std::pow(set.rounding(k), 2);
    Axis& axis = axes_.emplace_back();
    axis.J.resize(set.size(), own_ + shared_);
    axis.J << run.columns()(run.rows_of_axis(k), Eigen::seqN(run.column_of(k, 0), own_)),
        run.columns()(run.rows_of_axis(k), Eigen::lastN(shared_));
    axis.y = run.residuals()(run.rows_of_axis(k));
    axis.sums = {.G = axis.J.transpose() * axis.J,
                 .b = axis.J.transpose() * axis.y,
                 .squares = axis.y.squaredNorm(),
                 .readings = static_cast<double>((root_weights_.col(k).array() > 0.0).count())};
  }
}

DeletionFit::Sums DeletionFit::sums_without(const std::vector<std::size_t>& readings,
                                            Eigen::Index k) const {
  const Axis& axis = axes_[static_cast<std::size_t>(k)];
  Sums left = axis.sums;
  for (const std::size_t i : readings) {
    const auto row = static_cast<Eigen::Index>(i);
    const auto j = axis.J.row(row);
    left.G.noalias() -= j.transpose().lazyProduct(j);
    left.b.noalias() -= j.transpose() * axis.y(row);
    left.squares -= axis.y(row) * axis.y(row);
    left.readings -= root_weights_(row, k) > 0.0 ? 1.0 : 0.0;
  }
  return left;
}

std::optional<DeletionFit::Others> DeletionFit::without(
    const std::vector<std::size_t>& readings) const {
  const Eigen::Index m = set_.axis_count();
  constexpr double open_below = 1e-11;
  Others others;
  std::vector<ResponseSums> responses;
  Eigen::VectorXd start(m);
  Eigen::VectorXd all = Eigen::VectorXd::Zero(shared_);   // squares of the shared columns
  Eigen::VectorXd left = Eigen::VectorXd::Zero(shared_);  // and of what is left of them
  for (Eigen::Index k = 0; k < m; ++k) {
    const Sums sums = sums_without(readings, k);
    const ScaledCholesky own(sums.G.topLeftCorner(own_, own_));
    if (!own.is_determined(open_below)) {
      return std::nullopt;
    }
    const Eigen::MatrixXd with_shared = sums.G.topRightCorner(own_, shared_);
    const Eigen::VectorXd b = sums.b.head(own_);
    Others::Axis& axis = others.axes.emplace_back();
    axis.inverse = own.inverse();
    axis.own = axis.inverse * b;
    axis.take_up = axis.inverse * with_shared;
    const ResponseSums& response = responses.emplace_back(ResponseSums{
        .information =
            sums.G.bottomRightCorner(shared_, shared_) - with_shared.transpose() * axis.take_up,
        .gradient = sums.b.tail(shared_) - axis.take_up.transpose() * b,
        .squares = std::max(sums.squares - b.dot(axis.own), 0.0),
        .degrees_of_freedom = sums.readings - static_cast<double>(own_)});
    start(k) = std::max(response.squares / std::max(response.degrees_of_freedom, 1.0),
                        std::max(smallest_(k), std::numeric_limits<double>::min()));
    all += sums.G.diagonal().tail(shared_) / start(k);
    left += response.information.diagonal() / start(k);
  }
  if (!(left.array() > open_below * all.array()).all()) {
    return std::nullopt;
  }
  std::optional<SharedFit> shared = fit_shared(responses, start, smallest_);
  constexpr double fewest = 0.5;
  if (!shared || !(shared->degrees_of_freedom.minCoeff() > fewest)) {
    return std::nullopt;
  }
  others.shared = *std::move(shared);
  return others;
}

struct DeletionFit::LeftOut {
  bool seen = true;            // whether the axis uses all the readings
  Eigen::VectorXd error;       // q: contrast less prediction
  Eigen::MatrixXd covariance;  // q x q: the readings' own and the prediction's
};

DeletionFit::LeftOut DeletionFit::left_out(const std::vector<std::size_t>& readings,
                                           const Eigen::MatrixXd& contrasts,
                                           const Others& others,
                                           Eigen::Index k) const {
  const Axis& axis = axes_[static_cast<std::size_t>(k)];
  const auto d = static_cast<Eigen::Index>(readings.size());
  Eigen::MatrixXd J(d, axis.J.cols());
  Eigen::VectorXd y(d);
  Eigen::VectorXd own(d);
  LeftOut left;
  for (Eigen::Index i = 0; i < d; ++i) {
    const auto row = static_cast<Eigen::Index>(readings[static_cast<std::size_t>(i)]);
    const double root = root_weights_(row, k);
    left.seen = left.seen && root > 0.0;
    J.row(i) = axis.J.row(row) / root;
    y(i) = axis.y(row) / root;
    own(i) = others.shared.variance(k) / (root * root);
  }
  const Eigen::MatrixXd seen = contrasts * J;
  left.error = contrasts * y - others.predicted(k, seen);
  left.covariance = contrasts * own.asDiagonal() * contrasts.transpose();
  left.covariance += others.covariance(k, seen);
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
    const LeftOut left = left_out(readings, contrasts, *others, k);
    if (!left.seen) {
      continue;
    }
    const double f = std::max(left.error.dot(left.covariance.ldlt().solve(left.error)) / q, 1e-12);
    sum -= 2.0 * std::log(std::max(f_upper_p(f, q, others->shared.degrees_of_freedom(k)), 1e-300));
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
  std::vector<bool> is_other(set_.readings.size(), true);
  for (const std::size_t i : readings) {
    is_other[i] = false;
  }
  NoiseTails tails;
  std::vector<double> deviations;  // of the contrasts, square to each other, of variance 1
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    const LeftOut own = left_out(readings, contrasts, *others, k);
    if (!own.seen) {
      continue;
    }
    const Eigen::LLT<Eigen::MatrixXd> root(own.covariance);
    const Eigen::VectorXd whitened = root.matrixL().solve(own.error);
    deviations.insert(deviations.end(), whitened.begin(), whitened.end());
    const Axis& axis = axes_[static_cast<std::size_t>(k)];
    const double variance = others->shared.variance(k);
    const Eigen::VectorXd left = axis.y - others->predicted(k, axis.J);
    const Eigen::VectorXd free = 1.0 - others->variances(k, axis.J).array() / variance;
    for (Eigen::Index i = 0; i < left.size(); ++i) {
      constexpr double least_left = 1e-6;
      if (is_other[static_cast<std::size_t>(i)] && root_weights_(i, k) > 0.0) {
        tails.add(left(i) / std::sqrt(variance * std::max(free(i), least_left)));
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
                                    .degrees_of_freedom = others->shared.degrees_of_freedom});
    for (Eigen::Index k = 0; k < m; ++k) {
      if (root_weights_(static_cast<Eigen::Index>(reading), k) > 0.0) {
        const LeftOut left = left_out({reading}, Eigen::MatrixXd::Ones(1, 1), *others, k);
        one.error(k) = left.error(0);
        one.sd(k) = std::sqrt(left.covariance(0, 0));
      }
    }
  }
  return all;
}

}  // namespace axiscal
