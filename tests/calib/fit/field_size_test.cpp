// SPDX-License-Identifier: Apache-2.0
// The test of the size of the field, compared with the dense matrices A, P and V of its definition.
#include "calib/fit/field_size.hpp"

#include <cmath>

#include <Eigen/Dense>
#include <gmock/gmock.h>

#include "axiscal/core/rotation.hpp"
#include "calib/fit/estimation.hpp"
#include "labelled_set.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

constexpr double size_noise = 1e-4;

// A run, its fit and the check of the field's size.
struct SizedRun {
  Experiment experiment;
  ReadingSet set;
  Method method = Method::joint;
  TableField field;
  Calibration calibration;

  [[nodiscard]] std::optional<FieldSizeCheck> check() const {
    const SolvedReadings solved(set, method == Method::known);
    return check_field_size(experiment, solved, method, field, calibration);
  }
};

SizedRun sized_run(ReadingSet set, Method method, const Positioner& positioner = Positioner()) {
  SizedRun run{.set = std::move(set), .method = method};
  run.experiment.positioner = positioner;
  const Estimate estimate =
      method == Method::known
          ? estimate_known(run.set, test::gravity_in_table(test::sloping_gravity))
          : estimate_joint(run.set);
  run.field = estimate.field;
  run.calibration.sensor.response = estimate.response;
  run.calibration.fit.statistics = estimate.statistics;
  return run;
}

// @return the standard design of `points` points, `times` times.
std::vector<DesignEntry> sized_design(int points, int times) {
  std::vector<DesignEntry> all;
  for (int t = 0; t < times; ++t) {
    const std::vector<DesignEntry> one = standard_design(points);
    all.insert(all.end(), one.begin(), one.end());
  }
  return all;
}

ReadingSet sized_set(int points, int times, std::uint64_t seed, double noise_sd = size_noise) {
  return test::labelled_set(test::some_response(), test::gravity_in_table(test::sloping_gravity),
                            sized_design(points, times), noise_sd, seed);
}

// @return the field of a reading at `point` if the cube has these face normals.
Eigen::Vector3d met_with_normals(const FaceNormals& normals,
                                 const DesignPoint& point,
                                 const Eigen::Vector3d& in_table) {
  const Eigen::Vector3d z = -normals[static_cast<std::size_t>(point.rest())];
  const Eigen::Vector3d& fence = normals[static_cast<std::size_t>(point.fence())];
  const Eigen::Vector3d y = (fence - fence.dot(z) * z).normalized();
  Eigen::Matrix3d R;
  R << y.cross(z), y, z;
  return R * in_table;
}

// @return the changes of the readings with 12 errors of the normals (two for each face, sd `u`), by
// finite differences; 3n x 12.
Eigen::MatrixXd change_with_faces(const SizedRun& run, double u) {
  const Eigen::Index n = run.set.size();
  Eigen::MatrixXd H(3 * n, 12);
  Eigen::Index column = 0;
  for (const Face face : all_faces) {
    for (int axis = 0; axis < 3; ++axis) {
      if (axis == axis_of(face)) {
        continue;
      }
      std::array<FaceNormals, 2> moved;
      for (const bool plus : {true, false}) {
        FaceNormals& normals = moved[plus ? 0 : 1];
        for (const Face any : all_faces) {
          normals[static_cast<std::size_t>(any)] = nominal_normal(any);
        }
        Eigen::Vector3d& own = normals[static_cast<std::size_t>(face)];
        own = (own + (plus ? 1e-6 : -1e-6) * Eigen::Vector3d::Unit(axis)).normalized();
      }
      for (Eigen::Index i = 0; i < n; ++i) {
        const DesignPoint& point = *run.set.readings[static_cast<std::size_t>(i)].point;
        const Eigen::Vector3d change = (met_with_normals(moved[0], point, run.field.vector(0)) -
                                        met_with_normals(moved[1], point, run.field.vector(0))) /
                                       2e-6;
        H.block<3, 1>(3 * i, column) = u * run.calibration.sensor.response.sensitivity * change;
      }
      ++column;
    }
  }
  return H;
}

// The check by dense matrices with three rows for each reading [unit of the readings].
struct DenseLengths {
  double squares = 0.0;
  double by_noise = 0.0;
  double by_inputs = 0.0;
  double degrees_of_freedom = 0.0;

