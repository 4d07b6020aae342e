// SPDX-License-Identifier: Apache-2.0
// Inputs for which a wrong result could be stored silently.
#include <cmath>
#include <cstdio>
#include <fstream>

#include <gmock/gmock.h>

#include "strangers.hpp"

namespace axiscal::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

const std::vector<std::string> accelerometer = {"--instrument", "accelerometer", "--unit", "m/s^2"};

ProgramResult calibrate(const std::vector<std::string>& files,
                        const std::vector<std::string>& more) {
  std::vector<std::string> arguments = {"calibrate"};
  arguments.insert(arguments.end(), files.begin(), files.end());
  arguments.insert(arguments.end(), accelerometer.begin(), accelerometer.end());
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run_axiscal(arguments);
}

class WrongInSilence : public testing::Test {
 protected:
  ScratchFolder folder_;
  StrangeInstrument instrument_;
  std::string cal_ = folder_.path("cal.json");
};

TEST_F(WrongInSilence, ANumberNear10IsGravityInMetresPerSecondSquared) {
  const std::string run = folder_.write("run.csv", twelve_readings(instrument_));
  const ProgramResult result = calibrate({run}, {"--field-magnitude", "9.81", "-o", cal_});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("m/s^2"));
  const json record = read_json(cal_);
  EXPECT_EQ(record["field"]["unit"], "m/s^2");
  EXPECT_NEAR(record["coefficients"]["sensitivity"][0][0].get<double>(), 1.002, 2e-3);
}

TEST_F(WrongInSilence, GravityThatCannotBeIsRefused) {
  const std::string run = folder_.write("run.csv", twelve_readings(instrument_));
  for (const std::vector<std::string>& field :
       {std::vector<std::string>{"--field-magnitude", "9.81", "--field-unit", "g"},
        {"--field-magnitude", "9.5", "--field-unit", "m/s^2"},
        {"--field-magnitude", "1.02", "--field-unit", "g"}}) {
    std::vector<std::string> more = field;
    more.insert(more.end(), {"-o", cal_});
    const ProgramResult refused = calibrate({run}, more);
    EXPECT_EQ(refused.status, 1) << field[1];
    EXPECT_THAT(refused.err + refused.out, HasSubstr("on the Earth")) << field[1];
    more.push_back("--force");
    EXPECT_EQ(calibrate({run}, more).status, 1) << "stored, and still a refused record";
    EXPECT_EQ(read_json(cal_)["status"], "refused");
  }
}

TEST_F(WrongInSilence, SeveralInstrumentsAreNotBlocksOfOne) {
  std::vector<std::string> files;
  for (int unit = 0; unit < 3; ++unit) {
    StrangeInstrument one;
    one.random.seed(static_cast<unsigned>(unit) + 1);
    one.bias += 0.05 * unit * Eigen::Vector3d::Ones();
    one.sensitivity *= 1.0 + 0.004 * unit;
    files.push_back(folder_.write("SN" + std::to_string(unit) + ".csv", twelve_readings(one)));
  }
  const ProgramResult refused = calibrate(files, {"-o", cal_});
  EXPECT_NE(refused.status, 0);
  EXPECT_THAT(refused.err, HasSubstr("SN1.csv"));
  EXPECT_THAT(refused.err, HasSubstr("--each"));
  const ProgramResult each = calibrate(files, {"--each", "-o", folder_.path("{file}.json")});
  ASSERT_EQ(each.status, 0) << each.err;
  for (int unit = 0; unit < 3; ++unit) {
    const json record = read_json(folder_.path("SN" + std::to_string(unit) + ".json"));
    EXPECT_NEAR(record["coefficients"]["bias"][0].get<double>(), 0.12 + 0.05 * unit, 0.01);
  }
}

TEST_F(WrongInSilence, FilesOfOneInstrumentAreStillItsBlocks) {
  std::vector<std::string> files;
  for (int block = 0; block < 3; ++block) {
    files.push_back(
        folder_.write("block" + std::to_string(block) + ".csv", twelve_readings(instrument_)));
  }
  EXPECT_EQ(calibrate(files, {"-o", cal_}).status, 0);
}

