// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <numeric>
#include <string>
#include <utility>

#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"
#include "calib/mistakes/src/mistake_kind.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr std::array wrong_value_advice = {
    MistakeAdvice{.code = WarningCode::columns_exchanged,
                  .one = "Correct the order of the columns, or take the reading again."},
    MistakeAdvice{.code = WarningCode::sign, .one = "Correct the sign, or take the reading again."},
    MistakeAdvice{.code = WarningCode::unit_factor,
                  .one = "Correct the unit, or take the reading again."},
    MistakeAdvice{.code = WarningCode::outlier,
                  .one = "Take the reading again.",
                  .many = "Take these readings again."}};

std::vector<double> value_ranges(const SuspectRun& run, Eigen::Index repeats) {
  std::vector<double> ranges;
  for (Eigen::Index k = 0; k < run.m(); ++k) {
    ranges.insert(ranges.end(), static_cast<std::size_t>(repeats),
                  value_range * run.full_response(k));
  }
  return ranges;
}

void try_value(const SuspectRun& run,
               Explanations& found,
               std::size_t i,
               const Eigen::VectorXd& value,
               double alternatives,
               WarningCode code,
               const std::string& words) {
  const HypothesisFit& without = run.without(i);
  if (!without.fitted) {
    return;
  }
  const auto row = static_cast<Eigen::Index>(i);
  // A value is fitted only if it is at most half as far from the prediction by the other readings
  // as the stated value is.
  const ReadingSet one = one_reading(run.set(), i);
  const Eigen::VectorXd stated = run.set().response.row(row);
  if (distance_squared(run, one, without, value) >
      0.25 * distance_squared(run, one, without, stated)) {
    return;
  }
  ReadingSet set = run.set();
  set.response.row(row) = value;
  Correction correction = about(run, code, {i});
  correction.responses = {{run.run_of(i), value}};
  found.add(run.fitter().fit(set), {}, alternatives, std::move(correction), words);
}

void explain_by_value(const SuspectRun& run, std::size_t i, Explanations& found) {
  const auto row = static_cast<Eigen::Index>(i);
  const Eigen::VectorXd v = run.set().response.row(row);
  const auto readings = static_cast<double>(run.n());
  const auto axis_name = [&](Eigen::Index k) {
    return run.set().axes[static_cast<std::size_t>(k)];
  };
  if (run.m() > 1 && run.m() <= 4) {
    std::vector<Eigen::Index> order(static_cast<std::size_t>(run.m()));
    std::iota(order.begin(), order.end(), 0);
    double permutations = 1.0;
    for (Eigen::Index k = 2; k <= run.m(); ++k) {
      permutations *= static_cast<double>(k);
    }
    while (std::next_permutation(order.begin(), order.end())) {
      std::string names;
      for (const Eigen::Index k : order) {
        names += (names.empty() ? "" : ", ") + axis_name(k);
      }
      try_value(run, found, i, v(order), readings * (permutations - 1.0),
                WarningCode::columns_exchanged, "with its columns in the order " + names);
    }
  }
  if (run.m() <= 4) {
    const int subsets = (1 << run.m()) - 1;
    for (int subset = 1; subset <= subsets; ++subset) {
      Eigen::VectorXd turned = v;
      std::string names;
      for (Eigen::Index k = 0; k < run.m(); ++k) {
        if ((subset & (1 << k)) != 0) {
          turned(k) = -v(k);
          names += (names.empty() ? "" : ", ") + axis_name(k);
        }
      }
      try_value(run, found, i, turned, readings * subsets, WarningCode::sign,
                formatted("with the sign of {} reversed", names));
    }
  }
  const auto kinds = 4.0 * static_cast<double>(run.m() > 1 ? 1 + run.m() : 1);
  for (const double factor : {1e3, 1e-3, standard_gravity, 1.0 / standard_gravity}) {
    const std::string text = number_text(factor > 1.0 ? factor : 1.0 / factor);
    const std::string words = factor > 1.0 ? formatted("divided by {} (another unit)", text)
                                           : formatted("times {} (another unit)", text);
    try_value(run, found, i, v / factor, readings * kinds, WarningCode::unit_factor, words);
    for (Eigen::Index k = 0; k < run.m() && run.m() > 1; ++k) {
      Eigen::VectorXd one = v;
      one(k) /= factor;
      try_value(run, found, i, one, readings * kinds, WarningCode::unit_factor,
                formatted("with {} {}", axis_name(k), words));
    }
  }
  for (Eigen::Index k = 0; k < run.m() && run.m() > 1; ++k) {
    Correction correction = about(run, WarningCode::outlier, {i});
    correction.leave_out = correction.runs;
    found.add(run.arbitrary({i}, k), {value_range * run.full_response(k)},
              readings * static_cast<double>(run.m()), std::move(correction),
              "without axis " + axis_name(k));
  }
  Correction correction = about(run, WarningCode::outlier, {i});
  correction.leave_out = correction.runs;
  found.add(run.arbitrary({i}), value_ranges(run, 1), readings, std::move(correction),
            "without this reading");
}

void explain_by_two(const SuspectRun& run, Explanations& found) {
  if (!run.best_pair().fitted) {
    return;
  }
  const auto pairs = 0.5 * static_cast<double>(run.n()) * static_cast<double>(run.n() - 1);
  Correction correction = about(run, WarningCode::outlier, {run.pair()[0], run.pair()[1]});
  std::sort(correction.runs.begin(), correction.runs.end());
  correction.leave_out = correction.runs;
  found.add(run.arbitrary({run.pair()[0], run.pair()[1]}), value_ranges(run, 2), pairs,
            std::move(correction), "without these readings");
}

}  // namespace

MistakeKind wrong_value_kind() {
  return {.advice = wrong_value_advice, .of_reading = explain_by_value, .of_run = explain_by_two};
}

}  // namespace axiscal
