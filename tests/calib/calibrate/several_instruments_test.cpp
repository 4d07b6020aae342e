// SPDX-License-Identifier: Apache-2.0
// Instruments of several kinds in one cube, face names of the user, a temperature sensor for each
// axis.
#include <numbers>

#include <gtest/gtest.h>

#include "axiscal/calib/assembly.hpp"
#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/calibrate_run.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/experiment_json.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/calib/reduction.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/instruments/inclination.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

using testing::HasSubstr;

axiscal::Run run_of(const std::string& text, const Experiment& experiment) {
  std::size_t at = 0;
  CsvReader csv(
      [&](char* to, std::size_t size) {
        const std::size_t count = text.copy(to, size, at);
        at += count;
        return count;
      },
      "run.csv");
  return read_observations(csv, observation_columns(experiment, Units::one));
}

// An accelerometer L and a magnetometer M in one cube.
struct TwoKinds {
  SensorModel accelerometer = accelerometer_truth();
  SensorModel magnetometer =
      truth_of({.bias = Eigen::Vector3d(100.0, -50.0, 20.0),
                .sensitivity = Eigen::Matrix3d::Identity() * rotation_by({0.01, -0.02, 0.03})},
               "magnetometer");
  Eigen::Vector3d magnetic = Eigen::Vector3d(3000.0, 18000.0, -43000.0);

  [[nodiscard]] Experiment experiment() const {
    Experiment all;
    SlotSetup left{.slot = "L", .instrument = accelerometer.instrument, .field = {}};
    SlotSetup right{.slot = "M", .instrument = axiscal::magnetometer("nT"), .field = {}};
    left.field.of = make_field("gravity");
    right.field.of = make_field("geomagnetic");
    right.field.magnitude = magnetic.norm();
    all.slots = {left, right};
    return all;
  }

  [[nodiscard]] std::string text(double noise) const {
    RandomStream random(8);
    std::string text = "rest,fence,L.x,L.y,L.z,M.x,M.y,M.z\n";
    const Eigen::Vector3d up = Eigen::Vector3d(0.004, -0.003, 1.0).normalized();
    for (const DesignEntry& entry : standard_design(24)) {
      const Eigen::Matrix3d R =
          Positioner().rotation_table_from_positioner(entry.point).transpose();
      text += std::string(face_name(entry.point.rest())) + "," +
              std::string(face_name(entry.point.fence()));
      for (const auto& [truth, field] : {std::pair(&accelerometer, Eigen::Vector3d(R * up)),
                                         std::pair(&magnetometer, Eigen::Vector3d(R * magnetic))}) {
        for (const double value : truth->response.at(field)) {
          text += "," + number_text(value + noise * field.norm() * random.normal());
        }
      }
      text += "\n";
    }
    return text;
  }
};

TEST(SlotsOfSeveralKinds, AreCalibratedTogether) {
  const TwoKinds two;
  const Experiment experiment = two.experiment();
  const std::vector<Calibration> found =
      calibrate_run(experiment, run_of(two.text(0.0), experiment));
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].sensor.field.kind, "gravity");
  EXPECT_EQ(found[1].sensor.field.kind, "geomagnetic");
  EXPECT_MATRIX_NEAR(found[0].sensor.response.sensitivity, two.accelerometer.response.sensitivity,
                     1e-11);
  EXPECT_MATRIX_NEAR(found[1].sensor.response.sensitivity, two.magnetometer.response.sensitivity,
                     1e-9);
  // The alignment is the rotation from the accelerometer's axes to the magnetometer's axes.
  ASSERT_EQ(found[0].fit.slot_alignments.size(), 1U);
  const SlotAlignment& alignment = found[0].fit.slot_alignments.front();
  EXPECT_EQ(alignment.slot, "M");
  const auto axes = [](const SensorModel& truth) {
    return nearest_rotation(Eigen::Matrix3d(truth.response.sensitivity.rowwise().normalized()));
  };
  EXPECT_MATRIX_NEAR(alignment.rotation_other_from_sensor,
                     axes(two.magnetometer) * axes(two.accelerometer).transpose(), 1e-9);
  const std::string text = calibration_json(found[0]);
  EXPECT_EQ(calibration_json(parse_calibration(text, "record")), text);
}

TEST(SlotsOfSeveralKinds, AreStatedInAnExperiment) {
  const TwoKinds two;
  const std::string text = experiment_json(two.experiment());
  const Experiment back = parse_experiment(text, "experiment.json").experiment;
  EXPECT_EQ(experiment_json(back), text);
  ASSERT_EQ(back.slots.size(), 2U);
  EXPECT_EQ(back.slots[1].field.kind(), "geomagnetic");
}

TEST(SlotsOfSeveralKinds, MissAColumnByItsName) {
  const TwoKinds two;
  std::string text = two.text(0.0);
  text.replace(text.find("M.z"), 3, "M.q");
  try {
    static_cast<void>(run_of(text, two.experiment()));
    FAIL();
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr("column 'M.z'"));
  }
}

