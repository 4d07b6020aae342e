// SPDX-License-Identifier: Apache-2.0
#include "table_options.hpp"

#include <algorithm>

#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/field/field_unit.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "log_input.hpp"
#include "summary.hpp"
#include "usage_error.hpp"

namespace axiscal::cli {
namespace {

// Which sensor of a recording a kind of instrument is.
std::string_view sensor_name(const std::string& kind) {
  for (const InstrumentKind& known : instrument_kinds()) {
    if (known.name == kind) {
      switch (known.sensor) {
        case VehicleSensor::accelerometer:
          return name_of(SeriesKind::accelerometer);
        case VehicleSensor::gyroscope:
          return name_of(SeriesKind::gyroscope);
        case VehicleSensor::magnetometer:
          return name_of(SeriesKind::magnetometer);
        case VehicleSensor::none:
          break;
      }
    }
  }
  return kind == "inclinometer" ? name_of(SeriesKind::accelerometer) : "";
}

bool has_column(const TableText& table, const std::string& name) {
  return std::any_of(table.columns().begin(), table.columns().end(),
                     [&](const NamedColumn& column) {
                       return in_small_letters(column.name) == in_small_letters(name) ||
                              column.name.ends_with("." + name);
                     });
}

// The columns that are taken for axes which the table does not have.
std::optional<LogSensor> stand_in(const TableText& table, const WantedColumns& wanted) {
  const bool has_one =
      std::any_of(wanted.axes.begin(), wanted.axes.end(),
                  [&](const std::string& axis) { return has_column(table, axis); });
  if (wanted.kind.empty() || wanted.axes.size() != 3 || has_one || table.columns().empty()) {
    return std::nullopt;
  }
  if (std::optional<LogSensor> sensor = sensor_of_kind(table, wanted.kind)) {
    return sensor;
  }
  LogSensor plain;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string letter(1, "xyz"[axis]);
    const auto found = std::find_if(
        table.columns().begin(), table.columns().end(), [&](const NamedColumn& column) {
          return column.name == letter || column.name == std::string(1, "XYZ"[axis]);
        });
    if (found == table.columns().end()) {
      return std::nullopt;
    }
    plain.columns[axis] = found->name;
  }
  return plain;
}

// Columns of the axes whose header states another unit than is wanted.
void convert_units(const std::string& path,
                   const WantedColumns& wanted,
                   const TableText& table,
                   std::vector<MappedColumn>& renamed) {
  if (wanted.unit.empty() || wanted.unit == "1") {
    return;
  }
  for (const std::string& axis : wanted.axes) {
    const auto already = std::find_if(renamed.begin(), renamed.end(),
                                      [&](const MappedColumn& one) { return one.name == axis; });
    const std::string called = already != renamed.end() ? already->column : axis;
    const auto column =
        std::find_if(table.columns().begin(), table.columns().end(), [&](const NamedColumn& one) {
          return in_small_letters(one.name) == in_small_letters(called);
        });
    if (column == table.columns().end() || column->unit.empty()) {
      continue;
    }
    SeriesKind kind = SeriesKind::other;
    for (const SeriesKind one : {SeriesKind::accelerometer, SeriesKind::gyroscope,
                                 SeriesKind::magnetometer, SeriesKind::temperature}) {
      kind = name_of(one) == sensor_name(wanted.kind) ? one : kind;
    }
    const std::optional<KnownUnit> known = known_unit(column->unit, kind);
    const std::string unit = known ? std::string(known->name) : column->unit;
    const std::optional<double> factor = reading_factor_between(unit, wanted.unit);
    if (!factor && is_reading_unit(unit) && is_reading_unit(wanted.unit)) {
      throw DataError(path, formatted("column '{}' is in {} by its header, and readings in {} are "
                                      "wanted",
                                      called, unit, wanted.unit));
    }
    if (factor && *factor != 1.0) {
      if (already != renamed.end()) {
        already->factor = *factor;
      } else {
        renamed.push_back({.name = axis, .column = column->name, .factor = *factor});
      }
      print_remark("note", formatted("{}: column '{}' is converted from {} to {}", path, called,
                                     unit, wanted.unit));
    }
  }
}

// One column for all axes, one for each in their order, or by the names of axes or slots.
void rename_temperatures(const std::string& text,
                         const std::vector<std::string>& axes,
                         std::vector<MappedColumn>& renamed) {
  const std::vector<std::string> items = names_of(text);
  const bool named = text.find('=') != std::string::npos;
  if (named && std::any_of(items.begin(), items.end(), [](const std::string& item) {
        return item.find('=') == std::string::npos;
      })) {
    throw UsageError(formatted(
        "--temperature-column: '{}': either each is AXIS=COLUMN or SLOT=COLUMN, or none", text));
  }
  if (items.size() > 1 && !named && items.size() != axes.size()) {
    throw UsageError(
        formatted("--temperature-column: '{}' has {} columns for {} axes; give one "
                  "for all, or one for each",
                  text, items.size(), axes.size()));
  }
  for (std::size_t i = 0; i < items.size(); ++i) {
    const std::size_t equals = items[i].find('=');
    std::string name = "temperature";
    if (equals != std::string::npos) {
      const std::string of = items[i].substr(0, equals);
      const bool is_axis = std::find(axes.begin(), axes.end(), of) != axes.end();
      const bool is_slot = std::any_of(axes.begin(), axes.end(), [&](const std::string& axis) {
        return axis.starts_with(of + ".");
      });
      if (!is_axis && !is_slot) {
        throw UsageError(formatted("--temperature-column: '{}' is no axis and no slot", of));
      }
      name = is_axis ? of + "_temperature" : of + ".temperature";
    } else if (items.size() > 1) {
      name = axes[i] + "_temperature";
    }
    const std::string column = equals == std::string::npos ? items[i] : items[i].substr(equals + 1);
    if (column != name) {
      renamed.push_back({.name = name, .column = column});
    }
  }
}

}  // namespace

