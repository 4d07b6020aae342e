// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/number_text.hpp"
#include "calib/fit/fit.hpp"
#include "calib/fit/rounding_scatter.hpp"
#include "calib/fit/src/causes/causes.hpp"
#include "calib/fit/src/causes/noise_parts.hpp"
#include "calib/regression/serial_correlation.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// The ratio of the mean squares of two parts of the residuals r. D is a diagonal matrix of weights
// between 0 and 1. The sums of squares of the parts are r' D r and r' (1 - D) r. For white noise
// the ratio has approximately an F distribution. The degrees of freedom of the first part are
// trace(Z)^2 / trace(Z^2) with Z = M D M; M is the projection onto the residual space. Those of the
// second part are computed in the same way from 1 - D.
struct NoiseRatio {
  double ratio = 1.0;
  double above = 1.0;  // probability of a larger ratio by chance
  double below = 1.0;  // probability of a smaller ratio by chance
};

NoiseRatio ratio_of(const PartOfNoise& one, const PartOfNoise& other) {
  constexpr double fewest = 0.5;
  if (!(one.trace > fewest) || !(other.trace > fewest) || !(other.squares > 0.0)) {
    return {};
  }
  NoiseRatio result{.ratio = (one.squares / one.trace) / (other.squares / other.trace)};
  result.above = f_upper_p(std::max(result.ratio, 1e-300), one.freedom(), other.freedom());
  result.below = 1.0 - result.above;
  return result;
}

// A factor K of the hat matrix K K^T of one axis, with K = [Q, P]. Q is an orthonormal basis of the
// columns that only this axis has. P contains this axis's rows of the basis of the columns that all
// axes share.
struct AxisHat {
  AxisHat(const Fit& run, Eigen::Index k)
      : Q(run.basis_of_axis(k)),
        P(run.shared_basis_of_axis(k)),
        leverage((Q.rowwise().squaredNorm() + P.rowwise().squaredNorm()).array()) {}

  const Eigen::MatrixXd& Q;  // n x p
  Eigen::MatrixXd P;         // n x D
  Eigen::ArrayXd leverage;
};

// Returns the squared residuals of an axis.
auto squares_of_axis(const Fit& run, Eigen::Index k) {
  return run.residuals()(run.rows_of_axis(k)).array().square();
}

// The blocks of the matrix K^T W K of one axis, with K = [Q, P] of AxisHat. W is the diagonal
// matrix of the weights of the axis's rows.
struct WeightedHat {
  WeightedHat(const AxisHat& axis, const Eigen::ArrayXd& weights)
      : own(Eigen::MatrixXd::Zero(axis.Q.cols(), axis.Q.cols())),
        across(Eigen::MatrixXd::Zero(axis.Q.cols(), axis.P.cols())),
        shared(Eigen::MatrixXd::Zero(axis.P.cols(), axis.P.cols())) {
    constexpr Eigen::Index rows_at_once = 4096;  // all rows at once would need a second copy of Q
    for (Eigen::Index from = 0; from < weights.size(); from += rows_at_once) {
      const Eigen::Index rows = std::min(rows_at_once, weights.size() - from);
      const auto Q = axis.Q.middleRows(from, rows);
      const auto w = weights.segment(from, rows).matrix().asDiagonal();
      own += Q.transpose() * Eigen::MatrixXd(w * Q);
      if (axis.P.cols() > 0) {
        const auto P = axis.P.middleRows(from, rows);
        const Eigen::MatrixXd WP = w * P;
        across += Q.transpose() * WP;
        shared += P.transpose() * WP;
      }
    }
  }

  // Returns the sum of the squared elements of three blocks: Q^T W Q, Q^T W P and P^T W Q.
  [[nodiscard]] double squares_of_own() const {
    return own.squaredNorm() + 2.0 * across.squaredNorm();
  }

  Eigen::MatrixXd own;
  Eigen::MatrixXd across;
  Eigen::MatrixXd shared;
};

