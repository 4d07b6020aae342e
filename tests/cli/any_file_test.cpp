// SPDX-License-Identifier: Apache-2.0
// The command with logs and tables of other programs, called as their users would call it.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "data.hpp"
#include "program.hpp"

namespace axiscal {
namespace {

using test::ProgramResult;
using test::run_axiscal;
using testing::HasSubstr;

nlohmann::json json_of(const std::string& path) {
  std::ifstream file(path);
  return nlohmann::json::parse(file);
}

// Joins the lines of a wrapped message.
std::string unwrapped(std::string text) {
  for (std::size_t at = text.find("\n    "); at != std::string::npos; at = text.find("\n    ")) {
    text.replace(at, 5, " ");
  }
  return text;
}

class AnyFile : public testing::Test {
 protected:
  // A recording of a phone that lies on its six faces, 3 s on each at 100 Hz, with 0.5 s of motion
  // between.
  std::string six_faces() {
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    std::string text = "Time (s),X (m/s^2),Y (m/s^2),Z (m/s^2)\n";
    int i = 0;
    const auto add = [&](double x, double y, double z, double sd) {
      std::ostringstream row;
      row.precision(9);
      row << 0.01 * i++ << ',' << x + sd * normal(random) << ',' << y + sd * normal(random) << ','
          << z + sd * normal(random) << '\n';
      text += row.str();
    };
    for (int face = 0; face < 6; ++face) {
      double f[3] = {0.05, -0.08, 0.12};
      f[face / 2] += (face % 2 == 0 ? 1.002 : -1.002) * 9.80665;
      for (int k = 0; k < 300; ++k) {
        add(f[0], f[1], f[2], 0.02);
      }
      for (int k = 0; k < 50; ++k) {
        add(f[0], f[1], f[2], 2.0);
      }
    }
    return folder_.write("Accelerometer.csv", text);
  }

