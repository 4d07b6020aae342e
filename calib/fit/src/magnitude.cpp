// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/magnitude.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/LU>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/least_squares.hpp"
#include "axiscal/calib/magnitude_fit.hpp"
#include "axiscal/calib/orientation_quality.hpp"
#include "axiscal/calib/robust.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/units.hpp"
#include "calib/fit/src/axis_regression.hpp"
#include "calib/fit/src/ellipsoid.hpp"
#include "calib/fit/src/long_recording.hpp"
#include "calib/fit/src/recording_noise.hpp"
#include "calib/record/parameter_names.hpp"
#include "calib/regression/factor.hpp"
#include "calib/regression/further_columns.hpp"
#include "calib/regression/jackknife.hpp"
#include "calib/regression/reweighting.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// A fitted ellipsoid and its statistics.
struct EllipsoidFit {
  Ellipsoid at;
  LinearisedEllipsoid linear;
  Eigen::MatrixXd unscaled_covariance;  // 9 x 9
  Eigen::VectorXd leverage;             // n
  Eigen::VectorXd robust;               // n: robust weights; empty if the fit is not robust
  Eigen::MatrixXd further;              // n x q: columns of q further terms, such as a lag
  double condition_number = 1.0;
  double sd = 0.0;  // scatter of a reading of weight 1, in the cloud's units
  double dof = 0.0;
};

std::vector<std::string> names_of(const ReadingSet& set) {
  std::vector<std::string> names = names_of_columns(set.axes, {0}, {});
  for (const auto& [i, j] : ellipsoid_entries) {
    const std::string& axis = set.axes[static_cast<std::size_t>(i)];
    names.push_back(names_of_columns({axis}, {1 + j}, {}).front());
  }
  return names;
}

void require_open_nothing(const ReadingSet& set, const LinearisedEllipsoid& linear) {
  std::vector<std::string> open =
      undetermined_column_names(confounded_columns(linear.jacobian, 1e-6, 1e-3), names_of(set));
  if (!open.empty()) {
    const std::string list = joined(open);
    throw RankDeficientError(
        formatted(
            "the orientations do not determine {}; the method 'magnitude' requires at least nine "
            "different directions, spread so that they determine one ellipsoid. A cube on a level "
            "table gives only six directions: add oblique orientations, or give the design points",
            list),
        std::move(open));
  }
}

// Throws if many readings lie in few orientations. Each orientation is then a cloud of noise, and
// the shape of the clouds would determine the cross-axis terms.
void require_enough_places(const EllipsoidCloud& cloud) {
  constexpr double apart_rad = 10.0 * rad_per_deg;
  constexpr double tight_rad = 3.0 * rad_per_deg;
  const Eigen::RowVector3d least = cloud.v.colwise().minCoeff();
  const Eigen::RowVector3d most = cloud.v.colwise().maxCoeff();
  const Eigen::RowVector3d half = (0.5 * (most - least)).cwiseMax(1e-300);
  const Eigen::MatrixX3d directions =
      ((cloud.v.rowwise() - 0.5 * (least + most)).array().rowwise() / half.array())
          .matrix()
          .rowwise()
          .normalized();
  // A place is a group of directions within apart_rad of the first direction in it.
  std::vector<Eigen::Vector3d> first;
  std::vector<Eigen::Vector3d> sums;
  std::vector<std::size_t> place_of(static_cast<std::size_t>(cloud.size()));
  for (Eigen::Index i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d direction = directions.row(i).transpose();
    std::size_t place = 0;
    while (place < first.size() && first[place].dot(direction) < std::cos(apart_rad)) {
      ++place;
    }
    if (place == first.size()) {
      if (place + 1 >= static_cast<std::size_t>(ellipsoid_parameters)) {
        return;
      }
      first.push_back(direction);
      sums.emplace_back(Eigen::Vector3d::Zero());
    }
    sums[place] += direction;
    place_of[static_cast<std::size_t>(i)] = place;
  }
  constexpr Eigen::Index fewest_each = 3;
  if (cloud.size() < fewest_each * static_cast<Eigen::Index>(first.size())) {
    return;
  }
  Eigen::Index loose = 0;
  for (Eigen::Index i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d middle = sums[place_of[static_cast<std::size_t>(i)]].normalized();
    loose += middle.dot(directions.row(i).transpose()) < std::cos(tight_rad) ? 1 : 0;
  }
  if (20 * loose < cloud.size()) {
    throw RankDeficientError(
        formatted(
            "the readings are in {} orientations, but the method 'magnitude' requires nine or "
            "more: add oblique orientations, or give the rest face of each reading (column 'rest')",
            first.size()),
        {});
  }
}

