// SPDX-License-Identifier: Apache-2.0
// Each vector kernel is compared with its scalar version, for every instruction set of this
// machine.
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include <gmock/gmock.h>

#include "axiscal/core/random.hpp"
#include "axiscal/kernels/reduce_columns.hpp"
#include "axiscal/kernels/repeated_fit.hpp"
#include "kernels/ellipsoid_rows.hpp"
#include "kernels/instruction_set.hpp"
#include "kernels/regression_trials.hpp"
#include "kernels/second_differences.hpp"
#include "kernels/sliding_variance.hpp"
#include "kernels/sums_of_products.hpp"
#include "kernels/turn_integration.hpp"

namespace axiscal {
namespace {

class Kernels : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(use_instruction_set(GetParam())); }
  void TearDown() override { use_instruction_set(""); }
};

INSTANTIATE_TEST_SUITE_P(On, Kernels, testing::ValuesIn(instruction_sets()), [](const auto& set) {
  return set.param;
});

std::vector<double> normals(std::size_t count, std::uint64_t seed, double mean = 0.0) {
  RandomStream random(seed);
  std::vector<double> values(count);
  for (double& value : values) {
    value = mean + random.normal();
  }
  return values;
}

TEST(InstructionSet, IsOneOfThoseThatThereAre) {
  EXPECT_THAT(instruction_sets(), testing::Contains(instruction_set()));
  EXPECT_FALSE(use_instruction_set("Z80"));
  EXPECT_TRUE(use_instruction_set(""));
}

// ---- Monte Carlo ----

RegressionTrials twelve_points() {
  RegressionTrials trials{.at = {.readings = 12, .parameters = 4}, .responses = 3};
  trials.at.pseudo_inverse.resize(48);
  for (std::size_t i = 0; i < 12; ++i) {
    const std::array<double, 3> f = {i < 4 ? (i < 2 ? -1.0 : 1.0) : 0.0,
                                     i >= 4 && i < 8 ? (i < 6 ? -1.0 : 1.0) : 0.0,
                                     i >= 8 ? (i < 10 ? -1.0 : 1.0) : 0.0};
    trials.at.design.push_back(1.0);
    trials.at.pseudo_inverse[i] = 1.0 / 12.0;
    for (std::size_t j = 0; j < 3; ++j) {
      trials.at.design.push_back(f[j]);
      trials.at.pseudo_inverse[12 * (j + 1) + i] = f[j] / 4.0;
    }
  }
  trials.unscaled_variance = {1.0 / 12.0, 0.25, 0.25, 0.25};
  trials.truth = {0.1, 1.0, 0.02, 0.0, 0.2, 0.0, 1.0, 0.01, 0.3, 0.0, 0.0, -1.0};
  trials.noise_sd = {1e-3, 2e-3, 3e-3};
  trials.coverage_factor = 2.306004135033371;  // t with 8 degrees of freedom
  return trials;
}

TEST_P(Kernels, RegressionTrialsAreThoseOfThePlainTwin) {
  const RegressionTrials trials = twelve_points();
  for (const std::size_t count : {1U, 7U, 8U, 1001U}) {
    const auto plain = run_regression_trials_plain(trials, 5, 3, count);
    const auto lanes = run_regression_trials(trials, 5, 3, count);
    ASSERT_EQ(lanes.size(), 12U);
    for (std::size_t q = 0; q < 12; ++q) {
      EXPECT_NEAR(lanes[q].error, plain[q].error, 1e-11 * std::sqrt(plain[q].error_squared));
      EXPECT_NEAR(lanes[q].error_squared / plain[q].error_squared, 1.0, 1e-11);
      EXPECT_NEAR(lanes[q].u_squared / plain[q].u_squared, 1.0, 1e-11);
      EXPECT_EQ(lanes[q].covered, plain[q].covered);
    }
  }
}

