// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/body.hpp"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "axiscal/calib/reduction.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/instruments/inclination.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

constexpr double sensor_noise = 1e-4;

const Calibration& the_record() {
  static const Calibration one = [] {
    const SensorModel truth = accelerometer_truth();
    Experiment experiment = experiment_for(truth);
    experiment.fit.method = Method::joint;
    return calibrate(experiment,
                     observe(truth, {.points = 24, .noise_sd = sensor_noise, .seed = 3}));
  }();
  return one;
}

// A sensor that is mounted in a model with a rotation, and its readings at an attitude of the
// model.
struct Model {
  Eigen::Matrix3d model_from_sensor = rotation_by(Eigen::Vector3d(0.2, -0.3, 0.5));
  double noise = 0.0;
  mutable RandomStream random = RandomStream(5);

  [[nodiscard]] Eigen::VectorXd read(const Eigen::Vector3d& up) const {
    Eigen::VectorXd v = the_record().sensor.response.at(model_from_sensor.transpose() * up);
    for (double& value : v) {
      value += noise * random.normal();
    }
    return v;
  }
  [[nodiscard]] Eigen::VectorXd read(double pitch_deg, double roll_deg) const {
    return read(rotation_sensor_from_level(pitch_deg * rad_per_deg, roll_deg * rad_per_deg, 0.0,
                                           AxisConvention::forward_left_up)
                    .col(2));
  }
  [[nodiscard]] ReferenceReading at(double pitch_deg, double roll_deg) const {
    return {.row = 1,
            .readings = read(pitch_deg, roll_deg),
            .attitude = StatedAttitude{.pitch_rad = pitch_deg * rad_per_deg,
                                       .roll_rad = roll_deg * rad_per_deg}};
  }
  [[nodiscard]] std::vector<ReferenceReading> at_all(
      const std::vector<std::pair<double, double>>& attitudes) const {
    std::vector<ReferenceReading> all;
    for (const auto& [pitch, roll] : attitudes) {
      all.push_back(at(pitch, roll));
    }
    return all;
  }
};

TEST(BodyRotation, IsFoundByAttitudes) {
  const Model model;
  const BodyRotation body = find_body_rotation(
      the_record(), model.at_all({{0, 0}, {20, 0}, {-20, 0}, {0, 30}, {10, -30}}));
  EXPECT_MATRIX_NEAR(body.rotation_model_from_sensor, model.model_from_sensor, 1e-12);
  EXPECT_LT(body.residual_sd_rad, 1e-12);
  const Reducer reduce(in_model_frame(the_record(), body, true));
  const Eigen::VectorXd v = model.read(12.0, -7.0);
  const ReducedReading reading = reduce(std::vector<double>(v.begin(), v.end()));
  EXPECT_NEAR(reading["pitch_deg"], 12.0, 1e-9);
  EXPECT_NEAR(reading["roll_deg"], -7.0, 1e-9);
}

// The table slopes by 5 mrad. The mean over headings that are half a turn apart removes the slope.
TEST(BodyRotation, IsFoundByFlatFaces) {
  const Model model;
  std::vector<ReferenceReading> all;
  for (const Face face : {Face::minus_z, Face::plus_y}) {
    const Eigen::Vector3d up = -nominal_normal(face);
    const Eigen::Matrix<double, 3, 2> across = tangents_of(up);
    for (const double side : {1.0, -1.0}) {
      const Eigen::Vector3d met = (up + side * 5e-3 * across.col(0)).normalized();
      all.push_back({.row = 1, .readings = model.read(met), .flat = face});
    }
  }
  const BodyRotation body = find_body_rotation(the_record(), all, {.reference_u_rad = 1e-4});
  EXPECT_MATRIX_NEAR(body.rotation_model_from_sensor, model.model_from_sensor, 1e-12);
  all.pop_back();
  EXPECT_THROW(static_cast<void>(find_body_rotation(the_record(), all)), RefusedError);
}

TEST(BodyRotation, NamesTheTurnThatIsOpen) {
  const Model model;
  try {
    static_cast<void>(find_body_rotation(the_record(), model.at_all({{0, 0}, {0, 0}, {0, 0}})));
    FAIL() << "one attitude says nothing of the turn about the vertical";
  } catch (const RefusedError& error) {
    EXPECT_THAT(error.what(),
                testing::HasSubstr("do not determine the rotation about the model's z axis"));
  }
}

TEST(BodyRotation, RefusesReferencesThatContradictWhatIsStated) {
  const Model model{.noise = sensor_noise};
  std::vector<ReferenceReading> all = model.at_all({{0, 0}, {20, 0}, {-20, 0}, {0, 30}});
  EXPECT_NO_THROW(
      static_cast<void>(find_body_rotation(the_record(), all, {.reference_u_rad = 1e-4})));
  all[1].attitude->pitch_rad += 0.01;
  all[1].row = 2;
  try {
    static_cast<void>(find_body_rotation(the_record(), all, {.reference_u_rad = 1e-4}));
    FAIL() << "0.6 degrees off";
  } catch (const RefusedError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("row 2"));
  }
}

// The error of the calibration cancels at the attitudes of the references (method.md, section 11).
TEST(BodyRotation, SharesTheCalibrationsErrorWithItsUse) {
  const Model model;
  const BodyRotation body = find_body_rotation(
      the_record(), model.at_all({{0, 0}, {30, 0}, {-30, 0}, {0, 40}}), {.reference_u_rad = 1e-6});
  const auto variance = [&](bool same_record) {
    const Calibration in_model = in_model_frame(the_record(), body, same_record);
    return in_model.fit.statistics->covariance.diagonal().sum();
  };
  EXPECT_LT(variance(true), variance(false));
  // With another record the errors are independent, so the variance is larger than that of the
  // calibration.
  EXPECT_GT(variance(false), the_record().fit.statistics->covariance.diagonal().sum());
}

