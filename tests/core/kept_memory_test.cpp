// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/kept_memory.hpp"

#include <cstddef>
#include <cstdlib>
#include <vector>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "allocations.hpp"

namespace axiscal {
namespace {

long page_faults() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_minflt;
}

// Allocates and frees six blocks of 1 MiB, like the matrices of a fit.
void take_and_free() {
  constexpr std::size_t bytes = std::size_t{1} << 20U;
  std::vector<std::vector<std::byte>> pieces;
  for (int i = 0; i < 6; ++i) {
    pieces.emplace_back(bytes, std::byte{1});
  }
}

TEST(KeptMemory, IsNotAskedForAnew) {
#if !defined(__GLIBC__) || defined(__SANITIZE_THREAD__) || AXISCAL_HAS_FEATURE(thread_sanitizer)
  GTEST_SKIP() << "only glibc's memory is kept";
#endif
  if (test::under_address_sanitizer) {
    GTEST_SKIP() << "the address sanitizer takes memory of its own";
  }
  keep_freed_memory();
  take_and_free();
  const long before = page_faults();
  for (int i = 0; i < 20; ++i) {
    take_and_free();
  }
  EXPECT_LT(page_faults() - before, 1000);  // 1500 for each call otherwise
}

}  // namespace
}  // namespace axiscal
