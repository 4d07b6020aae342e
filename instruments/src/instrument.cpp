// SPDX-License-Identifier: Apache-2.0
#include "axiscal/instruments/instrument.hpp"

#include <set>
#include <string>
#include <string_view>

#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/error.hpp"
#include "core/formatted.hpp"

namespace axiscal {

void check_serial(std::string_view serial) {
  // Limit in bytes. A file name, which has at most 255 bytes, contains the serial number.
  constexpr std::size_t longest = 200;
  if (serial.size() > longest) {
    throw DomainError(formatted("the serial number has {} bytes, more than 200", serial.size()));
  }
  if (!is_utf8(serial)) {
    throw DomainError("the serial number is not UTF-8 text");
  }
  for (std::size_t i = 0; i < serial.size(); ++i) {
    const auto byte = static_cast<unsigned char>(serial[i]);
    // U+0080 to U+009F are control characters too. In UTF-8 they are C2 80 to C2 9F.
    const bool second = byte == 0xC2 && static_cast<unsigned char>(serial[i + 1]) < 0xA0;
    if (byte < 0x20 || byte == 0x7F || second) {
      throw DomainError(
          formatted("the serial number contains a control character, at byte {}", i + 1));
    }
  }
}

std::optional<int> nominal_axis(const Instrument& instrument, Eigen::Index axis) {
  const std::string& name = instrument.axes[static_cast<std::size_t>(axis)];
  const std::size_t letter = std::string_view("xyzXYZ").find(name.empty() ? ' ' : name.back());
  if (letter != std::string_view::npos) {
    return static_cast<int>(letter % 3);
  }
  if (instrument.axis_count() == 3) {
    return static_cast<int>(axis);
  }
  return std::nullopt;
}

int main_axis(const Instrument& instrument, const LinearResponse& response, Eigen::Index axis) {
  Eigen::Index largest = 0;
  response.sensitivity.row(axis).cwiseAbs().maxCoeff(&largest);
  return nominal_axis(instrument, axis).value_or(static_cast<int>(largest));
}

Instrument accelerometer(const std::string& unit) {
  return {.kind = "accelerometer", .unit = unit};
}

Instrument inclinometer(const std::string& unit) {
  return {.kind = "inclinometer", .unit = unit};
}

Instrument magnetometer(const std::string& unit) {
  return {.kind = "magnetometer", .unit = unit};
}

Instrument gyroscope(const std::string& unit) {
  return {.kind = "gyroscope", .unit = unit};
}

Instrument optical(const std::string& unit) {
  return {.kind = "optical", .unit = unit};
}

void set_axes(Instrument& instrument, const std::vector<std::string>& texts) {
  instrument.axes.clear();
  instrument.differences.clear();
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos) {
      instrument.axes.push_back(text);
      continue;
    }
    const std::size_t minus = text.find('-', equals);
    if (equals == 0 || minus == std::string::npos || minus == equals + 1 ||
        minus + 1 == text.size()) {
      throw DomainError(
          formatted("axis '{}' must be the name of a column, or NAME=COLUMN-COLUMN", text));
    }
    instrument.axes.push_back(text.substr(0, equals));
    instrument.differences.push_back({.axis = instrument.axes.back(),
                                      .plus = text.substr(equals + 1, minus - equals - 1),
                                      .minus = text.substr(minus + 1)});
  }
  check_axes(instrument);
}

void check_axes(const Instrument& instrument) {
  const std::set<std::string> names(instrument.axes.begin(), instrument.axes.end());
  if (names.empty() || names.size() != instrument.axes.size() || names.contains("")) {
    throw DomainError("an instrument needs at least one axis, and different names for all axes");
  }
}

AxisConvention parse_convention(std::string_view name) {
  if (name != "flu" && name != "frd") {
    throw DomainError(formatted("the convention must be flu or frd, not '{}'", name));
  }
  return name == "frd" ? AxisConvention::forward_right_down : AxisConvention::forward_left_up;
}

}  // namespace axiscal
