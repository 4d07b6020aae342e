// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/observations_csv.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/missing_column.hpp"
#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/printable_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/units.hpp"
#include "calib/record/src/sheet_columns.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// A table whose columns are found by name. Each error message contains the line and the column.
class Table {
 public:
  // @param faces  words for faces, in addition to the standard names.
  explicit Table(CsvReader& csv, FaceNames faces = {})
      : csv_(csv), used_(csv.header().size(), false), faces_(std::move(faces)) {}

  std::optional<std::size_t> find(std::string_view name) {
    const std::optional<std::size_t> column = csv_.column(name);
    if (column) {
      used_[*column] = true;
    }
    return column;
  }

  std::size_t need(std::string_view name) {
    if (const std::optional<std::size_t> column = find(name)) {
      return *column;
    }
    throw MissingColumnError(csv_.path(), csv_.line(), std::string(name), csv_.header());
  }

  [[noreturn]] void fail(std::string_view column, std::string_view what) const {
    throw DataError(csv_.path(), csv_.line(), formatted("column '{}': {}", column, what));
  }

  [[noreturn]] void fail(std::size_t column, std::string_view what) const {
    fail(csv_.header()[column], what);
  }

  // @param why  why the column is needed, as a sentence without its full stop.
  [[noreturn]] void fail_without(std::string_view column, std::string_view why) const {
    throw DataError(csv_.path(), csv_.line(), formatted("column '{}' is missing. {}", column, why));
  }

  static bool is_empty(std::span<const std::string_view> cells) {
    return std::all_of(cells.begin(), cells.end(),
                       [](std::string_view cell) { return cell.empty(); });
  }

  bool next() {
    CsvReader::Row row = csv_.next();
    while (row == CsvReader::Row::good && csv_.cell_count() > 1 && is_empty(csv_.cells())) {
      row = csv_.next();  // skips rows of empty cells, which spreadsheets may append
    }
    if (row == CsvReader::Row::defective) {
      const bool longer = csv_.cell_count() > csv_.header().size();
      throw DataError(csv_.path(), csv_.line(),
                      csv_.defect() + (longer ? " (a decimal comma? use '.')" : std::string()));
    }
    if (row == CsvReader::Row::good && !is_utf8(csv_.text())) {
      throw DataError(csv_.path(), csv_.line(), "not UTF-8 text: save the file as UTF-8");
    }
    return row == CsvReader::Row::good;
  }

  [[nodiscard]] std::string_view text(std::size_t column) const { return csv_.cells()[column]; }

  [[nodiscard]] double number(std::size_t column) const {
    const std::optional<double> number = parse_number(text(column));
    if (text(column).empty()) {
      throw DataError(csv_.path(), csv_.line(),
                      formatted("column '{}' is empty. Fill in the value, or delete the row",
                                csv_.header()[column]));
    }
    if (!number) {
      fail(column, formatted("{} is not a finite number{}", quoted(column), advice(text(column))));
    }
    return *number;
  }

  [[nodiscard]] double positive(std::size_t column) const {
    const double value = number(column);
    if (!(value > 0.0)) {
      fail(column, quoted(column) + " must be greater than 0");
    }
    return value;
  }

  [[nodiscard]] double not_negative(std::size_t column) const {
    const double value = number(column);
    if (!(value >= 0.0)) {
      fail(column, quoted(column) + " must not be negative");
    }
    return value;
  }

  [[nodiscard]] int integer(std::size_t column) const {
    if (const std::optional<int> number = parse_integer(text(column))) {
      return *number;
    }
    // Accepts 1.0 for 1, because spreadsheets and data frames may write whole numbers like this.
    const std::optional<double> number = parse_number(text(column));
    constexpr double largest = 2147483647.0;
    if (!number || *number != std::floor(*number) || std::abs(*number) > largest) {
      fail(column, quoted(column) + " is not a whole number");
    }
    return static_cast<int>(*number);
  }

  // Returns the value of a cell that contains 1 or 0. An empty cell means 0.
  [[nodiscard]] bool flag(std::size_t column) const {
    const std::string_view cell = text(column);
    if (!cell.empty() && cell != "0" && cell != "1") {
      fail(column, quoted(column) + " must be 1 or 0");
    }
    return cell == "1";
  }

