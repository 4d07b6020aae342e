// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/positioner/design.hpp"

namespace axiscal {

/// The start of a session: the first line of its journal.
struct SessionHeader {
  std::string directory;               ///< where: its files are named from there
  std::vector<std::string> arguments;  ///< the command line
  std::vector<RunSheetRow> sheet;      ///< one point or more; none of a free session
  bool free = false;                   ///< without a cube: FreeSession
  /// The experiment in the form of experiment_json(), so that a session can be resumed even if the
  /// named files have changed; empty in older journals.
  std::string experiment;
};

/// @return the line, with the time and this software's name.
[[nodiscard]] std::string session_header_line(const SessionHeader& header);

/// @param path  of the journal, for messages.
/// @throws DataError  for a missing member or an invalid design point.
[[nodiscard]] SessionHeader parse_session_header(const std::string& line, const std::string& path);

}  // namespace axiscal
