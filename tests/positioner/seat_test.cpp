// SPDX-License-Identifier: Apache-2.0
#include "axiscal/positioner/seat.hpp"

#include <cmath>
#include <cstdio>
#include <functional>
#include <vector>

#include <Eigen/Geometry>

#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/positioner/design.hpp"
#include "axiscal/positioner/positioner.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

// ---- an independent solution by minimisation, without contacts, pairs or angles ----

double golden_minimum(const std::function<double(double)>& f, double low, double high) {
  const double ratio = 0.5 * (std::sqrt(5.0) - 1.0);
  double a = high - ratio * (high - low);
  double b = low + ratio * (high - low);
  double fa = f(a);
  double fb = f(b);
  while (high - low > 1e-13) {
    if (fa < fb) {
      high = b;
      b = a;
      fb = fa;
      a = high - ratio * (high - low);
      fa = f(a);
    } else {
      low = a;
      a = b;
      fa = fb;
      b = low + ratio * (high - low);
      fb = f(b);
    }
  }
  return 0.5 * (low + high);
}

double farthest(const Feet& feet, const Eigen::Vector3d& direction) {
  double most = -1e300;
  for (const Ball& ball : feet) {
    most = std::max(most, direction.dot(ball.centre_m) + ball.radius_m);
  }
  return most;
}

// @return the direction in the cube that points down when its centre is lowest.
Eigen::Vector3d lowest_direction(Face face, const Feet& feet) {
  const int axis = axis_of(face);
  const Eigen::Vector3d first = Eigen::Vector3d::Unit((axis + 1) % 3);
  const Eigen::Vector3d second = Eigen::Vector3d::Unit((axis + 2) % 3);
  const auto direction = [&](double a, double b) -> Eigen::Vector3d {
    return (nominal_normal(face) + a * first + b * second).normalized();
  };
  const auto best_b = [&](double a) {
    return golden_minimum([&](double b) { return farthest(feet, direction(a, b)); }, -0.1, 0.1);
  };
  const double a =
      golden_minimum([&](double x) { return farthest(feet, direction(x, best_b(x))); }, -0.1, 0.1);
  return direction(a, best_b(a));
}

struct NumericalSeat {
  Eigen::Matrix3d rotation_table_from_positioner;
  int minima = 0;
};

// @return the seat in which the cube is as low as possible, and then as near to the fence as
// possible.
NumericalSeat numerical_seat(const CubeFeet& cube, const DesignPoint& point, double lean_rad) {
  const Eigen::Vector3d z =
      -lowest_direction(point.rest(), cube[static_cast<std::size_t>(point.rest())]);
  const Eigen::Vector3d guess = nominal_normal(point.fence());
  Eigen::Matrix3d start;
  start.row(1) = (guess - guess.dot(z) * z).normalized();
  start.row(2) = z;
  start.row(0) = start.row(1).cross(start.row(2));
  const Feet& feet = cube[static_cast<std::size_t>(point.fence())];
  const Eigen::Vector3d fence(0.0, std::cos(lean_rad), std::sin(lean_rad));
  const auto turned = [&](double turn) -> Eigen::Matrix3d {
    return Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix() * start;
  };
  const auto distance = [&](double turn) {
    return farthest(feet, turned(turn).transpose() * fence);
  };
  NumericalSeat seat{.rotation_table_from_positioner = start};
  double nearest = 1e300;
  constexpr int steps = 2000;
  constexpr double step = 0.2 / steps;
  for (int i = 1; i < steps; ++i) {
    const double turn = -0.1 + step * i;
    if (distance(turn) < distance(turn - step) && distance(turn) <= distance(turn + step)) {
      const double best = golden_minimum(distance, turn - step, turn + step);
      ++seat.minima;
      if (distance(best) < nearest) {
        nearest = distance(best);
        seat.rotation_table_from_positioner = turned(best);
      }
    }
  }
  return seat;
}

