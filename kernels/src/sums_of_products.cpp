// SPDX-License-Identifier: Apache-2.0
#include "kernels/sums_of_products.hpp"

#include <algorithm>

#ifdef AXISCAL_HIGHWAY
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sums_of_products.cpp"
#include "kernels/src/vector_lanes.hpp"
//
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace axiscal {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// The range of the rows that are summed. Its length is a multiple of the number of lanes.
struct RowRange {
  std::size_t first;
  std::size_t end;
};

// Adds the products of one column with three other columns.
void ByThree(
    const double* x, const double* const* others, RowRange rows, std::size_t p, double* products) {
  const hn::CappedTag<double, 8> lanes;
  auto a = hn::Zero(lanes);
  auto b = a;
  auto c = a;
  for (std::size_t i = rows.first; i < rows.end; i += hn::Lanes(lanes)) {
    const auto own = hn::LoadU(lanes, x + i);
    a = hn::MulAdd(own, hn::LoadU(lanes, others[0] + i), a);
    b = hn::MulAdd(own, hn::LoadU(lanes, others[1] + i), b);
    c = hn::MulAdd(own, hn::LoadU(lanes, others[2] + i), c);
  }
  products[0] += hn::GetLane(hn::SumOfLanes(lanes, a));
  products[p] += hn::GetLane(hn::SumOfLanes(lanes, b));
  products[2 * p] += hn::GetLane(hn::SumOfLanes(lanes, c));
}

// Adds the products of three columns with three others: nine sums from six loads for each vector of
// rows.
void ThreeByThree(const double* const* x,
                  const double* const* others,
                  RowRange rows,
                  std::size_t p,
                  double* products) {
  const hn::CappedTag<double, 8> lanes;
  auto a0 = hn::Zero(lanes);
  auto a1 = a0;
  auto a2 = a0;
  auto b0 = a0;
  auto b1 = a0;
  auto b2 = a0;
  auto c0 = a0;
  auto c1 = a0;
  auto c2 = a0;
  for (std::size_t i = rows.first; i < rows.end; i += hn::Lanes(lanes)) {
    const auto x0 = hn::LoadU(lanes, x[0] + i);
    const auto x1 = hn::LoadU(lanes, x[1] + i);
    const auto x2 = hn::LoadU(lanes, x[2] + i);
    const auto a = hn::LoadU(lanes, others[0] + i);
    a0 = hn::MulAdd(x0, a, a0);
    a1 = hn::MulAdd(x1, a, a1);
    a2 = hn::MulAdd(x2, a, a2);
    const auto b = hn::LoadU(lanes, others[1] + i);
    b0 = hn::MulAdd(x0, b, b0);
    b1 = hn::MulAdd(x1, b, b1);
    b2 = hn::MulAdd(x2, b, b2);
    const auto c = hn::LoadU(lanes, others[2] + i);
    c0 = hn::MulAdd(x0, c, c0);
    c1 = hn::MulAdd(x1, c, c1);
    c2 = hn::MulAdd(x2, c, c2);
  }
  const auto put = [&](std::size_t row, std::size_t column, auto sum) {
    products[row + p * column] += hn::GetLane(hn::SumOfLanes(lanes, sum));
  };
  put(0, 0, a0);
  put(1, 0, a1);
  put(2, 0, a2);
  put(0, 1, b0);
  put(1, 1, b1);
  put(2, 1, b2);
  put(0, 2, c0);
  put(1, 2, c1);
  put(2, 2, c2);
}

// Adds the products of the rows `first` to `end` to the p x p products, but omits the last rows
// that do not fill a vector. Only the blocks of 3 x 3 products on and below the diagonal are
// computed.
// @return the end of the rows that were added.
std::size_t AddProducts(const double* const* columns,
                        std::size_t p,
                        std::size_t first,
                        std::size_t end,
                        double* products) {
  const hn::CappedTag<double, 8> lanes;
  const RowRange rows{first, end - (end - first) % hn::Lanes(lanes)};
  for (std::size_t j = 0; j < p; j += 3) {
    const bool is_whole = j + 3 <= p;
    for (std::size_t k = j; k < p;) {
      double* const to = products + k + p * j;
      if (is_whole && k + 3 <= p) {
        ThreeByThree(columns + k, columns + j, rows, p, to);
        k += 3;
      } else if (is_whole) {
        ByThree(columns[k], columns + j, rows, p, to);
        ++k;
      } else {
        for (std::size_t l = j; l <= k; ++l) {
          auto sum = hn::Zero(lanes);
          for (std::size_t i = rows.first; i < rows.end; i += hn::Lanes(lanes)) {
            sum =
                hn::MulAdd(hn::LoadU(lanes, columns[k] + i), hn::LoadU(lanes, columns[l] + i), sum);
          }
          products[k + p * l] += hn::GetLane(hn::SumOfLanes(lanes, sum));
        }
        ++k;
      }
    }
  }
  return rows.end;
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

void add_products(std::span<const double* const> columns,
                  std::size_t first,
                  std::size_t end,
                  double* products) {
  const std::size_t p = columns.size();
  for (std::size_t j = 0; j < p; ++j) {
    for (std::size_t k = j; k < p; ++k) {
      double sum = 0.0;
      for (std::size_t i = first; i < end; ++i) {
        sum += columns[k][i] * columns[j][i];
      }
      products[k + p * j] += sum;
    }
  }
}

}  // namespace

void sums_of_products_plain(std::span<const double* const> columns,
                            std::size_t n,
                            double* products) {
  std::fill_n(products, columns.size() * columns.size(), 0.0);
  add_products(columns, 0, n, products);
}

#ifdef AXISCAL_HIGHWAY
AXISCAL_KERNEL(AddProducts);

void sums_of_products(std::span<const double* const> columns, std::size_t n, double* products) {
  std::fill_n(products, columns.size() * columns.size(), 0.0);
  // Number of rows in a block. A few columns of this length fit into the cache.
  constexpr std::size_t block = 1024;
  for (std::size_t first = 0; first < n; first += block) {
    const std::size_t end = std::min(n, first + block);
    const std::size_t done =
        AXISCAL_CALL(AddProducts)(columns.data(), columns.size(), first, end, products);
    add_products(columns, done, end, products);
  }
}
#else
void sums_of_products(std::span<const double* const> columns, std::size_t n, double* products) {
  sums_of_products_plain(columns, n, products);
}
#endif

}  // namespace axiscal
#endif
