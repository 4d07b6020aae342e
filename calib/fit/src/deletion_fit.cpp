// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/deletion_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/heavy_tails.hpp"
#include "axiscal/calib/shared_fit.hpp"
#include "axiscal/core/not_a_number.hpp"

namespace axiscal {

// K = (1 - Q Q^T)^-1, which takes what the fit of all leaves of d readings to what the others' fit
// does: by itself where they are fewer than the p columns, else by M = (1 - Q^T Q)^-1.
class DeletionFit::Own {
 public:
  // @param Q  d x p: basis of an axis's own columns at the readings.
  // @return nothing where the others do not determine what goes with the columns.
  static std::optional<Own> of(Eigen::MatrixXd Q) {
    Own own;
    const bool few = Q.rows() > 0 && Q.rows() < Q.cols();
    const Eigen::Index size = few ? Q.rows() : Q.cols();
    const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(size, size);
    const Eigen::LLT<Eigen::MatrixXd> cholesky(
        few ? Eigen::MatrixXd(identity - Q.lazyProduct(Q.transpose()))
            : Eigen::MatrixXd(identity - Q.transpose() * Q));
    if (cholesky.info() != Eigen::Success ||
        !(cholesky.matrixLLT().diagonal().array().square() > open_below).all()) {
      return std::nullopt;
    }
    (few ? own.K_ : own.M_) = cholesky.solve(identity);
    own.Q_ = std::move(Q);
    return own;
  }

  [[nodiscard]] const Eigen::MatrixXd& Q() const { return Q_; }

  // K B.
  [[nodiscard]] Eigen::MatrixXd times(const Eigen::Ref<const Eigen::MatrixXd>& B) const {
    if (K_.size() > 0) {
      return K_.lazyProduct(B);
    }
    return B + Q_ * (M_ * (Q_.transpose() * B));
  }

  [[nodiscard]] Eigen::VectorXd diagonal() const {
    return K_.size() > 0
               ? Eigen::VectorXd(K_.diagonal())
               : Eigen::VectorXd(1.0 + (Q_ * M_).cwiseProduct(Q_).rowwise().sum().array());
  }

  [[nodiscard]] Eigen::MatrixXd M() const {
    return K_.size() > 0 ? Eigen::MatrixXd(Eigen::MatrixXd::Identity(Q_.cols(), Q_.cols()) +
                                           Q_.transpose() * K_ * Q_)
                         : M_;
  }

  static constexpr double open_below = 1e-11;

 private:
  Eigen::MatrixXd Q_;
  Eigen::MatrixXd K_;  // one of the two
  Eigen::MatrixXd M_;
};

// The fit of the other readings, by what it leaves of those that are left out.
struct DeletionFit::Others {
  // Axes of one design.
  struct Alike {
    [[nodiscard]] bool has(Eigen::Index k) const { return k >= first && k < first + count; }

    // An axis's columns of those below.
    template <typename Matrix>
    [[nodiscard]] auto of_axis(const Matrix& columns, Eigen::Index k) const {
      const Eigen::Index each = columns.cols() / count;
      return columns.middleCols(each * (k - first), each);
    }

    Own own;
    Eigen::Index first = 0;
    Eigen::Index count = 0;
    // Of each axis the errors of the d readings, by the others' coefficients where nothing is
    // shared, and how they change with what is: d x count (1 + D).
    Eigen::MatrixXd errors;
  };

  [[nodiscard]] const Alike& alike(Eigen::Index k) const {
    return *std::find_if(all.begin(), all.end(), [&](const Alike& one) { return one.has(k); });
  }

  // How an axis's readings change with what is shared; d x D.
  [[nodiscard]] auto shared(Eigen::Index k) const {
    const Alike& one = alike(k);
    return one.of_axis(one.errors, k).rightCols(fit.estimate.size());
  }

  // Of an axis's readings: their errors by the others' fit.
  [[nodiscard]] Eigen::VectorXd errors(Eigen::Index k) const {
    const Alike& one = alike(k);
    return one.of_axis(one.errors, k).col(0) - shared(k) * fit.estimate;
  }

  std::vector<Alike> all;
  SharedFit fit;
};

DeletionFit::DeletionFit(const ReadingSet& set, const TableField& field, bool known_field)
    : DeletionFit(set, StateOfRun(set, known_field).at(field)) {}

DeletionFit::DeletionFit(const ReadingSet& set, std::shared_ptr<const JointState> state)
    : set_(set), state_(std::move(state)), smallest_(set.axis_count()) {
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    smallest_(k) = std::pow(set.rounding(k), 2);
  }
}