// A cube whose feet have random positions, heights and radii.
CubeFeet random_cube(RandomStream& random, bool middle_foot) {
  CubeFeet cube;
  const auto about = [&](double value, double range) {
    return value + range * (2.0 * random.uniform() - 1.0);
  };
  for (const Face face : all_faces) {
    BallFrame frame;
    if (middle_foot) {
      frame.foot_positions_m = {Eigen::Vector2d(0.025, 0.025), Eigen::Vector2d(-0.025, 0.025),
                                Eigen::Vector2d(0.0, -0.025)};
    }
    for (Eigen::Vector2d& position : frame.foot_positions_m) {
      position += 0.004 * Eigen::Vector2d(about(0.0, 1.0), about(0.0, 1.0));
    }
    Feet feet = feet_of_frame(frame)[static_cast<std::size_t>(face)];
    for (Ball& ball : feet) {
      ball.centre_m += about(0.0, 3e-4) * nominal_normal(face);
      ball.radius_m = about(0.003, 2e-4);
    }
    cube[static_cast<std::size_t>(face)] = feet;
  }
  return cube;
}

TEST(Seat, AgreesWithMinimisingForAThousandRandomCubes) {
  RandomStream random(11);
  const std::vector<DesignEntry> points = standard_design(24);
  int rocking = 0;
  double worst = 0.0;
  for (int trial = 0; trial < 1000; ++trial) {
    const CubeFeet feet = random_cube(random, trial % 2 == 0);
    const double lean_rad = 0.02 * (2.0 * random.uniform() - 1.0);
    const Positioner cube(feet, {.fence_lean_rad = lean_rad});
    const DesignPoint& point = points[static_cast<std::size_t>(trial) % points.size()].point;
    const Seat& seat = cube.seat(point);
    ASSERT_EQ(seat.defect, "") << "cube " << trial;
    const NumericalSeat numerical = numerical_seat(feet, point, lean_rad);
    worst = std::max(worst, (cube.rotation_table_from_positioner(point) -
                             numerical.rotation_table_from_positioner)
                                .cwiseAbs()
                                .maxCoeff());
    EXPECT_EQ(seat.rocks, numerical.minima > 1) << "cube " << trial << ", " << point.name();
    rocking += seat.rocks ? 1 : 0;
  }
  std::printf("1000 cubes: largest difference of a rotation's entries %.1e, %d seats rock\n", worst,
              rocking);
  EXPECT_LT(worst, 1e-10);
  EXPECT_GT(rocking, 20);  // rocking seats do occur
}

TEST(Seat, OfAPerfectFrameIsTheNominalOne) {
  const Positioner ideal;
  const Positioner frame(feet_of_frame({}));
  for (const DesignEntry& entry : standard_design(24)) {
    EXPECT_MATRIX_NEAR(frame.rotation_table_from_positioner(entry.point),
                       ideal.rotation_table_from_positioner(entry.point), 1e-15);
    EXPECT_FALSE(frame.seat(entry.point).rocks);
  }
}

TEST(Seat, TakesTheNearerOfTwoAndSaysThatItRocks) {
  BallFrame drawn;
  drawn.foot_positions_m = {Eigen::Vector2d(0.025, 0.025), Eigen::Vector2d(-0.025, 0.025),
                            Eigen::Vector2d(5e-5, -0.025)};
  CubeFeet feet = feet_of_frame(drawn);
  const DesignPoint point(Face::plus_x,
                          Face::plus_y);  // +Y: positions are (z, x), z along the fence
  EXPECT_FALSE(Positioner(feet).seat(point).rocks);
  Ball& middle = feet[static_cast<std::size_t>(Face::plus_y)][2];
  middle.centre_m.y() += 1e-4;
  const Seat seat = Positioner(feet).seat(point);
  EXPECT_TRUE(seat.rocks);
  // The middle foot is beside the centre, at z = 0.05 mm. If it and the foot at -25 mm touch the
  // fence, the centre is nearer to the fence than with the other pair.
  EXPECT_THAT(seat.contacts, testing::UnorderedElementsAre(1, 2));
  EXPECT_NEAR(std::abs(seat.turn_rad), 1e-4 / 0.02505, 2e-5);
}

TEST(Seat, FollowsALeaningFence) {
  CubeFeet feet = feet_of_frame({});
  const DesignPoint point(Face::minus_z, Face::plus_y);
  // Foot 0 is 18 mm higher than foot 1. Positions on +Y are (z, x), and x is along the fence.
  const double lean = 0.01;
  const Positioner cube(feet, {.fence_lean_rad = lean});
  const Seat& seat = cube.seat(point);
  const auto [i, j] = seat.contacts;
  const Eigen::Matrix3d& R = seat.rotation_table_from_positioner;
  const Eigen::Vector3d fence(0.0, std::cos(lean), std::sin(lean));
  const auto reach = [&](int k) {
    const Ball& ball = feet[static_cast<std::size_t>(Face::plus_y)][static_cast<std::size_t>(k)];
    return fence.dot(R * ball.centre_m) + ball.radius_m;
  };
  EXPECT_NEAR(reach(i), reach(j), 1e-15);
  EXPECT_LE(reach(3 - i - j), reach(i));
  EXPECT_GT(std::abs(seat.turn_rad), 1e-3);
}