TEST_F(WrongInSilence, TheDateIsThatOfTheReadings) {
  const std::string run = folder_.write(
      "run.csv", twelve_readings(instrument_, ",serial,operator,date", ",SN7,A. Smith,2024-03-05"));
  ASSERT_EQ(calibrate({run}, {"-o", cal_}).status, 0);
  const json record = read_json(cal_);
  EXPECT_THAT(record["measured"].get<std::string>(), testing::StartsWith("2024-03-05"));
  EXPECT_EQ(record["operator"], "A. Smith");
  EXPECT_EQ(record["instrument"]["serial"], "SN7");
  EXPECT_THAT(record["created"].get<std::string>(), Not(testing::StartsWith("2024")));

  const std::string other = folder_.path("other.json");
  ASSERT_EQ(calibrate({run}, {"--calibrated", "2023-01-02", "-o", other}).status, 0);
  EXPECT_THAT(read_json(other)["measured"].get<std::string>(), testing::StartsWith("2023-01-02"));
}

TEST_F(WrongInSilence, AHistoryRunsOverTheDatesOfTheReadings) {
  for (const char* const year : {"2021", "2022", "2023", "2024"}) {
    const std::string run = folder_.write(
        std::string(year) + ".csv",
        twelve_readings(instrument_, ",serial,date", ",SN7," + std::string(year) + "-06-01"));
    ASSERT_EQ(
        calibrate({run}, {"-o", folder_.path("records-" + std::string(year) + ".json")}).status, 0);
  }
  const ProgramResult history = run_axiscal({"check", "--history", folder_.path(""), "--json"});
  EXPECT_TRUE(json::accept(history.out));
  EXPECT_THAT(history.out, HasSubstr("2021-06-01"));
  EXPECT_THAT(history.out, HasSubstr("2024-06-01"));
}

TEST_F(WrongInSilence, ATemplateAsItStandsMakesADraft) {
  const std::string run = folder_.write("run.csv", twelve_readings(instrument_));
  ASSERT_EQ(calibrate({run}, {"-o", cal_}).status, 0);
  const std::string laboratory = folder_.path("laboratory.json");
  ASSERT_EQ(run_axiscal({"template", "laboratory", "-o", laboratory}).status, 0);
  const ProgramResult report = run_axiscal(
      {"report", cal_, "--laboratory", laboratory, "-o", folder_.path("certificate.pdf")});
  ASSERT_EQ(report.status, 0) << report.err;
  EXPECT_THAT(report.err, HasSubstr("requires"));
}

// The cube's sides lean by one degree, and only `rest` is stated. The bias is like (max + min) / 2.
TEST_F(WrongInSilence, SixFacesWithoutAFenceKeepTheLeanOutOfTheBias) {
  double squares = 0.0;
  constexpr int trials = 12;
  for (int trial = 0; trial < trials; ++trial) {
    instrument_.random.seed(static_cast<unsigned>(trial));
    std::uniform_real_distribution<double> turn(0.0, 2.0 * M_PI);
    std::string text = "rest,x,y,z\n";
    for (std::size_t i = 0; i < 12; i += 2) {
      const StrangeSeat seat = twelve_seats()[i];
      const Eigen::Vector3d side = seat.up.unitOrthogonal();
      const double at = turn(instrument_.random);
      const double lean = M_PI / 180.0;
      const Eigen::Vector3d up =
          std::cos(lean) * seat.up +
          std::sin(lean) * (std::cos(at) * side + std::sin(at) * seat.up.cross(side));
      text +=
          std::string(seat.rest) + "," + row_text(instrument_.read(standard_gravity * up)) + "\n";
    }
    const std::string run = folder_.write("six.csv", text);
    ASSERT_EQ(calibrate({run}, {"-o", cal_}).status, 0);
    const json record = read_json(cal_);
    for (int axis = 0; axis < 3; ++axis) {
      const double off =
          record["coefficients"]["bias"][static_cast<std::size_t>(axis)].get<double>() -
          instrument_.bias(axis);
      squares += off * off / (3.0 * trials);
    }
  }
  EXPECT_LT(std::sqrt(squares), 0.004);  // m/s^2; 0.04 if the sides are taken as level
}

std::string cloud_of(StrangeInstrument& instrument, const Eigen::Vector3d& up, int samples) {
  std::string text;
  std::normal_distribution<double> shake(0.0, 0.01);
  for (int i = 0; i < samples; ++i) {
    const double common = shake(instrument.random);
    const Eigen::Vector3d v =
        instrument.read(standard_gravity * up) + common * Eigen::Vector3d(1.0, 1.0, 0.0);
    text += row_text(v) + "\n";
  }
  return text;
}

