// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/noise_model.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "calib/regression/factor.hpp"

namespace axiscal {
namespace {

constexpr std::size_t kinds = all_noise_kinds.size();

// A set of kinds of noise is a bit mask with one bit for each kind.
constexpr unsigned all_kinds = (1U << kinds) - 1U;

constexpr unsigned bit_of(NoiseKind kind) {
  return 1U << static_cast<unsigned>(kind);
}

// The price of a kind of noise is a penalty. The kind is added to the model only if this reduces
// the deviance by more than its price. Without prices, uncertain points would add kinds of noise by
// chance: a few such points are fitted equally well by flicker noise and by a random walk. A ramp
// has a higher price, because the last points of a random walk look like a ramp.
constexpr double price_of_a_kind = 8.0;
constexpr double price_of_a_ramp = 10.0;

double price_of(unsigned set) {
  double price = 0.0;
  for (const NoiseKind kind : all_noise_kinds) {
    const double own = kind == NoiseKind::ramp ? price_of_a_ramp : price_of_a_kind;
    price += (set & bit_of(kind)) != 0 ? own : 0.0;
  }
  return price;
}

struct Solution {
  Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(kinds));
  double cost = std::numeric_limits<double>::infinity();  // deviance plus prices of the kinds
};

constexpr std::size_t fewest_points = 3;

// @return points of a curve that are at least about an octave apart.
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

// These functions return the mean and the variance of ln(chi^2 / nu), if chi^2 has nu degrees of
// freedom. They are asymptotic expansions of digamma(x) - ln x and of trigamma(x) with x = nu / 2.
// For nu >= 1 their relative error is largest at nu = 1, where it is less than 1/12.
double mean_of_log(double nu) {
  return -1.0 / nu - 1.0 / (3.0 * nu * nu);
}
double variance_of_log(double nu) {
  return 2.0 / nu + 2.0 / (nu * nu) + 4.0 / (3.0 * nu * nu * nu);
}

double freedom_of(const AllanPoint& point) {
  const double fewest = point.fewest_degrees_of_freedom;
  return std::max(fewest > 0.0 ? fewest : point.degrees_of_freedom, 1.0);
}

// Fits kinds of noise to the Allan variances s_i of a curve by minimising their deviance,
//   D = sum nu_i (s_i / V_i - ln(s_i / V_i) - 1).
// Here V_i is the modelled variance of point i, and s_i is distributed as V_i chi^2 / nu_i. The
// model is V = A theta, where theta are the squares of the noise coefficients.
class CurveDeviance {
 public:
  // @param error  assumed relative error of the modelled variances.
  CurveDeviance(std::span<const AllanPoint> points, double error)
      : A_(static_cast<Eigen::Index>(points.size()), static_cast<Eigen::Index>(kinds)),
        variance_(A_.rows()),
        nu_(A_.rows()),
        start_(A_.rows()) {
    for (Eigen::Index i = 0; i < A_.rows(); ++i) {
      const AllanPoint& point = points[static_cast<std::size_t>(i)];
      variance_(i) = std::max(point.deviation * point.deviation, 1e-300);
      nu_(i) = 2.0 / (2.0 / freedom_of(point) + error * error);
      for (std::size_t k = 0; k < kinds; ++k) {
        A_(i, static_cast<Eigen::Index>(k)) = allan_variance_of(all_noise_kinds[k], point.tau_s);
      }
    }
    // The first weights are computed from the variances of the curve. A point with few degrees of
    // freedom may be far too low and would dominate the fit, so its first weight is made small.
    constexpr double well_known = 10.0;  // fewest degrees of freedom of a reliable point
    start_ = variance_;
    for (Eigen::Index i = 0; i < A_.rows(); ++i) {
      if (freedom_of(points[static_cast<std::size_t>(i)]) < well_known) {
        start_(i) = 1e3 * variance_.maxCoeff();
      }
    }
  }

  [[nodiscard]] const Eigen::MatrixXd& A() const { return A_; }

  // Fits all sets of the allowed kinds, and returns the solution with the smallest sum of deviance
  // and price.
  // @param fixed  squares of the coefficients that are held fixed; 0 for the others.
  // @param price  function that returns the price of a set.
  template <typename Price>
  [[nodiscard]] Solution least(unsigned allowed,
                               const Eigen::VectorXd& fixed,
                               const Price& price) const {
    const Eigen::VectorXd given = A_ * fixed;
    Solution best;
    for (unsigned set = 0; set <= all_kinds; ++set) {
      if ((set & ~allowed) != 0 || std::popcount(set) > A_.rows()) {
        continue;
      }
      if (const std::optional<Solution> one = scored(set, given);
          one && one->cost + price(set) < best.cost) {
        best = {.coefficients = one->coefficients + fixed, .cost = one->cost + price(set)};
      }
    }
    return best;
  }

