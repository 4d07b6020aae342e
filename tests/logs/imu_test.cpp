// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/imu.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Geometry>
#include <gmock/gmock.h>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/logs/simulate_log.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

ImuSimulation some_imu(std::uint64_t seed = 1) {
  Eigen::Matrix3d A;
  A << 2050.0, 12.0, -9.0, 0.0, 2071.0, 15.0, 0.0, 0.0, 2033.0;
  Eigen::Matrix3d G;
  G << 3754.0, 40.0, -30.0, -25.0, 3700.0, 50.0, 30.0, 10.0, 3790.0;
  Eigen::Matrix3d M;
  M << 410.0, 8.0, -6.0, 8.0, 380.0, 10.0, -6.0, 10.0, 395.0;
  return {
      .accelerometer =
          LinearResponse{.bias = Eigen::Vector3d(50.0, -120.0, 80.0), .sensitivity = A},
      .gyroscope = LinearResponse{.bias = Eigen::Vector3d(12.0, -7.0, 30.0), .sensitivity = G},
      .magnetometer = LinearResponse{.bias = Eigen::Vector3d(60.0, -40.0, 20.0), .sensitivity = M},
      .accelerometer_sd = 4.0,
      .gyroscope_sd = 4.0,
      .magnetometer_sd = 2.0,
      .seed = seed};
}

ImuOptions all_three() {
  ImuOptions options;
  options.accelerometer = {"ax", "ay", "az"};
  options.gyroscope = {"gx", "gy", "gz"};
  options.magnetometer = {"mx", "my", "mz"};
  return options;
}

void expect_near_truth(const Calibration& calibration,
                       const LinearResponse& truth,
                       double standard_errors) {
  const FitStatistics& statistics = *calibration.fit.statistics;
  for (Eigen::Index k = 0; k < 3; ++k) {
    EXPECT_LT(std::abs(calibration.sensor.response.bias(k) - truth.bias(k)),
              standard_errors * statistics.bias_se(k))
        << calibration.provenance.slot;
    for (Eigen::Index j = 0; j < 3; ++j) {
      EXPECT_LE(std::abs(calibration.sensor.response.sensitivity(k, j) - truth.sensitivity(k, j)),
                standard_errors * statistics.sensitivity_se(k, j) + 1e-9)
          << calibration.provenance.slot << k << j;
    }
  }
}

// A bare board that is turned by hand. All three instruments are in the accelerometer's frame.
TEST(CalibrateImu, OfABareBoard) {
  const ImuSimulation simulation = some_imu();
  const RecordedLog log = simulate_imu_log(simulation, random_attitudes(30, 7));
  ImuOptions options = all_three();
  options.experiment.fit.shape = MagnitudeShape::triangular;
  const ImuCalibration imu = calibrate_imu(log, options);
  EXPECT_EQ(imu.rests.intervals.size(), 30U);
  EXPECT_FALSE(imu.seats.has_value());
  EXPECT_EQ(imu.accelerometer.fit.method, Method::magnitude);
  expect_near_truth(imu.accelerometer, simulation.accelerometer, 4.5);
  ASSERT_TRUE(imu.gyroscope && imu.magnetometer);
  EXPECT_EQ(imu.gyroscope->fit.method, Method::turns);
  // The uncertainty of the gyroscope does not include that of the accelerometer's directions, which
  // is small here.
  expect_near_truth(*imu.gyroscope, *simulation.gyroscope, 6.0);
  // The magnetometer is aligned with the accelerometer. The size of the field is unknown, so its
  // unit is the field.
  ASSERT_TRUE(imu.magnetometer->fit.alignment.has_value());
  const double F = simulation.magnetic_in_table.norm();
  LinearResponse relative = *simulation.magnetometer;
  relative.sensitivity *= F;
  expect_near_truth(*imu.magnetometer, relative, 5.0);
  EXPECT_THAT(imu.magnetometer->findings.notes,
              test::HasNote(HasSubstr("magnitudes are relative to the field")));
  ASSERT_EQ(imu.records().size(), 3U);
  EXPECT_EQ(imu.records()[2].provenance.slot, "magnetometer");
  for (const Calibration& record : imu.records()) {
    const std::string text = calibration_json(record);
    EXPECT_EQ(calibration_json(parse_calibration(text, "r.json")), text);
  }
}

