// SPDX-License-Identifier: Apache-2.0
// Answers that could mislead: the command reports nonsense, ignored inputs and comparisons that
// prove nothing.
#include <cmath>
#include <sstream>

#include <gmock/gmock.h>

#include "data.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

class HonestAnswers : public testing::Test {
 protected:
  // At least 12 simulated readings in volts.
  std::string run_of(const std::string& name, const axiscal::test::Run& run) {
    return folder_.write(name, observations_text(accelerometer_truth(), run));
  }

  // Calibrates the readings. @return the path of the record.
  std::string record_of(const std::string& run) {
    const std::string record = folder_.path("cal.json");
    EXPECT_EQ(run_axiscal(
                  {"calibrate", run, "--instrument", "accelerometer", "--unit", "V", "-o", record})
                  .status,
              0);
    return record;
  }

  // Joins the lines of a wrapped message.
  static std::string unwrapped(std::string text) {
    for (std::size_t at = text.find("\n    "); at != std::string::npos; at = text.find("\n    ")) {
      text.replace(at, 5, " ");
    }
    return text;
  }

  ScratchFolder folder_;
};

TEST_F(HonestAnswers, AWalkIsNoCalibration) {
  AXISCAL_NEED_DATA(log, "log_phyphox/Accelerometer.csv");
  const ProgramResult result = run_axiscal(
      {"calibrate", log, "--axes", "X (m/s^2),Y (m/s^2),Z (m/s^2)", "--instrument", "accelerometer",
       "--field", "gravity", "--method", "magnitude", "--unit", "m/s^2"});
  EXPECT_EQ(result.status, 1);
  EXPECT_THAT(unwrapped(result.err), HasSubstr("the instrument was moving"));
  EXPECT_THAT(unwrapped(result.err), HasSubstr("indoors"));
}

TEST_F(HonestAnswers, AUnitOfTheFieldMeansASensitivityOfOne) {
  const std::string run = run_of("run.csv", {.noise_sd = 1e-4});
  const std::vector<std::string> in_g = {"calibrate",     run,      "--instrument",
                                         "accelerometer", "--unit", "g"};
  const ProgramResult refused = run_axiscal(in_g);  // the readings are 2.5 V/g
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(unwrapped(refused.err), HasSubstr("times the expected sensitivity of readings in g"));
  std::vector<std::string> stated = in_g;
  stated.insert(stated.end(), {"--nominal-sensitivity", "2.5"});
  EXPECT_EQ(run_axiscal(stated).status, 0);
}

TEST_F(HonestAnswers, TheRecordsOwnReadingsProveNothing) {
  const std::string run = run_of("run.csv", {.replicates = 2, .noise_sd = 1e-4});
  const std::string record = record_of(run);
  EXPECT_THAT(run_axiscal({"check", record, run}).out, HasSubstr("always agree"));
  EXPECT_TRUE(json::parse(run_axiscal({"check", record, run, "--json"}).out)["own_readings"]);
  const std::string other = run_of("other.csv", {.replicates = 2, .noise_sd = 1e-4, .seed = 2});
  EXPECT_THAT(run_axiscal({"check", record, other}).out, Not(HasSubstr("always agree")));
}

TEST_F(HonestAnswers, BiasesThatHoldTheFieldAreComparedAsSuch) {
  // Recordings at rest over temperature. The even samples are calibrated, the odd ones check the
  // record.
  const auto sweep = [&](const std::string& name, int first, double shift) {
    std::string text = "temperature,x,y,z\n";
    for (int i = first; i < 240; i += 2) {
      const double t = 10.0 + 0.1 * i;
      const auto wave = [&](double phase) { return 2e-4 * std::sin(7.3 * i + phase); };
      text += std::to_string(t) + "," + std::to_string(0.2 + 1e-3 * t + wave(0.0) + shift) + "," +
              std::to_string(-0.1 - 5e-4 * t + wave(1.0)) + "," +
              std::to_string(1.01 + 2e-4 * t + wave(2.0)) + "\n";
    }
    return folder_.write(name, text);
  };
  const std::string own = sweep("own.csv", 0, 0.0);
  const std::string record = folder_.path("bias.json");
  ASSERT_EQ(run_axiscal({"calibrate", own, "--instrument", "accelerometer", "--method", "bias",
                         "--temperature-order", "1", "--unit", "V", "-o", record})
                .status,
            0);
  const ProgramResult same = run_axiscal({"check", record, own});
  EXPECT_EQ(same.status, 0) << same.out;  // an earlier version said drifted
  EXPECT_THAT(same.out, HasSubstr("always agree"));
  EXPECT_THAT(same.out, Not(HasSubstr("degrees")));
  const ProgramResult fresh = run_axiscal({"check", record, sweep("fresh.csv", 1, 0.0)});
  EXPECT_EQ(fresh.status, 0) << fresh.out;
  EXPECT_EQ(run_axiscal({"check", record, sweep("moved.csv", 1, 2e-3)}).status, 1);

  EXPECT_EQ(run_axiscal({"report", record, own, "-o", folder_.path("report.html")}).status, 0);
  EXPECT_EQ(run_axiscal({"budget", record, "--pitch", "10"}).status, 3);
  const ProgramResult applied = run_axiscal({"apply", record, own});
  const std::vector<std::vector<std::string>> rows = csv_cells(applied.out);
  const std::vector<std::string>& header = rows.front();
  for (std::size_t j = 0; j < header.size(); ++j) {
    if (header[j] == "residual" || header[j] == "pitch_deg" || header[j] == "flag") {
      EXPECT_EQ(rows[1][j], "") << header[j];
    }
    if (header[j] == "field_x") {
      EXPECT_NEAR(std::stod(rows[1][j]), 0.0, 2e-3);
    }
  }
}

