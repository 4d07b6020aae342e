// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/distributions.hpp"

#include <cmath>
#include <limits>

#include "matchers.hpp"

namespace axiscal {
namespace {

TEST(Distributions, AgreeWithTables) {
  // NIST/SEMATECH e-Handbook, tables 1.3.6.7.2, .3, .4.
  EXPECT_NEAR(student_t_factor(0.95, 2.0), 4.303, 5e-4);
  EXPECT_NEAR(student_t_factor(0.95, 8.0), 2.306, 5e-4);
  EXPECT_NEAR(student_t_factor(0.99, 10.0), 3.169, 5e-4);
  EXPECT_NEAR(student_t_two_sided_p(-4.303, 2.0), 0.05, 1e-5);
  EXPECT_NEAR(f_upper_p(3.326, 5.0, 10.0), 0.05, 1e-4);
  EXPECT_NEAR(chi_squared_upper_p(7.815, 3.0), 0.05, 1e-5);
  // F with two degrees of freedom in the numerator has a closed form.
  EXPECT_NEAR(f_upper_p(4.7374, 2.0, 7.0), 0.05, 1e-5);
  // F with integer degrees of freedom is a finite sum. The expected values are from
  // scipy.stats.f.sf.
  EXPECT_NEAR(f_upper_p(1.5, 1.0, 6.0), 0.266569703380069, 1e-13);
  EXPECT_NEAR(f_upper_p(0.8, 3.0, 21.0), 0.5077377599626438, 1e-13);
  EXPECT_NEAR(f_upper_p(2.0, 4.0, 7.0), 0.19902192835837115, 1e-13);
  EXPECT_NEAR(f_upper_p(1.2, 5.0, 4.0), 0.44229039814613197, 1e-13);
  EXPECT_NEAR(f_upper_p(0.02, 1.0, 3.0), 0.8964997142840404, 1e-13);
  EXPECT_NEAR(f_upper_p(30.0, 3.0, 9.0) / 5.125271709427028e-05, 1.0, 1e-12);
  // Small probabilities are exact to their last digits (mpmath.betainc).
  EXPECT_NEAR(f_upper_p(60.0, 1.0, 22.0) / 1.0043964640103082e-07, 1.0, 1e-14);
  EXPECT_NEAR(f_upper_p(3e3, 24.0, 5.0) / 6.9906414083477858e-09, 1.0, 1e-14);
  EXPECT_NEAR(f_upper_p(5.8, 29.0, 10.0) / 2.9342302976548927e-03, 1.0, 1e-14);
  EXPECT_NEAR(f_upper_p(7e3, 59.0, 1.0) / 9.4959929431436680e-03, 1.0, 1e-14);
  EXPECT_EQ(f_upper_p(1e308, 3.0, 9.0), 0.0);
  EXPECT_NEAR(f_upper_p(1.1, 1.0, 80.0), 0.2974243171780877, 1e-13);
  EXPECT_NEAR(chi_squared_upper_p(9.4877, 4.0), 0.05, 1e-6);
  EXPECT_NEAR(chi_squared_upper_p(200.0, 6.0) / (5101.0 * std::exp(-100.0)), 1.0, 1e-12);
  EXPECT_EQ(chi_squared_upper_p(4000.0, 6.0), 0.0);
  // With 1 and 2 degrees of freedom t has closed forms.
  EXPECT_NEAR(student_t_two_sided_p(1.0, 1.0), 0.5, 1e-15);
  EXPECT_NEAR(student_t_factor(0.95, 2.0), 0.95 * std::sqrt(2.0 / (1.0 - 0.95 * 0.95)), 1e-14);
}

// Expected value: scipy.stats.combine_pvalues([0.02, 0.3, 0.7], "fisher").
TEST(Distributions, PutProbabilitiesTogetherByFishersMethod) {
  FisherSum all;
  for (const double p : {0.02, 0.3, 0.7}) {
    all.add(p);
  }
  EXPECT_NEAR(all.p_value(), 0.09008048, 1e-7);
  EXPECT_EQ(all.count(), 3.0);
  all.add(0.0);
  EXPECT_GT(all.p_value(), 0.0);
  EXPECT_LT(all.p_value(), 1e-200);
}

TEST(Distributions, AreNanWhereTheyDoNotExist) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double value :
       {student_t_factor(0.95, 0.0), student_t_factor(0.95, nan), student_t_factor(1.0, 3.0),
        student_t_two_sided_p(nan, 3.0), student_t_two_sided_p(1.0, -1.0), f_upper_p(nan, 2.0, 2.0),
        f_upper_p(-1.0, 2.0, 2.0), f_upper_p(1.0, 0.0, 2.0), chi_squared_upper_p(-1.0, 2.0),
        chi_squared_upper_p(1.0, nan)}) {
    EXPECT_TRUE(std::isnan(value));
  }
  EXPECT_TRUE(std::isinf(student_t_factor(0.95, 1e-4)));
  EXPECT_EQ(f_upper_p(std::numeric_limits<double>::infinity(), 2.0, 3.0), 0.0);
}

TEST(FreedomOfFactor, TurnsStudentsFactorRound) {
  for (const double coverage : {0.5, 0.95, 0.999}) {
    for (double nu = 0.1; nu < 1e4; nu *= 1.31) {
      EXPECT_NEAR(freedom_of_factor(student_t_factor(coverage, nu), coverage), nu, 1e-8 * nu);
    }
    EXPECT_EQ(freedom_of_factor(student_t_factor(coverage, 4.0), coverage), 4.0);
  }
  for (const double as_good_as_infinite : {1e6, 1e7}) {
    EXPECT_EQ(freedom_of_factor(student_t_factor(0.95, as_good_as_infinite), 0.95),
              std::numeric_limits<double>::infinity());
  }
  EXPECT_EQ(freedom_of_factor(1.95, 0.95), std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace axiscal