// After each turn the accelerometer needs a second to settle. The start of each rest is left out,
// and a note says so. Without this, the biases would be wrong by many standard errors.
TEST(CalibrateImu, LeavesOutReadingsThatHaveNotSettled) {
  ImuSimulation simulation = some_imu();
  simulation.rest_s = 4.0;
  RecordedLog log = simulate_imu_log(simulation, random_attitudes(30, 7));
  ImuOptions options = all_three();
  options.gyroscope.clear();
  options.magnetometer.clear();
  options.experiment.fit.shape = MagnitudeShape::triangular;
  const ImuCalibration settled = calibrate_imu(log, options);
  EXPECT_THAT(settled.accelerometer.findings.notes,
              testing::Not(test::HasNote(HasSubstr("settled"))));
  ASSERT_EQ(settled.rests.intervals.size(), 30U);
  for (const StaticInterval& rest : settled.rests.intervals) {
    for (std::size_t i = 0; i < 300 && rest.first + i < log.samples.front().size(); ++i) {
      const double part = std::exp(-static_cast<double>(i) / (0.3 * settled.rests.rate_hz));
      for (const std::string& axis : options.accelerometer) {
        log.samples[find_column(log.columns, axis).value()][rest.first + i] += 12.0 * part;
      }
    }
  }
  const ImuCalibration imu = calibrate_imu(log, options);
  EXPECT_THAT(imu.accelerometer.findings.notes,
              test::HasNote(HasSubstr("% of each rest are left out")));
  expect_near_truth(imu.accelerometer, simulation.accelerometer, 4.5);
}

// The axes of the record differ from those of the log. Then the accelerometer gives no start for
// the gyroscope, and nothing else is stated.
TEST(CalibrateImu, TakesARecordOfAxesThatLieOtherwise) {
  Eigen::Matrix3d cyclic;
  cyclic << 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0;
  Eigen::Matrix3d exchanged;
  exchanged << 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0;
  const Eigen::Matrix3d turned = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  const Eigen::Matrix3d mirrored = Eigen::Vector3d(-1.0, 1.0, 1.0).asDiagonal();
  Eigen::Matrix3d G = Eigen::Matrix3d::Identity();
  G(0, 1) = 0.02;
  const Eigen::Vector3d bias(0.01, 0.02, 0.03);
  for (const auto& [lie, seed] : std::vector<std::pair<Eigen::Matrix3d, std::uint64_t>>{
           {cyclic, 5}, {exchanged, 1}, {turned, 2}, {mirrored, 2}}) {
    ImuSimulation imu;
    imu.accelerometer = LinearResponse{.bias = bias, .sensitivity = lie};
    imu.gyroscope = LinearResponse{.bias = bias, .sensitivity = G};
    imu.accelerometer_sd = 1e-3;
    imu.gyroscope_sd = 1e-3;
    imu.seed = seed;
    imu.rest_s = 3.0;
    ImuOptions options;
    options.accelerometer = {"ax", "ay", "az"};
    options.gyroscope = {"gx", "gy", "gz"};
    options.experiment.field.magnitude = 1.0;
    options.experiment.field.unit = "g";
    Calibration record;
    record.sensor.instrument = {.kind = "accelerometer", .axes = options.accelerometer};
    record.sensor.response = imu.accelerometer;
    record.sensor.field = {.kind = "gravity", .unit = "g", .magnitude = 1.0};
    record.fit.statistics.emplace().covariance = Eigen::MatrixXd::Zero(12, 12);
    options.known_accelerometer = record;
    const ImuCalibration found =
        calibrate_imu(simulate_imu_log(imu, random_attitudes(30, seed)), options);
    ASSERT_TRUE(found.turns);
    EXPECT_LT((found.turns->response.sensitivity - G).norm(), 0.005) << seed;
  }
}

