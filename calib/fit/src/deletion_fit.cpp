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

// Matrices and errors for the deletion of d readings from one axis.
struct AxisLeftOut {
  std::shared_ptr<const DesignLeftOut> design;  // shared by the axes of one design
  Eigen::VectorXd errors;  // d: prediction errors before a step of the shared unknowns
  // d x s: minus the derivatives of `errors` with respect to the shared unknowns
  Eigen::MatrixXd shared;
};

// The fit of the readings that are not left out.
struct Others {
  // Returns the d weighted prediction errors of an axis at the readings that are left out.
  [[nodiscard]] Eigen::VectorXd errors(std::size_t k) const {
    return axes[k].errors - axes[k].shared * fit.estimate;
  }

  std::vector<AxisLeftOut> axes;
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
  Others others;
  std::vector<ResponseSums> sums;
  Eigen::VectorXd start(smallest.size());
  // squared norms of the shared columns over the remaining readings: each axis's squared norm is
  // divided by its variance, then the axes are summed
  Eigen::VectorXd all = Eigen::VectorXd::Zero(solution.shared_count());
  // the same squared norms after projection off the columns that only one axis has
  Eigen::VectorXd left = Eigen::VectorXd::Zero(solution.shared_count());
  std::shared_ptr<const DesignLeftOut> design;
  for (const AxisSolution& axis : solution.axes) {
    const auto k = static_cast<Eigen::Index>(sums.size());
    const bool is_same = k > 0 && axis.design == solution.axes[sums.size() - 1].design;
    design = is_same ? design : left_out_of(*axis.design, rows);
    if (!design) {
      return std::nullopt;
    }
    const Eigen::MatrixXd projected = axis.projected(rows, Eigen::all);
    const Eigen::VectorXd residuals = axis.residuals(rows);
    const AxisLeftOut& own = others.axes.emplace_back(
        AxisLeftOut{design, design->times_K(residuals), design->times_K(projected)});
    ResponseSums& of_axis = sums.emplace_back(axis.sums);
    of_axis.information -= projected.transpose() * own.shared;
    of_axis.gradient -= projected.transpose() * own.errors;
    of_axis.squares = std::max(of_axis.squares - residuals.dot(own.errors), 0.0);
    of_axis.degrees_of_freedom -=
        static_cast<double>((axis.root_weights()(rows).array() > 0.0).count());
    start(k) = std::max({of_axis.squares / std::max(of_axis.degrees_of_freedom, 1.0), smallest(k),
                         std::numeric_limits<double>::min()});
    const Eigen::MatrixXd shared = axis.shared(rows, Eigen::all);
    all += (axis.shared_squares - shared.colwise().squaredNorm().transpose()) / start(k);
    left += of_axis.information.diagonal() / start(k);
  }
  if (!(left.array() > open_below * all.array()).all()) {
    return std::nullopt;
  }
  std::optional<SharedFit> fit = fit_shared(sums, start, smallest);
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

// Returns nullopt if the axis does not use all of the readings that are left out.
std::optional<ContrastError> contrast_error(const Others& others,
                                            std::size_t k,
                                            const Eigen::VectorXd& root_weights,
                                            const Eigen::MatrixXd& contrasts) {
  if (!(root_weights.array() > 0.0).all()) {
    return std::nullopt;
  }
  const AxisLeftOut& axis = others.axes[k];
  const Eigen::MatrixXd C = contrasts * root_weights.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd shared = C * axis.shared;
  return ContrastError{.error = C * others.errors(k),
                       .covariance = others.fit.variance(static_cast<Eigen::Index>(k)) *
                                         (C * axis.design->times_K(C.transpose())) +
                                     shared * others.fit.covariance * shared.transpose()};
}

// Adds residuals to `tails`, each divided by its standard deviation. They are the residuals of the
// fit without the left-out readings, at the readings that this fit uses.
void add_others(const AxisSolution& axis,
                const Others& others,
                std::size_t k,
                const std::vector<bool>& is_other,
                NoiseTails& tails) {
  const AxisLeftOut& own = others.axes[k];
  const double variance = others.fit.variance(static_cast<Eigen::Index>(k));
  const Eigen::MatrixXd& Q = axis.design->basis();
  const auto& [Q_left, M] = *own.design;
  const Eigen::VectorXd left = axis.residuals - axis.projected * others.fit.estimate +
                               Q * (Q_left.transpose() * others.errors(k));
  const Eigen::MatrixXd P = axis.projected + Q * (Q_left.transpose() * own.shared);
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
  const std::vector<Eigen::Index> rows(readings.begin(), readings.end());
  FisherSum axes;
  for (std::size_t k = 0; k < solution_->axes.size(); ++k) {
    if (const auto one =
            contrast_error(*others, k, solution_->axes[k].root_weights()(rows), contrasts)) {
      const double squares = one->error.dot(solve_symmetric(one->covariance, one->error).col(0));
      axes.add(f_upper_p(std::max(squares / q, 1e-12), q,
                         others->fit.degrees_of_freedom(static_cast<Eigen::Index>(k))));
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
  const std::vector<Eigen::Index> rows(readings.begin(), readings.end());
  std::vector<bool> is_other(set_.readings.size(), true);
  for (const std::size_t i : readings) {
    is_other[i] = false;
  }
  NoiseTails tails;
  // Errors of the contrasts, transformed to be independent with variance 1.
  std::vector<double> deviations;
  for (std::size_t k = 0; k < solution_->axes.size(); ++k) {
    const AxisSolution& axis = solution_->axes[k];
    if (const auto one = contrast_error(*others, k, axis.root_weights()(rows), contrasts)) {
      const Eigen::VectorXd whitened = Whitening(one->covariance).times(one->error);
      deviations.insert(deviations.end(), whitened.begin(), whitened.end());
      add_others(axis, *others, k, is_other, tails);
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
    const auto axis = static_cast<std::size_t>(k);
    const AxisLeftOut& own = others->axes[axis];
    const Eigen::VectorXd errors = others->errors(axis);
    const Eigen::VectorXd variances =
        others->fit.variance(k) * own.design->diagonal_of_K() +
        (own.shared * others->fit.covariance).cwiseProduct(own.shared).rowwise().sum();
    for (std::size_t i = 0; i < readings.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const double root =
          solution_->axes[axis].root_weights()(static_cast<Eigen::Index>(readings[i]));
      if (root > 0.0) {
        all[i].error(k) = errors(row) / root;
        all[i].sd(k) = std::sqrt(variances(row)) / root;
      }
    }
  }
  return all;
}

}  // namespace axiscal
