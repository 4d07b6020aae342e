// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/noise_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <Eigen/QR>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"

namespace axiscal {
namespace {

constexpr std::size_t kinds = all_noise_kinds.size();

// Non-negative weighted least squares by trying every set of columns: there are 31. A further kind
// of noise must earn its place: flicker and random walk, say, fit a few uncertain points alike.
constexpr double price_of_a_kind = 4.0;  // in chi^2

struct Solution {
  Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(kinds));
  Eigen::VectorXd standard_errors = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(kinds));
  double cost = std::numeric_limits<double>::infinity();
};

Solution solve_not_negative(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  Solution best;
  for (unsigned set = 1; set < (1U << kinds); ++set) {
    std::vector<Eigen::Index> columns;
    for (std::size_t k = 0; k < kinds; ++k) {
      if ((set >> k & 1U) != 0) {
        columns.push_back(static_cast<Eigen::Index>(k));
      }
    }
    const auto p = static_cast<Eigen::Index>(columns.size());
    if (p > A.rows()) {
      continue;
    }
    Eigen::MatrixXd part = A(Eigen::seqN(0, A.rows()), columns);
    const Eigen::VectorXd lengths = part.colwise().norm();
    if (!(lengths.minCoeff() > 0.0)) {
      continue;  // a kind that is not looked for
    }
    part = part * lengths.cwiseInverse().asDiagonal();
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(part);
    if (qr.rank() < p) {
      continue;
    }
    const Eigen::VectorXd x = qr.solve(b).cwiseQuotient(lengths);
    if ((x.array() < 0.0).any()) {
      continue;
    }
    const double cost = (A(Eigen::seqN(0, A.rows()), columns) * x - b).squaredNorm() +
                        price_of_a_kind * static_cast<double>(p);
    if (cost < best.cost) {
      best.cost = cost;
      best.coefficients.setZero();
      best.standard_errors.setZero();
      const Eigen::MatrixXd inverse = qr.solve(Eigen::MatrixXd::Identity(part.rows(), part.rows()));
      for (Eigen::Index j = 0; j < p; ++j) {
        best.coefficients(columns[static_cast<std::size_t>(j)]) = x(j);
        best.standard_errors(columns[static_cast<std::size_t>(j)]) =
            inverse.row(j).norm() / lengths(j);
      }
    }
  }
  return best;
}

constexpr std::size_t fewest_points = 3;

// The points of a curve that are about an octave apart, or more.
std::vector<AllanPoint> octaves_of(std::span<const AllanPoint> curve) {
  constexpr double octave = 1.9;
  std::vector<AllanPoint> octaves;
  for (const AllanPoint& point : curve) {
    if (octaves.empty() || point.tau_s >= octave * octaves.back().tau_s) {
      octaves.push_back(point);
    }
  }
  if (octaves.size() < fewest_points) {
    octaves.assign(curve.begin(), curve.end());
  }
  return octaves;
}

// Mean and variance of the logarithm of chi^2 / nu: digamma(x) - ln x and trigamma(x), x = nu / 2,
// by their expansions, from nu = 1 on to a twelfth.
double mean_of_log(double nu) {
  return -1.0 / nu - 1.0 / (3.0 * nu * nu);
}
double variance_of_log(double nu) {
  return 2.0 / nu + 2.0 / (nu * nu) + 4.0 / (3.0 * nu * nu * nu);
}

// A fit of the kinds to points of a curve.
struct CurveFit {
  std::vector<AllanPoint> points;
  Solution solution;
  Eigen::MatrixXd A;         // what a coefficient of 1 makes of each variance
  double error = 0.0;        // of the model, relative, of the variance
  double chi_squared = 0.0;  // by the points' own scatter and that error
  double dof = 0.0;
  double p_value = 0.0;
};

