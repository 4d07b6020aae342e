// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/sensor_names.hpp"

#include <algorithm>
#include <cctype>

#include "axiscal/core/number_text.hpp"
#include "axiscal/logs/time_column.hpp"

namespace axiscal {
namespace {

struct UnitName {
  std::string_view written;  // spelling in lower case and without blanks
  KnownUnit unit;
};

constexpr double g0 = 9.80665;
constexpr double rad_per_degree = 0.017453292519943295;

constexpr KnownUnit metres = {"m/s^2", SeriesKind::accelerometer, 1.0};
constexpr KnownUnit gs = {"g", SeriesKind::accelerometer, g0};
constexpr KnownUnit milli_gs = {"mg", SeriesKind::accelerometer, 1e-3 * g0};
constexpr KnownUnit radians = {"rad/s", SeriesKind::gyroscope, 1.0};
constexpr KnownUnit milliradians = {"mrad/s", SeriesKind::gyroscope, 1e-3};
constexpr KnownUnit degrees = {"deg/s", SeriesKind::gyroscope, rad_per_degree};
constexpr KnownUnit millidegrees = {"mdeg/s", SeriesKind::gyroscope, 1e-3 * rad_per_degree};
constexpr KnownUnit teslas = {"T", SeriesKind::magnetometer, 1.0};
constexpr KnownUnit milliteslas = {"mT", SeriesKind::magnetometer, 1e-3};
constexpr KnownUnit microteslas = {"uT", SeriesKind::magnetometer, 1e-6};
constexpr KnownUnit nanoteslas = {"nT", SeriesKind::magnetometer, 1e-9};
constexpr KnownUnit gauss = {"gauss", SeriesKind::magnetometer, 1e-4};
constexpr KnownUnit milligauss = {"mgauss", SeriesKind::magnetometer, 1e-7};
constexpr KnownUnit celsius = {"degC", SeriesKind::temperature, 1.0};

constexpr std::array<UnitName, 67> unit_names = {{{"m/s^2", metres},
                                                  {"m/s2", metres},
                                                  {"m/s²", metres},
                                                  {"m/s/s", metres},
                                                  {"m/s**2", metres},
                                                  {"m*s^-2", metres},
                                                  {"ms^-2", metres},
                                                  {"m·s⁻²", metres},
                                                  {"mps2", metres},
                                                  {"mss", metres},
                                                  {"g", gs},
                                                  {"gn", gs},
                                                  {"g0", gs},
                                                  {"mg", milli_gs},
                                                  {"milli-g", milli_gs},
                                                  {"rad/s", radians},
                                                  {"rad/sec", radians},
                                                  {"rps", radians},
                                                  {"radians/s", radians},
                                                  {"mrad/s", milliradians},
                                                  {"deg/s", degrees},
                                                  {"deg/sec", degrees},
                                                  {"degrees/s", degrees},
                                                  {"°/s", degrees},
                                                  {"°/sec", degrees},
                                                  {"º/s", degrees},
                                                  {"dps", degrees},
                                                  {"mdps", millidegrees},
                                                  {"mdeg/s", millidegrees},
                                                  {"t", teslas},
                                                  {"tesla", teslas},
                                                  {"mt", milliteslas},
                                                  {"ut", microteslas},
                                                  {"µt", microteslas},  // micro sign
                                                  {"μt", microteslas},  // Greek mu
                                                  {"microtesla", microteslas},
                                                  {"nt", nanoteslas},
                                                  {"gauss", gauss},
                                                  {"ga", gauss},
                                                  {"gs", gauss},
                                                  {"mgauss", milligauss},
                                                  {"mga", milligauss},
                                                  {"degc", celsius},
                                                  {"°c", celsius},
                                                  {"℃", celsius},
                                                  {"celsius", celsius},
                                                  {"metres/s^2", metres},
                                                  {"meters/s^2", metres},
                                                  {"meterspersecondsquared", metres},
                                                  {"metrespersecondsquared", metres},
                                                  {"gravity", gs},
                                                  {"degreespersecond", degrees},
                                                  {"degs/s", degrees},
                                                  {"radianspersecond", radians},
                                                  {"milliradianspersecond", milliradians},
                                                  {"teslas", teslas},
                                                  {"milliteslas", milliteslas},
                                                  {"millitesla", milliteslas},
                                                  {"microteslas", microteslas},
                                                  {"nanotesla", nanoteslas},
                                                  {"nanoteslas", nanoteslas},
                                                  {"milligauss", milligauss},
                                                  {"millig", milli_gs},
                                                  {"degreescelsius", celsius},
                                                  {"degreesc", celsius},
                                                  {"degcelsius", celsius},
                                                  {"deg.c", celsius}}};

bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

bool is_digits(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(),
                                      [](unsigned char c) { return std::isdigit(c) != 0; });
}

// Removes the word "axis" and separators from a name: "a_x" becomes "ax", "x-axis" becomes "x".
std::string letters_of_axis(std::string small) {
  const std::size_t axis = small.find("axis");
  if (axis != std::string::npos) {
    small.erase(axis, 4);
  }
  std::erase_if(small, [](char c) { return c == '_' || c == '-' || c == ' '; });
  return small;
}

// @return true if a name denotes a quantity that a calibration cannot use. Such quantities are
//         accelerations without gravity, which phones and filters compute, and gravity computed by
//         a filter.
bool is_without_gravity(std::string_view small) {
  const bool has_it = contains(small, "including") || contains(small, "with_gravity") ||
                      contains(small, "with gravity") || contains(small, "withgravity");
  return (!has_it && contains(small, "gravity")) || contains(small, "linear acc") ||
         contains(small, "linearacc") || small == "acceleration without gravity" ||
         contains(small, "freeacc") || contains(small, "free acc") || contains(small, "free_acc") ||
         contains(small, "useracc") || contains(small, "user_acc");
}

// Finds a unit within a name, after an underscore: "accel_mps2_x", "gyro_rad",
// "magnetometer_ga[0]", "acc_x_g".
std::optional<KnownUnit> unit_within(std::string_view name, SeriesKind kind) {
  struct Part {
    std::string_view text;
    KnownUnit unit;
  };
  constexpr std::array<Part, 14> parts = {{{"_m_s2", metres},
                                           {"_mps2", metres},
                                           {"_mss", metres},
                                           {"_rad_s", radians},
                                           {"_radps", radians},
                                           {"_rads", radians},
                                           {"_rad", radians},
                                           {"_dps", degrees},
                                           {"_deg_s", degrees},
                                           {"_degs", degrees},
                                           {"_ut", microteslas},
                                           {"_nt", nanoteslas},
                                           {"_ga", gauss},
                                           {"_mg", milli_gs}}};
  for (const Part& part : parts) {
    const std::size_t at = name.find(part.text);
    const std::size_t end = at == std::string_view::npos ? at : at + part.text.size();
    const bool ends =
        at != std::string_view::npos &&
        (end == name.size() || std::isalnum(static_cast<unsigned char>(name[end])) == 0);
    if (ends && part.unit.kind == kind) {
      return part.unit;
    }
  }
  if (kind == SeriesKind::accelerometer && name.ends_with("_g")) {
    return gs;
  }
  return std::nullopt;
}

// For a table that does not state units, finds the unit of a column in what is known about the
// program that wrote the table. The program is recognised by a column: "TimeUS" for ArduPilot's
// messages as CSV, "PacketCounter" for Xsens's exports, "seconds_elapsed" for Sensor Logger, and
// "%time" for rostopic echo.
// @return the unit; empty if it is not known.
std::string unit_of_writer(const std::vector<std::string>& columns,
                           std::string_view table,
                           std::string_view name,
                           SeriesKind kind) {
  const auto has = [&](std::string_view column) {
    return std::find(columns.begin(), columns.end(), column) != columns.end();
  };
  if (name.starts_with("field.") || has("%time")) {  // sensor_msgs, written by rostopic echo -p
    return kind == SeriesKind::accelerometer  ? "m/s^2"
           : kind == SeriesKind::gyroscope    ? "rad/s"
           : kind == SeriesKind::magnetometer ? "T"
                                              : "";
  }
  if (has("TimeUS") || has("TimeMS")) {
    return name.starts_with("Acc")   ? "m/s^2"
           : name.starts_with("Gyr") ? "rad/s"
           : name.starts_with("Mag") ? "mgauss"
           : name == "T"             ? "degC"
                                     : "";
  }
  if (has("PacketCounter")) {
    return name.starts_with("Acc_") ? "m/s^2" : name.starts_with("Gyr_") ? "rad/s" : "";
  }
  if (has("seconds_elapsed")) {
    // Android phones record accelerations in m/s^2, but iPhones record uncalibrated accelerations
    // in g. The unit is therefore found later, from the values.
    return kind == SeriesKind::gyroscope      ? "rad/s"
           : kind == SeriesKind::magnetometer ? "uT"
           : table == "TotalAcceleration"     ? "m/s^2"
                                              : "";
  }
  return "";
}

}  // namespace

