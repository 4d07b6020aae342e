// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/core/error.hpp"

namespace axiscal::cli {

/// An error's message, and in brackets the options that would mend it.
[[nodiscard]] std::string with_options(const Error& error);

}  // namespace axiscal::cli