CurveFit fit_curve(std::span<const AllanPoint> points, double error) {
  const auto n = static_cast<Eigen::Index>(points.size());
  CurveFit fit{.points = {points.begin(), points.end()},
               .A = Eigen::MatrixXd(n, static_cast<Eigen::Index>(kinds)),
               .error = error};
  Eigen::VectorXd variance(n);
  Eigen::VectorXd relative_sd(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const AllanPoint& point = points[static_cast<std::size_t>(i)];
    variance(i) = std::max(point.deviation * point.deviation, 1e-300);
    relative_sd(i) = std::sqrt(2.0 / std::max(point.degrees_of_freedom, 1.0) + error * error);
    for (std::size_t k = 0; k < kinds; ++k) {
      fit.A(i, static_cast<Eigen::Index>(k)) = allan_variance_of(all_noise_kinds[k], point.tau_s);
    }
  }
  // Weights by the curve itself first, then by the fit: else points that happen to be low count
  // more. At the start those of few degrees of freedom, which may be very low, hardly count.
  constexpr double well_known = 10.0;  // degrees of freedom
  Eigen::VectorXd expected = variance;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (points[static_cast<std::size_t>(i)].degrees_of_freedom < well_known) {
      expected(i) = 1e3 * variance.maxCoeff();
    }
  }
  constexpr int rounds = 6;
  for (int round = 0; round < rounds; ++round) {
    const Eigen::VectorXd weights = relative_sd.cwiseProduct(expected).cwiseInverse();
    fit.solution = solve_not_negative(weights.asDiagonal() * fit.A, weights.cwiseProduct(variance));
    expected = (fit.A * fit.solution.coefficients).cwiseMax(1e-3 * variance);
  }
  // In logarithms a curve far above the model counts as one far below.
  for (Eigen::Index i = 0; i < n; ++i) {
    const double nu = std::max(points[static_cast<std::size_t>(i)].degrees_of_freedom, 1.0);
    const double off = std::log(variance(i) / expected(i)) - mean_of_log(nu);
    fit.chi_squared += off * off / (variance_of_log(nu) + error * error);
  }
  fit.dof = static_cast<double>(n - (fit.solution.coefficients.array() > 0.0).count());
  fit.p_value =
      fit.dof > 0.0 ? chi_squared_upper_p(std::max(fit.chi_squared, 1e-12), fit.dof) : not_a_number;
  return fit;
}

// The error of the model with which chi^2 is its degrees of freedom, by bisection.
CurveFit with_model_error(std::span<const AllanPoint> points) {
  double low = 0.0;
  double high = 1e-3;
  constexpr double most = 10.0;
  const auto is_enough = [](const CurveFit& fit) { return !(fit.chi_squared > fit.dof); };
  CurveFit fit = fit_curve(points, high);
  while (!is_enough(fit) && high < most) {
    low = high;
    high *= 2.0;
    fit = fit_curve(points, high);
  }
  constexpr int halvings = 20;
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (low + high);
    CurveFit next = fit_curve(points, middle);
    if (is_enough(next)) {
      high = middle;
      fit = std::move(next);
    } else {
      low = middle;
    }
  }
  fit.p_value = fit_curve(points, 0.0).p_value;
  return fit;
}

// What a stretch of the curve says of white noise.
struct WhiteStretch {
  double coefficient = 0.0;  // N
  double relative_sd = 0.0;
};

// The longest stretch over which tau times the variance stays the same.
std::optional<WhiteStretch> white_stretch(std::span<const AllanPoint> points) {
  constexpr double shortest = 12.0;  // ratio of its ends: four octaves as points are chosen
  constexpr double of_model = 0.06;  // of the variance: 3 % of the deviation
  constexpr double steepest = 0.2;   // of the variance: 0.1 of the deviation
  constexpr double by_chance = 0.05;
  constexpr double least_sd = 0.025;  // with which twice the sd is 5 %
  std::optional<WhiteStretch> found;
  double longest = shortest;
  for (std::size_t first = 0; first < points.size(); ++first) {
    double w = 0.0;
    double wx = 0.0;
    double wy = 0.0;
    double wxx = 0.0;
    double wxy = 0.0;
    double wyy = 0.0;
    for (std::size_t last = first; last < points.size(); ++last) {
      const AllanPoint& point = points[last];
      if (!(point.deviation > 0.0)) {
        break;
      }
      const double nu = std::max(point.degrees_of_freedom, 1.0);
      const double weight = 1.0 / (variance_of_log(nu) + of_model * of_model);
      const double x = std::log(point.tau_s);
      const double y = std::log(point.deviation * point.deviation * point.tau_s) - mean_of_log(nu);
      w += weight;
      wx += weight * x;
      wy += weight * y;
      wxx += weight * x * x;
      wxy += weight * x * y;
      wyy += weight * y * y;
      const double length = point.tau_s / points[first].tau_s;
      if (last < first + 3 || length < longest) {
        continue;
      }
      const double chi_squared = std::max(wyy - wy * wy / w, 1e-12);
      const double slope = (wxy - wx * wy / w) / (wxx - wx * wx / w);
      if (std::abs(slope) <= steepest &&
          chi_squared_upper_p(chi_squared, static_cast<double>(last - first)) > by_chance) {
        longest = length;
        found = {.coefficient = std::exp(0.5 * wy / w),
                 .relative_sd = std::max(0.5 / std::sqrt(w), least_sd)};
      }
    }
  }
  return found;
}

