// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/recording_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <string>

#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/logs/log_file.hpp"
#include "axiscal/logs/recorded_sensor.hpp"
#include "data.hpp"
#include "matchers.hpp"
#include "program.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

// The content of a public recording, decoded by other programs (numpy, pyulog, pymavlink,
// blackbox_decode, @foxglove/rosbag, @mcap/core; see SOURCE.md in each folder).
struct Fact {
  const char* file;
  const char* format;
  const char* series;
  SeriesKind kind;
  const char* unit;
  std::array<const char*, 3> columns;
  std::size_t samples;
  double start_s, end_s;  // NaN: not compared
  std::array<double, 3> mean, sd;
  double scale;  // divisor that the file states
};

void PrintTo(const Fact& fact, std::ostream* os) {
  *os << fact.file << ' ' << name_of(fact.kind);
}

class Recordings : public testing::TestWithParam<Fact> {};

TEST_P(Recordings, HoldWhatOthersDecoded) {
  const Fact& fact = GetParam();
  AXISCAL_NEED_DATA(file, fact.file);
  RecordingSummary summary;
  try {
    summary = summarise(file);
  } catch (const DataError& error) {
    if (std::string(error.what()).find("was built without") != std::string::npos) {
      GTEST_SKIP() << error.what();
    }
    throw;
  }
  EXPECT_EQ(summary.format, fact.format);
  const auto found =
      std::find_if(summary.series.begin(), summary.series.end(), [&](const SeriesSummary& one) {
        return one.series.name == fact.series && one.series.kind == fact.kind;
      });
  ASSERT_NE(found, summary.series.end());
  EXPECT_EQ(found->series.unit, fact.unit);
  EXPECT_EQ(found->samples, fact.samples);
  if (std::isfinite(fact.start_s)) {
    EXPECT_NEAR(found->start_s, fact.start_s, 1e-9 * std::max(fact.start_s, 1.0));
    EXPECT_NEAR(found->end_s, fact.end_s, 1e-9 * fact.end_s);
  }
  ASSERT_EQ(found->series.columns.size(), 3U);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(found->series.columns[c], fact.columns[c]);
    const double near = 1e-9 * std::max(std::abs(fact.mean[c]), fact.sd[c]) / fact.scale;
    EXPECT_NEAR(found->mean[c], fact.mean[c] / fact.scale, near);
    EXPECT_NEAR(found->sd[c], fact.sd[c] / fact.scale, near);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Public,
    Recordings,
    testing::ValuesIn(std::vector<Fact>{
        {"log_ulog/sample_log_small.ulg",
         "ulog",
         "sensor_combined",
         SeriesKind::gyroscope,
         "rad/s",
         {"gyro_rad[0]", "gyro_rad[1]", "gyro_rad[2]"},
         1298,
         20.326716,
         26.822868,
         {0.004457859755, 0.0003117038352, 0.001009577744},
         {0.002907516816, 0.002459828535, 0.002635487861},
         1},
        {"log_ulog/sample_log_small.ulg",
         "ulog",
         "sensor_combined",
         SeriesKind::accelerometer,
         "m/s^2",
         {"accelerometer_m_s2[0]", "accelerometer_m_s2[1]", "accelerometer_m_s2[2]"},
         1298,
         20.326716,
         26.822868,
         {-0.01712333651, -0.1669345774, -9.621494838},
         {0.02467660763, 0.02820828749, 0.0405712274},
         1},
        {"log_ulog/sample_appended_multiple.ulg",
         "ulog",
         "sensor_combined",
         SeriesKind::magnetometer,
         "gauss",
         {"magnetometer_ga[0]", "magnetometer_ga[1]", "magnetometer_ga[2]"},
         2373,
         12.262822,
         21.880422,
         {0.154206778, -1.078835233, 0.4327021535},
         {0.002345321105, 0.001830027918, 0.003005842657},
         1},
        {"log_dataflash/spark404_log.bin",
         "dataflash",
         "IMU2",
         SeriesKind::accelerometer,
         "m/s^2",
         {"AccX", "AccY", "AccZ"},
         1258,
         402.644506,
         453.502278,
         {0.2077895908, 0.1833025166, -9.869643927},
         {0.5379588258, 0.376225966, 1.70451302},
         1},
        {"log_dataflash/center_0003.bin",
         "dataflash",
         "MAG",
         SeriesKind::magnetometer,
         "mgauss",
         {"MagX", "MagY", "MagZ"},
         465,
         3.782182,
         52.562257,
         {-19.23655914, -110.6989247, 460.6387097},
         {60.03529814, 115.4768958, 11.12519888},
         1},
        {"log_dataflash/nan.log",
         "dataflash-text",
         "IMU",
         SeriesKind::gyroscope,
         "rad/s",
         {"GyrX", "GyrY", "GyrZ"},
         705,
         95.892,
         125.27,
         {-0.01168293934, -0.009958330866, -0.0005776966074},
         {0.1192066325, 0.07314546721, 0.07113526011},
         1},
        {"log_mavlink/vtol.tlog",
         "tlog",
         "RAW_IMU",
         SeriesKind::magnetometer,
         "mgauss",
         {"xmag", "ymag", "zmag"},
         795,
         608.582234,
         816.977306,
         {48.18993711, -111.1735849, -504.509434},
         {173.6347259, 188.9376706, 67.88314785},
         1},
        {"log_mavlink/vtol_raw_imu.txt",
         "mavlink-text",
         "RAW_IMU",
         SeriesKind::magnetometer,
         "mgauss",
         {"xmag", "ymag", "zmag"},
         795,
         608.582234,
         816.977306,
         {48.18993711, -111.1735849, -504.509434},
         {173.6347259, 188.9376706, 67.88314785},
         1},
        {"log_blackbox/example_smooth_tune.BBL",
         "blackbox",
         "main",
         SeriesKind::gyroscope,
         "deg/s",
         {"gyroADC[0]", "gyroADC[1]", "gyroADC[2]"},
         76325,
         33.907148,
         72.683293,
         {-0.05065181788, 0.6564297412, -0.2341958729},
         {60.87105609, 43.01550599, 13.87333992},
         1},
        {"log_blackbox/example_smooth_tune.BBL",
         "blackbox",
         "main",
         SeriesKind::accelerometer,
         "g",
         {"accSmooth[0]", "accSmooth[1]", "accSmooth[2]"},
         76325,
         33.907148,
         72.683293,
         {-11.47989519, 33.9634851, 2109.706951},
         {52.10009978, 88.89247089, 327.3660877},
         2048},
        {"log_rosbag1/sparkfun_razor.bag",
         "rosbag1",
         "/imu/data_raw",
         SeriesKind::accelerometer,
         "m/s^2",
         {"linear_acceleration.x", "linear_acceleration.y", "linear_acceleration.z"},
         2144,
         1352907614.798384,
         1352907645.844156,
         {-1.789006821, 3.324043807, 4.867078293},
         {5.651208179, 3.874701752, 4.790058646},
         1},
        {"log_rosbag1/sparkfun_razor_lz4.bag",
         "rosbag1",
         "/imu/data_raw",
         SeriesKind::accelerometer,
         "m/s^2",
         {"linear_acceleration.x", "linear_acceleration.y", "linear_acceleration.z"},
         2144,
         1352907614.798384,
         1352907645.844156,
         {-1.789006821, 3.324043807, 4.867078293},
         {5.651208179, 3.874701752, 4.790058646},
         1},
        {"log_rosbag1/sparkfun_razor_none.bag",
         "rosbag1",
         "/imu/data_raw",
         SeriesKind::accelerometer,
         "m/s^2",
         {"linear_acceleration.x", "linear_acceleration.y", "linear_acceleration.z"},
         2144,
         1352907614.798384,
         1352907645.844156,
         {-1.789006821, 3.324043807, 4.867078293},
         {5.651208179, 3.874701752, 4.790058646},
         1},
        {"log_rosbag2/sparkfun_razor.db3",
         "rosbag2",
         "/imu/data_raw",
         SeriesKind::accelerometer,
         "m/s^2",
         {"linear_acceleration.x", "linear_acceleration.y", "linear_acceleration.z"},
         2144,
         1352907614.798384,
         1352907645.844156,
         {-1.789006821, 3.324043807, 4.867078293},
         {5.651208179, 3.874701752, 4.790058646},
         1},
        {"log_rosbag2/sparkfun_razor_lz4.mcap",
         "mcap",
         "/imu/data_raw",
         SeriesKind::accelerometer,
         "m/s^2",
         {"linear_acceleration.x", "linear_acceleration.y", "linear_acceleration.z"},
         2144,
         1352907614.798384,
         1352907645.844156,
         {-1.789006821, 3.324043807, 4.867078293},
         {5.651208179, 3.874701752, 4.790058646},
         1},
        {"log_rosbag2/sparkfun_razor_zstd.mcap",
         "mcap",
         "/imu/data_raw",
         SeriesKind::accelerometer,
         "m/s^2",
         {"linear_acceleration.x", "linear_acceleration.y", "linear_acceleration.z"},
         2144,
         1352907614.798384,
         1352907645.844156,
         {-1.789006821, 3.324043807, 4.867078293},
         {5.651208179, 3.874701752, 4.790058646},
         1},
        {"log_rosbag2/sparkfun_razor.db3",
         "rosbag2",
         "/imu/mag",
         SeriesKind::magnetometer,
         "T",
         {"magnetic_field.x", "magnetic_field.y", "magnetic_field.z"},
         2144,
         not_a_number,
         not_a_number,
         {1.881704103e-05, -3.168948808e-05, -6.528386724e-05},
         {3.595480155e-05, 3.358548395e-05, 4.428344196e-05},
         1},
        {"log_rosbag1/phidgets_imu_upside_down.bag",
         "rosbag1",
         "/imu/mag",
         SeriesKind::magnetometer,
         "T",
         {"magnetic_field.x", "magnetic_field.y", "magnetic_field.z"},
         13964,
         not_a_number,
         not_a_number,
         {4.577150846e-06, 1.963256653e-05, 3.703929524e-05},
         {6.24439316e-06, 1.239172294e-05, 1.379024244e-06},
         1},
        {"log_phyphox/phyphox_walk.zip",
         "phyphox",
         "Magnetometer",
         SeriesKind::magnetometer,
         "uT",
         {"X (µT)", "Y (µT)", "Z (µT)"},
         10575,
         0.01958608333,
         105.0479231,
         {-4.100583092, -4.309311171, -30.62977543},
         {19.36893821, 16.02021638, 5.67377675},
         1},
        {"log_sensorlogger/AccelerometerUncalibrated.csv",
         "sensorlogger",
         "AccelerometerUncalibrated",
         SeriesKind::accelerometer,
         "g",
         {"z", "y", "x"},
         2714,
         1699734109.7630764,
         1699734136.95995,
         {-0.3411969977, -0.3939741355, 0.003669941171},
         {0.6269330461, 0.5239195389, 0.2850565019},
         1},
        {"log_vectornav/vn100_0513test.txt",
         "vectornav",
         "VNYMR",
         SeriesKind::gyroscope,
         "rad/s",
         {"gyroX", "gyroY", "gyroZ"},
         3902,
         not_a_number,
         not_a_number,
         {-0.01753108995, 0.00435402614, -0.003618351615},
         {1.017446857, 0.2902937735, 0.4832341266},
         1},
        {"log_witmotion/imu_data.txt",
         "witmotion",
         "imu_data",
         SeriesKind::accelerometer,
         "g",
         {"ax(g)", "ay(g)", "az(g)"},
         684,
         50886.818,
         50893.631,
         {0.7507244152, -0.2336562865, -0.02104239766},
         {0.1639676431, 0.2728047246, 0.5525536174},
         1},
        {"log_ximu/sensor_data.csv",
         "ximu",
         "sensor_data",
         SeriesKind::gyroscope,
         "deg/s",
         {"Gyroscope X (deg/s)", "Gyroscope Y (deg/s)", "Gyroscope Z (deg/s)"},
         13514,
         0,
         135.326642,
         {-0.1158486828, -0.2685920846, 7.970623541},
         {16.55541299, 15.42216582, 39.87111492},
         1},
        {"log_xsens/MT_012005D6_009-001_00B421E6.txt",
         "xsens",
         "MT_012005D6_009-001_00B421E6",
         SeriesKind::accelerometer,
         "m/s^2",
         {"Acc_X", "Acc_Y", "Acc_Z"},
         2432,
         4.72,
         29.03,
         {-0.5325482496, 6.678804677, -8.249823303},
         {3.076783297, 4.138321104, 4.006419516},
         1},
        {"log_matlab73/x_up_mpu6050_accelerometer.mat",
         "mat",
         "x_up_mpu6050_accelerometer",
         SeriesKind::accelerometer,
         "g",
         {"accelBuffer_2", "accelBuffer_3", "accelBuffer_4"},
         13181,
         0.01111433484,
         132.44727,
         {-0.9964490977, 0.02497465427, -0.002713348641},
         {0.003004247849, 0.003069894579, 0.005149981804},
         1},
        {"log_npy/x_forward_compressed.npz",
         "npy",
         "x_forward_compressed",
         SeriesKind::accelerometer,
         "g",
         {"accel_1", "accel_2", "accel_3"},
         12243,
         0.008327751063,
         123.1997713,
         {-0.00664517958, -0.001543511949, -1.034533964},
         {0.003145852044, 0.003122958728, 0.004978542899},
         1},
    }));