std::string to_lower_case(std::string_view text) {
  std::string small(text);
  std::transform(small.begin(), small.end(), small.begin(), [](unsigned char c) {
    return static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  });
  return small;
}

std::optional<KnownUnit> known_unit(std::string_view text, SeriesKind of) {
  std::string small;
  for (const char c : to_lower_case(text)) {
    if (c != ' ' && c != '(' && c != ')') {  // "m/(s^2)" becomes "m/s^2"
      small += c;
    }
  }
  if (of == SeriesKind::other && trimmed(text) == "mG") {
    return milligauss;
  }
  if (of == SeriesKind::magnetometer) {
    if (small == "g") {
      return gauss;
    }
    if (small == "mg") {
      return milligauss;
    }
  }
  if (trimmed(text) == "mT") {
    return milliteslas;
  }
  if (of == SeriesKind::temperature && (small == "c" || small == "°")) {
    return celsius;
  }
  const auto* const found =
      std::find_if(unit_names.begin(), unit_names.end(),
                   [&](const UnitName& name) { return name.written == small; });
  return found == unit_names.end() ? std::nullopt : std::optional(found->unit);
}

namespace {

// @return the position of the bracket that matches the closing bracket at the end of a text; npos
//         if there is none.
std::size_t opening_bracket(std::string_view text, char open, char close) {
  int depth = 0;
  for (std::size_t at = text.size(); at-- > 0;) {
    depth += text[at] == close ? 1 : text[at] == open ? -1 : 0;
    if (depth == 0) {
      return at;
    }
  }
  return std::string_view::npos;
}

bool is_unit_of_time(std::string_view text) {
  constexpr std::array<std::string_view, 9> units = {"s",  "ms", "us",      "ns",          "sec",
                                                     "µs", "μs", "seconds", "milliseconds"};
  return std::find(units.begin(), units.end(), text) != units.end();
}

}  // namespace

