// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/deletion_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "calib/regression/factor.hpp"
#include "calib/regression/heavy_tails.hpp"
#include "calib/regression/shared_fit.hpp"

namespace axiscal {
namespace {

// The remaining readings do not determine a coefficient if less than this fraction of the squared
// norm of its column remains after projection off the other columns.
constexpr double open_below = 1e-11;

// Matrices for the deletion of d readings from a design.
struct DesignLeftOut {
  // Returns the product K B. K is the matrix (1 - Q Q^T)^-1 = 1 + Q M Q^T.
  [[nodiscard]] Eigen::MatrixXd times_K(const Eigen::MatrixXd& B) const {
    return B + Q * (M * (Q.transpose() * B));
  }
  [[nodiscard]] Eigen::VectorXd diagonal_of_K() const {
    return 1.0 + (Q * M).cwiseProduct(Q).rowwise().sum().array();
  }

  Eigen::MatrixXd Q;  // d x p: rows of the orthonormal basis of the design
  Eigen::MatrixXd M;  // p x p: (1 - Q^T Q)^-1
};

// The fit of the readings that are not left out. d readings are left out.
struct Others {
  // Returns, for axis k, minus the derivatives of the prediction errors with respect to the s
  // shared unknowns, d x s.
  [[nodiscard]] auto shared_of(Eigen::Index k) const {
    return shared.middleCols(fit.estimate.size() * k, fit.estimate.size());
  }
  // Returns the d weighted prediction errors of an axis at the readings that are left out.
  [[nodiscard]] Eigen::VectorXd errors_of(Eigen::Index k) const {
    return errors.col(k) - shared_of(k) * fit.estimate;
  }
  [[nodiscard]] const DesignLeftOut& design_of(Eigen::Index k) const {
    return *designs[static_cast<std::size_t>(k)];
  }