// Computes the ratio of the noise along the field to the noise across the field, for one axis. The
// squared residuals have the weights cos^2 in the part along the field and 1 - cos^2 in the part
// across it.
NoiseRatio ratio_of_axis(const Fit& run, Eigen::Index k, const Eigen::VectorXd& cosines) {
  const AxisHat axis(run, k);
  const auto part_of = [&](const Eigen::ArrayXd& weights, double squares_of_hat) {
    return PartOfNoise{
        .squares = (weights * squares_of_axis(run, k)).sum(),
        .trace = (weights * (1.0 - axis.leverage)).sum(),
        .trace_of_square = (weights.square() * (1.0 - 2.0 * axis.leverage)).sum() + squares_of_hat};
  };
  const Eigen::ArrayXd used = (run.set().weights.col(k).array() > 0.0).cast<double>();
  const Eigen::ArrayXd along = cosines.array().square() * used;
  WeightedHat of_hat(axis, along);
  const double squares_along = of_hat.squares_of_own() + of_hat.shared.squaredNorm();
  // The part across the field has the weights 1 - cos^2. The matrix for these weights is K^T K
  // minus the matrix for cos^2. In K^T K, Q^T Q is the unit matrix and Q^T P is 0. The sign of the
  // difference does not matter, because only squares of its elements are used.
  of_hat.own.diagonal().array() -= 1.0;
  of_hat.shared -= axis.P.transpose() * axis.P;
  const double squares_across = of_hat.squares_of_own() + of_hat.shared.squaredNorm();
  return ratio_of(part_of(along, squares_along), part_of(used - along, squares_across));
}

// Returns the cosine of the angle between the field and each axis, for each reading; n x m.
Eigen::MatrixXd cosines_of(const Fit& run, const Estimate& estimate) {
  Eigen::MatrixXd cosines(run.readings(), run.axes());
  for (Eigen::Index k = 0; k < run.axes(); ++k) {
    const auto met = run.field_met(k);
    const Eigen::Vector3d S = estimate.response.sensitivity.row(k).normalized();
    cosines.col(k) =
        (met * S).cwiseQuotient(met.rowwise().norm().cwiseMax(std::numeric_limits<double>::min()));
  }
  return cosines;
}

// The sandwich estimate of a coefficient's variance, with its degrees of freedom. It remains valid
// if the variance of the noise differs between readings. It is a weighted sum of the squared
// residuals. Each weight is (influence / (1 - leverage))^2. A common factor makes the sum unbiased
// for white noise.
struct Sandwich {
  double variance = 0.0;
  double degrees_of_freedom = 0.0;
};

// Computes sandwich estimates for the coefficients of a run. The object holds the matrices that all
// estimates need.
class Sandwiches {
 public:
  explicit Sandwiches(const Fit& run) : run_(run) {
    axes_.reserve(static_cast<std::size_t>(run.axes()));
    for (Eigen::Index k = 0; k < run.axes(); ++k) {
      axes_.push_back(AxisRows{.hat = AxisHat(run, k), .root = run.root_of_axis(k)});
    }
  }

  // Computes the sandwich estimate for coefficient j of axis k. The other axes influence it only
  // through the shared unknowns.
  [[nodiscard]] Sandwich of(Eigen::Index k, Eigen::Index j) const {
    const Fit::RootOfAxis& root = axes_[static_cast<std::size_t>(k)].root;
    const auto own = root.own.row(j).transpose();
    const auto by_shared = root.shared.row(j).transpose();
    double v = 0.0;
    double E = 0.0;
    double freedom = 0.0;
    Eigen::MatrixXd shared = Eigen::MatrixXd::Zero(run_.shared(), run_.shared());
    for (Eigen::Index a = 0; a < run_.axes(); ++a) {
      if (a != k && run_.shared() == 0) {
        continue;
      }
      // The influence of the axis's readings on the coefficient.
      const AxisRows& axis = axes_[static_cast<std::size_t>(a)];
      Eigen::VectorXd g = axis.hat.P * by_shared;
      if (a == k) {
        g += axis.hat.Q.lazyProduct(own);
      }
      // If 1 - leverage is not larger than this, the fit passes through the reading, and the
      // residual contains no information.
      constexpr double least_left = 1e-6;
      const auto left = 1.0 - axis.hat.leverage;
      const Eigen::ArrayXd w = (left > least_left).select((g.array() / left).square(), 0.0);
      v += (w * squares_of_axis(run_, a)).sum();
      E += (w * left).sum();
      const WeightedHat of_hat(axis.hat, w);
      freedom += (w.square() * (1.0 - 2.0 * axis.hat.leverage)).sum() + of_hat.squares_of_own();
      shared += of_hat.shared;
    }
    const double variance = own.squaredNorm() + by_shared.squaredNorm();
    return {.variance = v * variance / E,
            .degrees_of_freedom = E * E / (freedom + shared.squaredNorm())};
  }

 private:
  struct AxisRows {
    AxisHat hat;
    Fit::RootOfAxis root;
  };

  const Fit& run_;
  std::vector<AxisRows> axes_;
};

// The residuals of each reading, projected on the direction in which the reading moves if the
// field's magnitude changes.
struct AlongField {
  Eigen::VectorXd size;         // n: norm of the response to the field, in units of the noise
  Eigen::MatrixXd directions;   // n x m: the unit vector of this direction for each reading
  Eigen::VectorXd deviations;   // n: residuals projected on the directions
  Eigen::MatrixXd hat_root;     // n x q: a root K of the hat matrix K K^T of the deviations
  Eigen::MatrixXd hat_squares;  // q x q: K^T K
};

