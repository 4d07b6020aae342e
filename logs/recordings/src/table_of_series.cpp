// SPDX-License-Identifier: Apache-2.0
#include "logs/recordings/src/table_of_series.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "axiscal/core/error.hpp"
#include "axiscal/core/missing_column.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"
#include "logs/recordings/src/series_log.hpp"

namespace axiscal {
namespace {

// @return the first letter of the column names for a kind of sensor: ax, gx or mx.
char letter_of(SeriesKind kind) {
  return kind == SeriesKind::accelerometer ? 'a' : kind == SeriesKind::gyroscope ? 'g' : 'm';
}

// Finds a column by its name in the recording: "AccX", "IMU2.AccX" or "IMU[1].AccX".
std::optional<MergedColumn> column_called(const RecordingSummary& summary,
                                          const std::string& name) {
  for (std::size_t s = 0; s < summary.series.size(); ++s) {
    const Series& series = summary.series[s].series;
    for (std::size_t c = 0; c < series.columns.size(); ++c) {
      const std::string& own = series.columns[c];
      if (own == name || series.name + "." + own == name ||
          formatted("{}[{}].{}", series.name, series.instance, own) == name) {
        return MergedColumn{.name = name, .series = s, .place = c};
      }
    }
  }
  return std::nullopt;
}

}  // namespace

std::string series_list(const RecordingSummary& summary) {
  constexpr std::size_t most = 500;  // most names that a message lists
  std::vector<std::string> names;
  for (const SeriesSummary& one : summary.series) {
    const std::string text = formatted("{}{}", one.series.name,
                                       one.series.kind == SeriesKind::other
                                           ? std::string()
                                           : formatted(" ({})", name_of(one.series.kind)));
    if (std::find(names.begin(), names.end(), text) == names.end()) {
      names.push_back(text);
    }
  }
  if (names.size() > most) {
    const std::size_t more = names.size() - most;
    names.resize(most);
    names.push_back(formatted("and {} more", more));
  }
  return names.empty() ? "it contains no series of numbers" : "it contains " + joined(names);
}

OpenedTable table_of_series(const std::string& path,
                            const RecordingSummary& summary,
                            DecoderPointer decoder,
                            const LogFormat& format) {
  const std::vector<RecordedSensor> all = sensors_of(summary);
  OpenedTable table;
  std::vector<MergedColumn> columns;
  std::set<std::string> names;
  std::vector<std::string> notes;
  std::optional<std::size_t> base;
  double fastest = -1.0;
  const auto take = [&](MergedColumn column) {
    if (names.insert(column.name).second) {
      columns.push_back(std::move(column));
    }
  };
  // If a kind has no sensor with the requested number, the sensor with the next lower number is
  // used.
  int most = 0;
  for (const RecordedSensor& sensor : all) {
    most = std::max(most, sensor.number + 1);
  }
  if (format.instance >= most && !all.empty()) {
    throw DataError(
        path, formatted("instance {} does not exist: the file has at most {} sensors of each kind",
                        format.instance, most));
  }
  for (const SeriesKind kind :
       {SeriesKind::accelerometer, SeriesKind::gyroscope, SeriesKind::magnetometer}) {
    const RecordedSensor* chosen = nullptr;
    if (!format.kinds.empty() &&
        std::find(format.kinds.begin(), format.kinds.end(), kind) == format.kinds.end()) {
      continue;
    }
    for (const RecordedSensor& sensor : all) {
      if (sensor.kind == kind && sensor.number <= format.instance) {
        chosen = &sensor;
      }
    }
    if (chosen == nullptr) {
      continue;
    }
    LogSensor sensor{.kind = kind,
                     .unit = chosen->unit,
                     .number = chosen->number,
                     .of = static_cast<int>(std::count_if(
                         all.begin(), all.end(),
                         [&](const RecordedSensor& other) { return other.kind == kind; })),
                     .device = chosen->device,
                     .words = words_of(*chosen)};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      sensor.columns[axis] = formatted("{}{}", letter_of(kind), "xyz"[axis]);
      for (const std::string& wanted : format.wanted) {  // the requested name replaces ax, ay, ...
        const std::optional<MergedColumn> own = column_called(summary, wanted);
        if (own && own->series == chosen->series && own->place == chosen->places[axis]) {
          sensor.columns[axis] = wanted;
        }
      }
      take({.name = sensor.columns[axis], .series = chosen->series, .place = chosen->places[axis]});
    }
    notes.push_back(words_of(*chosen));
    const double rate = std::isfinite(chosen->rate_hz) ? chosen->rate_hz : 0.0;
    const bool serves = kind != SeriesKind::magnetometer || !base;
    if (serves && rate > 1.01 * fastest) {
      fastest = rate;
      base = chosen->series;
    }
    if (kind == SeriesKind::accelerometer) {
      const Series& own = summary.series[chosen->series].series;
      for (std::size_t s = 0; s < summary.series.size(); ++s) {
        const Series& other = summary.series[s].series;
        if (other.kind == SeriesKind::temperature && other.name == own.name &&
            other.instance == own.instance && other.columns.size() == 1) {
          take({.name = "temperature", .series = s, .place = 0});
        }
      }
    }
    table.sensors.push_back(std::move(sensor));
  }
  for (const std::string& wanted : format.wanted) {
    if (!names.contains(wanted)) {
      if (const std::optional<MergedColumn> column = column_called(summary, wanted)) {
        take(*column);
        base = base.value_or(column->series);
      }
    }
  }
  if (!base) {
    throw DataError(path,
                    formatted("this {} contains no accelerometer, gyroscope or magnetometer: {}",
                              summary.format, series_list(summary)));
  }
  auto source = std::make_unique<SeriesLog>(std::move(decoder), *base, std::move(columns));
  source->notes = summary.notes;
  source->notes.insert(source->notes.end(), notes.begin(), notes.end());
  const std::vector<std::string> dead = constant_sensor_notes(summary);
  source->notes.insert(source->notes.end(), dead.begin(), dead.end());
  table.source = std::move(source);
  return table;
}

}  // namespace axiscal