// The other kinds, of what is left of the variances beside white noise.
Solution solve_beside_white(const CurveFit& fit, double white) {
  const auto n = static_cast<Eigen::Index>(fit.points.size());
  constexpr auto column = static_cast<Eigen::Index>(NoiseKind::white);
  Eigen::MatrixXd A = fit.A;
  A.col(column).setZero();  // no fit takes it
  Eigen::VectorXd left(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const AllanPoint& point = fit.points[static_cast<std::size_t>(i)];
    const double variance = std::max(point.deviation * point.deviation, 1e-300);
    const double weight =
        1.0 / (std::sqrt(2.0 / std::max(point.degrees_of_freedom, 1.0) + fit.error * fit.error) *
               variance);
    left(i) = weight * (variance - white * white / point.tau_s);
    A.row(i) *= weight;
  }
  return solve_not_negative(A, left);
}

NoiseModel model_of(const CurveFit& fit) {
  constexpr double coverage = 2.0 * 1.959963984540054;
  // Resampled, coefficients of curves that the kinds do not describe scatter by as much.
  const double shortest_half_width = fit.error > 0.0 ? 0.1 : 0.0;
  NoiseModel model{.p_value = fit.p_value,
                   .from_tau_s = fit.points.front().tau_s,
                   .model_error = 0.5 * fit.error};
  for (std::size_t k = 0; k < kinds; ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    const double square = fit.solution.coefficients(at);
    const double se = coverage * fit.solution.standard_errors(at);
    NoiseCoefficient one{.kind = all_noise_kinds[k], .value = std::sqrt(square)};
    if (square > 0.0) {
      one.low =
          std::min(std::sqrt(std::max(0.0, square - se)), (1.0 - shortest_half_width) * one.value);
      one.high = std::max(std::sqrt(square + se), (1.0 + shortest_half_width) * one.value);
    } else {
      // Where it would reach half of the curve's lowest share, it would be seen.
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < fit.points.size(); ++i) {
        least = std::min(least, 0.5 * std::pow(fit.points[i].deviation, 2) /
                                    fit.A(static_cast<Eigen::Index>(i), at));
      }
      one.high = std::sqrt(least);
    }
    model.coefficients.push_back(one);
  }
  return model;
}

}  // namespace

std::string noise_name(NoiseKind kind) {
  static constexpr std::array<const char*, kinds> names = {
      "quantisation", "white", "bias_instability", "random_walk", "ramp"};
  return names[static_cast<std::size_t>(kind)];
}

double allan_variance_of(NoiseKind kind, double tau_s) {
  switch (kind) {
    case NoiseKind::quantisation:
      return 3.0 / (tau_s * tau_s);
    case NoiseKind::white:
      return 1.0 / tau_s;
    case NoiseKind::bias_instability:
      return 2.0 * std::numbers::ln2 / std::numbers::pi;
    case NoiseKind::random_walk:
      return tau_s / 3.0;
    case NoiseKind::ramp:
      break;
  }
  return 0.5 * tau_s * tau_s;
}

double NoiseModel::coefficient(NoiseKind kind) const {
  return coefficients.at(static_cast<std::size_t>(kind)).value;
}

double NoiseModel::deviation_at(double tau_s) const {
  double variance = 0.0;
  for (const NoiseCoefficient& one : coefficients) {
    variance += one.value * one.value * allan_variance_of(one.kind, tau_s);
  }
  return std::sqrt(variance);
}

