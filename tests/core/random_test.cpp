// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/random.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>

#include "matchers.hpp"

namespace axiscal {
namespace {

TEST(RandomStream, IsFixedByItsSeed) {
  RandomStream a(5);
  RandomStream b(5);
  RandomStream other_seed(6);
  RandomStream other_stream(5, 1);
  const double first = a.normal();
  EXPECT_EQ(first, b.normal());
  EXPECT_NE(first, other_seed.normal());
  EXPECT_NE(first, other_stream.normal());
}

// The engine is seeded by std::seed_seq of the two halves of the seed and the number of the stream.
TEST(RandomStream, IsSeededAsTheStandardSays) {
  for (const std::uint64_t seed :
       {std::uint64_t{0}, std::uint64_t{7}, ~std::uint64_t{0}, std::uint64_t{0x123456789abcdef0}}) {
    for (const std::uint32_t stream : {0U, 1U, 0xffffffffU}) {
      std::seed_seq sequence{static_cast<std::uint32_t>(seed),
                             static_cast<std::uint32_t>(seed >> 32U), stream};
      std::mt19937_64 engine(sequence);
      RandomStream random(seed, stream);
      for (int i = 0; i < 700; ++i) {
        EXPECT_EQ(random.uniform(), (static_cast<double>(engine() >> 12U) + 0.5) * 0x1p-52);
      }
    }
  }
}

TEST(RandomStream, IsTheSameWhereSeveralAreSeededTogether) {
  RandomStream a(5);
  RandomStream b(5, 1);
  RandomStream c(6, 7);
  RandomStream::seed_several({&a, &b, &c});
  RandomStream a_alone(5);
  RandomStream b_alone(5, 1);
  RandomStream c_alone(6, 7);
  for (int i = 0; i < 1000; ++i) {  // more than one state of the engine
    EXPECT_EQ(a.uniform(), a_alone.uniform());
    EXPECT_EQ(b.uniform(), b_alone.uniform());
    EXPECT_EQ(c.uniform(), c_alone.uniform());
  }
}

TEST(RandomStream, NormalsHaveTheirMoments) {
  RandomStream random(1);
  constexpr int count = 200000;
  double sum = 0.0;
  double squares = 0.0;
  double fourths = 0.0;
  int beyond_three = 0;
  for (int i = 0; i < count; ++i) {
    const double x = random.normal();
    sum += x;
    squares += x * x;
    fourths += x * x * x * x;
    beyond_three += std::abs(x) > 3.0 ? 1 : 0;
  }
  // The tolerances are five standard deviations of each statistic.
  EXPECT_NEAR(sum / count, 0.0, 5.0 / std::sqrt(count));
  EXPECT_NEAR(squares / count, 1.0, 5.0 * std::sqrt(2.0 / count));
  EXPECT_NEAR(fourths / count, 3.0, 5.0 * std::sqrt(96.0 / count));
  EXPECT_NEAR(beyond_three, 0.0027 * count, 5.0 * std::sqrt(0.0027 * count));
}

TEST(RandomStream, ShufflesEvenly) {
  RandomStream random(2);
  std::array<std::array<int, 4>, 4> counts{};
  constexpr int rounds = 40000;
  for (int i = 0; i < rounds; ++i) {
    std::array<std::size_t, 4> items = {0, 1, 2, 3};
    random.shuffle(std::span<std::size_t>(items));
    for (std::size_t k = 0; k < 4; ++k) {
      ++counts[items[k]][k];
    }
  }
  for (const auto& row : counts) {
    for (const int count : row) {
      EXPECT_NEAR(count, rounds / 4.0, 5.0 * std::sqrt(rounds * 0.1875));
    }
  }
}

TEST(RandomStream, DrawsAVectorInOneOrderWithEveryCompiler) {
  RandomStream random(3);
  RandomStream one_by_one(3);
  const Eigen::Vector3d drawn = random.normals<3>();
  for (const Eigen::Index i : {2, 1, 0}) {
    EXPECT_EQ(drawn(i), one_by_one.normal()) << i;
  }
}

}  // namespace
}  // namespace axiscal
