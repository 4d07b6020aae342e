// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/rough_tails.hpp"

#include <gtest/gtest.h>

#include "axiscal/calib/distributions.hpp"

namespace axiscal {
namespace {

TEST(RoughTails, AreWithinWhatTheySay) {
  for (double numerator = 2.0; numerator < 300.0; numerator *= 1.37) {
    for (double denominator = 2.0; denominator < 300.0; denominator *= 1.41) {
      for (double f = 0.05; f < 20.0; f *= 1.3) {
        EXPECT_NEAR(f_upper_p_roughly(f, numerator, denominator),
                    f_upper_p(f, numerator, denominator), 0.015);
      }
    }
  }
}

}  // namespace
}  // namespace axiscal
