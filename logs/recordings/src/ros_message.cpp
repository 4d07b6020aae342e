// SPDX-License-Identifier: Apache-2.0
#include "logs/recordings/src/ros_message.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/logs/sensor_names.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr std::size_t longest_array = 16;  // longer arrays are skipped
constexpr std::size_t most_columns = 4096;
constexpr std::size_t most_types = 256;
constexpr int deepest = 12;           // largest depth of messages within messages
constexpr double name_steps = 100.0;  // cost of naming a column, in units of ReadCost::steps

struct NumberType {
  std::string_view name;
  char letter;
  std::size_t size;
};

constexpr std::array<NumberType, 14> number_types = {{{"float64", 'd', 8},
                                                      {"double", 'd', 8},
                                                      {"float32", 'f', 4},
                                                      {"float", 'f', 4},
                                                      {"int8", 'b', 1},
                                                      {"uint8", 'B', 1},
                                                      {"int16", 'h', 2},
                                                      {"uint16", 'H', 2},
                                                      {"int32", 'i', 4},
                                                      {"uint32", 'I', 4},
                                                      {"int64", 'q', 8},
                                                      {"uint64", 'Q', 8},
                                                      {"bool", 'B', 1},
                                                      {"boolean", 'B', 1}}};

constexpr std::array<NumberType, 3> byte_types = {
    {{"byte", 'b', 1}, {"char", 'B', 1}, {"octet", 'B', 1}}};

const NumberType* number_type(std::string_view name) {
  for (const NumberType& type : number_types) {
    if (type.name == name) {
      return &type;
    }
  }
  for (const NumberType& type : byte_types) {
    if (type.name == name) {
      return &type;
    }
  }
  return nullptr;
}

std::size_t size_of(char letter) {
  const auto* const found =
      std::find_if(number_types.begin(), number_types.end(),
                   [&](const NumberType& type) { return type.letter == letter; });
  return found == number_types.end() ? 1 : found->size;
}

// Definitions of common ROS messages, for bags that contain no definitions (from ROS's
// common_interfaces, Apache-2.0). Each line of a definition is the type and the name of a field.
constexpr std::array<std::pair<std::string_view, std::string_view>, 18> usual_types = {{
    {"std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id"},
    {"builtin_interfaces/Time", "int32 sec\nuint32 nanosec"},
    {"builtin_interfaces/Duration", "int32 sec\nuint32 nanosec"},
    {"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z"},
    {"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z"},
    {"geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w"},
    {"geometry_msgs/Vector3Stamped", "std_msgs/Header header\ngeometry_msgs/Vector3 vector"},
    {"geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular"},
    {"geometry_msgs/TwistStamped", "std_msgs/Header header\ngeometry_msgs/Twist twist"},
    {"geometry_msgs/Accel", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular"},
    {"geometry_msgs/AccelStamped", "std_msgs/Header header\ngeometry_msgs/Accel accel"},
    {"sensor_msgs/Imu",
     "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] "
     "orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\nfloat64[9] "
     "angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\nfloat64[9] "
     "linear_acceleration_covariance"},
    {"sensor_msgs/MagneticField",
     "std_msgs/Header header\ngeometry_msgs/Vector3 magnetic_field\nfloat64[9] "
     "magnetic_field_covariance"},
    {"sensor_msgs/Temperature", "std_msgs/Header header\nfloat64 temperature\nfloat64 variance"},
    {"sensor_msgs/Illuminance", "std_msgs/Header header\nfloat64 illuminance\nfloat64 variance"},
    {"sensor_msgs/FluidPressure",
     "std_msgs/Header header\nfloat64 fluid_pressure\nfloat64 variance"},
    {"std_msgs/Float64", "float64 data"},
    {"std_msgs/Float32", "float32 data"},
}};

// @return the name of a type without "msg": "sensor_msgs/msg/Imu" becomes "sensor_msgs/Imu".
std::string plain_name(std::string_view name) {
  std::string plain(name);
  const std::size_t at = plain.find("/msg/");
  if (at != std::string::npos) {
    plain.erase(at, 4);
  }
  return plain;
}

// Splits the definition of a message into the text for its own type and the texts for other types.
// The text for another type begins after a line of "=" and a line "MSG: pkg/Type".
std::map<std::string, std::string> texts_of(const std::string& name, std::string_view definition) {
  std::map<std::string, std::string> texts;
  if (definition.find_first_not_of(" \t\r\n") == std::string_view::npos) {
    return texts;
  }
  std::string current = name;
  std::string text;
  bool after_rule = false;
  for (const std::string_view raw : split(definition, '\n')) {
    const std::string_view line = trimmed(raw);
    if (line.starts_with("=====")) {
      texts.try_emplace(current, text);
      text.clear();
      after_rule = true;
    } else if (after_rule && line.starts_with("MSG:")) {
      current = plain_name(trimmed(line.substr(4)));
      after_rule = false;
    } else if (texts.size() < most_types) {
      text += std::string(line) + '\n';
    }
  }
  texts.try_emplace(current, text);
  return texts;
}

std::string_view package_of(std::string_view name) {
  return name.substr(0, name.find('/'));
}

// @return the texts that add_message_definitions() has read, by their names "package/Type".
std::map<std::string, std::string>& added_definitions() {
  static std::map<std::string, std::string> definitions;
  return definitions;
}

}  // namespace