  test::ScratchFolder folder_;
};

TEST_F(AnyFile, IsDescribedWithTheNextCommand) {
  const std::string phone = six_faces();
  const ProgramResult log = run_axiscal({"log", phone});
  EXPECT_EQ(log.status, 0);
  EXPECT_THAT(log.out, HasSubstr("accelerometer 0: Accelerometer (X (m/s^2)"));
  EXPECT_THAT(log.out, HasSubstr("next: axiscal calibrate --imu " + phone));
  const auto json = nlohmann::json::parse(run_axiscal({"log", phone, "--json"}).out);
  EXPECT_EQ(json["format"], "phyphox");
  EXPECT_EQ(json["series"][0]["kind"], "accelerometer");
  EXPECT_EQ(json["series"][0]["samples"], 2100);
  EXPECT_NEAR(json["series"][0]["rate_hz"].get<double>(), 100.0, 1e-6);
}

// A log is read twice, first for its content. A pipe can be read only once, and gives the same
// result.
TEST_F(AnyFile, OfAnAutopilotIsReadFromAPipeAsFromTheFile) {
  std::string text =
      "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns\n"
      "FMT, 150, 50, IMU, QBffffff, TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ\n";
  std::mt19937 random(2);
  std::normal_distribution<double> normal(0.0, 0.01);
  long time_us = 1000000;
  for (int face = 0; face < 6; ++face) {
    for (int i = 0; i < 460; ++i) {
      const double shaken = i < 400 ? 1.0 : 300.0;
      std::ostringstream line;
      line << "IMU, " << (time_us += 5000) << ", 0";
      for (int k = 0; k < 6; ++k) {
        const bool up = k - 3 == face / 2;
        line << ", " << shaken * normal(random) + (up ? (face % 2 == 0 ? 9.81 : -9.81) : 0.0);
      }
      text += line.str() + "\n";
    }
  }
  const ProgramResult piped = run_axiscal({"segment", "-"}, {.stdin_text = text});
  EXPECT_EQ(piped.status, 0) << piped.err;
  const std::string path = folder_.write("flight.log", text);
  EXPECT_EQ(piped.out, run_axiscal({"segment", path}).out);
}

TEST_F(AnyFile, OfAPhoneOnSixFacesIsCalibratedByOneCommand) {
  const ProgramResult result =
      run_axiscal({"calibrate", "--imu", six_faces(), "-o", folder_.path("imu-{slot}.json")});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(unwrapped(result.err), HasSubstr("lay on its six faces"));
  const auto record = json_of(folder_.path("imu-accelerometer.json"));
  EXPECT_EQ(record["instrument"]["unit"], "m/s^2");
  EXPECT_EQ(record["instrument"]["axes"][0], "X");
  EXPECT_EQ(record["field"]["unit"], "m/s^2");
  EXPECT_NEAR(record["coefficients"]["sensitivity"][0][0].get<double>(), 1.002, 1e-3);
  EXPECT_NEAR(record["coefficients"]["bias"][2].get<double>(), 0.12, 5e-3);
}

TEST_F(AnyFile, OfAFlightIsRefusedWithWhatToDo) {
  AXISCAL_NEED_DATA(flight, "log_ulog/sample_log_small.ulg");
  const ProgramResult result =
      run_axiscal({"calibrate", "--imu", flight, "-o", folder_.path("{slot}-{instance}.json")});
  EXPECT_EQ(result.status, 1);
  EXPECT_THAT(result.err, HasSubstr("lay the instrument on each of its six faces"));
  const ProgramResult table = run_axiscal({"calibrate", flight, "--instrument", "accelerometer"});
  EXPECT_EQ(table.status, 3);
  EXPECT_THAT(table.err, HasSubstr("is a recording (ulog)"));
  EXPECT_THAT(table.err, HasSubstr("calibrate --imu"));
}

TEST_F(AnyFile, OfFerrarisGivesImucalsResult) {
  AXISCAL_NEED_DATA(log, "imu_ferraris_imucal/annotated_session.csv");
  AXISCAL_NEED_DATA(published_path, "imu_ferraris_imucal/example_cal.json");
  const ProgramResult result = run_axiscal(
      {"calibrate", "--imu", log, "--rate", "204.8", "-o", folder_.path("imu-{slot}.json")});
  ASSERT_EQ(result.status, 0) << result.err;
  const auto published = json_of(published_path);
  const auto accelerometer = json_of(folder_.path("imu-accelerometer.json"));
  const auto gyroscope = json_of(folder_.path("imu-gyroscope.json"));
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      double acc = 0.0;
      double gyr = 0.0;
      for (std::size_t k = 0; k < 3; ++k) {
        acc += published["K_a"][i][k].get<double>() * published["R_a"][k][j].get<double>();
        gyr += published["K_g"][i][k].get<double>() * published["R_g"][k][j].get<double>();
      }
      EXPECT_NEAR(accelerometer["coefficients"]["sensitivity"][i][j].get<double>(), acc * 9.81,
                  1e-8);
      // imucal takes the turns as -360 degrees. If the sense is not stated, it is chosen so that S
      // is positive.
      EXPECT_NEAR(
          gyroscope["coefficients"]["sensitivity"][i][j].get<double>() * std::numbers::pi / 180.0,
          -gyr, 0.02);
    }
  }
}

TEST_F(AnyFile, OfRegionsThatAreStated) {
  const std::string phone = six_faces();
  std::string regions = R"({"format": "axiscal-regions", "version": 1, "regions": [)";
  const char* const faces[] = {"-X", "+X", "-Y", "+Y", "-Z", "+Z"};
  for (int face = 0; face < 6; ++face) {
    regions += (face > 0 ? "," : "") + std::string(R"({"kind": "rest", "start_sample": )") +
               std::to_string(350 * face) + R"(, "end_sample": )" +
               std::to_string(350 * face + 300) + R"(, "rest": ")" + faces[face] + "\"}";
  }
  const ProgramResult result =
      run_axiscal({"calibrate", "--imu", phone, "--regions",
                   folder_.write("regions.json", regions + "]}"), "-o", folder_.path("r.json")});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_NEAR(json_of(folder_.path("r.json"))["coefficients"]["sensitivity"][1][1].get<double>(),
              1.002, 1e-3);
}

