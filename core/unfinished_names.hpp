// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace axiscal {

/// Announces the path of a file that a signal which ends the program must remove. Up to 64 at once
/// are known to the handler: remove_unfinished_output().
void register_unfinished_file(const std::string& path) noexcept;

/// The file is gone, or is to stay.
void unregister_unfinished_file(const std::string& path) noexcept;

}  // namespace axiscal