// An instrument that is mounted upside down gives the pitch and roll of the assembly.
TEST(InAssemblyFrame, AMirroredInstrumentAnswersAlike) {
  const SensorModel truth = accelerometer_truth();
  Calibration mirrored;
  mirrored.sensor = truth;
  const Eigen::Matrix3d mount = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  mirrored.sensor.rotation_sensor_from_assembly = mount;
  const Eigen::Vector3d up = rotation_sensor_from_level(5.0 * rad_per_deg, 11.6 * rad_per_deg, 0.0,
                                                        AxisConvention::forward_left_up)
                                 .col(2);
  const Eigen::VectorXd v = truth.response.at(mount * up);
  const Reducer reduce(in_assembly_frame(mirrored));
  const ReducedReading reading = reduce(std::vector<double>(v.begin(), v.end()));
  EXPECT_NEAR(reading["pitch_deg"], 5.0, 1e-9);
  EXPECT_NEAR(reading["roll_deg"], 11.6, 1e-9);
}

// Stated attitudes are those of the positioner. The mount of the instrument does not change them.
TEST(StatedAttitudes, AreLabels) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  experiment.rotation_sensor_from_positioner = rotation_by({0.0, 0.0, std::numbers::pi});
  std::string text = "pitch_deg,roll_deg,x,y,z\n";
  for (const double pitch : {-90.0, -45.0, 0.0, 45.0, 90.0}) {
    for (const double roll : {0.0, 90.0, 180.0, 270.0}) {
      const Eigen::Vector3d up = rotation_sensor_from_level(pitch * rad_per_deg, roll * rad_per_deg,
                                                            0.0, AxisConvention::forward_left_up)
                                     .col(2);
      text += number_text(pitch) + "," + number_text(roll);
      for (const double value :
           truth.response.at(experiment.rotation_sensor_from_positioner * up)) {
        text += "," + number_text(value);
      }
      text += "\n";
    }
  }
  const Calibration found = calibrate(experiment, run_of(text, experiment).observations);
  EXPECT_EQ(found.fit.method, Method::known);
  EXPECT_MATRIX_NEAR(found.sensor.response.sensitivity, truth.response.sensitivity, 1e-12);
  EXPECT_MATRIX_NEAR(found.sensor.response.bias, truth.response.bias, 1e-12);
}

TEST(StatedAttitudes, OfAFieldThatLiesNeedAHeading) {
  Experiment experiment;
  experiment.instrument = magnetometer("nT");
  experiment.field.of = make_field("geomagnetic");
  experiment.field.in_table = Eigen::Vector3d(0.0, 18000.0, -43000.0);
  const std::string rows = "10,20,1,2,3\n-10,-20,1,2,4\n";
  try {
    static_cast<void>(calibrate(
        experiment, run_of("pitch_deg,roll_deg,x,y,z\n" + rows, experiment).observations));
    FAIL();
  } catch (const RefusedError& error) {
    EXPECT_THAT(error.what(), HasSubstr("heading_deg"));
  }
  EXPECT_THROW(static_cast<void>(
                   run_of("rest,fence,pitch_deg,roll_deg,x,y,z\n+X,+Y,1,2,3,4,5\n", experiment)),
               DataError);
  // If only the pitch is stated, the roll is 0. The heading is still missing.
  const axiscal::Run one_column = run_of("pitch_deg,x,y,z\n1,3,4,5\n2,3,4,6\n", experiment);
  EXPECT_EQ(one_column.observations.readings.front().attitude->roll_rad, 0.0);
  EXPECT_THROW(static_cast<void>(calibrate(experiment, one_column.observations)), RefusedError);
}

std::string six_faces(const SensorModel& truth, const FaceNames& words = {}) {
  std::string text = "rest,x,y,z\n";
  for (int again = 0; again < 2; ++again) {
    for (const Face face : all_faces) {
      std::string name(face_name(face));
      for (const auto& [word, of] : words) {
        name = of == face ? word : name;
      }
      text += name;
      for (const double value : truth.response.at(-nominal_normal(face))) {
        text += "," + number_text(value + 1e-5 * again);
      }
      text += "\n";
    }
  }
  return text;
}

TEST(SixFaces, WithoutFenceGiveBiasAndScaleByLength) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  const Calibration found =
      calibrate(experiment, run_of(six_faces(truth), experiment).observations);
  EXPECT_EQ(found.fit.method, Method::faces);
  EXPECT_MATRIX_NEAR(found.sensor.response.bias, truth.response.bias, 2e-3);
  for (Eigen::Index k = 0; k < 3; ++k) {
    EXPECT_NEAR(found.sensor.response.sensitivity(k, k), truth.response.sensitivity(k, k), 2e-3);
  }
  experiment.fit.method = Method::known;  // the sides are taken as vertical
  EXPECT_MATRIX_NEAR(calibrate(experiment, run_of(six_faces(truth), experiment).observations)
                         .sensor.response.sensitivity,
                     truth.response.sensitivity, 1e-5);
  experiment.fit.method = Method::joint;
  EXPECT_THROW(static_cast<void>(run_of(six_faces(truth), experiment)), DataError);
}