NamedColumn named_column(std::string_view header) {
  header = trimmed(header);
  for (const auto& [open, close] : {std::pair{'(', ')'}, std::pair{'[', ']'}}) {
    if (!header.ends_with(close)) {
      continue;
    }
    const std::size_t at = opening_bracket(header, open, close);
    if (at == std::string_view::npos || at == 0) {
      continue;
    }
    std::string_view inside = trimmed(header.substr(at + 1, header.size() - at - 2));
    if (inside.starts_with("in ")) {
      inside = trimmed(inside.substr(3));
    }
    if (inside.empty() || is_digits(inside)) {
      continue;
    }
    return {.name = std::string(trimmed(header.substr(0, at))), .unit = std::string(inside)};
  }
  if (const std::size_t slash = header.find(" / "); slash != std::string_view::npos) {
    return {.name = std::string(trimmed(header.substr(0, slash))),
            .unit = std::string(trimmed(header.substr(slash + 3)))};
  }
  if (const std::size_t in = header.rfind(" in "); in != std::string_view::npos) {
    const std::string_view unit = trimmed(header.substr(in + 4));
    if (is_unit_of_time(unit) || known_unit(unit)) {
      return {.name = std::string(trimmed(header.substr(0, in))), .unit = std::string(unit)};
    }
  }
  return {.name = std::string(header)};
}

