// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/kept_memory.hpp"

#include <cstdlib>  // defines __GLIBC__

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace axiscal {

void keep_freed_memory() {
#if defined(__GLIBC__)
  constexpr int largest_piece = 8 << 20;
  constexpr int most = 64 << 20;
  ::mallopt(M_MMAP_THRESHOLD, largest_piece);
  ::mallopt(M_TRIM_THRESHOLD, most);
#endif
}

}  // namespace axiscal
