// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <utility>

#include "mistake_kind.hpp"

namespace axiscal {
namespace {

constexpr std::array tilted_seat_advice = {MistakeAdvice{
    .code = WarningCode::tilted_seat,
    .one = "Look for grit under a foot and a fence not touched, and take the reading again."}};

void explain_by_tilt(const SuspectRun& run, std::size_t i, Explanations& found) {
  Correction correction = about(run, WarningCode::tilted_seat, {i});
  correction.leave_out = correction.runs;
  found.add(run.tilted(i), {angle_range_rad, angle_range_rad}, static_cast<double>(run.n()),
            std::move(correction), "with its seat tilted");
}

}  // namespace

MistakeKind tilted_seat_kind() {
  return {.advice = tilted_seat_advice, .of_reading = explain_by_tilt};
}

}  // namespace axiscal
