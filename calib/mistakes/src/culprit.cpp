// SPDX-License-Identifier: Apache-2.0
#include "calib/mistakes/culprit.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/number_text.hpp"
#include "calib/fit/deletion_fit.hpp"
#include "calib/fit/layings.hpp"
#include "calib/mistakes/src/condensed_run.hpp"
#include "calib/mistakes/src/detection.hpp"
#include "calib/mistakes/src/mistake_kind.hpp"
#include "calib/mistakes/src/typed_value.hpp"
#include "calib/record/calibration_warning.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// An explanation is also reported if its log-likelihood exceeds the largest log-likelihood minus
// this number.
constexpr double as_likely = 3.0;

constexpr std::size_t most_said = 3;

std::vector<Explanation> explain(const SuspectRun& run) {
  constexpr std::size_t most_suspects = 6;
  Explanations found;
  for (const std::size_t i : first_of(run.ranked_by_deletion(), most_suspects)) {
    for (const MistakeKind& kind : mistake_kinds()) {
      if (kind.of_reading != nullptr) {
        kind.of_reading(run, i, found);
      }
    }
  }
  for (const MistakeKind& kind : mistake_kinds()) {
    if (kind.of_run != nullptr) {
      kind.of_run(run, found);
    }
  }
  return std::move(found).ranked();
}

std::string better(const SuspectRun& run, const HypothesisFit& fit) {
  const double ratio = scatter_reduction_factor(run, fit);
  return number_text(ratio, ratio < 100.0 ? 2 : static_cast<int>(std::log10(ratio)) + 1);
}

// Returns the words for a reading that contradicts the others: its value, the expected value, and
// the value that was probably meant.
std::string expected_words(const SuspectRun& run, const Correction& correction) {
  const bool is_value = correction.code == WarningCode::sign ||
                        correction.code == WarningCode::unit_factor ||
                        correction.code == WarningCode::outlier;
  const auto found = std::find_if(run.order().begin(), run.order().end(), [&](std::size_t i) {
    return correction.runs.size() == 1 && run.run_of(i) == correction.runs.front();
  });
  if (!is_value || found == run.order().end() || !run.without(*found).fitted) {
    return "";
  }
  const Eigen::VectorXd typed = run.set().response.row(static_cast<Eigen::Index>(*found));
  const Eigen::VectorXd expected =
      predict_from_other_readings(run, one_reading(run.set(), *found), run.without(*found));
  // The deviations are fractions of the full response, not of the scatter, because a mistake
  // increases the scatter of the run.
  Eigen::VectorXd off(run.m());
  for (Eigen::Index k = 0; k < run.m(); ++k) {
    off(k) = std::abs(typed(k) - expected(k)) / run.full_response(k);
  }
  constexpr double worth_saying = 0.2;  // fraction of the largest deviation
  constexpr double as_meant = 0.01;
  std::vector<std::string> said;
  for (Eigen::Index k = 0; k < run.m(); ++k) {
    if (!(off(k) > as_meant) || off(k) < worth_saying * off.maxCoeff()) {
      continue;
    }
    const std::optional<double> meant =
        infer_intended_value(typed(k), expected(k), as_meant * run.full_response(k));
    said.push_back(formatted("{} reads {}, but about {} was expected{}",
                             run.set().axes[static_cast<std::size_t>(k)], number_text(typed(k), 6),
                             number_text(expected(k), 3),
                             meant ? formatted(" (meant {}?)", number_text(*meant, 7)) : ""));
  }
  constexpr std::size_t most = 3;
  return said.empty() || said.size() > most ? "" : ": " + joined(said);
}

std::string sentence(const SuspectRun& run, const Explanation& explanation) {
  const Correction& correction = explanation.correction;
  const std::string who =
      correction.runs.empty() ? std::string("the run") : name_of_runs(correction.runs);
  const bool one = correction.runs.size() < 2;
  return formatted("{}{}{} times better {}{}. {}", who, one ? " fits " : " fit ",
                   better(run, explanation.fit), explanation.words, expected_words(run, correction),
                   advice_of(correction));
}