  [[nodiscard]] Face face(std::size_t column) const {
    const std::optional<Face> face = find_face(faces_, text(column));
    if (!face) {
      std::string words;
      for (const auto& [word, of] : faces_) {
        words += formatted(", '{}'", word);
      }
      fail(column, formatted("{} is not a face; the faces are +X -X +Y -Y +Z -Z{}; to use another "
                             "word, define it with face names: 'WORD=FACE,...'",
                             quoted(column), words));
    }
    return *face;
  }

  [[nodiscard]] DesignPoint point(std::size_t rest, std::size_t fence) const {
    const Face rest_face = face(rest);
    const Face fence_face = face(fence);
    if (axis_of(rest_face) == axis_of(fence_face)) {
      fail(fence, formatted("'{}' and rest '{}' are on one axis; the two faces must be adjacent",
                            face_name(fence_face), face_name(rest_face)));
    }
    return {rest_face, fence_face};
  }

  [[nodiscard]] double time(std::size_t column) const {
    const std::optional<double> seconds = parse_number(text(column));
    const std::optional<double> stamp = seconds ? seconds : parse_clock_time(text(column));
    if (!stamp) {
      fail(column, quoted(column) + " is neither a number of seconds nor an ISO 8601 time");
    }
    return seconds ? seconds_of_clock(*seconds) : *stamp;
  }

  [[nodiscard]] std::vector<std::string> ignored() const {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < used_.size(); ++i) {
      if (!used_[i]) {
        names.push_back(csv_.header()[i]);
      }
    }
    return names;
  }

  [[noreturn]] void fail_without_rows() const {
    throw DataError(csv_.path(), csv_.line(), "the table has a header, but no readings");
  }

  [[nodiscard]] std::size_t line() const { return csv_.line(); }

  // Returns the names of the columns that begin with a prefix, in the columns' order. The prefix is
  // removed from the names.
  [[nodiscard]] std::vector<std::string> names_after(const std::string& prefix) const {
    std::vector<std::string> names;
    for (const std::string& name : csv_.header()) {
      if (name.size() > prefix.size() && name.starts_with(prefix)) {
        names.push_back(name.substr(prefix.size()));
      }
    }
    return names;
  }

  // Returns the slots of all columns SLOT.axis for one axis, in the columns' order.
  [[nodiscard]] std::vector<std::string> slots_of(const std::string& axis) const {
    std::vector<std::string> slots;
    for (const std::string& name : csv_.header()) {
      if (name.size() > axis.size() + 1 && name.ends_with("." + axis) &&
          !name.starts_with(level_column_prefix)) {
        slots.push_back(name.substr(0, name.size() - axis.size() - 1));
      }
    }
    return slots;
  }

 private:
  [[nodiscard]] std::string quoted(std::size_t column) const {
    return formatted("'{}'", text(column).substr(0, 40));
  }

  static std::string advice(std::string_view text) {
    if (text.find(',') != std::string_view::npos) {
      return ": write '.' as the decimal point";
    }
    return "";
  }

  CsvReader& csv_;
  std::vector<bool> used_;
  FaceNames faces_;
};

// The columns that state the level of the field: `level` for the whole field, and `level.NAME` for
// the part NAME of the field.
class LevelColumns {
 public:
  LevelColumns() = default;
  explicit LevelColumns(Table& table) : of_all_(table.find("level")) {
    for (const std::string& name : table.names_after(level_column_prefix)) {
      of_parts_.emplace_back(name, table.need(level_column_prefix + name));
    }
  }

  [[nodiscard]] bool any() const { return of_all_.has_value() || !of_parts_.empty(); }

  [[nodiscard]] FieldLevel read(const Table& table) const {
    const double of_all = of_all_ ? table.number(*of_all_) : 1.0;
    if (of_parts_.empty()) {
      return of_all;
    }
    FieldLevel::OfParts of_parts;
    for (const auto& [name, column] : of_parts_) {
      of_parts[name] = table.number(column);
    }
    return FieldLevel(std::move(of_parts), of_all);
  }

