// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "subcommand.hpp"

namespace axiscal::cli {

/// @return the output of `axiscal --version --verbose`: libraries with their versions, and programs
///         with their paths.
[[nodiscard]] std::string verbose_version(std::span<const Subcommand> subcommands);

}  // namespace axiscal::cli
