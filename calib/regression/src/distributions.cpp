// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/distributions.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <boost/math/tools/toms748_solve.hpp>

#include "axiscal/core/not_a_number.hpp"

namespace axiscal {
namespace {

// Quantiles overflow if the degrees of freedom are almost 0; the result is then infinity instead of
// an exception. Doubles are not promoted to long doubles, because these are three times as slow and
// change no digit that is shown.
using Quiet = boost::math::policies::policy<
    boost::math::policies::promote_double<false>,
    boost::math::policies::overflow_error<boost::math::policies::ignore_error>,
    boost::math::policies::underflow_error<boost::math::policies::ignore_error>,
    boost::math::policies::evaluation_error<boost::math::policies::ignore_error>>;
using StudentT = boost::math::students_t_distribution<double, Quiet>;
using FisherF = boost::math::fisher_f_distribution<double, Quiet>;
using ChiSquared = boost::math::chi_squared_distribution<double, Quiet>;
using Normal = boost::math::normal_distribution<double, Quiet>;

// A cache of the last results of a function of two numbers. It saves time because the function is
// called with the same arguments for all parameters of an axis.
class LastAnswers {
 public:
  template <typename Function>
  double operator()(double first, double second, const Function& function) {
    for (const Answer& answer : answers_) {
      if (answer.first == first && answer.second == second) {
        return answer.value;
      }
    }
    Answer& oldest = answers_[next_++ % answers_.size()];
    oldest = {.first = first, .second = second, .value = function()};
    return oldest.value;
  }