EllipsoidFit describe(const EllipsoidCloud& cloud,
                      const Ellipsoid& at,
                      const Eigen::VectorXd& robust) {
  EllipsoidFit fit{.at = at, .linear = linearise_ellipsoid(cloud, at), .robust = robust};
  const LeastSquaresDesign design(fit.linear.jacobian, Eigen::VectorXd(), cloud.names);
  fit.unscaled_covariance = design.unscaled_covariance();
  fit.leverage = design.leverage();
  fit.condition_number = design.condition_number();
  fit.dof = static_cast<double>(cloud.size() - ellipsoid_parameters);
  fit.sd = std::sqrt(fit.linear.residuals.squaredNorm() / fit.dof);
  return fit;
}

EllipsoidFit fit_cloud(const EllipsoidCloud& cloud, bool robust) {
  Ellipsoid at = converged_ellipsoid(cloud, ellipsoid_start(cloud), {});
  if (!robust) {
    return describe(cloud, at, {});
  }
  BisquareWeights bisquare;
  const Eigen::VectorXd weights = reweight_until_converged(
      cloud.size(), 1,
      [&] {
        const EllipsoidFit now = describe(cloud, at, {});
        bisquare = bisquare_weights(now.linear.residuals, now.leverage,
                                    static_cast<double>(ellipsoid_parameters), 1e-15);
        return bisquare.weights;
      },
      [&](const Eigen::MatrixXd& robust_weights) {
        at = converged_ellipsoid(cloud, at, robust_weights);
      });
  EllipsoidFit fit = describe(cloud, at, weights);
  fit.sd = bisquare.scale * std::sqrt(bisquare.variance_factor);
  return fit;
}

// Returns the readings that the fit predicts, without noise.
Eigen::MatrixXd on_the_ellipsoid(const EllipsoidCloud& cloud, const Ellipsoid& at) {
  const Eigen::Matrix3d S = at.A.inverse();
  Eigen::MatrixXd exact(cloud.size(), 3);
  for (Eigen::Index i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d f = at.A * (cloud.v.row(i).transpose() - at.b);
    exact.row(i) = at.b + S * f.normalized();
  }
  return exact;
}

// Simulates noise that has the standard deviation 1 for a reading of weight 1.
Eigen::MatrixXd noise_of(const EllipsoidCloud& cloud, RandomStream& random) {
  const Eigen::Matrix3d root = Whitening(cloud.noise).root();
  Eigen::MatrixXd noise(cloud.size(), 3);
  for (Eigen::Index i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d e = random.normals<3>();
    noise.row(i) = root * e / cloud.root_weights(i);
  }
  return noise;
}

// Returns the bias that noise causes in the estimate: the mean of fits to simulated readings, minus
// the fit. It is proportional to the variance of the noise.
EllipsoidParameters bias_by_bootstrap(const EllipsoidCloud& all, const EllipsoidFit& fit) {
  constexpr int pairs = 40;
  // Repeated readings in the same directions do not change the bias, so this many rows are enough.
  constexpr Eigen::Index most_rows = 2000;
  const Eigen::Index step = 1 + (all.size() - 1) / most_rows;
  EllipsoidCloud cloud = all;
  const Eigen::Index rows = (all.size() + step - 1) / step;
  cloud.v = all.v(Eigen::seqN(0, rows, step), Eigen::seqN(0, all.v.cols()));
  cloud.root_weights = all.root_weights(Eigen::seqN(0, rows, step));
  const Eigen::MatrixXd exact = on_the_ellipsoid(cloud, fit.at);
  RandomStream random(1, 0);
  EllipsoidCloud made = cloud;
  EllipsoidParameters sum = EllipsoidParameters::Zero();
  for (int t = 0; t < pairs; ++t) {
    // The same noise is used with both signs. The odd part of its effect cancels, and the bias of
    // order sigma^2 remains.
    const Eigen::MatrixXd noise = fit.sd * noise_of(cloud, random);
    for (const double sign : {1.0, -1.0}) {
      made.v = exact + sign * noise;
      const Ellipsoid again = converged_ellipsoid(made, fit.at, {});
      sum.head<3>() += again.b - fit.at.b;
      for (std::size_t e = 0; e < ellipsoid_entries.size(); ++e) {
        const auto [i, j] = ellipsoid_entries[e];
        sum(3 + static_cast<Eigen::Index>(e)) += again.A(i, j) - fit.at.A(i, j);
      }
    }
  }
  return sum / (2.0 * pairs);
}

