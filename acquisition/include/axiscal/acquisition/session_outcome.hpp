// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// The result of a session for one instrument, for its faces.
struct SessionOutcome {
  std::string slot;                            ///< of an assembly; empty for one instrument
  std::string status;                          ///< "ok", "warning", "refused"
  std::string verdict;                         ///< in a sentence
  std::vector<std::string> head;               ///< "axis", "bias [V]", "Sx [V/g]", ...
  std::vector<std::vector<std::string>> rows;  ///< the axis, then "0.01196 \u00b1 0.00027", ...
};

[[nodiscard]] SessionOutcome outcome_of(const Calibration& calibration);

/// A file that a session leaves, as a page offers it.
struct SessionFile {
  std::string name;   ///< "cal.html", without its folder
  std::string label;  ///< "Report"
  std::string type;   ///< "text/html; charset=utf-8"
  std::string body;
};

}  // namespace axiscal