TEST_F(AnyFile, AtRestGivesKalibrsNoise) {
  AXISCAL_NEED_DATA(log, "log_ulog/sample_log_small.ulg");
  const ProgramResult direct = run_axiscal({"noise", log, "--format", "kalibr"});
  ASSERT_EQ(direct.status, 0) << direct.err;
  EXPECT_THAT(direct.out, HasSubstr("accelerometer_noise_density: 0.002"));
  EXPECT_THAT(direct.out, HasSubstr("update_rate: 204.583"));
  const std::string noise = folder_.path("noise.json");
  ASSERT_EQ(run_axiscal({"noise", log, "--json", "-o", noise}).status, 0);
  EXPECT_EQ(run_axiscal({"export", noise, "--format", "kalibr"}).out, direct.out);
}

TEST_F(AnyFile, RecordsOfAVehicleAreOneFileOfParameters) {
  ASSERT_EQ(
      run_axiscal({"calibrate", "--imu", six_faces(), "-o", folder_.path("{slot}.json")}).status,
      0);
  auto record = json_of(folder_.path("accelerometer.json"));
  std::vector<std::string> call = {"export", "--format", "px4", "--lossy"};
  for (int instance = 0; instance < 3; ++instance) {
    record["instance"] = instance;
    record["device"] = std::to_string(2424842 + instance);
    call.push_back(folder_.write("imu-" + std::to_string(instance) + ".json", record.dump()));
  }
  const ProgramResult result = run_axiscal(call);
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("CAL_ACC0_ID\t2424842\t6"));
  EXPECT_THAT(result.out, HasSubstr("CAL_ACC2_ID\t2424844\t6"));
  EXPECT_THAT(result.out, HasSubstr("CAL_ACC2_ZSCALE"));
  EXPECT_THAT(result.out, HasSubstr("for example v = ("));
  EXPECT_THAT(run_axiscal({"export", call.back(), "--format", "iio", "--lossy"}).out,
              HasSubstr("> in_accel_x_calibscale"));
  EXPECT_THAT(run_axiscal({"export", call.back(), "--format", "ros"}).out,
              HasSubstr("linear_acceleration_covariance: ["));
}

TEST_F(AnyFile, NamesItsInstrumentAndUnit) {
  const std::string plan = folder_.path("sheet.csv");
  ASSERT_EQ(run_axiscal({"plan", "--design", "12", "-o", plan}).status, 0);
  // The faces of the run sheet with an accelerometer's readings, in the form of a spreadsheet.
  std::ifstream sheet(plan);
  std::string line;
  std::getline(sheet, line);
  std::string text = "Rest;Fence;acc_x [m/s^2];acc_y [m/s^2];acc_z [m/s^2]\n";
  while (std::getline(sheet, line)) {
    std::istringstream cells(line);
    std::string run, block, rest, fence;
    std::getline(cells, run, ',');
    std::getline(cells, block, ',');
    std::getline(cells, rest, ',');
    std::getline(cells, fence, ',');
    text += rest + ";" + fence;
    for (int axis = 0; axis < 3; ++axis) {
      const bool along = rest[1] == "XYZ"[axis];
      text += !along ? ";0,01" : rest[0] == '-' ? ";9,81" : ";-9,80";
    }
    text += "\n";
  }
  const ProgramResult result =
      run_axiscal({"calibrate", folder_.write("readings.csv", text), "-o", folder_.path("a.json")});
  ASSERT_EQ(result.status, 0) << result.err;
  const auto record = json_of(folder_.path("a.json"));
  EXPECT_EQ(record["instrument"]["kind"], "accelerometer");
  EXPECT_EQ(record["instrument"]["axes"][0], "acc_x");
  EXPECT_EQ(record["instrument"]["unit"], "m/s^2");
  EXPECT_EQ(record["field"]["unit"], "m/s^2");
  // The log has other column names for the axes of the record.
  const std::string other = folder_.write("other.csv", "ax,ay,az\n0.1,0.2,9.8\n");
  const ProgramResult applied = run_axiscal({"apply", folder_.path("a.json"), other});
  EXPECT_EQ(applied.status, 0) << applied.err;
  EXPECT_THAT(unwrapped(applied.err), HasSubstr("are taken from the columns ax, ay, az"));
}