std::size_t add_message_definitions(const std::string& folder) {
  namespace fs = std::filesystem;
  std::error_code none;
  if (!fs::is_directory(folder, none)) {
    throw DataError(folder, "is not a folder of message definitions (package/msg/Type.msg)");
  }
  std::size_t count = 0;
  constexpr std::size_t most = 100000;
  for (auto entry = fs::recursive_directory_iterator(
           folder, fs::directory_options::skip_permission_denied, none);
       entry != fs::recursive_directory_iterator() && count < most; entry.increment(none)) {
    const fs::path& path = entry->path();
    if (path.extension() != ".msg") {
      continue;
    }
    // package/msg/Type.msg, or package/Type.msg
    const fs::path above = path.parent_path();
    const std::string package =
        (above.filename() == "msg" ? above.parent_path() : above).filename().string();
    added_definitions()[package + "/" + path.stem().string()] = read_whole_file(path.string());
    ++count;
  }
  if (count == 0) {
    throw DataError(folder, "contains no message definitions (package/msg/Type.msg)");
  }
  return count;
}

std::optional<RosMessageType> RosMessageType::parse(const std::string& name,
                                                    std::string_view definition,
                                                    ReadBudget budget) {
  RosMessageType type;
  type.budget_ = std::move(budget);
  type.name_ = plain_name(name);
  std::map<std::string, std::string> texts = texts_of(type.name_, definition);
  texts.insert(added_definitions().begin(),
               added_definitions().end());  // insert() keeps definitions from the file
  if (!type.add_type(type.name_, texts, 0)) {
    return std::nullopt;
  }
  type.name_columns(0, "", 0);
  return type;
}

// NOLINTNEXTLINE(misc-no-recursion): messages contain messages
bool RosMessageType::add_type(const std::string& name,
                              const std::map<std::string, std::string>& texts,
                              int depth) {
  const auto given = texts.find(name);
  const auto* const usual = std::find_if(usual_types.begin(), usual_types.end(),
                                         [&](const auto& known) { return known.first == name; });
  if (depth > deepest || types_.size() >= most_types ||
      (given == texts.end() && usual == usual_types.end())) {
    return false;
  }
  const std::size_t place = types_.size();
  types_.push_back({.name = name});
  open_.push_back(place);
  const std::string text = given != texts.end() ? given->second : std::string(usual->second);
  for (const std::string_view raw : split(text, '\n')) {
    std::string_view line = trimmed(raw.substr(0, raw.find('#')));
    const std::size_t blank = line.find_first_of(" \t");
    if (blank == std::string_view::npos) {
      continue;
    }
    std::string_view type = line.substr(0, blank);
    std::string_view field_name = trimmed(line.substr(blank));
    const std::size_t name_end = field_name.find_first_of(" \t=");
    if (name_end != std::string_view::npos) {
      const std::string_view behind = trimmed(field_name.substr(name_end));
      if (behind.starts_with('=')) {
        continue;  // a constant
      }
      field_name = field_name.substr(0, name_end);  // removes the default value after the name
    }
    Field field{.name = std::string(field_name)};
    if (const std::size_t open = type.find('['); open != std::string_view::npos) {
      field.is_array = true;
      const std::string_view inside = type.substr(open + 1, type.find(']') - open - 1);
      if (!inside.empty() && !inside.starts_with("<=")) {
        field.count = static_cast<std::size_t>(std::max(parse_integer(inside).value_or(0), 0));
      }
      type = type.substr(0, open);
    }
    if (const NumberType* number = number_type(type)) {
      field.letter = number->letter;
    } else if (type.starts_with("string") || type.starts_with("wstring")) {
      field.kind = type.starts_with("w") ? Kind::message : Kind::text;
      if (type.starts_with("w")) {
        return false;  // usual messages contain no wide strings
      }
    } else if (type == "time") {
      field.kind = Kind::time;
    } else if (type == "duration") {
      field.kind = Kind::duration;
    } else {
      field.kind = Kind::message;
      std::string full = plain_name(type);
      if (full == "Header") {
        full = "std_msgs/Header";
      } else if (full.find('/') == std::string::npos) {
        full = std::string(package_of(name)) + "/" + full;
      }
      const auto known = std::find_if(types_.begin(), types_.end(),
                                      [&](const Type& one) { return one.name == full; });
      if (known != types_.end()) {
        field.type = static_cast<std::size_t>(known - types_.begin());
        if (std::find(open_.begin(), open_.end(), field.type) != open_.end()) {
          return false;  // a type must not contain itself
        }
      } else {
        field.type = types_.size();
        if (!add_type(full, texts, depth + 1)) {
          return false;
        }
      }
    }
    types_[place].fields.push_back(std::move(field));
  }
  open_.pop_back();
  return true;
}

