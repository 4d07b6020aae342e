// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "axiscal/core/setting.hpp"

namespace axiscal {

/// The parts of an address SCHEME:PLACE?OPTION=VALUE&...
struct SourceAddress {
  std::string text;    ///< the whole address
  std::string scheme;  ///< empty for `-` and paths
  std::string place;   ///< the part between the scheme and `?`, without a leading `//`
  std::vector<std::pair<std::string, std::string>> options;

  [[nodiscard]] std::optional<std::string> find(std::string_view option) const;
  [[nodiscard]] std::string text_or(std::string_view option, const std::string& otherwise) const;

  /// @throws DomainError  for a value that is not a number, or outside the range.
  [[nodiscard]] double number_or(std::string_view option,
                                 double otherwise,
                                 double low,
                                 double high) const;
  /// @return true if the value is "1", "yes", "true" or empty; false if the option is missing.
  [[nodiscard]] bool flag(std::string_view option) const;
  /// @return the parts of a value A,B,..
  [[nodiscard]] std::vector<std::string> names(std::string_view option) const;

  /// @throws DomainError  always. The message is the address, a colon and the text in `what`.
  [[noreturn]] void fail(const std::string& what, std::vector<Setting> settings = {}) const;
};

/// @param schemes  the existing schemes. If another word is before the colon, the text is a path.
[[nodiscard]] SourceAddress parse_source_address(const std::string& text,
                                                 const std::vector<std::string>& schemes);

struct HostAndPort {
  std::string host;
  std::string port;
};

/// @return the host and port of a place HOST:PORT or [ADDRESS]:PORT.
/// @param usual_port  the port if the place does not contain one; may be empty.
/// @throws DomainError  if the port is invalid, or is missing and usual_port is empty.
[[nodiscard]] HostAndPort host_and_port(const SourceAddress& address,
                                        const std::string& usual_port = "");

}  // namespace axiscal