TEST(Seat, RefusesWhatCannotBe) {
  CubeFeet feet = feet_of_frame({});
  const auto defect = [](const CubeFeet& cube, Face rest, Face fence) {
    return Positioner(cube).seat({rest, fence}).defect;
  };
  // All feet of the rest face are on one side of its middle, so the cube tips over.
  Feet& bottom = feet[static_cast<std::size_t>(Face::minus_z)];
  bottom[0].centre_m.head<2>() = Eigen::Vector2d(0.03, 0.01);
  bottom[1].centre_m.head<2>() = Eigen::Vector2d(0.005, 0.03);
  bottom[2].centre_m.head<2>() = Eigen::Vector2d(0.03, -0.02);
  EXPECT_THAT(defect(feet, Face::minus_z, Face::plus_y), HasSubstr("tip"));
  EXPECT_EQ(defect(feet, Face::plus_z, Face::plus_y), "");
  EXPECT_THAT(test::complaint_of<RefusedError>([&] {
                static_cast<void>(
                    Positioner(feet).rotation_table_from_positioner({Face::minus_z, Face::plus_y}));
              }),
              HasSubstr("rest -Z, fence +Y: the cube cannot lie in this way: the cube would tip"));

  // All feet of the fence face are on one side, so the push turns the cube away.
  feet = feet_of_frame({});
  for (Ball& ball : feet[static_cast<std::size_t>(Face::plus_y)]) {
    ball.centre_m.x() += 0.028;
  }
  EXPECT_THAT(defect(feet, Face::minus_z, Face::plus_y), HasSubstr("centre between them"));

  // A foot of a side face is below the table, and a foot of another face is behind the fence.
  feet = feet_of_frame({});
  feet[static_cast<std::size_t>(Face::plus_x)][0].centre_m.z() = -0.04;
  EXPECT_THAT(defect(feet, Face::minus_z, Face::plus_y), HasSubstr("face +X reaches below"));
  feet = feet_of_frame({});
  feet[static_cast<std::size_t>(Face::plus_x)][0].centre_m.y() = 0.04;
  EXPECT_THAT(defect(feet, Face::minus_z, Face::plus_y), HasSubstr("face +X reaches through"));
}

TEST(Positioner, TakesFeetAndMeasuredNormalsTogether) {
  PositionerDescription description{.id = "both"};
  const CubeFeet feet = feet_of_frame({});
  for (std::size_t face = 0; face < 6; ++face) {
    description.faces[face].feet = feet[face];
  }
  const Eigen::Vector3d normal = Eigen::Vector3d(0.002, 1.0, -0.003).normalized();
  description.faces[2].normal = normal;
  const Positioner cube(description);
  EXPECT_MATRIX_NEAR(cube.normal(Face::plus_y), normal, 1e-15);
  const Seat& seat = cube.seat({Face::minus_z, Face::plus_y});
  EXPECT_NE(seat.contacts.front(), -1);
  // The line through the two feet is along the fence, whatever the z component of the normal.
  const Feet& turned = *cube.feet(Face::plus_y);
  const Eigen::Vector3d line = seat.rotation_table_from_positioner *
                               (turned[static_cast<std::size_t>(seat.contacts[0])].centre_m -
                                turned[static_cast<std::size_t>(seat.contacts[1])].centre_m);
  EXPECT_NEAR(line.y(), 0.0, 1e-15);
}

TEST(Positioner, RefusesBallsOfTwoFacesInEachOther) {
  // The balls are at the edges, so a foot of +X and one of +Y overlap.
  BallFrame frame{.ball_radius_m = 0.006};
  frame.foot_positions_m = {Eigen::Vector2d(0.033, 0.02), Eigen::Vector2d(0.02, 0.033),
                            Eigen::Vector2d(-0.02, -0.02)};
  EXPECT_THAT(
      test::complaint_of<DomainError>([&] { static_cast<void>(Positioner(feet_of_frame(frame))); }),
      HasSubstr("of face +X and those of face +Y overlap"));
}

}  // namespace
}  // namespace axiscal