TEST_F(WrongInSilence, RawSamplesOfSixFacesAreSixReadings) {
  std::vector<std::string> files;
  std::string all = "ax,ay,az\n";
  for (std::size_t i = 0; i < 12; i += 2) {
    const StrangeSeat seat = twelve_seats()[i];
    const Eigen::Index axis = i < 4 ? 2 : i < 8 ? 0 : 1;
    const std::string name = std::string(1, "xyz"[axis]) + (seat.up.sum() > 0.0 ? "_up" : "_down");
    const std::string cloud = cloud_of(instrument_, seat.up, 50);
    all += cloud;
    files.push_back(folder_.write(name + ".csv", "ax,ay,az\n" + cloud));
  }
  const std::string one = folder_.write("all.csv", all);
  for (const std::vector<std::string>& run : {files, {one}}) {
    const ProgramResult result = calibrate(run, {"--axes", "ax,ay,az", "-o", cal_});
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_THAT(result.err, HasSubstr("samples of 6 rests"));
    const json record = read_json(cal_);
    EXPECT_EQ(record["method"], "faces");
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(record["coefficients"]["bias"][axis].get<double>(),
                  instrument_.bias(static_cast<Eigen::Index>(axis)), 0.01);
    }
  }
  const ProgramResult cross =
      calibrate(files, {"--axes", "ax,ay,az", "--method", "magnitude", "-o", cal_});
  EXPECT_EQ(cross.status, 1);
  EXPECT_THAT(cross.err, HasSubstr("method 'magnitude' needs"));
}

TEST_F(WrongInSilence, AFileNamedAfterAnotherFaceIsRefused) {
  std::vector<std::string> files;
  for (std::size_t i = 0; i < 12; i += 2) {
    const StrangeSeat seat = twelve_seats()[i];
    const Eigen::Index axis = i < 4 ? 2 : i < 8 ? 0 : 1;
    // The names of x_up and y_up are exchanged.
    const char letter = axis == 0 && seat.up.sum() > 0.0   ? 'y'
                        : axis == 1 && seat.up.sum() > 0.0 ? 'x'
                                                           : "xyz"[axis];
    const std::string name = std::string(1, letter) + (seat.up.sum() > 0.0 ? "_up" : "_down");
    files.push_back(
        folder_.write(name + ".csv", "ax,ay,az\n" + cloud_of(instrument_, seat.up, 50)));
  }
  const ProgramResult result = calibrate(files, {"--axes", "ax,ay,az", "-o", cal_});
  EXPECT_EQ(result.status, 1);
  EXPECT_THAT(result.err, HasSubstr("the file name says that face"));
}

// A log of rests, with quick turns between them.
std::string log_of(StrangeInstrument& instrument, int rests) {
  std::string text = "time,ax,ay,az\n";
  std::normal_distribution<double> shake(0.0, 1.5);
  Eigen::Vector3d up = instrument.direction();
  int sample = 0;
  const auto put = [&](const Eigen::Vector3d& v) {
    std::array<char, 32> time{};
    std::snprintf(time.data(), time.size(), "%.2f,", 0.02 * sample++);
    text += time.data() + row_text(v) + "\n";
  };
  for (int rest = 0; rest < rests; ++rest) {
    for (int i = 0; i < 150; ++i) {
      put(instrument.read(standard_gravity * up));
    }
    const Eigen::Vector3d next = instrument.direction();
    for (int i = 0; i < 50 && rest + 1 < rests; ++i) {
      const Eigen::Vector3d between = (up + (next - up) * i / 50.0).normalized();
      put(instrument.read(standard_gravity * between) + Eigen::Vector3d(shake(instrument.random),
                                                                        shake(instrument.random),
                                                                        shake(instrument.random)));
    }
    up = next;
  }
  return text;
}

TEST_F(WrongInSilence, CheckFindsTheRestsOfARawLog) {
  const std::string log = folder_.write("log.csv", log_of(instrument_, 20));
  ASSERT_EQ(calibrate({log}, {"--axes", "ax,ay,az", "-o", cal_}).status, 0);
  const std::string same = folder_.write("same.csv", log_of(instrument_, 20));
  EXPECT_EQ(run_axiscal({"check", cal_, same}).status, 0);
  instrument_.bias.x() += 0.1;
  const std::string later = folder_.write("later.csv", log_of(instrument_, 20));
  const ProgramResult drifted = run_axiscal({"check", cal_, later});
  EXPECT_EQ(drifted.status, 1);
  EXPECT_THAT(drifted.out, HasSubstr("drifted"));
  EXPECT_THAT(drifted.err, HasSubstr("samples of 20 rests"));
}

