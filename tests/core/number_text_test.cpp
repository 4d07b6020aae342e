// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/number_text.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "axiscal/core/random.hpp"
#include "core/read_double.hpp"
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

TEST(NumberText, SaysWhatIsNoNumber) {
  EXPECT_EQ(number_text(std::numeric_limits<double>::infinity()), "inf");
  EXPECT_EQ(number_text(-std::numeric_limits<double>::infinity()), "-inf");
  EXPECT_EQ(number_text(std::numeric_limits<double>::quiet_NaN()), "nan");
}

// Compares with std::to_chars: numbers of all sizes, with few and many digits, and near powers of
// ten.
TEST(NumberText, IsWhatTheStandardLibraryWrites) {
  const auto expected = [](double value) {
    std::array<char, 64> text{};
    return std::string(text.data(),
                       std::to_chars(text.data(), text.data() + text.size(), value).ptr);
  };
  RandomStream random(11);
  for (int i = 0; i < 20000; ++i) {
    const double any = random.normal() * std::pow(10.0, i % 600 - 300);
    const double rounded = std::round(1e3 * random.normal()) / std::pow(10.0, i % 9);
    const double power = std::pow(10.0, i % 30 - 15);
    for (const double value :
         {any, rounded + 1e-9, std::nextafter(power, 0.0), std::nextafter(power, 1e300),
          power * (1 + i % 9), std::round(1e-5 * power * random.normal()) + 0.5,
          random.normal() * std::pow(10.0, i % 16 - 7)}) {
      ASSERT_EQ(number_text(value), expected(value));
      ASSERT_EQ(number_text(-value), expected(-value));
    }
  }
}

std::string decimals_of(double value, int decimals) {
  std::array<char, number_text_size> text{};
  return {text.data(), write_decimals(text.data(), value, decimals)};
}

TEST(WriteDecimals, WritesSoMany) {
  EXPECT_EQ(decimals_of(0.0, 0), "0");
  EXPECT_EQ(decimals_of(-0.0, 2), "0.00");
  EXPECT_EQ(decimals_of(-0.004, 2), "0.00");
  EXPECT_EQ(decimals_of(0.05, 3), "0.050");
  EXPECT_EQ(decimals_of(-12.3456789, 4), "-12.3457");
  EXPECT_EQ(decimals_of(7.0, 15), "7.000000000000000");
  EXPECT_EQ(decimals_of(1e14, 1), "100000000000000.0");
  EXPECT_EQ(decimals_of(1e300, 3), "1e+300");
  EXPECT_EQ(decimals_of(-std::numeric_limits<double>::max(), 15),
            number_text(-std::numeric_limits<double>::max()));
}

// Compares with the C library, which rounds exactly.
TEST(WriteDecimals, RoundsAsThePrinterDoes) {
  RandomStream random(4);
  for (int i = 0; i < 20000; ++i) {
    const double value = random.normal() * std::pow(10.0, i % 9 - 4);
    const int decimals = i % 7;
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
    const std::string expected =
        std::string(text.data()).find_first_not_of("-0.") == std::string::npos && text[0] == '-'
            ? text.data() + 1
            : text.data();
    EXPECT_EQ(decimals_of(value, decimals), expected) << value;
  }
}

TEST(ReadDouble, ByTheCLibraryIsWhatFromCharsGives) {
  std::vector<std::string> texts = {"0",
                                    "-0",
                                    "1.5",
                                    "-.5",
                                    "5.",
                                    ".",
                                    "-",
                                    "",
                                    "+1",
                                    " 1",
                                    "1e5",
                                    "1e",
                                    "1e+",
                                    "1E-3x",
                                    "1e400",
                                    "1e-400",
                                    "0e999",
                                    "0x10",
                                    "1,5",
                                    "1.2.3",
                                    "12abc",
                                    "4.9e-324",
                                    "2.2250738585072011e-308",
                                    "1.7976931348623159e308",
                                    "9007199254740993",
                                    "0.1000000000000000055511151231257827021181583404541015625"};
  RandomStream random(11);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector2d number = random.normals<2>();
    std::string text = number_text(number(0) * std::pow(10.0, 90.0 * number(1)));
    // Also more digits than a double can represent.
    const std::size_t point = text.find('.');
    texts.push_back(text);
    if (point != std::string::npos) {
      texts.push_back(text.insert(point + 1, number_text(std::abs(number(1))).substr(2)));
    }
  }
  for (const std::string& text : texts) {
    double standard = 7.0;
    double own = 7.0;
    const char* const last = text.data() + text.size();
    const auto expected = std::from_chars(text.data(), last, standard);
    const auto result = read_double_by_c_library(text.data(), last, own);
    EXPECT_EQ(result.ec, expected.ec) << text;
    EXPECT_EQ(result.ptr, expected.ptr) << text;
    EXPECT_EQ(own, standard) << text;
    EXPECT_EQ(std::signbit(own), std::signbit(standard)) << text;
  }
}

TEST(Split, TrimsItsParts) {
  EXPECT_THAT(split(" a, b ,,c", ','), testing::ElementsAre("a", "b", "", "c"));
  EXPECT_EQ(joined({"a", "b"}), "a, b");
}

}  // namespace
}  // namespace axiscal
