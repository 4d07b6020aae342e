// SPDX-License-Identifier: Apache-2.0
// Inputs from other tools, and commands that new users type first.
#include <cmath>
#include <cstdio>
#include <filesystem>

#include <gmock/gmock.h>

#include "strangers.hpp"

namespace axiscal::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

class OpenDoors : public testing::Test {
 protected:
  // A log in m/s^2, deg/s and uT with rests in many orientations and turns between them.
  std::string imu_log(const std::string& header, bool gyroscope_is_dead = false) {
    StrangeInstrument magnetometer;
    magnetometer.random.seed(21);
    magnetometer.bias = {3.0, -7.0, 12.0};
    magnetometer.noise = 0.1;
    std::normal_distribution<double> shake(0.0, 1.5);
    std::string text = header;
    const auto rates = [&](double turning) {
      std::normal_distribution<double> noise(0.0, 0.02);
      const Eigen::Vector3d w =
          Eigen::Vector3d(0.31, -0.22, 0.14) + turning * Eigen::Vector3d(31.0, -14.5, 8.1) +
          Eigen::Vector3d(noise(magnetometer.random), noise(magnetometer.random),
                          noise(magnetometer.random));
      return row_text(w);
    };
    int sample = 0;
    const auto put = [&](const Eigen::Vector3d& up, const Eigen::Vector3d& north, double turning) {
      const Eigen::Vector3d a =
          instrument_.read(standard_gravity * up) +
          turning * Eigen::Vector3d(shake(instrument_.random), shake(instrument_.random),
                                    shake(instrument_.random));
      const Eigen::Vector3d m =
          magnetometer.read(48.0 * (0.4 * north - std::sqrt(1.0 - 0.16) * up));
      std::array<char, 256> row{};
      std::snprintf(row.data(), row.size(), "%.2f,%.5f,%.5f,%.5f,%s,%.4f,%.4f,%.4f\n",
                    0.02 * sample++, a.x(), a.y(), a.z(),
                    gyroscope_is_dead ? "0,0,0" : rates(turning).c_str(), m.x(), m.y(), m.z());
      text += row.data();
    };
    Eigen::Vector3d up = instrument_.direction();
    for (int rest = 0; rest < 20; ++rest) {
      const Eigen::Vector3d north = up.unitOrthogonal();
      for (int i = 0; i < 150; ++i) {
        put(up, north, 0.0);
      }
      const Eigen::Vector3d next = instrument_.direction();
      for (int i = 0; i < 50; ++i) {
        const Eigen::Vector3d between = (up + (next - up) * i / 50.0).normalized();
        put(between, between.unitOrthogonal(), 1.0);
      }
      up = next;
    }
    return text;
  }

  ScratchFolder folder_;
  StrangeInstrument instrument_;
  std::string cal_ = folder_.path("cal.json");
};

constexpr const char* plain_header = "time,ax,ay,az,gx,gy,gz,mx,my,mz\n";

TEST_F(OpenDoors, ACompassWithoutAStatedFieldIsFittedToLength1) {
  std::string text = "mx,my,mz\n";
  for (int i = 0; i < 40; ++i) {
    text += row_text(instrument_.read(48.0 * instrument_.direction())) + "\n";
  }
  const ProgramResult result =
      run_axiscal({"calibrate", folder_.write("compass.csv", text), "--instrument", "magnetometer",
                   "--method", "magnitude", "-o", cal_});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.err + result.out, HasSubstr("the magnitude\n    is taken as 1"));
  EXPECT_DOUBLE_EQ(read_json(cal_)["field"]["magnitude"].get<double>(), 1.0);
}

