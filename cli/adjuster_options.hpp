// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "axiscal/positioner/surface.hpp"

namespace axiscal::cli {

/// Replaces the adjusters of a table (its levelling screws) and their thread pitch by the values of
/// --adjusters and --thread-pitch.
/// @throws UsageError  if the adjusters are missing, or cannot level a table.
void set_adjusters(const std::optional<std::string>& adjusters,
                   const std::optional<std::string>& thread_pitch,
                   Surface& surface);

}  // namespace axiscal::cli
