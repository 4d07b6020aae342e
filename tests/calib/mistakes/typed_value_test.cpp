// SPDX-License-Identifier: Apache-2.0
#include "calib/mistakes/src/typed_value.hpp"

#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "axiscal/core/random.hpp"

namespace axiscal {
namespace {

struct Slip {
  const char* name;
  double typed;
  double meant;
};

class TypedValue : public testing::TestWithParam<Slip> {};

TEST_P(TypedValue, IsReadAsItWasMeant) {
  const auto [name, typed, meant] = GetParam();
  // The expectation by the other readings is never exact.
  for (const double off : {-4e-3, 0.0, 3e-3}) {
    const std::optional<double> found = infer_intended_value(typed, meant + off, 5e-3);
    ASSERT_TRUE(found.has_value()) << name << ", off by " << off;
    // Another slip may give a value that is nearer to the expectation.
    EXPECT_LE(std::abs(*found - (meant + off)), std::abs(off) + 1e-12) << name << ", " << off;
  }
  EXPECT_DOUBLE_EQ(infer_intended_value(typed, meant, 1e-9).value(), meant);
}

TEST_P(TypedValue, IsReadAsItWasMeantWithTheOppositeSignsToo) {
  const auto [name, typed, meant] = GetParam();
  EXPECT_DOUBLE_EQ(infer_intended_value(-typed, -meant, 1e-9).value(), -meant) << name;
}

// Each slip can also happen in the opposite direction.
TEST_P(TypedValue, CouldHaveBeenMeantByItsCorrection) {
  const auto [name, typed, meant] = GetParam();
  EXPECT_DOUBLE_EQ(infer_intended_value(meant, typed, 1e-9).value(), typed) << name;
}

INSTANTIATE_TEST_SUITE_P(Slips,
                         TypedValue,
                         testing::Values(Slip{"one digit", 2.4112, 2.4712},
                                         Slip{"first digit", 7.4712, 2.4712},
                                         Slip{"last digit", 2.4719, 2.4712},
                                         Slip{"exchanged digits", 2.4172, 2.4712},
                                         Slip{"exchanged first decimals", -1.0934, -1.9034},
                                         Slip{"sign", -2.4712, 2.4712},
                                         Slip{"point one place left", 0.24712, 2.4712},
                                         Slip{"point one place right", 24.712, 2.4712},
                                         Slip{"point two places left", 0.024712, 2.4712},
                                         Slip{"point two places right", 247.12, 2.4712}),
                         [](const auto& one) {
                           std::string name = one.param.name;
                           for (char& c : name) {
                             c = c == ' ' ? '_' : c;
                           }
                           return name;
                         });

TEST(ProbablyMeant, ExplainsNoTwoSlipsAtOnce) {
  EXPECT_FALSE(infer_intended_value(2.4712, 2.5812, 1e-3).has_value());   // two digits
  EXPECT_FALSE(infer_intended_value(-2.4112, 2.4712, 1e-3).has_value());  // sign and digit
  EXPECT_FALSE(infer_intended_value(24.112, 2.4712, 1e-3).has_value());   // point and digit
  EXPECT_FALSE(infer_intended_value(2.4712, 2.7142, 1e-3).has_value());   // three digits rotated
  EXPECT_FALSE(infer_intended_value(2.4712, 2471.2, 1e-3).has_value());   // three places
}

TEST(ProbablyMeant, TakesTheNearestOfSeveralExplanations) {
  // 0 and 9 as the last digit are both within the tolerance.
  EXPECT_DOUBLE_EQ(infer_intended_value(2.4715, 2.4708, 2e-3).value(), 2.471);
  EXPECT_DOUBLE_EQ(infer_intended_value(2.4715, 2.4721, 2e-3).value(), 2.4719);
  // A change of the sign gives 5.5555, which is nearer than any value by a change of one digit.
  EXPECT_DOUBLE_EQ(infer_intended_value(-5.5555, 5.0, 1.0).value(), 5.5555);
}

TEST(ProbablyMeant, SaysNothingOfFewDigits) {
  EXPECT_FALSE(infer_intended_value(2.47, -2.47, 1e-2).has_value());
  EXPECT_FALSE(infer_intended_value(247.0, 274.0, 1.0).has_value());
  EXPECT_FALSE(infer_intended_value(0.0, 1.0, 10.0).has_value());
  EXPECT_TRUE(infer_intended_value(2.471, -2.471, 1e-2).has_value());
  EXPECT_TRUE(infer_intended_value(2471.0, 2741.0, 1.0).has_value());
}

TEST(ProbablyMeant, SaysNothingOfWhatNobodyTypesByDigits) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(infer_intended_value(std::nan(""), 1.0, 1.0).has_value());
  EXPECT_FALSE(infer_intended_value(infinity, 1.0, 1.0).has_value());
  EXPECT_FALSE(infer_intended_value(-infinity, 1.0, 1.0).has_value());
  EXPECT_FALSE(infer_intended_value(1.2345e-12, -1.2345e-12, 1e-13).has_value());
  EXPECT_FALSE(infer_intended_value(1.2345e30, -1.2345e30, 1e20).has_value());
  EXPECT_FALSE(infer_intended_value(2.4712, std::nan(""), 1.0).has_value());
}

// Random numbers without the digit 0, so that no digit is lost at an end.
std::string text_without_zeros(RandomStream& random) {
  std::string text;
  for (int digit = 0; digit < 6; ++digit) {
    text += static_cast<char>('1' + static_cast<char>(random.index(9)));
    text += digit == 1 ? "." : "";
  }
  return text;
}

TEST(ProbablyMeant, UndoesAnySlipOfOneDigitOrTwo) {
  RandomStream random(8);
  for (int t = 0; t < 2000; ++t) {
    const std::string meant = text_without_zeros(random);
    std::string typed = meant;
    std::size_t at = random.index(typed.size() - 1);
    at = typed[at] == '.' || typed[at + 1] == '.' ? typed.size() - 2 : at;
    if (t % 2 == 0) {
      std::swap(typed[at], typed[at + 1]);
    } else {
      typed[at] = static_cast<char>('1' + static_cast<char>(random.index(9)));
    }
    if (typed == meant) {
      continue;
    }
    const double value = std::stod(meant);
    const std::optional<double> found = infer_intended_value(std::stod(typed), value, 1e-7);
    ASSERT_TRUE(found.has_value()) << typed << " for " << meant;
    EXPECT_DOUBLE_EQ(*found, value) << typed << " for " << meant;
  }
}

TEST(ProbablyMeant, StaysWithinItsToleranceAndKeepsWhatAShorterOneFound) {
  RandomStream random(9);
  int found = 0;
  for (int t = 0; t < 2000; ++t) {
    const double typed = std::stod(text_without_zeros(random));
    const double expected = 100.0 * random.uniform();
    const std::optional<double> narrow = infer_intended_value(typed, expected, 0.1);
    const std::optional<double> wide = infer_intended_value(typed, expected, 1.0);
    if (wide) {
      EXPECT_LE(std::abs(*wide - expected), 1.0);
      EXPECT_NE(*wide, 0.0);
    }
    if (narrow) {
      ++found;
      EXPECT_LE(std::abs(*narrow - expected), 0.1);
      EXPECT_EQ(narrow, wide);
    }
  }
  // A change of a digit gives about 20 values in a range of 100. Each matches an interval of width
  // 0.2.
  EXPECT_GT(found, 20);
  EXPECT_LT(found, 400);
}

}  // namespace
}  // namespace axiscal
