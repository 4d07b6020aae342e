// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace axiscal {

/// The result of comparing one parameter with its limits.
struct LimitVerdict {
  std::string parameter;
  double value = 0.0;
  double u = 0.0;           ///< standard uncertainty; NaN if unknown
  double guard_band = 0.0;  ///< amount by which both limits are narrowed
  std::optional<double> low;
  std::optional<double> high;
  bool passed = true;
  double conformity = 0.0;  ///< probability that the true value is within the limits; NaN: unknown
  std::string note;         ///< restriction of the verdict's meaning; may be empty
};

/// The decision to accept a unit.
struct Verdict {
  bool passed = true;
  std::string rule;  ///< "simple" or "guarded"
  std::vector<LimitVerdict> limits;
  std::vector<std::string> not_counted;  ///< inputs that the uncertainties do not include
};

}  // namespace axiscal
