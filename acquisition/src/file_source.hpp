// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "acquisition/src/decoder.hpp"
#include "axiscal/acquisition/source.hpp"

namespace axiscal {

/// A recording of any format that LogFile reads. Options: speed (of the replay; max), names, rate,
/// time.
/// @throws DataError    as LogFile.
/// @throws DomainError  where neither times nor a rate are known.
[[nodiscard]] std::unique_ptr<Source> open_file_source(const SourceAddress& address);

}  // namespace axiscal