 private:
  std::optional<std::size_t> of_all_;
  std::vector<std::pair<std::string, std::size_t>> of_parts_;
};

// The columns of temperature sensors: `temperature` for all axes, AXIS_temperature or
// temperature_AXIS for one axis, SLOT.temperature or SLOT.temperature_AXIS in an assembly.
class TemperatureColumns {
 public:
  TemperatureColumns() = default;
  // @param slots  the slot of each axis; empty without slots.
  TemperatureColumns(Table& table,
                     const std::vector<std::string>& axes,
                     const std::vector<std::string>& slots,
                     bool needed) {
    std::vector<std::size_t> own;
    std::string missing;
    for (std::size_t k = 0; k < axes.size(); ++k) {
      std::optional<std::size_t> column = table.find(axes[k] + "_temperature");
      if (!column && slots.empty()) {
        column = table.find("temperature_" + axes[k]);
      } else if (!column) {
        const std::string axis = axes[k].substr(slots[k].size() + 1);
        column = table.find(formatted("{}.temperature_{}", slots[k], axis));
        column = column ? column : table.find(slots[k] + ".temperature");
      }
      if (column) {
        own.push_back(*column);
      } else {
        missing = missing.empty() ? axes[k] + "_temperature" : missing;
      }
    }
    if (own.empty()) {
      of_all_ = needed ? table.need("temperature") : table.find("temperature");
      may_be_blank_ = !needed;
      return;
    }
    if (!missing.empty()) {
      table.fail_without(missing, "Other axes have their own temperature columns");
    }
    of_axes_ = std::move(own);
  }

  // Reads the temperature of a reading. The column `temperature` may be empty if it is not
  // required, but it must then be empty in all rows.
  [[nodiscard]] std::optional<SensorTemperature> read(const Table& table) {
    if (of_all_ && !is_blank_) {
      is_blank_ = may_be_blank_ && table.text(*of_all_).empty();
    }
    if (of_all_ && *is_blank_) {
      if (!table.text(*of_all_).empty()) {
        table.fail(*of_all_,
                   "this column has a value in this row, but not in the earlier rows; fill in all "
                   "rows or none");
      }
      return std::nullopt;
    }
    if (of_axes_.empty()) {
      return of_all_ ? std::optional<SensorTemperature>(table.number(*of_all_)) : std::nullopt;
    }
    std::vector<double> all;
    for (const std::size_t column : of_axes_) {
      all.push_back(table.number(column));
    }
    return SensorTemperature(std::move(all));
  }

 private:
  std::optional<std::size_t> of_all_;
  std::vector<std::size_t> of_axes_;
  bool may_be_blank_ = true;
  std::optional<bool> is_blank_;  // true if column `temperature` is empty in the first row
};

// A column with the magnitude of a known field, for example of a rate table, a coil or a lamp.
struct SizeColumn {
  std::string_view name;
  std::string_view unit;  // unit of the column; empty if it is the unit of the field
};
constexpr std::array size_columns = {SizeColumn{"rate", ""},
                                     SizeColumn{"rate_dps", "deg/s"},
                                     SizeColumn{"rate_deg_s", "deg/s"},
                                     SizeColumn{"rate_rad_s", "rad/s"},
                                     SizeColumn{"omega", ""},
                                     SizeColumn{"lux", "lux"},
                                     SizeColumn{"illuminance", "lux"},
                                     SizeColumn{"irradiance", "W/m^2"},
                                     SizeColumn{"field", ""},
                                     SizeColumn{"field_nT", "nT"},
                                     SizeColumn{"field_uT", "uT"}};

// A column with the angle of a tilt about one axis.
struct AngleColumn {
  std::string_view name;
  double in_rad;
};
constexpr std::array angle_columns = {
    AngleColumn{"angle", rad_per_deg},     AngleColumn{"angle_deg", rad_per_deg},
    AngleColumn{"angle_rad", 1.0},         AngleColumn{"tilt", rad_per_deg},
    AngleColumn{"tilt_deg", rad_per_deg},  AngleColumn{"tilt_rad", 1.0},
    AngleColumn{"theta_deg", rad_per_deg}, AngleColumn{"theta_rad", 1.0}};

