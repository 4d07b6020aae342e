// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "acquisition/src/decoder.hpp"
#include "axiscal/acquisition/source.hpp"

namespace axiscal {

/// Opens a recording in any format that LogFile reads. Options: speed (relative
/// to the original speed, or `max`), names, rate, time.
/// @throws DataError    if LogFile cannot read the recording.
/// @throws DomainError  if neither times nor a sample rate are known.
[[nodiscard]] std::unique_ptr<Source> open_file_source(const SourceAddress& address);

}  // namespace axiscal
