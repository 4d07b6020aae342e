// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "calib/mistakes/src/mistake_kind.hpp"

namespace axiscal {
namespace {

constexpr std::array exchanged_advice = {
    MistakeAdvice{.code = WarningCode::exchanged,
                  .one = "Check which reading belongs to which pose, or take "
                         "both readings again."}};

void explain_by_exchange(const SuspectRun& run, Explanations& found) {
  constexpr std::size_t few = 16;
  const std::vector<std::size_t> candidates = run.count() <= few ? run.order() : [&] {
    std::vector<std::size_t> some = run.largest_residuals(few / 2);
    for (const std::size_t i : first_of(run.ranked_by_deletion(), few / 2)) {
      if (std::find(some.begin(), some.end(), i) == some.end()) {
        some.push_back(i);
      }
    }
    return some;
  }();
  const auto pairs = 0.5 * static_cast<double>(run.n()) * static_cast<double>(run.n() - 1);
  for (const auto& [a, b] : run.pairs_to_fit(candidates)) {
    const std::size_t i = std::min(a, b);
    const std::size_t j = std::max(a, b);
    const DesignPoint& first = *run.set().readings[i].point;
    const DesignPoint& second = *run.set().readings[j].point;
    if (first == second) {
      continue;
    }
    ReadingSet set = run.set();
    set.response.row(static_cast<Eigen::Index>(i)) =
        run.set().response.row(static_cast<Eigen::Index>(j));
    set.response.row(static_cast<Eigen::Index>(j)) =
        run.set().response.row(static_cast<Eigen::Index>(i));
    Correction correction = about(run, WarningCode::exchanged, {i, j});
    correction.responses = {{run.run_of(i), run.set().response.row(static_cast<Eigen::Index>(j))},
                            {run.run_of(j), run.set().response.row(static_cast<Eigen::Index>(i))}};
    found.add(
        run.fitter().fit(set), {}, pairs, std::move(correction),
        std::string("with their readings exchanged") +
            (first.turned_round() == second ? " (or both with the opposite fence face)" : ""));
  }
}

}  // namespace

MistakeKind exchanged_kind() {
  return {.advice = exchanged_advice, .of_run = explain_by_exchange};
}

}  // namespace axiscal
