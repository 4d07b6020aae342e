// SPDX-License-Identifier: Apache-2.0
#include "calib/regression/heavy_tails.hpp"

#include <cmath>
#include <numbers>
#include <numeric>

#include "axiscal/core/random.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

TEST(NoiseTails, AreWeightedByTheLikelihood) {
  NoiseTails tails;
  for (const double z : {0.5, -3.0, 1.0}) {
    tails.add(z);
  }
  const auto weights = tails.weights();
  EXPECT_NEAR(std::accumulate(weights.begin(), weights.end(), 0.0), 1.0, 1e-12);
  // The weight of t with 3 degrees of freedom, density 2 / (pi sqrt(3) (1 + z^2 / 3)^2), over that
  // of the normal density.
  double t3 = 0.16;
  double normal = 0.2;
  for (const double z : {0.5, -3.0, 1.0}) {
    t3 *= 2.0 / (std::numbers::pi * std::sqrt(3.0) * std::pow(1.0 + z * z / 3.0, 2));
    normal *= std::exp(-0.5 * z * z) / std::sqrt(2.0 * std::numbers::pi);
  }
  EXPECT_NEAR(weights.front() / weights.back(), t3 / normal, 1e-9);
}

TEST(NoiseTails, JudgeADeviationByTheCompanyItKeeps) {
  RandomStream random(3);
  NoiseTails light;
  NoiseTails heavy;
  for (int i = 0; i < 200; ++i) {
    const double z = random.normal();
    light.add(z);
    const double chi = std::hypot(random.normal(), random.normal(), random.normal());
    heavy.add(z * std::sqrt(3.0) / chi);
  }
  EXPECT_LT(light.two_sided_p(6.0), 1e-4);
  EXPECT_GT(heavy.two_sided_p(6.0), 2e-3);
  // add() and remove() of the same residual change nothing.
  const double before = light.two_sided_p(6.0);
  light.add(9.0);
  light.remove(9.0);
  EXPECT_NEAR(light.two_sided_p(6.0), before, 1e-9);
}

}  // namespace
}  // namespace axiscal
