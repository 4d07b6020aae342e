// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "logs/recordings/src/series_decoder.hpp"

namespace axiscal {

/// A type of message of ArduPilot or MAVLink, from a log in any format. One of the fields is the
/// time, and the field `I` is the number of the sensor. The name of the message determines the
/// meaning of the other fields.
class FlightMessage {
 public:
  FlightMessage() = default;

  /// @param name    name of the message: "IMU", "MAG2", "RAW_IMU", ...
  /// @param fields  names of the numeric fields of the message, including the time and `I`.
  FlightMessage(std::string name, std::vector<std::string> fields);

  [[nodiscard]] const std::vector<std::string>& fields() const { return fields_; }

  /// Passes a message on to the sink.
  /// @param values  one value for each field.
  /// @param count   number of series in the sink; increased if the message begins new series.
  /// @param time_s  time of the message [s], used if none of its fields is a time.
  void put(SeriesSink& sink,
           std::span<const double> values,
           std::size_t& count,
           std::optional<double> time_s = {});

 private:
  std::string name_;
  std::vector<std::string> fields_;
  std::optional<std::size_t> time_, instance_;
  double seconds_ = 1.0;  // seconds per unit of the time
  std::vector<std::size_t> others_;
  std::map<int, MessageSeries> series_;  // one for each instance
  std::vector<double> values_;
};

}  // namespace axiscal
