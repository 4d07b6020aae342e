// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>

namespace axiscal {

/// Writes all bytes; a signal does not end it early.
/// @return false if they cannot all be written; errno says why.
[[nodiscard]] bool write_all(int descriptor, std::string_view bytes) noexcept;

/// Brings the names of a folder's files to the disk. Some file systems cannot do it.
void sync_folder(const std::filesystem::path& folder) noexcept;

}  // namespace axiscal