TEST_P(Kernels, RegressionTrialsHaveTheVariancesAndCoverageOfTheory) {
  const RegressionTrials trials = twelve_points();
  std::vector<RegressionTrialSums> all(12);
  constexpr std::uint64_t blocks = 50;
  for (std::uint64_t block = 0; block < blocks; ++block) {
    const auto sums = run_regression_trials(trials, 11, block, regression_trials_block);
    for (std::size_t q = 0; q < 12; ++q) {
      all[q].error_squared += sums[q].error_squared;
      all[q].u_squared += sums[q].u_squared;
      all[q].covered += sums[q].covered;
    }
  }
  const double n = static_cast<double>(blocks * regression_trials_block);
  for (std::size_t q = 0; q < 12; ++q) {
    const double variance = std::pow(trials.noise_sd[q / 4], 2) * trials.unscaled_variance[q % 4];
    EXPECT_NEAR(all[q].error_squared / n / variance, 1.0, 5.0 * std::sqrt(2.0 / n));
    EXPECT_NEAR(all[q].u_squared / n / variance, 1.0, 5.0 * std::sqrt(2.0 / 8.0 / n));
    EXPECT_NEAR(all[q].covered / n, 0.95, 5.0 * std::sqrt(0.95 * 0.05 / n));
  }
}

TEST_P(Kernels, NormalsAreNormalAndThoseOfThePlainTwin) {
  std::vector<double> lanes(1U << 21U);
  std::vector<double> plain(lanes.size());
  fill_normals(1, 2, lanes);
  fill_normals_plain(1, 2, plain);
  const auto n = static_cast<double>(lanes.size());
  double largest = 0.0;
  double mean = 0.0;
  double square = 0.0;
  double fourth = 0.0;
  double beyond_3 = 0.0;
  double beyond_4 = 0.0;
  for (std::size_t i = 0; i < lanes.size(); ++i) {
    const double z = lanes[i];
    largest = std::max(largest, std::abs(z - plain[i]));
    mean += z / n;
    square += z * z / n;
    fourth += z * z * z * z / n;
    beyond_3 += std::abs(z) > 3.0 ? 1.0 / n : 0.0;
    beyond_4 += std::abs(z) > 4.0 ? 1.0 / n : 0.0;
  }
  EXPECT_LT(largest, 1e-13);
  EXPECT_NEAR(mean, 0.0, 5.0 / std::sqrt(n));
  EXPECT_NEAR(square, 1.0, 5.0 * std::sqrt(2.0 / n));
  EXPECT_NEAR(fourth, 3.0, 5.0 * std::sqrt(96.0 / n));
  EXPECT_NEAR(beyond_3, 0.0026998, 5.0 * std::sqrt(0.0027 / n));
  EXPECT_NEAR(beyond_4, 6.334e-5, 5.0 * std::sqrt(6.334e-5 / n));
}

// The reference numbers of xoshiro256plusplus.c (Blackman and Vigna) need its state, and ours is
// seeded by splitmix64. So the test checks that blocks and seeds differ.
TEST_P(Kernels, BlocksAndSeedsHaveNothingInCommon) {
  constexpr std::size_t n = 4096;
  std::vector<std::vector<double>> all(4, std::vector<double>(n));
  fill_normals(1, 0, all[0]);
  fill_normals(1, 1, all[1]);
  fill_normals(2, 0, all[2]);
  fill_normals(0, 1, all[3]);
  for (std::size_t a = 0; a < all.size(); ++a) {
    for (std::size_t b = a + 1; b < all.size(); ++b) {
      const double sum = std::inner_product(all[a].begin(), all[a].end(), all[b].begin(), 0.0);
      EXPECT_LT(std::abs(sum), 5.0 * std::sqrt(double{n}));
    }
  }
}

