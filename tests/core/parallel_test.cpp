// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/parallel.hpp"

#include <atomic>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>

namespace axiscal {
namespace {

TEST(ForEachInParallel, DoesEachPieceOnce) {
  for (const std::size_t threads : {0U, 1U, 2U, 7U}) {
    std::vector<int> times(1000, 0);
    for_each_in_parallel(
        times.size(), [&](std::size_t i) { ++times[i]; }, threads);
    EXPECT_THAT(times, testing::Each(1)) << threads;
    for_each_in_parallel(
        0, [](std::size_t) { FAIL(); }, threads);
  }
}

TEST(ForEachInParallel, ThrowsTheErrorOfTheLowestNumber) {
  for (const std::size_t threads : {1U, 3U}) {
    std::atomic<int> done = 0;
    try {
      for_each_in_parallel(
          100,
          [&](std::size_t i) {
            ++done;
            if (i >= 5) {
              throw std::runtime_error(std::to_string(i));
            }
          },
          threads);
      FAIL() << "must throw";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "5");
    }
    EXPECT_LT(done, 20);
  }
}

}  // namespace
}  // namespace axiscal
