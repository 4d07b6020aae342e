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
#include "axiscal/calib/state_of_run.hpp"
#include "axiscal/core/not_a_number.hpp"

namespace axiscal {

// K = (1 - Q Q^T)^-1, which takes what the fit of all leaves of d readings to what the others' fit
// does: by itself where they are fewer than the p columns, else by M = (1 - Q^T Q)^-1.
// @tparam Most  how many readings and columns there are at most.
template <int Most>
class DeletionFit::Own {
 public:
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, Most, Most>;
  using Column = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, Most, 1>;

  // @param basis  n x p, of an axis's own columns.
  // @return nothing where the others do not determine what goes with the columns.
  static std::optional<Own> of(const Eigen::MatrixXd& basis,
                               const std::vector<std::size_t>& readings) {
    Own own;
    own.Q_.resize(static_cast<Eigen::Index>(readings.size()), basis.cols());
    for (Eigen::Index i = 0; i < own.Q_.rows(); ++i) {
      own.Q_.row(i) = basis.row(static_cast<Eigen::Index>(readings[static_cast<std::size_t>(i)]));
    }
    const Square& Q = own.Q_;
    own.is_of_readings_ = Q.rows() > 0 && Q.rows() < Q.cols();
    const Eigen::Index size = own.is_of_readings_ ? Q.rows() : Q.cols();
    const Square identity = Square::Identity(size, size);
    const Eigen::LLT<Square> cholesky(own.is_of_readings_
                                          ? Square(identity - Q.lazyProduct(Q.transpose()))
                                          : Square(identity - Q.transpose() * Q));
    if (cholesky.info() != Eigen::Success ||
        !(cholesky.matrixLLT().diagonal().array().square() > open_below).all()) {
      return std::nullopt;
    }
    own.inverse_ = cholesky.solve(identity);
    return own;
  }

  [[nodiscard]] const Square& Q() const { return Q_; }

  // K B.
  template <typename Matrix>
  [[nodiscard]] Matrix times(const Matrix& B) const {
    if (is_of_readings_) {
      return inverse_.lazyProduct(B);
    }
    return B + Q_ * (inverse_ * (Q_.transpose() * B));
  }

  [[nodiscard]] Column diagonal() const {
    return is_of_readings_ ? Column(inverse_.diagonal())
                           : Column(1.0 + (Q_ * inverse_).cwiseProduct(Q_).rowwise().sum().array());
  }

  [[nodiscard]] Square M() const {
    return is_of_readings_
               ? Square(Square::Identity(Q_.cols(), Q_.cols()) + Q_.transpose() * inverse_ * Q_)
               : inverse_;
  }

 private:
  Square Q_;        // d x p
  Square inverse_;  // K or M
  bool is_of_readings_ = false;
};

// The fit of the other readings, by what it leaves of those that are left out.
template <int Most>
struct DeletionFit::Others {
  // Of d readings what there is of all axes, side by side.
  static constexpr int most_columns = Most == Eigen::Dynamic ? Eigen::Dynamic : 2 * Most;
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, Most, most_columns>;

  // Axes of one design.
  struct Alike {
    [[nodiscard]] bool has(Eigen::Index k) const { return k >= first && k < first + count; }

    // An axis's columns of those below.
    template <typename Matrix>
    [[nodiscard]] auto of_axis(const Matrix& columns, Eigen::Index k) const {
      const Eigen::Index each = columns.cols() / count;
      return columns.middleCols(each * (k - first), each);
    }

