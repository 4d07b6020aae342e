// SPDX-License-Identifier: Apache-2.0
#include "axiscal/positioner/mount.hpp"

#include <limits>

#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

TEST(HShapedMounts, TurnTheSecondAboutAnAxisInTheWeb) {
  const std::vector<Mount> x = h_shaped_mounts("A", "B");
  ASSERT_EQ(x.size(), 2U);
  EXPECT_EQ(x[0].rotation_sensor_from_positioner, Eigen::Matrix3d::Identity());
  const Eigen::Matrix3d& turned = x[1].rotation_sensor_from_positioner;
  EXPECT_TRUE(is_rotation(turned));
  // The half turn keeps the axis in the web and reverses the web's normal, so it leads to the other
  // side of the web.
  EXPECT_EQ(turned * Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitX());
  EXPECT_EQ(turned * Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitZ());
  const Eigen::Matrix3d other =
      h_shaped_mounts("A", "B", WebAxis::y)[1].rotation_sensor_from_positioner;
  EXPECT_TRUE(is_rotation(other));
  EXPECT_EQ(other * Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitY());
}

TEST(ParallelMounts, AreTheCubesOwnOrientation) {
  const std::vector<Mount> triple = parallel_mounts({"A", "B", "C"});
  ASSERT_EQ(triple.size(), 3U);
  EXPECT_EQ(triple[2].slot, "C");
  EXPECT_EQ(triple[2].rotation_sensor_from_positioner, Eigen::Matrix3d::Identity());
}

TEST(CheckedMounts, MakesAMatrixOfFewDigitsARotation) {
  Eigen::Matrix3d written;
  // clang-format off
  written << 0.8660254, -0.5,       0.0,
             0.5,        0.8660254, 0.0,
             0.0,        0.0,       1.0;
  // clang-format on
  const Mount mount =
      checked_mounts({{.slot = "A", .rotation_sensor_from_positioner = written}}).front();
  EXPECT_TRUE(is_rotation(mount.rotation_sensor_from_positioner, 1e-15));
  EXPECT_MATRIX_NEAR(mount.rotation_sensor_from_positioner, written, 1e-7);
}

TEST(CheckedMounts, RefusesWhatIsNoMount) {
  const auto complaint = [](const std::vector<Mount>& mounts) {
    return test::complaint_of<DomainError>([&] { static_cast<void>(checked_mounts(mounts)); });
  };
  EXPECT_EQ(complaint(h_shaped_mounts("A", "B")), "accepted");
  EXPECT_THAT(complaint(parallel_mounts({"A", "A"})), HasSubstr("different slot name"));
  EXPECT_THAT(complaint(parallel_mounts({""})), HasSubstr("different slot name"));
  const Eigen::Matrix3d mirrored = Eigen::Vector3d(1.0, 1.0, -1.0).asDiagonal();
  EXPECT_THAT(complaint({{.slot = "A", .rotation_sensor_from_positioner = mirrored}}),
              HasSubstr("slot A: rotation_sensor_from_positioner is not a rotation"));
  EXPECT_THAT(complaint({{.slot = "A", .repeatability_rad = -1.0}}), HasSubstr("negative"));
  EXPECT_THAT(
      complaint({{.slot = "A", .repeatability_rad = std::numeric_limits<double>::quiet_NaN()}}),
      HasSubstr("negative"));
}

}  // namespace
}  // namespace axiscal
