// SPDX-License-Identifier: Apache-2.0
#include "axiscal/kernels/sliding_variance.hpp"

#include <algorithm>

#ifdef AXISCAL_HIGHWAY
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sliding_variance.cpp"
#include "vector_lanes.hpp"
//
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace axiscal {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<double, 8>;
using Double = hn::Vec<Lanes>;

// Running sums within a vector: lane i becomes the sum of the lanes 0 .. i.
class PrefixSum {
 public:
  PrefixSum() {
    const auto width = static_cast<std::int64_t>(hn::Lanes(lanes_));
    for (std::int64_t step = 1, s = 0; step < width; step *= 2, ++s) {
      for (std::int64_t i = 0; i < width; ++i) {
        from_[s][i] = std::max<std::int64_t>(i - step, 0);
      }
    }
    std::fill_n(last_, width, width - 1);
  }

  [[nodiscard]] Double operator()(Double v) const {
    std::size_t s = 0;
    for (std::size_t step = 1; step < hn::Lanes(lanes_); step *= 2, ++s) {
      const Double moved = hn::TableLookupLanes(v, hn::SetTableIndices(lanes_, from_[s]));
      const auto inside = hn::Ge(hn::Iota(lanes_, 0.0), hn::Set(lanes_, static_cast<double>(step)));
      v = hn::Add(v, hn::IfThenElseZero(inside, moved));
    }
    return v;
  }

  [[nodiscard]] Double last_everywhere(Double v) const {
    return hn::TableLookupLanes(v, hn::SetTableIndices(lanes_, last_));
  }

 private:
  Lanes lanes_;
  std::int64_t from_[3][8] = {};
  std::int64_t last_[8] = {};
};

// Windows that start at first .. first + count - 1, added to `joined`; count is a multiple of the
// lanes. The window after the last must exist too.
void AddBlock(const double* x, std::size_t window, std::size_t count, double* joined) {
  const Lanes lanes;
  const PrefixSum prefix;
  const double about = x[0];
  double sum = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < window; ++i) {
    sum += x[i] - about;
    squares += (x[i] - about) * (x[i] - about);
  }
  Double carried_sum = hn::Set(lanes, sum);
  Double carried_squares = hn::Set(lanes, squares);
  const auto w = static_cast<double>(window);
  const Double centre = hn::Set(lanes, about);
  const Double per_window = hn::Set(lanes, 1.0 / w);
  const Double per_rest = hn::Set(lanes, 1.0 / (w - 1.0));
  for (std::size_t i = 0; i < count; i += hn::Lanes(lanes)) {
    const Double out = hn::Sub(hn::LoadU(lanes, x + i), centre);
    const Double in = hn::Sub(hn::LoadU(lanes, x + i + window), centre);
    const Double change = hn::Sub(in, out);
    const Double change_of_squares = hn::Mul(change, hn::Add(in, out));
    const Double sums = hn::Add(carried_sum, prefix(change));
    const Double sums_of_squares = hn::Add(carried_squares, prefix(change_of_squares));
    const Double s = hn::Sub(sums, change);  // without what this step brings
    const Double q = hn::Sub(sums_of_squares, change_of_squares);
    const Double variance = hn::Mul(hn::NegMulAdd(hn::Mul(s, s), per_window, q), per_rest);
    hn::StoreU(hn::MulAdd(variance, variance, hn::LoadU(lanes, joined + i)), lanes, joined + i);
    carried_sum = prefix.last_everywhere(sums);
    carried_squares = prefix.last_everywhere(sums_of_squares);
  }
}

// @return how many windows were done, from the first.
std::size_t SlideVariance(std::span<const std::span<const double>> columns,
                          std::size_t window,
                          std::span<double> joined) {
  constexpr std::size_t block = 8192;
  const std::size_t width = hn::Lanes(Lanes());
  const std::size_t whole = (joined.size() - 1) / width * width;
  for (std::size_t first = 0; first < whole; first += block) {
    const std::size_t count = std::min(block, whole - first);
    std::fill_n(joined.begin() + static_cast<std::ptrdiff_t>(first), count, 0.0);
    for (const std::span<const double> column : columns) {
      AddBlock(column.data() + first, window, count, joined.data() + first);
    }
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
HWY_EXPORT(SlideVariance);

void joined_sliding_variance(std::span<const std::span<const double>> columns,
                             std::size_t window,
                             std::span<double> joined) {
  if (joined.empty()) {
    return;
  }
  const std::size_t done = HWY_DYNAMIC_DISPATCH(SlideVariance)(columns, window, joined);
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
