// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace axiscal {

/// Registers a file that remove_unfinished_output() must remove if a signal ends the program. Up to
/// 64 files can be registered at a time.
void register_unfinished_file(const std::string& path) noexcept;

/// Unregisters a file that has been deleted, or that is complete and must remain.
void unregister_unfinished_file(const std::string& path) noexcept;

}  // namespace axiscal
