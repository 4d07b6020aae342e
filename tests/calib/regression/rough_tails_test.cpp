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

TEST(RoughTails, OfStudentsTToo) {
  for (double nu = 1.0; nu < 300.0; nu *= 1.27) {
    for (double t = 0.05; t < 30.0; t *= 1.2) {
      const double p = student_t_two_sided_p(t, nu);
      const double roughly = t_two_sided_p_roughly(t * t, nu);
      EXPECT_NEAR(roughly, p, nu < 2.0 ? 0.016 : 0.01) << t << " " << nu;
    }
  }
}

}  // namespace
}  // namespace axiscal
