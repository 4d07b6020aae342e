// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

namespace axiscal::test {

/// @return path of a file in AXISCAL_DATA_DIR, or nothing where it is not there.
[[nodiscard]] std::optional<std::string> data_file(const std::string& name);

}  // namespace axiscal::test

/// Skips the test, saying why, where a file of AXISCAL_DATA_DIR is missing.
#define AXISCAL_NEED_DATA(variable, name)                                            \
  const std::optional<std::string> variable##_file = axiscal::test::data_file(name); \
  if (!variable##_file) {                                                            \
    GTEST_SKIP() << "no " << (name) << " in AXISCAL_DATA_DIR";                       \
  }                                                                                  \
  const std::string& variable = *variable##_file