// The correlation of consecutive residuals, and the absolute value of this correlation divided by
// the standard deviation that it has for white noise.
struct LagOneCorrelation {
  double correlation = 0.0;
  double beyond_chance = 0.0;
};

constexpr double alike_by_more_than_chance = 3.5;  // limit for LagOneCorrelation::beyond_chance

LagOneCorrelation likeness_of_neighbours(const Eigen::VectorXd& r) {
  const double correlation =
      r.head(r.size() - 1).dot(r.tail(r.size() - 1)) / std::max(r.squaredNorm(), 1e-300);
  return {.correlation = correlation,
          .beyond_chance = std::abs(correlation) * std::sqrt(static_cast<double>(r.size()))};
}

// Returns true if the residuals may be independent normal noise: consecutive residuals are not
// correlated, and there is no outlier. If an instrument is turned by hand, consecutive residuals
// usually are correlated.
bool is_plain_noise(const EllipsoidFit& fit) {
  const Eigen::VectorXd& r = fit.linear.residuals;
  const auto n = static_cast<double>(r.size());
  const double largest = r.cwiseAbs().maxCoeff() / fit.sd;
  return likeness_of_neighbours(r).beyond_chance < alike_by_more_than_chance &&
         n * student_t_two_sided_p(largest, fit.dof) > 1e-3;
}

// Returns the derivative of the biases and sensitivities with respect to the parameters of the
// ellipsoid, which are b and six entries of A = S^-1; 12 x 9. The rows are the bias and the three
// sensitivities of each axis.
Eigen::MatrixXd change_of_response(const Ellipsoid& at, MagnitudeShape shape) {
  const Eigen::Matrix3d S = at.A.inverse();
  Eigen::MatrixXd T = Eigen::MatrixXd::Zero(12, ellipsoid_parameters);
  for (int k = 0; k < 3; ++k) {
    T(4 * k, k) = 1.0;
  }
  for (std::size_t e = 0; e < ellipsoid_entries.size(); ++e) {
    const auto [i, j] = ellipsoid_entries[e];
    Eigen::Matrix3d dA = Eigen::Matrix3d::Zero();
    dA(i, j) = 1.0;
    if (shape == MagnitudeShape::symmetric) {
      dA(j, i) = 1.0;
    }
    const Eigen::Matrix3d dS = -S * dA * S;
    for (int k = 0; k < 3; ++k) {
      T.block<3, 1>(4 * k + 1, 3 + static_cast<Eigen::Index>(e)) = dS.row(k).transpose();
    }
  }
  return T;
}

// Returns the residuals and all columns of the fit: those of the nine parameters, then the further
// columns. In a robust fit the residuals r are replaced by pseudo-residuals psi(r) / mean(psi').
// Least squares of these has the errors of the robust fit. With psi(r) = w r and bisquare weights
// w = (1 - u^2)^2, psi' is w - 4 u^2 sqrt(w).
// Source: Huber & Ronchetti, Robust Statistics, 2nd ed. (2009), sec. 7.6.
Linearised all_columns(const EllipsoidFit& fit) {
  Linearised all = fit.linear;
  if (fit.further.cols() > 0) {
    all.jacobian.resize(fit.linear.jacobian.rows(), ellipsoid_parameters + fit.further.cols());
    all.jacobian << fit.linear.jacobian, fit.further;
  }
  if (fit.robust.size() > 0) {
    const Eigen::ArrayXd root = fit.robust.array().sqrt();
    const double slope = (root * (5.0 * root - 4.0)).mean();  // mean of psi'
    all.residuals.array() *= fit.robust.array() / slope;
  }
  return all;
}

// Extends a derivative to all columns of the fit.
// @param T  derivative of quantities with respect to the nine parameters. The further columns do
//           not change these quantities.
// @return T, followed by zeros for the further columns.
Eigen::MatrixXd with_further(const Eigen::MatrixXd& T, const EllipsoidFit& fit) {
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(T.rows(), T.cols() + fit.further.cols());
  all.leftCols(T.cols()) = T;
  return all;
}

