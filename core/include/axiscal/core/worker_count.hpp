// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// @return the number of threads for computations: the number given to set_worker_count(), else the
///         environment variable AXISCAL_THREADS, else the number of processors that this process
///         may use, at most the CPU quota of its container.
[[nodiscard]] AXISCAL_EXPORT std::size_t worker_count();

/// @param count  number of threads; 0 restores the default.
AXISCAL_EXPORT void set_worker_count(std::size_t count);

}  // namespace axiscal
