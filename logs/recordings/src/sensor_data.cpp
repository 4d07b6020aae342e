// SPDX-License-Identifier: Apache-2.0
#include "logs/recordings/src/sensor_data.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <functional>
#include <optional>

#include "axiscal/core/median.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/logs/sensor_names.hpp"

namespace axiscal {
namespace {

constexpr std::size_t fewest_rows = 50;  // rows needed to recognise columns by their values

// True if a column never decreases, and increases at more than a quarter of the rows, as times do.
bool ascends(const std::vector<double>& values) {
  std::size_t up = 0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (!(values[i] >= values[i - 1])) {
      return false;
    }
    up += values[i] > values[i - 1] ? 1U : 0U;
  }
  return values.size() >= fewest_rows && 4 * up > values.size();
}

// True if a column increases in equal steps, as times or a counter do.
bool ascends_evenly(const std::vector<double>& values) {
  if (!ascends(values)) {
    return false;
  }
  std::vector<double> steps;
  for (std::size_t i = 1; i < values.size(); ++i) {
    steps.push_back(values[i] - values[i - 1]);
  }
  const double usual = upper_median(steps);
  const auto even = std::count_if(steps.begin(), steps.end(), [&](double step) {
    return step > 0.2 * usual && step < 5.0 * usual;
  });
  return usual > 0.0 && 10 * even >= 9 * static_cast<std::ptrdiff_t>(steps.size());
}

double length_of(const LogBlock& block, std::size_t first, std::size_t row) {
  return std::hypot(block[first][row], block[first + 1][row], block[first + 2][row]);
}

// Statistics of the magnitudes of the vectors whose components are three columns: `middle` is the
// median magnitude, and `spread` is the median of |magnitude - middle| / middle.
struct Lengths {
  double middle = 0.0;
  double spread = 1.0;
  // True if the vectors point in several directions. Otherwise a constant magnitude does not show
  // which quantity was measured.
  bool has_turned = false;

  // True for unit vectors, for example normalised directions from a filter or a sun sensor.
  [[nodiscard]] bool are_normalised() const {
    constexpr double exactly = 1e-3;
    return std::abs(middle - 1.0) < exactly && spread < exactly;
  }
};

Lengths lengths_of(const LogBlock& block, std::size_t first) {
  std::vector<double> lengths;
  std::array<std::array<double, 3>, 3> directions{};  // sum of u u^T, u: unit vector
  double turned = 0.0;
  for (std::size_t row = 0; row < block[first].size(); ++row) {
    const double length = length_of(block, first, row);
    if (std::isfinite(length)) {
      lengths.push_back(length);
    }
    if (std::isfinite(length) && length > 0.0) {
      turned += 1.0;
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
          directions[i][j] += block[first + i][row] * block[first + j][row] / (length * length);
        }
      }
    }
  }
  if (lengths.size() < fewest_rows) {
    return {};
  }
  const double middle = upper_median(lengths);
  std::vector<double> off;
  for (const double length : lengths) {
    off.push_back(std::abs(length - middle) / middle);
  }
  // The squared norm of the mean of u u^T is 1 if all u are along one line, 1/2 if they are spread
  // over a plane, and 1/3 if they are spread over all directions.
  double concentration = 0.0;
  for (const std::array<double, 3>& row : directions) {
    for (const double entry : row) {
      concentration += entry * entry / (turned * turned);
    }
  }
  constexpr double about_one_line = 0.8;
  return {.middle = middle,
          .spread = middle > 0.0 ? upper_median(off) : 1.0,
          .has_turned = concentration < about_one_line};
}

// @return the unit in which the median magnitude is that of gravity; empty if there is no such
//         unit.
std::string gravity_unit(const Lengths& lengths) {
  constexpr double g0 = 9.80665;
  constexpr double within = 0.06;
  constexpr double steady = 0.06;
  const auto is = [&](double g) { return std::abs(lengths.middle / g - 1.0) < within; };
  if (!(lengths.spread < steady)) {
    return "";
  }
  return is(g0) ? "m/s^2" : is(1.0) ? "g" : is(1000.0) ? "mg" : "";
}