// Returns true if two explanations fit the readings equally well. For example, a tilt of the first
// reading equals a movement of the table after it.
bool same_data(const Explanation& a, const Explanation& b) {
  const double difference = std::abs(a.fit.total() / b.fit.total() - 1.0);
  return difference < 1e-6;
}

// Returns the largest change of a coefficient by a mistake, as a fraction of the full response.
double effect_of(const SuspectRun& run, const Explanation& explanation) {
  double effect = 0.0;
  for (Eigen::Index k = 0; k < run.m(); ++k) {
    const Eigen::Vector4d change =
        explanation.fit.coefficients.col(k).head<4>() - run.plain().coefficients.col(k).head<4>();
    const double F = run.plain().field.magnitude();
    effect = std::max({effect, std::abs(change(0)) / run.full_response(k),
                       change.tail<3>().norm() * F / run.full_response(k)});
  }
  return effect;
}

// Returns the probability that, in a run without mistakes, the worst reading deviates at least as
// much as the corrected reading. The distribution of the noise is estimated from the other
// readings. Returns 0 if the correction is not an outlier or a tilt of a single reading.
double p_by_tails(const SuspectRun& run, const Correction& correction) {
  const bool is_single =
      correction.runs.size() == 1 &&
      (correction.code == WarningCode::outlier || correction.code == WarningCode::tilted_seat);
  const auto found = std::find_if(run.order().begin(), run.order().end(), [&](std::size_t i) {
    return is_single && run.run_of(i) == correction.runs.front();
  });
  if (found == run.order().end()) {
    return 0.0;
  }
  const DeletionFit others(run.set(), run.plain().field, run.fitter().known_field());
  return static_cast<double>(run.n()) *
         others
             .p_value_by_tails({*found}, Eigen::MatrixXd::Ones(1, 1),
                               dof_reduction_factor_without(run.plain(), {&*found, 1}))
             .value_or(0.0);
}

MistakeSearch culprit_of(const SuspectRun& run, std::vector<Explanation> explanations) {
  // An explanation whose fit is not clearly better is dropped. Its likelihood may still be high,
  // because an explanation that adds no parameters has no penalty for parameters.
  std::erase_if(explanations, [&](const Explanation& explanation) {
    return !is_clearly_better(run, explanation.fit);
  });
  if (explanations.empty()) {
    return {};
  }
  const Explanation& best = explanations.front();
  constexpr double may_be_wrong = 0.005;
  // The limit for a tilt is higher, because a tilt changes fewer components of a reading.
  const double is_wrong = best.correction.code == WarningCode::tilted_seat ? 0.003 : 0.001;
  const double by_tails = p_by_tails(run, best.correction);
  if (by_tails > is_wrong) {
    return {.culprit = {},
            .remark = by_tails < may_be_wrong
                          ? formatted("{} deviates from the other readings: this reading is wrong, "
                                      "or the noise has heavy tails; take the reading again to "
                                      "find out",
                                      name_of_runs(best.correction.runs))
                          : std::string()};
  }
  Culprit result;
  std::set<std::vector<int>> seen_outliers;
  for (const Explanation& explanation : explanations) {
    const double behind = best.likelihood - explanation.likelihood;
    const bool twin = same_data(best, explanation) && behind < 3.0 * as_likely;
    if (&explanation != &best && !(behind < as_likely) && !twin) {
      continue;
    }
    if (result.warnings.size() == most_said) {
      break;
    }
    // A reading is reported as an outlier only once.
    if (explanation.correction.code == WarningCode::outlier &&
        !seen_outliers.insert(explanation.correction.runs).second) {
      continue;
    }
    std::string message = sentence(run, explanation);
    if (&explanation != &best) {
      const double ratio = std::exp(behind);
      message = formatted("or {} ({})", message,
                          ratio < 1.05 ? std::string("equally "
                                                     "likely")
                                       : number_text(ratio, 2) + " times less likely");
    }
    result.warnings.push_back({.code = explanation.correction.code,
                               .runs = explanation.correction.runs,
                               .message = std::move(message)});
  }
  result.correction = best.correction;
  result.correction.message = result.warnings.front().message;
  result.effect = effect_of(run, best);
  return {.culprit = std::move(result), .remark = {}};
}

