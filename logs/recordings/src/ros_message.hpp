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

/// The layout of the numbers in a message: packed in ROS 1, aligned in ROS 2 (CDR).
enum class RosWire { packed, cdr };

/// A message type of ROS, parsed from its definition (wiki.ros.org/msg; docs.ros.org,
/// "Interfaces").
class RosMessageType {
 public:
  /// @param name        "sensor_msgs/Imu" or "sensor_msgs/msg/Imu".
  /// @param definition  definitions of the type and of the types that it contains, separated by
  ///                    lines of `=`. A missing type is looked up among the definitions that were
  ///                    read by add_message_definitions(), and then among common ROS messages.
  /// @return nullopt if a type is unknown or the text cannot be parsed.
  /// @throws LimitError  if nested types make the cost of reading exceed a limit. decode() also
  ///                     throws it.
  [[nodiscard]] static std::optional<RosMessageType> parse(const std::string& name,
                                                           std::string_view definition,
                                                           ReadBudget budget);

  /// @return the names of the numbers in a message, such as "angular_velocity.x" and
  ///         "orientation_covariance[0]". Arrays of more than 16 elements are left out.
  [[nodiscard]] const std::vector<std::string>& columns() const { return columns_; }

  /// @return the name of the type without "msg": "sensor_msgs/Imu".
  [[nodiscard]] const std::string& name() const { return name_; }

  struct Decoded {
    std::vector<double> values;     ///< one value for each column
    std::optional<double> stamp_s;  ///< time in header.stamp [s]; nullopt if it is 0 or missing
  };

  /// @return false if the message does not match the type.
  [[nodiscard]] bool decode(std::string_view message, RosWire wire, Decoded& to) const;

 private:
  enum class Kind { number, text, time, duration, message };
  struct Field {
    std::string name;
    Kind kind = Kind::number;
    char letter = 'd';     // if kind is number, its type: b B h H i I q Q f d
    std::size_t type = 0;  // if kind is message, the index of its type in types_
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
  std::vector<std::size_t> open_;  // type that add_type() is reading, and the types around it
};

/// A topic of a bag. It converts the messages of the topic to series.
class RosTopic {
 public:
  RosTopic() = default;

  /// @param type        name of the message type, for example "sensor_msgs/Imu".
  /// @param definition  see RosMessageType::parse().
  RosTopic(std::string topic,
           const std::string& type,
           std::string_view definition,
           const ReadBudget& budget);

  /// Passes a message on to the sink.
  /// @param time_s  time at which the message was recorded [s]. It is used if the message has no
  ///                time in header.stamp.
  /// @param count   number of series in the sink; increased if the message begins new series.
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

/// @return notes about topics without numbers and about damaged messages in a bag.
[[nodiscard]] std::vector<std::string> notes_of(const std::vector<const RosTopic*>& topics);

}  // namespace axiscal
