// SPDX-License-Identifier: Apache-2.0
#include "axiscal/positioner/positioner.hpp"

#include <Eigen/Geometry>

#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/positioner/design.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

std::vector<Eigen::Matrix3d> all_rotations() {
  const Positioner cube;
  std::vector<Eigen::Matrix3d> rotations;
  for (const DesignEntry& entry : standard_design(24)) {
    rotations.push_back(cube.rotation_table_from_positioner(entry.point));
  }
  return rotations;
}

bool contains(const std::vector<Eigen::Matrix3d>& rotations, const Eigen::Matrix3d& R) {
  return std::any_of(rotations.begin(), rotations.end(),
                     [&](const Eigen::Matrix3d& other) { return other == R; });
}

TEST(Positioner, The24OrientationsAreAGroup) {
  const std::vector<Eigen::Matrix3d> rotations = all_rotations();
  EXPECT_TRUE(contains(rotations, Eigen::Matrix3d::Identity()));
  for (const Eigen::Matrix3d& a : rotations) {
    EXPECT_TRUE(is_rotation(a, 0.0));
    EXPECT_TRUE(contains(rotations, a.transpose()));
    for (const Eigen::Matrix3d& b : rotations) {
      EXPECT_TRUE(contains(rotations, a * b));
    }
  }
}

TEST(Positioner, LaysTheRestFaceDownAndTheFenceFaceForward) {
  const Positioner cube;
  for (const DesignEntry& entry : standard_design(24)) {
    const Eigen::Matrix3d R = cube.rotation_table_from_positioner(entry.point);
    EXPECT_EQ(R * nominal_normal(entry.point.rest()), Eigen::Vector3d(0.0, 0.0, -1.0));
    EXPECT_EQ(R * nominal_normal(entry.point.fence()), Eigen::Vector3d(0.0, 1.0, 0.0));
  }
}

TEST(Positioner, UsesMeasuredNormals) {
  const Positioner nominal;
  std::array<Eigen::Vector3d, 6> normals;
  for (const Face face : all_faces) {
    const Eigen::Vector3d axis = Eigen::Vector3d(1.0, 2.0, -1.0 - static_cast<int>(face));
    normals[static_cast<std::size_t>(face)] =
        Eigen::AngleAxisd(2e-3, axis.normalized()) * nominal_normal(face);
  }
  const Positioner cube(normals, "cube-07");
  EXPECT_FALSE(cube.is_nominal());
  EXPECT_EQ(cube.id(), "cube-07");
  for (const DesignEntry& entry : standard_design(24)) {
    const Eigen::Matrix3d R = cube.rotation_table_from_positioner(entry.point);
    EXPECT_TRUE(is_rotation(R, 1e-15));
    EXPECT_MATRIX_NEAR(R * cube.normal(entry.point.rest()), Eigen::Vector3d(0.0, 0.0, -1.0), 1e-15);
    EXPECT_NEAR((R * cube.normal(entry.point.fence())).x(), 0.0, 1e-15);
    EXPECT_MATRIX_NEAR(R, nominal.rotation_table_from_positioner(entry.point), 5e-3);
  }
}

TEST(Positioner, RefusesBadNormals) {
  std::array<Eigen::Vector3d, 6> normals;
  for (const Face face : all_faces) {
    normals[static_cast<std::size_t>(face)] = nominal_normal(face);
  }
  EXPECT_NO_THROW(Positioner{normals});
  auto longer = normals;
  longer[2] *= 1.0 + 2e-6;
  EXPECT_THROW(Positioner{longer}, DomainError);
  auto left_handed = normals;
  std::swap(left_handed[4], left_handed[5]);
  EXPECT_THROW(Positioner{left_handed}, DomainError);
}

}  // namespace
}  // namespace axiscal
