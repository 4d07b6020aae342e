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

/// Begins work on a thread of its own. Where none can be had, or the work is not worth one, who
/// asks for what it gives does it.
template <typename Work>
[[nodiscard]] std::future<std::invoke_result_t<Work>> begin_work(Work work,
                                                                 bool worth_a_thread = true) {
  if (worth_a_thread) {
    try {
      return std::async(std::launch::async, work);
    } catch (const std::system_error&) {  // the machine gives no more
    }
  }
  return std::async(std::launch::deferred, std::move(work));
}

/// Does `work(0) .. work(count - 1)` on the machine's cores, in any order, each once.
///
/// What the work gives must not depend on the order: then the result is the same, bit for bit, on
/// any number of cores. Of several exceptions that of the lowest number is thrown, after all
/// threads have ended.
///
/// @param threads  how many; 0: worker_count(). One thread, or one piece of work, runs
///                 in the caller's; so does all where the machine gives no more of them.
AXISCAL_EXPORT void for_each_in_parallel(std::size_t count,
                                         const std::function<void(std::size_t)>& work,
                                         std::size_t threads = 0);

/// Makes pieces of what goes on and on, on the machine's cores, and hands them over in their order.
/// A few are under way at a time: memory stays what it is.
///
/// @param next     gives the work for the next piece, or nothing at the end; in order, by the
///                 caller's thread.
/// @param take     takes the pieces, in order, by the caller's thread.
/// @param threads  how many; 0: worker_count(). With one all is done in the caller's.
/// @throws what the work of the first piece that fails throws, and behind all pieces what next()
///         does; after all threads have ended.
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
  std::exception_ptr failure;  // of next(), behind what is under way
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