void add_table_options(OptionSet& options, TableOptions& table) {
  OptionSet group = options.group("Table");
  group.add("--names", table.names, "A,B,..", "names of the columns of a file without a header");
  group.add("--map", table.map, "FILE",
            "axiscal-log (JSON): columns renamed, scaled, turned round");
  group.add("--time", table.time, "COLUMN",
            "of times; time, t, timestamp with _s, _ms, _us, _ns or (s), (ms), ..");
  group.add("--temperature-column", table.temperature_column, "COLUMN",
            "of temperatures; temperature; A,B,C: of each axis's own sensor, in their order, or "
            "AXIS=A,.. and SLOT=A,..; else AXIS_temperature and SLOT.temperature");
}

LogFormat format_of(const TableOptions& options) {
  LogFormat format;
  if (options.map) {
    format = read_log_format(*options.map);
  }
  if (options.names) {
    format.names = names_of(*options.names);
  }
  return format;
}

std::optional<LogSensor> sensor_of_kind(const TableText& table, const std::string& kind) {
  const std::string_view wanted = sensor_name(kind);
  std::optional<LogSensor> found;
  for (const LogSensor& sensor : table.sensors()) {
    if (wanted.empty() || name_of(sensor.kind) == wanted) {
      if (found) {
        return std::nullopt;  // several: which one is for the user to say
      }
      found = sensor;
    }
  }
  return found;
}

OpenTable open_table(const std::string& path,
                     const TableOptions& options,
                     const WantedColumns& wanted,
                     CsvReader::Quotes quotes,
                     const std::function<std::size_t(char* buffer, std::size_t size)>& read) {
  const LogFormat format = format_of(options);
  OpenTable table;
  table.text = read ? std::make_unique<TableText>(path, read, format)
                    : std::make_unique<TableText>(path, format);
  std::vector<std::string> known = {"run",      "rest",    "fence",       "block",   "mount",
                                    "level",    "serial",  "temperature", "time",    "samples",
                                    "fx",       "fy",      "fz",          "confirm", "pitch_deg",
                                    "roll_deg", "yaw_deg", "heading_deg"};
  for (const std::string& axis : wanted.axes) {
    known.push_back(axis);
    known.push_back(axis + "_sd");
    known.push_back(axis + "_temperature");
    known.push_back("temperature_" + axis);
  }
  std::vector<MappedColumn> renamed;
  const auto rename = [&](const std::optional<std::string>& column, const char* name) {
    if (column && *column != name) {
      renamed.push_back({.name = name, .column = *column});
    }
  };
  rename(options.time, "time");
  if (options.temperature_column) {
    rename_temperatures(*options.temperature_column, wanted.axes, renamed);
  }
  if (const std::optional<LogSensor> sensor = stand_in(*table.text, wanted)) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      renamed.push_back({.name = wanted.axes[axis], .column = sensor->columns[axis]});
    }
    print_remark("note", formatted("{}: the axes {} are taken from the columns {}", path,
                                   joined(wanted.axes),
                                   joined({sensor->columns.begin(), sensor->columns.end()})));
  }
  convert_units(path, wanted, *table.text, renamed);
  table.csv = std::make_unique<CsvReader>(table.text->reader(known, renamed, quotes));
  for (const std::string& note : table.text->notes()) {
    print_remark("note", path + ": " + note);
  }
  return table;
}

}  // namespace axiscal::cli
