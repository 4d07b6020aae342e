// SPDX-License-Identifier: Apache-2.0
#include "axiscal/instruments/instrument.hpp"

#include <string_view>

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

}  // namespace axiscal
