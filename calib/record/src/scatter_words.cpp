// SPDX-License-Identifier: Apache-2.0
#include "calib/record/src/scatter_words.hpp"

#include <algorithm>
#include <array>

namespace axiscal {
namespace {

struct ScatterWords {
  std::string_view name;
  std::string_view meaning;
};

constexpr std::array all_words = {
    ScatterWords{"blocks",
                 "The biases differ from block to block: from day to day, or each time the "
                 "instrument is switched on."},
    ScatterWords{"block_sensitivities", "The sensitivities differ from block to block."},
    ScatterWords{"sessions",
                 "The sessions differ by more than the noise of each: the coefficients are their "
                 "mean."},
    ScatterWords{"seats", "The cube lies otherwise each time it is laid down."},
    ScatterWords{"layings", "Consecutive readings of a pose share an error."},
    ScatterWords{"poses", "Each pose has an error of its own, which repeats in all blocks."},
    ScatterWords{"mounts", "The instrument sits otherwise in the cube each time it is mounted."},
    ScatterWords{"rests",
                 "The bias changes from rest to rest: it drifts, warms up, or depends on the "
                 "attitude."},
    ScatterWords{"field_noise",
                 "Readings scatter more along the field than across it, or less: its size jitters, "
                 "or the cube lies otherwise each time."},
    ScatterWords{"field_wander",
                 "The field's size, or all gains together, wander slowly over the run."},
    ScatterWords{"correlation", "Consecutive readings are alike, and count as fewer."},
    ScatterWords{"curvature",
                 "The response may be bent by less than a test sees; the coefficients are means "
                 "over how much."},
    ScatterWords{"soaks", "The temperature levels do not lie on the polynomial."},
    ScatterWords{"hysteresis",
                 "The biases differ between the way up and the way down of the temperature."},
    ScatterWords{"rounding",
                 "The readings' step is wider than their noise, so that repeats share its error."}};

}  // namespace

std::string_view meaning_of_scatter(std::string_view name) {
  const auto* const found = std::find_if(all_words.begin(), all_words.end(),
                                         [&](const ScatterWords& one) { return one.name == name; });
  return found == all_words.end() ? std::string_view() : found->meaning;
}

}  // namespace axiscal