TEST_P(Kernels, FitRepeatedlyAsThePlainTwin) {
  const RegressionTrials twelve = twelve_points();
  for (const std::size_t p : {4U, 2U}) {
    RepeatedDesign design{.readings = 12, .parameters = p};
    for (std::size_t i = 0; i < 12; ++i) {
      for (std::size_t j = 0; j < p; ++j) {
        design.design.push_back(twelve.at.design[4 * i + j]);
      }
    }
    design.pseudo_inverse.assign(
        twelve.at.pseudo_inverse.begin(),
        twelve.at.pseudo_inverse.begin() + static_cast<std::ptrdiff_t>(12 * p));
    for (const std::size_t m : {0U, 1U, 8U, 21U}) {
      const std::vector<double> y = normals(12 * m, 3 + m);
      std::vector<double> b(p * m), plain_b(p * m), rss(m), plain_rss(m);
      fit_repeatedly(design, y, b, rss);
      fit_repeatedly_plain(design, y, plain_b, plain_rss);
      for (std::size_t k = 0; k < p * m; ++k) {
        EXPECT_NEAR(b[k], plain_b[k], 1e-15);
      }
      for (std::size_t u = 0; u < m; ++u) {
        EXPECT_NEAR(rss[u], plain_rss[u], 1e-13);
      }
    }
  }
}

// ---- reduction ----

struct Columns {
  explicit Columns(std::size_t rows) : x(rows), y(rows), z(rows) {}
  [[nodiscard]] ReadColumns read() const { return {x, y, z}; }
  [[nodiscard]] WrittenColumns written() { return {x, y, z}; }
  std::vector<double> x, y, z;
};

ColumnReduction some_reduction() {
  return {.bias = {0.1, -0.2, 0.3},
          .inverse = {1.01, 0.02, -0.03, 0.01, 0.98, 0.02, 0.0, -0.01, 1.1},
          .magnitude = 1.0};
}

Columns some_readings(std::size_t rows) {
  Columns v(rows);
  v.x = normals(rows, 1);
  v.y = normals(rows, 2);
  v.z = normals(rows, 3);
  for (std::size_t i = 0; i < rows; ++i) {
    const double length = std::hypot(v.x[i], v.y[i], v.z[i]);
    v.x[i] /= length;
    v.y[i] /= length;
    v.z[i] /= length;
  }
  return v;
}

TEST_P(Kernels, ReduceAsThePlainTwin) {
  for (const std::size_t rows : {0U, 1U, 7U, 8U, 9U, 1000U}) {
    const Columns v = some_readings(rows);
    Columns plain(rows);
    Columns lanes(rows);
    std::vector<double> pitch(rows), roll(rows), plain_pitch(rows), plain_roll(rows);
    const ColumnReduction reduction = some_reduction();
    reduce_columns_plain(reduction, v.read(), plain.written());
    add_angles_plain(reduction, plain.read(), {plain_pitch, plain_roll});
    reduce_columns(reduction, v.read(), lanes.written(), {pitch, roll});
    Columns in_place = v;
    reduce_columns(reduction, in_place.read(), in_place.written());
    std::vector<double> by_rows;
    for (std::size_t i = 0; i < rows; ++i) {
      by_rows.insert(by_rows.end(), {v.x[i], v.y[i], v.z[i]});
    }
    reduce_rows(reduction, by_rows, by_rows);
    for (std::size_t i = 0; i < rows; ++i) {
      EXPECT_NEAR(lanes.x[i], plain.x[i], 1e-15);
      EXPECT_NEAR(lanes.y[i], plain.y[i], 1e-15);
      EXPECT_NEAR(lanes.z[i], plain.z[i], 1e-15);
      EXPECT_EQ(in_place.y[i], lanes.y[i]);
      EXPECT_NEAR(by_rows[3 * i + 2], plain.z[i], 1e-15);
      // Near its ends asin is steep. The tolerance allows for an error in the last digit of f_x.
      const double steep = 1.0 / std::sqrt(std::max(1e-9, 1.0 - plain.x[i] * plain.x[i]));
      EXPECT_NEAR(pitch[i], plain_pitch[i], 2e-15 * steep);
      EXPECT_NEAR(roll[i], plain_roll[i], 3e-15 / std::hypot(plain.y[i], plain.z[i]));
    }
  }
}

