// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace axiscal {

/// One limit and what came of it.
struct LimitVerdict {
  std::string parameter;
  double value = 0.0;
  double u = 0.0;           ///< standard uncertainty; NaN where there is none
  double guard_band = 0.0;  ///< how much the limits were narrowed
  std::optional<double> low;
  std::optional<double> high;
  bool passed = true;
  double conformity = 0.0;  ///< probability that the true value is within the limits; NaN: unknown
  std::string note;         ///< what the limit cannot mean; may be empty
};

/// Whether a unit is accepted.
struct Verdict {
  bool passed = true;
  std::string rule;  ///< "simple" or "guarded"
  std::vector<LimitVerdict> limits;
  std::vector<std::string> not_counted;  ///< in the uncertainties, in words
};

}  // namespace axiscal
