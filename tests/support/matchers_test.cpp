// SPDX-License-Identifier: Apache-2.0
#include "matchers.hpp"

#include <limits>

namespace axiscal::test {
namespace {

TEST(MatricesNear, SeesShapeDistanceAndNan) {
  const Eigen::Vector2d a(1.0, 2.0);
  EXPECT_TRUE(matrices_near(a, Eigen::Vector2d(1.0, 2.05), 0.1));
  EXPECT_FALSE(matrices_near(a, Eigen::Vector2d(1.0, 2.2), 0.1));
  EXPECT_FALSE(matrices_near(a, Eigen::Vector3d(1.0, 2.0, 0.0), 0.1));
  const Eigen::Vector2d broken(1.0, std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(matrices_near(broken, broken, 0.1));
}

}  // namespace
}  // namespace axiscal::test
