// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/time_column.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/logs/log_file.hpp"
#include "axiscal/logs/sensor_names.hpp"
#include "axiscal/logs/settings.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

struct Unit {
  const char* suffix;
  const char* words;
  double seconds;
};

constexpr std::array<Unit, 4> units = {{{"s", "seconds", 1.0},
                                        {"ms", "milliseconds", 1e-3},
                                        {"us", "microseconds", 1e-6},
                                        {"ns", "nanoseconds", 1e-9}}};

constexpr double lowest_rate_hz = 0.5;
constexpr double highest_rate_hz = 1e6;
// If the unit of the times is not stated, a unit is assumed only if it gives at most this rate. If
// the unit is assumed to be seconds, the limit is highest_rate_hz.
constexpr double highest_usual_rate_hz = 2000.0;

// True if a number of seconds, counted from 1970, is a time in the years 2001 to 2039.
bool is_since_1970(double time_s) {
  return time_s > 1e9 && time_s < 2.2e9;
}

// The information about times in the name of a column, such as "time", "t_us" or "Timestamp_ms".
struct Named {
  bool is_time = false;
  std::optional<double> seconds;  // seconds per unit; nullopt if the name states no unit
};

Named named(const std::string& column) {
  // The unit follows the name: "Time (s)", "Timestamp (us)".
  if (const NamedColumn parts = named_column(column); !parts.unit.empty()) {
    const std::string name = to_lower_case(parts.name);
    const std::string unit = to_lower_case(parts.unit);
    const bool is_called_time = name == "t" || name.ends_with("time") ||
                                name.find("timestamp") != std::string::npos ||
                                name.starts_with("time ") || name == "elapsed";
    for (const Unit& known : units) {
      const bool is_unit = unit == known.suffix || unit == known.words ||
                           (known.seconds == 1.0 && (unit == "sec" || unit == "second")) ||
                           (known.seconds == 1e-6 && (unit == "µs" || unit == "μs"));
      if (is_called_time && is_unit) {
        return {.is_time = true, .seconds = known.seconds};
      }
    }
    return {};
  }
  struct Suffix {
    const char* text;
    std::optional<double> seconds;
  };
  static const std::array<Suffix, 9> suffixes = {{{"", std::nullopt},
                                                  {"_s", 1.0},
                                                  {"_sec", 1.0},
                                                  {"_ms", 1e-3},
                                                  {"_msec", 1e-3},
                                                  {"_us", 1e-6},
                                                  {"_usec", 1e-6},
                                                  {"_ns", 1e-9},
                                                  {"_nsec", 1e-9}}};
  std::string name = to_lower_case(column);
  if (const std::size_t point = name.rfind('.');
      point != std::string::npos && name != "field.header.stamp") {
    name.erase(0, point + 1);  // "imu.time" becomes "time"
  }
  std::replace(name.begin(), name.end(), ' ', '_');
  std::replace(name.begin(), name.end(), '-', '_');
  // Names that some programs use for columns of times.
  struct Known {
    const char* name;
    std::optional<double> seconds;
  };
  constexpr std::array<Known, 9> known_names = {{{"sampletimefine", std::nullopt},
                                                 {"seconds_elapsed", 1.0},
                                                 {"seconds", 1.0},
                                                 {"timeus", 1e-6},
                                                 {"timems", 1e-3},
                                                 {"micros", 1e-6},
                                                 {"millis", 1e-3},
                                                 {"field.header.stamp", 1e-9},
                                                 {"%time", 1e-9}}};
  for (const Known& known : known_names) {
    if (name == known.name) {
      return {.is_time = true, .seconds = known.seconds};
    }
  }
  for (const char* stem : {"time", "t", "timestamp", "time_stamp", "epoch", "date", "datetime",
                           "ts", "zeit", "uhrzeit", "datum", "zeitstempel"}) {
    for (const Suffix& suffix : suffixes) {
      if (name == std::string(stem) + suffix.text) {
        return {.is_time = true, .seconds = suffix.seconds};
      }
    }
  }
  return {};
}

TimeColumn column_at(std::size_t position, const std::string& name) {
  const Named what = named(name);
  return {.position = position,
          .seconds = what.seconds.value_or(1.0),
          .unit_is_stated = what.seconds.has_value(),
          .name = name};
}

std::string rate_text(double step, const Unit& unit) {
  return formatted("in {} the rate is {} Hz", unit.words,
                   number_text(1.0 / (step * unit.seconds), 3));
}

}  // namespace

std::optional<TimeColumn> find_time_column(const std::string& path,
                                           const std::vector<std::string>& columns,
                                           const std::string& name) {
  if (!name.empty()) {
    return column_at(need_column(path, columns, name), name);
  }
  // A column of dates is used only if there is no other column of times.
  std::optional<TimeColumn> date;
  for (std::size_t c = 0; c < columns.size(); ++c) {
    if (named(columns[c]).is_time) {
      const bool is_date =
          to_lower_case(columns[c]) == "date" || to_lower_case(columns[c]) == "datum";
      if (!is_date) {
        return column_at(c, columns[c]);
      }
      date = date ? date : column_at(c, columns[c]);
    }
  }
  return date;
}

