// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/rounded_value.hpp"

#include <algorithm>
#include <cmath>

#include "core/formatted.hpp"

namespace axiscal {

std::string rounded_value(double value, double uncertainty) {
  if (std::isnan(value)) {
    return "-";
  }
  if (!(uncertainty > 0.0) || !std::isfinite(uncertainty) || !std::isfinite(value)) {
    return formatted("{:.6g}", value);
  }
  constexpr std::size_t longest = 12;
  const int decimals = static_cast<int>(1.0 - std::floor(std::log10(uncertainty)));
  std::string fixed = formatted("{:.{}f}", value, std::clamp(decimals, 0, 17));
  if (decimals <= 8 && fixed.size() <= longest) {
    return fixed;
  }
  const double size = std::max(std::abs(value), uncertainty);
  const int digits = static_cast<int>(std::floor(std::log10(size))) + decimals;
  return formatted("{:.{}e}", value, std::clamp(digits, 1, 6));
}

std::string rounded_uncertainty(double uncertainty) {
  return std::isfinite(uncertainty) ? rounded_value(uncertainty, uncertainty) : "-";
}

}  // namespace axiscal