TEST_P(Kernels, ReduceAlsoWhereTheCachesAreTooSmall) {
  constexpr std::size_t rows = (1U << 20U) + 3;
  const Columns v = some_readings(rows);
  Columns plain(rows);
  // Aligned outputs are written past the caches. Others are written in the usual way.
  for (const std::size_t shift : {0U, 1U}) {
    std::vector<double> room(3 * (rows + 16));
    std::array<std::span<double>, 3> out;
    for (std::size_t j = 0; j < 3; ++j) {
      double* at = &room[j * (rows + 16)];
      while (reinterpret_cast<std::uintptr_t>(at) % 64 != 0) {
        ++at;
      }
      out[j] = std::span<double>(at + shift, rows);
    }
    reduce_columns_plain(some_reduction(), v.read(), plain.written());
    reduce_columns(some_reduction(), v.read(), out);
    double largest = 0.0;
    for (std::size_t i = 0; i < rows; ++i) {
      largest = std::max({largest, std::abs(out[0][i] - plain.x[i]),
                          std::abs(out[1][i] - plain.y[i]), std::abs(out[2][i] - plain.z[i])});
    }
    EXPECT_LT(largest, 1e-15);
  }
}

TEST_P(Kernels, AnglesAtThePolesBeyondThemAndWithoutANumber) {
  const ColumnReduction same{.inverse = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Columns v(10);
  v.x = {0.0, -0.0, 1.0, -1.0, 1.0000001, -7.0, nan, 0.5, 0.70710678118654757, -0.9999999999};
  v.y = {0.0, -0.0, 0.0, 0.0, -0.0, 1.0, 1.0, nan, -1.0, 1e-300};
  v.z = {1.0, 1.0, 0.0, -0.0, -1.0, 0.0, 1.0, 1.0, -1.0, -1e-300};
  Columns f(10);
  std::vector<double> pitch(10), roll(10), plain_pitch(10), plain_roll(10);
  reduce_columns(same, v.read(), f.written(), {pitch, roll});
  add_angles_plain(same, f.read(), {plain_pitch, plain_roll});
  for (std::size_t i = 0; i < 10; ++i) {
    if (std::isnan(plain_pitch[i])) {
      EXPECT_TRUE(std::isnan(pitch[i])) << i;
    } else {
      EXPECT_NEAR(pitch[i], plain_pitch[i], 1e-15) << i;
    }
    if (std::isnan(plain_roll[i])) {
      EXPECT_TRUE(std::isnan(roll[i])) << i;
    } else {
      EXPECT_NEAR(roll[i], plain_roll[i], 1e-15) << i;
    }
  }
  EXPECT_EQ(pitch[4], std::numbers::pi / 2.0);
}

// ---- sliding variance ----

TEST_P(Kernels, SlidingVarianceIsThatOfEachWindow) {
  for (const std::size_t n : {2U, 5U, 100U, 101U, 150U, 20000U}) {
    for (const std::size_t window : {2U, 5U, 101U}) {
      if (window > n) {
        continue;
      }
      // An offset of 1000 times the noise, as of raw counts, and a jump in the middle.
      std::array<std::vector<double>, 3> columns = {normals(n, 4, 32768.0), normals(n, 5, -2000.0),
                                                    normals(n, 6)};
      for (std::size_t i = n / 2; i < n; ++i) {
        columns[0][i] += 5000.0;
      }
      const std::array<std::span<const double>, 3> spans = {columns[0], columns[1], columns[2]};
      std::vector<double> lanes(n - window + 1);
      std::vector<double> plain(lanes.size());
      joined_sliding_variance(spans, window, lanes);
      joined_sliding_variance_plain(spans, window, plain);
      for (std::size_t i = 0; i < plain.size(); ++i) {
        // The squares of the jump are 2.5e7, so the rounding error of a variance is about 1e-7.
        EXPECT_NEAR(std::sqrt(lanes[i]), std::sqrt(plain[i]), 1e-6)
            << n << " " << window << " " << i;
      }
    }
  }
}

// ---- second differences ----

TEST_P(Kernels, SecondDifferencesAreThoseOfThePlainTwin) {
  const std::vector<double> x = normals(5000, 8);
  for (const std::size_t m : {1U, 3U, 64U, 1000U}) {
    for (const std::size_t count : {0U, 1U, 31U, 32U, 2000U}) {
      const double plain = sum_of_squared_second_differences_plain(x, m, 17, count);
      EXPECT_NEAR(sum_of_squared_second_differences(x, m, 17, count), plain, 1e-13 * plain);
    }
  }
}

// ---- sums of products ----

TEST_P(Kernels, ProductsOfColumnsAreThoseOfPlainCode) {
  for (const std::size_t p : {1U, 2U, 3U, 4U, 6U, 10U, 14U}) {
    for (const std::size_t n : {0U, 1U, 7U, 8U, 200U, 2500U}) {
      const std::vector<double> x = normals(p * n, p + n);
      std::vector<const double*> columns;
      for (std::size_t j = 0; j < p; ++j) {
        columns.push_back(x.data() + n * j);
      }
      std::vector<double> plain(p * p);
      std::vector<double> sums(p * p);
      sums_of_products_plain(columns, n, plain.data());
      sums_of_products(columns, n, sums.data());
      for (std::size_t j = 0; j < p; ++j) {
        for (std::size_t k = j; k < p; ++k) {
          EXPECT_NEAR(sums[k + p * j], plain[k + p * j], 1e-13 * static_cast<double>(n)) << p << n;
        }
      }
    }
  }
}

// ---- ellipsoid ----

TEST_P(Kernels, EllipsoidRowsAreThoseOfPlainCode) {
  for (const std::size_t n : {1U, 7U, 8U, 203U}) {
    const std::array<std::vector<double>, 3> v = {normals(n, 1, 0.1), normals(n, 2), normals(n, 3)};
    const std::vector<double> weights = normals(n, 4, 5.0);
    const EllipsoidReadings readings{
        .v = {v[0].data(), v[1].data(), v[2].data()},
        .n = n,
        .A = {{{1.1, 0.02, -0.03}, {0.04, 0.9, 0.05}, {0.0, 0.06, 1.0}}},
        .b = {0.1, -0.2, 0.3}};
    for (const bool symmetric : {false, true}) {
      const EllipsoidWeights how{.root_weights = weights.data(),
                                 .C = {{{1.2, 0.1, 0.2}, {0.1, 0.8, 0.05}, {0.2, 0.05, 1.0}}},
                                 .symmetric = symmetric};
      const auto rows_by = [&](auto* function) {
        std::vector<double> all(11 * n);
        EllipsoidRows rows{.scale = all.data(), .residuals = all.data() + n};
        for (std::size_t j = 0; j < rows.jacobian.size(); ++j) {
          rows.jacobian[j] = all.data() + (2 + j) * n;
        }
        function(readings, how, rows);
        return all;
      };
      const std::vector<double> plain = rows_by(&ellipsoid_rows_plain);
      const std::vector<double> rows = rows_by(&ellipsoid_rows);
      for (std::size_t i = 0; i < plain.size(); ++i) {
        EXPECT_NEAR(rows[i], plain[i], 1e-13 * (1.0 + std::abs(plain[i]))) << i / n;
      }
      const double squares = ellipsoid_squares_plain(readings, plain.data());
      EXPECT_NEAR(ellipsoid_squares(readings, plain.data()), squares, 1e-13 * squares);
      double of_residuals = 0.0;
      for (std::size_t i = 0; i < n; ++i) {
        of_residuals += plain[n + i] * plain[n + i];
      }
      EXPECT_NEAR(squares, of_residuals, 1e-13 * squares);
    }
  }
}

// ---- turns ----

struct Turn {
  std::vector<double> time;
  std::array<std::vector<double>, 3> rate;
  [[nodiscard]] TurnSamples samples() const {
    return {.rate = {rate[0], rate[1], rate[2]}, .time_s = time};
  }
};

Turn some_turn(std::size_t samples, std::uint64_t seed) {
  RandomStream random(seed);
  Turn turn;
  double t = 10.0 * random.uniform();
  for (std::size_t i = 0; i < samples; ++i) {
    t += 0.008 + 0.004 * random.uniform();
    turn.time.push_back(t);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      turn.rate[axis].push_back(100.0 * std::sin(t * (1.0 + 0.3 * static_cast<double>(axis))));
    }
  }
  return turn;
}

