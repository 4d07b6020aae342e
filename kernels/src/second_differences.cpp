// SPDX-License-Identifier: Apache-2.0
#include "kernels/second_differences.hpp"

#ifdef AXISCAL_HIGHWAY
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "second_differences.cpp"
#include "kernels/src/vector_lanes.hpp"
//
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace axiscal {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Returns the sum of the first terms, as many as fill whole groups of four SIMD vectors. `done`
// receives the number of these terms.
double SumSquares(const double* x, std::size_t m, std::size_t count, std::size_t& done) {
  const hn::CappedTag<double, 8> lanes;
  using Double = hn::Vec<decltype(lanes)>;
  const std::size_t width = hn::Lanes(lanes);
  const auto square = [&](std::size_t i, Double sum) {
    const Double ends = hn::Add(hn::LoadU(lanes, x + i), hn::LoadU(lanes, x + i + 2 * m));
    const Double d = hn::NegMulAdd(hn::Set(lanes, 2.0), hn::LoadU(lanes, x + i + m), ends);
    return hn::MulAdd(d, d, sum);
  };
  Double a = hn::Zero(lanes);
  Double b = a;
  Double c = a;
  Double d = a;
  std::size_t i = 0;
  for (; i + 4 * width <= count; i += 4 * width) {
    a = square(i, a);
    b = square(i + width, b);
    c = square(i + 2 * width, c);
    d = square(i + 3 * width, d);
  }
  done = i;
  return hn::GetLane(hn::SumOfLanes(lanes, hn::Add(hn::Add(a, b), hn::Add(c, d))));
}

}  // namespace HWY_NAMESPACE
}  // namespace axiscal
HWY_AFTER_NAMESPACE();
#else
#define HWY_ONCE 1
#endif

#if HWY_ONCE
namespace axiscal {

double sum_of_squared_second_differences_plain(std::span<const double> x,
                                               std::size_t m,
                                               std::size_t first,
                                               std::size_t count) {
  double sum = 0.0;
  for (std::size_t i = first; i < first + count; ++i) {
    const double d = x[i + 2 * m] - 2.0 * x[i + m] + x[i];
    sum += d * d;
  }
  return sum;
}

#ifdef AXISCAL_HIGHWAY
AXISCAL_KERNEL(SumSquares);

double sum_of_squared_second_differences(std::span<const double> x,
                                         std::size_t m,
                                         std::size_t first,
                                         std::size_t count) {
  std::size_t done = 0;
  const double sum = AXISCAL_CALL(SumSquares)(x.data() + first, m, count, done);
  return sum + sum_of_squared_second_differences_plain(x, m, first + done, count - done);
}
#else
double sum_of_squared_second_differences(std::span<const double> x,
                                         std::size_t m,
                                         std::size_t first,
                                         std::size_t count) {
  return sum_of_squared_second_differences_plain(x, m, first, count);
}
#endif

}  // namespace axiscal
#endif