// Returns true if consecutive readings at one design point share an error. Their means then scatter
// more than the readings scatter about these means, and only the means are independent.
bool scatter_by_layings(const MeanReadings& layings, const Estimate& estimate, bool known_field) {
  if (!layings.own || !(layings.degrees_of_freedom.minCoeff() > 0.0)) {
    return false;
  }
  const SuspectRun run(layings.set(), estimate, known_field);
  constexpr double differs = 0.05;
  return between_groups_p(run.plain(), run.fitter().scale(), layings) < differs;
}

// Returns the means over consecutive readings at one design point. Their weights are scaled to mean
// 1 for each axis.
ReadingSet means_of(const MeanReadings& layings) {
  ReadingSet means = layings.set();
  const Eigen::RowVectorXd readings_of_mean = means.weights.colwise().mean();
  means.weights.array().rowwise() /= readings_of_mean.array();
  return means;
}

}  // namespace

std::string_view advice_of(const Correction& correction) {
  for (const MistakeKind& kind : mistake_kinds()) {
    for (const MistakeAdvice& advice : kind.advice) {
      if (advice.code == correction.code) {
        return correction.runs.size() > 1 && !advice.many.empty() ? advice.many : advice.one;
      }
    }
  }
  return "";
}

bool can_be_searched(const ReadingSet& set, const Estimate& estimate) {
  const bool labelled =
      set.rotation_sensor_from_table.size() == set.readings.size() && estimate.field.has_vectors();
  return labelled && !set.field.is_sum() && !set.robust && !set.has_excluded_readings() &&
         set.seen.cols() == 0 && set.also_in_table.empty() && set.size() >= 6;
}

MistakeSearch find_culprit(const ReadingSet& set,
                           const Estimate& estimate,
                           bool known_field,
                           const ReadingSet* without_shared_errors) {
  constexpr Eigen::Index most_searched = 3000;
  constexpr std::size_t most_means = 1500;
  if (set.size() > most_searched) {
    const std::optional<ReadingSet> few = condensed(set, most_means);
    const std::optional<ReadingSet> judged = without_shared_errors != nullptr
                                                 ? condensed(*without_shared_errors, most_means)
                                                 : std::nullopt;
    if (few && judged.has_value() == (without_shared_errors != nullptr)) {
      return find_culprit(*few, estimate, known_field, judged ? &*judged : nullptr);
    }
  }
  if (const MeanReadings layings = average_layings(set, estimate);
      scatter_by_layings(layings, estimate, known_field)) {
    const ReadingSet means = means_of(layings);
    if (without_shared_errors == nullptr) {
      return find_culprit(means, estimate, known_field);
    }
    const ReadingSet judged = means_of(average_layings(*without_shared_errors, estimate));
    return find_culprit(means, estimate, known_field, &judged);
  }
  // A wrongly stated direction of the field is not a mistake in a reading. If readings in opposite
  // positions of the cube show that the stated direction is wrong, the direction is fitted instead.
  const bool stated = known_field && !estimate.levelness;
  if (without_shared_errors != nullptr) {
    SuspectRun run(*without_shared_errors, estimate, stated);
    if (!run.plain().fitted || !is_suspicious(run)) {
      return {};
    }
    run.fit_single_deletions();
    if (!is_bad(run)) {
      return {};
    }
  }
  SuspectRun run(set, estimate, stated);
  const HypothesisFit& plain = run.plain();
  if (!plain.fitted || plain.dof() < 2.0 * static_cast<double>(run.m()) || !is_suspicious(run)) {
    return {};
  }
  run.fit_single_deletions();
  if (!is_bad(run)) {
    return {};
  }
  return culprit_of(run, explain(run));
}

}  // namespace axiscal
