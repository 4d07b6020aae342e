// SPDX-License-Identifier: Apache-2.0
#include "table_options.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <set>

#include "axiscal/calib/face_names.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/field/field_unit.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "axiscal/logs/recording_file.hpp"
#include "core/formatted.hpp"
#include "log_input.hpp"
#include "summary.hpp"
#include "usage_error.hpp"

namespace axiscal::cli {
namespace {

// Returns the name by which recordings denote the sensor of an instrument kind; empty if recordings
// have no such sensor.
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
                       return to_lower_case(column.name) == to_lower_case(name) ||
                              column.name.ends_with("." + name);
                     });
}

// Returns the columns to use if the table lacks the axes. They are the columns of the table's
// sensor of the wanted kind, or x, y, z. The result is nullopt if the table lacks these columns
// too.
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

// Adds a unit conversion for each axis whose column header states another unit than wanted.unit.
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
    const auto column = std::find_if(
        table.columns().begin(), table.columns().end(),
        [&](const NamedColumn& one) { return to_lower_case(one.name) == to_lower_case(called); });
    if (column == table.columns().end() || column->unit.empty()) {
      continue;
    }
    const std::vector<SeriesKind> kinds = kinds_of(wanted.kind);
    const SeriesKind kind = kinds.empty() ? SeriesKind::other : kinds.front();
    const std::optional<KnownUnit> known = known_unit(column->unit, kind);
    const std::string unit = known ? std::string(known->name) : column->unit;
    const std::optional<double> factor = reading_factor_between(unit, wanted.unit);
    if (!factor && is_reading_unit(unit) && is_reading_unit(wanted.unit)) {
      throw DataError(
          path,
          formatted("column '{}' is in {} according to its header, but readings in {} are required",
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

// Applies the option --temperature-column. It states one column for all axes, or one column for
// each axis in the order of the axes, or NAME=COLUMN for each axis or slot.
void rename_temperatures(const std::string& text,
                         const std::vector<std::string>& axes,
                         std::vector<MappedColumn>& renamed) {
  const std::vector<std::string> items = names_of(text);
  const bool named = text.find('=') != std::string::npos;
  if (named && std::any_of(items.begin(), items.end(), [](const std::string& item) {
        return item.find('=') == std::string::npos;
      })) {
    throw UsageError(formatted(
        "--temperature-column: '{}': either all parts or none must have the form AXIS=COLUMN or "
        "SLOT=COLUMN",
        text));
  }
  if (items.size() > 1 && !named && items.size() != axes.size()) {
    throw UsageError(
        formatted("--temperature-column: '{}' has {} columns for {} axes; give one column for all "
                  "axes, or one for each axis",
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
        throw UsageError(formatted("--temperature-column: '{}' is neither an axis nor a slot", of));
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

// Returns three columns whose names combine one of the words with x, y and z, for example true_x,
// true_y, true_z. The result is empty if there are no such columns.
std::vector<std::string> three_of(const TableText& table,
                                  std::initializer_list<std::string_view> words) {
  for (const std::string_view word : words) {
    for (const char* const parting : {"_", ".", " ", ""}) {
      std::vector<std::string> three;
      for (const char axis : {'x', 'y', 'z'}) {
        const std::string name = std::string(word) + parting + axis;
        const std::string turned = std::string(1, axis) + parting + std::string(word);
        for (const NamedColumn& column : table.columns()) {
          const std::string small = to_lower_case(column.name);
          if (small == name || small == turned) {
            three.push_back(column.name);
          }
        }
      }
      if (three.size() == 3) {
        return three;
      }
    }
  }
  return {};
}

// Maps the columns of the true field to fx, fy, fz, and the columns of the measured field to the
// axes.
void name_truth_and_measured(const std::string& path,
                             const WantedColumns& wanted,
                             const TableText& table,
                             std::vector<MappedColumn>& renamed) {
  if (wanted.faces_of.empty() || wanted.axes.size() != 3 || has_column(table, "fx") ||
      has_column(table, "rest")) {
    return;
  }
  const std::vector<std::string> truth = three_of(
      table, {"true", "truth", "ref", "reference", "expected", "nominal", "applied", "target"});
  const bool has_axes = has_column(table, wanted.axes.front());
  const std::vector<std::string> measured =
      has_axes
          ? wanted.axes
          : three_of(table, {"meas", "measured", "raw", "reading", "sensor", "output", "read"});
  if (truth.empty() || measured.empty()) {
    // Prints a warning if the table has unused columns that may contain the field in the sensor's
    // frame.
    const std::vector<std::string> fields =
        three_of(table, {"b", "h", "coil", "i", "current", "field"});
    if (has_axes && !fields.empty() &&
        std::find(wanted.axes.begin(), wanted.axes.end(), fields.front()) == wanted.axes.end()) {
      print_remark("warning",
                   formatted("{}: the columns {} are not used; if they are the field in the "
                             "sensor's frame at each reading, rename them to fx, fy, fz",
                             path, joined(fields)));
    }
    return;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    renamed.push_back({.name = std::string("f") + "xyz"[axis], .column = truth[axis]});
    if (!has_axes) {
      renamed.push_back({.name = wanted.axes[axis], .column = measured[axis]});
    }
  }
  print_remark("note", formatted("{}: the columns {} are taken as the true field in the sensor's "
                                 "frame (fx, fy, fz), and {} as the readings of the axes",
                                 path, joined(truth), joined(measured)));
}

// A column that names faces in words (such as "X up") and is read as the column `rest` or `fence`.
struct FaceColumn {
  MappedColumn column;
  std::string words;
};

// The position of the named faces according to the heading of a column: down, up or at the fence.
enum class FaceHeading { down, up, at_fence, other };

FaceHeading heading_of(const std::string& name) {
  const std::string small = to_lower_case(name);
  const auto has_one_of = [&](std::initializer_list<std::string_view> words) {
    return std::any_of(words.begin(), words.end(), [&](std::string_view word) {
      return small.find(word) != std::string::npos;
    });
  };
  return has_one_of({"bottom", "down", "base", "table", "abajo", "unten"}) ? FaceHeading::down
         : has_one_of({"side", "wall", "against", "fence", "lado"})        ? FaceHeading::at_fence
         : small == "up" || has_one_of({"top", "upper", "face up", "face_up", "upward"})
             ? FaceHeading::up
             : FaceHeading::other;
}

// Determines from the readings whether the named faces were up. If they were up, the readings of an
// axis are higher for its positive face than for its negative face.
// @return true if the faces were up; false if they were down; nullopt if the readings do not show
//         whether they were up or down.
std::optional<bool> named_faces_are_up(const TableText& table,
                                       const std::vector<std::string>& axes,
                                       const std::vector<MappedColumn>& renamed,
                                       const std::vector<std::optional<FaceInWords>>& faces) {
  int votes = 0;
  for (std::size_t axis = 0; axis < axes.size() && axis < 3; ++axis) {
    const auto already = std::find_if(renamed.begin(), renamed.end(), [&](const MappedColumn& one) {
      return one.name == axes[axis];
    });
    const std::string called = already != renamed.end() ? already->column : axes[axis];
    const auto column = std::find_if(
        table.columns().begin(), table.columns().end(),
        [&](const NamedColumn& one) { return to_lower_case(one.name) == to_lower_case(called); });
    if (column == table.columns().end()) {
      continue;
    }
    const std::vector<double>& values =
        table.first_rows()[static_cast<std::size_t>(column - table.columns().begin())];
    double plus = 0.0;
    double minus = 0.0;
    int of_plus = 0;
    int of_minus = 0;
    for (std::size_t row = 0; row < faces.size() && row < values.size(); ++row) {
      if (!faces[row] || axis_of(faces[row]->face) != static_cast<int>(axis) ||
          !std::isfinite(values[row])) {
        continue;
      }
      (is_positive(faces[row]->face) ? plus : minus) += values[row];
      ++(is_positive(faces[row]->face) ? of_plus : of_minus);
    }
    if (of_plus > 0 && of_minus > 0) {
      votes += plus / of_plus > minus / of_minus ? 1 : -1;
    } else if (of_plus + of_minus > 0) {
      // The first rows name only one face of this axis, so the sign of the reading decides. This
      // assumes a bias of less than 1 g.
      votes += of_plus > 0 ? (plus > 0.0 ? 1 : -1) : (minus < 0.0 ? 1 : -1);
    }
  }
  return votes == 0 ? std::nullopt : std::optional(votes > 0);
}

// A column whose first rows name faces in words, such as "X up".
struct WordsOfFaces {
  std::string name;
  std::vector<std::optional<FaceInWords>> faces;  // faces in the first rows
  std::string first;                              // text of the column's first cell
  FaceHeading heading = FaceHeading::other;
};

// Finds the columns that contain words for faces in the first rows.
// @throws DataError  if most words of a column are faces, but some are not.
std::vector<WordsOfFaces> columns_of_faces(const std::string& path, const TableText& table) {
  const bool has_size = has_column(table, "rate") || has_column(table, "rate_dps") ||
                        has_column(table, "lux") || has_column(table, "irradiance");
  std::vector<WordsOfFaces> found;
  for (std::size_t c = 0; c < table.columns().size(); ++c) {
    WordsOfFaces column{.name = table.columns()[c].name, .heading = {}};
    std::set<std::string> words;
    std::string stranger;
    std::size_t good = 0;
    for (const std::vector<std::string>& row : table.first_cells()) {
      column.faces.push_back(face_in_words(row[c]));
      column.first = column.first.empty() ? row[c] : column.first;
      if (words.insert(row[c]).second) {
        good += column.faces.back() ? 1U : 0U;
        stranger = column.faces.back() ? stranger : row[c];
      }
    }
    constexpr std::size_t most_words = 24;
    const bool is_axis_of_size = has_size && to_lower_case(column.name) == "axis";
    if (good == 0 || words.size() > most_words || 2 * good < words.size() || is_axis_of_size) {
      continue;
    }
    if (good < words.size()) {
      throw DataError(path,
                      formatted("column '{}': '{}' is not a face, but the other words in the "
                                "column are; call the columns 'rest' and 'fence' and write +X, -Y, "
                                ".., or give the meaning of the words with --face-names "
                                "'WORD=FACE,..'",
                                column.name, stranger));
    }
    column.heading = heading_of(column.name);
    found.push_back(std::move(column));
  }
  // If this is the only column that names faces, the heading "side" means the face that is up or
  // down. Otherwise it means the face that touches the fence.
  const bool has_rest = std::any_of(found.begin(), found.end(), [](const WordsOfFaces& one) {
    return one.heading != FaceHeading::at_fence;
  });
  for (WordsOfFaces& column : found) {
    if (!has_rest) {
      column.heading = to_lower_case(column.name).find("up") != std::string::npos
                           ? FaceHeading::up
                           : FaceHeading::other;
    }
  }
  return found;
}

// Returns the columns whose words name faces, to be read as `rest` and `fence`. The list is empty
// if the table already has columns with labels of poses.
std::vector<FaceColumn> face_columns(const std::string& path,
                                     const WantedColumns& wanted,
                                     const TableText& table,
                                     const std::vector<MappedColumn>& renamed) {
  const auto is_label = [](std::string name) {
    name = to_lower_case(name);
    return name == "rest" || name == "fence" || name == "fx" || name == "pitch_deg" ||
           name == "roll_deg" || name.starts_with("rest ") || name.starts_with("rest_") ||
           name.ends_with(".rest");
  };
  if (wanted.faces_of.empty() || table.first_cells().empty() ||
      std::any_of(table.columns().begin(), table.columns().end(),
                  [&](const NamedColumn& one) { return is_label(one.name); })) {
    return {};
  }
  const bool feels_gravity =
      wanted.faces_of == "accelerometer" || wanted.faces_of == "inclinometer";
  std::vector<FaceColumn> found;
  std::set<std::string> taken;
  for (const WordsOfFaces& words : columns_of_faces(path, table)) {
    const bool is_fence = words.heading == FaceHeading::at_fence;
    const std::string name = is_fence ? "fence" : "rest";
    if (!taken.insert(name).second) {
      continue;
    }
    const std::optional<bool> by_readings =
        feels_gravity ? named_faces_are_up(table, wanted.axes, renamed, words.faces) : std::nullopt;
    // Whether a face was up or down is taken from the cell. If the cell does not state it, the
    // heading is used; if the heading does not state it either, the readings are used.
    const auto of_cell = [is_fence, heading = words.heading, by_readings](const std::string& cell) {
      const std::optional<FaceInWords> face = face_in_words(cell);
      if (!face) {
        return cell;
      }
      const bool otherwise = heading == FaceHeading::up ||
                             (heading != FaceHeading::down && by_readings.value_or(false));
      const bool is_up = !is_fence && face->is_up.value_or(otherwise);
      return std::string(face_name(is_up ? opposite(face->face) : face->face));
    };
    found.push_back({.column = MappedColumn{.name = name, .column = words.name, .of_cell = of_cell},
                     .words = formatted(
                         "{}: column '{}' contains faces and is read as the column '{}' (the face "
                         "{}): '{}' means {}",
                         path, words.name, name, is_fence ? "at the fence" : "on the table",
                         words.first, of_cell(words.first))});
  }
  return found;
}

}  // namespace

void add_table_options(OptionSet& options, TableOptions& table) {
  OptionSet group = options.group("Table");
  group.add("--names", table.names, "A,B,..", "names of the columns of a file without a header");
  group.add("--map", table.map, "FILE",
            "axiscal-log file (JSON) that renames and scales columns; factor -1 reverses an axis");
  group.add(
      "--time", table.time, "COLUMN",
      "column of times [default: time, t or timestamp, with _s, _ms, _us, _ns, (s), (ms), ..]");
  group.add("--temperature-column", table.temperature_column, "COLUMN",
            "column of temperatures; A,B,C or AXIS=A,.. if each axis has its own sensor, SLOT=A,.. "
            "for slots [default: temperature, AXIS_temperature, SLOT.temperature]");
  add_definitions_option(group, table.definitions);
  add_limit_option(group, table.limits);
}

void add_limit_option(OptionSet& options, std::optional<std::string>& limits) {
  options.add("--limit", limits, "NAME=VALUE,..",
              "raise a limit for reading a file that you trust; NAME is nesting, members, "
              "unpacked, cells, steps, memory or disk");
}

ReadLimits limits_of(const std::optional<std::string>& limits) {
  ReadLimits all;
  for (const std::string& item : limits ? names_of(*limits) : std::vector<std::string>{}) {
    const std::size_t equals = item.find('=');
    const std::string name = item.substr(0, equals);
    const auto known = std::find(read_limit_names().begin(), read_limit_names().end(), name);
    const std::optional<double> value =
        equals == std::string::npos ? std::nullopt : parse_number(item.substr(equals + 1));
    if (known == read_limit_names().end() || !value || *value < 0.0) {
      throw UsageError(
          formatted("--limit: '{}' must be NAME=VALUE; the names are {}, and the value is a number",
                    item, joined({read_limit_names().begin(), read_limit_names().end()})));
    }
    all.set(static_cast<ReadCost>(known - read_limit_names().begin()), *value);
  }
  return all;
}

void add_definitions_option(OptionSet& options, std::optional<std::string>& definitions) {
  options.add("--definitions", definitions, "DIR",
              "folder of ROS message definitions (package/msg/Type.msg), for a bag that does not "
              "contain the definitions");
}

void take_definitions(const std::optional<std::string>& definitions) {
  if (definitions) {
    static_cast<void>(add_message_definitions(*definitions));
  }
}

LogFormat format_of(const TableOptions& options) {
  LogFormat format;
  take_definitions(options.definitions);
  if (options.map) {
    format = read_log_format(*options.map);
  }
  if (options.names) {
    format.names = names_of(*options.names);
  }
  format.limits = limits_of(options.limits);
  return format;
}

std::vector<SeriesKind> kinds_of(const std::string& kind) {
  std::vector<SeriesKind> kinds;
  for (const SeriesKind one :
       {SeriesKind::accelerometer, SeriesKind::gyroscope, SeriesKind::magnetometer}) {
    if (name_of(one) == sensor_name(kind)) {
      kinds.push_back(one);
    }
  }
  return kinds;
}

std::optional<LogSensor> sensor_of_kind(const TableText& table, const std::string& kind) {
  const std::string_view wanted = sensor_name(kind);
  std::optional<LogSensor> found;
  for (const LogSensor& sensor : table.sensors()) {
    if (wanted.empty() || name_of(sensor.kind) == wanted) {
      if (found) {
        return std::nullopt;  // several sensors match, so the user must state the columns
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
  LogFormat format = format_of(options);
  format.kinds = kinds_of(wanted.of_recording);
  format.wanted = wanted.axes;
  OpenTable table;
  table.text = read ? std::make_unique<TableText>(path, read, format)
                    : std::make_unique<TableText>(path, format);
  std::vector<std::string> known = {
      "run",         "rest",      "fence",    "block",       "mount",    "level",    "serial",
      "temperature", "time",      "samples",  "fx",          "fy",       "fz",       "confirm",
      "pitch_deg",   "roll_deg",  "yaw_deg",  "heading_deg", "date",     "operator", "axis",
      "angle",       "angle_deg", "tilt_deg", "rate",        "rate_dps", "lux",      "irradiance"};
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
  name_truth_and_measured(path, wanted, *table.text, renamed);
  convert_units(path, wanted, *table.text, renamed);
  const std::vector<FaceColumn> faces = face_columns(path, wanted, *table.text, renamed);
  for (const FaceColumn& column : faces) {
    renamed.push_back(column.column);
    print_remark("note", column.words);
  }
  table.csv = std::make_unique<CsvReader>(table.text->reader(known, renamed, quotes));
  for (const std::string& note : table.text->notes()) {
    print_remark("note", path + ": " + note);
  }
  return table;
}

}  // namespace axiscal::cli