// @return the unit in which the median magnitude is 20 to 80 uT, which includes the geomagnetic
//         field (22 to 67 uT); empty if there is no such unit.
std::string magnetic_unit(const Lengths& lengths) {
  struct Unit {
    const char* name;
    double lowest;  // 20 uT in this unit
  };
  constexpr std::array<Unit, 4> units = {
      {{"gauss", 0.2}, {"uT", 20.0}, {"mgauss", 200.0}, {"nT", 2e4}}};
  constexpr double steady = 0.15;
  constexpr double widest = 4.0;
  for (const Unit& unit : units) {
    if (lengths.spread < steady && lengths.middle > unit.lowest &&
        lengths.middle < widest * unit.lowest) {
      return unit.name;
    }
  }
  return "";
}

using Vector = std::array<double, 3>;

Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Tests whether three columns are the rates of a gyroscope. Such rates explain how the vector `up`
// changes, which is the gravity that an accelerometer measures: d(up)/dt = -rate x up. The changes
// are computed over `step` samples, because over one sample a slow rotation is hidden by noise.
// @return the correlation between the measured changes and -rate x up, -1 to 1; 0 if gravity does
//         not change, or if -rate x up is always 0.
double turning_of(const LogBlock& block, std::size_t gravity, std::size_t rates, std::size_t step) {
  double product = 0.0;
  double changes = 0.0;
  double turns = 0.0;
  for (std::size_t row = 0; row + step < block[gravity].size(); row += step) {
    const auto vector = [&](std::size_t first, std::size_t at) {
      return Vector{block[first][at], block[first + 1][at], block[first + 2][at]};
    };
    const Vector up = vector(gravity, row + step / 2);
    const double length = std::sqrt(dot(up, up));
    const Vector before = vector(gravity, row);
    const Vector after = vector(gravity, row + step);
    Vector mean{};
    for (std::size_t i = 0; i < step; ++i) {
      const Vector rate = vector(rates, row + i);
      for (std::size_t k = 0; k < 3; ++k) {
        mean[k] += rate[k] / static_cast<double>(step);
      }
    }
    const Vector turn = cross(up, mean);  // -rate x up
    const Vector change = {after[0] - before[0], after[1] - before[1], after[2] - before[2]};
    if (length > 0.0 && std::isfinite(dot(change, turn))) {
      product += dot(change, turn) / (length * length);
      changes += dot(change, change) / (length * length);
      turns += dot(turn, turn) / (length * length);
    }
  }
  return changes > 0.0 && turns > 0.0 ? product / std::sqrt(changes * turns) : 0.0;
}

// @return a name without the underscore and the number at its end, "accelBuffer" for
//         "accelBuffer_2"; empty if the name does not end with a number.
std::string_view stem_of_part(std::string_view name) {
  const std::size_t end = name.find_last_not_of("0123456789");
  if (end == std::string_view::npos || end + 1 == name.size() || name[end] != '_') {
    return {};
  }
  return name.substr(0, end);
}

void set(TableColumns& columns, std::size_t first, const Series& what) {
  for (std::size_t c = first; c < first + 3; ++c) {
    columns.series[c] = what;
  }
}

// @return true if three columns from `first` on, and the column before or after them, are the four
//         numbers of a quaternion.
bool is_quaternion_at(const LogBlock& block, std::size_t first) {
  for (const std::size_t begin : {first, first == 0 ? first : first - 1}) {
    if (begin + 3 >= block.size()) {
      continue;
    }
    std::size_t rows = 0;
    std::size_t of_length_1 = 0;
    for (std::size_t row = 0; row < block[begin].size(); ++row) {
      const double length = std::hypot(length_of(block, begin, row), block[begin + 3][row]);
      constexpr double rounded = 5e-3;
      rows += std::isfinite(length) ? 1U : 0U;
      of_length_1 += std::abs(length - 1.0) < rounded ? 1U : 0U;
    }
    if (rows >= fewest_rows && 10 * of_length_1 >= 9 * rows) {
      return true;
    }
  }
  return false;
}