TEST(BodyRotation, ATareSetsTwoAnglesAndItsRange) {
  const Model model;
  BodyRotation body = find_body_rotation(
      the_record(), model.at_all({{0, 0}, {20, 0}, {-20, 0}, {0, 30}, {10, -30}}));
  Model slipped = model;
  slipped.model_from_sensor =
      rotation_by(Eigen::Vector3d(0.01, -0.02, 0.0)) * model.model_from_sensor;
  const BodyRotation again = corrected_by_tare(the_record(), body, {slipped.at(0, 0)});
  EXPECT_MATRIX_NEAR(again.rotation_model_from_sensor, slipped.model_from_sensor, 3e-4);
  EXPECT_NEAR(again.tare_rad, std::hypot(0.01, 0.02), 1e-4);
  EXPECT_THROW(static_cast<void>(
                   corrected_by_tare(the_record(), body, {slipped.at(0, 0), slipped.at(20, 0)})),
               RefusedError);
  ReferenceReading far = slipped.at(30, 0);
  far.attitude.reset();
  EXPECT_THROW(static_cast<void>(corrected_by_tare(the_record(), body, {far})), RefusedError);
  far.flat = Face::minus_z;  // one heading does not remove the slope of the table
  EXPECT_THROW(static_cast<void>(corrected_by_tare(the_record(), body, {far})), RefusedError);
}

// Without references the turn about the vertical has an uncertainty of 1 degree. If the record is
// another one, no error cancels.
TEST(BodyRotation, ATareAloneLeavesTheTurnAboutTheVertical) {
  const Model model{.model_from_sensor = rotation_by(Eigen::Vector3d(0.01, -0.02, 0.0))};
  const BodyRotation body = corrected_by_tare(the_record(), {}, {model.at(0, 0)});
  EXPECT_NEAR(std::sqrt(body.covariance(2, 2)), 1.0 * rad_per_deg, 1e-6);
  EXPECT_LT(std::sqrt(body.covariance(0, 0)), 1e-3);
  const BodyRotation found = find_body_rotation(
      the_record(), model.at_all({{0, 0}, {30, 0}, {-30, 0}, {0, 40}}), {.reference_u_rad = 1e-6});
  const auto vertical = [&](bool same_record) {
    return corrected_by_tare(the_record(), found, {model.at(0, 0)},
                             {.reference_u_rad = 1e-6, .same_record = same_record})
        .covariance(2, 2);
  };
  EXPECT_NEAR(vertical(true), vertical(false), 1e-9 * vertical(true));
  EXPECT_EQ(corrected_by_tare(the_record(), found, {model.at(0, 0)}, {.same_record = false})
                .by_parameters.row(2)
                .norm(),
            0.0);
}

TEST(BodyRotation, ComesBackFromItsFile) {
  const Model model{.noise = sensor_noise};
  BodyRotation body = find_body_rotation(
      the_record(), model.at_all({{0, 0}, {20, 0}, {-20, 0}, {0, 30}, {10, -30}}));
  body.record_sha256 = "abc";
  const std::string text = body_rotation_json(body);
  const BodyRotation back = parse_body_rotation(text, "body.json");
  EXPECT_EQ(body_rotation_json(back), text);
  EXPECT_MATRIX_NEAR(back.by_parameters, body.by_parameters, 0.0);
  EXPECT_MATRIX_NEAR(back.covariance_of_references, body.covariance_of_references, 0.0);
}

TEST(JointMovement, IsTheAngleAndItsChance) {
  const Eigen::Matrix3d C = 1e-8 * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  constexpr double dof = 60.0;
  const JointMovement still = joint_movement(up, C, rotation_by({1e-4, 0.0, 0.0}) * up, C, dof);
  EXPECT_NEAR(still.angle_rad, 1e-4, 1e-9);
  EXPECT_NEAR(still.u_rad, std::sqrt(2e-8), 1e-9);
  EXPECT_GT(still.p_value, 0.1);
  EXPECT_LT(joint_movement(up, C, rotation_by({2e-3, 0.0, 0.0}) * up, C, dof).p_value, 1e-6);
  EXPECT_TRUE(std::isnan(joint_movement(up, C, up, {}, dof).p_value));
}

TEST(CompareRotations, TellsASlip) {
  const Model model{.noise = sensor_noise};
  const std::vector<std::pair<double, double>> attitudes = {
      {0, 0}, {20, 0}, {-20, 0}, {0, 30}, {0, -30}};
  const BodyRotation before = find_body_rotation(the_record(), model.at_all(attitudes));
  EXPECT_GT(
      compare_rotations(before, find_body_rotation(the_record(), model.at_all(attitudes))).p_value,
      1e-3);
  Model slipped = model;
  slipped.model_from_sensor =
      rotation_by(Eigen::Vector3d(0.0, 0.005, 0.0)) * model.model_from_sensor;
  const BodyChange change =
      compare_rotations(before, find_body_rotation(the_record(), slipped.at_all(attitudes)));
  EXPECT_LT(change.p_value, 1e-6);
  EXPECT_NEAR(change.turn_rad.y(), 0.005, 5.0 * change.u_rad.y());
  // If both rotations have the same record, its error is common and cancels.
  BodyRotation once = before;
  once.record_sha256 = "a";
  BodyRotation more = once;
  EXPECT_LT(compare_rotations(once, more).u_rad.norm(), change.u_rad.norm());
  EXPECT_THROW(static_cast<void>(compare_rotations(BodyRotation(), BodyRotation())), RefusedError);
}

}  // namespace
}  // namespace axiscal::test
