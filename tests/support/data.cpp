// SPDX-License-Identifier: Apache-2.0
#include "data.hpp"

#include <filesystem>

namespace axiscal::test {

std::optional<std::string> data_file(const std::string& name) {
  const std::filesystem::path path = std::filesystem::path(AXISCAL_DATA_DIR) / name;
  if (std::string(AXISCAL_DATA_DIR).empty() || !std::filesystem::exists(path)) {
    return std::nullopt;
  }
  return path.string();
}

}  // namespace axiscal::test