TEST(RecordingFile, GoesOnBehindDamage) {
  AXISCAL_NEED_DATA(file, "log_blackbox/error-recovery.bbl");
  const RecordingSummary summary = summarise(file);
  EXPECT_EQ(summary.series.front().samples, 2U);
  EXPECT_FALSE(summary.notes.empty());
}

TEST(RecordingFile, ChoosesFastAndRawSensors) {
  RecordingSummary summary{.format = "ulog"};
  const auto add = [&](const char* name, int instance, double rate_hz) {
    summary.series.push_back({.series = {.name = name,
                                         .instance = instance,
                                         .kind = SeriesKind::accelerometer,
                                         .columns = {"x", "y", "z"},
                                         .unit = "m/s^2"},
                              .samples = 1000,
                              .rate_hz = rate_hz});
  };
  add("sensor_combined", 0, 200.0);
  add("sensor_accel", 0, 1.0);
  EXPECT_EQ(sensors_of(summary).front().name, "sensor_combined");
  summary.series.back().rate_hz = 100.0;
  add("sensor_accel", 1, 100.0);
  summary.facts["device_id sensor_accel 1"] = "2424842";
  const std::vector<RecordedSensor> raw = sensors_of(summary);
  ASSERT_EQ(raw.size(), 2U);
  EXPECT_EQ(raw[0].name, "sensor_accel[0]");
  EXPECT_EQ(raw[1].number, 1);
  EXPECT_EQ(raw[1].device, "2424842");
}