TEST_F(WrongInSilence, CheckRefusesALogOfMotion) {
  const std::string log = folder_.write("log.csv", log_of(instrument_, 20));
  ASSERT_EQ(calibrate({log}, {"--axes", "ax,ay,az", "-o", cal_}).status, 0);
  std::string text = "time,ax,ay,az\n";
  for (int i = 0; i < 2000; ++i) {
    const double t = 0.02 * i;
    const Eigen::Vector3d up(std::sin(0.9 * t) * std::cos(0.37 * t),
                             std::sin(0.9 * t) * std::sin(0.37 * t), std::cos(0.9 * t));
    text += std::to_string(t) + "," + row_text(instrument_.read(standard_gravity * up)) + "\n";
  }
  const ProgramResult result = run_axiscal({"check", cal_, folder_.write("motion.csv", text)});
  EXPECT_EQ(result.status, 1);
  EXPECT_THAT(result.err, HasSubstr("axiscal segment"));
}

TEST_F(WrongInSilence, NoiseIsOfTheLongestRest) {
  std::string text = "time,ax,ay,az\n";
  std::normal_distribution<double> shake(0.0, 2.0);
  for (int i = 0; i < 6000; ++i) {
    const bool moves = i < 600 || i >= 5400;
    Eigen::Vector3d v = instrument_.read(Eigen::Vector3d(0.0, 0.0, standard_gravity));
    for (Eigen::Index k = 0; k < 3 && moves; ++k) {
      v(k) += shake(instrument_.random);
    }
    text += std::to_string(0.01 * i) + "," + row_text(v) + "\n";
  }
  const std::string log = folder_.write("log.csv", text);
  const ProgramResult result = run_axiscal({"noise", log, "--unit", "m/s^2", "--json"});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("left out"));
  const ProgramResult part =
      run_axiscal({"noise", log, "--unit", "m/s^2", "--from", "10", "--to", "50"});
  EXPECT_EQ(part.status, 0) << part.err;
}

TEST_F(WrongInSilence, NoiseIsNotThatOfASensorThatSleeps) {
  std::string text = "time,ax,ay,az\n";
  std::string last;
  for (int i = 0; i < 9000; ++i) {
    if (i < 3000 || i >= 6000) {
      last = row_text(instrument_.read(Eigen::Vector3d(0.0, 0.0, standard_gravity)));
    }
    text += std::to_string(0.01 * i) + "," + last + "\n";
  }
  const ProgramResult result =
      run_axiscal({"noise", folder_.write("sleeps.csv", text), "--unit", "m/s^2", "--json"});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("left out"));
  const json noise = json::parse(result.out);
  EXPECT_LE(noise["samples"].get<int>(), 3000);
  EXPECT_GE(noise["samples"].get<int>(), 2500);
}

TEST_F(WrongInSilence, NoiseRefusesALogThatMovesAllTheTime) {
  std::string text = "time,ax,ay,az\n";
  for (int i = 0; i < 6000; ++i) {
    const double t = 0.01 * i;
    const Eigen::Vector3d up(std::sin(1.3 * t), 0.3 * std::sin(2.1 * t), std::cos(1.3 * t));
    text += std::to_string(t) + "," + row_text(instrument_.read(standard_gravity * up)) + "\n";
  }
  const ProgramResult result =
      run_axiscal({"noise", folder_.write("walk.csv", text), "--unit", "m/s^2"});
  EXPECT_EQ(result.status, 1);
}

TEST_F(WrongInSilence, TheFirstRowOfATableWithoutAHeaderIsRead) {
  std::string text;
  for (const StrangeSeat& seat : twelve_seats()) {
    text += std::string(seat.rest) + "," + seat.fence + "," +
            row_text(instrument_.read(standard_gravity * seat.up)) + "\n";
  }
  const ProgramResult result = calibrate({folder_.write("bare.csv", text)}, {"-o", cal_});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("12 of 12 readings"));
}

TEST_F(WrongInSilence, ReturnsBeforeTheEndOfALineAreNoCells) {
  std::string text = twelve_readings(instrument_);
  for (std::size_t at = text.find('\n'); at != std::string::npos; at = text.find('\n', at + 3)) {
    text.replace(at, 1, "\r\r\n");
  }
  const ProgramResult result = calibrate({folder_.write("returns.csv", text)}, {"-o", cal_});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_NEAR(read_json(cal_)["coefficients"]["sensitivity"][2][2].get<double>(), 9.80665 * 1.001,
              0.02);
}