// A unit in the header that contradicts --unit is not overlooked.
TEST_F(OpenDoors, TheUnitOfTheColumnsMustBeTheStatedOne) {
  std::string text = read_file(std::string(AXISCAL_SOURCE_DIR) + "/examples/run.csv");
  const std::size_t end = text.find('\n');
  ASSERT_EQ(text.substr(end - 5, 5), "x,y,z");
  text.replace(end - 5, 5, "x (V),y (V),z (V)");
  const std::string file = folder_.write("volts.csv", text);
  const auto calibrate = [&](const std::string& unit) {
    return run_axiscal(
        {"calibrate", file, "--instrument", "accelerometer", "--unit", unit, "-o", cal_});
  };
  const ProgramResult wrong = calibrate("mV");
  EXPECT_EQ(wrong.status, 2);
  EXPECT_THAT(wrong.err, HasSubstr("--unit: the columns of the axes are in V, not in mV"));
  EXPECT_FALSE(std::filesystem::exists(cal_));
  EXPECT_EQ(calibrate("V").status, 0);
  EXPECT_EQ(calibrate("LSB").status, 0) << "a name of the user's own is accepted";
}

TEST_F(OpenDoors, TemplateWithoutANameListsThem) {
  const ProgramResult result = run_axiscal({"template"});
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.out, HasSubstr("laboratory"));
}

TEST_F(OpenDoors, SwappedArgumentsAreNamed) {
  const std::string run = folder_.write("run.csv", twelve_readings(instrument_));
  ASSERT_EQ(run_axiscal(
                {"calibrate", run, "--instrument", "accelerometer", "--unit", "m/s^2", "-o", cal_})
                .status,
            0);
  const ProgramResult result = run_axiscal({"apply", run, cal_});
  EXPECT_NE(result.status, 0);
  EXPECT_THAT(result.err, HasSubstr("record first"));
}

TEST_F(OpenDoors, SeveralRecordsCorrectALogAtOnce) {
  const std::string log = folder_.write("log.csv", imu_log(plain_header));
  const ProgramResult imu =
      run_axiscal({"calibrate", "--imu", log, "--unit", "m/s^2", "--gyroscope-unit", "deg/s", "-o",
                   folder_.path("{slot}.json")});
  const std::string accelerometer = folder_.path("accelerometer.json");
  const std::string magnetometer = folder_.path("magnetometer.json");
  ASSERT_TRUE(std::filesystem::exists(accelerometer)) << imu.err;
  ASSERT_TRUE(std::filesystem::exists(magnetometer)) << imu.err;
  const ProgramResult result = run_axiscal({"apply", accelerometer, magnetometer, log});
  ASSERT_EQ(result.status, 0) << result.err;
  const std::vector<std::vector<std::string>> cells = csv_cells(result.out);
  EXPECT_EQ(cells[0], (std::vector<std::string>{"time", "ax", "ay", "az", "mx", "my", "mz"}));
  EXPECT_EQ(cells.size(), 4001U);
  double length = 0.0;
  for (std::size_t c = 1; c < 4; ++c) {
    length += std::pow(std::stod(cells[20][c]), 2.0);
  }
  const double F = read_json(accelerometer)["field"]["magnitude"].get<double>();
  EXPECT_NEAR(std::sqrt(length), F, 0.002 * F);
}

TEST_F(OpenDoors, OneSensorThatFailsLosesNoOther) {
  const std::string log = folder_.write("log.csv", imu_log(plain_header, true));
  const ProgramResult result = run_axiscal(
      {"calibrate", "--imu", log, "--unit", "m/s^2", "-o", folder_.path("{slot}.json")});
  EXPECT_TRUE(std::filesystem::exists(folder_.path("accelerometer.json"))) << result.err;
  EXPECT_TRUE(std::filesystem::exists(folder_.path("magnetometer.json"))) << result.err;
}

TEST_F(OpenDoors, AnAccelerometerThatFailsLosesNoMagnetometer) {
  instrument_.sensitivity.row(0).setZero();  // axis x is dead
  const std::string log = folder_.write("log.csv", imu_log(plain_header));
  const ProgramResult result = run_axiscal(
      {"calibrate", "--imu", log, "--unit", "m/s^2", "-o", folder_.path("{slot}.json")});
  EXPECT_EQ(result.status, 1);
  EXPECT_TRUE(std::filesystem::exists(folder_.path("magnetometer.json"))) << result.err;
  EXPECT_THAT(result.err, HasSubstr("accelerometer"));
}