TEST(RecordingFile, PutsSeriesOfOtherTimesIntoOneTable) {
  const test::ScratchFolder folder;
  std::filesystem::create_directory(folder.path("phone"));
  std::string accelerometer = "Time (s),X (m/s^2),Y (m/s^2),Z (m/s^2)\n";
  std::string magnetometer = "Time (s),X (uT),Y (uT),Z (uT)\n";
  for (int i = 0; i < 200; ++i) {
    accelerometer += std::to_string(0.01 * i) + ",0,0," + (i % 2 == 0 ? "9.8" : "9.81") + "\n";
  }
  for (int i = 0; i < 40; ++i) {  // linear in time, for exact interpolation
    magnetometer += std::to_string(0.05 * i + 0.003) + "," + std::to_string(20.0 + i) + ",0,30\n";
  }
  folder.write("phone/Accelerometer.csv", accelerometer);
  folder.write("phone/Magnetometer.csv", magnetometer);
  LogFile log(folder.path("phone"));
  EXPECT_EQ(log.columns(),
            (std::vector<std::string>{"time_s", "ax", "ay", "az", "mx", "my", "mz"}));
  const LogBlock all = read_log(log);
  ASSERT_EQ(all[0].size(), 200U);
  EXPECT_NEAR(all[4][100], 20.0 + (1.0 - 0.003) / 0.05, 1e-9);
  EXPECT_EQ(all[3][100], 9.8);
}

