// SPDX-License-Identifier: Apache-2.0
#include "calib/mistakes/src/detection.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "axiscal/calib/distributions.hpp"
#include "calib/fit/deletion_fit.hpp"
#include "calib/mistakes/src/mistake_kind.hpp"
#include "calib/regression/variance_components.hpp"

namespace axiscal {
namespace {

// The level of significance of all nested F tests together. These tests assume that the noise of
// the axes is equal or has a stated ratio. Tests for the same kind of mistake are correlated, so
// only 0.6 % of good runs are called bad (by Monte Carlo simulation).
constexpr double false_alarm = 0.016;
// The axes' noise clearly differs if the test for equal scatter has a p-value below this.
constexpr double unequal_below = 0.01;
constexpr double false_alarm_by_axis = 0.001;
// Levels of significance for runs that have enough readings to test each reading against the other
// readings. The first level is used in this test of single readings. The second level is used in
// the tests for all other kinds of mistakes.
constexpr double false_alarm_of_deletion = 0.003;
constexpr double false_alarm_of_others = 0.008;

double equality_p_value(const HypothesisFit& fit) {
  return equal_variances_p(fit.rss.cwiseQuotient(fit.degrees_of_freedom), fit.degrees_of_freedom);
}

// Returns the smallest p-value of the quick tests that leave out one reading, with Bonferroni's
// correction for the number of readings.
double single_p(const SuspectRun& run, const HypothesisFit& fit) {
  double largest = 0.0;  // the largest drop has the smallest p-value
  for (std::size_t i = 0; i < run.count(); ++i) {
    largest = std::max(largest, run.rss_drop_without_readings(fit, {&i, 1}));
  }
  return std::min(1.0, static_cast<double>(run.n()) * nested_f_p(fit.total(), fit.dof(), largest,
                                                                 static_cast<double>(run.m())));
}

// Returns the smallest p-value of the quick tests of all kinds of mistakes.
double added_p(const SuspectRun& run, const HypothesisFit& fit) {
  double smallest = 1.0;
  for (const MistakeKind& kind : mistake_kinds()) {
    if (kind.quick_p != nullptr) {
      smallest = std::min(smallest, kind.quick_p(run, fit));
    }
  }
  return smallest;
}

// Returns true if the axes' noise clearly differs after the worst readings are removed. In this
// case the axes are also weighted by their scatter, in two rounds: the worst readings of a quiet
// axis appear only after a noisy axis has less weight.
bool weigh_axes(SuspectRun& run) {
  const auto clean = [&]() -> const HypothesisFit& {
    return run.best_pair().fitted ? run.best_pair() : run.without(run.ranked_by_deletion().front());
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

// Returns a factor of at least 1 that multiplies the p-value of a hypothesis. It is needed because
// a noisy axis looks like a mistake in a few of its readings. The factor is larger in two cases. In
// the first case the scatters of the axes differ without the hypothesis (`equality` is the p-value
// of equal scatters). In the second case most of the reduction of the sum of squares comes from an
// axis that also scatters more than the others under the hypothesis. The constants are tuned by
// simulation, so that 1 % of good runs with axis noise 1 : 1 : 3 are called bad.
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
  constexpr double most = 1e3;  // limited, because noise does not explain an error of many sigma
  return std::min(most, unequal * std::pow(std::max(1.0, noisy), 8.0));
}

double nested_p(const SuspectRun& run, const HypothesisFit& with) {
  return with.fitted ? nested_f_p(run.plain().total(), run.plain().dof(),
                                  run.plain().total() - with.total(),
                                  run.plain().dof() - with.dof(), with.loss)
                     : 1.0;
}

// Returns the p-value of nested F tests, one for each axis, combined by Fisher's method. Each axis
// has a separate scatter.
double nested_p_by_axis(const SuspectRun& run, const HypothesisFit& with) {
  if (!with.fitted) {
    return 1.0;
  }
  FisherSum axes;
  for (Eigen::Index k = 0; k < run.m(); ++k) {
    axes.add(nested_f_p(run.plain().rss(k), run.plain().degrees_of_freedom(k),
                        run.plain().rss(k) - with.rss(k),
                        run.plain().degrees_of_freedom(k) - with.degrees_of_freedom(k)));
  }
  return axes.p_value(with.loss);
}

// The fit of all readings, with each axis weighted by its scatter if the scatters differ. Without
// these weights a noisy axis spoils the field's direction, and the wrong direction hides mistakes
// in a quiet axis. Each round of weighting is computed at most once, on demand.
class WeighedFit {
 public:
  explicit WeighedFit(const SuspectRun& run) : run_(run) {}

  // Returns the fit after one round of weighting; null if the scatters of the axes do not differ or
  // if the fit fails.
  const HypothesisFit* once() {
    if (!first_) {
      first_ = next(run_.plain(), run_.fitter());
    }
    return fit_of(first_);
  }

  // Returns the fit after at most two rounds of weighting.
  const HypothesisFit& best() {
    if (once() == nullptr) {
      return run_.plain();
    }
    if (!second_) {
      second_ = next((*first_)->fit, (*first_)->fitter);
    }
    const HypothesisFit* const twice = fit_of(second_);
    return twice != nullptr ? *twice : (*first_)->fit;
  }

 private:
  struct Weighed {
    HypothesisFit fit;
    HypothesisFitter fitter;
  };
  // The outer optional is empty until the round was computed. The inner optional is empty if the
  // round gave no fit.
  using Round = std::optional<std::optional<Weighed>>;

  static const HypothesisFit* fit_of(const Round& round) {
    return *round ? &(*round)->fit : nullptr;
  }

  [[nodiscard]] std::optional<Weighed> next(const HypothesisFit& fit,
                                            const HypothesisFitter& fitter) const {
    if (!(equality_p_value(fit) < may_be_equal)) {
      return std::nullopt;
    }
    HypothesisFitter own = fitter.by_scatter_of(fit);
    HypothesisFit again = own.refit(fit);
    if (!again.fitted) {
      return std::nullopt;
    }
    return Weighed{.fit = std::move(again), .fitter = std::move(own)};
  }

  const SuspectRun& run_;
  Round first_;
  Round second_;
};

// The index of a reading, and the sum of -2 ln p over its axes (Fisher's method), where p is the
// p-value of one axis. A larger sum means a less likely reading.
struct Unlikely {
  std::size_t reading = 0;
  double sum = 0.0;
};

// Returns the readings that fit the other readings worst, at most `most`, the worst first. Each
// reading is compared with a fit of the other readings. That fit is not computed, because the
// deviation from it follows from the reading's residual and leverage in the fit of all readings.
// The result is exact except for the weights of the axes, which come from all readings.
std::vector<Unlikely> roughly_by_others(const SuspectRun& run,
                                        const HypothesisFit& fit,
                                        std::size_t most) {
  const Eigen::MatrixXd leverage = fit.fit->leverage();
  // Returns the F(1, nu - 1) statistic of each reading of axis k; all 0 if the axis has too few
  // degrees of freedom.
  const auto ratios_of = [&](Eigen::Index k) -> Eigen::ArrayXd {
    const double nu = fit.degrees_of_freedom(k);
    if (!(nu > 2.0) || !(fit.rss(k) > 0.0)) {
      return Eigen::ArrayXd::Zero(run.n());
    }
    const Eigen::ArrayXd left = (1.0 - leverage.col(k).array()).max(1e-9);
    const Eigen::ArrayXd t2 = fit.residuals.col(k).array().square() / (left * fit.rss(k) / nu);
    return (t2 * (nu - 1.0) / (nu - t2).max(1e-9)).max(1e-12);
  };
  Eigen::ArrayXXd ratios(run.n(), run.m());
  for (Eigen::Index k = 0; k < run.m(); ++k) {
    ratios.col(k) = ratios_of(k);
  }
  // The normal distribution has shorter tails than Student's distribution, so it gives an upper
  // bound of each sum. Therefore only a few of thousands of readings need the exact sum.
  std::vector<Unlikely> bounds(run.count());
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    bounds[i].reading = i;
    for (const double ratio : ratios.row(static_cast<Eigen::Index>(i))) {
      bounds[i].sum += FisherSum::term(std::erfc(std::sqrt(0.5 * ratio)));
    }
  }
  const auto less = [](const Unlikely& a, const Unlikely& b) { return a.sum < b.sum; };
  std::make_heap(bounds.begin(), bounds.end(), less);
  std::vector<Unlikely> worst;
  while (!bounds.empty() && (worst.size() < most || worst.back().sum < bounds.front().sum)) {
    Unlikely one{.reading = bounds.front().reading};
    std::pop_heap(bounds.begin(), bounds.end(), less);
    bounds.pop_back();
    for (Eigen::Index k = 0; k < run.m(); ++k) {
      const double ratio = ratios(static_cast<Eigen::Index>(one.reading), k);
      if (ratio > 0.0) {
        one.sum += FisherSum::term(f_upper_p(ratio, 1.0, fit.degrees_of_freedom(k) - 1.0));
      }
    }
    worst.insert(std::upper_bound(worst.begin(), worst.end(), one,
                                  [&](const Unlikely& a, const Unlikely& b) { return less(b, a); }),
                 one);
    worst.resize(std::min(worst.size(), most));
  }
  return worst;
}

// Tests the worst reading against a fit of the other readings. Returns the p-value, with
// Bonferroni's correction for the number of readings. Each axis has a separate scatter.
double deletion_p(const SuspectRun& run, WeighedFit& weighed) {
  if (!run.has_independent_readings() || run.only_rounding()) {
    return 1.0;
  }
  constexpr double worth_deleting = 0.1;
  constexpr std::size_t most = 4;
  const HypothesisFit& fit = weighed.best();
  const std::vector<Unlikely> worst = roughly_by_others(run, fit, most);
  const auto readings = static_cast<double>(run.n());
  if (readings * chi_squared_upper_p(std::max(worst.front().sum, 1e-12),
                                     2.0 * static_cast<double>(run.m())) >
      worth_deleting) {
    return 1.0;
  }
  const DeletionFit others(run.set(), fit.field, run.fitter().known_field());
  double smallest = 1.0;
  for (const auto& [i, sum] : worst) {
    const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
    const double loss = dof_reduction_factor_without(fit, {&i, 1});
    const double p = others.p_value({i}, one, loss).value_or(1.0);
    constexpr double worth_their_tails = 0.005;
    smallest =
        std::min(smallest, readings * p < worth_their_tails
                               ? std::max(p, others.p_value_by_tails({i}, one, loss).value_or(1.0))
                               : p);
  }
  return std::min(1.0, readings * smallest);
}

// Tests the worst two readings against a fit of the other readings. Returns the p-value, without a
// correction for the number of pairs.
double pair_p(const SuspectRun& run, WeighedFit& weighed) {
  if (!run.best_pair().fitted || run.only_rounding()) {
    return 1.0;
  }
  const DeletionFit others(run.set(), weighed.best().field, run.fitter().known_field());
  return others
      .p_value({run.pair()[0], run.pair()[1]}, Eigen::MatrixXd::Identity(2, 2),
               dof_reduction_factor_without(weighed.best(), run.pair()))
      .value_or(1.0);
}

}  // namespace

bool is_clearly_better(const SuspectRun& run, const HypothesisFit& with) {
  constexpr double by_scatter = 1.15;
  constexpr double by_chance = 0.005;
  return scatter_reduction_factor(run, with) > by_scatter ||
         (run.has_independent_readings() &&
          static_cast<double>(run.n()) *
                  std::min(nested_p(run, with), nested_p_by_axis(run, with)) <
              by_chance);
}

double scatter_reduction_factor(const SuspectRun& run, const HypothesisFit& fit) {
  return std::sqrt((run.plain().total() / run.plain().dof()) / (fit.total() / fit.dof()));
}

bool is_suspicious(const SuspectRun& run) {
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
  if (suspicious(run.plain())) {
    return true;
  }
  WeighedFit weighed(run);
  if (const HypothesisFit* const once = weighed.once();
      once != nullptr && classes * single_p(run, *once) < worth_a_look) {
    return true;
  }
  return deletion_p(run, weighed) < false_alarm_of_deletion;
}

bool is_bad(SuspectRun& run) {
  const double equality = run.stated_ratio() ? 1.0 : equality_p_value(run.plain());
  const auto readings = static_cast<double>(run.n());
  double smallest = 1.0;
  const Consider consider = [&](const HypothesisFit& with, const CandidateHypothesis& how) {
    if (with.fitted) {
      smallest = std::min(smallest, how.tests * allowance(run, with, equality, how.of_few) *
                                        std::max(nested_p(run, with), how.at_least));
    }
  };
  run.fit_pair_deletions();
  WeighedFit weighed(run);
  constexpr double rare = 100.0;  // two independent mistakes are rarer than one by this factor
  const double pairs = rare * 0.5 * readings * (readings - 1.0);
  const bool many = run.has_independent_readings();
  // pair_p() is valid for any ratio of the axes' noise, because it tests two readings against the
  // others.
  if (many) {
    smallest = pairs * pair_p(run, weighed);
  } else {
    consider(run.without(run.ranked_by_deletion().front()), {.tests = readings, .of_few = true});
    consider(run.best_pair(), {.tests = pairs, .of_few = true});
  }
  for (const MistakeKind& kind : mistake_kinds()) {
    if (kind.detect != nullptr) {
      kind.detect(run, consider);
    }
  }
  const bool bad = classes * smallest < (many ? false_alarm_of_others : false_alarm) ||
                   deletion_p(run, weighed) < false_alarm_of_deletion;
  const bool unequal = !run.stated_ratio() && weigh_axes(run);
  if (bad || !unequal || !run.plain().fitted) {
    return bad && run.plain().fitted;
  }
  double by_axis = readings * nested_p_by_axis(run, run.without(run.ranked_by_deletion().front()));
  for (const MistakeKind& kind : mistake_kinds()) {
    if (kind.of_all_axes != nullptr) {
      by_axis = std::min(by_axis, nested_p_by_axis(run, kind.of_all_axes(run)));
    }
  }
  return 2.0 * by_axis < false_alarm_by_axis;
}

}  // namespace axiscal
