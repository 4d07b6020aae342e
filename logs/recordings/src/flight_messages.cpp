// SPDX-License-Identifier: Apache-2.0
#include "logs/recordings/src/flight_messages.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

#include "axiscal/core/not_a_number.hpp"

namespace axiscal {
namespace {

struct TimeField {
  std::string_view name;
  double seconds;
};

constexpr std::array<TimeField, 4> time_fields = {
    {{"TimeUS", 1e-6}, {"TimeMS", 1e-3}, {"time_usec", 1e-6}, {"time_boot_ms", 1e-3}}};

// @return the name without the digits at its end: "IMU" for "IMU2".
std::string_view without_number(std::string_view name) {
  while (!name.empty() && std::isdigit(static_cast<unsigned char>(name.back())) != 0) {
    name.remove_suffix(1);
  }
  return name;
}

// @return kind and unit of a field, according to ArduPilot's log messages (ardupilot.org, "Onboard
//         Message Log Messages") and MAVLink's common messages (mavlink.io). MAVLink defines
//         RAW_IMU as raw counts, but ArduPilot writes milli-g, so milli-g is assumed.
Series rule_of(const std::string& message, const std::string& field) {
  const auto is = [&](SeriesKind kind, const char* unit) {
    return Series{.kind = kind, .unit = unit, .known_by = KnownBy::format};
  };
  const std::string_view name = without_number(message);
  if (name == "IMU" || name == "ACC" || name == "GYR") {
    if (field == "AccX" || field == "AccY" || field == "AccZ") {
      return is(SeriesKind::accelerometer, "m/s^2");
    }
    if (field == "GyrX" || field == "GyrY" || field == "GyrZ") {
      return is(SeriesKind::gyroscope, "rad/s");
    }
    if (field == "T" && name == "IMU") {
      return is(SeriesKind::temperature, "degC");
    }
  }
  if (name == "MAG" && (field == "MagX" || field == "MagY" || field == "MagZ")) {
    return is(SeriesKind::magnetometer, "mgauss");
  }
  const bool is_scaled = name == "SCALED_IMU" || name == "RAW_IMU";
  if (is_scaled || name == "HIGHRES_IMU") {
    if (field == "xacc" || field == "yacc" || field == "zacc") {
      return is(SeriesKind::accelerometer, is_scaled ? "mg" : "m/s^2");
    }
    if (field == "xgyro" || field == "ygyro" || field == "zgyro") {
      return is(SeriesKind::gyroscope, is_scaled ? "mrad/s" : "rad/s");
    }
    if (field == "xmag" || field == "ymag" || field == "zmag") {
      return is(SeriesKind::magnetometer, is_scaled ? "mgauss" : "gauss");
    }
    if (field == "temperature") {
      return is(SeriesKind::temperature, is_scaled ? "cdegC" : "degC");
    }
  }
  return {};
}

}  // namespace

FlightMessage::FlightMessage(std::string name, std::vector<std::string> fields)
    : name_(std::move(name)), fields_(std::move(fields)) {
  for (const TimeField& field : time_fields) {
    const auto found = std::find(fields_.begin(), fields_.end(), field.name);
    if (found != fields_.end() && !time_) {
      time_ = static_cast<std::size_t>(found - fields_.begin());
      seconds_ = field.seconds;
    }
  }
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    if (fields_[f] == "I" && f == 1) {  // only the second field; elsewhere I is an integral term
      instance_ = f;
    } else if (f != time_) {
      others_.push_back(f);
    }
  }
}

void FlightMessage::put(SeriesSink& sink,
                        std::span<const double> values,
                        std::size_t& count,
                        std::optional<double> time_s) {
  constexpr double most_instances = 64;
  const double number = instance_ ? values[*instance_] : 0.0;
  const int instance = number >= 0.0 && number < most_instances ? static_cast<int>(number) : 0;
  const auto [at, is_new] = series_.try_emplace(instance);
  if (is_new) {
    std::vector<std::string> columns;
    for (const std::size_t f : others_) {
      columns.push_back(fields_[f]);
    }
    at->second = MessageSeries(name_, instance, columns,
                               [&](const std::string& field) { return rule_of(name_, field); });
    at->second.announce(sink, count);
  }
  values_.clear();
  for (const std::size_t f : others_) {
    values_.push_back(values[f]);
  }
  at->second.put(sink, time_ ? values[*time_] * seconds_ : time_s.value_or(not_a_number), values_);
}

}  // namespace axiscal
