// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <system_error>
#include <unistd.h>

#include "allocations.hpp"
#include "axiscal/core/worker_count.hpp"

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

// If the system cannot start threads, the calling thread does all the work.
TEST(ForEachInParallel, NeedsNoThreads) {
#if defined(__SANITIZE_THREAD__) || AXISCAL_HAS_FEATURE(thread_sanitizer)
  GTEST_SKIP() << "the thread sanitizer needs more memory than is left";
#endif
  if (test::under_address_sanitizer) {
    GTEST_SKIP() << "the address sanitizer needs more memory than is left";
  }
  const auto without_threads = [] {
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const rlim_t little = pages * static_cast<std::size_t>(getpagesize()) + (1U << 20U);
    const rlimit limit{.rlim_cur = little, .rlim_max = little};
    setrlimit(RLIMIT_AS, &limit);  // too little for another thread's stack
    bool refused = false;
    try {
      std::thread([] {}).join();
    } catch (const std::system_error&) {
      refused = true;
    }
    std::atomic<int> sum = 0;
    for_each_in_parallel(
        4, [&](std::size_t i) { sum += static_cast<int>(i); }, 4);
    sum += begin_work([] { return 10; }).get();
    std::_Exit(refused && sum == 16 ? 0 : 1);
  };
  GTEST_FLAG_SET(death_test_style, "threadsafe");  // in a new process without other threads
  EXPECT_EXIT(without_threads(), testing::ExitedWithCode(0), "");
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

TEST(ForEachInOrder, HandsOverWhatIsUnderWayWhereNoMoreCanBeHad) {
  for (const std::size_t threads : {1U, 2U, 7U}) {
    std::vector<int> taken;
    const auto take = [&](int number) { taken.push_back(number); };
    const auto failing = [numbers = numbers_to(10), count = 0]() mutable {
      if (count++ == 5) {
        throw std::logic_error("no more");
      }
      return numbers();
    };
    EXPECT_THROW(for_each_in_order<int>(failing, take, threads), std::logic_error);
    EXPECT_EQ(taken.size(), 5U) << threads;
    taken.clear();
    const auto both = [numbers = numbers_to(10, 3), count = 0]() mutable {
      if (count++ == 5) {
        throw std::logic_error("no more");
      }
      return numbers();
    };
    EXPECT_THROW(for_each_in_order<int>(both, take, threads), std::runtime_error);
    EXPECT_EQ(taken.size(), 3U) << threads;
  }
}

TEST(WorkerCount, IsStatedOrThatOfTheMachine) {
  const std::size_t found = worker_count();
  EXPECT_GE(found, 1U);
  EXPECT_LE(found, std::max(std::thread::hardware_concurrency(), 1U));
  set_worker_count(5);
  EXPECT_EQ(worker_count(), 5U);
  set_worker_count(0);
  EXPECT_EQ(worker_count(), found);
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