  std::vector<std::shared_ptr<const DesignLeftOut>> designs;  // one object for axes of one design
  Eigen::MatrixXd errors;  // d x m: prediction errors before a step of the shared unknowns
  Eigen::MatrixXd shared;  // d x (s m): shared_of() of the axes, side by side
  SharedFit fit;
};

// Returns a null pointer if the remaining readings do not determine all coefficients.
std::shared_ptr<const DesignLeftOut> left_out_of(const FactoredDesign& design,
                                                 const std::vector<Eigen::Index>& rows) {
  const Eigen::MatrixXd Q = design.basis()(rows, Eigen::all);
  const Eigen::Index p = Q.cols();
  const PositiveFactor factor(Eigen::MatrixXd::Identity(p, p) - Q.transpose() * Q);
  return factor.is_determined(open_below)
             ? std::make_shared<const DesignLeftOut>(DesignLeftOut{.Q = Q, .M = factor.inverse()})
             : nullptr;
}

std::optional<Others> others_of(const Solution& solution,
                                const std::vector<std::size_t>& readings,
                                const Eigen::VectorXd& smallest) {
  const std::vector<Eigen::Index> rows(readings.begin(), readings.end());
  const auto m = std::ssize(solution.axes);
  const auto d = std::ssize(rows);
  const Eigen::Index s = solution.shared_count();
  Others others{.designs = {},
                .errors = Eigen::MatrixXd(d, m),
                .shared = Eigen::MatrixXd(d, s * m),
                .fit = {}};
  SharedSums sums = solution.sums;
  Eigen::VectorXd start(m);
  // Squared norms of the shared columns over the remaining readings: each axis's squared norm is
  // divided by its variance, then the axes are summed.
  Eigen::VectorXd all = Eigen::VectorXd::Zero(s);
  // the same squared norms after projection off the columns that only one axis has
  Eigen::VectorXd left = Eigen::VectorXd::Zero(s);
  Eigen::MatrixXd before(d, 1 + s);  // the residuals and the projected shared columns of an axis
  for (Eigen::Index k = 0; k < m; ++k) {
    const AxisSolution& axis = solution.axes[static_cast<std::size_t>(k)];
    const bool is_same =
        k > 0 && axis.design == solution.axes[static_cast<std::size_t>(k - 1)].design;
    others.designs.push_back(is_same ? others.designs.back() : left_out_of(*axis.design, rows));
    if (!others.designs.back()) {
      return std::nullopt;
    }
    double deleted = 0.0;
    for (Eigen::Index i = 0; i < d; ++i) {
      const Eigen::Index row = rows[static_cast<std::size_t>(i)];
      before(i, 0) = axis.residuals(row);
      before.row(i).tail(s) = axis.projected.row(row);
      deleted += axis.root_weights()(row) > 0.0 ? 1.0 : 0.0;
    }
    const Eigen::MatrixXd after = others.designs.back()->times_K(before);
    others.errors.col(k) = after.col(0);
    others.shared.middleCols(s * k, s) = after.rightCols(s);
    const Eigen::MatrixXd products = before.transpose() * after;
    sums.information_of(k) -= products.bottomRightCorner(s, s);
    sums.gradient.col(k) -= products.bottomLeftCorner(s, 1);
    sums.squares(k) = std::max(sums.squares(k) - products(0, 0), 0.0);
    sums.degrees_of_freedom(k) -= deleted;
    start(k) = std::max({sums.squares(k) / std::max(sums.degrees_of_freedom(k), 1.0), smallest(k),
                         std::numeric_limits<double>::min()});
    all += solution.shared_squares.col(k) / start(k);
    for (const Eigen::Index row : rows) {
      all -= axis.shared.row(row).cwiseAbs2().transpose() / start(k);
    }
    left += sums.information_of(k).diagonal() / start(k);
  }
  if (!(left.array() > open_below * all.array()).all()) {
    return std::nullopt;
  }
  constexpr double enough_for_tests = 1e-6;
  std::optional<SharedFit> fit = fit_shared(sums, start, smallest, enough_for_tests);
  constexpr double fewest = 0.5;
  if (!fit || !(fit->degrees_of_freedom.minCoeff() > fewest)) {
    return std::nullopt;
  }
  others.fit = *std::move(fit);
  return others;
}

// The contrasts of one axis minus their prediction, not weighted. The covariance is that of this
// difference.
struct ContrastError {
  Eigen::VectorXd error;       // one for each of the q contrasts
  Eigen::MatrixXd covariance;  // q x q
};

// Returns the errors of the contrasts of each axis. The entry of an axis is nullopt if it does not
// use every deleted reading.
std::vector<std::optional<ContrastError>> contrast_errors(const Others& others,
                                                          const Solution& solution,
                                                          const std::vector<std::size_t>& readings,
                                                          const Eigen::MatrixXd& contrasts) {
  const std::vector<Eigen::Index> rows(readings.begin(), readings.end());
  std::vector<std::optional<ContrastError>> errors(solution.axes.size());
  const FactoredDesign* design = nullptr;
  // For axes of this design: C maps weighted readings to contrasts, and C K C^T is the part of the
  // covariance that is proportional to the variance of the axis.
  bool uses_all = false;
  Eigen::MatrixXd C;
  Eigen::MatrixXd CKC;
  for (Eigen::Index k = 0; k < std::ssize(solution.axes); ++k) {
    const AxisSolution& axis = solution.axes[static_cast<std::size_t>(k)];
    if (axis.design.get() != design) {
      design = axis.design.get();
      const Eigen::VectorXd root_weights = axis.root_weights()(rows);
      uses_all = (root_weights.array() > 0.0).all();
      C = contrasts * root_weights.cwiseInverse().asDiagonal();
      CKC = C * others.design_of(k).times_K(C.transpose());
    }
    if (uses_all) {
      const Eigen::MatrixXd shared = C * others.shared_of(k);
      errors[static_cast<std::size_t>(k)] = {
          .error = C * others.errors_of(k),
          .covariance =
              others.fit.variance(k) * CKC + shared * others.fit.covariance * shared.transpose()};
    }
  }
  return errors;
}

// Adds residuals to `tails`, each divided by its standard deviation. They are the residuals of the
// fit without the left-out readings, at the readings that this fit uses.
void add_others(const AxisSolution& axis,
                const Others& others,
                Eigen::Index k,
                const std::vector<bool>& is_other,
                NoiseTails& tails) {
  const double variance = others.fit.variance(k);
  const Eigen::MatrixXd& Q = axis.design->basis();
  const auto& [Q_left, M] = others.design_of(k);
  const Eigen::VectorXd left = axis.residuals - axis.projected * others.fit.estimate +
                               Q * (Q_left.transpose() * others.errors_of(k));
  const Eigen::MatrixXd P = axis.projected + Q * (Q_left.transpose() * others.shared_of(k));
  const Eigen::VectorXd of_own = (Q * M).cwiseProduct(Q).rowwise().sum();
  const Eigen::VectorXd of_shared =
      (P * others.fit.covariance).cwiseProduct(P).rowwise().sum() / variance;
  for (Eigen::Index i = 0; i < left.size(); ++i) {
    constexpr double least_free = 1e-6;
    if (is_other[static_cast<std::size_t>(i)] && axis.root_weights()(i) > 0.0) {
      const double free = std::max(1.0 - of_own(i) - of_shared(i), least_free);
      tails.add(left(i) / std::sqrt(variance * free));
    }
  }
}

Eigen::VectorXd variances_of_rounding(const ReadingSet& set) {
  Eigen::VectorXd smallest(set.axis_count());
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    smallest(k) = std::pow(set.rounding(k), 2);
  }
  return smallest;
}

}  // namespace