TEST_F(HonestAnswers, TemperaturesAreNotPassedOverInSilence) {
  const auto run_with = [&](const std::string& name, int blocks, bool soaks) {
    const std::string plain =
        observations_text(accelerometer_truth(), {.replicates = blocks, .noise_sd = 1e-4});
    std::string text;
    int row = 0;
    for (const std::vector<std::string>& cells : csv_cells(plain)) {
      const int block = (row - 1) / 12;
      const double t = soaks ? -10.0 + 35.0 * block + 0.02 * (row % 3)
                             : -10.0 + 70.0 * std::abs(std::sin(2.7 * row));
      for (std::size_t j = 0; j < cells.size(); ++j) {
        const bool axis = row > 0 && j + 3 >= cells.size();
        text +=
            (j > 0 ? "," : "") + (axis ? std::to_string(std::stod(cells[j]) + 1e-3 * t) : cells[j]);
      }
      text += row == 0 ? ",temperature\n" : "," + std::to_string(t) + "\n";
      ++row;
    }
    return folder_.write(name, text);
  };
  const auto calibrate = [&](const std::string& run, const std::vector<std::string>& more = {}) {
    std::vector<std::string> all = {"calibrate",     run,      "--instrument",
                                    "accelerometer", "--unit", "V"};
    all.insert(all.end(), more.begin(), more.end());
    return run_axiscal(all);
  };
  EXPECT_THAT(calibrate(run_with("soaks.csv", 3, true)).err,
              HasSubstr("temperature terms of order 1 were chosen"));
  const ProgramResult few = calibrate(run_with("few.csv", 1, false), {"--method", "paired"});
  EXPECT_THAT(unwrapped(few.err), HasSubstr("the column 'temperature' range from"));
  EXPECT_THAT(unwrapped(calibrate(folder_.path("few.csv"),
                                  {"--method", "paired", "--temperature-order", "0"})
                            .err),
              Not(HasSubstr("the column 'temperature' range from")));
}

TEST_F(HonestAnswers, WhatIsIgnoredIsRefused) {
  const std::string run = run_of("run.csv", {.noise_sd = 1e-4});
  const std::vector<std::string> good = {"calibrate", run, "--instrument", "accelerometer"};
  for (const std::vector<std::string>& more : std::vector<std::vector<std::string>>{
           {"--accelerometer", "a,b,c"}, {"--instance", "1"}, {"--rate", "100"}}) {
    std::vector<std::string> all = good;
    all.insert(all.end(), more.begin(), more.end());
    const ProgramResult result = run_axiscal(all);
    EXPECT_EQ(result.status, 2) << more.front();
    EXPECT_THAT(result.err, HasSubstr(more.front()));
  }
  const ProgramResult assembly = run_axiscal(
      {"acquire", "--connect", "sim:", "--assembly", "parallel", "--name", folder_.path("q")});
  EXPECT_EQ(assembly.status, 2);
  EXPECT_THAT(assembly.err, HasSubstr("--slot"));
  const ProgramResult pattern =
      run_axiscal({"acquire", "--connect", "sim:", "--record", folder_.path("q-{slot}.json")});
  EXPECT_EQ(pattern.status, 2);
  EXPECT_EQ(folder_.file_count(), 1U);

  std::string two = "rest,fence,acc.x,acc.y,acc.z,mag.x,mag.y,mag.z\n";
  for (const std::vector<std::string>& row : csv_cells(read_file(run))) {
    if (row.front() != "run") {
      two += row[row.size() - 5] + "," + row[row.size() - 4];
      for (int copy = 0; copy < 2; ++copy) {
        for (std::size_t j = row.size() - 3; j < row.size(); ++j) {
          two += "," + row[j];
        }
      }
      two += "\n";
    }
  }
  const ProgramResult kinds =
      run_axiscal({"calibrate", folder_.write("two.csv", two), "--instrument", "accelerometer"});
  EXPECT_EQ(kinds.status, 2);
  EXPECT_THAT(kinds.err, HasSubstr("slot 'mag' suggests the kind"));
}

