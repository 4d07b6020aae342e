// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

namespace axiscal {

/// Does `work(0) .. work(count - 1)` on the machine's cores, in any order, each once.
///
/// What the work gives must not depend on the order: then the result is the same, bit for bit, on
/// any number of cores. Of several exceptions that of the lowest number is thrown, after all
/// threads have ended.
///
/// @param threads  how many; 0: as many as there are cores. One thread, or one piece of work, runs
///                 in the caller's.
void for_each_in_parallel(std::size_t count,
                          const std::function<void(std::size_t)>& work,
                          std::size_t threads = 0);

}  // namespace axiscal