constexpr std::array<double, 9> some_B = {0.01, 1e-4, -2e-4, 0.0, 0.011, 1e-4, 3e-4, 0.0, 0.009};

TEST_P(Kernels, TurnsAreThoseOfThePlainTwin) {
  std::vector<Turn> turns;
  for (std::size_t i = 0; i < 21; ++i) {
    turns.push_back(some_turn(2 + 37 * (i * 5 % 21), i + 1));
  }
  std::vector<TurnSamples> samples;
  for (const Turn& turn : turns) {
    samples.push_back(turn.samples());
  }
  const PackedTurns packed(samples);
  const auto lanes = packed.integrate(some_B);
  const auto plain = packed.integrate_plain(some_B);
  ASSERT_EQ(lanes.size(), turns.size());
  for (std::size_t i = 0; i < turns.size(); ++i) {
    const auto alone = PackedTurns(std::span(&samples[i], 1)).integrate(some_B);
    for (std::size_t q = 0; q < 4; ++q) {
      EXPECT_NEAR(lanes[i].attitude[q], plain[i].attitude[q], 1e-13);
      EXPECT_NEAR(lanes[i].attitude[q], alone[0].attitude[q], 1e-13);
    }
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t pq = 0; pq < 9; ++pq) {
        EXPECT_NEAR(lanes[i].sensitivity[row][pq], plain[i].sensitivity[row][pq], 1e-10);
      }
    }
  }
}

