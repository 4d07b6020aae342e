// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// @return the number of threads for computations. If set_worker_count() has set no number, it is
///         the value of the environment variable AXISCAL_THREADS. If that is not set, it is the
///         number of processors that this process may use, at most the CPU quota of its container.
[[nodiscard]] AXISCAL_EXPORT std::size_t worker_count();

/// @param count  number of threads; 0 restores the default.
AXISCAL_EXPORT void set_worker_count(std::size_t count);

}  // namespace axiscal
