// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/positioner/design.hpp"

namespace axiscal {

/// The content of the first line of a session's journal.
struct SessionHeader {
  std::string directory;               ///< working directory; file names are relative to it
  std::vector<std::string> arguments;  ///< arguments of the command line
  std::vector<RunSheetRow> sheet;      ///< one point or more; empty for a FreeSession
  bool free = false;                   ///< true for a FreeSession
  /// The experiment in the form of experiment_json(), so that a session can be resumed even if the
  /// named files have changed; empty in older journals.
  std::string experiment;
};

/// @return the header as one line of JSON, with the current time and the software's name.
[[nodiscard]] std::string session_header_line(const SessionHeader& header);

/// @param path  the journal's file name, for messages.
/// @throws DataError  for a missing member or an invalid design point.
[[nodiscard]] SessionHeader parse_session_header(const std::string& line, const std::string& path);

}  // namespace axiscal
