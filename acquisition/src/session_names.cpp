// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "axiscal/acquisition/session.hpp"

namespace axiscal {
namespace {

// The names, in the order of the enumerators of SessionAction and SessionPhase.
constexpr std::array<std::string_view, 13> action_names = {
    "capture",   "accept", "as-seen", "retake", "retake-suggested", "undo", "skip",
    "replicate", "pause",  "go-on",   "finish", "automatic",        "quit"};
constexpr std::array<std::string_view, 11> phase_names = {
    "waiting",  "soaking", "laying", "settling", "dwelling", "ready",
    "question", "storing", "paused", "review",   "over"};

}  // namespace

std::string_view action_name(SessionAction action) {
  return action_names[static_cast<std::size_t>(action)];
}

std::optional<SessionAction> parse_action(std::string_view name) {
  for (std::size_t i = 0; i < action_names.size(); ++i) {
    if (action_names[i] == name) {
      return static_cast<SessionAction>(i);
    }
  }
  return {};
}

std::string_view phase_name(SessionPhase phase) {
  return phase_names[static_cast<std::size_t>(phase)];
}

}  // namespace axiscal
