// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <string>
#include <utility>

#include "calib/mistakes/src/mistake_kind.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr std::array stuck_advice = {
    MistakeAdvice{.code = WarningCode::stuck, .one = "Take the reading again."}};

// Number that is added to the log-likelihood of a stuck output, because no other mistake makes all
// digits of two readings equal.
constexpr double sure = 200.0;
constexpr std::size_t most_repeats = 3;

// Adds an explanation for each reading that was taken in another pose but equals reading i in all
// digits. The output of the instrument was then probably stuck.
void explain_by_repeat(const SuspectRun& run, std::size_t i, Explanations& found) {
  const auto row = static_cast<Eigen::Index>(i);
  std::size_t said = 0;
  for (std::size_t j = 0; j < run.count() && run.m() > 1 && said < most_repeats; ++j) {
    const auto other = static_cast<Eigen::Index>(j);
    if (i == j || *run.set().readings[i].point == *run.set().readings[j].point ||
        run.set().response.row(row) != run.set().response.row(other)) {
      continue;
    }
    Correction correction = about(run, WarningCode::stuck, {i});
    correction.leave_out = correction.runs;
    ++said;
    found.add(run.without(i), {}, static_cast<double>(run.n()), std::move(correction),
              formatted("without this reading: it repeats run {} to the last digit", run.run_of(j)),
              sure);
  }
}

}  // namespace

MistakeKind stuck_kind() {
  return {.advice = stuck_advice, .of_reading = explain_by_repeat};
}

}  // namespace axiscal