TEST_F(WrongInSilence, SignedCountsThatWerePrintedUnsignedGetTheirSign) {
  std::string good = "rest,fence,x,y,z\n";
  std::string wrapped = good;
  for (const StrangeSeat& seat : twelve_seats()) {
    const Eigen::Vector3d v = 2048.0 * instrument_.read(seat.up);
    for (const bool is_wrapped : {false, true}) {
      std::string& text = is_wrapped ? wrapped : good;
      text += std::string(seat.rest) + "," + seat.fence;
      for (Eigen::Index k = 0; k < 3; ++k) {
        const long count = std::lround(v(k));
        text += "," + std::to_string(is_wrapped && count < 0 ? count + 65536 : count);
      }
      text += "\n";
    }
  }
  const std::vector<std::string> counts = {"calibrate",     "",   "--instrument",
                                           "accelerometer", "-o", cal_};
  std::vector<std::string> arguments = counts;
  arguments[1] = folder_.write("good.csv", good);
  ASSERT_EQ(run_axiscal(arguments).status, 0);
  const json expected = read_json(cal_)["coefficients"];
  arguments[1] = folder_.write("wrapped.csv", wrapped);
  const ProgramResult result = run_axiscal(arguments);
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("as unsigned numbers"));
  EXPECT_EQ(read_json(cal_)["coefficients"], expected);
}

TEST_F(WrongInSilence, ErasedMemoryAtTheEndOfALogIsLeftOut) {
  std::string text = log_of(instrument_, 20);
  for (int i = 0; i < 300; ++i) {
    text += "4294967.295,4294967.295,4294967.295,4294967.295\n";
  }
  const ProgramResult result = run_axiscal({"calibrate", "--imu", folder_.write("log.csv", text),
                                            "--unit", "m/s^2", "-o", folder_.path("{slot}.json")});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("300 rows (the first is line"));
}

TEST_F(WrongInSilence, LinesOfASketchAreOneSample) {
  std::string text;
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector3d a = 1000.0 * instrument_.read(instrument_.direction());
    const Eigen::Vector3d m = 400.0 * instrument_.read(instrument_.direction());
    std::array<char, 256> lines{};
    std::snprintf(lines.data(), lines.size(),
                  "ax = %.2f ay = %.2f az = %.2f mg\ngx = 0.06 gy = -1.69 gz = 0.39 deg/s\n"
                  "mx = %.0f my = %.0f mz = %.0f mG\nGyro temperature is 29.1 degrees C\n",
                  a.x(), a.y(), a.z(), m.x(), m.y(), m.z());
    text += lines.data();
  }
  const ProgramResult result = run_axiscal({"log", folder_.write("serial.txt", text)});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("accelerometer"));
  EXPECT_THAT(result.out, HasSubstr("gyroscope"));
  EXPECT_THAT(result.out, HasSubstr("magnetometer"));
  EXPECT_THAT(result.out, HasSubstr(" 40 "));
}

// Adafruit's examples print the name of the sensor only before the first axis.
TEST_F(WrongInSilence, AWordBeforeTheFirstAxisNamesAll) {
  std::string text;
  for (int i = 0; i < 40; ++i) {
    text += "\t\tAccel X: 0.20 \tY: -0.1" + std::to_string(i % 10) +
            " \tZ: 10.21 m/s^2 \n\t\tGyro X: 0.0" + std::to_string(i % 9) +
            " \tY: -0.02 \tZ: 0.02 rad/s \n\n";
  }
  const ProgramResult result = run_axiscal({"log", folder_.write("serial.txt", text)});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("Accel X"));
  EXPECT_THAT(result.out, HasSubstr("Accel Z"));
  EXPECT_THAT(result.out, HasSubstr("Gyro Y"));
}

TEST_F(WrongInSilence, ErasedRowsOfATableAreNoReadings) {
  std::string text = "mx,my,mz\n";
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d v = 480.0 * instrument_.read(instrument_.direction());
    text += std::to_string(std::lround(v.x())) + "," + std::to_string(std::lround(v.y())) + "," +
            std::to_string(std::lround(v.z())) + "\n";
  }
  for (int i = 0; i < 20; ++i) {
    text += "65535,65535,65535\n";
  }
  const ProgramResult result =
      run_axiscal({"calibrate", folder_.write("flash.csv", text), "--instrument", "magnetometer",
                   "--method", "magnitude", "--axes", "mx,my,mz", "-o", cal_});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("20 readings of erased memory"));
}

TEST_F(WrongInSilence, ARowWithoutNumbersAtTheEndChangesNothing) {
  const ProgramResult result =
      run_axiscal({"log", folder_.write("log.csv", log_of(instrument_, 4) + "nan,nan,nan,nan\n")});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("50 Hz"));
  EXPECT_THAT(result.out, Not(HasSubstr("does not vary")));
}

