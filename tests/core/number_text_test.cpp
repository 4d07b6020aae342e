// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/number_text.hpp"

#include <cmath>
#include <limits>

#include "axiscal/core/random.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

TEST(ParseNumber, TakesNumbers) {
  EXPECT_EQ(parse_number("1.5"), 1.5);
  EXPECT_EQ(parse_number("+2e-3"), 2e-3);
  EXPECT_EQ(parse_number("-.5"), -0.5);
  EXPECT_EQ(parse_number("1e308"), 1e308);
  EXPECT_EQ(parse_integer("-12"), -12);
}

TEST(ParseNumber, RefusesEverythingElse) {
  for (const char* text : {"", "+", "nan", "NaN", "inf", "-Infinity", "1e999", "1,5", "1.2V",
                           "0x10", "1 ", " 1", "+-1", "++1", "--1", "1e", "one"}) {
    EXPECT_FALSE(parse_number(text)) << text;
  }
  EXPECT_FALSE(parse_integer("1.0"));
  EXPECT_FALSE(parse_integer("99999999999"));
}

TEST(ParseNumbers, TakesLists) {
  EXPECT_THAT(*parse_numbers("-0.001, 0.002"), testing::ElementsAre(-0.001, 0.002));
  EXPECT_FALSE(parse_numbers("1,,2"));
  EXPECT_FALSE(parse_numbers(""));
}

TEST(NumberText, IsTheShortestThatReadsBack) {
  EXPECT_EQ(number_text(0.1), "0.1");
  EXPECT_EQ(number_text(-0.0), "0");
  EXPECT_EQ(number_text(1e300), "1e+300");
  EXPECT_LE(number_text(-std::numeric_limits<double>::denorm_min()).size(), number_text_size);
  RandomStream random(7);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector2d number = random.normals<2>();
    const double value = number(0) * std::pow(10.0, 20.0 * number(1));
    EXPECT_EQ(parse_number(number_text(value)), value);
  }
}

TEST(Split, TrimsItsParts) {
  EXPECT_THAT(split(" a, b ,,c", ','), testing::ElementsAre("a", "b", "", "c"));
  EXPECT_EQ(joined({"a", "b"}), "a, b");
}

}  // namespace
}  // namespace axiscal
