// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace axiscal {

/// The files of the session's page, embedded at build time. The script is empty if the build did
/// not have node.
[[nodiscard]] std::string_view acquire_page();
[[nodiscard]] std::string_view acquire_style();
[[nodiscard]] std::string_view acquire_script();

}  // namespace axiscal