TEST_F(WrongInSilence, TwoLettersBehindThePointSayWhichSensor) {
  std::string text =
      "t,Mag_Accel.ax,Mag_Accel.ay,Mag_Accel.az,Mag_Accel.mx,Mag_Accel.my,Mag_Accel.mz\n";
  for (int i = 0; i < 100; ++i) {
    text += std::to_string(0.02 * i) + "," + row_text(9.8 * instrument_.direction()) + "," +
            row_text(48.0 * instrument_.direction()) + "\n";
  }
  const ProgramResult result = run_axiscal({"log", folder_.write("log.csv", text)});
  EXPECT_THAT(result.out, HasSubstr("magnetometer 0"));
  EXPECT_THAT(result.out, Not(HasSubstr("accelerometer 1")));
}

// Betaflight reads a compass in counts.
TEST_F(WrongInSilence, ACompassInMicroteslaAsksBetaflightsFactor) {
  std::string text = "x,y,z\n";
  for (int i = 0; i < 40; ++i) {
    text += row_text(instrument_.read(48.0 * instrument_.direction())) + "\n";
  }
  const std::string run = folder_.write("compass.csv", text);
  ASSERT_EQ(run_axiscal({"calibrate", run, "--instrument", "magnetometer", "--unit", "uT",
                         "--method", "magnitude", "--field-magnitude", "48", "-o", cal_})
                .status,
            0);
  const ProgramResult without = run_axiscal({"export", cal_, "--format", "betaflight"});
  EXPECT_NE(without.status, 0);
  EXPECT_THAT(without.err, HasSubstr("--reading-factor"));
  EXPECT_EQ(
      run_axiscal({"export", cal_, "--format", "betaflight", "--reading-factor", "10", "--lossy"})
          .status,
      0);
}

TEST_F(WrongInSilence, AnExportedTableHoldsTheExpandedUncertainty) {
  const std::string run = folder_.write("run.csv", twelve_readings(instrument_));
  ASSERT_EQ(calibrate({run}, {"-o", cal_}).status, 0);
  const ProgramResult csv = run_axiscal({"export", cal_, "--format", "csv"});
  ASSERT_EQ(csv.status, 0) << csv.err;
  EXPECT_THAT(csv.out, HasSubstr("parameter,value,standard_error,u,U,k,unit"));
  bool found = false;
  for (const std::vector<std::string>& row : csv_cells(csv.out)) {
    if (row.front() == "x.bias") {
      found = true;
      EXPECT_GT(std::stod(row[4]), std::stod(row[3]));
      EXPECT_NEAR(std::stod(row[4]), std::stod(row[3]) * std::stod(row[5]), 1e-6);
    }
  }
  EXPECT_TRUE(found) << csv.out;
}

struct OtherHeading {
  const char* heading;
  std::string (*word)(const StrangeSeat& seat);
};

std::string axis_of(const StrangeSeat& seat) {
  return std::string(1, "xyz"[seat.up.cwiseAbs().maxCoeff() == std::abs(seat.up.x())   ? 0
                              : seat.up.cwiseAbs().maxCoeff() == std::abs(seat.up.y()) ? 1
                                                                                       : 2]);
}

TEST_F(WrongInSilence, FacesAreReadUnderOtherHeadings) {
  const std::vector<OtherHeading> headings = {
      {"bottom", [](const StrangeSeat& seat) { return std::string(seat.rest); }},
      {"Position",
       [](const StrangeSeat& seat) {
         return axis_of(seat) + (seat.up.sum() > 0.0 ? " up" : " down");
       }},
      {"orientation",
       [](const StrangeSeat& seat) {
         return axis_of(seat) + (seat.up.sum() > 0.0 ? "_up" : "_down");
       }},
      {"pose",
       [](const StrangeSeat& seat) { return (seat.up.sum() > 0.0 ? "+" : "-") + axis_of(seat); }},
      {"posicion", [](const StrangeSeat& seat) {
         return "eje " + axis_of(seat) + (seat.up.sum() > 0.0 ? " arriba" : " abajo");
       }}};
  for (const OtherHeading& heading : headings) {
    std::string text = std::string(heading.heading) + ",x,y,z\n";
    for (const StrangeSeat& seat : twelve_seats()) {
      text +=
          heading.word(seat) + "," + row_text(instrument_.read(standard_gravity * seat.up)) + "\n";
    }
    const ProgramResult result = calibrate({folder_.write("faces.csv", text)}, {"-o", cal_});
    ASSERT_EQ(result.status, 0) << heading.heading << ": " << result.err;
    const json record = read_json(cal_);
    EXPECT_NE(record["method"], "magnitude") << heading.heading;
    EXPECT_NEAR(record["coefficients"]["sensitivity"][0][0].get<double>(), 9.80665 * 1.002, 0.02)
        << heading.heading;
  }
}

