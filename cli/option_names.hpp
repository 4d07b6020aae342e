// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/core/error.hpp"

namespace axiscal::cli {

/// @return the message of an error, followed in brackets by the options for the settings that would
///         remedy the error.
[[nodiscard]] std::string with_options(const Error& error);

}  // namespace axiscal::cli
