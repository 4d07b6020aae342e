// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include <system_error>

#include "axiscal/core/worker_count.hpp"

namespace axiscal {
namespace {

// A set of threads. The destructor waits until they end. (libc++ 14 lacks std::jthread.)
class JoinedThreads {
 public:
  JoinedThreads() = default;
  JoinedThreads(const JoinedThreads&) = delete;
  JoinedThreads& operator=(const JoinedThreads&) = delete;
  ~JoinedThreads() {
    for (std::thread& thread : threads_) {
      thread.join();
    }
  }

  // @return false if no thread is available.
  bool start(const std::function<void()>& work) {
    try {
      threads_.emplace_back(work);
      return true;
    } catch (const std::system_error&) {
      return false;
    }
  }

 private:
  std::vector<std::thread> threads_;
};

}  // namespace

void for_each_in_parallel(std::size_t count,
                          const std::function<void(std::size_t)>& work,
                          std::size_t threads) {
  const std::size_t cores = threads > 0 ? threads : worker_count();
  const std::size_t used = std::min(std::max<std::size_t>(cores, 1), count);
  if (used <= 1) {
    for (std::size_t i = 0; i < count; ++i) {
      work(i);
    }
    return;
  }
  std::atomic<std::size_t> next = 0;
  std::mutex mutex;
  std::exception_ptr error;
  std::size_t error_at = count;
  const auto run = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      try {
        work(i);
      } catch (...) {
        const std::scoped_lock lock(mutex);
        if (i < error_at) {
          error_at = i;
          error = std::current_exception();
        }
        next = count;  // starts no further work; all lower indices have already started
      }
    }
  };
  {
    JoinedThreads pool;
    for (std::size_t t = 1; t < used && pool.start(run); ++t) {
    }
    run();
  }
  if (error) {
    std::rethrow_exception(error);
  }
}

}  // namespace axiscal
