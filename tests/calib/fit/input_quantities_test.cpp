// SPDX-License-Identifier: Apache-2.0
// The change of readings with uncertain inputs, compared with finite differences and explicit
// covariances.
#include "calib/fit/input_quantities.hpp"

#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "axiscal/core/rotation.hpp"
#include "labelled_set.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

const Eigen::Vector3d uneven_field(0.3, -0.5, 0.9);

ReadingSet set_of_inputs(const Eigen::Vector3d& in_table) {
  return test::labelled_set(test::some_response(), test::gravity_in_table(in_table),
                            standard_design(24), 1e-4, 21);
}

// @return the field in the frame of a cube with these normals that lies at `point`.
Eigen::Vector3d field_in_cube(const FaceNormals& normals,
                              const DesignPoint& point,
                              const Eigen::Vector3d& in_table) {
  return Positioner(normals).rotation_table_from_positioner(point).transpose() * in_table;
}

// @return the change of the field in the cube for a turn of one face [per rad], by a finite
// difference.
Eigen::Vector3d change_by_difference(const DesignPoint& point,
                                     Face face,
                                     const Eigen::Vector3d& turn) {
  constexpr double step = 1e-5;
  FaceNormals more = Positioner().normals();
  FaceNormals less = more;
  Eigen::Vector3d& up = more[static_cast<std::size_t>(face)];
  Eigen::Vector3d& down = less[static_cast<std::size_t>(face)];
  up = rotation_by(step * turn) * up;
  down = rotation_by(-step * turn) * down;
  return (field_in_cube(more, point, uneven_field) - field_in_cube(less, point, uneven_field)) /
         (2.0 * step);
}

Eigen::Matrix<double, 3, 18> change_at(const DesignPoint& point) {
  return change_with_normals(Positioner().rotation_table_from_positioner(point), point,
                             uneven_field);
}

TEST(ChangeWithNormals, IsTheDifferenceOfTwoCubes) {
  for (const DesignEntry& entry : standard_design(24)) {
    const Eigen::Matrix<double, 3, 18> change = change_at(entry.point);
    for (const Face face : all_faces) {
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d turn = Eigen::Vector3d::Unit(axis);
        const Eigen::Vector3d of_normal = turn.cross(nominal_normal(face));
        EXPECT_MATRIX_NEAR(change.middleCols<3>(3 * static_cast<Eigen::Index>(face)) * of_normal,
                           change_by_difference(entry.point, face, turn), 1e-8)
            << entry.point.name() << face_name(face);
      }
    }
  }
}

TEST(ChangeWithNormals, ConcernsTheRestAndTheFenceFaceAlone) {
  for (const DesignEntry& entry : standard_design(12)) {
    const Eigen::Matrix<double, 3, 18> change = change_at(entry.point);
    for (const Face face : all_faces) {
      const bool touches = face == entry.point.rest() || face == entry.point.fence();
      const auto own = change.middleCols<3>(3 * static_cast<Eigen::Index>(face));
      EXPECT_EQ(own.norm() > 0.0, touches) << entry.point.name() << face_name(face);
    }
  }
}

// An error of a normal rotates the field in the cube and does not change its length.
TEST(ChangeWithNormals, TurnsTheFieldAndNoMore) {
  const DesignPoint point(Face::minus_z, Face::plus_y);
  const Eigen::Matrix3d R = Positioner().rotation_table_from_positioner(point);
  const Eigen::RowVectorXd along = (R.transpose() * uneven_field).transpose() * change_at(point);
  for (const Face face : all_faces) {
    const auto first = 3 * static_cast<Eigen::Index>(face);
    const Eigen::Matrix<double, 3, 2> tangents = tangents_of(nominal_normal(face));
    EXPECT_MATRIX_NEAR(along.segment<3>(first) * tangents, Eigen::RowVector2d::Zero(), 1e-12);
  }
}

TEST(InputQuantities, AreNoneIfAllIsExact) {
  const ReadingSet set = set_of_inputs(uneven_field);
  EXPECT_TRUE(input_quantities({}, set, true, set.field).empty());
  Experiment zero;
  zero.positioner = test::uncertain_cube(0.0);
  EXPECT_TRUE(input_quantities(zero, set, true, set.field).empty());
}