TEST(SixFaces, NameAWrongFaceWithoutAFence) {
  const SensorModel truth = accelerometer_truth();
  const Experiment experiment = experiment_for(truth);
  Observations all = run_of(six_faces(truth), experiment).observations;
  all.readings[2].point = all.readings[3].point;
  const Calibration found = calibrate(experiment, all);
  ASSERT_TRUE(found.findings.suggestion);
  EXPECT_EQ(found.findings.suggestion->runs, std::vector<int>{3});
  EXPECT_THAT(found.findings.warnings.front().message, HasSubstr("rest +Y instead of -Y"));
  EXPECT_THAT(found.findings.warnings.front().message, testing::Not(HasSubstr("fence")));
}

TEST(FaceNames, AreTheUsersWords) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  experiment.face_names = parse_face_names("Level=-Z, upside down=Z+, nose up=-x");
  const std::string text = six_faces(truth, experiment.face_names);
  EXPECT_THAT(text, HasSubstr("nose up"));
  const Observations read = run_of(text, experiment).observations;
  EXPECT_EQ(read.readings[1].point->rest(), Face::minus_x);
  EXPECT_EQ(experiment_json(parse_experiment(experiment_json(experiment), "e.json").experiment),
            experiment_json(experiment));
  EXPECT_THROW(static_cast<void>(parse_face_names("up")), DomainError);
  EXPECT_THROW(static_cast<void>(parse_face_names("up=+Z,up=-Z")), DomainError);
  experiment.face_names.clear();
  try {
    static_cast<void>(run_of(text, experiment));
    FAIL();
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr("face names"));
  }
}

// The axes have temperature sensors that differ by 0.5 degrees (sd). Each axis is fitted with its
// own sensor.
TEST(OwnTemperatures, AreThoseOfEachAxis) {
  SensorModel truth = accelerometer_truth();
  TemperatureResponse& terms = truth.temperature.emplace();
  terms.spans = {{.reference = 20.0}, {.reference = 21.0}, {.reference = 22.0}};
  terms.bias = Eigen::Vector3d(1e-3, -2e-3, 1.5e-3);
  terms.scale = Eigen::Vector3d(2e-3, -1e-3, 1e-3);
  RandomStream random(4);
  for (const bool turned : {false, true}) {
    std::string text = turned ? "rest,fence,x,y,z,temperature_x,temperature_y,temperature_z\n"
                              : "rest,fence,x,y,z,x_temperature,y_temperature,z_temperature\n";
    for (const double soak : {0.0, 20.0, 40.0}) {
      for (const DesignEntry& entry : standard_design(12)) {
        std::vector<double> t;
        for (int k = 0; k < 3; ++k) {
          t.push_back(soak + 0.5 * random.normal());
        }
        const Eigen::Vector3d f =
            Positioner().rotation_table_from_positioner(entry.point).transpose().col(2);
        text += std::string(face_name(entry.point.rest())) + "," +
                std::string(face_name(entry.point.fence()));
        for (const double value : response_at(truth, f, SensorTemperature(t))) {
          text += "," + number_text(value);
        }
        for (const double value : t) {
          text += "," + number_text(value);
        }
        text += "\n";
      }
    }
    Experiment experiment = experiment_for(truth);
    experiment.fit.method = Method::joint;
    experiment.fit.temperature.order = 1;
    const Calibration found = calibrate(experiment, run_of(text, experiment).observations);
    ASSERT_TRUE(found.sensor.temperature && found.sensor.temperature->has_own_sensors());
    // The fit has other reference temperatures than the truth, so the responses are compared.
    const SensorTemperature at(std::vector<double>{10.0, 12.0, 9.0});
    const Eigen::Vector3d f(0.3, -0.5, 0.8);
    EXPECT_MATRIX_NEAR(response_at(found.sensor, f, at), response_at(truth, f, at), 1e-11);
    const std::string record = calibration_json(found);
    EXPECT_THAT(record, HasSubstr("\"version\": 2"));
    EXPECT_EQ(calibration_json(parse_calibration(record, "record")), record);
    const Eigen::VectorXd v = response_at(truth, f, at);
    const ReducedReading reading =
        Reducer(found).reduce(std::vector<double>(v.begin(), v.end()), {.temperature = at});
    EXPECT_MATRIX_NEAR(reading.field_in_sensor, f, 1e-11);
  }
  EXPECT_THROW(static_cast<void>(run_of("rest,fence,x,y,z,x_temperature\n+X,+Y,1,2,3,4\n",
                                        experiment_for(accelerometer_truth()))),
               DataError);
}

}  // namespace
}  // namespace axiscal::test