// In a cube, with a run sheet or with recognised seats. The seats also give the angles against the
// cube.
TEST(CalibrateImu, OfACube) {
  const std::vector<RunSheetRow> sheet = make_run_sheet(standard_design(12), 2, 4);
  ImuSimulation simulation = some_imu(3);
  simulation.slope = {0.004, -0.003};
  const RecordedLog log = simulate_imu_log(simulation, attitudes_of(sheet));
  for (const Seats seats : {Seats::sheet, Seats::recognised}) {
    ImuOptions options = all_three();
    options.magnetometer.clear();
    options.seats = seats;
    options.sheet = sheet;
    const ImuCalibration imu = calibrate_imu(log, options);
    ASSERT_EQ(imu.rests.intervals.size(), 24U);
    EXPECT_THAT(imu.seats->messages, IsEmpty());
    EXPECT_THAT(imu.rests.warnings, IsEmpty());
    EXPECT_EQ(imu.accelerometer.fit.method, Method::joint);
    expect_near_truth(imu.accelerometer, simulation.accelerometer, 4.5);
    ASSERT_TRUE(imu.gyroscope && imu.turns);
    EXPECT_TRUE(imu.turns->has_rotations);
    expect_near_truth(*imu.gyroscope, *simulation.gyroscope, 4.5);
    if (seats == Seats::sheet) {
      // A log does not show the fence of the first seat, so frame and slope may be turned about the
      // vertical.
      EXPECT_NEAR(imu.accelerometer.fit.levelness->mean_x, 0.004, 3e-4);
      EXPECT_NEAR(imu.accelerometer.fit.levelness->mean_y, -0.003, 3e-4);
    } else {
      EXPECT_NEAR(std::hypot(imu.accelerometer.fit.levelness->mean_x,
                             imu.accelerometer.fit.levelness->mean_y),
                  0.005, 3e-4);
      EXPECT_THAT(imu.notes, Contains(HasSubstr("recognised by the gyroscope")));
    }
  }
}

// Four quarter turns about each axis. The last four are about the vertical, so gravity does not
// show them and the seats do.
TEST(CalibrateImu, TakesTurnsAboutTheVerticalInACube) {
  std::vector<Eigen::Matrix3d> attitudes = {Eigen::Matrix3d::Identity()};
  for (int axis = 0; axis < 3; ++axis) {
    for (int quarter = 0; quarter < 4; ++quarter) {
      attitudes.emplace_back(attitudes.back() *
                             rotation_by(0.5 * std::numbers::pi * Eigen::Vector3d::Unit(axis)));
    }
  }
  const ImuSimulation simulation = some_imu(7);
  ImuOptions options = all_three();
  options.magnetometer.clear();
  options.seats = Seats::recognised;
  const ImuCalibration imu = calibrate_imu(simulate_imu_log(simulation, attitudes), options);
  ASSERT_TRUE(imu.gyroscope && imu.turns);
  EXPECT_TRUE(imu.turns->has_rotations);
  expect_near_truth(*imu.gyroscope, *simulation.gyroscope, 4.5);
}

TEST(CalibrateImu, RecognisesFencesByTheMagnetometer) {
  const std::vector<RunSheetRow> sheet = make_run_sheet(standard_design(12), 1, 6);
  const RecordedLog log = simulate_imu_log(some_imu(5), attitudes_of(sheet));
  ImuOptions options = all_three();
  options.gyroscope.clear();
  options.seats = Seats::recognised;
  const ImuCalibration imu = calibrate_imu(log, options);
  EXPECT_THAT(imu.notes, Contains(HasSubstr("recognised by the magnetometer")));
  EXPECT_THAT(imu.seats->messages, IsEmpty());
  // The attitudes are those of the sheet, up to one rotation of the table.
  const auto turn = [&](std::size_t i) {
    return Eigen::Matrix3d(
        attitudes_of(sheet)[i] *
        attitudes_of({RunSheetRow{.entry = {.point = *imu.seats->points[i]}}})[0].transpose());
  };
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    EXPECT_MATRIX_NEAR(turn(i), turn(0), 1e-12);
  }
  expect_near_truth(imu.accelerometer, some_imu(5).accelerometer, 6.0);
}