TEST_F(HonestAnswers, LevelTakesReadingsAsTheDocsSay) {
  const std::string run = run_of("run.csv", {.slope = {0.003, -0.002}, .noise_sd = 1e-5});
  const ProgramResult good =
      run_axiscal({"level", run, "--instrument", "accelerometer", "--adjusters",
                   "0.1,0;-0.1,0.08;-0.1,-0.08", "--thread-pitch", "0.0005"});
  EXPECT_EQ(good.status, 0) << good.err;
  const ProgramResult millimetres =
      run_axiscal({"level", run, "--instrument", "accelerometer", "--adjusters",
                   "100,0;-100,80;-100,-80", "--thread-pitch", "0.5"});
  EXPECT_EQ(millimetres.status, 2);
  EXPECT_THAT(millimetres.err, HasSubstr("0.1 for 100 mm"));
  EXPECT_EQ(run_axiscal({"level", run, "--adjusters", "0.1,0;-0.1,0.08;-0.1,-0.08"}).status, 0);
}

TEST_F(HonestAnswers, OneNumberForOneThing) {
  const std::string record = folder_.path("cal.json");
  ASSERT_EQ(run_axiscal({"calibrate", std::string(AXISCAL_SOURCE_DIR) + "/examples/run.csv",
                         "--instrument", "accelerometer", "--unit", "V", "-o", record})
                .status,
            0);
  const json budget = json::parse(run_axiscal({"budget", record, "--json"}).out);
  const json parameters = read_json(record)["uncertainty"]["parameters"];
  ASSERT_FALSE(parameters.empty());
  const std::string text = run_axiscal({"budget", record}).out;
  for (const json& parameter : parameters) {
    const std::string name = parameter["parameter"];
    if (name.ends_with(".bias")) {  // biases are in both tables
      std::vector<std::string> lines;
      std::istringstream all(text);
      for (std::string line; std::getline(all, line);) {
        if (line.starts_with("  " + name + " ")) {
          lines.push_back(line);
        }
      }
      ASSERT_EQ(lines.size(), 2U) << text;
      EXPECT_EQ(lines[0], lines[1]);
    }
    // k is Student's t for the stated degrees of freedom.
    EXPECT_NEAR(parameter["expanded_95"].get<double>(),
                parameter["coverage_factor_95"].get<double>() * parameter["u"].get<double>(),
                1e-12);
  }
  EXPECT_FALSE(budget["not_counted"].empty());
}

TEST_F(HonestAnswers, ErrorsEndWithTheLineToType) {
  std::string log = "time,ux,uy,uz\n";
  for (int i = 0; i < 400; ++i) {
    log += std::to_string(0.01 * i) + ",0,0,1\n";
  }
  const ProgramResult imu = run_axiscal({"calibrate", "--imu", folder_.write("log.csv", log)});
  EXPECT_EQ(imu.status, 3);
  EXPECT_THAT(imu.err, HasSubstr("try --accelerometer ux,uy,uz"));
  const ProgramResult semicolons = run_axiscal(
      {"calibrate", folder_.write("s.csv", "rest;fence;x;y;z\n"), "--instrument", "accelerometer"});
  EXPECT_THAT(semicolons.err, HasSubstr("s.csv:1: the cells are separated by semicolons"));
  const ProgramResult field = run_axiscal(
      {"calibrate", folder_.path("s.csv"), "--instrument", "generic", "--field", "gravty"});
  EXPECT_THAT(field.err, HasSubstr("did you mean 'gravity'?"));
}

TEST_F(HonestAnswers, ExportsSayWhatTheyTakeAndDoNotCollide) {
  const std::string run = run_of("run.csv", {.replicates = 2, .noise_sd = 1e-4});
  const std::string record = record_of(run);
  const ProgramResult ros =
      run_axiscal({"export", record, "--format", "ros", "--reading-factor", "3.92266"});
  EXPECT_EQ(ros.status, 0) << ros.err;
  EXPECT_THAT(ros.err, HasSubstr("9.80665"));
  EXPECT_THAT(run_axiscal({"export", record, "--format", "c-header"}).out,
              HasSubstr("#ifndef AXISCAL_ACCELEROMETER_CALIBRATION_H"));
}

}  // namespace
}  // namespace axiscal::test
