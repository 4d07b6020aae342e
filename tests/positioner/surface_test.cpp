// SPDX-License-Identifier: Apache-2.0
#include "axiscal/positioner/surface.hpp"

#include <cmath>

#include <Eigen/Geometry>

#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

const Surface three_screws{.adjusters_m = {{0.1, 0.0}, {-0.1, 0.08}, {-0.1, -0.08}},
                           .thread_pitch_m = 0.5e-3};

TEST(LevelTable, RaisesOnlyAndMakesTheTableLevel) {
  const Eigen::Vector2d slope(0.004, -0.003);
  const std::vector<AdjusterMove> moves =
      level_table(slope, 1e-12 * Eigen::Matrix2d::Identity(), three_screws);
  ASSERT_EQ(moves.size(), 3U);
  double least = 1.0;
  // Positions of the screws' heads. In the table's frame they are in the plane z = 0; the rotation
  // R takes them to a level frame. After raising they must be level.
  const Eigen::Matrix3d to_level = rotation_sloping_from_level(slope).transpose();
  std::vector<Eigen::Vector3d> heads;
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector2d& p = three_screws.adjusters_m[i];
    EXPECT_EQ(moves[i].position_m, p);
    EXPECT_GE(moves[i].raise_m, 0.0);
    EXPECT_NEAR(*moves[i].turns, moves[i].raise_m / 0.5e-3, 1e-15);
    least = std::min(least, moves[i].raise_m);
    heads.push_back(to_level * Eigen::Vector3d(p.x(), p.y(), 0.0) +
                    Eigen::Vector3d(0.0, 0.0, moves[i].raise_m));
  }
  EXPECT_EQ(least, 0.0);
  const Eigen::Vector3d normal = (heads[1] - heads[0]).cross(heads[2] - heads[0]).normalized();
  // The remaining slope is of third order, because the screws are square to the table and not
  // vertical.
  EXPECT_NEAR(std::abs(normal.z()), 1.0, 1e-14);
  EXPECT_LT(std::hypot(normal.x(), normal.y()), 1e-7);
  EXPECT_NEAR(moves[1].uncertainty_m, moves[1].raise_m > 0.0 ? 1e-6 * 0.16 : 0.0, 1.2e-7);
}

TEST(LevelTable, TableThatRisesTowardsXIsRaisedAtMinusX) {
  const std::vector<AdjusterMove> moves =
      level_table({0.001, 0.0}, Eigen::Matrix2d::Zero(), three_screws);
  EXPECT_EQ(moves[0].raise_m, 0.0);
  EXPECT_NEAR(moves[1].raise_m, 0.2 * 0.001, 1e-9);
  EXPECT_NEAR(moves[2].raise_m, 0.2 * 0.001, 1e-9);
  EXPECT_EQ(moves[2].uncertainty_m, 0.0);
}

TEST(LevelTable, RefusesWhatCannotLevel) {
  const auto complaint = [](const Eigen::Vector2d& slope, const Surface& surface) {
    return test::complaint_of<DomainError>(
        [&] { static_cast<void>(level_table(slope, Eigen::Matrix2d::Zero(), surface)); });
  };
  EXPECT_THAT(complaint({0.0, 0.0}, {.adjusters_m = {{0.0, 0.0}, {1.0, 0.0}}}),
              HasSubstr("three height adjusters"));
  EXPECT_THAT(complaint({0.0, 0.0}, {.adjusters_m = {{0.0, 0.0}, {1.0, 1.0}, {2.0, 2.0}}}),
              HasSubstr("in a line"));
  EXPECT_THAT(complaint({1.0, 0.1}, three_screws), HasSubstr("X^2 + Y^2 < 1"));
  Surface surface = three_screws;
  surface.thread_pitch_m = 0.0;
  EXPECT_THAT(complaint({0.0, 0.0}, surface), HasSubstr("pitch"));
}

TEST(FenceLean, StaysOnOnePieceAndChangesUnderASeparateFence) {
  EXPECT_EQ(fence_lean_when_level({.fence_lean_rad = 0.002}, {0.0, 0.005}), 0.002);
  const Surface separate{.kind = SurfaceKind::separate, .fence_lean_rad = 0.002};
  const Eigen::Vector2d slope(0.0, 0.005);
  // The fence's normal in the room does not change, so its vertical component does not.
  const Eigen::Vector3d up(0.0, slope.y(), std::sqrt(1.0 - slope.squaredNorm()));
  const double before = up.dot(Eigen::Vector3d(0.0, std::cos(0.002), std::sin(0.002)));
  EXPECT_NEAR(std::sin(fence_lean_when_level(separate, slope)), before, 1e-15);
}

}  // namespace
}  // namespace axiscal