// A sensitivity to gravity is found at the rests and reported. It does not change the bias.
TEST(CalibrateImu, ReportsGSensitivity) {
  ImuSimulation simulation = some_imu(9);
  RecordedLog log = simulate_imu_log(simulation, random_attitudes(30, 8));
  const Eigen::Matrix3d inverse = simulation.accelerometer.sensitivity.inverse();
  for (std::size_t i = 0; i < log.samples[0].size(); ++i) {
    const Eigen::Vector3d f =
        inverse * (Eigen::Vector3d(log.samples[1][i], log.samples[2][i], log.samples[3][i]) -
                   simulation.accelerometer.bias);
    log.samples[4][i] += 30.0 * f.z();
  }
  ImuOptions options = all_three();
  options.magnetometer.clear();
  const ImuCalibration imu = calibrate_imu(log, options);
  ASSERT_TRUE(imu.g_sensitivity.has_value());
  EXPECT_NEAR((*imu.g_sensitivity)(0, 2), 30.0, 5.0 * (*imu.g_sensitivity_se)(0, 2));
  EXPECT_NEAR((*imu.g_sensitivity)(1, 0), 0.0, 5.0 * (*imu.g_sensitivity_se)(1, 0));
  EXPECT_THAT(imu.gyroscope->findings.notes, test::HasNote(HasSubstr("g-sensitivity of up to 30")));
}

TEST(CalibrateImu, SaysWhatIsWrong) {
  const RecordedLog log = simulate_imu_log(some_imu(), random_attitudes(30, 7));
  ImuOptions options = all_three();
  options.gyroscope[0] = "wx";
  EXPECT_THAT(
      test::complaint_of<DataError>([&] { static_cast<void>(calibrate_imu(log, options)); }),
      HasSubstr("column 'wx' is missing. The columns are: t, ax"));
  options = all_three();
  const RecordedLog one =
      simulate_imu_log(some_imu(), std::vector<Eigen::Matrix3d>(14, Eigen::Matrix3d::Identity()));
  EXPECT_THAT(
      test::complaint_of<RefusedError>([&] { static_cast<void>(calibrate_imu(one, options)); }),
      HasSubstr("needs rests in many attitudes"));
  options.seats = Seats::recognised;
  EXPECT_THAT(
      test::complaint_of<RefusedError>([&] { static_cast<void>(calibrate_imu(one, options)); }),
      HasSubstr("cannot be found from one rest"));
  options.accelerometer = {"ax", "ay"};
  EXPECT_THROW(static_cast<void>(calibrate_imu(log, options)), DomainError);
}

// A turn with missing samples is left out. The other turns are used.
TEST(CalibrateImu, LeavesOutBrokenTurns) {
  RecordedLog log = simulate_imu_log(some_imu(2), random_attitudes(30, 7));
  // One missing sample is interpolated, thirty are not.
  log.samples[5][449 * 7 - 60] = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t i = 0; i < 30; ++i) {
    log.samples[5][449 * 3 - 80 + i] = std::numeric_limits<double>::quiet_NaN();
  }
  ImuOptions options = all_three();
  options.magnetometer.clear();
  const ImuCalibration imu = calibrate_imu(log, options);
  EXPECT_EQ(imu.turns->residuals.size(), 28U);
  EXPECT_THAT(imu.gyroscope->findings.notes,
              test::HasNote(HasSubstr("1 turns with missing samples")));
}

}  // namespace
}  // namespace axiscal