// The indices of the columns of observations.
struct Columns {
  std::optional<std::size_t> rest, fence, run, block, mount, time, samples, serial, confirm, date,
      operated_by;
  std::optional<std::size_t> pitch, roll, heading;
  double angle_in_rad = rad_per_deg;       // unit of the columns pitch and roll [rad]
  std::optional<std::size_t> size, along;  // columns of magnitude and axis of a known field
  Eigen::Vector3d along_all =
      Eigen::Vector3d::Zero();  // direction of a known field if `along` is nullopt
  TemperatureColumns temperature;
  LevelColumns level;
  std::vector<std::size_t> axes;
  std::vector<std::optional<std::size_t>> minus;  // subtracted column of each axis, if any
  std::vector<std::size_t> axes_sd;               // empty unless each axis has a column AXIS_sd
  std::vector<std::size_t> field;                 // columns fx, fy, fz; empty if absent
};

// Finds the columns of stated attitudes. If an axis of the instrument is named pitch_deg or
// roll_deg, these columns are readings and not attitudes.
void find_attitude(Table& table, const std::vector<std::string>& axes, Columns& columns) {
  const auto is_axis = [&](const char* name) {
    return std::find(axes.begin(), axes.end(), name) != axes.end();
  };
  if (is_axis("pitch_deg") || is_axis("roll_deg")) {
    return;
  }
  columns.pitch = table.find("pitch_deg");
  columns.roll = table.find("roll_deg");
  const bool has_labels = columns.rest || !columns.field.empty();
  for (const AngleColumn& angle : angle_columns) {
    const bool is_own = std::find(axes.begin(), axes.end(), angle.name) != axes.end();
    if (columns.pitch || columns.roll || has_labels || is_own) {
      continue;
    }
    // A single tilt angle is the roll if the instrument's only axis is y, and otherwise the pitch.
    const bool rolls = axes.size() == 1 && (axes.front() == "y" || axes.front() == "Y");
    (rolls ? columns.roll : columns.pitch) = table.find(angle.name);
    columns.angle_in_rad = angle.in_rad;
  }
  if (!columns.pitch && !columns.roll) {
    return;
  }
  columns.heading = table.find("heading_deg");
  if (!columns.heading) {
    columns.heading = table.find("yaw_deg");
  }
  if (columns.rest || !columns.field.empty()) {
    table.fail(
        "pitch_deg",
        "the file states each pose twice: as an attitude, and by 'rest' and 'fence' or by 'fx', "
        "'fy', 'fz'. Keep one of the two, and delete or rename the columns of the other");
  }
}

// Parses a direction in the sensor's frame: "x", "-Z", or the name of an axis.
std::optional<Eigen::Vector3d> direction_of(std::string_view word,
                                            const std::vector<std::string>& axes) {
  double sign = 1.0;
  if (word.starts_with('+') || word.starts_with('-')) {
    sign = word.front() == '-' ? -1.0 : 1.0;
    word.remove_prefix(1);
  }
  const std::size_t letter = std::string_view("xyzXYZ").find(word);
  if (word.size() == 1 && letter != std::string_view::npos) {
    return sign * Eigen::Vector3d::Unit(static_cast<Eigen::Index>(letter % 3));
  }
  const auto axis = std::find(axes.begin(), axes.end(), word);
  if (axis == axes.end() || axes.size() > 3) {
    return std::nullopt;
  }
  return sign * Eigen::Vector3d::Unit(axis - axes.begin());
}

// Finds the columns with the magnitude and the axis of a known field.
void find_size(Table& table, const std::vector<std::string>& axes, Columns& columns, Run& run) {
  if (columns.rest || !columns.field.empty() || columns.pitch || columns.roll) {
    return;
  }
  for (const SizeColumn& size : size_columns) {
    if (std::find(axes.begin(), axes.end(), size.name) != axes.end()) {
      continue;
    }
    columns.size = table.find(size.name);
    if (!columns.size) {
      continue;
    }
    run.field_unit = size.unit;
    columns.along = table.find("axis");
    if (!columns.along && axes.size() > 1) {
      table.fail(size.name,
                 "this column gives the magnitude of the field, but not its axis; add the column "
                 "'axis' (x, y or z), or give the field in the sensor's frame in the columns "
                 "'fx', 'fy', 'fz'");
    }
    columns.along_all = direction_of(axes.front(), {}).value_or(Eigen::Vector3d::UnitZ());
    return;
  }
}

