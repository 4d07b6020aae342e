// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>

#include "acquisition/src/source_address.hpp"
#include "axiscal/acquisition/source.hpp"

namespace axiscal {

/// The condition of a link after a read.
struct LinkReport {
  LinkState state = LinkState::open;
  std::string message;
  bool reopened = false;  ///< true if the next bytes do not continue the earlier ones
};

/// A stream of bytes from a port, a socket or a pipe. A lost link reopens itself.
class ByteLink {
 public:
  ByteLink() = default;
  virtual ~ByteLink() = default;
  ByteLink(const ByteLink&) = delete;
  ByteLink& operator=(const ByteLink&) = delete;

  /// Waits for bytes, at most for `patience`, and appends them to `bytes`.
  virtual LinkReport read(std::string& bytes, std::chrono::milliseconds patience) = 0;

  /// Sends a text. @return false if the link is not open or breaks.
  virtual bool write(std::string_view text);

  /// @return true if the first bytes may begin in the middle of a line, as at a serial port.
  [[nodiscard]] virtual bool joins_midway() const { return false; }

  /// @return true if each read is one message, as for datagrams.
  [[nodiscard]] virtual bool has_messages() const { return false; }
};

[[nodiscard]] std::unique_ptr<ByteLink> open_serial(const SourceAddress& address);
[[nodiscard]] std::unique_ptr<ByteLink> open_tcp_client(const SourceAddress& address,
                                                        const std::string& usual_port = "");
[[nodiscard]] std::unique_ptr<ByteLink> open_tcp_server(const SourceAddress& address);
[[nodiscard]] std::unique_ptr<ByteLink> open_udp(const SourceAddress& address);
[[nodiscard]] std::unique_ptr<ByteLink> open_standard_input();

}  // namespace axiscal