AlongField along_field(const Fit& run) {
  AlongField along{.size = run.along_field().rowwise().norm(),
                   .directions = run.along_field(),
                   .deviations = Eigen::VectorXd::Zero(run.readings()),
                   .hat_root = {},
                   .hat_squares = {}};
  along.directions.array().colwise() /= along.size.array().max(std::numeric_limits<double>::min());
  for (Eigen::Index k = 0; k < run.axes(); ++k) {
    along.deviations +=
        along.directions.col(k).cwiseProduct(run.residuals()(run.rows_of_axis(k)).matrix());
  }
  along.hat_root = run.combined_basis(along.directions);
  along.hat_squares = along.hat_root.transpose() * along.hat_root;
  return along;
}

PartOfNoise part_along(const Fit& run, const AlongField& along) {
  const double taken = along.hat_squares.trace();  // degrees of freedom taken by the fit
  const auto n = static_cast<double>(run.readings());
  return {.squares = along.deviations.squaredNorm(),
          .trace = n - taken,
          .trace_of_square = n - 2.0 * taken + along.hat_squares.squaredNorm()};
}

bool can_be_looked_at(const Fit& run) {
  const ReadingSet& set = run.set();
  return run.is_determined() && run.readings() >= fewest_looked_at && set.seen.cols() == 0 &&
         set.visible.empty() && !set.robust;
}

// The signs that the magnitude of the field varies from reading to reading.
struct FieldVariation {
  NoiseRatio all;            // the noise along the field to that across it; 1 if it is not tested
  double one_axis = 1.0;     // smallest probability of such a ratio of one axis, by chance
  double score = 0.0;        // result of lag_one_score_along()
  double correlation = 0.0;  // of consecutive readings along the field

  // Returns the probability of both signs together by chance.
  [[nodiscard]] double p_value() const {
    FisherSum both;
    if (all.above < 1.0) {
      both.add(all.above);
    }
    both.add(0.5 * std::erfc(score / std::numbers::sqrt2));
    return both.p_value();
  }
};

// Lengthens intervals if the noise along the field differs from the noise across it.
// @param one  the noise along the field.
void add_field_noise(const Fit& run,
                     const PartOfNoise& one,
                     FieldVariation& found,
                     Estimate& estimate) {
  if (estimate.statistics.find_component("seats") != nullptr) {
    return;
  }
  const Eigen::Index m = run.axes();
  NoiseRatio& all = found.all;
  if (m > 1) {
    const double left = run.degrees_of_freedom();
    all = ratio_of(one, {.squares = run.residuals().squaredNorm() - one.squares,
                         .trace = left - one.trace,
                         .trace_of_square = left + one.trace_of_square - 2.0 * one.trace});
  }
  const Eigen::MatrixXd cosines = cosines_of(run, estimate);
  double& one_axis = found.one_axis;
  for (Eigen::Index k = 0; k < m; ++k) {
    one_axis = std::min(one_axis, ratio_of_axis(run, k, cosines.col(k)).above);
  }
  const Gate gate(run.readings());
  if (!(all.above < gate.above) && !(all.below < gate.below) && !(one_axis < gate.above_of_axis)) {
    return;
  }
  const Sandwiches sandwiches(run);
  WiderIntervals wider("field_noise", estimate);
  const Eigen::Index p = run.set().coefficient_count();
  for (Eigen::Index k = 0; k < m; ++k) {
    for (Eigen::Index l = 1; l <= 3; ++l) {
      const Sandwich one = sandwiches.of(k, l);
      if (one.variance > 0.0 && one.degrees_of_freedom > 0.0) {
        wider.widen(p * k + l, one.variance, std::max(one.degrees_of_freedom, 1.0));
      }
    }
    wider.component().sd(k) = run.sigma(k) * std::sqrt(std::max(all.ratio, 1.0 / all.ratio));
  }
  wider.put();
}