  // @param pure  standard deviations of the axes.
  // @param H     change of the readings with each input, 3n rows.
  DenseLengths(const SizedRun& run, const Eigen::Vector3d& pure, const Eigen::MatrixXd& H) {
    const Eigen::Index n = run.set.size();
    const Eigen::Matrix3d S = run.calibration.sensor.response.sensitivity;
    const Eigen::Vector3d sigma = run.calibration.fit.statistics->residual_sd;
    const Eigen::Vector3d F = run.field.vector(0);
    const Eigen::Matrix<double, 3, 2> tangents = F.norm() * tangents_of(F);
    const Eigen::Index shared = run.method == Method::known ? 0 : 2;
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3 * n, 12 + shared);
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, 3 * n);
    Eigen::VectorXd V(3 * n);
    Eigen::VectorXd weight(3 * n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Matrix3d& R = run.set.rotation_sensor_from_table[static_cast<std::size_t>(i)];
      const Eigen::Vector3d met = R * F;
      for (Eigen::Index k = 0; k < 3; ++k) {
        J(3 * i + k, 4 * k) = 1.0;
        J.block<1, 3>(3 * i + k, 4 * k + 1) = met.transpose();
        J.row(3 * i + k).tail(shared) = (S.row(k) * R * tangents).leftCols(shared);
      }
      A.block<1, 3>(i, 3 * i) = met.normalized().transpose() * S.inverse();
      V.segment<3>(3 * i) = pure.cwiseAbs2();
      weight.segment<3>(3 * i) = sigma.cwiseAbs2().cwiseInverse();
      const Eigen::Vector3d found = S.inverse() * (run.set.response.row(i).transpose() -
                                                   run.calibration.sensor.response.bias);
      squares += std::pow(found.norm() - F.norm(), 2);
    }
    const Eigen::MatrixXd N = J.transpose() * weight.asDiagonal() * J;
    const Eigen::MatrixXd P = Eigen::MatrixXd::Identity(3 * n, 3 * n) -
                              J * N.ldlt().solve(J.transpose() * weight.asDiagonal());
    const Eigen::MatrixXd noise = A * P * V.asDiagonal() * P.transpose() * A.transpose();
    const Eigen::MatrixXd inputs = A * P * H;
    by_noise = noise.trace();
    by_inputs = inputs.squaredNorm();
    const Eigen::MatrixXd all = noise + inputs * inputs.transpose();
    degrees_of_freedom = std::pow(all.trace(), 2) / all.squaredNorm();
  }
};

void expect_dense(const FieldSizeCheck& check, const DenseLengths& dense, const SizedRun& run) {
  const double n = static_cast<double>(run.set.size());
  const double F = run.field.vector(0).norm();
  EXPECT_EQ(check.orientations, static_cast<int>(run.set.size()));
  EXPECT_NEAR(check.relative_sd, std::sqrt(dense.squares / n) / F, 1e-3 * check.relative_sd);
  EXPECT_NEAR(check.by_noise, std::sqrt(dense.by_noise / n) / F, 1e-4 * check.by_noise);
  EXPECT_NEAR(check.by_inputs, std::sqrt(dense.by_inputs / n) / F, 1e-4 * check.by_noise);
  EXPECT_NEAR(check.degrees_of_freedom, dense.degrees_of_freedom, 1e-3 * dense.degrees_of_freedom);
}

class FieldSizeByMethod : public testing::TestWithParam<Method> {};

TEST_P(FieldSizeByMethod, AgreesWithDenseMatrices) {
  const SizedRun run = sized_run(sized_set(24, 1, 1), GetParam());
  const auto check = run.check();
  ASSERT_TRUE(check.has_value());
  expect_dense(
      *check,
      DenseLengths(run, run.calibration.fit.statistics->residual_sd, Eigen::MatrixXd::Zero(72, 0)),
      run);
  EXPECT_EQ(check->by_inputs, 0.0);
}

// If there are repeats, the noise is their scatter and not that of the residuals.
TEST_P(FieldSizeByMethod, TakesTheNoiseOfRepeats) {
  const SizedRun run = sized_run(sized_set(12, 3, 2), GetParam());
  const std::vector<LackOfFit>& repeats = run.calibration.fit.statistics->lack_of_fit;
  ASSERT_EQ(repeats.size(), 3U);
  const Eigen::Vector3d pure(repeats[0].pure_error_sd, repeats[1].pure_error_sd,
                             repeats[2].pure_error_sd);
  const auto check = run.check();
  ASSERT_TRUE(check.has_value());
  expect_dense(*check, DenseLengths(run, pure, Eigen::MatrixXd::Zero(108, 0)), run);
}

TEST_P(FieldSizeByMethod, CountsUncertainNormals) {
  constexpr double u = 3e-4;
  const SizedRun run = sized_run(sized_set(24, 1, 3), GetParam(), test::uncertain_cube(u));
  const auto check = run.check();
  ASSERT_TRUE(check.has_value());
  EXPECT_GT(check->by_inputs, 0.3 * check->by_noise);
  expect_dense(
      *check,
      DenseLengths(run, run.calibration.fit.statistics->residual_sd, change_with_faces(run, u)),
      run);
}

// Under the null hypothesis p is uniformly distributed.
TEST_P(FieldSizeByMethod, IsUniformIfAllIsWell) {
  constexpr int runs = 150;
  double mean = 0.0;
  int small = 0;
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {
    const auto check = sized_run(sized_set(24, 1, seed), GetParam()).check();
    ASSERT_TRUE(check.has_value());
    mean += check->p_value / runs;
    small += check->p_value < 0.1 ? 1 : 0;
  }
  EXPECT_NEAR(mean, 0.5, 0.1);
  EXPECT_LE(small, 30);
  EXPECT_GE(small, 4);
}