// Recognises the columns of a matrix: "accelBuffer_1" to "accelBuffer_4" are a time and three axes,
// "gyro_1" to "gyro_3" are three axes.
void recognise_matrices(const std::vector<std::string>& names,
                        const LogBlock& block,
                        TableColumns& columns) {
  for (std::size_t first = 0; first < names.size();) {
    const std::string_view stem = stem_of_part(names[first]);
    std::size_t end = first + 1;
    while (end < names.size() && !stem.empty() && stem_of_part(names[end]) == stem) {
      ++end;
    }
    const bool has_time = end - first >= 2 && ascends(block[first]);
    const std::size_t axes = first + (has_time ? 1 : 0);
    if (has_time && !columns.time) {
      columns.time = first;
    }
    const SeriesKind kind = sensor_kind_in(stem);
    if (end - axes == 3 && kind != SeriesKind::other && kind != SeriesKind::temperature) {
      set(columns, axes,
          {.kind = kind,
           .unit = kind == SeriesKind::accelerometer ? gravity_unit(lengths_of(block, axes)) : "",
           .known_by = KnownBy::names});
    } else if (end - axes == 1 && kind == SeriesKind::temperature) {
      columns.series[axes] = {.kind = kind, .known_by = KnownBy::names};
    }
    first = end;
  }
}

}  // namespace

std::string unit_of_gravity(const std::vector<double>& first,
                            const std::vector<double>& second,
                            const std::vector<double>& third) {
  return gravity_unit(lengths_of({first, second, third}, 0));
}