TEST_F(OpenDoors, OnlyOneSensorOfALogIsCalibrated) {
  const std::string log = folder_.write("log.csv", imu_log(plain_header));
  const ProgramResult result = run_axiscal({"calibrate", "--imu", log, "--only", "accelerometer",
                                            "--unit", "m/s^2", "-o", folder_.path("{slot}.json")});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_TRUE(std::filesystem::exists(folder_.path("accelerometer.json")));
  EXPECT_FALSE(std::filesystem::exists(folder_.path("magnetometer.json")));
}

TEST_F(OpenDoors, SeveralLogsAreOneRecording) {
  const std::string all = imu_log(plain_header);
  const std::size_t half = all.find("\n40.00,") + 1;
  const std::string first = folder_.write("first.csv", all.substr(0, half));
  const std::string second = folder_.write("second.csv", plain_header + all.substr(half));
  const ProgramResult result =
      run_axiscal({"calibrate", "--imu", first, second, "--only", "accelerometer", "--unit",
                   "m/s^2", "-o", folder_.path("{slot}.json")});
  ASSERT_EQ(result.status, 0) << result.err;
  const json record = read_json(folder_.path("accelerometer.json"));
  EXPECT_EQ(record["inputs"].size(), 2U);
  EXPECT_NEAR(record["coefficients"]["bias"][0].get<double>(), 0.12, 0.01);
}

TEST_F(OpenDoors, ARestThatRepeatsOneValueIsLeftOut) {
  std::string text = imu_log(plain_header);
  // The sensor sleeps and repeats one value for a minute.
  const std::string frozen = ",3.0,4.0,8.0,0.31,-0.22,0.14,10.0,20.0,-40.0\n";
  for (int i = 0; i < 3000; ++i) {
    text += std::to_string(80.0 + 0.02 * i) + frozen;
  }
  const ProgramResult result =
      run_axiscal({"calibrate", "--imu", folder_.write("log.csv", text), "--only", "accelerometer",
                   "--unit", "m/s^2", "-o", folder_.path("{slot}.json")});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_NEAR(
      read_json(folder_.path("accelerometer.json"))["coefficients"]["bias"][2].get<double>(), 0.31,
      0.01);
}

TEST_F(OpenDoors, ClockTimesDatesAndMillisecondsAreTimes) {
  const auto log_with = [&](const std::function<std::string(int)>& time) {
    std::string text = "time,ax,ay,az\n";
    for (int i = 0; i < 600; ++i) {
      text += time(i) + "," + row_text(instrument_.read(Eigen::Vector3d(0.0, 0.0, 9.80665))) + "\n";
    }
    return text;
  };
  const std::vector<std::function<std::string(int)>> clocks = {
      [](int i) {
        std::array<char, 64> text{};
        std::snprintf(text.data(), text.size(), "2024-03-05 14:08:%02d:%03d", i / 50 % 60,
                      i % 50 * 20);
        return std::string(text.data());
      },
      [](int i) {
        std::array<char, 64> text{};
        std::snprintf(text.data(), text.size(), "3/25/2024 14:08:%02d.%03d", i / 50 % 60,
                      i % 50 * 20);
        return std::string(text.data());
      }};
  for (const auto& clock : clocks) {
    const ProgramResult result =
        run_axiscal({"log", folder_.write("log.csv", log_with(clock)), "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    const json series = json::parse(result.out)["series"];
    bool found = false;
    for (const json& one : series) {
      found = found ||
              (one["rate_hz"].is_number() && std::abs(one["rate_hz"].get<double>() - 50.0) < 1.0);
    }
    EXPECT_TRUE(found) << clock(1) << result.out;
  }
}

TEST_F(OpenDoors, JsonLinesOfMavlogdumpAreSeriesByType) {
  std::string text;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d a = instrument_.read(Eigen::Vector3d(0.0, 0.0, 9.80665));
    std::array<char, 400> lines{};
    std::snprintf(
        lines.data(), lines.size(),
        R"({"meta": {"type": "IMU", "timestamp": %.4f}, "data": {"TimeUS": %d, "I": 0, "GyrX": 0.01, "GyrY": 0.02, "GyrZ": -0.01, "AccX": %.5f, "AccY": %.5f, "AccZ": %.5f}})"
        "\n"
        R"({"meta": {"type": "ATT", "timestamp": %.4f}, "data": {"TimeUS": %d, "Roll": 0.1}})"
        "\n",
        1700000000.0 + 0.02 * i, 20000 * i, a.x(), a.y(), a.z(), 1700000000.0 + 0.02 * i,
        20000 * i);
    text += lines.data();
  }
  const ProgramResult result = run_axiscal({"log", folder_.write("flight.json", text)});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("accelerometer"));
  EXPECT_THAT(result.out, HasSubstr("gyroscope"));
  EXPECT_THAT(result.out, HasSubstr("ATT"));
}