// NOLINTNEXTLINE(misc-no-recursion): messages contain messages
void RosMessageType::name_columns(std::size_t type, const std::string& prefix, int depth) {
  for (const Field& field : types_[type].fields) {
    const std::string name = prefix + field.name;
    budget_.spend(ReadCost::steps, name_steps);
    if (name == "header.stamp" || name == "header.seq" || columns_.size() > most_columns ||
        depth > deepest ||
        (field.is_array && field.count.value_or(longest_array + 1) > longest_array)) {
      continue;
    }
    const std::size_t count = field.is_array ? *field.count : 1;
    for (std::size_t i = 0; i < count; ++i) {
      budget_.spend(ReadCost::steps, name_steps);
      const std::string one = field.is_array ? formatted("{}[{}]", name, i) : name;
      if (field.kind == Kind::message) {
        name_columns(field.type, one + ".", depth + 1);
      } else if (field.kind != Kind::text) {
        columns_.push_back(one);
      }
    }
  }
}

// Reads the fields of a message, and stores the values of the columns in `to`.
struct RosMessageType::Walk {
  const RosMessageType& type;
  RecordBytes bytes;
  RosWire wire;
  Decoded& to;
  std::size_t origin = 0;  // position from which alignment is counted in CDR

  template <typename Number>
  double number() {
    align(sizeof(Number));
    return static_cast<double>(bytes.take<Number>());
  }

  void align(std::size_t size) {
    if (wire == RosWire::cdr && size > 1) {
      bytes.align(size, origin);
    }
  }

  double number_of(char letter) {
    switch (letter) {
      case 'd':
        return number<double>();
      case 'f':
        return number<float>();
      case 'b':
        return number<std::int8_t>();
      case 'h':
        return number<std::int16_t>();
      case 'H':
        return number<std::uint16_t>();
      case 'i':
        return number<std::int32_t>();
      case 'I':
        return number<std::uint32_t>();
      case 'q':
        return number<std::int64_t>();
      case 'Q':
        return number<std::uint64_t>();
      default:
        return number<std::uint8_t>();
    }
  }

  std::uint32_t size() {
    align(4);
    return bytes.take<std::uint32_t>();
  }

  // NOLINTNEXTLINE(misc-no-recursion): messages contain messages
  void message(std::size_t which, bool keeps, int depth, bool is_header) {
    for (const Field& field : type.types_[which].fields) {
      if (!bytes.ok() || depth > deepest) {
        return;
      }
      const bool is_long =
          field.is_array && field.count.value_or(longest_array + 1) > longest_array;
      const bool is_stamp = is_header && field.name == "stamp";
      const bool keeps_field =
          keeps && !is_long && !is_stamp && !(is_header && field.name == "seq");
      const std::size_t count = !field.is_array ? 1 : field.count ? *field.count : size();
      if (field.kind == Kind::number && is_long) {
        const std::size_t one = size_of(field.letter);
        if (count > 0) {
          align(one);
        }
        bytes.skip(count > bytes.left() / one ? bytes.left() + 1 : count * one);
        continue;
      }
      for (std::size_t i = 0; i < count && bytes.ok(); ++i) {
        type.budget_.spend(ReadCost::steps, 1.0);
        one(field, keeps_field, is_stamp, depth);
      }
    }
  }