TEST(InputQuantities, AreNoneForAFieldWithoutVectors) {
  const ReadingSet set = set_of_inputs(uneven_field);
  Experiment experiment;
  experiment.positioner = test::uncertain_cube(1e-3);
  experiment.stated.slope_u = 1e-3;
  EXPECT_TRUE(input_quantities(experiment, set, true, set.field.without_vectors()).empty());
}

// Slope and direction are inputs only if the field is given. Face normals are always inputs.
TEST(InputQuantities, OfTheFieldCountIfItIsGiven) {
  const ReadingSet set = set_of_inputs(uneven_field);
  Experiment experiment;
  experiment.positioner = test::uncertain_cube(1e-3);
  experiment.stated.slope_u = 2e-3;
  experiment.stated.direction_u_rad = 3e-3;
  const std::vector<InputQuantity> fitted = input_quantities(experiment, set, false, set.field);
  ASSERT_EQ(fitted.size(), 1U);
  EXPECT_EQ(fitted.front().name, "positioner");
  EXPECT_TRUE(std::isnan(fitted.front().u));
  const std::vector<InputQuantity> given = input_quantities(experiment, set, true, set.field);
  ASSERT_EQ(given.size(), 3U);
  EXPECT_EQ(given[1].name, "levelness");
  EXPECT_EQ(given[1].u, 2e-3);
  EXPECT_EQ(given[1].unit, "rad");
  EXPECT_EQ(given[1].parts, 2);
  EXPECT_EQ(given[2].name, "field direction");
  EXPECT_EQ(given[2].u, 3e-3);
  EXPECT_EQ(given[2].parts, 2);
}

// H H^T is the propagated covariance of the field in the sensor.
TEST(InputQuantities, OfTheFacesPropagateTheirCovariance) {
  const ReadingSet set = set_of_inputs(uneven_field);
  Experiment experiment;
  constexpr double u = 2e-3;
  experiment.positioner = test::uncertain_cube(u);
  experiment.rotation_sensor_from_positioner = rotation_by(Eigen::Vector3d(0.3, -0.2, 0.5));
  const Eigen::Matrix3d& mount = experiment.rotation_sensor_from_positioner;
  const InputQuantity faces = input_quantities(experiment, set, false, set.field).front();
  for (const Eigen::Index i : {0, 7, 23}) {
    const DesignPoint& point = *set.readings[static_cast<std::size_t>(i)].point;
    Eigen::Matrix3d expected = Eigen::Matrix3d::Zero();
    for (const Face face : all_faces) {
      const Eigen::Matrix<double, 3, 2> axes = tangents_of(nominal_normal(face));
      for (int t = 0; t < 2; ++t) {
        const Eigen::Vector3d one = u * (mount * change_by_difference(point, face, axes.col(t)));
        expected += one * one.transpose();
      }
    }
    const Eigen::Matrix3Xd H = faces.change(i, 0, set.field);
    ASSERT_EQ(H.cols(), faces.parts);
    EXPECT_MATRIX_NEAR(H * H.transpose(), expected, 1e-8 * u * u);
  }
}

TEST(InputQuantities, OfTheSlopeTurnTheFieldInTheTable) {
  const ReadingSet set = set_of_inputs(uneven_field);
  Experiment experiment;
  experiment.stated.slope_u = 1e-5;
  const InputQuantity slope = input_quantities(experiment, set, true, set.field).front();
  for (const Eigen::Index i : {2, 11}) {
    const Eigen::Matrix3d& R = set.rotation_sensor_from_table[static_cast<std::size_t>(i)];
    const Eigen::Matrix3Xd H = slope.change(i, 1, set.field);
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector3d turned =
          R * (rotation_by(1e-5 * Eigen::Vector3d::Unit(axis)) * uneven_field - uneven_field);
      EXPECT_MATRIX_NEAR(H.col(axis), turned, 1e-9);
    }
  }
}

// The covariance of the direction is equal in all directions across the field: u^2 (|f|^2 I - f
// f^T) in the sensor.
TEST(InputQuantities, OfTheDirectionAreTheSameAllRound) {
  const ReadingSet set = set_of_inputs(uneven_field);
  Experiment experiment;
  constexpr double u = 4e-3;
  experiment.stated.direction_u_rad = u;
  const InputQuantity direction = input_quantities(experiment, set, true, set.field).front();
  for (const Eigen::Index i : {1, 14}) {
    const Eigen::Vector3d f =
        set.rotation_sensor_from_table[static_cast<std::size_t>(i)] * uneven_field;
    const Eigen::Matrix3d expected =
        u * u * (f.squaredNorm() * Eigen::Matrix3d::Identity() - f * f.transpose());
    const Eigen::Matrix3Xd H = direction.change(i, 2, set.field);
    EXPECT_MATRIX_NEAR(H * H.transpose(), expected, 1e-12);
  }
}