TEST_F(OpenDoors, TheReferenceOfTheReadingsAndOneNumberForTheFaces) {
  const std::string run = folder_.write("run.csv", twelve_readings(instrument_));
  const auto u_of = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {
        "calibrate", run, "--instrument", "accelerometer", "--unit", "V", "-o", cal_, "--force"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramResult result = run_axiscal(arguments);
    EXPECT_EQ(result.status, 0) << result.err;
    const ProgramResult csv = run_axiscal({"export", cal_, "--format", "csv"});
    for (const std::vector<std::string>& row : csv_cells(csv.out)) {
      if (row[0] == "x.sensitivity.x") {
        return std::stod(row[3]);
      }
    }
    ADD_FAILURE() << csv.out;
    return 0.0;
  };
  const double plain = u_of({});
  EXPECT_GT(u_of({"--reference-u", "0.001"}), std::max(2.0 * plain, 0.009));
  const std::string positioned = folder_.path("positioned.json");
  EXPECT_EQ(run_axiscal({"calibrate", run, "--instrument", "accelerometer", "--unit", "m/s^2",
                         "--positioner-u", "0.001", "-o", positioned})
                .status,
            0);
  EXPECT_THAT(read_file(positioned), HasSubstr("0.001"));
}

TEST_F(OpenDoors, ReportReadsNamesAndMaps) {
  const std::string named = twelve_readings(instrument_);
  const std::string run = folder_.write("run.csv", named.substr(named.find('\n') + 1));
  ASSERT_EQ(run_axiscal({"calibrate", run, "--names", "rest,fence,x,y,z", "--instrument",
                         "accelerometer", "--unit", "m/s^2", "-o", cal_})
                .status,
            0);
  const ProgramResult result = run_axiscal(
      {"report", cal_, run, "--names", "rest,fence,x,y,z", "-o", folder_.path("report.html")});
  EXPECT_EQ(result.status, 0) << result.err;
}

// Three axes are turned about one of them. Only the determined coefficients are fitted.
TEST_F(OpenDoors, ATurnAboutOneAxisGivesWhatItDetermines) {
  std::string text = "fx,fy,fz,x,y,z\n";
  for (int i = 0; i < 12; ++i) {
    const double angle = 2.0 * M_PI * i / 12.0;
    const Eigen::Vector3d field(std::cos(angle), std::sin(angle), 0.0);
    text += row_text(field) + "," + row_text(instrument_.read(field)) + "\n";
  }
  const ProgramResult result =
      run_axiscal({"calibrate", folder_.write("turn.csv", text), "--instrument", "generic",
                   "--field", "custom", "--field-magnitude", "1", "-o", cal_});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_NEAR(read_json(cal_)["coefficients"]["sensitivity"][1][1].get<double>(), 0.998, 0.005);
  EXPECT_THAT(result.err + result.out, HasSubstr("not seen"));
}

