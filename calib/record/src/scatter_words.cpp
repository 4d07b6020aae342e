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
                 "The sessions differ by more than their noise. The coefficients are means over "
                 "the sessions."},
    ScatterWords{"seats", "The cube's orientation varies each time the cube is laid down."},
    ScatterWords{"layings", "Consecutive readings in one pose share an error."},
    ScatterWords{"poses", "Each pose has an error of its own, which repeats in all blocks."},
    ScatterWords{"mounts",
                 "The instrument's orientation in the cube varies each time the instrument is "
                 "mounted."},
    ScatterWords{"rests",
                 "The bias changes from rest to rest: by drift, by warm-up, or with the "
                 "attitude."},
    ScatterWords{"field_noise",
                 "The scatter of readings along the field differs from the scatter across it: the "
                 "field's magnitude or the cube's orientation varies."},
    ScatterWords{"field_wander",
                 "The field's magnitude, or the gain of all axes, drifts slowly during the run."},
    ScatterWords{"correlation",
                 "Consecutive readings are correlated, so they count as fewer independent "
                 "readings."},
    ScatterWords{"curvature",
                 "The response may be nonlinear by less than the test detects. The coefficients "
                 "are means over the possible nonlinearities."},
    ScatterWords{"soaks", "The readings of the temperature levels deviate from the polynomial."},
    ScatterWords{"hysteresis", "The biases differ between rising and falling temperature."},
    ScatterWords{"rounding",
                 "The rounding step of the readings is wider than their noise, so repeated "
                 "readings share a rounding error."}};

}  // namespace

std::string_view meaning_of_scatter(std::string_view name) {
  const auto* const found = std::find_if(all_words.begin(), all_words.end(),
                                         [&](const ScatterWords& one) { return one.name == name; });
  return found == all_words.end() ? std::string_view() : found->meaning;
}

}  // namespace axiscal
