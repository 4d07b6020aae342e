// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace axiscal {

/// The session's page, embedded at build time; the script is empty where it was built without node.
[[nodiscard]] std::string_view acquire_page();
[[nodiscard]] std::string_view acquire_style();
[[nodiscard]] std::string_view acquire_script();

}  // namespace axiscal