TEST(InputQuantities, ChangeWithTheLevelOfTheField) {
  ReadingSet set = set_of_inputs(uneven_field);
  set.readings[5].level = -2.5;
  set.readings[6].level = 0.0;
  Experiment experiment;
  experiment.positioner = test::uncertain_cube(1e-3);
  experiment.stated.slope_u = 1e-3;
  experiment.stated.direction_u_rad = 1e-3;
  const ReadingSet plain = set_of_inputs(uneven_field);
  const std::vector<InputQuantity> at_levels = input_quantities(experiment, set, true, set.field);
  const std::vector<InputQuantity> at_one = input_quantities(experiment, plain, true, plain.field);
  for (std::size_t q = 0; q < at_one.size(); ++q) {
    EXPECT_MATRIX_NEAR(at_levels[q].change(5, 0, set.field),
                       -2.5 * at_one[q].change(5, 0, plain.field), 1e-15);
    EXPECT_EQ(at_levels[q].change(6, 0, set.field).norm(), 0.0);
  }
}

TEST(MountQuantity, TurnsTheFieldInTheSensor) {
  const ReadingSet set = set_of_inputs(uneven_field);
  constexpr double u = 1e-5;
  const InputQuantity mount = mount_quantity(u, set);
  EXPECT_EQ(mount.name, "mount");
  EXPECT_EQ(mount.parts, 3);
  for (const Eigen::Index i : {0, 9, 18}) {
    const Eigen::Vector3d f =
        set.rotation_sensor_from_table[static_cast<std::size_t>(i)] * uneven_field;
    const Eigen::Matrix3Xd H = mount.change(i, 0, set.field);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_MATRIX_NEAR(H.col(axis), rotation_by(u * Eigen::Vector3d::Unit(axis)) * f - f, 1e-9);
    }
    EXPECT_MATRIX_NEAR(f.transpose() * H, Eigen::RowVector3d::Zero(), 1e-18);
  }
}

// The rows are S H, divided by sigma and multiplied by the root of the weight. The columns of the
// inputs follow each other.
TEST(ChangeOfReadings, IsTheChangeOfEachAxisInItsSigma) {
  ReadingSet set = set_of_inputs(uneven_field);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    set.weights(i, 1) = 0.5 + 0.1 * static_cast<double>(i % 10);
  }
  set.weights(4, 2) = 0.0;
  Experiment experiment;
  experiment.stated.slope_u = 1e-3;
  experiment.stated.direction_u_rad = 2e-3;
  std::vector<InputQuantity> inputs = input_quantities(experiment, set, true, set.field);
  inputs.push_back(mount_quantity(3e-3, set));
  const Eigen::Vector3d sigma(1e-4, 2e-4, 4e-4);
  const SolvedReadings run(set, true);
  const Fit fit(run, set.field, sigma);
  const Eigen::MatrixXd changes = input_error_jacobian(inputs, fit, set.field);
  ASSERT_EQ(changes.rows(), 72);
  ASSERT_EQ(changes.cols(), 7);
  const Eigen::MatrixXd X = test::rows_of(set, uneven_field);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::VectorXd w = set.weights.col(k);
    const Eigen::VectorXd b = (X.transpose() * w.asDiagonal() * X)
                                  .ldlt()
                                  .solve(X.transpose() * w.cwiseProduct(set.response.col(k)));
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      Eigen::Matrix<double, 3, 7> H;
      H << inputs[0].change(i, k, set.field), inputs[1].change(i, k, set.field),
          inputs[2].change(i, k, set.field);
      const Eigen::RowVectorXd expected = std::sqrt(w(i)) / sigma(k) * b.tail<3>().transpose() * H;
      EXPECT_MATRIX_NEAR(changes.row(fit.row_of(i, k)), expected, 1e-7);
    }
  }
}

}  // namespace
}  // namespace axiscal