// Leaves out one tenth of the readings at a time, and returns the changes of the biases and
// sensitivities; 12 x 10, one column for each tenth, in the cloud's units.
// @param independent  receives the equivalent number of independent readings.
Eigen::MatrixXd changes_by_order(const EllipsoidFit& fit,
                                 const Eigen::MatrixXd& T,
                                 double& independent) {
  const Linearised at_solution = all_columns(fit);
  // The longest correlation length of the deviations and of their components along each axis. The
  // components are needed because slow noise of an axis becomes fast noise of |f| while the
  // instrument turns.
  double longest = correlation_length(at_solution.residuals);
  for (Eigen::Index k = 0; k < 3; ++k) {
    longest = std::max(
        longest,
        correlation_length(at_solution.residuals.cwiseProduct(at_solution.jacobian.col(k))));
  }
  independent = static_cast<double>(at_solution.residuals.size()) / longest;
  return with_further(T, fit) * block_jackknife_changes(at_solution);
}

// The derivative of the readings with respect to each further term of the fit; n x 3 for each term.
using TermChanges = std::vector<Eigen::MatrixX3d>;

// Returns the terms that correct a quadratic response: -f_k^2 in the reading of each axis k.
TermChanges squared_terms(const EllipsoidCloud& cloud, const Ellipsoid& at) {
  TermChanges terms(3, Eigen::MatrixX3d::Zero(cloud.size(), 3));
  for (Eigen::Index i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d f = (at.A * (cloud.v.row(i).transpose() - at.b)).normalized();
    for (int k = 0; k < 3; ++k) {
      terms[static_cast<std::size_t>(k)](i, k) = -f(k) * f(k);
    }
  }
  return terms;
}

// Returns the term for the lag of a low-pass filter. Let the field turn by an angle a from one
// reading to the next. A filter with the time constant tau, measured in readings, then shortens the
// reading by the fraction tau^2 a^2 / 2. The term restores the length; its coefficient is tau^2.
TermChanges lag_term(const EllipsoidCloud& cloud, const Ellipsoid& at) {
  const Eigen::MatrixX3d f = (cloud.v.rowwise() - at.b.transpose()) * at.A.transpose();
  const Eigen::Index n = cloud.size();
  const Eigen::VectorXd turned = (f.bottomRows(n - 1) - f.topRows(n - 1)).rowwise().squaredNorm();
  Eigen::VectorXd share(n);
  share << turned(0), turned;
  const Eigen::MatrixX3d along = f.rowwise().normalized() * at.A.inverse().transpose();
  return {0.5 * (along.array().colwise() * share.array()).matrix()};
}

// Returns the derivative of |f| with respect to each term; n x number of terms.
Eigen::MatrixXd changes_with(const TermChanges& terms, const EllipsoidFit& fit) {
  Eigen::MatrixXd columns(fit.linear.jacobian.rows(), static_cast<Eigen::Index>(terms.size()));
  for (std::size_t j = 0; j < terms.size(); ++j) {
    // The derivative of |f| with respect to a reading is minus the one with respect to the bias.
    columns.col(static_cast<Eigen::Index>(j)) =
        -fit.linear.jacobian.leftCols<3>().cwiseProduct(terms[j]).rowwise().sum();
  }
  return columns;
}

// Like fit_cloud(), with further terms.
// @param terms_of  function that returns the terms for a cloud and an ellipsoid.
// @param names     the names of the terms, for error messages.
// @return the coefficients of the terms, in the cloud's units.
template <typename TermsOf>
Eigen::VectorXd fit_with_terms(const EllipsoidCloud& cloud,
                               const TermsOf& terms_of,
                               const std::vector<std::string>& names,
                               EllipsoidFit& fit) {
  EllipsoidCloud straight = cloud;
  TermChanges terms = terms_of(straight, fit.at);
  Eigen::VectorXd sizes = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(terms.size()));
  constexpr int most_rounds = 30;
  constexpr double still = 1e-12;
  double step = 1.0;
  for (int round = 0; round < most_rounds && step > still; ++round) {
    const std::optional<FurtherColumns> further =
        fit_further_columns(fit.linear.jacobian, -fit.linear.residuals, changes_with(terms, fit));
    if (!further) {
      throw RankDeficientError(
          formatted("the orientations do not determine {} together with bias and sensitivity; add "
                    "orientations, or fit without these terms",
                    joined(names)),
          names);
    }
    sizes += further->estimate;
    step = further->estimate.cwiseAbs().maxCoeff();
    fit.at = moved_ellipsoid(fit.at, further->change, cloud.shape);
    terms = terms_of(straight, fit.at);
    straight.v = cloud.v;
    for (std::size_t j = 0; j < terms.size(); ++j) {
      straight.v += sizes(static_cast<Eigen::Index>(j)) * terms[j];
    }
    fit = describe(straight, fit.at, {});
    fit.unscaled_covariance =
        further->covariance.topLeftCorner<ellipsoid_parameters, ellipsoid_parameters>();
    fit.sd = further->residual_sd;
    fit.dof = further->degrees_of_freedom;
  }
  fit.further = changes_with(terms, fit);
  return sizes;
}

