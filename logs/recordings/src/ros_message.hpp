// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "logs/recordings/src/record_bytes.hpp"
#include "logs/recordings/src/series_decoder.hpp"

namespace axiscal {

/// The layout of the numbers in a message: ROS 1 (packed) or ROS 2's CDR (aligned).
enum class RosWire { packed, cdr };

/// A message type of ROS, parsed from its definition (wiki.ros.org/msg; docs.ros.org,
/// "Interfaces").
class RosMessageType {
 public:
  /// @param name        "sensor_msgs/Imu" or "sensor_msgs/msg/Imu".
  /// @param definition  text of the type and of the types that it contains, separated by lines of
  ///                    `=`. A type that it lacks is looked up in add_message_definitions(), and
  ///                    then among the usual sensor messages.
  /// @return nullopt if a type is unknown or the text cannot be parsed.
  /// @throws LimitError  if the nested types exceed a limit of the file. decode() also throws it.
  [[nodiscard]] static std::optional<RosMessageType> parse(const std::string& name,
                                                           std::string_view definition,
                                                           ReadBudget budget);

  /// @return the names of its numbers, "angular_velocity.x", "orientation_covariance[0]", including
  ///         those of arrays of up to 16 elements.
  [[nodiscard]] const std::vector<std::string>& columns() const { return columns_; }

  /// @return "sensor_msgs/Imu": without "msg".
  [[nodiscard]] const std::string& name() const { return name_; }

  struct Decoded {
    std::vector<double> values;     ///< one for each column
    std::optional<double> stamp_s;  ///< header.stamp, if it is not 0
  };

  /// @return false if the message does not match the type.
  [[nodiscard]] bool decode(std::string_view message, RosWire wire, Decoded& to) const;

 private:
  enum class Kind { number, text, time, duration, message };
  struct Field {
    std::string name;
    Kind kind = Kind::number;
    char letter = 'd';     // type of a number: b B h H i I q Q f d
    std::size_t type = 0;  // position in types_ of the type of a message
    bool is_array = false;
    std::optional<std::size_t> count;  // length of a fixed array; otherwise nullopt
  };
  struct Type {
    std::string name;
    std::vector<Field> fields;
  };
  struct Walk;

  bool add_type(const std::string& name,
                const std::map<std::string, std::string>& texts,
                int depth);
  void name_columns(std::size_t type, const std::string& prefix, int depth);

  std::string name_;
  ReadBudget budget_;
  std::vector<Type> types_;
  std::vector<std::string> columns_;
  std::vector<std::size_t> open_;  // positions of the types that add_type() is reading
};

/// A topic of a bag. It converts messages to series.
class RosTopic {
 public:
  RosTopic() = default;

  /// @param type        "sensor_msgs/Imu", ...
  /// @param definition  see RosMessageType::parse().
  RosTopic(std::string topic,
           const std::string& type,
           std::string_view definition,
           const ReadBudget& budget);

  /// @param time_s  time at which the message was recorded [s], used if it has no header stamp.
  /// @param count   number of series that the sink contains; increased for a new series.
  void put(
      SeriesSink& sink, std::string_view message, RosWire wire, double time_s, std::size_t& count);

  [[nodiscard]] const std::string& topic() const { return topic_; }
  [[nodiscard]] bool has_numbers() const { return type_ && !type_->columns().empty(); }
  [[nodiscard]] std::size_t damaged() const { return damaged_; }
  [[nodiscard]] const std::string& type_name() const { return type_name_; }

 private:
  std::string topic_, type_name_;
  std::optional<RosMessageType> type_;
  MessageSeries series_;
  RosMessageType::Decoded decoded_;
  std::size_t damaged_ = 0;
};

/// @return notes about a bag's topics: topics without numbers, damaged messages.
[[nodiscard]] std::vector<std::string> notes_of(const std::vector<const RosTopic*>& topics);

}  // namespace axiscal