 private:
  [[nodiscard]] double of(const Eigen::VectorXd& V) const {
    const Eigen::ArrayXd x = variance_.array() / V.array();
    return (nu_.array() * (x - x.log() - 1.0)).sum();
  }

  // Minimises the deviance over the coefficients of a set of kinds by Fisher scoring.
  // @param given  for each point, the sum of the modelled variances of the fixed kinds.
  // @return nullopt if a coefficient is negative or not determined by the points.
  [[nodiscard]] std::optional<Solution> scored(unsigned set, const Eigen::VectorXd& given) const {
    std::vector<Eigen::Index> columns;
    for (std::size_t k = 0; k < kinds; ++k) {
      if ((set >> k & 1U) != 0) {
        columns.push_back(static_cast<Eigen::Index>(k));
      }
    }
    Solution solution;
    if (columns.empty()) {
      solution.cost = given.minCoeff() > 0.0 ? of(given) : solution.cost;
      return solution;
    }
    const Eigen::MatrixXd own = A_(Eigen::all, columns);
    const auto variances = [&](const Eigen::VectorXd& theta) -> Eigen::VectorXd {
      return (given + own * theta).cwiseMax(1e-3 * variance_);
    };
    std::optional<Eigen::VectorXd> theta = step(own, given, start_);
    if (!theta) {
      return std::nullopt;
    }
    solution.cost = of(variances(*theta));
    constexpr int most_rounds = 40;
    constexpr double still = 1e-6;
    for (int round = 0; round < most_rounds; ++round) {
      std::optional<Eigen::VectorXd> next = step(own, given, variances(*theta));
      if (!next) {
        return std::nullopt;
      }
      double cost = of(variances(*next));
      constexpr int most_halvings = 6;
      for (int half = 0; half < most_halvings && cost > solution.cost; ++half) {
        *next = 0.5 * (*next + *theta);
        cost = of(variances(*next));
      }
      const double gain = solution.cost - cost;
      if (gain > 0.0) {
        theta = std::move(next);
        solution.cost = cost;
      }
      if (!(gain > still)) {
        break;
      }
    }
    if ((theta->array() < 0.0).any()) {
      return std::nullopt;
    }
    solution.coefficients(columns) = *theta;
    return solution;
  }

  // Solves a weighted least-squares problem for the squares of the coefficients.
  // @param V  variances at the points, from which the weights are computed.
  [[nodiscard]] std::optional<Eigen::VectorXd> step(const Eigen::MatrixXd& own,
                                                    const Eigen::VectorXd& given,
                                                    const Eigen::VectorXd& V) const {
    const Eigen::VectorXd weights = nu_.cwiseSqrt().cwiseQuotient(V);
    const Factor factor(weights.asDiagonal() * own);
    if (!factor.has_full_rank()) {
      return std::nullopt;
    }
    return factor.solve(weights.cwiseProduct(variance_ - given));
  }

  Eigen::MatrixXd A_;         // modelled variances for coefficients of 1; points x kinds
  Eigen::VectorXd variance_;  // Allan variances of the curve
  Eigen::VectorXd nu_;        // degrees of freedom, reduced for the error of the model
  Eigen::VectorXd start_;     // variances from which the first weights are computed
};

// A fit of the kinds of noise to points of a curve.
struct CurveFit {
  std::vector<AllanPoint> points;
  Solution solution;
  double error = 0.0;        // assumed relative error of the modelled variances
  double chi_squared = 0.0;  // sum of squared logarithmic residuals, each divided by its variance
  double dof = 0.0;
  double p_value = 0.0;
};

Eigen::VectorXd none_fixed() {
  return Eigen::VectorXd::Zero(static_cast<Eigen::Index>(kinds));
}

CurveFit fit_curve(std::span<const AllanPoint> points, double error) {
  CurveFit fit{.points = {points.begin(), points.end()}, .error = error};
  const CurveDeviance deviance(points, error);
  fit.solution = deviance.least(all_kinds, none_fixed(), price_of);
  const Eigen::VectorXd expected = deviance.A() * fit.solution.coefficients;
  // The residuals are differences of logarithms, so that a point far above the model contributes as
  // much to chi^2 as a point far below it.
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double nu = freedom_of(points[i]);
    const double variance = std::max(points[i].deviation * points[i].deviation, 1e-300);
    const double model = std::max(expected(static_cast<Eigen::Index>(i)), 1e-3 * variance);
    const double off = std::log(variance / model) - mean_of_log(nu);
    fit.chi_squared += off * off / (variance_of_log(nu) + error * error);
  }
  fit.dof = static_cast<double>(points.size()) -
            static_cast<double>((fit.solution.coefficients.array() > 0.0).count());
  fit.p_value =
      fit.dof > 0.0 ? chi_squared_upper_p(std::max(fit.chi_squared, 1e-12), fit.dof) : not_a_number;
  return fit;
}