// @return true if consecutive changes of the field from reading to reading are correlated, as they
//         are while an instrument turns. Readings at rest may be in any order, so their changes are
//         not correlated.
bool turned_steadily(const EllipsoidCloud& cloud, const Ellipsoid& at) {
  constexpr double alike = 0.5;  // correlation of consecutive steps
  const Eigen::MatrixX3d f = (cloud.v.rowwise() - at.b.transpose()) * at.A.transpose();
  const Eigen::Index steps = f.rows() - 1;
  const Eigen::MatrixX3d step = f.bottomRows(steps) - f.topRows(steps);
  return step.topRows(steps - 1).cwiseProduct(step.bottomRows(steps - 1)).sum() >
         alike * step.squaredNorm();
}

// Fits the lag of a low-pass filter. Returns the largest fraction by which the filter shortens a
// reading; nullopt if the lag is not significant.
std::optional<double> fit_lag(const EllipsoidCloud& cloud, EllipsoidFit& fit) {
  constexpr double false_lag = 0.001;
  if (!turned_steadily(cloud, fit.at)) {
    return std::nullopt;
  }
  const TermChanges terms = lag_term(cloud, fit.at);
  const std::optional<FurtherColumns> lag =
      fit_further_columns(fit.linear.jacobian, -fit.linear.residuals, changes_with(terms, fit),
                          correlation_length(fit.linear.residuals));
  if (!lag || !(lag->p_value < false_lag) || !(lag->estimate(0) > 0.0)) {
    return std::nullopt;
  }
  const auto of_given = [&](const EllipsoidCloud&, const Ellipsoid& at) {
    return lag_term(cloud, at);  // the angles are those of the uncorrected readings
  };
  const Eigen::VectorXd size = fit_with_terms(cloud, of_given, {"the lag"}, fit);
  return size(0) *
         (lag_term(cloud, fit.at).front() * fit.at.A.transpose()).rowwise().norm().maxCoeff();
}

// Tests for curvature of the response and stores the result in the estimate.
void test_squares(const ReadingSet& set,
                  const EllipsoidCloud& cloud,
                  const EllipsoidFit& fit,
                  double size,
                  Estimate& estimate) {
  // Correlated deviations count as fewer independent readings.
  const std::optional<FurtherColumns> squares =
      set.robust ? std::nullopt
                 : fit_further_columns(all_columns(fit).jacobian, -fit.linear.residuals,
                                       changes_with(squared_terms(cloud, fit.at), fit),
                                       correlation_length(fit.linear.residuals));
  if (squares) {
    estimate.curvature =
        CurvatureTest{.p_value = squares->p_value, .bends = size * squares->estimate};
  }
}

// Widens the intervals if consecutive readings are correlated.
// @param to_parameters  derivative of the biases and sensitivities with respect to the nine
//                       parameters of the ellipsoid, 12 x 9.
void add_noise_of_order(const EllipsoidFit& fit,
                        const Eigen::MatrixXd& to_parameters,
                        Estimate& estimate) {
  Linearised all = all_columns(fit);
  if (fit.robust.size() > 0) {
    std::vector<Eigen::Index> kept;
    for (Eigen::Index i = 0; i < fit.robust.size(); ++i) {
      if (fit.robust(i) > 0.0) {
        kept.push_back(i);
      }
    }
    all.residuals = all.residuals(kept).eval();
    all.jacobian = all.jacobian(kept, Eigen::all).eval();
  }
  const Eigen::MatrixX3d along = all.jacobian.leftCols<3>();
  const std::optional<CorrelatedFit> noise = noise_of_recording(all, along);
  constexpr double slight = 0.1;
  if (!noise || !(noise->correlation > slight)) {
    return;
  }
  // The estimate is not changed. Its difference from the estimate with correlated noise is added to
  // the uncertainty.
  const Eigen::MatrixXd C = noise->covariance + noise->estimate * noise->estimate.transpose();
  const Eigen::MatrixXd to = with_further(to_parameters, fit);
  add_correlation((to * C * to.transpose()).diagonal().cwiseSqrt(), noise->degrees_of_freedom,
                  estimate.statistics);
  if (lag_one_score(all.jacobian, all.residuals, along) > told_alike_above) {
    estimate.notes.push_back(
        {NoteCode::correlation,
         formatted(
             "Consecutive readings are correlated (coefficient about {}). The intervals include "
             "this correlation{}",
             number_text(noise->correlation, 1),
             fit.linear.residuals.size() < 60 ? ", but only roughly, because the recording is short"
                                              : "")});
  }
}