double usual_step(std::span<const double> times) {
  double usual = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 3; ++round) {
    double sum = 0.0;
    double count = 0.0;
    for (std::size_t i = 1; i < times.size(); ++i) {
      const double step = times[i] - times[i - 1];
      if (step >= 0.0 && step <= 20.0 * usual) {
        sum += step;
        count += 1.0;
      }
    }
    usual = sum / count;
  }
  return usual > 0.0 ? usual : not_a_number;
}

TimeUnit settle_time_unit(const std::string& path,
                          const TimeColumn& column,
                          std::span<const double> times) {
  times = times.first(std::min(times.size(), times_that_settle_the_unit));
  const double step = usual_step(times);
  if (!(step > 0.0 && std::isfinite(step))) {
    return {.seconds = column.seconds};  // the caller reports times that do not increase
  }
  const auto rate_hz = [&](double seconds) { return 1.0 / (step * seconds); };
  const auto is_rate = [&](double seconds, double highest) {
    return rate_hz(seconds) >= lowest_rate_hz && rate_hz(seconds) <= highest;
  };
  const std::string head = formatted("column '{}': ", column.name);
  const std::string advice =
      formatted("; give the unit in the column's name ({}_s, {}_ms, {}_us, ...), or give the rate",
                to_lower_case(column.name), to_lower_case(column.name), to_lower_case(column.name));
  if (column.unit_is_stated) {
    return {
        .seconds = column.seconds,
        .remark =
            is_rate(column.seconds, highest_rate_hz)
                ? ""
                : formatted("{}the unit in the name of the column gives a rate of {} Hz; is this "
                            "unit right?",
                            head, number_text(rate_hz(column.seconds), 3))};
  }
  const auto first =
      std::find_if(times.begin(), times.end(), [](double t) { return std::isfinite(t); });
  std::vector<Unit> possible;
  std::optional<Unit> since_1970;
  for (const Unit& unit : units) {
    if (is_rate(unit.seconds, highest_usual_rate_hz)) {
      possible.push_back(unit);
    }
    // Seconds since 1970 are recognised even if a log has only one reading in several minutes.
    constexpr double slowest_rate_hz = 2e-3;
    const bool may_be = (unit.seconds == 1.0 && rate_hz(1.0) >= slowest_rate_hz) ||
                        is_rate(unit.seconds, highest_usual_rate_hz);
    if (may_be && is_since_1970(*first * unit.seconds) && !since_1970) {
      since_1970 = unit;
    }
  }
  // Xsens's SampleTimeFine is in units of 0.1 ms (MTw) or 1 us (DOT).
  if (to_lower_case(column.name) == "sampletimefine") {
    constexpr double tick_s = 1e-4;
    constexpr double slowest_hz = 1.0;
    constexpr double fastest_hz = 2500.0;
    const bool are_ticks = rate_hz(tick_s) >= slowest_hz && rate_hz(tick_s) <= fastest_hz;
    return {.seconds = are_ticks ? tick_s : 1e-6};
  }
  // The times of spreadsheets are days since 1899-12-30.
  constexpr double day_s = 86400.0;
  constexpr double first_day = 36526.0;  // the year 2000
  constexpr double last_day = 73050.0;   // 2100
  if (*first > first_day && *first < last_day && step < 1e-3 &&
      is_rate(day_s, highest_usual_rate_hz)) {
    return {.seconds = day_s,
            .remark = formatted(
                "{}the times are assumed to be days, as in spreadsheets, which gives {} Hz", head,
                number_text(rate_hz(day_s), 3))};
  }
  const bool seconds_fit = is_rate(1.0, highest_rate_hz);
  const auto taken = [&](const Unit& unit, const std::string& why) -> TimeUnit {
    if (unit.seconds == 1.0) {
      return {};
    }
    return {.seconds = unit.seconds,
            .remark = formatted("{}the times are assumed to be {}, which gives {} Hz: {}{}", head,
                                unit.words, number_text(rate_hz(unit.seconds), 3), why, advice)};
  };
  if (since_1970) {
    return taken(*since_1970, "in this unit they are times since 1970");
  }
  if (seconds_fit) {
    return {};
  }
  if (possible.size() == 1) {
    return taken(possible.front(), rate_text(step, units.front()) + ", which is not usual");
  }
  std::string rates;
  for (const Unit& unit : units) {
    rates += (rates.empty() ? "" : ", ") + rate_text(step, unit);
  }
  throw DataError(path,
                  formatted("{}the unit of the times is not clear from the sample rate: {}{}", head,
                            rates, advice),
                  {settings::column_names, settings::rate});
}

}  // namespace axiscal