// Returns the slot of each axis; empty without slots.
std::vector<std::string> slot_of_axes(const ObservationColumns& wanted) {
  std::vector<std::string> slots;
  for (const SlotColumns& slot : wanted.slots) {
    slots.insert(slots.end(), slot.axes.size(), slot.slot);
  }
  return slots;
}

Columns find_columns(Table& table, const ObservationColumns& wanted, Run& run) {
  const std::vector<std::string>& axes = wanted.axes;
  Columns columns;
  for (const std::string& axis : axes) {
    const auto difference =
        std::find_if(wanted.differences.begin(), wanted.differences.end(),
                     [&](const DifferentialAxis& one) { return one.axis == axis; });
    if (difference == wanted.differences.end()) {
      columns.axes.push_back(table.need(axis));
      columns.minus.emplace_back();
    } else {
      columns.axes.push_back(table.need(difference->plus));
      columns.minus.emplace_back(table.need(difference->minus));
    }
  }
  for (const std::string& axis : axes) {
    const std::string name = axis + "_sd";
    const std::optional<std::size_t> column = wanted.needs_sd ? table.need(name) : table.find(name);
    if (column) {
      columns.axes_sd.push_back(*column);
    }
  }
  if (columns.axes_sd.size() != axes.size()) {
    columns.axes_sd.clear();
  }
  columns.rest = table.find("rest");
  columns.fence = table.find("fence");
  if (columns.rest && !columns.fence && wanted.needs_labels) {
    table.fail_without("fence", "This method needs both 'rest' and 'fence'");
  }
  if (columns.fence && !columns.rest) {
    table.fail_without("rest", "A design point needs both 'rest' and 'fence'");
  }
  constexpr std::array<std::string_view, 3> field_names = {"fx", "fy", "fz"};
  const bool any_field =
      std::any_of(field_names.begin(), field_names.end(), [&](std::string_view name) {
        return std::find(axes.begin(), axes.end(), name) == axes.end() && table.find(name);
      });
  if (any_field) {
    for (const std::string_view name : field_names) {
      columns.field.push_back(table.need(name));
    }
  }
  find_attitude(table, axes, columns);
  find_size(table, axes, columns, run);
  if (!columns.rest && wanted.needs_labels) {
    table.fail_without("rest", "This method needs the design point of each reading");
  }
  columns.run = table.find("run");
  columns.block = table.find("block");
  columns.mount = table.find("mount");
  columns.level = LevelColumns(table);
  columns.temperature =
      TemperatureColumns(table, axes, slot_of_axes(wanted), wanted.needs_temperature);
  columns.confirm = table.find("confirm");
  columns.time = table.find("time");
  columns.samples = wanted.needs_samples ? table.need("samples") : table.find("samples");
  columns.serial = table.find("serial");
  columns.date = table.find("date");
  columns.operated_by = table.find("operator");
  return columns;
}

// Returns a design point with an arbitrary fence face. The fence face does not matter on a level
// table.
DesignPoint any_point_on(Face rest) {
  return {rest, face_of((axis_of(rest) + 1) % 3, true)};
}