// The compass of a vehicle with two axes, turned on the ground. The readings lie on an ellipse.
TEST_F(OpenDoors, ACompassOfTwoAxesIsTurnedInAPlane) {
  std::string text = "x,y\n";
  std::normal_distribution<double> noise(0.0, 0.05);
  for (int i = 0; i < 36; ++i) {
    const double angle = 2.0 * M_PI * i / 36.0;
    std::array<char, 64> row{};
    std::snprintf(row.data(), row.size(), "%.5f,%.5f\n",
                  12.0 + 1.2 * 20.0 * std::cos(angle) + 0.1 * 20.0 * std::sin(angle) +
                      noise(instrument_.random),
                  -7.0 + 0.1 * 20.0 * std::cos(angle) + 0.9 * 20.0 * std::sin(angle) +
                      noise(instrument_.random));
    text += row.data();
  }
  const ProgramResult result =
      run_axiscal({"calibrate", folder_.write("compass.csv", text), "--axes", "x,y", "--instrument",
                   "magnetometer", "--unit", "uT", "--field", "custom", "--field-magnitude", "20",
                   "--field-unit", "uT", "-o", cal_});
  ASSERT_EQ(result.status, 0) << result.err;
  const json record = read_json(cal_);
  EXPECT_NEAR(record["coefficients"]["bias"][0].get<double>(), 12.0, 0.05);
  EXPECT_NEAR(record["coefficients"]["bias"][1].get<double>(), -7.0, 0.05);
  EXPECT_NEAR(record["coefficients"]["sensitivity"][0][0].get<double>(), 1.2, 0.005);
  EXPECT_NEAR(record["coefficients"]["sensitivity"][1][0].get<double>(), 0.1, 0.005);
  EXPECT_NEAR(record["coefficients"]["sensitivity"][1][1].get<double>(), 0.9, 0.005);
  EXPECT_EQ(run_axiscal({"report", cal_, "-o", folder_.path("report.html")}).status, 0);
}

TEST_F(OpenDoors, OneColumnOfAnglesIsEnough) {
  std::string text = "angle,V\n";
  for (int angle = -60; angle <= 60; angle += 15) {
    std::array<char, 64> row{};
    std::snprintf(row.data(), row.size(), "%d,%.6f\n", angle,
                  0.02 + 2.5 * std::sin(angle * M_PI / 180.0));
    text += row.data();
  }
  const ProgramResult result =
      run_axiscal({"calibrate", folder_.write("angle.csv", text), "--instrument", "inclinometer",
                   "--axes", "V", "-o", cal_});
  ASSERT_EQ(result.status, 0) << result.err;
}

TEST_F(OpenDoors, TheDefaultIsJoint) {
  const std::string run = folder_.write("run.csv", twelve_readings(instrument_));
  ASSERT_EQ(run_axiscal(
                {"calibrate", run, "--instrument", "accelerometer", "--unit", "m/s^2", "-o", cal_})
                .status,
            0);
  EXPECT_EQ(read_json(cal_)["method"], "joint");
}

TEST_F(OpenDoors, DefinitionsThatABagLacksComeFromAFolder) {
  const ProgramResult none =
      run_axiscal({"log", folder_.write("log.csv", twelve_readings(instrument_)), "--definitions",
                   folder_.path("none")});
  EXPECT_NE(none.status, 0);
  std::filesystem::create_directories(folder_.path("my_robot/msg"));
  folder_.write("my_robot/msg/Six.msg", "float64 ax\nfloat64 ay\n");
  EXPECT_EQ(run_axiscal({"log", folder_.path("log.csv"), "--definitions", folder_.path("")}).status,
            0);
}

}  // namespace
}  // namespace axiscal::test