TEST_F(WrongInSilence, FacesOfALongTableAreReadToItsEnd) {
  for (const int samples : {30, 100, 300}) {
    std::string text = "position,x,y,z\n";
    for (std::size_t i = 0; i < 12; i += 2) {
      const StrangeSeat seat = twelve_seats()[i];
      for (int k = 0; k < samples; ++k) {
        text += (seat.up.sum() > 0.0 ? "+" : "-") + axis_of(seat) + "," +
                row_text(instrument_.read(standard_gravity * seat.up)) + "\n";
      }
    }
    const ProgramResult result = calibrate({folder_.write("long.csv", text)}, {"-o", cal_});
    ASSERT_EQ(result.status, 0) << samples << result.err;
    const json record = read_json(cal_);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(record["coefficients"]["sensitivity"][axis][axis].get<double>(), 9.81, 0.05)
          << samples;
    }
  }
}

TEST_F(WrongInSilence, AWordThatSaysUpOrDownCountsBeforeItsHeading) {
  for (const char* const heading : {"up", "Face up", "side", "bottom"}) {
    std::string text = std::string(heading) + ",x,y,z\n";
    for (std::size_t i = 0; i < 12; i += 2) {
      const StrangeSeat seat = twelve_seats()[i];
      text += axis_of(seat) + (seat.up.sum() > 0.0 ? " up," : " down,") +
              row_text(instrument_.read(standard_gravity * seat.up)) + "\n";
    }
    const ProgramResult result = calibrate({folder_.write("faces.csv", text)}, {"-o", cal_});
    ASSERT_EQ(result.status, 0) << heading << result.err;
    EXPECT_NEAR(read_json(cal_)["coefficients"]["bias"][2].get<double>(), 0.31, 0.02) << heading;
  }
}

TEST_F(WrongInSilence, WordsThatAreNoFacesAreAnError) {
  std::string text = "position,x,y,z\n";
  int i = 0;
  for (const StrangeSeat& seat : twelve_seats()) {
    text += (i++ == 3 ? std::string("somehow")
                      : axis_of(seat) + (seat.up.sum() > 0.0 ? " up" : " down")) +
            "," + row_text(instrument_.read(standard_gravity * seat.up)) + "\n";
  }
  const ProgramResult result = calibrate({folder_.write("faces.csv", text)}, {"-o", cal_});
  EXPECT_NE(result.status, 0);
  EXPECT_THAT(result.err, HasSubstr("--face-names"));
}

TEST_F(WrongInSilence, AUnitShortOfReadingsIsMarked) {
  std::string text = "serial,rest,fence,x,y,z\n";
  for (const char* const serial : {"A1", "A2", "A3"}) {
    int i = 0;
    for (const StrangeSeat& seat : twelve_seats()) {
      if (std::string(serial) != "A2" || i++ < 9) {
        text += std::string(serial) + "," + seat.rest + "," + seat.fence + "," +
                row_text(instrument_.read(standard_gravity * seat.up)) + "\n";
      }
    }
  }
  const ProgramResult result =
      calibrate({folder_.write("batch.csv", text)}, {"-o", folder_.path("{serial}.json")});
  EXPECT_THAT(result.out, HasSubstr("9 readings, but most units have 12"));
}

// A rate table: the stated fields fx, fy, fz have different lengths, and no magnitude is stated.
TEST_F(WrongInSilence, KnownFieldsOfVaryingSizeNeedNoMagnitude) {
  std::string text = "fx,fy,fz,x,y,z\n";
  for (int axis = 0; axis < 3; ++axis) {
    for (const double rate : {-200.0, -100.0, -20.0, 20.0, 100.0, 200.0}) {
      const Eigen::Vector3d field = rate * Eigen::Vector3d::Unit(axis);
      text += row_text(field) + "," + row_text(instrument_.read(field)) + "\n";
    }
  }
  const ProgramResult result = run_axiscal(
      {"calibrate", folder_.write("rates.csv", text), "--instrument", "gyroscope", "--unit",
       "deg/s", "--field", "induced_rotation", "--field-unit", "deg/s", "-o", cal_});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_NEAR(read_json(cal_)["coefficients"]["sensitivity"][0][0].get<double>(), 1.002, 1e-3);
}

