// SPDX-License-Identifier: Apache-2.0
#include "store/src/database.hpp"

namespace axiscal {

bool is_postgresql(const std::string& address) {
  return address.starts_with("postgresql://") || address.starts_with("postgres://");
}

std::string without_password(const std::string& address) {
  const std::size_t start = address.find("://");
  const std::size_t end = address.find('@');
  const std::size_t colon =
      start == std::string::npos ? std::string::npos : address.find(':', start + 3);
  if (!is_postgresql(address) || end == std::string::npos || colon >= end) {
    return address;
  }
  return address.substr(0, colon) + address.substr(end);
}

}  // namespace axiscal
