// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/source_address.hpp"

#include <algorithm>
#include <charconv>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

std::string without_escapes(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned byte = 0;
    if (text[i] == '%' && i + 2 < text.size() &&
        std::from_chars(text.data() + i + 1, text.data() + i + 3, byte, 16).ptr ==
            text.data() + i + 3) {
      plain += static_cast<char>(byte);
      i += 2;
    } else {
      plain += text[i];
    }
  }
  return plain;
}

}  // namespace

std::optional<std::string> SourceAddress::find(std::string_view option) const {
  for (const auto& [name, value] : options) {
    if (name == option) {
      return value;
    }
  }
  return {};
}

std::string SourceAddress::text_or(std::string_view option, const std::string& otherwise) const {
  return find(option).value_or(otherwise);
}

double SourceAddress::number_or(std::string_view option,
                                double otherwise,
                                double low,
                                double high) const {
  const std::optional<std::string> value = find(option);
  if (!value) {
    return otherwise;
  }
  const std::optional<double> number = parse_number(*value);
  if (!number || !(*number >= low && *number <= high)) {
    fail(formatted("{}={}: expected a number from {} to {}", option, *value, number_text(low),
                   number_text(high)));
  }
  return *number;
}

bool SourceAddress::flag(std::string_view option) const {
  const std::string value = text_or(option, "no");
  return value.empty() || value == "1" || value == "yes" || value == "true";
}

std::vector<std::string> SourceAddress::names(std::string_view option) const {
  std::vector<std::string> result;
  const std::string value = text_or(option, "");
  if (!value.empty()) {
    for (const std::string_view name : split(value, ',')) {
      result.emplace_back(name);
    }
  }
  return result;
}

void SourceAddress::fail(const std::string& what, std::vector<Setting> settings) const {
  throw DomainError(formatted("{}: {}", text, what), std::move(settings));
}

SourceAddress parse_source_address(const std::string& text,
                                   const std::vector<std::string>& schemes) {
  SourceAddress address{.text = text, .scheme = "", .place = text, .options = {}};
  const std::size_t colon = text.find(':');
  if (colon != std::string::npos &&
      std::find(schemes.begin(), schemes.end(), text.substr(0, colon)) != schemes.end()) {
    address.scheme = text.substr(0, colon);
    address.place = text.substr(colon + 1);
  }
  const std::size_t question = address.place.find('?');
  if (question != std::string::npos) {
    const std::string rest = address.place.substr(question + 1);
    address.place.resize(question);
    for (std::size_t at = 0; at < rest.size();) {
      const std::size_t end = std::min(rest.find('&', at), rest.size());
      const std::string_view one = std::string_view(rest).substr(at, end - at);
      const std::size_t equals = one.find('=');
      if (!one.empty()) {
        address.options.emplace_back(
            without_escapes(one.substr(0, equals)),
            equals == std::string_view::npos ? "" : without_escapes(one.substr(equals + 1)));
      }
      at = end + 1;
    }
  }
  if (address.place.starts_with("//")) {
    address.place.erase(0, 2);
  }
  return address;
}

HostAndPort host_and_port(const SourceAddress& address, const std::string& usual_port) {
  const std::string& place = address.place;
  const std::size_t bracket = place.find(']');
  const std::size_t colon = place.find(':', bracket == std::string::npos ? 0 : bracket);
  HostAndPort result{.host = place.substr(0, colon),
                     .port = colon == std::string::npos ? usual_port : place.substr(colon + 1)};
  if (result.host.starts_with('[') && result.host.ends_with(']')) {
    result.host = result.host.substr(1, result.host.size() - 2);
  }
  const std::optional<int> port = parse_integer(result.port);
  if (!port || *port < 0 || *port > 65535) {
    address.fail("expected HOST:PORT");
  }
  return result;
}

}  // namespace axiscal
