// SPDX-License-Identifier: Apache-2.0
#include "axiscal/instruments/instrument_kind.hpp"

#include <string>

#include "axiscal/core/error.hpp"
#include "axiscal/core/nearest_name.hpp"
#include "axiscal/instruments/settings.hpp"
#include "core/formatted.hpp"
#include "instruments/src/kinds/kinds.hpp"

namespace axiscal {
namespace {

std::deque<InstrumentKind>& known_kinds() {
  static std::deque<InstrumentKind> kinds = {
      accelerometer_kind(), inclinometer_kind(), magnetometer_kind(),
      gyroscope_kind(),     optical_kind(),      InstrumentKind{.name = "generic"}};
  return kinds;
}

}  // namespace

const std::deque<InstrumentKind>& instrument_kinds() {
  return known_kinds();
}

const InstrumentKind& add_instrument_kind(const InstrumentKind& kind) {
  for (const InstrumentKind& known : known_kinds()) {
    if (kind.name.empty() || known.name == kind.name) {
      throw DomainError(
          formatted("add_instrument_kind: the name '{}' is empty or exists already", kind.name));
    }
  }
  if (kind.derived_names.size() > DerivedValues{}.values.size() ||
      (!kind.derived_names.empty() && kind.derive == nullptr)) {
    throw DomainError(
        formatted("add_instrument_kind: '{}': derived_names requires derive() and may have at most "
                  "four entries",
                  kind.name));
  }
  return known_kinds().emplace_back(kind);
}

const InstrumentKind& find_instrument_kind(std::string_view name) {
  std::string list;
  std::vector<std::string_view> names;
  for (const InstrumentKind& kind : known_kinds()) {
    if (kind.name == name) {
      return kind;
    }
    names.push_back(kind.name);
    list += (list.empty() ? "" : ", ") + std::string(kind.name);
  }
  throw DomainError(formatted("unknown kind of instrument '{}'{}", name,
                              did_you_mean(name, names, "known kinds: " + list)),
                    {settings::instrument});
}

}  // namespace axiscal