// Returns the likely cause of the failure for the error message: a dead axis, scatter, or too few
// orientations. The analysis fits a sphere, because scatter distorts a fitted ellipsoid.
std::string cause_of(const ReadingSet& set, const EllipsoidCloud& cloud) {
  const Eigen::RowVector3d range = cloud.v.colwise().maxCoeff() - cloud.v.colwise().minCoeff();
  Eigen::Index least = 0;
  constexpr double dead = 0.02;
  if (range.minCoeff(&least) < dead * range.maxCoeff()) {
    return formatted("the readings of axis {} hardly change: check whether the axis works",
                     set.axes[static_cast<std::size_t>(least)]);
  }
  const Ellipsoid sphere = sphere_through(cloud);
  const Eigen::MatrixXd fields =
      (cloud.v.rowwise() - sphere.b.transpose()) * Eigen::Matrix3d(sphere.A).transpose();
  const OrientationQuality quality = orientation_quality(fields, 1.0);
  const std::string covered = number_text(std::round(100.0 * quality.coverage));
  constexpr double well_covered = 0.7;
  constexpr double about_one_point = 0.25;
  constexpr double much_scatter = 0.02;
  if (quality.coverage >= well_covered && quality.fit_error > about_one_point) {
    return "all readings are close to one point, not on a sphere: turn the instrument between "
           "readings";
  }
  if (quality.coverage >= well_covered && quality.fit_error > much_scatter) {
    const LagOneCorrelation alike = likeness_of_neighbours(fields.rowwise().norm().array() - 1.0);
    return formatted(
        "the readings cover {} % of the sphere within 30 degrees, but their magnitudes scatter by "
        "{} %{}; take the readings at rest, in one place, away from iron and currents",
        covered, number_text(100.0 * quality.fit_error, 2),
        alike.beyond_chance > alike_by_more_than_chance
            ? formatted(", and consecutive magnitudes are correlated (correlation {}): the "
                        "instrument was moving, or the field differs from place to place, as is "
                        "usual indoors",
                        number_text(alike.correlation, 2))
            : "");
  }
  return formatted(
      "the orientations cover too little of the sphere ({} % of the sphere is within 30 degrees of "
      "a reading); turn the instrument so that each of its sides faces the field once",
      covered);
}

// Throws if many different ellipsoids fit the readings. This happens if the orientations are close
// together or in one plane, or if the readings scatter too much.
void require_determined(const ReadingSet& set,
                        const EllipsoidCloud& cloud,
                        const EllipsoidFit& fit,
                        double bias_in_se) {
  constexpr double largest_relative_se = 0.1;
  constexpr double largest_bias_in_se = 1.5;  // a first-order correction is valid only for a small
                                              // bias
  const Eigen::VectorXd se = fit.sd * fit.unscaled_covariance.diagonal().cwiseSqrt();
  const double size = fit.at.A.norm() / std::sqrt(3.0);
  const double worst = std::max(se.head<3>().maxCoeff() * size, se.tail<6>().maxCoeff() / size);
  if (worst > largest_relative_se || bias_in_se > largest_bias_in_se) {
    throw RefusedError(formatted(
        "method 'magnitude': the readings do not separate bias and sensitivity ({}): {}",
        worst > largest_relative_se ? formatted("standard errors of {} % of the field",
                                                number_text(std::round(100.0 * worst)))
                                    : formatted("the noise shifts the coefficients by {} standard "
                                                "errors",
                                                number_text(std::round(10.0 * bias_in_se) / 10.0)),
        cause_of(set, cloud)));
  }
}

}  // namespace