NoiseModel fit_noise(std::span<const AllanPoint> curve) {
  const std::vector<AllanPoint> octaves = octaves_of(curve);
  if (octaves.size() < fewest_points) {
    throw DomainError("fit_noise: three points of the curve or more are needed");
  }
  const std::span<const AllanPoint> all(octaves);
  const std::size_t most_left_out = std::min<std::size_t>(4, octaves.size() - fewest_points);
  constexpr double by_chance = 0.05;
  CurveFit best;
  for (std::size_t left_out = 0; left_out <= most_left_out && !(best.p_value > by_chance);
       ++left_out) {
    CurveFit fit = fit_curve(all.subspan(left_out), 0.0);
    if (left_out == 0 || fit.dof >= 1.0) {  // with nothing left over nothing is tested
      best = std::move(fit);
    }
  }
  if (best.p_value <= by_chance) {
    best.error = std::numeric_limits<double>::infinity();
    for (std::size_t left_out = 0; left_out <= most_left_out; ++left_out) {
      const CurveFit fit = with_model_error(all.subspan(left_out));
      if (fit.dof >= 1.0 && fit.error < best.error) {
        best = fit;
      }
    }
  }
  const std::optional<WhiteStretch> stretch = white_stretch(all);
  NoiseModel model = model_of(best);
  constexpr double denied = 0.7;
  if (stretch && model.coefficient(NoiseKind::white) < denied * stretch->coefficient) {
    best.solution = solve_beside_white(best, stretch->coefficient);
    model = model_of(best);
    const double N = stretch->coefficient;
    model.coefficients[static_cast<std::size_t>(NoiseKind::white)] = {
        .kind = NoiseKind::white,
        .value = N,
        .low = N * (1.0 - 2.0 * stretch->relative_sd),
        .high = N * (1.0 + 2.0 * stretch->relative_sd)};
    model.white_by_stretch = true;
  }
  return model;
}

double deviation_at(std::span<const AllanPoint> curve, double tau_s) {
  if (curve.empty()) {
    throw DomainError("deviation_at: points of the curve are needed");
  }
  if (curve.size() == 1) {
    return curve.front().deviation;
  }
  std::size_t after = 1;
  while (after + 1 < curve.size() && curve[after].tau_s < tau_s) {
    ++after;
  }
  const AllanPoint& a = curve[after - 1];
  const AllanPoint& b = curve[after];
  const double share = std::log(tau_s / a.tau_s) / std::log(b.tau_s / a.tau_s);
  if (!(a.deviation > 0.0) || !(b.deviation > 0.0)) {
    return std::max(a.deviation + share * (b.deviation - a.deviation), 0.0);
  }
  return a.deviation * std::pow(b.deviation / a.deviation, share);
}

double coefficient_by_slope(NoiseKind kind, std::span<const AllanPoint> points) {
  if (points.empty()) {
    throw DomainError("coefficient_by_slope: points of the curve are needed");
  }
  double sum = 0.0;
  for (const AllanPoint& point : points) {
    sum += std::log(point.deviation) - 0.5 * std::log(allan_variance_of(kind, point.tau_s));
  }
  return std::exp(sum / static_cast<double>(points.size()));
}

Dwell best_dwell(std::span<const AllanPoint> curve) {
  if (curve.empty()) {
    throw DomainError("best_dwell: points of the curve are needed");
  }
  constexpr double well_known = 20.0;  // degrees of freedom
  std::size_t known = 0;
  while (known < curve.size() && curve[known].degrees_of_freedom >= well_known) {
    ++known;
  }
  const std::span<const AllanPoint> used = known >= fewest_points ? curve.first(known) : curve;
  const auto least = std::min_element(
      used.begin(), used.end(),
      [](const AllanPoint& a, const AllanPoint& b) { return a.deviation < b.deviation; });
  Dwell dwell{.best_s = least->tau_s,
              .deviation = least->deviation,
              .sensible_s = least->tau_s,
              .sensible_deviation = least->deviation,
              .beyond_record = least + 1 == used.end()};
  const double good_enough = 1.1 * least->deviation;
  for (auto point = least; point != used.begin() && least->deviation > 0.0; --point) {
    const AllanPoint& before = *(point - 1);
    if (before.deviation <= good_enough) {
      dwell.sensible_s = before.tau_s;
      dwell.sensible_deviation = before.deviation;
      continue;
    }
    const double share =
        std::log(good_enough / before.deviation) / std::log(point->deviation / before.deviation);
    dwell.sensible_s = before.tau_s * std::pow(point->tau_s / before.tau_s, share);
    dwell.sensible_deviation = good_enough;
    break;
  }
  return dwell;
}

}  // namespace axiscal