// Fits the curve with an assumed relative error of the model. The error is found by bisection, so
// that chi^2 equals the degrees of freedom.
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

// The coefficient of white noise, determined from a stretch of the curve.
struct WhiteStretch {
  double coefficient = 0.0;  // coefficient N of white noise
  double relative_sd = 0.0;
};

// Finds the longest stretch of a curve over which tau times the Allan variance is constant.
std::optional<WhiteStretch> white_stretch(std::span<const AllanPoint> points) {
  constexpr double shortest = 12.0;  // smallest ratio of last to first tau
  constexpr double of_model = 0.06;  // assumed relative error of the variance
  constexpr double steepest = 0.2;   // largest slope of ln(tau * variance) over ln(tau)
  constexpr double by_chance = 0.05;
  constexpr double least_sd = 0.025;  // smallest relative sd of N; its interval is then +-5 %
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

// Computes the interval of one coefficient from the profile of the deviance. For each value of this
// coefficient, the profile is the smallest deviance over all choices of the other kinds of noise in
// the model and over all values of their coefficients. For independent points, the deviance at the
// ends of a 95 % interval is 3.84 above its minimum. The points of a curve are correlated, so
// larger rises are used (rise_of()).
class Profile {
 public:
  // @param fixed  squares of the coefficients that are held fixed; 0 for the others.
  Profile(const CurveDeviance& deviance, NoiseKind kind, const Eigen::VectorXd& fixed)
      : deviance_(deviance), kind_(kind), fixed_(fixed) {
    for (const NoiseKind one : all_noise_kinds) {
      others_ |= one != kind && !(fixed(static_cast<Eigen::Index>(one)) > 0.0) ? bit_of(one) : 0U;
    }
    const Solution best = without_or_with_ramp(others_ | bit_of(kind), fixed_);
    best_ = best.coefficients(static_cast<Eigen::Index>(kind));
    least_ = best.cost;
  }

  // @param rise   largest rise of the deviance above its minimum.
  // @param scale  square of a plausible coefficient, at which the search starts.
  // @return the largest square of the coefficient for which the deviance rises by at most `rise`.
  [[nodiscard]] double upper(double rise, double scale) const {
    double inside = best_;
    double outside = std::max(best_, scale);
    constexpr int most_doublings = 60;
    for (int i = 0; i < most_doublings && rise_at(outside) <= rise; ++i) {
      inside = outside;
      outside *= 2.0;
    }
    return between(inside, outside, rise);
  }

  // @return the smallest square of the coefficient for which the deviance rises by at most `rise`.
  [[nodiscard]] double lower(double rise) const {
    return rise_at(0.0) <= rise ? 0.0 : between(best_, 0.0, rise);
  }

 private:
  [[nodiscard]] double rise_at(double square) const {
    Eigen::VectorXd fixed = fixed_;
    fixed(static_cast<Eigen::Index>(kind_)) = square;
    return without_or_with_ramp(others_, fixed).cost - least_;
  }

  [[nodiscard]] Solution without_or_with_ramp(unsigned allowed,
                                              const Eigen::VectorXd& fixed) const {
    const auto price = [&](unsigned set) {
      return kind_ != NoiseKind::ramp && (set & bit_of(NoiseKind::ramp)) != 0 ? price_of_a_ramp
                                                                              : 0.0;
    };
    return deviance_.least(allowed, fixed, price);
  }

  [[nodiscard]] double between(double inside, double outside, double rise) const {
    constexpr int halvings = 12;
    for (int i = 0; i < halvings; ++i) {
      const double middle = 0.5 * (inside + outside);
      (rise_at(middle) <= rise ? inside : outside) = middle;
    }
    return 0.5 * (inside + outside);
  }

  const CurveDeviance& deviance_;
  NoiseKind kind_;
  Eigen::VectorXd fixed_;
  unsigned others_ = 0;
  double best_ = 0.0;  // square of the coefficient with the smallest deviance
  double least_ = 0.0;
};

// @param is_found  true if the fitted coefficient is positive.
// @return the rise of the deviance above its minimum that marks the ends of a 95 % interval. The
//         values come from simulations with 3e4 and 1e5 samples, in which at least 93 % of the
//         intervals contained the true value.
double rise_of(NoiseKind kind, bool is_found) {
  switch (kind) {
    case NoiseKind::random_walk:
    case NoiseKind::ramp:
      return 13.0;
    case NoiseKind::bias_instability:
      return is_found ? 11.0 : 12.0;
    case NoiseKind::quantisation:
    case NoiseKind::white:
      break;
  }
  return is_found ? 10.0 : 12.0;
}

// Computes the coefficients and their intervals from a fit.
// @param fixed  squares of the coefficients that were held fixed; 0 for the others.
NoiseModel model_of(const CurveFit& fit, const Eigen::VectorXd& fixed) {
  // If the kinds of noise do not describe the curve, the half-width of an interval is at least one
  // tenth of the value, because the coefficients of resampled records scatter by this much.
  const double shortest_half_width = fit.error > 0.0 ? 0.1 : 0.0;
  NoiseModel model{.p_value = fit.p_value,
                   .from_tau_s = fit.points.front().tau_s,
                   .model_error = 0.5 * fit.error};
  const CurveDeviance deviance(fit.points, fit.error);
  for (std::size_t k = 0; k < kinds; ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    const NoiseKind kind = all_noise_kinds[k];
    NoiseCoefficient one{.kind = kind, .value = std::sqrt(fit.solution.coefficients(at))};
    if (!(fixed(at) > 0.0)) {
      double scale = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < fit.points.size(); ++i) {
        scale = std::min(scale, std::pow(fit.points[i].deviation, 2) /
                                    deviance.A()(static_cast<Eigen::Index>(i), at));
      }
      const double rise = rise_of(kind, one.value > 0.0);
      const Profile profile(deviance, kind, fixed);
      one.low = std::min(std::sqrt(profile.lower(rise)), (1.0 - shortest_half_width) * one.value);
      one.high = std::max(std::sqrt(profile.upper(rise, std::max(scale, 1e-300))),
                          (1.0 + shortest_half_width) * one.value);
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
    throw DomainError("fit_noise: the curve must have at least three points");
  }
  const std::span<const AllanPoint> all(octaves);
  const std::size_t most_left_out = std::min<std::size_t>(4, octaves.size() - fewest_points);
  constexpr double by_chance = 0.05;
  CurveFit best;
  for (std::size_t left_out = 0; left_out <= most_left_out && !(best.p_value > by_chance);
       ++left_out) {
    CurveFit fit = fit_curve(all.subspan(left_out), 0.0);
    if (left_out == 0 || fit.dof >= 1.0) {  // without degrees of freedom a fit cannot be tested
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
  constexpr auto white = static_cast<Eigen::Index>(NoiseKind::white);
  constexpr double denied = 0.7;
  const double fitted_N = std::sqrt(best.solution.coefficients(white));
  Eigen::VectorXd fixed = none_fixed();
  const bool is_denied = stretch && fitted_N < denied * stretch->coefficient;
  if (is_denied) {
    fixed(white) = stretch->coefficient * stretch->coefficient;
    best.solution = CurveDeviance(best.points, best.error)
                        .least(all_kinds & ~bit_of(NoiseKind::white), fixed, price_of);
  }
  NoiseModel model = model_of(best, fixed);
  if (is_denied) {
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
    throw DomainError("deviation_at: the curve is empty");
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
    throw DomainError("coefficient_by_slope: there are no points");
  }
  double sum = 0.0;
  for (const AllanPoint& point : points) {
    sum += std::log(point.deviation) - 0.5 * std::log(allan_variance_of(kind, point.tau_s));
  }
  return std::exp(sum / static_cast<double>(points.size()));
}

Dwell best_dwell(std::span<const AllanPoint> curve) {
  if (curve.empty()) {
    throw DomainError("best_dwell: the curve is empty");
  }
  constexpr double well_known = 20.0;  // fewest degrees of freedom of a reliable point
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
