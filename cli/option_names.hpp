// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/core/error.hpp"

namespace axiscal::cli {

/// @return the message of an error, with the options for its settings in brackets.
[[nodiscard]] std::string with_options(const Error& error);

}  // namespace axiscal::cli