 private:
  struct Answer {
    double first = not_a_number;
    double second = not_a_number;
    double value = not_a_number;
  };
  std::array<Answer, 8> answers_{};
  std::size_t next_ = 0;
};

}  // namespace

double student_t_factor(double coverage, double degrees_of_freedom) {
  if (!(degrees_of_freedom > 0.0) || !(coverage > 0.0 && coverage < 1.0)) {
    return not_a_number;
  }
  thread_local LastAnswers answers;
  return answers(coverage, degrees_of_freedom, [&] {
    const StudentT distribution(degrees_of_freedom);
    const double factor =
        boost::math::quantile(boost::math::complement(distribution, 0.5 * (1.0 - coverage)));
    // Squares of larger factors overflow. Boost 1.83 limits such a quantile to the square root of
    // the largest double, but Boost 1.74 returns infinity.
    constexpr double largest = 1e150;
    return factor < largest ? factor : std::numeric_limits<double>::infinity();
  });
}

namespace {

// Returns an approximation of 1 / nu for a coverage factor, where nu is the degrees of freedom. The
// factor is a series in 1 / nu that begins with the quantile z of the normal distribution. The
// first terms of this series are inverted.
double guessed_inverse(double factor, double coverage) {
  const double z = boost::math::quantile(boost::math::complement(Normal(), 0.5 * (1.0 - coverage)));
  const double z2 = z * z;
  const double a = z * (z2 + 1.0) / 4.0;
  const double b = z * ((5.0 * z2 + 16.0) * z2 + 3.0) / 96.0;
  const double c = z * (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / 384.0;
  double inverse = (factor - z) / a;
  constexpr int rounds = 4;
  for (int round = 0; round < rounds; ++round) {
    const double value = z + inverse * (a + inverse * (b + inverse * c));
    inverse -= (value - factor) / (a + inverse * (2.0 * b + inverse * 3.0 * c));
  }
  return inverse;
}

// Finds the root of a smooth function by the secant method, from a close guess. Returns nullopt if
// the method leaves the interval (low, high) or does not converge.
template <typename Function>
std::optional<double> root_by_secants(const Function& function,
                                      double guess,
                                      double low,
                                      double high) {
  const auto is_inside = [&](double x) { return x > low && x < high; };
  constexpr double beside = 1.0 + 1e-4;
  double before = guess * beside;
  double here = guess;
  if (!is_inside(before) || !is_inside(here)) {
    return std::nullopt;
  }
  double at_before = function(before);
  double last_step = std::abs(here);
  constexpr int most_rounds = 6;
  for (int round = 0; round < most_rounds; ++round) {
    const double at_here = function(here);
    const double step = at_here * (here - before) / (at_here - at_before);
    before = std::exchange(here, here - step);
    at_before = at_here;
    if (!is_inside(here)) {
      return std::nullopt;
    }
    // The remaining error is approximately the product of the last two steps.
    constexpr double rounding = 1e-15;
    if (std::abs(step * last_step) <= rounding * here * here) {
      return here;
    }
    last_step = std::abs(step);
  }
  return std::nullopt;
}

double found_freedom_of_factor(double factor, double coverage) {
  // The search uses 1 / nu, because t is nearly linear in 1 / nu.
  constexpr double as_good_as_infinite = 1e6;
  constexpr double fewest = 0.05;
  // If nu is as_good_as_infinite, 1 / nu has this relative rounding error. The interval therefore
  // begins above 1 / as_good_as_infinite, so that the result for this nu is infinity.
  constexpr double rounding = 1e-6;
  double low = (1.0 + rounding) / as_good_as_infinite;
  double high = 1.0 / fewest;
  // The distribution function is much cheaper than its inverse.
  const auto beyond = [&](double inverse) {
    return student_t_two_sided_p(factor, 1.0 / inverse) - (1.0 - coverage);
  };
  const double guess = guessed_inverse(factor, coverage);
  if (const std::optional<double> root = root_by_secants(beyond, guess, low, high)) {
    const double nu = 1.0 / *root;
    const double whole = std::round(nu);  // for a single axis, nu is an integer
    constexpr double last_digits = 1e-13;
    return std::abs(nu - whole) <= last_digits * nu ? whole : nu;
  }
  // Moves one end of the interval to `to` if the root stays inside the interval. Returns the value
  // of the function at this end of the interval.
  const auto narrowed = [&](double& end, double to, double sign) {
    const double value = to > low && to < high ? beyond(to) : 0.0;
    end = sign * value > 0.0 ? to : end;
    return sign * value > 0.0 ? value : beyond(end);
  };
  constexpr double about = 0.02;
  const double at_low = narrowed(low, guess * (1.0 - about), -1.0);
  const double at_high = narrowed(high, guess * (1.0 + about), 1.0);
  if (!(at_low < 0.0)) {
    return std::numeric_limits<double>::infinity();
  }
  if (!(at_high > 0.0)) {
    return fewest;
  }
  std::uintmax_t most_rounds = 60;
  constexpr int digits = 48;
  const auto [below, above] = boost::math::tools::toms748_solve(
      beyond, low, high, at_low, at_high, boost::math::tools::eps_tolerance<double>(digits),
      most_rounds);
  return 2.0 / (below + above);
}

}  // namespace

double freedom_of_factor(double factor, double coverage) {
  if (std::isnan(factor)) {
    return not_a_number;
  }
  thread_local LastAnswers answers;
  return answers(factor, coverage, [&] { return found_freedom_of_factor(factor, coverage); });
}

double student_t_two_sided_p(double t, double degrees_of_freedom) {
  if (!(degrees_of_freedom > 0.0) || std::isnan(t)) {
    return not_a_number;
  }
  const StudentT distribution(degrees_of_freedom);
  return 2.0 * boost::math::cdf(boost::math::complement(distribution, std::abs(t)));
}

namespace {

// Returns true if `whole` is odd. `whole` must be a whole number in the range of int.
bool is_odd(double whole) {
  return (static_cast<int>(whole) & 1) == 1;
}

// Computes the regularised incomplete beta function I_x(a, b) as a finite sum, for a and b that are
// multiples of 1/2. The sum starts at I_x(a_0, b_0), where a_0 and b_0 are 1/2 or 1. Each step of 1
// in b adds a term, and each step of 1 in a subtracts a term. The subtraction loses digits if the
// result is small. A series of positive terms then replaces the sum. Source: Abramowitz & Stegun,
// Handbook of Mathematical Functions (1964), 26.5.4, 26.5.16, 26.6.4-26.6.8.
double incomplete_beta(double x, double twice_a, double twice_b) {
  const double y = 1.0 - x;
  const bool half_a = is_odd(twice_a);
  const bool half_b = is_odd(twice_b);
  double a = half_a ? 0.5 : 1.0;
  double b = half_b ? 0.5 : 1.0;
  constexpr double two_over_pi = 2.0 * std::numbers::inv_pi;
  // The four cases of the starting values a_0 and b_0: both are 1/2; only b_0 is 1/2; only a_0 is
  // 1/2; both are 1.
  double value = half_a && half_b ? two_over_pi * std::atan2(std::sqrt(x), std::sqrt(y))
                 : half_b         ? 1.0 - std::sqrt(y)
                 : half_a         ? std::sqrt(x)
                                  : x;
  // The value of x^a y^b / B(a, b). Each pass of a loop increases a or b by 1 and multiplies this
  // value by the corresponding factor.
  double power = (half_a ? std::sqrt(x) : x) * (half_b ? std::sqrt(y) : y) *
                 (half_a && half_b   ? std::numbers::inv_pi
                  : half_a || half_b ? 0.5
                                     : 1.0);
  for (; b < 0.5 * twice_b; b += 1.0) {
    value += power / b;
    power *= y * (a + b) / b;
  }
  for (; a < 0.5 * twice_a; a += 1.0) {
    value -= power / a;
    power *= x * (a + b) / a;
  }
  constexpr double loses_no_digits = 0.01;
  if (value > loses_no_digits) {
    return value;
  }
  constexpr double last_digit = 1e-17;
  double term = 1.0 / a;
  double sum = term;
  for (double k = 0.0; term > last_digit * sum; k += 1.0) {
    term *= x * (a + b + k) / (a + 1.0 + k);
    sum += term;
  }
  return power * sum;
}

}  // namespace

double f_upper_p(double f, double numerator, double denominator) {
  if (!(f >= 0.0) || !(numerator > 0.0) || !(denominator > 0.0)) {
    return not_a_number;
  }
  if (std::isinf(f)) {
    return 0.0;
  }
  if (numerator == 2.0) {
    return std::exp(-0.5 * denominator * std::log1p(2.0 * f / denominator));
  }
  constexpr double few_terms = 60.0;
  if (numerator + denominator <= few_terms && std::floor(numerator) == numerator &&
      std::floor(denominator) == denominator) {
    return incomplete_beta(denominator / (denominator + numerator * f), denominator, numerator);
  }
  const FisherF distribution(numerator, denominator);
  return boost::math::cdf(boost::math::complement(distribution, f));
}

double f_quantile(double probability, double numerator, double denominator) {
  if (!(probability > 0.0 && probability < 1.0) || !(numerator > 0.0) || !(denominator > 0.0)) {
    return not_a_number;
  }
  return boost::math::quantile(FisherF(numerator, denominator), probability);
}

double chi_squared_upper_p(double x, double degrees_of_freedom) {
  if (!(x >= 0.0) || !(degrees_of_freedom > 0.0)) {
    return not_a_number;
  }
  constexpr double few_terms = 40.0;
  if (degrees_of_freedom <= few_terms && std::floor(degrees_of_freedom) == degrees_of_freedom &&
      !is_odd(degrees_of_freedom)) {
    double term = std::exp(-0.5 * x);  // term 0 of a Poisson distribution with mean x / 2
    double sum = term;
    for (double j = 1.0; j < 0.5 * degrees_of_freedom; j += 1.0) {
      term *= 0.5 * x / j;
      sum += term;
    }
    return sum;
  }
  const ChiSquared distribution(degrees_of_freedom);
  return boost::math::cdf(boost::math::complement(distribution, x));
}

double FisherSum::term(double p) {
  return -2.0 * std::log(std::max(p, 1e-300));
}

void FisherSum::add(double p) {
  sum_ += term(p);
  count_ += 1.0;
}

double FisherSum::p_value(double loss) const {
  return chi_squared_upper_p(std::max(sum_, 1e-12) / loss, 2.0 * count_ / loss);
}

double chi_squared_quantile(double probability, double degrees_of_freedom) {
  if (!(probability > 0.0 && probability < 1.0) || !(degrees_of_freedom > 0.0)) {
    return not_a_number;
  }
  return boost::math::quantile(ChiSquared(degrees_of_freedom), probability);
}

double normal_quantile(double probability) {
  if (!(probability > 0.0 && probability < 1.0)) {
    return not_a_number;
  }
  return boost::math::quantile(Normal(), probability);
}

}  // namespace axiscal