Reading read_reading(const Table& table,
                     Columns& columns,
                     const std::vector<std::string>& axes,
                     int row) {
  Reading reading;
  reading.run = columns.run ? table.integer(*columns.run) : row;
  if (columns.block) {
    reading.block = table.integer(*columns.block);
  }
  if (columns.mount) {
    reading.mount = table.integer(*columns.mount);
  }
  if (columns.rest) {
    reading.point = columns.fence ? table.point(*columns.rest, *columns.fence)
                                  : any_point_on(table.face(*columns.rest));
  }
  if (columns.pitch || columns.roll) {
    const auto angle_of = [&](const std::optional<std::size_t>& column) {
      return column ? table.number(*column) * columns.angle_in_rad : 0.0;
    };
    reading.attitude =
        StatedAttitude{.pitch_rad = angle_of(columns.pitch), .roll_rad = angle_of(columns.roll)};
    if (columns.heading) {
      reading.attitude->heading_rad = table.number(*columns.heading) * rad_per_deg;
    }
  }
  reading.confirm = columns.confirm && table.flag(*columns.confirm);
  reading.level = columns.level.read(table);
  reading.temperature = columns.temperature.read(table);
  if (columns.time) {
    reading.time_s = table.time(*columns.time);
  }
  if (!columns.field.empty()) {
    reading.field_in_sensor =
        Eigen::Vector3d(table.number(columns.field[0]), table.number(columns.field[1]),
                        table.number(columns.field[2]));
  }
  if (columns.size) {
    const std::optional<Eigen::Vector3d> along =
        columns.along ? direction_of(table.text(*columns.along), axes) : columns.along_all;
    if (!along) {
      table.fail(
          "axis",
          formatted(
              "'{}' is not an axis; write x, y or z, with a minus sign for the opposite direction",
              table.text(*columns.along)));
    }
    reading.field_in_sensor = table.number(*columns.size) * *along;
  }
  return reading;
}

Eigen::MatrixXd rows_of(const std::vector<double>& numbers, std::size_t columns) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor>(numbers.data(),
                                    static_cast<Eigen::Index>(numbers.size() / columns),
                                    static_cast<Eigen::Index>(columns));
}

void append_cells(std::string& text, const std::vector<std::string>& cells) {
  text += joined(cells, ",");
  text += '\n';
}

}  // namespace

std::vector<std::string> unknown_columns(const std::vector<std::string>& header) {
  constexpr std::array<std::string_view, 20> names = {
      "rest",      "fence",    "run",     "block",       "mount", "level",   "temperature",
      "time",      "samples",  "serial",  "fx",          "fy",    "fz",      "confirm",
      "pitch_deg", "roll_deg", "yaw_deg", "heading_deg", "date",  "operator"};
  const auto is_one_of = [](const auto& columns, const std::string& name) {
    return std::any_of(columns.begin(), columns.end(),
                       [&](const auto& column) { return column.name == name; });
  };
  std::vector<std::string> own;
  for (const std::string& name : header) {
    const bool has_meaning = std::find(names.begin(), names.end(), name) != names.end() ||
                             is_one_of(size_columns, name) || is_one_of(angle_columns, name) ||
                             name == "axis" || name.starts_with(level_column_prefix) ||
                             name.ends_with("_sd") || name.ends_with("_temperature") ||
                             name.starts_with("temperature_");
    if (!has_meaning) {
      own.push_back(name);
    }
  }
  return own;
}

bool is_label_of_pose(std::string_view name) {
  constexpr std::array<std::string_view, 6> labels = {"rest", "fence",     "fx",
                                                      "fy",   "pitch_deg", "roll_deg"};
  return std::find(labels.begin(), labels.end(), name) != labels.end() ||
         std::any_of(size_columns.begin(), size_columns.end(),
                     [&](const SizeColumn& column) { return column.name == name; }) ||
         std::any_of(angle_columns.begin(), angle_columns.end(),
                     [&](const AngleColumn& column) { return column.name == name; });
}