Estimate estimate_magnitude(const ReadingSet& set,
                            double F,
                            MagnitudeShape shape,
                            const Eigen::Matrix3d& noise,
                            bool squares) {
  if (set.axis_count() != 3) {
    throw RefusedError(formatted(
        "the method 'magnitude' needs an instrument with three axes, not {}", set.axis_count()));
  }
  if (set.size() < ellipsoid_parameters + 1) {
    throw RefusedError(
        formatted("the method 'magnitude' needs at least ten readings in different orientations, "
                  "but there are {}",
                  set.size()));
  }
  require_response(set);
  const Eigen::Vector3d lowest = set.response.colwise().minCoeff();
  const Eigen::Vector3d highest = set.response.colwise().maxCoeff();
  const Eigen::Vector3d middle = 0.5 * (lowest + highest);
  const double size = 0.5 * (highest - lowest).maxCoeff();
  EllipsoidCloud cloud{.v = (set.response.rowwise() - middle.transpose()) / size,
                       .root_weights = set.weights.col(0).cwiseSqrt(),
                       .noise = 3.0 / noise.trace() * noise,
                       .shape = shape,
                       .names = names_of(set)};
  require_enough_places(cloud);
  require_open_nothing(set, linearise_ellipsoid(cloud, ellipsoid_start(cloud)));
  EllipsoidFit fit = fit_cloud(cloud, set.robust);
  require_open_nothing(set, fit.linear);
  Eigen::VectorXd squared;    // squared terms at full field, in units of `cloud`; empty: not fitted
  std::optional<double> lag;  // largest relative loss of magnitude; nullopt if no lag is found
  if (squares) {
    squared = fit_with_terms(cloud, squared_terms, {"x.k2", "y.k2", "z.k2"}, fit);
  } else if (!set.robust) {
    lag = fit_lag(cloud, fit);
  }
  const Eigen::VectorXd se = fit.sd * fit.unscaled_covariance.diagonal().cwiseSqrt();
  const EllipsoidParameters bias = bias_by_bootstrap(cloud, fit);
  const double bias_in_se = (bias.array().abs() / se.array().max(1e-300)).maxCoeff();
  constexpr double worth_correcting = 0.1;  // smallest corrected bias, in standard errors
  constexpr double rounding =
      1e-12;  // relative to the field; a smaller scatter is rounding and causes no bias
  const bool plain_noise = fit.sd > rounding && !set.robust && is_plain_noise(fit);
  const bool correct = bias_in_se > worth_correcting && plain_noise;
  require_determined(set, cloud, fit, plain_noise ? bias_in_se : 0.0);
  if (correct) {
    fit.at = moved_ellipsoid(fit.at, -bias, shape);
  }

  Estimate estimate;
  if (bias_in_se > worth_correcting && fit.sd > rounding) {
    const std::string size_in_se = number_text(std::round(bias_in_se * 100.0) / 100.0);
    estimate.notes.push_back(
        {NoteCode::estimate_bias,
         correct
             ? formatted("the coefficients were corrected for the error that noise causes in the "
                         "fit of an ellipsoid, by up to {} standard errors (parametric bootstrap)",
                         size_in_se)
             : formatted(
                   "the coefficients were not corrected for the error that noise causes in the fit "
                   "of an ellipsoid, because the residuals are not independent noise. For "
                   "independent noise this error would be up to {} standard errors",
                   size_in_se)});
  }
  RegressionRows rows = rows_of_readings(set);
  estimate.statistics = blank_statistics(set, rows);
  FitStatistics& statistics = estimate.statistics;
  const Eigen::Matrix3d S = fit.at.A.inverse();
  estimate.response.bias = middle + size * fit.at.b;
  estimate.response.sensitivity = size / F * S;
  const Eigen::MatrixXd T = change_of_response(fit.at, shape);
  Eigen::VectorXd units(12);
  for (int k = 0; k < 3; ++k) {
    units.segment<4>(4 * k) << size, size / F, size / F, size / F;
  }
  statistics.covariance = fit.sd * fit.sd * units.asDiagonal() * T * fit.unscaled_covariance *
                          T.transpose() * units.asDiagonal();
  statistics.degrees_of_freedom.setConstant(fit.dof);
  statistics.residual_sd = size * fit.sd * cloud.noise.diagonal().cwiseSqrt();
  statistics.r_squared.setConstant(not_a_number);
  statistics.variance_inflation.setConstant(not_a_number);
  statistics.condition_number = fit.condition_number;
  const ResidualDiagnostics diagnostics =
      set.robust ? scale_residuals(fit.linear.residuals, fit.leverage, fit.sd,
                                   static_cast<double>(ellipsoid_parameters))
                 : diagnose_residuals(fit.linear.residuals, fit.leverage, fit.dof,
                                      static_cast<double>(ellipsoid_parameters));
  for (Eigen::Index k = 0; k < 3; ++k) {
    put_diagnostics(statistics, k, fit.leverage, diagnostics,
                    set.robust ? fit.robust : Eigen::VectorXd());
  }
  if (is_long_recording(set.size())) {
    double independent = 0.0;
    const Eigen::MatrixXd changes = units.asDiagonal() * changes_by_order(fit, T, independent);
    add_long_correlation(jackknife_uncertainty(changes), statistics, estimate.notes);
    for (std::string& remark : remarks_on_length(independent)) {
      estimate.notes.push_back({NoteCode::correlation, std::move(remark)});
    }
  }
  if (lag) {
    estimate.notes.push_back(
        {NoteCode::method,
         formatted("The readings lag behind the field, as after a low-pass filter: while the "
                   "instrument turns, their magnitude is up to {} % too small. The fit corrects "
                   "for this. Turn more slowly, or filter less",
                   number_text(100.0 * *lag, 2))});
  }
  if (squared.size() > 0) {
    estimate.notes.push_back(
        {NoteCode::method,
         formatted("squared terms were fitted together with bias and sensitivity. At full field, "
                   "the squared terms are {}, {}, {}. The coefficients in the record do not "
                   "include these terms",
                   number_text(size * squared(0), 2), number_text(size * squared(1), 2),
                   number_text(size * squared(2), 2))});
  } else {
    test_squares(set, cloud, fit, size, estimate);
  }
  add_noise_of_order(fit, units.asDiagonal() * T, estimate);
  return estimate;
}

