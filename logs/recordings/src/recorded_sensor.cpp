// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/recorded_sensor.hpp"

#include <algorithm>
#include <cmath>

#include "axiscal/core/number_text.hpp"
#include "axiscal/logs/sensor_names.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// @return true if the readings of a series were already corrected with PX4's parameters. They are
//         corrected in the topic sensor_combined and in topics whose names begin with "vehicle_".
bool is_corrected(const RecordingSummary& summary, const Series& series) {
  return summary.format == "ulog" &&
         (series.name == "sensor_combined" || series.name.starts_with("vehicle_"));
}

// @return the device id of a sensor according to the log of PX4 or ArduPilot; empty if not known.
std::string device_of(const RecordingSummary& summary, const RecordedSensor& sensor) {
  const Series& series = summary.series[sensor.series].series;
  const auto fact = [&](const std::string& name) {
    const auto found = summary.facts.find(name);
    return found == summary.facts.end() ? std::string() : found->second;
  };
  if (summary.format == "ulog") {
    const std::string own = fact(formatted("device_id {} {}", series.name, series.instance));
    const char* const kind = sensor.kind == SeriesKind::accelerometer ? "ACC"
                             : sensor.kind == SeriesKind::gyroscope   ? "GYRO"
                                                                      : "MAG";
    return own.empty() ? fact(formatted("CAL_{}{}_ID", kind, sensor.number)) : own;
  }
  if (summary.format.starts_with("dataflash")) {
    const std::string number = sensor.number == 0 ? "" : formatted("{}", sensor.number + 1);
    return sensor.kind == SeriesKind::magnetometer
               ? fact("COMPASS_DEV_ID" + number)
               : fact(formatted("INS_{}{}_ID",
                                sensor.kind == SeriesKind::accelerometer ? "ACC" : "GYR", number));
  }
  return "";
}

std::string full_name(const RecordingSummary& summary, const Series& series) {
  const auto same =
      std::count_if(summary.series.begin(), summary.series.end(), [&](const SeriesSummary& other) {
        return other.series.name == series.name && other.series.instance != series.instance;
      });
  return same > 0 ? formatted("{}[{}]", series.name, series.instance) : series.name;
}

std::string_view words_of(KnownBy by) {
  switch (by) {
    case KnownBy::format:
      return "recognised by the file's format";
    case KnownBy::names:
      return "recognised by the columns' names";
    case KnownBy::units:
      return "recognised by the columns' units";
    case KnownBy::data:
      return "guessed from the numbers";
    case KnownBy::nothing:
      break;
  }
  return "not recognised";
}

}  // namespace

bool is_constant(const SeriesSummary& one) {
  return !one.sd.empty() && one.samples > 2 &&
         std::all_of(one.sd.begin(), one.sd.end(), [](double sd) { return !(sd > 0.0); });
}

std::vector<std::string> constant_sensor_notes(const RecordingSummary& summary) {
  std::vector<std::string> words;
  for (const SeriesSummary& one : summary.series) {
    const SeriesKind kind = one.series.kind;
    if (kind != SeriesKind::other && kind != SeriesKind::temperature && is_constant(one)) {
      const std::string name = full_name(summary, one.series);
      words.push_back(formatted("the {}{}{} has constant readings and is left out", name_of(kind),
                                name.empty() ? "" : " " + name,
                                " (" + joined(one.series.columns) + ")"));
    }
  }
  return words;
}

std::vector<RecordedSensor> sensors_of(const RecordingSummary& summary) {
  std::vector<RecordedSensor> sensors;
  for (const SeriesKind kind :
       {SeriesKind::accelerometer, SeriesKind::gyroscope, SeriesKind::magnetometer}) {
    std::vector<RecordedSensor> found;
    double fastest = 0.0;
    std::size_t most = 0;
    for (std::size_t s = 0; s < summary.series.size(); ++s) {
      const SeriesSummary& one = summary.series[s];
      if (one.series.kind != kind || one.series.columns.size() != 3 || one.samples < 2) {
        continue;
      }
      RecordedSensor sensor{.kind = kind,
                            .series = s,
                            .name = full_name(summary, one.series),
                            .unit = one.series.unit,
                            .known_by = one.series.known_by,
                            .rate_hz = one.rate_hz,
                            .samples = one.samples,
                            .is_corrected = is_corrected(summary, one.series)};
      // If the names of the columns do not state all three axes, the columns are x, y, z in this
      // order.
      sensor.places = {0, 1, 2};
      std::array<std::optional<std::size_t>, 3> axes{};
      for (std::size_t c = 0; c < 3; ++c) {
        if (const auto axis = axis_of_name(named_column(one.series.columns[c]).name)) {
          axes[*axis] = c;
        }
      }
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (axes[0] && axes[1] && axes[2]) {
          sensor.places[axis] = *axes[axis];
        }
        sensor.columns[axis] = one.series.columns[sensor.places[axis]];
      }
      fastest = std::isfinite(one.rate_hz) ? std::max(fastest, one.rate_hz) : fastest;
      most = std::max(most, one.samples);
      found.push_back(std::move(sensor));
    }
    // Slow copies of a fast sensor are left out.
    constexpr double slow = 0.2;
    std::erase_if(found, [&](const RecordedSensor& sensor) {
      return std::isfinite(sensor.rate_hz) && fastest > 0.0
                 ? sensor.rate_hz < slow * fastest
                 : static_cast<double>(sensor.samples) < slow * static_cast<double>(most);
    });
    // A sensor that is recognised only by its values is left out if another sensor of the same kind
    // is recognised by the format, a name or a unit.
    const bool has_named =
        std::any_of(found.begin(), found.end(),
                    [](const RecordedSensor& sensor) { return sensor.known_by != KnownBy::data; });
    std::erase_if(found, [&](const RecordedSensor& sensor) {
      return has_named && sensor.known_by == KnownBy::data;
    });
    const bool has_raw = std::any_of(found.begin(), found.end(), [](const RecordedSensor& sensor) {
      return !sensor.is_corrected;
    });
    std::erase_if(found,
                  [&](const RecordedSensor& sensor) { return has_raw && sensor.is_corrected; });
    for (std::size_t i = 0; i < found.size(); ++i) {
      found[i].number = static_cast<int>(i);
      found[i].device = device_of(summary, found[i]);
      // Constant sensors are left out only after numbering, so that the others keep their numbers.
      if (!is_constant(summary.series[found[i].series])) {
        sensors.push_back(std::move(found[i]));
      }
    }
  }
  return sensors;
}

std::string words_of(const RecordedSensor& sensor) {
  std::string text = formatted("{} {}: {}({})", name_of(sensor.kind), sensor.number,
                               sensor.name.empty() ? "" : sensor.name + " ",
                               joined({sensor.columns.begin(), sensor.columns.end()}));
  text += sensor.unit.empty() ? ", unit unknown" : ", " + sensor.unit;
  if (std::isfinite(sensor.rate_hz) && sensor.rate_hz > 0.0) {
    text += formatted(", {} Hz", number_text(sensor.rate_hz, 4));
  }
  text += formatted("; {}", words_of(sensor.known_by));
  return sensor.is_corrected ? text + "; already corrected by PX4 with parameters in the log"
                             : text;
}

}  // namespace axiscal
