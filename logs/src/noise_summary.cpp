// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/noise_summary.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rounded_value.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/logs/sensor_names.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// A unit used in data sheets, and the factor that converts a coefficient from SI units (including
// s and Hz) to this unit.
struct SheetUnit {
  double factor = 1.0;
  const char* name = "";
};

std::optional<SheetUnit> sheet_unit(SeriesKind of, NoiseKind kind) {
  constexpr double per_hour = 3600.0;
  constexpr double per_root_hour = 60.0;
  constexpr double micro_g = 1e6 / standard_gravity;
  constexpr double nano = 1e9;
  const auto chosen = [kind](const SheetUnit& white, const SheetUnit& instability,
                             const SheetUnit& walk) -> std::optional<SheetUnit> {
    switch (kind) {
      case NoiseKind::white:
        return white;
      case NoiseKind::bias_instability:
        return instability;
      case NoiseKind::random_walk:
        return walk;
      default:
        return std::nullopt;
    }
  };
  switch (of) {
    case SeriesKind::gyroscope:
      return chosen({deg_per_rad * per_root_hour, "deg/sqrt(h)"}, {deg_per_rad * per_hour, "deg/h"},
                    {deg_per_rad * per_hour * per_root_hour, "deg/h/sqrt(h)"});
    case SeriesKind::accelerometer:
      return chosen({micro_g, "ug/sqrt(Hz)"}, {micro_g, "ug"}, {micro_g, "ug/sqrt(s)"});
    case SeriesKind::magnetometer:
      return chosen({nano, "nT/sqrt(Hz)"}, {nano, "nT"}, {nano, "nT/sqrt(s)"});
    default:
      return std::nullopt;
  }
}

SeriesKind kind_of(const ColumnNoise& column) {
  for (const SeriesKind kind :
       {SeriesKind::accelerometer, SeriesKind::gyroscope, SeriesKind::magnetometer}) {
    if (column.kind == name_of(kind)) {
      return kind;
    }
  }
  return SeriesKind::other;
}

constexpr std::array sheet_kinds = {NoiseKind::white, NoiseKind::bias_instability,
                                    NoiseKind::random_walk};

}  // namespace

SheetNoise sheet_noise(const ColumnNoise& column, NoiseKind kind) {
  SheetNoise stated{.unit = noise_unit(kind, column.unit.empty() ? "unit" : column.unit)};
  double factor = 1.0;
  const std::optional<KnownUnit> unit = known_unit(column.unit, kind_of(column));
  if (unit) {
    if (const std::optional<SheetUnit> sheet = sheet_unit(unit->kind, kind)) {
      factor = unit->si * sheet->factor;
      stated.unit = sheet->name;
    }
  }
  for (const NoiseCoefficient& c : column.model.coefficients) {
    if (c.kind == kind) {
      stated.value = factor * c.value;
      stated.low = factor * c.low;
      stated.high = factor * c.high;
    }
  }
  return stated;
}

std::string sheet_text(const SheetNoise& noise) {
  if (noise.value > 0.0) {
    // The numbers are rounded to the second significant digit of the interval's width. They have at
    // most four significant digits.
    const double fourth = std::pow(10.0, std::floor(std::log10(noise.high)) - 2.0);
    const double place = std::max(noise.high - noise.low, fourth);
    return formatted("{} [{}, {}]", rounded_value(noise.value, place),
                     rounded_value(noise.low, place), rounded_value(noise.high, place));
  }
  return std::isfinite(noise.high) && noise.high > 0.0
             ? formatted("< {}", number_text(noise.high, 2))
             : "-";
}

std::string noise_summary(const LogNoise& noise) {
  constexpr std::size_t longest = 14;
  std::string text;
  std::string units_above;
  for (const ColumnNoise& one : noise.columns) {
    std::string units;
    std::string cells;
    for (const NoiseKind kind : sheet_kinds) {
      const SheetNoise stated = sheet_noise(one, kind);
      units += formatted(" {:>20}", "[" + stated.unit + "]");
      cells += formatted(" {:>20}", sheet_text(stated));
    }
    if (units != units_above) {
      text += formatted("{}{:<16}{:>21}{:>21}{:>21}\n{:<16}{}\n", text.empty() ? "" : "\n",
                        one.kind.empty() ? "column" : one.kind, "N white noise", "B instability",
                        "K random walk", "", units);
      units_above = units;
    }
    // Only the end of a long name is shown, because it is more specific than the beginning.
    const std::string name = one.name.size() > longest
                                 ? ".." + one.name.substr(one.name.size() - longest + 2)
                                 : one.name;
    text += formatted("  {:<14}{}\n", name, cells);
  }
  return text;
}

}  // namespace axiscal