MagnitudeFit fit_magnitude(const Eigen::Ref<const Eigen::MatrixX3d>& readings,
                           double F,
                           MagnitudeShape shape,
                           const Eigen::Ref<const Eigen::VectorXd>& weights) {
  if (readings.rows() <= ellipsoid_parameters || !readings.allFinite()) {
    throw RefusedError(
        formatted("fit_magnitude needs ten finite readings or more, not {}", readings.rows()));
  }
  const Eigen::Vector3d lowest = readings.colwise().minCoeff();
  const Eigen::Vector3d highest = readings.colwise().maxCoeff();
  const Eigen::Vector3d middle = 0.5 * (lowest + highest);
  const double size = 0.5 * (highest - lowest).maxCoeff();
  EllipsoidCloud cloud{.v = (readings.rowwise() - middle.transpose()) / size,
                       .root_weights = Eigen::VectorXd::Ones(readings.rows()),
                       .noise = Eigen::Matrix3d::Identity(),
                       .shape = shape};
  if (weights.size() > 0) {
    cloud.root_weights = weights.cwiseSqrt();
  }
  const Ellipsoid at = converged_ellipsoid(cloud, ellipsoid_start(cloud), {});
  MagnitudeFit fit;
  fit.response = {.bias = middle + size * at.b, .sensitivity = size / F * at.A.inverse()};
  fit.degrees_of_freedom = static_cast<double>(readings.rows() - ellipsoid_parameters);
  // The sum of squares of |f| - F, weighted only with the weights of the readings.
  const double rss = F * F * ellipsoid_cost(cloud, at, cloud.root_weights);
  fit.residual_sd = std::sqrt(rss / fit.degrees_of_freedom);
  return fit;
}

LinearResponse refit_magnitude(const Eigen::MatrixXd& readings,
                               double F,
                               MagnitudeShape shape,
                               const LinearResponse& start) {
  const double size = F * start.sensitivity.norm();
  EllipsoidCloud cloud{.v = readings / size,
                       .root_weights = Eigen::VectorXd::Ones(readings.rows()),
                       .noise = Eigen::Matrix3d::Identity(),
                       .shape = shape};
  Ellipsoid at{.b = start.bias / size};
  at.A = (Eigen::Matrix3d(start.sensitivity) * (F / size)).inverse();
  at = converged_ellipsoid(cloud, at, {});
  return {.bias = size * at.b, .sensitivity = size / F * at.A.inverse()};
}

}  // namespace axiscal