DeletionFit::DeletionFit(const ReadingSet& set, const TableField& field, bool known_field)
    : set_(set),
      solution_(Model(set, known_field).at({.field = field})),
      smallest_(variances_of_rounding(set)) {}

DeletionFit::DeletionFit(const SolvedReadings& run, const TableField& field)
    : set_(run.set()), solution_(run.at(field)), smallest_(variances_of_rounding(run.set())) {}

std::optional<double> DeletionFit::p_value(const std::vector<std::size_t>& readings,
                                           const Eigen::MatrixXd& contrasts,
                                           double loss) const {
  const std::optional<Others> others = others_of(*solution_, readings, smallest_);
  if (!others) {
    return std::nullopt;
  }
  const auto q = static_cast<double>(contrasts.rows());
  FisherSum axes;
  const auto errors = contrast_errors(*others, *solution_, readings, contrasts);
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    if (const std::optional<ContrastError>& one = errors[static_cast<std::size_t>(k)]) {
      const double squares = one->error.dot(solve_symmetric(one->covariance, one->error).col(0));
      axes.add(f_upper_p(std::max(squares / q, 1e-12), q, others->fit.degrees_of_freedom(k)));
    }
  }
  return axes.count() > 0.0 ? std::optional(axes.p_value(loss)) : std::nullopt;
}

std::optional<double> DeletionFit::p_value_by_tails(const std::vector<std::size_t>& readings,
                                                    const Eigen::MatrixXd& contrasts,
                                                    double loss) const {
  const std::optional<Others> others = others_of(*solution_, readings, smallest_);
  if (!others) {
    return std::nullopt;
  }
  std::vector<bool> is_other(set_.readings.size(), true);
  for (const std::size_t i : readings) {
    is_other[i] = false;
  }
  NoiseTails tails;
  // Errors of the contrasts, transformed to be independent with variance 1.
  std::vector<double> deviations;
  const auto errors = contrast_errors(*others, *solution_, readings, contrasts);
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    if (const std::optional<ContrastError>& one = errors[static_cast<std::size_t>(k)]) {
      const Eigen::VectorXd whitened = Whitening(one->covariance).times(one->error);
      deviations.insert(deviations.end(), whitened.begin(), whitened.end());
      add_others(solution_->axes[static_cast<std::size_t>(k)], *others, k, is_other, tails);
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
    p += weights[v] * all.p_value(loss);
  }
  return p;
}

std::optional<std::vector<DeletionFit::Prediction>> DeletionFit::predictions(
    const std::vector<std::size_t>& readings) const {
  const std::optional<Others> others = others_of(*solution_, readings, smallest_);
  if (!others) {
    return std::nullopt;
  }
  const Eigen::Index m = set_.axis_count();
  std::vector<Prediction> all(readings.size(),
                              Prediction{.error = Eigen::VectorXd::Constant(m, not_a_number),
                                         .sd = Eigen::VectorXd::Constant(m, not_a_number),
                                         .degrees_of_freedom = others->fit.degrees_of_freedom});
  for (Eigen::Index k = 0; k < m; ++k) {
    const AxisSolution& axis = solution_->axes[static_cast<std::size_t>(k)];
    const Eigen::VectorXd errors = others->errors_of(k);
    const Eigen::MatrixXd shared = others->shared_of(k);
    const Eigen::VectorXd variances =
        others->fit.variance(k) * others->design_of(k).diagonal_of_K() +
        (shared * others->fit.covariance).cwiseProduct(shared).rowwise().sum();
    for (std::size_t i = 0; i < readings.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const double root = axis.root_weights()(static_cast<Eigen::Index>(readings[i]));
      if (root > 0.0) {
        all[i].error(k) = errors(row) / root;
        all[i].sd(k) = std::sqrt(variances(row)) / root;
      }
    }
  }
  return all;
}

}  // namespace axiscal