// Lengthens intervals if the magnitude of the field, or the gain of all axes together, varies
// slowly over the run.
void add_field_wander(const Fit& run, AlongField along, FieldVariation& found, Estimate& estimate) {
  found.score = lag_one_score_along(along.deviations, along.hat_root, along.hat_squares);
  if (!(found.score > one_sided_5_percent)) {
    return;
  }
  along.hat_root.resize(0, 0);
  const Eigen::Index n = run.readings();
  const double size = std::sqrt(along.size.squaredNorm() / static_cast<double>(n));
  const CorrelatedFit fit =
      fit_with_common_ar1({.information = run.information(),
                           .squares = run.residuals().squaredNorm(),
                           .along = run.combined_columns(along.directions),
                           .deviations = along.deviations,
                           .sizes = along.size / size,
                           .places = Eigen::VectorXd::LinSpaced(n, 0.0, static_cast<double>(n - 1)),
                           .degrees_of_freedom = run.degrees_of_freedom()});
  found.correlation = fit.correlation;
  constexpr double slight = 0.1;
  if (!(fit.correlation > slight)) {
    return;
  }
  WiderIntervals wider("field_wander", estimate);
  const Eigen::Index p = run.set().coefficient_count();
  for (Eigen::Index k = 0; k < run.axes(); ++k) {
    for (Eigen::Index l = 1; l <= 3; ++l) {
      const Eigen::Index c = run.column_of(k, l);
      // The estimate is not changed. Its difference from the estimate with correlated noise is
      // added to the uncertainty.
      wider.widen(p * k + l, fit.covariance(c, c) + fit.estimate(c) * fit.estimate(c),
                  fit.degrees_of_freedom);
    }
  }
  wider.component().sd = Eigen::VectorXd::Constant(1, fit.correlation);
  wider.component().unit = "correlation";
  wider.put();
}

// Adds a note if the magnitude of the field varies, or if the cube is laid down differently each
// time. The scatter of the readings along the field and their correlation are tested together,
// because a magnitude that wanders increases both.
void note_field_scatter(const FieldVariation& found, Eigen::Index axes, Estimate& estimate) {
  constexpr double beyond_chance = 0.005;
  constexpr double of_one_sign = 0.004;
  constexpr double of_both = 0.012;
  constexpr double clear = 0.3;
  const NoiseRatio& all = found.all;
  const bool varies = found.p_value() < of_both || all.above < of_one_sign ||
                      found.one_axis * static_cast<double>(axes) < beyond_chance;
  if (varies && found.correlation > clear) {
    estimate.notes.push_back(
        {NoteCode::field,
         formatted("the components of consecutive readings along the field are correlated "
                   "(coefficient about {}): the magnitude of the field, or the gain of all axes "
                   "together, varies slowly. The sensitivities are valid for the field during the "
                   "run, and their intervals include this variation",
                   number_text(found.correlation, 1))});
  } else if (varies) {
    estimate.notes.push_back(
        {NoteCode::field,
         formatted("noise increases with the field: the scatter of the readings along the field is "
                   "{} times the scatter across the field. Check whether the magnitude of the "
                   "field, or the rate of the turntable, fluctuates. The intervals of the "
                   "sensitivities include this scatter",
                   number_text(std::sqrt(std::max(all.ratio, 1.0)), 2))});
  } else if (all.below < beyond_chance) {
    estimate.notes.push_back(
        {NoteCode::seats,
         formatted("the scatter of the readings across the field is {} times the scatter along the "
                   "field, as if the cube's orientation varied each time it is laid down: clean "
                   "its feet, the table and the fence. The intervals of the sensitivities include "
                   "this scatter",
                   number_text(std::sqrt(1.0 / std::max(all.ratio, 1e-6)), 2))});
  }
}

void add_field_scatter(const Fit& run, bool gains_differ, Estimate& estimate) {
  if (!can_be_looked_at(run)) {
    return;
  }
  FieldVariation found;
  if (!gains_differ) {  // gains that differ between blocks look like noise along the field
    add_field_noise(run, part_along(run, along_field(run)), found, estimate);
  }
  // along_field() is called a second time to save memory. Two results at the same time would need
  // more memory than any other step of a calibration.
  add_field_wander(run, along_field(run), found, estimate);
  if (!gains_differ) {
    note_field_scatter(found, run.axes(), estimate);
  }
}

CountedEstimate counted_field_scatter(const ScatterAnalysisInput& run, CountedEstimate so_far) {
  // The test is omitted if the fields differ in fewer than three directions (a transfer). It is
  // also omitted for averages of opposite readings, because they do not show the noise along the
  // field, and for coarsely rounded readings, because rounding errors look like noise.
  if (!run.is_transfer() && !run.method.averages_pairs &&
      !is_coarsely_rounded(run.fitted.set(), run.experiment.stated.resolution,
                           so_far.estimate.statistics.residual_sd)) {
    with_independent_readings(run, so_far, [&](const SolvedReadings& readings) {
      add_field_scatter(Fit(readings, so_far.estimate), so_far.gains_differ, so_far.estimate);
    });
  }
  return so_far;
}

}  // namespace

Cause field_scatter_cause() {
  return {.name = "field_scatter", .counted = counted_field_scatter};
}

}  // namespace axiscal
