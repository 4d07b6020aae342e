// SPDX-License-Identifier: Apache-2.0
#include "detection.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "axiscal/calib/deletion_fit.hpp"
#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/variance_components.hpp"
#include "mistake_kind.hpp"

namespace axiscal {
namespace {

// Nested F tests take the axes' noise as equal, or of a stated ratio, and are held against this
// level over all classes; as the tests of a class overlap, 0.6 % of good runs are called bad (MC).
constexpr double false_alarm = 0.016;
constexpr double classes = 6.0;
constexpr double worth_a_look = 0.04;  // probability in the quick tests, before any refit
// Below this probability of the axes' scatters their noise clearly differs.
constexpr double unequal_below = 0.01;
// And above this nothing says so.
constexpr double may_be_equal = 0.5;
constexpr double false_alarm_by_axis = 0.001;
// Where each reading is judged by the others, that test and those of other mistakes share the
// level.
constexpr double false_alarm_of_deletion = 0.003;
constexpr double false_alarm_of_others = 0.008;

double equality_p_value(const HypothesisFit& fit) {
  return equal_variances_p(fit.rss.cwiseQuotient(fit.degrees_of_freedom), fit.degrees_of_freedom);
}

// The smallest probability of the quick tests: one reading deleted.
double single_p(const SuspectRun& run, const HypothesisFit& fit) {
  double largest = 0.0;  // one test's largest drop has the smallest probability
  for (std::size_t i = 0; i < run.count(); ++i) {
    largest = std::max(largest, run.drop_without(fit, {i}));
  }
  return std::min(1.0, static_cast<double>(run.n()) * nested_f_p(fit.total(), fit.dof(), largest,
                                                                 static_cast<double>(run.m())));
}

// The same of the kinds that have a quick test of their own.
double added_p(const SuspectRun& run, const HypothesisFit& fit) {
  double smallest = 1.0;
  for (const MistakeKind& kind : mistake_kinds()) {
    if (kind.quick_p != nullptr) {
      smallest = std::min(smallest, kind.quick_p(run, fit));
    }
  }
  return smallest;
}

// Whether the axes' noise clearly differs once the worst readings are out; all fits anew then,
// twice: which readings are the worst of a quiet axis shows only once a noisy one counts less.
bool weigh_axes(SuspectRun& run) {
  const auto clean = [&]() -> const HypothesisFit& {
    return run.best_pair().fitted ? run.best_pair() : run.without(run.by_deletion().front());
  };
  if (!clean().fitted || !(equality_p_value(clean()) < unequal_below)) {
    return false;
  }
  constexpr int rounds = 2;
  for (int round = 0; round < rounds && clean().fitted; ++round) {
    run.weigh_axes_by(HypothesisFit(clean()));
  }
  return true;
}

// A noisy axis looks like a mistake in a few of its readings. What may be that counts less: where
// the scatters of the axes differ (`equality`, before the hypothesis), and where it takes its sum
// of squares from an axis that scatters more than the others even after it. Tuned (MC) so that
// good runs with noise 1 : 1 : 3 are called bad in 1 %.
double allowance(const SuspectRun& run, const HypothesisFit& with, double equality, bool of_few) {
  if (run.stated_ratio()) {
    return 1.0;
  }
  double own = 0.0;
  double drops = 0.0;
  for (Eigen::Index k = 0; k < run.m(); ++k) {
    const double drop = std::max(run.plain().rss(k) - with.rss(k), 0.0);
    own += drop * with.rss(k) / std::max(with.degrees_of_freedom(k), 0.5);
    drops += drop;
  }
  const double pooled = with.total() / std::max(with.dof(), 0.5);
  const double noisy = drops > 0.0 && pooled > 0.0 ? own / drops / pooled : 1.0;
  const double unequal = of_few ? std::pow(std::max(1.0, 0.2 / std::max(equality, 1e-300)), 1.6)
                                : std::max(1.0, 3e-4 / std::max(equality, 1e-300));
  constexpr double most = 1e3;  // no noise makes a mistake of many sigma
  return std::min(most, unequal * std::pow(std::max(1.0, noisy), 8.0));
}

double nested_p(const SuspectRun& run, const HypothesisFit& with) {
  return with.fitted
             ? nested_f_p(run.plain().total(), run.plain().dof(),
                          run.plain().total() - with.total(), run.plain().dof() - with.dof())
             : 1.0;
}

// Each axis by its own scatter, put together by Fisher's method.
double nested_p_by_axis(const SuspectRun& run, const HypothesisFit& with) {
  if (!with.fitted) {
    return 1.0;
  }
  double sum = 0.0;
  for (Eigen::Index k = 0; k < run.m(); ++k) {
    const double p = nested_f_p(run.plain().rss(k), run.plain().degrees_of_freedom(k),
                                run.plain().rss(k) - with.rss(k),
                                run.plain().degrees_of_freedom(k) - with.degrees_of_freedom(k));
    sum -= 2.0 * std::log(std::max(p, 1e-300));
  }
  return chi_squared_upper_p(std::max(sum, 1e-12), 2.0 * static_cast<double>(run.m()));
}

// The fit of all readings with the axes weighed by what it leaves of them, where they differ: else
// a noisy axis, by the field's direction, hides what a quiet one shows.
HypothesisFit weighed_fit(const SuspectRun& run) {
  HypothesisFit fit = run.plain();
  HypothesisFitter fitter = run.fitter();
  constexpr int rounds = 2;
  for (int round = 0; round < rounds && equality_p_value(fit) < may_be_equal; ++round) {
    HypothesisFitter own = fitter.by_scatter_of(fit);
    HypothesisFit next = own.again(run.set(), fit, fitter);
    if (!next.fitted) {
      break;
    }
    fit = std::move(next);
    fitter = std::move(own);
  }
  return fit;
}

// How unlikely each reading is by the scatter of each axis: of what the fit of all leaves of it, as
// if the others had been fitted alone. Exact but for the weights by axis, which are those of all.
Eigen::VectorXd roughly_by_others(const SuspectRun& run, const HypothesisFit& fit) {
  const Eigen::MatrixXd leverage = fit.basis.leverage();
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(run.n());
  for (Eigen::Index k = 0; k < run.m(); ++k) {
    const double nu = fit.degrees_of_freedom(k);
    if (!(nu > 2.0) || !(fit.rss(k) > 0.0)) {
      continue;
    }
    for (Eigen::Index i = 0; i < run.n(); ++i) {
      const double left = std::max(1.0 - leverage(i, k), 1e-9);
      const double t2 = std::pow(fit.residuals(i, k), 2) / (left * fit.rss(k) / nu);
      const double f = t2 * (nu - 1.0) / std::max(nu - t2, 1e-9);
      sums(i) -= 2.0 * std::log(std::max(f_upper_p(std::max(f, 1e-12), 1.0, nu - 1.0), 1e-300));
    }
  }
  return sums;
}

// How unlikely the worst reading is by the others, each axis by its own scatter, over all readings.
double deletion_p(const SuspectRun& run) {
  if (!run.is_judged_by_others() || run.only_rounding()) {
    return 1.0;
  }
  constexpr double worth_deleting = 0.1;
  constexpr std::size_t most = 4;
  const HypothesisFit fit = weighed_fit(run);
  const Eigen::VectorXd sums = roughly_by_others(run, fit);
  std::vector<std::size_t> worst(run.count());
  std::iota(worst.begin(), worst.end(), std::size_t{0});
  std::partial_sort(
      worst.begin(), worst.begin() + most, worst.end(), [&](std::size_t a, std::size_t b) {
        return sums(static_cast<Eigen::Index>(a)) > sums(static_cast<Eigen::Index>(b));
      });
  const auto readings = static_cast<double>(run.n());
  if (readings * chi_squared_upper_p(std::max(sums.maxCoeff(), 1e-12),
                                     2.0 * static_cast<double>(run.m())) >
      worth_deleting) {
    return 1.0;
  }
  const DeletionFit others(run.set(), fit.field, run.fitter().known_field());
  double smallest = 1.0;
  for (const std::size_t i : first_of(worst, most)) {
    const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
    const double p = others.p_value({i}, one).value_or(1.0);
    constexpr double worth_their_tails = 0.005;
    smallest = std::min(smallest, readings * p < worth_their_tails
                                      ? std::max(p, others.p_value_by_tails({i}, one).value_or(1.0))
                                      : p);
  }
  return std::min(1.0, readings * smallest);
}

// How unlikely the worst two are by the others, likewise; as if they were the only two.
double pair_p(const SuspectRun& run) {
  if (!run.best_pair().fitted || run.only_rounding()) {
    return 1.0;
  }
  const DeletionFit others(run.set(), weighed_fit(run).field, run.fitter().known_field());
  return others.p_value({run.pair()[0], run.pair()[1]}, Eigen::MatrixXd::Identity(2, 2))
      .value_or(1.0);
}

}  // namespace

bool is_clearly_better(const SuspectRun& run, const HypothesisFit& with) {
  constexpr double by_scatter = 1.15;
  constexpr double by_chance = 0.005;
  return times_better(run, with) > by_scatter ||
         (run.is_judged_by_others() &&
          static_cast<double>(run.n()) *
                  std::min(nested_p(run, with), nested_p_by_axis(run, with)) <
              by_chance);
}

double times_better(const SuspectRun& run, const HypothesisFit& fit) {
  return std::sqrt((run.plain().total() / run.plain().dof()) / (fit.total() / fit.dof()));
}

bool looks_bad(const SuspectRun& run) {
  constexpr double large_share = 0.003;
  for (Eigen::Index k = 0; k < run.m(); ++k) {
    const double rms = std::sqrt(run.plain().rss(k) / static_cast<double>(run.n()));
    if (rms <= 2.0 * run.set().rounding(k)) {
      continue;
    }
    if (rms > large_share * run.full_response(k)) {
      return true;
    }
  }
  if (run.only_rounding()) {
    return false;
  }
  const auto suspicious = [&](const HypothesisFit& fit) {
    return classes * std::min(single_p(run, fit), added_p(run, fit)) < worth_a_look;
  };
  if (suspicious(run.plain()) || deletion_p(run) < false_alarm_of_deletion) {
    return true;
  }
  if (!(equality_p_value(run.plain()) < may_be_equal)) {
    return false;
  }
  const HypothesisFit again =
      run.fitter().by_scatter_of(run.plain()).again(run.set(), run.plain(), run.fitter());
  return again.fitted && classes * single_p(run, again) < worth_a_look;
}

bool is_bad(SuspectRun& run) {
  const double equality = run.stated_ratio() ? 1.0 : equality_p_value(run.plain());
  const auto readings = static_cast<double>(run.n());
  double smallest = 1.0;
  const Consider consider = [&](const HypothesisFit& with, const Considered& how) {
    if (with.fitted) {
      smallest = std::min(smallest, how.tests * allowance(run, with, equality, how.of_few) *
                                        std::max(nested_p(run, with), how.at_least));
    }
  };
  run.delete_pairs();
  constexpr double rare = 100.0;  // two independent mistakes
  const double pairs = rare * 0.5 * readings * (readings - 1.0);
  const bool many = run.is_judged_by_others();
  if (many) {  // what the others say of each judges it at any noise of the axes
    smallest = pairs * pair_p(run);
  } else {
    consider(run.without(run.by_deletion().front()), {.tests = readings, .of_few = true});
    consider(run.best_pair(), {.tests = pairs, .of_few = true});
  }
  for (const MistakeKind& kind : mistake_kinds()) {
    if (kind.detect != nullptr) {
      kind.detect(run, consider);
    }
  }
  const bool bad = classes * smallest < (many ? false_alarm_of_others : false_alarm) ||
                   deletion_p(run) < false_alarm_of_deletion;
  const bool unequal = !run.stated_ratio() && weigh_axes(run);
  if (bad || !unequal || !run.plain().fitted) {
    return bad && run.plain().fitted;
  }
  double by_axis = readings * nested_p_by_axis(run, run.without(run.by_deletion().front()));
  for (const MistakeKind& kind : mistake_kinds()) {
    if (kind.of_all_axes != nullptr) {
      by_axis = std::min(by_axis, nested_p_by_axis(run, kind.of_all_axes(run)));
    }
  }
  return 2.0 * by_axis < false_alarm_by_axis;
}

}  // namespace axiscal