namespace {

// @return the kind of quantity that a part of a name states. The last known word determines it:
//         "gyro_mag_x" is a magnetometer, and "acc_temp" is a temperature.
SeriesKind kind_of_part(std::string_view small) {
  struct Word {
    std::string_view text;
    SeriesKind kind;
  };
  constexpr std::array<Word, 22> words = {{{"acc", SeriesKind::accelerometer},
                                           {"acel", SeriesKind::accelerometer},
                                           {"beschl", SeriesKind::accelerometer},
                                           {"specific_force", SeriesKind::accelerometer},
                                           {"linear_acceleration", SeriesKind::accelerometer},
                                           {"gforce", SeriesKind::accelerometer},
                                           {"g-force", SeriesKind::accelerometer},
                                           {"g force", SeriesKind::accelerometer},
                                           {"gyr", SeriesKind::gyroscope},
                                           {"giro", SeriesKind::gyroscope},
                                           {"drehrate", SeriesKind::gyroscope},
                                           {"angular_velocity", SeriesKind::gyroscope},
                                           {"angular velocity", SeriesKind::gyroscope},
                                           {"rotationrate", SeriesKind::gyroscope},
                                           {"rotation_rate", SeriesKind::gyroscope},
                                           {"angularrate", SeriesKind::gyroscope},
                                           {"angular_rate", SeriesKind::gyroscope},
                                           {"omega", SeriesKind::gyroscope},
                                           {"mag", SeriesKind::magnetometer},
                                           {"compass", SeriesKind::magnetometer},
                                           {"temp", SeriesKind::temperature},
                                           {"brujula", SeriesKind::magnetometer}}};
  SeriesKind kind = SeriesKind::other;
  std::size_t last = 0;
  for (const Word& word : words) {
    const std::size_t at = small.rfind(word.text);
    const bool is_other_word =
        word.text == "mag" && (contains(small, "magnitude") || contains(small, "image"));
    if (at != std::string_view::npos && !is_other_word &&
        (kind == SeriesKind::other || at > last)) {
      kind = word.kind;
      last = at;
    }
  }
  return kind;
}

}  // namespace

SeriesKind sensor_kind_in(std::string_view words) {
  const std::string small = to_lower_case(words);
  if (is_without_gravity(small) || contains(small, "accuracy")) {
    return SeriesKind::other;
  }
  // The last part of the name that contains a known word determines the kind: "Gyro.mag_x" is a
  // magnetometer, and "/imu/gyro/acc" is an accelerometer.
  std::string_view rest = small;
  for (;;) {
    const std::size_t at = rest.find_last_of("./");
    const SeriesKind kind = kind_of_part(at == std::string_view::npos ? rest : rest.substr(at + 1));
    if (kind != SeriesKind::other || at == std::string_view::npos) {
      return kind;
    }
    rest = rest.substr(0, at);
  }
}

std::optional<std::size_t> axis_of_name(std::string_view name) {
  std::string small = to_lower_case(trimmed(name));
  if (small.ends_with(']') && small.size() > 3 && small[small.size() - 3] == '[') {
    const char digit = small[small.size() - 2];
    if (digit >= '0' && digit <= '2') {
      return static_cast<std::size_t>(digit - '0');
    }
  }
  // The letter may be at the end of the name, as in "x", "acc_x", "AccX" or "ax", or at its
  // beginning, as in "xacc".
  const auto axis = [](char c) -> std::optional<std::size_t> {
    return c >= 'x' && c <= 'z' ? std::optional(static_cast<std::size_t>(c - 'x')) : std::nullopt;
  };
  if (small.empty()) {
    return std::nullopt;
  }
  if (const auto last = axis(small.back())) {
    return last;
  }
  // The letter may also be between characters other than letters and digits, as in "accel_x_g" or
  // "acc_x_raw".
  for (std::size_t i = 1; i + 1 < small.size(); ++i) {
    const bool alone = std::isalnum(static_cast<unsigned char>(small[i - 1])) == 0 &&
                       std::isalnum(static_cast<unsigned char>(small[i + 1])) == 0;
    if (const auto inside = axis(small[i]); inside && alone) {
      return inside;
    }
  }
  const bool leads = sensor_kind_in(small) != SeriesKind::other || small.find("axis") == 2;
  return leads ? axis(small.front()) : std::nullopt;
}

