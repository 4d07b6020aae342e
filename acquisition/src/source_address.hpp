// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "axiscal/core/setting.hpp"

namespace axiscal {

/// An address in its parts: SCHEME:PLACE?OPTION=VALUE&...
struct SourceAddress {
  std::string text;    ///< as given
  std::string scheme;  ///< empty for `-` and paths
  std::string place;   ///< without leading slashes after `SCHEME:` where it is host and port
  std::vector<std::pair<std::string, std::string>> options;

  [[nodiscard]] std::optional<std::string> find(std::string_view option) const;
  [[nodiscard]] std::string text_or(std::string_view option, const std::string& otherwise) const;

  /// @throws DomainError  for a value that is not a number, or outside the range.
  [[nodiscard]] double number_or(std::string_view option,
                                 double otherwise,
                                 double low,
                                 double high) const;
  [[nodiscard]] bool flag(std::string_view option) const;  ///< "1", "yes", "true" or nothing
  [[nodiscard]] std::vector<std::string> names(std::string_view option) const;  ///< A,B,..

  /// @throws DomainError  `ADDRESS: what`.
  [[noreturn]] void fail(const std::string& what, std::vector<Setting> settings = {}) const;
};

/// @param schemes  that there are; another word before a colon makes a path.
[[nodiscard]] SourceAddress parse_source_address(const std::string& text,
                                                 const std::vector<std::string>& schemes);

struct HostAndPort {
  std::string host;
  std::string port;
};

/// @return the place as HOST:PORT, [ADDRESS]:PORT; the port may be missing where one is usual.
/// @throws DomainError  if the port is missing and the scheme lacks a default.
[[nodiscard]] HostAndPort host_and_port(const SourceAddress& address,
                                        const std::string& usual_port = "");

}  // namespace axiscal