TEST(RecordingFile, SaysWhatIsThereWhereNoSensorIs) {
  AXISCAL_NEED_DATA(file, "log_rosbag1/example-lz4.bag");
  EXPECT_THAT(test::complaint_of<DataError>([&] { LogFile log(file); }),
              testing::AllOf(HasSubstr("no accelerometer, gyroscope or magnetometer"),
                             HasSubstr("/turtle1/pose")));
}

// ---- what is known by names, units and numbers ----

SeriesKind kind_of(const std::string& header, const std::string& rows, const std::string& name) {
  const test::ScratchFolder folder;
  const RecordingSummary summary = summarise(folder.write(name, header + rows));
  return summary.series.front().series.kind;
}

TEST(RecordingFile, KnowsColumnsByTheirNames) {
  const std::string rows = "1,2,3\n2,3,4\n3,4,5\n";
  EXPECT_EQ(kind_of("acc_x,acc_y,acc_z\n", rows, "a.csv"), SeriesKind::accelerometer);
  EXPECT_EQ(kind_of("wx,wy,wz\n", rows, "a.csv"), SeriesKind::gyroscope);
  EXPECT_EQ(kind_of("X (uT),Y (uT),Z (uT)\n", rows, "a.csv"), SeriesKind::magnetometer);
  EXPECT_EQ(kind_of("x,y,z\n", rows, "Gyroscope.csv"), SeriesKind::gyroscope);
  EXPECT_EQ(kind_of("x,y,z\n", rows, "a.csv"), SeriesKind::other);
  // Acceleration without gravity is not used.
  EXPECT_EQ(kind_of("FreeAcc_X,FreeAcc_Y,FreeAcc_Z\n", rows, "a.csv"), SeriesKind::other);
}

