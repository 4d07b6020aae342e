// SPDX-License-Identifier: Apache-2.0
#include "axiscal/instruments/instrument.hpp"

#include <set>
#include <string>
#include <string_view>

#include "axiscal/core/error.hpp"

namespace axiscal {

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
      throw DomainError("axis '" + text + "' must be the name of a column, or NAME=COLUMN-COLUMN");
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
    throw DomainError("an instrument needs one or more axes, each with a name of its own");
  }
}

AxisConvention parse_convention(std::string_view name) {
  if (name != "flu" && name != "frd") {
    throw DomainError("the convention must be flu or frd, not '" + std::string(name) + "'");
  }
  return name == "frd" ? AxisConvention::forward_right_down : AxisConvention::forward_left_up;
}

}  // namespace axiscal
