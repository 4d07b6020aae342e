// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <utility>

#include "mistake_kind.hpp"

namespace axiscal {
namespace {

constexpr std::array table_moved_advice = {MistakeAdvice{
    .code = WarningCode::table_moved,
    .one = "See that nothing moves the table, and take all readings again, or give each part its "
           "own block and level by block."}};

void explain_by_table(const SuspectRun& run, Explanations& found) {
  if (run.fitter().known_field()) {
    return;
  }
  for (const std::size_t cut : run.cuts()) {
    Correction correction =
        about(run, WarningCode::table_moved, {run.order()[cut - 1], run.order()[cut]});
    found.add(run.table_moved(cut), {angle_range_rad, angle_range_rad},
              static_cast<double>(run.n() - 1), std::move(correction),
              "with the table moved between them");
  }
}

}  // namespace

MistakeKind table_moved_kind() {
  return {.advice = table_moved_advice, .of_run = explain_by_table};
}

}  // namespace axiscal
