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

/// A message type of ROS by the text that defines it (wiki.ros.org/msg; docs.ros.org,
/// "Interfaces").
class RosMessageType {
 public:
  /// @param name        "sensor_msgs/Imu" or "sensor_msgs/msg/Imu".
  /// @param definition  the text and the texts of the types in it, separated by lines of `=`; if
  ///                    empty, the usual types of sensors are known.
  /// @return nullopt if a type is unknown or the text cannot be parsed.
  /// @throws LimitError  if the nesting of its types costs more than the file may; decode() too.
  [[nodiscard]] static std::optional<RosMessageType> parse(const std::string& name,
                                                           std::string_view definition,
                                                           ReadBudget budget);

  /// @return its numbers: "angular_velocity.x", "orientation_covariance[0]"; arrays up to 16 long.
  [[nodiscard]] const std::vector<std::string>& columns() const { return columns_; }

  /// @return "sensor_msgs/Imu": without "msg".
  [[nodiscard]] const std::string& name() const { return name_; }

  struct Decoded {
    std::vector<double> values;     ///< one for each column
    std::optional<double> stamp_s;  ///< header.stamp, if it is not 0
  };

  /// @return false where the message is shorter than its type says.
  [[nodiscard]] bool decode(std::string_view message, RosWire wire, Decoded& to) const;

 private:
  enum class Kind { number, text, time, duration, message };
  struct Field {
    std::string name;
    Kind kind = Kind::number;
    char letter = 'd';     // of a number: b B h H i I q Q f d ?
    std::size_t type = 0;  // of a message: its place in types_
    bool is_array = false;
    std::optional<std::size_t> count;  // of a fixed array
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
  std::vector<std::size_t> open_;  // types that are being read
};

/// The topic of a bag: its messages as series.
class RosTopic {
 public:
  RosTopic() = default;

  /// @param type        "sensor_msgs/Imu", ...
  /// @param definition  as RosMessageType::parse().
  RosTopic(std::string topic,
           const std::string& type,
           std::string_view definition,
           const ReadBudget& budget);

  /// @param time_s  when it was recorded; the header's stamp is taken where there is one.
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
