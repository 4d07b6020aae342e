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
  struct Axis {
    std::size_t own = 0;     // which of those
    Eigen::VectorXd error;   // d: of the readings, by others' coefficients where nothing is shared
    Eigen::MatrixXd shared;  // d x D: the same of what is shared
  };

  // Of an axis's readings: their errors by the others' fit.
  [[nodiscard]] Eigen::VectorXd errors(Eigen::Index k) const {
    const Axis& axis = axes[static_cast<std::size_t>(k)];
    return axis.shared.cols() > 0 ? axis.error - axis.shared * fit.estimate : axis.error;
  }

  [[nodiscard]] const Own& own_of(Eigen::Index k) const {
    return owns[axes[static_cast<std::size_t>(k)].own];
  }

  std::vector<Own> owns;  // axes of one design share them
  std::vector<Axis> axes;
  SharedFit fit;
};

DeletionFit::DeletionFit(const ReadingSet& set, const TableField& field, bool known_field)
    : DeletionFit(set, StateOfRun(set, known_field).at(field)) {}

DeletionFit::DeletionFit(const ReadingSet& set, std::shared_ptr<const JointState> state)
    : set_(set), state_(std::move(state)), smallest_(set.axis_count()) {
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    smallest_(k) = std::pow(set.rounding(k), 2);
    const JointAxis& axis = axis_of(k);
    sums_.push_back(
        {.information = axis.projected.transpose() * axis.projected,
         .gradient = axis.projected.transpose() * axis.residuals,
         .squares = axis.residuals.squaredNorm(),
         .degrees_of_freedom = static_cast<double>(axis.design->observations() - axis.X().cols())});
  }
}

std::optional<DeletionFit::Others> DeletionFit::without(
    const std::vector<std::size_t>& readings) const {
  const Eigen::Index m = set_.axis_count();
  const Eigen::Index D = state_->direction_count();
  Others others;
  others.axes.reserve(sums_.size());
  std::vector<ResponseSums> responses;
  responses.reserve(sums_.size());
  Eigen::VectorXd start(m);
  Eigen::VectorXd all = Eigen::VectorXd::Zero(D);   // squares of the shared columns
  Eigen::VectorXd left = Eigen::VectorXd::Zero(D);  // and of what is left of them
  for (Eigen::Index k = 0; k < m; ++k) {
    const JointAxis& own = axis_of(k);
    Others::Axis& axis = others.axes.emplace_back();
    if (k == 0 || own.design != axis_of(k - 1).design) {
      std::optional<Own> at = Own::of(own.design->basis()(readings, Eigen::all));
      if (!at) {
        return std::nullopt;
      }
      others.owns.push_back(*std::move(at));
    }
    axis.own = others.owns.size() - 1;
    const Own& at = others.owns.back();
    const Eigen::VectorXd e = own.residuals(readings);
    axis.error = at.times(e);
    axis.shared.resize(e.size(), D);
    ResponseSums& response = responses.emplace_back(sums_[static_cast<std::size_t>(k)]);
    if (D > 0) {
      const Eigen::MatrixXd P = own.projected(readings, Eigen::all);
      axis.shared = at.times(P);
      response.information -= P.transpose() * axis.shared;
      response.gradient -= P.transpose() * axis.error;
    }
    response.squares = std::max(response.squares - e.dot(axis.error), 0.0);
    for (const std::size_t i : readings) {
      response.degrees_of_freedom -=
          own.root_weights(static_cast<Eigen::Index>(i)) > 0.0 ? 1.0 : 0.0;
    }
    start(k) = std::max(response.squares / std::max(response.degrees_of_freedom, 1.0),
                        std::max(smallest_(k), std::numeric_limits<double>::min()));
    if (D > 0) {
      all += (own.tangents.colwise().squaredNorm() -
              own.tangents(readings, Eigen::all).colwise().squaredNorm())
                 .transpose() /
             start(k);
      left += response.information.diagonal() / start(k);
    }
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
    return error.size() == 1 ? error(0) * error(0) / covariance(0, 0)
                             : error.dot(covariance.ldlt().solve(error));
  }
};

std::vector<DeletionFit::LeftOut> DeletionFit::left_out(const std::vector<std::size_t>& readings,
                                                        const Eigen::MatrixXd& contrasts,
                                                        const Others& others) const {
  std::vector<LeftOut> all(others.axes.size());
  // Axes of one design have these in common.
  bool seen = false;
  Eigen::MatrixXd C;
  Eigen::MatrixXd unscaled;  // of C, by the readings and their own columns
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    const Others::Axis& axis = others.axes[static_cast<std::size_t>(k)];
    if (k == 0 || axis.own != others.axes[static_cast<std::size_t>(k) - 1].own) {
      const Eigen::VectorXd root = axis_of(k).root_weights(readings);
      seen = (root.array() > 0.0).all();
      if (seen) {
        C = contrasts * root.cwiseInverse().asDiagonal();
        unscaled = C.lazyProduct(others.own_of(k).times(C.transpose()));
      }
    }
    LeftOut& left = all[static_cast<std::size_t>(k)];
    left.seen = seen;
    if (!seen) {
      continue;
    }
    left.error = C * others.errors(k);
    left.covariance = others.fit.variance(k) * unscaled;
    if (axis.shared.cols() > 0) {
      const Eigen::MatrixXd CP = C * axis.shared;
      left.covariance += CP * others.fit.covariance * CP.transpose();
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
    const Others::Axis& gone = others->axes[static_cast<std::size_t>(k)];
    const Own& own = others->own_of(k);
    const double variance = others->fit.variance(k);
    const Eigen::MatrixXd& Q = axis.design->basis();
    const Eigen::VectorXd left = axis.residuals - axis.projected * others->fit.estimate +
                                 Q * (own.Q().transpose() * others->errors(k));
    const Eigen::MatrixXd P = axis.projected + Q * (own.Q().transpose() * gone.shared);
    const Eigen::VectorXd of_own = (Q * own.M()).cwiseProduct(Q).rowwise().sum();
    const Eigen::VectorXd of_shared =
        (P * others->fit.covariance).cwiseProduct(P).rowwise().sum() / variance;
    const Eigen::VectorXd free = 1.0 - (of_own + of_shared).array();
    for (Eigen::Index i = 0; i < left.size(); ++i) {
      constexpr double least_left = 1e-6;
      if (is_other[static_cast<std::size_t>(i)] && axis.root_weights(i) > 0.0) {
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
    const Others::Axis& axis = others->axes[static_cast<std::size_t>(k)];
    const Eigen::VectorXd errors = others->errors(k);
    Eigen::VectorXd variances = others->fit.variance(k) * others->own_of(k).diagonal();
    if (axis.shared.cols() > 0) {
      variances += (axis.shared * others->fit.covariance).cwiseProduct(axis.shared).rowwise().sum();
    }
    for (std::size_t i = 0; i < readings.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const double root = axis_of(k).root_weights(static_cast<Eigen::Index>(readings[i]));
      if (root > 0.0) {
        all[i].error(k) = errors(row) / root;
        all[i].sd(k) = std::sqrt(variances(row)) / root;
      }
    }
  }
  return all;
}

}  // namespace axiscal