// A turn about one axis has the angle of the integral of the rate. For a linear rate it is exact.
TEST_P(Kernels, ATurnAboutOneAxisIsItsIntegral) {
  Turn turn;
  for (std::size_t i = 0; i <= 200; ++i) {
    const double t = 0.01 * static_cast<double>(i);
    turn.time.push_back(t);
    turn.rate[0].push_back(0.0);
    turn.rate[1].push_back(0.0);
    turn.rate[2].push_back(0.5 * t);
  }
  const std::array<double, 9> unit = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const TurnSamples samples = turn.samples();
  const IntegratedTurn whole = PackedTurns(std::span(&samples, 1)).integrate(unit).front();
  EXPECT_NEAR(2.0 * std::atan2(whole.attitude[3], whole.attitude[0]), 1.0, 1e-13);
  EXPECT_NEAR(whole.sensitivity[2][8], 1.0, 1e-13);
  EXPECT_NEAR(whole.rotation_integral[2][2], 2.0, 1e-13);
}

// The derivative agrees with finite differences.
TEST_P(Kernels, SensitivityOfATurnIsThatOfDifferences) {
  const Turn turn = some_turn(150, 3);
  const TurnSamples samples = turn.samples();
  const PackedTurns packed(std::span(&samples, 1));
  const IntegratedTurn at = packed.integrate(some_B).front();
  for (std::size_t pq = 0; pq < 9; ++pq) {
    constexpr double step = 1e-6;
    std::array<double, 9> B = some_B;
    B[pq] += step;
    const IntegratedTurn other = packed.integrate(B).front();
    // The small rotation in the frame at the start is twice the vector part of other * at^-1.
    const auto& a = other.attitude;
    const auto& b = at.attitude;
    const std::array<double, 3> turned = {
        2.0 * (-a[0] * b[1] + a[1] * b[0] - a[2] * b[3] + a[3] * b[2]) / step,
        2.0 * (-a[0] * b[2] + a[1] * b[3] + a[2] * b[0] - a[3] * b[1]) / step,
        2.0 * (-a[0] * b[3] - a[1] * b[2] + a[2] * b[1] + a[3] * b[0]) / step};
    for (std::size_t row = 0; row < 3; ++row) {
      EXPECT_NEAR(at.sensitivity[row][pq], turned[row], 0.05) << pq;  // values up to 70
    }
  }
}

}  // namespace
}  // namespace axiscal
