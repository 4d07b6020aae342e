// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/field_kind.hpp"

#include <algorithm>
#include <optional>

#include "axiscal/core/error.hpp"
#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/field/field_unit.hpp"
#include "core/formatted.hpp"
#include "field/src/field_entries.hpp"

namespace axiscal {
namespace {

// A vector with reserved memory: field_kinds() needs contiguous entries, and references to entries
// must stay valid when a kind is added.
std::vector<FieldKind>& kinds() {
  constexpr std::size_t most_kinds = 256;
  static std::vector<FieldKind> all = [] {
    std::vector<FieldKind> built_in = {
        gravity_entry(), geomagnetic_entry(), earth_rotation_entry(), turntable_entry(),
        coil_entry(),    light_entry(),       custom_entry()};
    built_in.reserve(most_kinds);
    return built_in;
  }();
  return all;
}

}  // namespace

std::span<const FieldKind> field_kinds() {
  return kinds();
}

void add_field_kind(const FieldKind& kind) {
  if (kind.name.empty() || !field_kind(kind.name).name.empty() ||
      kinds().size() == kinds().capacity()) {
    throw DomainError(formatted("a kind of field '{}' cannot be added: {}", kind.name,
                                kind.name.empty() ? "its name is empty" : "it exists already"));
  }
  kinds().push_back(kind);
}

const FieldKind& field_kind(std::string_view name) {
  static const FieldKind another = {};
  const auto found = std::find_if(kinds().begin(), kinds().end(),
                                  [&](const FieldKind& kind) { return kind.name == name; });
  return found == kinds().end() ? another : *found;
}

std::string list_of_field_kinds() {
  std::vector<std::string> names;
  for (const FieldKind& kind : kinds()) {
    names.emplace_back(kind.name);
  }
  return joined(names);
}

bool is_possible_magnitude(const FieldKind& kind, double magnitude, std::string_view unit) {
  if (kind.greatest_magnitude == 0.0) {
    return true;
  }
  const std::optional<double> factor = reading_factor_between(unit, kind.units.front());
  return !factor || (magnitude * *factor >= kind.least_magnitude &&
                     magnitude * *factor <= kind.greatest_magnitude);
}

std::string possible_magnitudes(const FieldKind& kind, std::string_view unit) {
  const double factor = reading_factor_between(kind.units.front(), unit).value_or(1.0);
  return formatted("{} to {} {}", number_text(kind.least_magnitude * factor, 4),
                   number_text(kind.greatest_magnitude * factor, 4), unit);
}

void check_field_kind(std::string_view kind) {
  if (field_kind(kind).name.empty()) {
    std::vector<std::string_view> names;
    for (const FieldKind& known : kinds()) {
      names.push_back(known.name);
    }
    throw SetupError(formatted(
        "unknown field '{}'{}", kind,
        did_you_mean(std::string(kind), names, "known fields: " + list_of_field_kinds())));
  }
}

}  // namespace axiscal