Run read_observations(CsvReader& csv, const ObservationColumns& asked_for) {
  if (asked_for.axes.empty()) {
    throw DomainError("read_observations: at least one axis is needed");
  }
  Table table(csv, asked_for.face_names);
  Run result;
  ObservationColumns wanted = asked_for;
  result.axes = asked_for.axes;
  if (wanted.slots.empty() && !csv.column(asked_for.axes.front()) &&
      asked_for.differences.empty()) {
    for (const std::string& slot : table.slots_of(asked_for.axes.front())) {
      wanted.slots.push_back({.slot = slot, .axes = asked_for.axes});
    }
  }
  if (!wanted.slots.empty()) {
    wanted.axes.clear();
    for (const SlotColumns& slot : wanted.slots) {
      result.slots.push_back(slot.slot);
      for (const std::string& axis : slot.axes) {
        wanted.axes.push_back(formatted("{}.{}", slot.slot, axis));
      }
    }
    for (const SlotColumns& slot : asked_for.slots) {
      result.axes_of_slots.push_back(slot.axes);
    }
  }
  Columns columns = find_columns(table, wanted, result);
  Observations& observations = result.observations;
  observations.has_block = columns.block.has_value();
  observations.has_level = columns.level.any();
  observations.has_fence = !columns.rest || columns.fence.has_value();
  std::vector<double> response;
  std::vector<double> response_sd;
  std::vector<double> samples;
  std::vector<double> saturated;
  while (table.next()) {
    const int row = static_cast<int>(observations.readings.size()) + 1;
    observations.readings.push_back(read_reading(table, columns, wanted.axes, row));
    for (std::size_t k = 0; k < columns.axes.size(); ++k) {
      const double plus = table.number(columns.axes[k]);
      const double minus = columns.minus[k] ? table.number(*columns.minus[k]) : 0.0;
      response.push_back(plus - minus);
      const auto out_of_range = [&](double value) {
        return wanted.range && (value <= wanted.range->low || value >= wanted.range->high);
      };
      if (!wanted.differences.empty()) {
        saturated.push_back(columns.minus[k] && (out_of_range(plus) || out_of_range(minus)) ? 1.0
                                                                                            : 0.0);
      }
    }
    for (const std::size_t column : columns.axes_sd) {
      response_sd.push_back(wanted.needs_sd ? table.not_negative(column) : table.number(column));
    }
    if (columns.samples) {
      samples.push_back(table.positive(*columns.samples));
    }
    if (columns.serial) {
      const std::string_view serial = table.text(*columns.serial);
      if (row > 1 && serial != result.serial && !wanted.takes_several_units) {
        table.fail(*columns.serial,
                   formatted("'{}' follows '{}', but here a file may contain the readings of only "
                             "one unit (device); make one file for each unit",
                             serial, result.serial));
      }
      if (row == 1 || serial != result.serials.back()) {
        try {
          check_serial(serial);
        } catch (const DomainError& error) {
          table.fail(*columns.serial, error.what());
        }
      }
      result.serials.emplace_back(serial);
      result.serial = result.serials.front();
    }
    if (columns.date) {
      result.dates.emplace_back(table.text(*columns.date));
    }
    if (columns.operated_by) {
      result.operators.emplace_back(table.text(*columns.operated_by));
    }
  }
  if (observations.readings.empty()) {
    table.fail_without_rows();
  }
  observations.response = rows_of(response, wanted.axes.size());
  if (!wanted.differences.empty()) {
    observations.saturated = rows_of(saturated, wanted.axes.size()).array() > 0.0;
  }
  if (!response_sd.empty()) {
    observations.response_sd = rows_of(response_sd, wanted.axes.size());
  }
  if (!samples.empty()) {
    observations.samples = rows_of(samples, 1).col(0);
  }
  result.ignored_columns = table.ignored();
  for (std::string& date : result.dates) {
    const std::optional<double> time_s = parse_clock_time(date, UnclearDays::refused);
    if (!date.empty() && (!time_s || !is_utc(*time_s))) {
      result.notes.push_back(formatted(
          "{}: column 'date': '{}' is not a clear date, so all dates are ignored; write dates "
          "as 2026-11-20",
          csv.path(), date));
      result.dates.clear();
      break;
    }
    constexpr std::size_t day_alone = 10;
    constexpr double day_s = 86400.0;
    if (!date.empty()) {
      date = timestamp_of(*time_s).substr(
          0, std::fmod(*time_s, day_s) == 0.0 ? day_alone : std::string::npos);
    }
  }
  return result;
}

std::vector<RunSheetRow> read_run_sheet(CsvReader& csv) {
  Table table(csv);
  const std::size_t rest = table.need("rest");
  const std::size_t fence = table.need("fence");
  const LevelColumns level(table);
  const std::optional<std::size_t> run = table.find("run");
  const std::optional<std::size_t> block = table.find("block");
  const std::optional<std::size_t> temperature = table.find("temperature");
  std::vector<RunSheetRow> sheet;
  while (table.next()) {
    sheet.push_back(
        {.run = run ? table.integer(*run) : static_cast<int>(sheet.size()) + 1,
         .block = block ? table.integer(*block) : 1,
         .entry = DesignEntry{.point = table.point(rest, fence), .level = level.read(table)},
         .temperature = temperature && !table.text(*temperature).empty()
                            ? std::optional(table.number(*temperature))
                            : std::nullopt});
  }
  if (sheet.empty()) {
    table.fail_without_rows();
  }
  return sheet;
}

