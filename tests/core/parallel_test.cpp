// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <functional>
#include <optional>
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

std::function<std::optional<std::function<int()>>()> numbers_to(int count, int failing = -1) {
  return [=, at = 0]() mutable -> std::optional<std::function<int()>> {
    if (at == count) {
      return std::nullopt;
    }
    return [=, number = at++] {
      if (number == failing) {
        throw std::runtime_error("failed");
      }
      return number;
    };
  };
}

TEST(ForEachInOrder, HandsOverWhatIsMadeInItsOrder) {
  for (const std::size_t threads : {0U, 1U, 2U, 7U}) {
    std::vector<int> taken;
    for_each_in_order<int>(
        numbers_to(100), [&](int number) { taken.push_back(number); }, threads);
    ASSERT_EQ(taken.size(), 100U);
    EXPECT_TRUE(std::is_sorted(taken.begin(), taken.end())) << threads;
  }
}

TEST(ForEachInOrder, ThrowsBehindWhatCameBefore) {
  for (const std::size_t threads : {1U, 3U}) {
    std::vector<int> taken;
    const auto take = [&](int number) { taken.push_back(number); };
    EXPECT_THROW(for_each_in_order<int>(numbers_to(100, 7), take, threads), std::runtime_error);
    EXPECT_EQ(taken.size(), 7U);
  }
}

}  // namespace
}  // namespace axiscal
