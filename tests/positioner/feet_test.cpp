// SPDX-License-Identifier: Apache-2.0
#include "axiscal/positioner/feet.hpp"

#include <cmath>
#include <limits>

#include "axiscal/core/error.hpp"
#include "axiscal/positioner/cube_geometry.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

Feet three_feet() {
  return {Ball{.centre_m = {0.02, 0.02, 0.035}, .radius_m = 0.003},
          Ball{.centre_m = {-0.02, 0.005, 0.035}, .radius_m = 0.003},
          Ball{.centre_m = {0.005, -0.02, 0.035}, .radius_m = 0.003}};
}

TEST(ContactPlane, TouchesBallsOfUnequalRadii) {
  Feet feet = three_feet();
  feet[0].radius_m = 0.0041;
  feet[1].radius_m = 0.0;
  feet[2].centre_m.z() += 0.0003;
  const ContactPlane plane = contact_plane(Face::plus_z, feet);
  EXPECT_NEAR(plane.normal.norm(), 1.0, 1e-15);
  for (const Ball& ball : feet) {
    EXPECT_NEAR(plane.normal.dot(ball.centre_m) + ball.radius_m, plane.offset_m, 1e-16);
  }
  EXPECT_GT(plane.normal.z(), 0.99);
}

TEST(ContactPlane, ThirtyFiveMicrometresOverSeventyMillimetresAreHalfAMilliradian) {
  // A foot that is 35 um too high at a distance of 70 mm tilts the plane by 0.5 mrad.
  const Feet feet = {Ball{.centre_m = {0.035, 0.02, 0.035}, .radius_m = 0.003},
                     Ball{.centre_m = {-0.035, 0.02, 0.035035}, .radius_m = 0.003},
                     Ball{.centre_m = {0.035, -0.02, 0.035}, .radius_m = 0.003}};
  EXPECT_NEAR(contact_plane(Face::plus_z, feet).normal.x(), std::sin(std::atan(0.5e-3)), 1e-15);
}

TEST(ContactPlane, SaysWhatFeetCannotBe) {
  const auto complaint = [](const Feet& feet) {
    return test::complaint_of<DomainError>(
        [&] { static_cast<void>(contact_plane(Face::plus_z, feet)); });
  };
  EXPECT_EQ(complaint(three_feet()), "accepted");
  Feet feet = three_feet();
  feet[2].centre_m = {0.0, 0.0125, 0.035};
  EXPECT_THAT(complaint(feet), HasSubstr("feet of face +Z are in a line"));
  feet = three_feet();
  feet[1].centre_m = feet[0].centre_m + Eigen::Vector3d(0.005, 0.0, 0.0);
  EXPECT_THAT(complaint(feet), HasSubstr("overlap: the distance of"));
  feet = three_feet();
  feet[1].radius_m = -1e-3;
  EXPECT_THAT(complaint(feet), HasSubstr("not negative"));
  feet = three_feet();
  feet[1].centre_m.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(complaint(feet), HasSubstr("finite"));
  feet = three_feet();
  feet[0].centre_m.z() += 0.02;
  EXPECT_THAT(complaint(feet), HasSubstr("more than 0.2 rad from the nominal direction +Z"));
  feet = three_feet();
  for (Ball& ball : feet) {
    ball.centre_m.z() *= -1.0;
  }
  EXPECT_THAT(complaint(feet), HasSubstr("on the wrong side of the cube's centre"));
  feet = three_feet();
  feet[0].radius_m = 0.022;  // its neighbours are 0.025 and 0.0277 m away
  feet[1].radius_m = 0.0;
  feet[1].centre_m = feet[0].centre_m - Eigen::Vector3d(0.0, 0.0221, 0.0);
  feet[2].radius_m = 0.0;
  EXPECT_THAT(complaint(feet), HasSubstr("plane"));
}

TEST(FeetOfFrame, StandsOnSquareFaces) {
  const CubeFeet feet = feet_of_frame({});
  for (const Face face : all_faces) {
    const ContactPlane plane = contact_plane(face, feet[static_cast<std::size_t>(face)]);
    EXPECT_MATRIX_NEAR(plane.normal, nominal_normal(face), 1e-15);
    EXPECT_NEAR(plane.offset_m, 0.5 * 0.07 + 0.004, 1e-16);
  }
  const CubeGeometry geometry = describe_geometry(Positioner(feet));
  EXPECT_EQ(geometry.angles.size(), 15U);
  EXPECT_NEAR(geometry.worst_from_square_rad, 0.0, 1e-14);
  EXPECT_NEAR(geometry.worst_from_parallel_rad, 0.0, 1e-14);
  EXPECT_NEAR(*geometry.offset_m[3], 0.039, 1e-15);
}

TEST(FeetOfFrame, RefusesFeetBesideTheFace) {
  EXPECT_THROW(static_cast<void>(feet_of_frame({.edge_m = 0.05})), DomainError);
  EXPECT_THROW(static_cast<void>(feet_of_frame({.edge_m = -0.07})), DomainError);
  EXPECT_THROW(static_cast<void>(feet_of_frame({.ball_radius_m = 0.03})), DomainError);
}

TEST(FeetFromPoints, TouchesAtThePoints) {
  std::array<std::array<Eigen::Vector3d, 3>, 6> points;
  const CubeFeet balls = feet_of_frame({.ball_radius_m = 0.0});
  for (std::size_t face = 0; face < 6; ++face) {
    for (std::size_t i = 0; i < 3; ++i) {
      points[face][i] = balls[face][i].centre_m;
    }
  }
  const Positioner cube(feet_from_points(points));
  EXPECT_MATRIX_NEAR(cube.normal(Face::minus_y), nominal_normal(Face::minus_y), 1e-15);
}

TEST(FeetTurnedTo, GivesTheFaceItsMeasuredNormal) {
  const Eigen::Vector3d normal = Eigen::Vector3d(0.002, -0.001, 1.0).normalized();
  const Feet turned = feet_turned_to(Face::plus_z, three_feet(), normal);
  EXPECT_MATRIX_NEAR(contact_plane(Face::plus_z, turned).normal, normal, 1e-15);
  EXPECT_NEAR((turned[0].centre_m - turned[1].centre_m).norm(),
              (three_feet()[0].centre_m - three_feet()[1].centre_m).norm(), 1e-15);
}

TEST(DescribeGeometry, MeasuresSquareAndParallel) {
  FaceNormals normals;
  for (const Face face : all_faces) {
    normals[static_cast<std::size_t>(face)] = nominal_normal(face);
  }
  normals[0] = Eigen::Vector3d(std::cos(0.003), std::sin(0.003), 0.0);
  const CubeGeometry geometry = describe_geometry(Positioner(normals));
  EXPECT_NEAR(geometry.worst_from_square_rad, 0.003, 1e-12);
  EXPECT_NEAR(geometry.worst_from_parallel_rad, 0.003, 1e-12);
  for (const FaceAngle& angle : geometry.angles) {
    if (angle.first == Face::plus_x && angle.second == Face::plus_y) {
      EXPECT_NEAR(angle.deviation_rad, -0.003, 1e-12);
    }
  }
  EXPECT_FALSE(geometry.offset_m[0]);
}

}  // namespace
}  // namespace axiscal