std::optional<DeletionFit::Others> DeletionFit::without(
    const std::vector<std::size_t>& readings) const {
  const Eigen::Index m = set_.axis_count();
  const Eigen::Index D = state_->direction_count();
  const auto d = static_cast<Eigen::Index>(readings.size());
  Others others;
  std::vector<ResponseSums> responses;
  responses.reserve(static_cast<std::size_t>(m));
  Eigen::VectorXd start(m);
  Eigen::VectorXd all = Eigen::VectorXd::Zero(D);   // squares of the shared columns
  Eigen::VectorXd left = Eigen::VectorXd::Zero(D);  // and of what is left of them
  for (Eigen::Index first = 0; first < m;) {
    Eigen::Index end = first + 1;
    while (end < m && axis_of(end).design == axis_of(first).design) {
      ++end;
    }
    std::optional<Own> own = Own::of(axis_of(first).design->basis()(readings, Eigen::all));
    if (!own) {
      return std::nullopt;
    }
    Eigen::MatrixXd gone(d, (end - first) * (1 + D));
    for (Eigen::Index k = first; k < end; ++k) {
      auto of_axis = gone.middleCols((1 + D) * (k - first), 1 + D);
      for (Eigen::Index i = 0; i < d; ++i) {
        const auto row = static_cast<Eigen::Index>(readings[static_cast<std::size_t>(i)]);
        of_axis(i, 0) = axis_of(k).residuals(row);
        of_axis.row(i).tail(D) = axis_of(k).projected.row(row);
      }
    }
    Eigen::MatrixXd errors = own->times(gone);
    const Others::Alike& one = others.all.emplace_back(Others::Alike{
        .own = *std::move(own), .first = first, .count = end - first, .errors = std::move(errors)});
    for (Eigen::Index k = first; k < end; ++k) {
      const JointAxis& axis = axis_of(k);
      const Eigen::MatrixXd products =
          one.of_axis(gone, k).transpose().lazyProduct(one.of_axis(one.errors, k));
      ResponseSums& response = responses.emplace_back(axis.sums);
      response.information -= products.bottomRightCorner(D, D);
      response.gradient -= products.bottomLeftCorner(D, 1);
      response.squares = std::max(response.squares - products(0, 0), 0.0);
      for (const std::size_t i : readings) {
        response.degrees_of_freedom -=
            axis.root_weights()(static_cast<Eigen::Index>(i)) > 0.0 ? 1.0 : 0.0;
      }
      start(k) = std::max(response.squares / std::max(response.degrees_of_freedom, 1.0),
                          std::max(smallest_(k), std::numeric_limits<double>::min()));
      all += axis.tangent_squares / start(k);
      for (const std::size_t i : readings) {
        all -= axis.tangents.row(static_cast<Eigen::Index>(i)).cwiseAbs2().transpose() / start(k);
      }
      left += response.information.diagonal() / start(k);
    }
    first = end;
  }
  if (!(left.array() > Own::open_below * all.array()).all()) {
    return std::nullopt;
  }
  std::optional<SharedFit> shared = fit_shared(responses, start, smallest_);
  constexpr double fewest = 0.5;
  if (!shared || !(shared->degrees_of_freedom.minCoeff() > fewest)) {
    return std::nullopt;
  }
  others.fit = *std::move(shared);
  return others;
}

struct DeletionFit::LeftOut {
  bool seen = true;            // whether the axis uses all the readings
  Eigen::VectorXd error;       // q: contrast less prediction
  Eigen::MatrixXd covariance;  // q x q: the readings' own and the prediction's

  // In units of it.
  [[nodiscard]] double squares() const {
    if (error.size() > 1) {
      return error.dot(covariance.ldlt().solve(error));
    }
    return covariance(0, 0) > 0.0 ? error(0) * error(0) / covariance(0, 0) : 0.0;  // as of a solve
  }
};