SensorColumns::SensorColumns(const std::vector<std::string>& columns, std::string_view table)
    : series_(columns.size()) {
  std::vector<NamedColumn> names;
  for (const std::string& column : columns) {
    names.push_back(named_column(column));
  }
  if (const std::optional<TimeColumn> found = find_time_column("", columns, "")) {
    time_ = found->position;
    seconds_ = found->unit_is_stated ? found->seconds : 0.0;
  }
  const auto has_letters = [&](std::string_view letters) {
    return std::any_of(names.begin(), names.end(), [&](const NamedColumn& one) {
      return letters_of_axis(to_lower_case(one.name)) == letters;
    });
  };
  const SeriesKind kind_of_table = sensor_kind_in(table);
  // Sensor Logger's Accelerometer.csv excludes gravity, and TotalAcceleration.csv includes gravity.
  const bool is_sensor_logger =
      std::find(columns.begin(), columns.end(), "seconds_elapsed") != columns.end();
  const bool table_without_gravity =
      is_without_gravity(to_lower_case(table)) || (is_sensor_logger && table == "Accelerometer");
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const std::string small = to_lower_case(names[c].name);
    Series& series = series_[c];
    if (c == time_ || is_without_gravity(small)) {
      continue;
    }
    const bool is_axis = axis_of_name(small).has_value();
    // Two letters after the last dot have priority over the words before it: "Mag_Accel.mx" is a
    // magnetometer.
    const std::string last = small.substr(small.find_last_of("./") + 1);
    const std::string behind_point =
        last.size() < small.size() && last.size() == 2 ? letters_of_axis(last) : "";
    SeriesKind kind = behind_point.starts_with('a')   ? SeriesKind::accelerometer
                      : behind_point.starts_with('g') ? SeriesKind::gyroscope
                      : behind_point.starts_with('m') ? SeriesKind::magnetometer
                                                      : sensor_kind_in(small);
    KnownBy by = KnownBy::names;
    // Without separators, names such as ax, a_x, wx or bx have two letters; x or x-axis have one.
    const std::string letters = letters_of_axis(small);
    // Physics Toolbox calls its columns gFx, gFy, gFz.
    if (kind == SeriesKind::other && is_axis && letters.size() == 3 && letters.starts_with("gf")) {
      kind = SeriesKind::accelerometer;
    }
    // The columns tx, ty, tz are an accelerometer if there is a column wx. If there is a column qx,
    // they are the positions of a trajectory.
    if (kind == SeriesKind::other && is_axis && letters.size() == 2 && letters[0] == 't' &&
        has_letters("wx") && !has_letters("qx")) {
      kind = SeriesKind::accelerometer;
    }
    if (kind == SeriesKind::other && is_axis && letters.size() == 2) {
      kind = letters[0] == 'a'                        ? SeriesKind::accelerometer
             : letters[0] == 'g' || letters[0] == 'w' ? SeriesKind::gyroscope
             : letters[0] == 'm' || letters[0] == 'b' ? SeriesKind::magnetometer
                                                      : SeriesKind::other;
    }
    if (kind == SeriesKind::other && is_axis && !table_without_gravity &&
        (letters.size() == 1 || small == "field.vector." + small.substr(small.size() - 1))) {
      kind = kind_of_table;
    }
    if (kind == SeriesKind::other && small == "t") {  // a temperature if its unit is degC
      const bool is_temperature = known_unit(names[c].unit, SeriesKind::temperature).has_value() ||
                                  unit_of_writer(columns, table, names[c].name, kind) == "degC";
      kind = is_temperature ? SeriesKind::temperature : kind;
    }
    std::optional<KnownUnit> unit = known_unit(names[c].unit, kind);
    if (!unit) {
      unit = unit_within(small, kind);
    }
    if (!unit && letters.size() == 3 && letters.starts_with("gf")) {
      unit = gs;
    }
    if (kind == SeriesKind::other && unit && is_axis && !table_without_gravity &&
        letters.size() <= 2) {
      kind = unit->kind;
      by = KnownBy::units;
    }
    const bool three = kind != SeriesKind::temperature;
    if (kind == SeriesKind::other || (three && !is_axis) || (unit && unit->kind != kind)) {
      series.unit = names[c].unit;
      continue;
    }
    series = {.kind = kind, .unit = unit ? std::string(unit->name) : names[c].unit, .known_by = by};
  }
  // If a column states no unit, the unit is known from the program that wrote the table.
  for (std::size_t c = 0; c < columns.size(); ++c) {
    if (series_[c].kind != SeriesKind::other && series_[c].unit.empty()) {
      series_[c].unit = unit_of_writer(columns, table, names[c].name, series_[c].kind);
    }
  }
  // A sensor has three axes. If the columns of a kind do not contain x, y and z equally often, none
  // of them is used.
  for (const SeriesKind kind :
       {SeriesKind::accelerometer, SeriesKind::gyroscope, SeriesKind::magnetometer}) {
    std::array<std::size_t, 3> found{};
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (series_[c].kind == kind) {
        ++found[axis_of_name(names[c].name).value_or(0)];
      }
    }
    if (found[0] != found[1] || found[1] != found[2]) {
      for (Series& series : series_) {
        if (series.kind == kind) {
          series = {.unit = series.unit};
        }
      }
    }
  }
}

}  // namespace axiscal