INSTANTIATE_TEST_SUITE_P(Methods,
                         FieldSizeByMethod,
                         testing::Values(Method::joint, Method::known),
                         [](const auto& method) {
                           return method.param == Method::joint ? "joint" : "known";
                         });

// Readings of a cube whose normals have errors of `off` [rad] (sd). The cube is taken as nominal.
ReadingSet of_a_wrong_cube(double off, std::uint64_t seed) {
  FaceNormals normals;
  RandomStream random(seed, 5);
  for (const Face face : all_faces) {
    Eigen::Vector3d normal = nominal_normal(face);
    const Eigen::Vector3d error = off * random.normals<3>();
    normal = (normal + error - error.dot(normal) * normal).normalized();
    normals[static_cast<std::size_t>(face)] = normal;
  }
  ReadingSet set = sized_set(24, 2, seed);
  for (std::size_t i = 0; i < set.readings.size(); ++i) {
    const Eigen::Vector3d nominal = set.rotation_sensor_from_table[i] * test::sloping_gravity;
    const Eigen::Vector3d real =
        met_with_normals(normals, *set.readings[i].point, test::sloping_gravity);
    set.response.row(static_cast<Eigen::Index>(i)) +=
        (test::some_response().sensitivity * (real - nominal)).transpose();
  }
  return set;
}

TEST(CheckFieldSize, ShowsACubeThatIsWorseThanStated) {
  int shown = 0;
  int shown_if_stated = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    constexpr double off = 1e-3;
    const ReadingSet set = of_a_wrong_cube(off, seed);
    shown += sized_run(set, Method::joint).check()->p_value < 0.01 ? 1 : 0;
    shown_if_stated +=
        sized_run(set, Method::joint, test::uncertain_cube(off)).check()->p_value < 0.01 ? 1 : 0;
  }
  EXPECT_GE(shown, 18);
  EXPECT_LE(shown_if_stated, 2);
}

TEST(CheckFieldSize, DoesNotDependOnTheUnitOfReadings) {
  const ReadingSet set = sized_set(24, 2, 7);
  ReadingSet scaled = set;
  scaled.response *= 1e4;
  const auto a = sized_run(set, Method::joint, test::uncertain_cube(1e-4)).check();
  const auto b = sized_run(scaled, Method::joint, test::uncertain_cube(1e-4)).check();
  EXPECT_NEAR(b->relative_sd, a->relative_sd, 1e-9 * a->relative_sd);
  EXPECT_NEAR(b->by_inputs, a->by_inputs, 1e-7 * a->by_inputs);
  EXPECT_NEAR(b->p_value, a->p_value, 1e-6);
}

// One reading has a wrong length. p is small although the reading also increases the residuals.
TEST(CheckFieldSize, ShowsOneLengthThatIsOff) {
  ReadingSet set = sized_set(24, 1, 8);
  const Eigen::Vector3d met = set.rotation_sensor_from_table[5] * test::sloping_gravity;
  set.response.row(5) += (20.0 * size_noise * test::some_response().sensitivity * met).transpose();
  EXPECT_LT(sized_run(set, Method::known).check()->p_value, 0.01);
  EXPECT_GT(sized_run(sized_set(24, 1, 8), Method::known).check()->p_value, 0.05);
}

TEST(CheckFieldSize, IsNotCheckedIfALengthIsUnknown) {
  const SizedRun run = sized_run(sized_set(24, 1, 9), Method::known);
  ASSERT_TRUE(run.check().has_value());
  SizedRun robust = run;
  robust.set.robust = true;
  EXPECT_FALSE(robust.check().has_value());
  SizedRun left_out = run;
  left_out.set.weights(3, 1) = 0.0;
  EXPECT_FALSE(left_out.check().has_value());
  SizedRun one_sided = run;
  one_sided.experiment.instrument.one_sided = true;
  EXPECT_FALSE(one_sided.check().has_value());
  SizedRun dark = run;
  dark.set.readings[2].level = 0.0;
  EXPECT_FALSE(dark.check().has_value());
  SizedRun by_field = run;
  by_field.field = run.field.without_vectors();
  EXPECT_FALSE(by_field.check().has_value());
  SizedRun without_statistics = run;
  without_statistics.calibration.fit.statistics.reset();
  EXPECT_FALSE(without_statistics.check().has_value());
  SizedRun second = run;
  second.set.also_kinds = {"geomagnetic"};
  second.set.also_in_table = {Eigen::Vector3d::UnitX()};
  EXPECT_FALSE(second.check().has_value());
}

TEST(CheckFieldSize, IsNotCheckedForTwoAxesOrVeryManyReadings) {
  ReadingSet two = sized_set(24, 1, 10);
  two.response.conservativeResize(Eigen::NoChange, 2);
  two.weights.conservativeResize(Eigen::NoChange, 2);
  two.axes.resize(2);
  two.nominal.resize(2);
  EXPECT_FALSE(sized_run(two, Method::known).check().has_value());
  EXPECT_TRUE(sized_run(sized_set(24, 10, 11), Method::known).check().has_value());
  EXPECT_FALSE(sized_run(sized_set(12, 21, 11), Method::known).check().has_value());
}

}  // namespace
}  // namespace axiscal
