// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// @return how many threads compute: the number that set_worker_count() was given, else that of the
///         environment variable AXISCAL_THREADS, else the processors that this process may use. The
///         processors of a container are those of its quota.
[[nodiscard]] AXISCAL_EXPORT std::size_t worker_count();

/// @param count  0: as before any call.
AXISCAL_EXPORT void set_worker_count(std::size_t count);

}  // namespace axiscal