TEST_F(WrongInSilence, ARateTableOfSignedAxesIsUnderstood) {
  std::string text = "axis,rate_dps,x,y,z\n";
  for (int axis = 0; axis < 3; ++axis) {
    for (const double rate : {-100.0, 0.0, 100.0}) {
      text += std::string("+") + "XYZ"[axis] + "," + std::to_string(rate) + "," +
              row_text(instrument_.read(rate * Eigen::Vector3d::Unit(axis))) + "\n";
    }
  }
  const ProgramResult result =
      run_axiscal({"calibrate", folder_.write("rates.csv", text), "--instrument", "gyroscope",
                   "--unit", "deg/s", "-o", cal_});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_NEAR(read_json(cal_)["coefficients"]["sensitivity"][1][1].get<double>(), 0.998, 1e-3);
  EXPECT_THAT(result.err, Not(HasSubstr("on average")));
}

TEST_F(WrongInSilence, ReferenceColumnsAreTheKnownField) {
  std::string text = "x_ref,y_ref,z_ref,x,y,z\n";
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector3d field = (50.0 + 0.1 * i) * instrument_.direction();
    text += row_text(field) + "," + row_text(instrument_.read(field)) + "\n";
  }
  const ProgramResult result =
      run_axiscal({"calibrate", folder_.write("coil.csv", text), "--instrument", "magnetometer",
                   "--unit", "uT", "-o", cal_});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_EQ(read_json(cal_)["method"], "known");
  EXPECT_NEAR(read_json(cal_)["coefficients"]["bias"][0].get<double>(), 0.12, 0.01);
}

TEST_F(WrongInSilence, AWrongReadingDoesNotRefuseARobustRun) {
  std::string text = "rest,fence,x,y,z\n";
  int row = 0;
  for (int block = 0; block < 2; ++block) {
    for (const StrangeSeat& seat : twelve_seats()) {
      Eigen::Vector3d v = instrument_.read(standard_gravity * seat.up);
      v.x() += row++ == 5 ? 30.0 : 0.0;
      text += std::string(seat.rest) + "," + seat.fence + "," + row_text(v) + "\n";
    }
  }
  const std::string run = folder_.write("run.csv", text);
  const ProgramResult robust = calibrate({run}, {"--robust", "-o", cal_});
  ASSERT_EQ(robust.status, 0) << robust.err;
  EXPECT_NEAR(read_json(cal_)["coefficients"]["bias"][0].get<double>(), 0.12, 0.02);
}

TEST_F(WrongInSilence, CheckHoldsAFewLabelledReadingsAgainstTheRecord) {
  std::string text;
  for (int block = 0; block < 3; ++block) {
    const std::string run = twelve_readings(instrument_);
    text += block == 0 ? run : run.substr(run.find('\n') + 1);
  }
  ASSERT_EQ(calibrate({folder_.write("run.csv", text)}, {"-o", cal_}).status, 0);
  for (const std::size_t readings : {2U, 4U, 6U, 7U, 8U, 9U, 11U}) {
    std::string few = "rest,fence,x,y,z\n";
    for (std::size_t i = 0; i < readings; ++i) {
      const StrangeSeat seat = twelve_seats()[(5 * i) % 12];
      few += std::string(seat.rest) + "," + seat.fence + "," +
             row_text(instrument_.read(standard_gravity * seat.up)) + "\n";
    }
    const ProgramResult good = run_axiscal({"check", cal_, folder_.write("few.csv", few)});
    EXPECT_EQ(good.status, 0) << readings << ": " << good.out << good.err;
  }
  instrument_.bias.y() += 0.05;
  std::string few = "rest,fence,x,y,z\n";
  for (std::size_t i = 0; i < 6; ++i) {
    const StrangeSeat seat = twelve_seats()[2 * i];
    few += std::string(seat.rest) + "," + seat.fence + "," +
           row_text(instrument_.read(standard_gravity * seat.up)) + "\n";
  }
  EXPECT_EQ(run_axiscal({"check", cal_, folder_.write("moved.csv", few)}).status, 1);
}

TEST_F(WrongInSilence, ABiasByKnownAttitudesUsesThem) {
  instrument_.sensitivity.setIdentity();
  std::string text = "pitch_deg,roll_deg,x,y,z\n";
  for (const double pitch_deg : {0.0, 20.0, -20.0, 45.0, -45.0, 10.0}) {
    const double pitch = pitch_deg * M_PI / 180.0;
    const Eigen::Vector3d up(std::sin(pitch), 0.0, std::cos(pitch));
    text += std::to_string(pitch_deg) + ",0," + row_text(instrument_.read(standard_gravity * up)) +
            "\n";
  }
  const ProgramResult result =
      calibrate({folder_.write("attitudes.csv", text)}, {"--method", "bias", "-o", cal_});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.err, Not(HasSubstr("ignored")));
  EXPECT_NEAR(read_json(cal_)["coefficients"]["bias"][0].get<double>(), 0.12, 0.02);
}

}  // namespace
}  // namespace axiscal::test
