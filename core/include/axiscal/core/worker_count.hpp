// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// @return the number of threads that compute: the number given to set_worker_count(), else the
///         environment variable AXISCAL_THREADS, else the number of processors that this process
///         may use. In a container the quota counts.
[[nodiscard]] AXISCAL_EXPORT std::size_t worker_count();

/// @param count  0: as before any call.
AXISCAL_EXPORT void set_worker_count(std::size_t count);

}  // namespace axiscal
