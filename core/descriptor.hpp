// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>

namespace axiscal {

/// Writes all bytes, even if signals interrupt the write.
/// @return false if the bytes cannot all be written; errno is then set.
[[nodiscard]] bool write_all(int descriptor, std::string_view bytes) noexcept;

/// Writes a folder's directory entries to the disk by fsync(). Errors are ignored, because some
/// file systems do not support it.
void sync_folder(const std::filesystem::path& folder) noexcept;

}  // namespace axiscal
