// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/rotation.hpp"

#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include "axiscal/core/error.hpp"
#include "axiscal/core/units.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

TEST(SmallestRotation, TakesOneDirectionToTheOther) {
  const Eigen::Vector3d from(1.0, 2.0, -0.5);
  const Eigen::Vector3d to(-0.2, 1.0, 3.0);
  const Eigen::Matrix3d R = smallest_rotation(from, to);
  EXPECT_TRUE(is_rotation(R, 1e-14));
  EXPECT_MATRIX_NEAR(R * from.normalized(), to.normalized(), 1e-15);
  // Eigen's quaternion is an independent computation.
  EXPECT_MATRIX_NEAR(R, Eigen::Quaterniond::FromTwoVectors(from, to).toRotationMatrix(), 1e-14);
  EXPECT_MATRIX_NEAR(smallest_rotation(from, from), Eigen::Matrix3d::Identity(), 0.0);
}

TEST(SmallestRotation, RefusesWhatHasNone) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  EXPECT_THROW(static_cast<void>(smallest_rotation(x, -x)), DomainError);
  EXPECT_THROW(static_cast<void>(smallest_rotation(x, Eigen::Vector3d::Zero())), DomainError);
  EXPECT_THROW(static_cast<void>(rotation_table_from_enu(std::nan(""))), DomainError);
}

TEST(RotationTableFromEnu, PutsTheFenceAtItsAzimuth) {
  EXPECT_MATRIX_NEAR(rotation_table_from_enu(0.0), Eigen::Matrix3d::Identity(), 0.0);
  // With the fence in the east, y of the table is east and x of the table is south.
  const Eigen::Matrix3d R = rotation_table_from_enu(90.0 * rad_per_deg);
  EXPECT_MATRIX_NEAR(R * Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), 1e-15);
  EXPECT_MATRIX_NEAR(R * Eigen::Vector3d::UnitY(), -Eigen::Vector3d::UnitX(), 1e-15);
}

TEST(TangentsOf, CompleteARightHandedFrame) {
  for (const Eigen::Vector3d& direction :
       {Eigen::Vector3d(0.0, 0.0, 2.0), Eigen::Vector3d(1.0, -2.0, 0.3)}) {
    Eigen::Matrix3d frame;
    frame << tangents_of(direction), direction.normalized();
    EXPECT_TRUE(is_rotation(frame, 1e-15));
  }
}

}  // namespace
}  // namespace axiscal
