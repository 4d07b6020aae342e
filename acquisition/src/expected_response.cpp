// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/expected_response.hpp"

#include <array>
#include <cmath>

#include "axiscal/acquisition/pose_model.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/field_kind.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Units that are often confused, and the factor by which the wrong unit changes a reading.
struct UnitMistake {
  double factor;
  std::string_view text;
};
constexpr std::array unit_mistakes = {
    UnitMistake{standard_gravity, "m/s^2 instead of g"},
    UnitMistake{1.0 / standard_gravity, "g instead of m/s^2"},
    UnitMistake{1e3, "1/1000 of the stated unit"},
    UnitMistake{1e-3, "1000 times the stated unit"},
    UnitMistake{deg_per_rad, "deg instead of rad"},
    UnitMistake{rad_per_deg, "rad instead of deg"},
    UnitMistake{0.1, "mT instead of Gauss, or another factor of 10"},
};

}  // namespace

double expected_direction_sd(const Experiment& experiment, const FieldDescription& field) {
  if (!field.in_table && !field_kind(field.kind).along_normal) {
    return any_direction_rad;
  }
  const bool along_normal =
      !field.in_table || field.in_table->head<2>().norm() < 1e-3 * field.in_table->norm();
  constexpr double off_level_rad = 0.02;
  // Standard deviation of the field's direction due to iron near the table.
  constexpr double local_field_rad = 0.15;
  constexpr double any_heading_rad = 0.35;
  if (along_normal) {
    return off_level_rad;
  }
  return experiment.table.fence_azimuth_rad ? local_field_rad : any_heading_rad;
}

std::string unit_mistake_text(double ratio) {
  constexpr double near = 0.1;
  for (const UnitMistake& mistake : unit_mistakes) {
    if (std::abs(std::log(ratio / mistake.factor)) < near) {
      return formatted(
          "the readings are {} times the expected value: is their unit {}? Correct the unit or the "
          "source",
          number_text(mistake.factor, 4), mistake.text);
    }
  }
  return "";
}

}  // namespace axiscal
