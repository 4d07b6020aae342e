// SPDX-License-Identifier: Apache-2.0
// Readings at the start of each series that differ from the later ones.
#include "calib/regression/settling.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "axiscal/core/random.hpp"

namespace axiscal {
namespace {

constexpr Eigen::Index of_series = 8;
constexpr Eigen::Index count = 12;

std::vector<ReadingSeries> some_series() {
  std::vector<ReadingSeries> series;
  for (Eigen::Index s = 0; s < count; ++s) {
    series.push_back({.first = of_series * s, .readings = of_series});
  }
  return series;
}

// Readings of three axes: noise of standard deviation 1, which may be correlated, a level for each
// series, and a transient that halves from reading to reading.
Eigen::MatrixXd readings(std::uint32_t seed, double transient, bool alternating, double ar = 0.0) {
  RandomStream random(seed, 0);
  Eigen::MatrixXd response(of_series * count, 3);
  for (Eigen::Index k = 0; k < 3; ++k) {
    double noise = random.normal();
    for (Eigen::Index i = 0; i < response.rows(); ++i) {
      const double sign = alternating && (i / of_series) % 2 == 1 ? -1.0 : 1.0;
      noise = ar * noise + std::sqrt(1.0 - ar * ar) * random.normal();
      response(i, k) = 100.0 * static_cast<double>(i / of_series) + noise +
                       sign * transient * std::exp2(-static_cast<double>(i % of_series));
    }
  }
  return response;
}

TEST(UnsettledStart, IsNotFoundInNoise) {
  for (const double ar : {0.0, 0.8}) {
    int found = 0;
    constexpr int trials = 1000;
    for (std::uint32_t seed = 1; seed <= trials; ++seed) {
      found += find_unsettled_start(readings(seed, 0.0, false, ar), some_series()).readings > 0;
    }
    EXPECT_LE(found, 5) << ar;
  }
}

TEST(UnsettledStart, IsLeftOutUntilTheReadingsAgree) {
  for (const bool alternating : {false, true}) {
    for (std::uint32_t seed = 1; seed <= 50; ++seed) {
      const UnsettledStart start =
          find_unsettled_start(readings(seed, 20.0, alternating), some_series());
      // The transient of reading 2 is 5 times the noise, that of reading 6 is 0.3 times.
      EXPECT_GE(start.readings, 2) << seed;
      EXPECT_LE(start.readings, 6) << seed;
      EXPECT_NEAR(start.largest, 20.0, 7.0) << seed;
    }
  }
}

// A transient with the same sign in all series is followed further than one that alternates.
TEST(UnsettledStart, FollowsACommonTransientFurther) {
  Eigen::Index common = 0;
  Eigen::Index alternating = 0;
  for (std::uint32_t seed = 1; seed <= 50; ++seed) {
    common += find_unsettled_start(readings(seed, 20.0, false), some_series()).readings;
    alternating += find_unsettled_start(readings(seed, 20.0, true), some_series()).readings;
  }
  EXPECT_GT(common, alternating);
}

}  // namespace
}  // namespace axiscal
