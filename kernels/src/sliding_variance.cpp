// SPDX-License-Identifier: Apache-2.0
#include "kernels/sliding_variance.hpp"

#include <algorithm>
#include <vector>

#ifdef AXISCAL_HIGHWAY
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sliding_variance.cpp"
#include "kernels/src/vector_lanes.hpp"
//
#include <hwy/foreach_target.h>
//
#include <hwy/cache_control.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace axiscal {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Four stretches of a column are processed at the same time, one in each lane, because the running
// sums of a single stretch depend on each other. The changes from window to window are computed
// along each stretch, then interleaved so that each stretch has one lane.
constexpr std::size_t stretches = 4;
using Lanes = hn::CappedTag<double, stretches>;
using Double = hn::Vec<Lanes>;
constexpr std::size_t tile = stretches * hn::MaxLanes(Lanes());

// The running sums of one window in each stretch. The summed values are the differences of the
// samples from the first sample of the stretch.
struct RunningSums {
  RunningSums(const double* column, std::size_t length, std::size_t window, std::size_t prefetched)
      : ahead(prefetched) {
    for (std::size_t l = 0; l < stretches; ++l) {
      x[l] = column + l * length;
      for (std::size_t i = 0; i < window; ++i) {
        const double value = x[l][i] - x[l][0];
        sum[l] += value;
        squares[l] += value * value;
      }
    }
  }

  // Distance, in samples, from the current sample to the one to prefetch, which is in the next
  // block; 0 if there is no next block.
  std::size_t ahead;
  const double* x[stretches] = {};
  double sum[stretches] = {};
  double squares[stretches] = {};
};

// Computes the squared variances of the windows that start at i, i + 1, .., i + lanes - 1 in each
// stretch, and adds them to `total`. Entry 4 j + l of `total` belongs to stretch l and the window
// at i + j. Then updates the running sums for the next windows.
HWY_INLINE void AddTile(RunningSums& of, std::size_t i, std::size_t window, double* total) {
  const Lanes lanes;
  const auto w = static_cast<double>(window);
  const Double per_window = hn::Set(lanes, 1.0 / w);
  const Double per_rest = hn::Set(lanes, 1.0 / (w - 1.0));
  Double change[stretches];
  Double change_of_squares[stretches];
  for (std::size_t l = 0; l < stretches; ++l) {
    hwy::Prefetch(of.x[l] + i + of.ahead);
    const Double centre = hn::Set(lanes, of.x[l][0]);
    const Double out = hn::Sub(hn::LoadU(lanes, of.x[l] + i), centre);
    const Double in = hn::Sub(hn::LoadU(lanes, of.x[l] + i + window), centre);
    change[l] = hn::Sub(in, out);
    change_of_squares[l] = hn::Mul(change[l], hn::Add(in, out));
  }
  HWY_ALIGN double by_step[2][tile];
  hn::StoreInterleaved4(change[0], change[1], change[2], change[3], lanes, by_step[0]);
  hn::StoreInterleaved4(change_of_squares[0], change_of_squares[1], change_of_squares[2],
                        change_of_squares[3], lanes, by_step[1]);
  for (std::size_t l = 0; l < stretches; l += hn::Lanes(lanes)) {
    Double sum = hn::LoadU(lanes, of.sum + l);
    Double squares = hn::LoadU(lanes, of.squares + l);
    for (std::size_t at = l; at < stretches * hn::Lanes(lanes); at += stretches) {
      const Double variance =
          hn::Mul(hn::NegMulAdd(hn::Mul(sum, sum), per_window, squares), per_rest);
      hn::Store(hn::MulAdd(variance, variance, hn::Load(lanes, total + at)), lanes, total + at);
      sum = hn::Add(sum, hn::Load(lanes, by_step[0] + at));
      squares = hn::Add(squares, hn::Load(lanes, by_step[1] + at));
    }
    hn::StoreU(sum, lanes, of.sum + l);
    hn::StoreU(squares, lanes, of.squares + l);
  }
}

// Computes the windows that start at the first 4 * length samples. `length` must be a multiple of
// the number of lanes, and the window after the last one must exist.
void SlideBlock(std::vector<RunningSums>& columns,
                std::size_t length,
                std::size_t window,
                double* joined) {
  const Lanes lanes;
  for (std::size_t i = 0; i < length; i += hn::Lanes(lanes)) {
    HWY_ALIGN double total[tile] = {};
    for (RunningSums& column : columns) {
      AddTile(column, i, window, total);
    }
    Double of[stretches];
    hn::LoadInterleaved4(lanes, total, of[0], of[1], of[2], of[3]);
    for (std::size_t l = 0; l < stretches; ++l) {
      hn::StoreU(of[l], lanes, joined + l * length + i);
    }
  }
}

// @return the number of windows that were computed, counted from the first window.
std::size_t SlideVariance(std::span<const std::span<const double>> columns,
                          std::size_t window,
                          std::span<double> joined) {
  // The running sums are computed anew for each block. With stretches of 2040 samples, the samples
  // that are read at the same time are in different cache sets.
  constexpr std::size_t block = stretches * 2040;
  const std::size_t whole = (joined.size() - 1) / tile * tile;
  for (std::size_t first = 0; first < whole; first += block) {
    const std::size_t length = std::min(block, whole - first) / stretches;
    const std::size_t ahead = first + 2 * block <= whole ? block : 0;
    std::vector<RunningSums> sums;
    for (const std::span<const double> column : columns) {
      sums.emplace_back(&column[first], length, window, ahead);
    }
    SlideBlock(sums, length, window, &joined[first]);
  }
  return whole;
}

}  // namespace HWY_NAMESPACE
}  // namespace axiscal
HWY_AFTER_NAMESPACE();
#else
#define HWY_ONCE 1
#endif

#if HWY_ONCE
namespace axiscal {
namespace {

double variance_of(std::span<const double> x) {
  double mean = 0.0;
  for (const double value : x) {
    mean += (value - x[0]) / static_cast<double>(x.size());
  }
  double squares = 0.0;
  for (const double value : x) {
    squares += (value - x[0] - mean) * (value - x[0] - mean);
  }
  return squares / static_cast<double>(x.size() - 1);
}

}  // namespace

void joined_sliding_variance_plain(std::span<const std::span<const double>> columns,
                                   std::size_t window,
                                   std::span<double> joined) {
  std::fill(joined.begin(), joined.end(), 0.0);
  for (const std::span<const double> column : columns) {
    for (std::size_t i = 0; i < joined.size(); ++i) {
      const double variance = variance_of(column.subspan(i, window));
      joined[i] += variance * variance;
    }
  }
}

#ifdef AXISCAL_HIGHWAY
AXISCAL_KERNEL(SlideVariance);

void joined_sliding_variance(std::span<const std::span<const double>> columns,
                             std::size_t window,
                             std::span<double> joined) {
  if (joined.empty()) {
    return;
  }
  const std::size_t done = AXISCAL_CALL(SlideVariance)(columns, window, joined);
  std::span<double> rest = joined.subspan(done);
  std::fill(rest.begin(), rest.end(), 0.0);
  for (const std::span<const double> column : columns) {
    for (std::size_t i = 0; i < rest.size(); ++i) {
      const double variance = variance_of(column.subspan(done + i, window));
      rest[i] += variance * variance;
    }
  }
}
#else
void joined_sliding_variance(std::span<const std::span<const double>> columns,
                             std::size_t window,
                             std::span<double> joined) {
  joined_sliding_variance_plain(columns, window, joined);
}
#endif

}  // namespace axiscal
#endif
