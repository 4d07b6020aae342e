// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "subcommand.hpp"

namespace axiscal::cli {

/// @return the answer to `axiscal --version --verbose`: libraries with their versions, and programs
///         with their places.
[[nodiscard]] std::string verbose_version(std::span<const Subcommand> subcommands);

}  // namespace axiscal::cli
