// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/error.hpp"

#include "axiscal/core/version.hpp"

namespace axiscal {
namespace {

constexpr std::string_view version_text = AXISCAL_VERSION_TEXT;
static_assert(version_text.size() == 5 && version_text[0] == '0' + AXISCAL_VERSION_MAJOR &&
                  version_text[2] == '0' + AXISCAL_VERSION_MINOR &&
                  version_text[4] == '0' + AXISCAL_VERSION_PATCH,
              "core/version.hpp and CMake's project() must contain the same version");

}  // namespace

DataError::DataError(std::string_view path, std::string_view what, std::vector<Setting> settings)
    : Error(std::string(path) + ": " + std::string(what), std::move(settings)) {}

DataError::DataError(std::string_view path, std::size_t line, std::string_view what)
    : Error(std::string(path) + ":" + std::to_string(line) + ": " + std::string(what)) {}

DataError::DataError(std::string_view path, std::string_view pointer, std::string_view what)
    : Error(std::string(path) + ": " + (pointer.empty() ? "/" : std::string(pointer)) + ": " +
            std::string(what)) {}

std::string_view software_name() {
  return "axiscal " AXISCAL_VERSION_TEXT;
}

}  // namespace axiscal