TEST(RecordingFile, KnowsGravityAndTurnsByTheirNumbers) {
  std::string text;
  double angle = 0.0;
  for (int i = 0; i < 400; ++i) {
    const double rate = i % 100 < 50 ? 0.0 : 1.5;  // rate about x
    angle += 0.01 * rate;
    text += std::to_string(0.1) + " " + std::to_string(9.8 * std::sin(angle)) + " " +
            std::to_string(9.8 * std::cos(angle)) + " " + std::to_string(rate) + " 0.001 0.002\n";
  }
  const test::ScratchFolder folder;
  LogFile log(folder.write("plain.txt", text));
  const std::vector<LogSensor> sensors = log.sensors();
  ASSERT_EQ(sensors.size(), 2U);
  EXPECT_EQ(sensors[0].kind, SeriesKind::accelerometer);
  EXPECT_EQ(sensors[0].unit, "m/s^2");
  EXPECT_EQ(sensors[0].columns[0], "c1");
  EXPECT_EQ(sensors[1].kind, SeriesKind::gyroscope);
  EXPECT_EQ(sensors[1].columns[2], "c6");
  EXPECT_EQ(read_log(log)[0].size(), 400U);  // recognition consumes no samples
}

TEST(RecordingFile, TakesNoQuaternionForGravity) {
  std::string rows;
  for (int i = 0; i < 100; ++i) {
    rows += "0.6,0.0,0.8\n";
  }
  EXPECT_EQ(kind_of("Quat_W,Quat_X,Quat_Y\n", rows, "a.csv"), SeriesKind::other);
}

}  // namespace
}  // namespace axiscal