std::vector<DesignEntry> read_design(CsvReader& csv) {
  std::vector<DesignEntry> design;
  for (const RunSheetRow& row : read_run_sheet(csv)) {
    design.push_back(row.entry);
  }
  return design;
}

std::vector<Reading> readings_of(const std::vector<RunSheetRow>& sheet) {
  std::vector<Reading> readings;
  readings.reserve(sheet.size());
  for (const RunSheetRow& row : sheet) {
    readings.push_back({.run = row.run,
                        .block = row.block,
                        .point = row.entry.point,
                        .level = row.entry.level,
                        .temperature = row.temperature});
  }
  return readings;
}

std::string run_sheet_csv(const std::vector<RunSheetRow>& sheet,
                          const std::vector<std::string>& axes) {
  std::string text;
  const RunSheetCells cells = run_sheet_cells(sheet);
  std::vector<std::string> header = cells.header;
  if (!axes.empty()) {
    std::transform(axes.begin(), axes.end(), std::back_inserter(header), formula_safe_cell);
  }
  const bool with_temperature = !axes.empty() || (!sheet.empty() && sheet.front().temperature);
  if (with_temperature) {
    header.emplace_back("temperature");
  }
  append_cells(text, header);
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    std::vector<std::string> row = cells.rows[i];
    row.resize(row.size() + axes.size());  // empty cells for the readings
    if (with_temperature) {
      row.push_back(sheet[i].temperature ? number_text(*sheet[i].temperature) : "");
    }
    append_cells(text, row);
  }
  return text;
}

RunSheetCells run_sheet_cells(const std::vector<RunSheetRow>& sheet) {
  std::vector<Reading> readings = readings_of(sheet);
  for (Reading& reading : readings) {
    reading.temperature.reset();
  }
  const SheetColumns columns(readings);
  RunSheetCells cells{.header = columns.header()};
  for (const Reading& reading : readings) {
    cells.rows.push_back(columns.cells(reading));
  }
  return cells;
}

std::string observations_csv(const Observations& observations,
                             const std::vector<std::string>& axes) {
  SheetColumns columns(observations.readings, axes);
  if (observations.has_level) {
    columns.show_level();
  }
  std::vector<std::string> header = columns.header();
  std::transform(axes.begin(), axes.end(), std::back_inserter(header), formula_safe_cell);
  if (observations.samples) {
    header.emplace_back("samples");
  }
  if (observations.response_sd) {
    std::transform(axes.begin(), axes.end(), std::back_inserter(header),
                   [](const std::string& axis) { return formula_safe_cell(axis + "_sd"); });
  }
  const bool has_time = !observations.readings.empty() &&
                        std::all_of(observations.readings.begin(), observations.readings.end(),
                                    [](const Reading& reading) { return reading.time_s; });
  if (has_time) {
    header.emplace_back("time");
  }
  std::string text;
  append_cells(text, header);
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    const Reading& reading = observations.readings[i];
    std::vector<std::string> cells = columns.cells(reading);
    for (Eigen::Index k = 0; k < observations.response.cols(); ++k) {
      cells.push_back(number_text(observations.response(static_cast<Eigen::Index>(i), k)));
    }
    const auto row = static_cast<Eigen::Index>(i);
    if (observations.samples) {
      cells.push_back(number_text((*observations.samples)(row)));
    }
    if (observations.response_sd) {
      for (Eigen::Index k = 0; k < observations.response_sd->cols(); ++k) {
        cells.push_back(number_text((*observations.response_sd)(row, k)));
      }
    }
    if (has_time) {
      cells.push_back(number_text(*reading.time_s));
    }
    append_cells(text, cells);
  }
  return text;
}

}  // namespace axiscal
