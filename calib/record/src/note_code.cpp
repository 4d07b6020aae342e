// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/note_code.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

namespace axiscal {
namespace {

// The names, in the order of the enumerators of NoteCode.
constexpr std::array<std::string_view, 24> note_names = {
    "input",       "imported",    "axes",       "unseen",        "method", "conditions",
    "correlation", "not_counted", "stated",     "rounding",      "seats",  "face_normals",
    "mount",       "temperature", "hysteresis", "drift",         "field",  "pose",
    "weights",     "tails",       "corrected",  "estimate_bias", "turns",  "other"};
static_assert(note_names.size() == static_cast<std::size_t>(NoteCode::other) + 1);

}  // namespace

std::string_view note_name(NoteCode code) {
  return note_names[static_cast<std::size_t>(code)];
}

std::optional<NoteCode> parse_note_code(std::string_view name) {
  const auto* const found = std::find(note_names.begin(), note_names.end(), name);
  return found == note_names.end()
             ? std::nullopt
             : std::optional(static_cast<NoteCode>(found - note_names.begin()));
}

}  // namespace axiscal