    Own<Most> own;
    Eigen::Index first = 0;
    Eigen::Index count = 0;
    // Of each axis the errors of the d readings, by the others' coefficients where nothing is
    // shared, and how they change with what is: d x count (1 + D).
    Columns errors;
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
    : set_(set), state_(StateOfRun(set, known_field).at(field)), smallest_(set.axis_count()) {
  find_smallest();
}

DeletionFit::DeletionFit(StateOfRun& run, const TableField& field)
    : set_(run.set()), state_(run.at(field)), smallest_(run.set().axis_count()) {
  find_smallest();
}

void DeletionFit::find_smallest() {
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    smallest_(k) = std::pow(set_.rounding(k), 2);
  }
}

template <int Most>
std::optional<DeletionFit::Others<Most>> DeletionFit::without(
    const std::vector<std::size_t>& readings) const {
  using OthersOfSome = Others<Most>;
  const Eigen::Index m = set_.axis_count();
  const Eigen::Index D = state_->direction_count();
  const auto d = static_cast<Eigen::Index>(readings.size());
  OthersOfSome others;
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
    const std::optional<Own<Most>> own = Own<Most>::of(axis_of(first).design->basis(), readings);
    if (!own) {
      return std::nullopt;
    }
    typename OthersOfSome::Columns gone(d, (end - first) * (1 + D));
    for (Eigen::Index k = first; k < end; ++k) {
      auto of_axis = gone.middleCols((1 + D) * (k - first), 1 + D);
      for (Eigen::Index i = 0; i < d; ++i) {
        const auto row = static_cast<Eigen::Index>(readings[static_cast<std::size_t>(i)]);
        of_axis(i, 0) = axis_of(k).residuals(row);
        of_axis.row(i).tail(D) = axis_of(k).projected.row(row);
      }
    }
    const typename OthersOfSome::Alike& one = others.all.emplace_back(typename OthersOfSome::Alike{
        .own = *own, .first = first, .count = end - first, .errors = own->times(gone)});
    for (Eigen::Index k = first; k < end; ++k) {
      const JointAxis& axis = axis_of(k);
      const auto before = one.of_axis(gone, k);
      const auto after = one.of_axis(one.errors, k);
      ResponseSums& response = responses.emplace_back(axis.sums);
      response.information -= before.rightCols(D).transpose().lazyProduct(after.rightCols(D));
      response.gradient -= before.rightCols(D).transpose().lazyProduct(after.col(0));
      response.squares = std::max(response.squares - before.col(0).dot(after.col(0)), 0.0);
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
  if (!(left.array() > open_below * all.array()).all()) {
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

template <int Most>
struct DeletionFit::LeftOut {
  bool seen = true;                       // whether the axis uses all the readings
  typename Own<Most>::Column error;       // q: contrast less prediction
  typename Own<Most>::Square covariance;  // q x q: the readings' own and the prediction's

  // In units of it.
  [[nodiscard]] double squares() const {
    if (error.size() > 1) {
      return error.dot(covariance.ldlt().solve(error));
    }
    return covariance(0, 0) > 0.0 ? error(0) * error(0) / covariance(0, 0) : 0.0;  // as of a solve
  }
};

template <int Most>
std::vector<DeletionFit::LeftOut<Most>> DeletionFit::left_out(
    const std::vector<std::size_t>& readings,
    const Eigen::MatrixXd& contrasts,
    const Others<Most>& others) const {
  using Square = typename Own<Most>::Square;
  std::vector<LeftOut<Most>> all;
  all.reserve(static_cast<std::size_t>(set_.axis_count()));
  for (const typename Others<Most>::Alike& one : others.all) {
    typename Own<Most>::Column root(contrasts.cols());
    for (Eigen::Index i = 0; i < root.size(); ++i) {
      const std::size_t reading = readings[static_cast<std::size_t>(i)];
      root(i) = axis_of(one.first).root_weights()(static_cast<Eigen::Index>(reading));
    }
    if (!(root.array() > 0.0).all()) {
      LeftOut<Most> unseen;
      unseen.seen = false;
      all.resize(all.size() + static_cast<std::size_t>(one.count), unseen);
      continue;
    }
    const Square C = contrasts * root.cwiseInverse().asDiagonal();
    const Square unscaled = C.lazyProduct(one.own.times(Square(C.transpose())));  // by their own
    const typename Others<Most>::Columns errors = C.lazyProduct(one.errors);
    for (Eigen::Index k = one.first; one.has(k); ++k) {
      const auto of_axis = one.of_axis(errors, k);
      const auto shared = of_axis.rightCols(others.fit.estimate.size());
      LeftOut<Most>& left = all.emplace_back();
      left.error = of_axis.col(0) - shared.lazyProduct(others.fit.estimate);
      left.covariance = others.fit.variance(k) * unscaled;
      if (shared.cols() > 0) {
        left.covariance +=
            shared.lazyProduct(others.fit.covariance.lazyProduct(shared.transpose()));
      }
    }
  }
  return all;
}

std::optional<double> DeletionFit::p_value(const std::vector<std::size_t>& readings,
                                           const Eigen::MatrixXd& contrasts) const {
  const Eigen::Index of_all_axes = set_.axis_count() * (1 + state_->direction_count());
  const bool are_few = readings.size() <= static_cast<std::size_t>(few) &&
                       axis_of(0).X().cols() <= few && of_all_axes <= Others<few>::most_columns &&
                       contrasts.rows() <= few;
  return are_few ? p_value_of<few>(readings, contrasts)
                 : p_value_of<Eigen::Dynamic>(readings, contrasts);
}

template <int Most>
std::optional<double> DeletionFit::p_value_of(const std::vector<std::size_t>& readings,
                                              const Eigen::MatrixXd& contrasts) const {
  const std::optional<Others<Most>> others = without<Most>(readings);
  if (!others) {
    return std::nullopt;
  }
  const auto q = static_cast<double>(contrasts.rows());
  FisherSum axes;
  Eigen::Index k = 0;
  for (const LeftOut<Most>& left : left_out(readings, contrasts, *others)) {
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
  const std::optional<Others<Eigen::Dynamic>> others = without<Eigen::Dynamic>(readings);
  if (!others) {
    return std::nullopt;
  }
  std::vector<bool> is_other(set_.readings.size(), true);
  for (const std::size_t i : readings) {
    is_other[i] = false;
  }
  NoiseTails tails;
  std::vector<double> deviations;  // of the contrasts, square to each other, of variance 1
  const std::vector<LeftOut<Eigen::Dynamic>> of_axes = left_out(readings, contrasts, *others);
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    const LeftOut<Eigen::Dynamic>& left_of_all = of_axes[static_cast<std::size_t>(k)];
    if (!left_of_all.seen) {
      continue;
    }
    const Eigen::LLT<Eigen::MatrixXd> root(left_of_all.covariance);
    const Eigen::VectorXd whitened = root.matrixL().solve(left_of_all.error);
    deviations.insert(deviations.end(), whitened.begin(), whitened.end());
    // What the others' fit leaves of themselves, and the variance of what it says of them.
    const JointAxis& axis = axis_of(k);
    const Own<Eigen::Dynamic>& own = others->alike(k).own;
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
  const std::optional<Others<Eigen::Dynamic>> others = without<Eigen::Dynamic>(readings);
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