std::vector<DeletionFit::LeftOut> DeletionFit::left_out(const std::vector<std::size_t>& readings,
                                                        const Eigen::MatrixXd& contrasts,
                                                        const Others& others) const {
  std::vector<LeftOut> all;
  all.reserve(static_cast<std::size_t>(set_.axis_count()));
  for (const Others::Alike& one : others.all) {
    const Eigen::VectorXd root = axis_of(one.first).root_weights()(readings);
    if (!(root.array() > 0.0).all()) {
      all.resize(all.size() + static_cast<std::size_t>(one.count), LeftOut{.seen = false});
      continue;
    }
    const Eigen::MatrixXd C = contrasts * root.cwiseInverse().asDiagonal();
    const Eigen::MatrixXd unscaled = C.lazyProduct(one.own.times(C.transpose()));  // by their own
    const Eigen::MatrixXd errors = C.lazyProduct(one.errors);
    for (Eigen::Index k = one.first; one.has(k); ++k) {
      const auto of_axis = one.of_axis(errors, k);
      const auto shared = of_axis.rightCols(others.fit.estimate.size());
      LeftOut& left = all.emplace_back();
      left.error = of_axis.col(0) - shared * others.fit.estimate;
      left.covariance = others.fit.variance(k) * unscaled;
      left.covariance += shared.lazyProduct(others.fit.covariance.lazyProduct(shared.transpose()));
    }
  }
  return all;
}

std::optional<double> DeletionFit::p_value(const std::vector<std::size_t>& readings,
                                           const Eigen::MatrixXd& contrasts) const {
  const std::optional<Others> others = without(readings);
  if (!others) {
    return std::nullopt;
  }
  const auto q = static_cast<double>(contrasts.rows());
  FisherSum axes;
  Eigen::Index k = 0;
  for (const LeftOut& left : left_out(readings, contrasts, *others)) {
    if (left.seen) {
      const double f = std::max(left.squares() / q, 1e-12);
      axes.add(f_upper_p(f, q, others->fit.degrees_of_freedom(k)));
    }
    ++k;
  }
  return axes.count() > 0.0 ? std::optional(axes.p_value()) : std::nullopt;
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
  const std::vector<LeftOut> of_axes = left_out(readings, contrasts, *others);
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    const LeftOut& left_of_all = of_axes[static_cast<std::size_t>(k)];
    if (!left_of_all.seen) {
      continue;
    }
    const Eigen::LLT<Eigen::MatrixXd> root(left_of_all.covariance);
    const Eigen::VectorXd whitened = root.matrixL().solve(left_of_all.error);
    deviations.insert(deviations.end(), whitened.begin(), whitened.end());
    // What the others' fit leaves of themselves, and the variance of what it says of them.
    const JointAxis& axis = axis_of(k);
    const Own& own = others->alike(k).own;
    const double variance = others->fit.variance(k);
    const Eigen::MatrixXd& Q = axis.design->basis();
    const Eigen::VectorXd left = axis.residuals - axis.projected * others->fit.estimate +
                                 Q * (own.Q().transpose() * others->errors(k));
    const Eigen::MatrixXd P = axis.projected + Q * (own.Q().transpose() * others->shared(k));
    const Eigen::VectorXd of_own = (Q * own.M()).cwiseProduct(Q).rowwise().sum();
    const Eigen::VectorXd of_shared =
        (P * others->fit.covariance).cwiseProduct(P).rowwise().sum() / variance;
    const Eigen::VectorXd free = 1.0 - (of_own + of_shared).array();
    for (Eigen::Index i = 0; i < left.size(); ++i) {
      constexpr double least_left = 1e-6;
      if (is_other[static_cast<std::size_t>(i)] && axis.root_weights()(i) > 0.0) {
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
    FisherSum all;
    for (const double t : deviations) {
      all.add(NoiseTails::two_sided_p_of(NoiseTails::freedoms[v], t));
    }
    p += weights[v] * all.p_value();
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
  std::vector<Prediction> all(readings.size(),
                              Prediction{.error = Eigen::VectorXd::Constant(m, not_a_number),
                                         .sd = Eigen::VectorXd::Constant(m, not_a_number),
                                         .degrees_of_freedom = others->fit.degrees_of_freedom});
  for (Eigen::Index k = 0; k < m; ++k) {
    const Eigen::VectorXd errors = others->errors(k);
    const Eigen::MatrixXd shared = others->shared(k);
    const Eigen::VectorXd variances =
        others->fit.variance(k) * others->alike(k).own.diagonal() +
        (shared * others->fit.covariance).cwiseProduct(shared).rowwise().sum();
    for (std::size_t i = 0; i < readings.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const double root = axis_of(k).root_weights()(static_cast<Eigen::Index>(readings[i]));
      if (root > 0.0) {
        all[i].error(k) = errors(row) / root;
        all[i].sd(k) = std::sqrt(variances(row)) / root;
      }
    }
  }
  return all;
}

}  // namespace axiscal
