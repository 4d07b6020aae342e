// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "acquisition/src/byte_link.hpp"
#include "acquisition/src/source_address.hpp"
#include "axiscal/acquisition/open_source.hpp"

namespace axiscal {

/// Opens a multimeter or scanner that uses SCPI over TCP. Options: channels, names, range, nplc,
/// resistor, setup, read, rate.
[[nodiscard]] std::unique_ptr<Source> open_scpi_source(const SourceAddress& address);

/// Opens a Linux IIO device by libiio, local or on the network. Options: device, channels, names,
/// rate, buffer, poll.
/// @throws DomainError  if this build lacks libiio.
[[nodiscard]] std::unique_ptr<Source> open_iio_source(const SourceAddress& address);
[[nodiscard]] bool has_iio() noexcept;
[[nodiscard]] std::vector<FoundSource> find_iio_devices();

/// Opens a link that receives the messages of an MQTT broker, by libmosquitto. Options: user,
/// password-file, qos, ca, and those of the decoder and the clock.
/// @throws DomainError  if this build lacks libmosquitto.
[[nodiscard]] std::unique_ptr<ByteLink> open_mqtt(const SourceAddress& address);
[[nodiscard]] bool has_mqtt() noexcept;

}  // namespace axiscal
