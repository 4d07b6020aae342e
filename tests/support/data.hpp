// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

namespace axiscal::test {

/// @return the path of a file in AXISCAL_DATA_DIR; nullopt if there is no such file.
[[nodiscard]] std::optional<std::string> data_file(const std::string& name);

}  // namespace axiscal::test

/// Skips the test with a message if a file is missing in AXISCAL_DATA_DIR.
#define AXISCAL_NEED_DATA(variable, name)                                            \
  const std::optional<std::string> variable##_file = axiscal::test::data_file(name); \
  if (!variable##_file) {                                                            \
    GTEST_SKIP() << "no " << (name) << " in AXISCAL_DATA_DIR";                       \
  }                                                                                  \
  const std::string& variable = *variable##_file
