// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "axiscal/acquisition/source.hpp"

namespace axiscal {

/// A kind of source and the form of its address.
struct SourceKind {
  std::string scheme;   ///< "serial", "tcp", ...
  std::string address;  ///< an example: "serial:/dev/ttyUSB0?baud=115200"
  std::string help;
  std::vector<std::string> options;  ///< names allowed after the question mark
  bool available = true;             ///< true if this build supports this kind of source
};

/// @return all kinds, in the order of the documentation.
[[nodiscard]] const std::vector<SourceKind>& source_kinds();

/// Opens a source by its address: SCHEME:PLACE?OPTION=VALUE&OPTION=VALUE.
///
/// `-` is standard input. A path without a scheme is a file. In an option, `%XX` is the byte with
/// the hexadecimal code XX. This function does not throw if a device is not connected; read() then
/// reports the problem and tries to connect again.
/// @throws DomainError  for an unknown scheme, option or value, or if this build does not support
///                      the scheme.
/// @throws DataError    for a file that is missing or malformed.
[[nodiscard]] std::unique_ptr<Source> open_source(const std::string& address);

/// A source that find_sources() found.
struct FoundSource {
  std::string address;      ///< argument for open_source()
  std::string description;  ///< text for a person, for example maker and model
};

/// Looks for serial ports, and for IIO devices on this machine and on the local network.
[[nodiscard]] std::vector<FoundSource> find_sources();

}  // namespace axiscal