bool is_generic_name(std::string_view name) {
  const NamedColumn parts = named_column(name);
  std::string small;
  for (const char c : parts.name) {
    if (c != '_' && c != '[' && c != ']' && c != ' ' &&
        std::isdigit(static_cast<unsigned char>(c)) == 0) {
      small += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  constexpr std::array<std::string_view, 14> plain = {
      "", "c", "x", "y", "z", "v", "a", "ch", "col", "column", "data", "value", "axis", "val"};
  return std::find(plain.begin(), plain.end(), small) != plain.end() ||
         !stem_of_part(parts.name).empty();
}

TableColumns recognise_columns(const std::vector<std::string>& names,
                               std::string_view table,
                               const LogBlock& block) {
  const SensorColumns sensors(names, table);
  TableColumns columns{
      .series = sensors.series(), .time = sensors.time(), .seconds = sensors.seconds()};
  const auto is_empty = [&](std::size_t c) {
    return std::none_of(block[c].begin(), block[c].end(),
                        [](double v) { return std::isfinite(v); });
  };
  if (columns.time && is_empty(*columns.time)) {
    columns.time.reset();
  }
  const auto has = [&](SeriesKind kind) {
    return std::any_of(columns.series.begin(), columns.series.end(),
                       [&](const Series& series) { return series.kind == kind; });
  };
  const bool has_names =
      has(SeriesKind::accelerometer) || has(SeriesKind::gyroscope) || has(SeriesKind::magnetometer);
  if (!has_names) {
    recognise_matrices(names, block, columns);
  }
  // If the unit of an accelerometer is not stated, it is found from the magnitude of gravity.
  for (std::size_t c = 0; c + 2 < names.size(); ++c) {
    Series& series = columns.series[c];
    const auto same = [&](std::size_t other) {
      return columns.series[other].kind == SeriesKind::accelerometer;
    };
    if (series.kind == SeriesKind::accelerometer && series.unit.empty() && same(c + 1) &&
        same(c + 2)) {
      const std::string unit = gravity_unit(lengths_of(block, c));
      for (std::size_t k = c; k < c + 3; ++k) {
        columns.series[k].unit = unit;
      }
      c += 2;
    }
  }
  // In files of the app Sensor Logger, columns are not recognised by their values, with one
  // exception. Accelerometer.csv usually excludes gravity, but is used if its values include
  // gravity.
  const bool is_of_phone = std::find(names.begin(), names.end(), "seconds_elapsed") != names.end();
  for (std::size_t c = 0; is_of_phone && table == "Accelerometer" && c + 2 < names.size(); ++c) {
    const bool are_axes =
        names[c].size() == 1 && names[c + 1].size() == 1 && names[c + 2].size() == 1;
    const std::string unit = are_axes ? gravity_unit(lengths_of(block, c)) : "";
    if (!unit.empty()) {
      set(columns, c,
          {.kind = SeriesKind::accelerometer, .unit = unit, .known_by = KnownBy::names});
      return columns;
    }
  }
  if (has(SeriesKind::accelerometer) || has_names || is_of_phone) {
    return columns;
  }
  // From here on, columns are recognised only by their values.
  if (!columns.time && !names.empty() && ascends_evenly(block[0])) {
    columns.time = 0;
  }
  std::optional<std::size_t> gravity;
  const auto is_free = [&](std::size_t c) {
    return c != columns.time && columns.series[c].kind == SeriesKind::other &&
           is_generic_name(names[c]);
  };
  const auto three_free = [&](std::size_t c) {
    return c + 2 < names.size() && is_free(c) && is_free(c + 1) && is_free(c + 2);
  };
  // Of several possible triples of columns, the one whose magnitude varies least is chosen. The
  // magnitude varies more if a triple contains columns of two sensors.
  struct Candidate {
    std::size_t first = 0;
    std::string unit;
    double spread = 1.0;
  };
  const auto steadiest = [&](const std::function<std::string(const Lengths&)>& unit_of) {
    std::optional<Candidate> best;
    for (std::size_t c = 0; c + 2 < names.size(); ++c) {
      if (!three_free(c)) {
        continue;
      }
      const Lengths lengths = lengths_of(block, c);
      const std::string unit =
          lengths.has_turned && !lengths.are_normalised() && !is_quaternion_at(block, c)
              ? unit_of(lengths)
              : "";
      if (!unit.empty() && (!best || lengths.spread < best->spread)) {
        best = {.first = c, .unit = unit, .spread = lengths.spread};
      }
    }
    return best;
  };
  if (const std::optional<Candidate> found = steadiest(gravity_unit)) {
    gravity = found->first;
    set(columns, found->first,
        {.kind = SeriesKind::accelerometer, .unit = found->unit, .known_by = KnownBy::data});
  }
  constexpr double clearly = 0.3;
  std::optional<std::size_t> rates;
  double best_turning = clearly;
  for (std::size_t c = 0; gravity && c < names.size(); ++c) {
    for (const std::size_t step : {4U, 16U, 64U}) {
      const double turning = three_free(c) ? turning_of(block, *gravity, c, step) : 0.0;
      if (turning > best_turning) {
        rates = c;
        best_turning = turning;
      }
    }
  }
  if (rates) {
    set(columns, *rates, {.kind = SeriesKind::gyroscope, .known_by = KnownBy::data});
  }
  // If no accelerometer is found, a magnetometer may be recognised. It must have been rotated, and
  // the magnitude of its readings must be constant and that of the Earth's field in a common unit.
  if (const std::optional<Candidate> found = gravity ? std::nullopt : steadiest(magnetic_unit)) {
    set(columns, found->first,
        {.kind = SeriesKind::magnetometer, .unit = found->unit, .known_by = KnownBy::data});
  }
  return columns;
}

}  // namespace axiscal
