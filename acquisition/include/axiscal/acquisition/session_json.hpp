// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "axiscal/acquisition/session.hpp"

namespace axiscal {

/// @return a view as JSON in one line, for the page in the browser and for `--json`.
[[nodiscard]] std::string view_json(const SessionView& view);

/// @return an event as JSON in one line: {"event": "captured", "text": .., "time": .., "run": ..}.
[[nodiscard]] std::string event_json(const SessionEvent& event);

/// @param text  a command, such as "capture" or "retake 7".
/// @return nullopt if the text is not a command.
[[nodiscard]] std::optional<SessionCommand> parse_command(std::string_view text);

/// @return the possible commands in this phase, the most likely first.
[[nodiscard]] std::vector<SessionAction> possible_actions(const SessionView& view);

}  // namespace axiscal
