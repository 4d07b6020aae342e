// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <future>
#include <optional>
#include <type_traits>
#include <utility>

#include <system_error>

#include "axiscal/core/export.hpp"
#include "axiscal/core/worker_count.hpp"

namespace axiscal {

/// Starts `work` on a new thread. If no thread is available or `worth_a_thread` is false, the work
/// runs in the thread that calls get() of the result.
template <typename Work>
[[nodiscard]] std::future<std::invoke_result_t<Work>> begin_work(Work work,
                                                                 bool worth_a_thread = true) {
  if (worth_a_thread) {
    try {
      return std::async(std::launch::async, work);
    } catch (const std::system_error&) {  // no more threads are available
    }
  }
  return std::async(std::launch::deferred, std::move(work));
}

/// Calls each of work(0) .. work(count - 1) once, on several threads, in any order.
///
/// The result of the work must not depend on the order. The results are then identical for any
/// number of threads. If several calls throw, the exception of the call with the lowest number is
/// thrown after all threads have ended.
///
/// @param threads  number of threads; 0: worker_count(). With one thread, with one piece of work,
///                 or if the system refuses a thread, the work runs in the caller's thread.
AXISCAL_EXPORT void for_each_in_parallel(std::size_t count,
                                         const std::function<void(std::size_t)>& work,
                                         std::size_t threads = 0);

/// Computes the pieces of a stream in parallel and delivers them in order. Only a few pieces are in
/// progress at a time, so the memory use is limited.
///
/// @param next     returns the work for the next piece, or nullopt at the end. It is called in
///                 order by the caller's thread.
/// @param take     receives the pieces in order, in the caller's thread.
/// @param threads  number of threads; 0: worker_count(). With one thread, all work runs in the
///                 caller's thread.
/// @throws the exception of the first piece that fails. An exception of next() is thrown after all
///         earlier pieces are delivered. All threads have ended before anything is thrown.
template <typename Piece>
void for_each_in_order(const std::function<std::optional<std::function<Piece()>>()>& next,
                       const std::function<void(Piece)>& take,
                       std::size_t threads = 0) {
  const std::size_t cores = threads > 0 ? threads : worker_count();
  std::deque<std::future<Piece>> under_way;
  const auto hand_over = [&] {
    Piece piece = under_way.front().get();
    under_way.pop_front();
    take(std::move(piece));
  };
  std::exception_ptr failure;  // exception of next(); thrown after all earlier pieces are delivered
  const auto next_work = [&]() -> std::optional<std::function<Piece()>> {
    try {
      return next();
    } catch (...) {
      failure = std::current_exception();
      return std::nullopt;
    }
  };
  while (std::optional<std::function<Piece()>> work = next_work()) {
    if (cores <= 1) {
      take((*work)());
      continue;
    }
    under_way.push_back(begin_work(*std::move(work)));
    if (under_way.size() > cores) {
      hand_over();
    }
  }
  while (!under_way.empty()) {
    hand_over();
  }
  if (failure) {
    std::rethrow_exception(failure);
  }
}

}  // namespace axiscal
