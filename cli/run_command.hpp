// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace axiscal::cli {

/// Runs the command: `axiscal ARGUMENT..`. Messages go to stderr.
/// @return its exit status, as docs/messages.md lists them.
[[nodiscard]] int run_command(const std::vector<std::string>& arguments);

}  // namespace axiscal::cli
