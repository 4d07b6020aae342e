// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/stillness.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"

namespace axiscal {
namespace {

// Feeds simulated samples of two axes to `stillness`.
void feed(Stillness& stillness,
          RandomStream& random,
          double& time_s,
          double seconds,
          double rate,
          double sd,
          double offset = 0.0) {
  const auto count = static_cast<int>(seconds * rate);
  for (int i = 0; i < count; ++i) {
    time_s += 1.0 / rate;
    const std::array<double, 2> values = {offset + sd * random.normal(),
                                          5.0 + sd * random.normal()};
    stillness.add(time_s, values);
  }
}

TEST(Stillness, LearnsTheFloorAndTellsMotionAtAnyRate) {
  for (const double rate : {20.0, 100.0, 10000.0}) {
    RandomStream random(1);
    Stillness stillness(2);
    double time_s = 0.0;
    EXPECT_FALSE(stillness.is_ready());
    feed(stillness, random, time_s, 1.0, rate, 0.05);
    feed(stillness, random, time_s, 2.0, rate, 1e-4);
    EXPECT_TRUE(stillness.is_still());
    EXPECT_NEAR(stillness.floor()(0), 1e-4, 0.6e-4) << rate;
    EXPECT_NEAR(stillness.rate_hz(), rate, 0.05 * rate);
    EXPECT_NEAR(stillness.mean()(1), 5.0, 1e-3);
    feed(stillness, random, time_s, 0.3, rate, 0.01);
    EXPECT_FALSE(stillness.is_still()) << rate;
  }
}

TEST(Stillness, AStatedFloorStays) {
  RandomStream random(1);
  Stillness stillness(2, {.noise_sd = Eigen::Vector2d(1e-3, 1e-3)});
  double time_s = 0.0;
  feed(stillness, random, time_s, 2.0, 100.0, 1e-3);
  EXPECT_TRUE(stillness.is_still());
  EXPECT_EQ(stillness.floor()(0), 1e-3);
  stillness.learn(Eigen::Vector2d(1.0, 1.0));
  EXPECT_EQ(stillness.floor()(0), 1e-3);
}

TEST(Stillness, ValuesOnOneStepOfAConverterAreStill) {
  Stillness stillness(1);
  double time_s = 0.0;
  for (int i = 0; i < 300; ++i) {
    time_s += 0.01;
    stillness.add(time_s, std::array<double, 1>{i % 97 == 0 ? 0.001 : 0.0});
  }
  EXPECT_TRUE(stillness.is_still());
  EXPECT_GT(stillness.floor()(0), 0.0);
}

TEST(Stillness, CountsHowLongAValueHasNotChanged) {
  Stillness stillness(1);
  for (int i = 0; i < 50; ++i) {
    stillness.add(0.1 * i, std::array<double, 1>{i < 10 ? 0.1 * i : 7.0});
  }
  EXPECT_NEAR(stillness.unchanged(0).seconds, 3.9, 1e-9);
  EXPECT_EQ(stillness.unchanged(0).samples, 40U);
}

TEST(Stillness, RejectsNonsense) {
  EXPECT_THROW(Stillness(1, {.window_s = 0.0}), DomainError);
  EXPECT_THROW(Stillness(2, {.noise_sd = Eigen::VectorXd::Ones(1)}), DomainError);
}

}  // namespace
}  // namespace axiscal