TEST_F(AnyFile, InAnotherUnitIsConvertedOrRefused) {
  ASSERT_EQ(
      run_axiscal({"calibrate", "--imu", six_faces(), "-o", folder_.path("{slot}.json")}).status,
      0);
  const std::string record = folder_.path("accelerometer.json");
  const auto apply = [&](const std::string& header, const std::string& row) {
    return run_axiscal({"apply", record, folder_.write("other.csv", header + "\n" + row + "\n")});
  };
  const ProgramResult same = apply("X (m/s^2),Y (m/s^2),Z (m/s^2)", "0.1,0.2,9.80665");
  const ProgramResult other = apply("X (g),Y (g),Z (g)", "0.010197162129779,0.020394324259558,1");
  ASSERT_EQ(same.status, 0) << same.err;
  ASSERT_EQ(other.status, 0) << other.err;
  EXPECT_THAT(unwrapped(other.err), HasSubstr("is converted from g to m/s^2"));
  const auto first_number = [](const std::string& out) {
    const std::string row = out.substr(out.find('\n') + 1);
    std::size_t at = 0;
    for (int comma = 0; comma < 3; ++comma) {
      at = row.find(',', at) + 1;
    }
    return std::stod(row.substr(at));
  };
  EXPECT_NEAR(first_number(other.out), first_number(same.out), 1e-6);
  const ProgramResult volts = apply("X (V),Y (V),Z (V)", "0.1,0.2,9.8");
  EXPECT_EQ(volts.status, 3);
  EXPECT_THAT(volts.err, HasSubstr("is in V according to its header"));
}

TEST_F(AnyFile, TakesNoSensorThatIsDeadOrMadeByAFilter) {
  std::string text = "time,ax,ay,az,gx,gy,gz\n";
  std::ifstream phone(six_faces());
  std::string line;
  std::getline(phone, line);
  while (std::getline(phone, line)) {
    text += line + ",0,0,0\n";
  }
  const ProgramResult dead = run_axiscal({"calibrate", "--imu", folder_.write("dead.csv", text),
                                          "-o", folder_.path("dead-{slot}.json")});
  EXPECT_EQ(dead.status, 0) << dead.err;
  EXPECT_THAT(unwrapped(dead.err), HasSubstr("gyroscope (gx, gy, gz) has constant readings"));
  // The series `gravity` of Sensor Logger is filtered and has no noise, so a choice by noise would
  // prefer it.
  std::filesystem::create_directory(folder_.path("phone"));
  std::string gravity = "time,seconds_elapsed,z,y,x\n";
  for (int i = 0; i < 100; ++i) {
    gravity += std::to_string(1699734109763076400 + 10000000LL * i) + "," +
               std::to_string(0.01 * i) + ",9.80665,0,0\n";
  }
  folder_.write("phone/Gravity.csv", gravity);
  const ProgramResult log = run_axiscal({"log", folder_.path("phone")});
  EXPECT_EQ(log.status, 0);
  EXPECT_THAT(log.out, testing::Not(HasSubstr("accelerometer 0")));
}

}  // namespace
}  // namespace axiscal