  // NOLINTNEXTLINE(misc-no-recursion): messages contain messages
  void one(const Field& field, bool keeps, bool is_stamp, int depth) {
    switch (field.kind) {
      case Kind::number: {
        const double value = number_of(field.letter);
        if (keeps) {
          to.values.push_back(value);
        }
        break;
      }
      case Kind::text:
        bytes.skip(size());
        break;
      case Kind::time:
      case Kind::duration: {
        const double seconds =
            field.kind == Kind::time ? number<std::uint32_t>() : number<std::int32_t>();
        const double nanoseconds = number<std::uint32_t>();
        take_time(seconds + 1e-9 * nanoseconds, keeps, is_stamp);
        break;
      }
      case Kind::message:
        if (is_stamp) {
          const double seconds = number<std::int32_t>();
          const double nanoseconds = number<std::uint32_t>();
          take_time(seconds + 1e-9 * nanoseconds, false, true);
        } else {
          message(field.type, keeps, depth + 1, depth == 0 && field.name == "header");
        }
        break;
    }
  }

  void take_time(double seconds, bool keeps, bool is_stamp) {
    if (keeps) {
      to.values.push_back(seconds);
    }
    if (is_stamp && seconds != 0.0) {
      to.stamp_s = seconds;
    }
  }
};

bool RosMessageType::decode(std::string_view message, RosWire wire, Decoded& to) const {
  to.values.clear();
  to.stamp_s.reset();
  Walk walk{.type = *this, .bytes = RecordBytes(message), .wire = wire, .to = to};
  if (wire == RosWire::cdr) {
    constexpr std::size_t encapsulation = 4;  // begins with 00 01 if little-endian, else 00 00
    if (message.size() < encapsulation || message[1] != '\1') {
      return false;
    }
    walk.bytes.skip(encapsulation);
    walk.origin = encapsulation;
  }
  walk.message(0, true, 0, false);
  return walk.bytes.ok() && to.values.size() == columns_.size();
}

RosTopic::RosTopic(std::string topic,
                   const std::string& type,
                   std::string_view definition,
                   const ReadBudget& budget)
    : topic_(std::move(topic)),
      type_name_(plain_name(type)),
      type_(RosMessageType::parse(type, definition, budget)) {
  if (!has_numbers()) {
    return;
  }
  series_ = MessageSeries(topic_, 0, type_->columns(), [&](const std::string& column) {
    const auto is = [&](SeriesKind kind, const char* unit) {
      return Series{.kind = kind, .unit = unit, .known_by = KnownBy::format};
    };
    const std::string& message = type_->name();
    if (message == "sensor_msgs/Imu") {
      return column.starts_with("linear_acceleration.") ? is(SeriesKind::accelerometer, "m/s^2")
             : column.starts_with("angular_velocity.")  ? is(SeriesKind::gyroscope, "rad/s")
                                                        : Series{};
    }
    if (message == "sensor_msgs/MagneticField" && column.starts_with("magnetic_field.")) {
      return is(SeriesKind::magnetometer, "T");
    }
    if (message == "sensor_msgs/Temperature" && column == "temperature") {
      return is(SeriesKind::temperature, "degC");
    }
    if (message == "geometry_msgs/Vector3Stamped" && column.starts_with("vector.")) {
      return Series{.kind = sensor_kind_in(topic_), .known_by = KnownBy::names};
    }
    // Common messages may be part of other messages: "imu.linear_acceleration.x".
    const auto holds = [&](std::string_view name) {
      return column.find(name) != std::string::npos;
    };
    if (holds(".linear_acceleration.")) {
      return is(SeriesKind::accelerometer, "m/s^2");
    }
    if (holds(".angular_velocity.")) {
      return is(SeriesKind::gyroscope, "rad/s");
    }
    if (holds(".magnetic_field.")) {
      return is(SeriesKind::magnetometer, "T");
    }
    return Series{};
  });
}

void RosTopic::put(
    SeriesSink& sink, std::string_view message, RosWire wire, double time_s, std::size_t& count) {
  if (!has_numbers()) {
    return;
  }
  if (!type_->decode(message, wire, decoded_)) {
    ++damaged_;
    return;
  }
  if (!series_.announced()) {
    series_.announce(sink, count);
  }
  series_.put(sink, decoded_.stamp_s.value_or(time_s), decoded_.values);
}

std::vector<std::string> notes_of(const std::vector<const RosTopic*>& topics) {
  std::vector<std::string> without, notes;
  std::size_t damaged = 0;
  for (const RosTopic* topic : topics) {
    if (!topic->has_numbers()) {
      without.push_back(formatted("{} ({})", topic->topic(), topic->type_name()));
    }
    damaged += topic->damaged();
  }
  if (!without.empty()) {
    notes.push_back(
        "some topics are left out, because they contain no readable numbers, or because their "
        "message definitions are missing (give the folder of the definitions): " +
        joined(without));
  }
  if (damaged > 0) {
    notes.push_back(
        formatted("{} messages are left out, because they do not match the definition of the "
                  "message type",
                  damaged));
  }
  return notes;
}

}  // namespace axiscal
