// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// The result of a session for one instrument, as the user interfaces display it.
struct SessionOutcome {
  std::string slot;                            ///< slot in an assembly; empty if there is none
  std::string status;                          ///< "ok", "warning", "refused"
  std::string verdict;                         ///< one sentence
  std::vector<std::string> head;               ///< column titles: "axis", "bias [V]", "Sx [V/g]"
  std::vector<std::vector<std::string>> rows;  ///< the axis, then "0.01196 \u00b1 0.00027", ...
};

[[nodiscard]] SessionOutcome outcome_of(const Calibration& calibration);

/// An output file of a session, which the web page offers for download.
struct SessionFile {
  std::string name;   ///< "cal.html", without its folder
  std::string label;  ///< "Report"
  std::string type;   ///< "text/html; charset=utf-8"
  std::string body;
};

}  // namespace axiscal
