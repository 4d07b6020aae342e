// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "logs/recordings/src/read_budget.hpp"

namespace axiscal {

/// Unpacks a block of a bag: "bz2", "lz4" (a frame), "zstd".
/// @param size  of what comes out, as the file states it.
/// @return nothing where the block is damaged, or of another size.
/// @throws LimitError  if that is more than the file may cost.
/// @throws Error  for a packing that this build cannot unpack; the message says so.
[[nodiscard]] std::optional<std::string> unpack(std::string_view packing,
                                                std::string_view block,
                                                std::size_t size,
                                                const ReadBudget& budget);

/// The same where the size is not stated: a zstd frame that knows it itself.
[[nodiscard]] std::optional<std::string> unpack_zstd(std::string_view block,
                                                     const ReadBudget& budget);

}  // namespace axiscal
