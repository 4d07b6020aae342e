// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "axiscal/acquisition/source.hpp"

namespace axiscal {

/// A kind of source, and how its address is written.
struct SourceKind {
  std::string scheme;   ///< "serial", "tcp", ...
  std::string address;  ///< "serial:/dev/ttyUSB0?baud=115200"
  std::string help;
  std::vector<std::string> options;  ///< that may stand behind the question mark
  bool available = true;             ///< whether this build has it
};

/// @return all kinds, in the order of the documentation.
[[nodiscard]] const std::vector<SourceKind>& source_kinds();

/// Opens a source by its address: SCHEME:PLACE?OPTION=VALUE&OPTION=VALUE.
///
/// `-` is standard input. A path without a scheme is a file. The code `%XX` in an option is a byte.
/// A missing source is not an error: read() reports it and keeps trying.
/// @throws DomainError  for an unknown scheme, option or value, or one that this build has not.
/// @throws DataError    for a file that is missing or malformed.
[[nodiscard]] std::unique_ptr<Source> open_source(const std::string& address);

/// Something that is connected to this machine.
struct FoundSource {
  std::string address;      ///< as open_source() takes it
  std::string description;  ///< maker, model
};

/// Looks for serial ports, IIO devices and devices that announce themselves on the local network.
[[nodiscard]] std::vector<FoundSource> find_sources();

}  // namespace axiscal
