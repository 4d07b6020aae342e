// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/positioner/design.hpp"

namespace axiscal {

/// How a session was begun: the first line of its journal.
struct SessionHeader {
  std::string directory;               ///< where: its files are named from there
  std::vector<std::string> arguments;  ///< what was typed to begin it
  std::vector<RunSheetRow> sheet;      ///< one point or more; none of a free session
  bool free = false;                   ///< without a cube: FreeSession
  /// What is calibrated, and how, as experiment_json() writes it, so that a session goes on with it
  /// whatever becomes of the files that were named; empty in older journals.
  std::string experiment;
};

/// @return the line, with the time and this software's name.
[[nodiscard]] std::string session_header_line(const SessionHeader& header);

/// @param path  of the journal, for messages.
/// @throws DataError  for what is missing or no point of a cube.
[[nodiscard]] SessionHeader parse_session_header(const std::string& line, const std::string& path);

}  // namespace axiscal
