// SPDX-License-Identifier: Apache-2.0
#include "axiscal/kernels/repeated_fit.hpp"

#ifdef AXISCAL_HIGHWAY
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "repeated_fit.cpp"
#include "kernels/src/vector_lanes.hpp"
//
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace axiscal {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Fits `vectors` vectors of responses at a time, one response in each lane. The four estimates of
// each response stay in registers. The sums of different vectors are independent, so that the
// processor computes them at the same time.
template <std::size_t vectors>
void FitBlock(const RepeatedDesign& design,
              const double* responses,
              std::size_t m,
              double* estimates,
              double* rss) {
  const hn::CappedTag<double, 8> lanes;
  using Double = hn::Vec<decltype(lanes)>;
  const std::size_t width = hn::Lanes(lanes);
  const std::size_t n = design.readings;
  const double* const P = design.pseudo_inverse.data();
  Double b[4][vectors];
  for (auto& row : b) {
    for (Double& value : row) {
      value = hn::Zero(lanes);
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t v = 0; v < vectors; ++v) {
      const Double y = hn::LoadU(lanes, responses + i * m + v * width);
      for (std::size_t j = 0; j < 4; ++j) {
        b[j][v] = hn::MulAdd(hn::Set(lanes, P[j * n + i]), y, b[j][v]);
      }
    }
  }
  Double sum[vectors];
  for (Double& value : sum) {
    value = hn::Zero(lanes);
  }
  for (std::size_t i = 0; i < n; ++i) {
    const double* const x = &design.design[4 * i];
    for (std::size_t v = 0; v < vectors; ++v) {
      Double r = hn::LoadU(lanes, responses + i * m + v * width);
      for (std::size_t j = 0; j < 4; ++j) {
        r = hn::NegMulAdd(hn::Set(lanes, x[j]), b[j][v], r);
      }
      sum[v] = hn::MulAdd(r, r, sum[v]);
    }
  }
  for (std::size_t v = 0; v < vectors; ++v) {
    for (std::size_t j = 0; j < 4; ++j) {
      hn::StoreU(b[j][v], lanes, estimates + j * m + v * width);
    }
    hn::StoreU(sum[v], lanes, rss + v * width);
  }
}

// @return the number of responses that were fitted, counted from the first response.
std::size_t FitFour(const RepeatedDesign& design,
                    std::span<const double> responses,
                    std::span<double> estimates,
                    std::span<double> rss) {
  const std::size_t width = hn::Lanes(hn::CappedTag<double, 8>());
  const std::size_t m = rss.size();
  std::size_t u = 0;
  for (; u + 4 * width <= m; u += 4 * width) {
    FitBlock<4>(design, &responses[u], m, &estimates[u], &rss[u]);
  }
  for (; u + width <= m; u += width) {
    FitBlock<1>(design, &responses[u], m, &estimates[u], &rss[u]);
  }
  return u;
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

void fit_from(const RepeatedDesign& design,
              std::span<const double> responses,
              std::span<double> estimates,
              std::span<double> rss,
              std::size_t first) {
  const std::size_t n = design.readings;
  const std::size_t p = design.parameters;
  const std::size_t m = rss.size();
  for (std::size_t u = first; u < m; ++u) {
    for (std::size_t j = 0; j < p; ++j) {
      double b = 0.0;
      for (std::size_t i = 0; i < n; ++i) {
        b += design.pseudo_inverse[j * n + i] * responses[i * m + u];
      }
      estimates[j * m + u] = b;
    }
    double sum = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      double r = responses[i * m + u];
      for (std::size_t j = 0; j < p; ++j) {
        r -= design.design[i * p + j] * estimates[j * m + u];
      }
      sum += r * r;
    }
    rss[u] = sum;
  }
}

}  // namespace

void fit_repeatedly_plain(const RepeatedDesign& design,
                          std::span<const double> responses,
                          std::span<double> estimates,
                          std::span<double> rss) {
  fit_from(design, responses, estimates, rss, 0);
}

#ifdef AXISCAL_HIGHWAY
AXISCAL_KERNEL(FitFour);

void fit_repeatedly(const RepeatedDesign& design,
                    std::span<const double> responses,
                    std::span<double> estimates,
                    std::span<double> rss) {
  const std::size_t done =
      design.parameters == 4 ? AXISCAL_CALL(FitFour)(design, responses, estimates, rss) : 0;
  fit_from(design, responses, estimates, rss, done);
}
#else
void fit_repeatedly(const RepeatedDesign& design,
                    std::span<const double> responses,
                    std::span<double> estimates,
                    std::span<double> rss) {
  fit_repeatedly_plain(design, responses, estimates, rss);
}
#endif

}  // namespace axiscal
#endif
