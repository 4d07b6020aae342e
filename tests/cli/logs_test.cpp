// SPDX-License-Identifier: Apache-2.0
// The commands segment, noise and calibrate --imu.
#include <cmath>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/logs/simulate_log.hpp"
#include "program.hpp"

namespace axiscal::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

std::string csv_of(const RecordedLog& log) {
  std::string text;
  for (std::size_t c = 0; c < log.columns.size(); ++c) {
    text += (c > 0 ? "," : "") + log.columns[c];
  }
  for (std::size_t i = 0; i < log.samples[0].size(); ++i) {
    text += '\n';
    for (std::size_t c = 0; c < log.columns.size(); ++c) {
      text += (c > 0 ? "," : "") + number_text(log.samples[c][i]);
    }
  }
  return text + "\n";
}

ImuSimulation some_imu() {
  return {.accelerometer = LinearResponse{.bias = Eigen::Vector3d(0.02, -0.01, 0.03),
                                          .sensitivity = 2.5 * Eigen::Matrix3d::Identity()},
          .gyroscope = LinearResponse{.bias = Eigen::Vector3d(0.5, -0.2, 0.1),
                                      .sensitivity = 57.3 * Eigen::Matrix3d::Identity()},
          .accelerometer_sd = 2e-3,
          .gyroscope_sd = 0.05,
          .slope = Eigen::Vector2d(0.003, -0.002)};
}

class LogCommands : public testing::Test {
 protected:
  void SetUp() override {
    sheet_ = make_run_sheet(standard_design(12), 1, 7);
    sheet_path_ = folder_.write("sheet.csv", run_sheet_csv(sheet_));
    log_path_ =
        folder_.write("log.csv", csv_of(simulate_imu_log(some_imu(), attitudes_of(sheet_))));
  }

  ScratchFolder folder_;
  std::vector<RunSheetRow> sheet_;
  std::string sheet_path_;
  std::string log_path_;
};

// The gyroscope is calibrated with an existing record of the accelerometer, which is not changed.
TEST_F(LogCommands, TakeARecordOfTheAccelerometer) {
  ASSERT_EQ(run_axiscal(
                {"calibrate", "--imu", log_path_, "--cube", "-o", folder_.path("both-{slot}.json")})
                .status,
            0);
  const ProgramResult result =
      run_axiscal({"calibrate", "--imu", log_path_, "--cube", "--accelerometer-record",
                   folder_.path("both-accelerometer.json"), "-o", folder_.path("new-{slot}.json")});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_FALSE(std::filesystem::exists(folder_.path("new-accelerometer.json")));
  EXPECT_EQ(read_json(folder_.path("new-gyroscope.json"))["coefficients"],
            read_json(folder_.path("both-gyroscope.json"))["coefficients"]);
}

// segment and calibrate make a record from a log.
TEST_F(LogCommands, SegmentGivesWhatCalibrateTakes) {
  const std::string run = folder_.path("run.csv");
  const ProgramResult segmented = run_axiscal(
      {"segment", log_path_, "--columns", "ax,ay,az", "--plan", sheet_path_, "-o", run});
  ASSERT_EQ(segmented.status, 0) << segmented.err;
  EXPECT_THAT(segmented.err, HasSubstr("12 rests found in "));
  EXPECT_THAT(segmented.err, testing::Not(HasSubstr("warning")));
  const std::string record = folder_.path("cal.json");
  const ProgramResult calibrated =
      run_axiscal({"calibrate", run, "--instrument", "accelerometer", "--field", "gravity",
                   "--axes", "ax,ay,az", "-o", record});
  ASSERT_EQ(calibrated.status, 0) << calibrated.err;
  const json cal = read_json(record);
  EXPECT_EQ(cal["method"], "joint");
  EXPECT_NEAR(cal["coefficients"]["bias"][2].get<double>(), 0.03, 1e-3);
  EXPECT_NEAR(cal["levelness"]["mean"]["x"].get<double>(), 0.003, 3e-4);
}

TEST_F(LogCommands, SegmentSaysWhichSeatsDoNotFit) {
  std::vector<RunSheetRow> other = sheet_;
  other[4].entry.point =
      DesignPoint(opposite(other[4].entry.point.rest()), other[4].entry.point.fence());
  const ProgramResult result = run_axiscal({"segment", log_path_, "--columns", "ax,ay,az", "--plan",
                                            folder_.write("other.csv", run_sheet_csv(other))});
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.err, HasSubstr("run 5 (rest 5): the sheet states"));
}

TEST_F(LogCommands, SegmentRecognisesSeatsAndWritesJson) {
  const ProgramResult result = run_axiscal({"segment", log_path_, "--columns", "ax,ay,az",
                                            "--recognise", "--gyroscope", "gx,gy,gz", "--json"});
  ASSERT_EQ(result.status, 0) << result.err;
  const json out = json::parse(result.out);
  ASSERT_EQ(out["rests"].size(), 12U);
  EXPECT_EQ(out["rests"][3]["rest"], face_name(sheet_[3].entry.point.rest()));
  EXPECT_GT(out["tried"].size(), 8U);
  EXPECT_THAT(result.err, HasSubstr("recognised by the gyroscope"));
}

TEST_F(LogCommands, ReadPipesAndRates) {
  const ProgramResult result =
      run_axiscal({"segment", "-", "--columns", "ax,ay,az", "--rate", "100"},
                  {.stdin_text = read_file(log_path_)});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_EQ(csv_cells(result.out).size(), 13U);
}

// The times are microseconds, and the column's name does not state this. Either the unit is
// recognised and reported, or the log is refused.
TEST_F(LogCommands, TimesInAnotherUnitGiveNoWrongScale) {
  RecordedLog log = simulate_imu_log(some_imu(), attitudes_of(sheet_));
  for (double& t : log.samples[0]) {
    t *= 1e6;
  }
  const auto calibrated = [&](const std::string& name) {
    return run_axiscal({"calibrate", "--imu", folder_.write(name, csv_of(log)), "--gyroscope",
                        "gx,gy,gz", "--cube", "-o", folder_.path("us-{slot}.json")});
  };
  const ProgramResult result = calibrated("us.csv");
  ASSERT_EQ(result.status, 0) << result.err;
  const json gyroscope = read_json(folder_.path("us-gyroscope.json"));
  EXPECT_NEAR(gyroscope["coefficients"]["sensitivity"][1][1].get<double>(), 57.3, 0.1);
  EXPECT_EQ(gyroscope["status"], "warning");
  EXPECT_EQ(gyroscope["warnings"][0]["code"], "log");
  EXPECT_THAT(gyroscope["warnings"][0]["message"].get<std::string>(),
              HasSubstr("the times are assumed to be microseconds, which gives 100 Hz"));
  for (double& t : log.samples[0]) {
    t *= 0.1;  // 1000 Hz if in us, 1 Hz if in ms
  }
  const ProgramResult unclear = calibrated("unclear.csv");
  EXPECT_EQ(unclear.status, 3);
  EXPECT_THAT(unclear.err, HasSubstr("the unit of the times is not clear"));
}

TEST_F(LogCommands, ImuGivesARecordForEachInstrument) {
  const ProgramResult result =
      run_axiscal({"calibrate", "--imu", log_path_, "--gyroscope", "gx,gy,gz", "--cube", "--unit",
                   "V", "--gyroscope-unit", "deg/s", "-o", folder_.path("imu-{slot}.json")});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("12 rests found in "));
  EXPECT_THAT(result.out, HasSubstr("11 turns, attitude error"));
  const json accelerometer = read_json(folder_.path("imu-accelerometer.json"));
  const json gyroscope = read_json(folder_.path("imu-gyroscope.json"));
  EXPECT_EQ(accelerometer["method"], "joint");
  EXPECT_EQ(gyroscope["method"], "turns");
  EXPECT_EQ(gyroscope["instrument"]["unit"], "deg/s");
  EXPECT_NEAR(gyroscope["coefficients"]["sensitivity"][1][1].get<double>(), 57.3, 0.1);
  EXPECT_EQ(gyroscope["inputs"][0]["sha256"].get<std::string>().size(), 64U);
  // apply reads the gyroscope's record.
  const ProgramResult applied =
      run_axiscal({"apply", folder_.path("imu-gyroscope.json"), log_path_});
  EXPECT_EQ(applied.status, 0) << applied.err;
  EXPECT_THAT(applied.out, HasSubstr("field_x,field_y,field_z"));
}

TEST_F(LogCommands, NoiseAndThePlanThatUsesIt) {
  RandomStream random(3);
  std::string text = "t,x,y\n";
  for (int i = 0; i < 20000; ++i) {
    const double x = 0.1 * random.normal();
    const double y = 0.2 * random.normal();
    text += number_text(0.01 * i) + "," + number_text(x) + "," + number_text(y) + "\n";
  }
  const std::string rest = folder_.write("rest.csv", text);
  const ProgramResult shown = run_axiscal({"noise", rest});
  ASSERT_EQ(shown.status, 0) << shown.err;
  EXPECT_THAT(shown.out, HasSubstr("20000 samples at 100 Hz, 200 s"));
  EXPECT_THAT(shown.out, HasSubstr("white"));
  const std::string noise = folder_.path("noise.json");
  ASSERT_EQ(run_axiscal({"noise", rest, "--json", "-o", noise}).status, 0);
  const json file = read_json(noise);
  const double white = file["columns"]["y"]["coefficients"]["white"]["value"].get<double>();
  EXPECT_NEAR(white, 0.02, 1e-3);
  const ProgramResult plan =
      run_axiscal({"plan", "--noise-log", noise, "--dwell", "4", "-o", folder_.path("plan.csv")});
  ASSERT_EQ(plan.status, 0) << plan.err;
  EXPECT_THAT(plan.err, HasSubstr("dwell time at each design point"));
  const std::string::size_type at = plan.err.find("deviation of ");
  ASSERT_NE(at, std::string::npos) << plan.err;
  EXPECT_NEAR(std::stod(plan.err.substr(at + 13)) / (white / std::sqrt(4.0)), 1.0, 0.15);
  EXPECT_EQ(run_axiscal({"plan", "--dwell", "4"}).status, 2);
  EXPECT_EQ(run_axiscal({"plan", "--noise-log", rest}).status, 3);
}

// An existing curve, a range of tau and more deviations.
TEST_F(LogCommands, NoiseOfACurve) {
  std::string text = "tau,adev,n\n";
  for (int i = 0; i < 12; ++i) {
    const double tau = 0.01 * std::pow(2.0, i);
    const double n = 100001.0 - 2.0 * std::pow(2.0, i);
    text +=
        number_text(tau) + "," + number_text(0.02 / std::sqrt(tau)) + "," + number_text(n) + "\n";
  }
  const std::string curve = folder_.write("curve.csv", text);
  const ProgramResult shown = run_axiscal({"noise", curve, "--curve", "--json"});
  ASSERT_EQ(shown.status, 0) << shown.err;
  const json column = json::parse(shown.out)["columns"]["adev"];
  EXPECT_NEAR(column["coefficients"]["white"]["value"].get<double>(), 0.02, 1e-9);
  EXPECT_EQ(column["coefficients"]["random_walk"]["value"].get<double>(), 0.0);
  EXPECT_NEAR(column["deviation_at_1_s"].get<double>(), 0.02, 1e-9);
  EXPECT_GT(column["fit"]["p_value"].get<double>(), 0.05);
  EXPECT_EQ(column["allan_deviation"].size(), 12U);
  const ProgramResult part = run_axiscal({"noise", curve, "--curve", "--tau", "0.1,5", "--json"});
  ASSERT_EQ(part.status, 0) << part.err;
  EXPECT_NEAR(json::parse(part.out)["columns"]["adev"]["fit"]["from_tau_s"].get<double>(), 0.16,
              1e-9);
  EXPECT_EQ(run_axiscal({"noise", curve, "--curve", "--tau", "0.1,0.2"}).status, 2);
  EXPECT_EQ(run_axiscal({"noise", curve, "--curve", "--tau", "5,1"}).status, 2);
  EXPECT_EQ(run_axiscal({"noise", curve, "--curve", "--deviations", "mdev"}).status, 2);
  const std::string back = folder_.write("back.csv", "tau,adev\n1,2\n1,2\n3,4\n5,6\n");
  const ProgramResult wrong = run_axiscal({"noise", back, "--curve"});
  EXPECT_EQ(wrong.status, 3);
  EXPECT_THAT(wrong.err, HasSubstr("point 2 of the curve: tau must be positive, and"));
  EXPECT_EQ(run_axiscal({"noise", folder_.write("no.csv", "a,b\n1,2\n2,3\n"), "--curve"}).status,
            3);
}

// The output is a table in the units of data sheets. Curves are optional, and -o writes a page.
TEST_F(LogCommands, NoiseIsToldInATable) {
  RandomStream random(3);
  std::string text = "time,gx (deg/s),gy (deg/s),gz (deg/s)\n";
  for (int i = 0; i < 20000; ++i) {
    text += number_text(0.01 * i);
    for (int k = 0; k < 3; ++k) {
      text += "," + number_text(0.1 * random.normal());
    }
    text += "\n";
  }
  const std::string rest = folder_.write("rest.csv", text);
  const ProgramResult shown = run_axiscal({"noise", rest});
  ASSERT_EQ(shown.status, 0) << shown.err;
  EXPECT_THAT(shown.out, HasSubstr("[deg/sqrt(h)]"));
  // 0.1 deg/s at 100 Hz is 0.01 deg/s/sqrt(Hz) or 0.6 deg/sqrt(h).
  const std::size_t row = shown.out.find("\n  gx");
  ASSERT_NE(row, std::string::npos) << shown.out;
  EXPECT_NEAR(std::stod(shown.out.substr(row + 16)), 0.6, 0.03) << shown.out;
  EXPECT_THAT(shown.out, Not(HasSubstr("tau [s]")));
  EXPECT_THAT(run_axiscal({"noise", rest, "--all"}).out, HasSubstr("tau [s]"));
  const std::string page = folder_.path("noise.html");
  ASSERT_EQ(run_axiscal({"noise", rest, "-o", page}).status, 0);
  EXPECT_THAT(read_file(page), HasSubstr("id=\"allan-1\""));
}

TEST_F(LogCommands, NoiseWithMoreDeviations) {
  RandomStream random(3);
  std::string text = "x\n";
  for (int i = 0; i < 3000; ++i) {
    text += number_text(random.normal()) + "\n";
  }
  const std::string rest = folder_.write("rest.csv", text);
  const ProgramResult shown =
      run_axiscal({"noise", rest, "--rate", "1", "--deviations", "mdev,hdev,totdev", "--json"});
  ASSERT_EQ(shown.status, 0) << shown.err;
  const json curve = json::parse(shown.out)["columns"]["x"]["allan_deviation"];
  EXPECT_NEAR(curve[0]["mdev"].get<double>(), curve[0]["deviation"].get<double>(), 1e-12);
  EXPECT_NEAR(curve[2]["totdev"].get<double>() / curve[2]["deviation"].get<double>(), 1.0, 0.02);
  EXPECT_NEAR(curve[2]["hdev"].get<double>() / curve[2]["deviation"].get<double>(), 1.0, 0.1);
  EXPECT_THAT(run_axiscal({"noise", rest, "--rate", "1", "--deviations", "mdev"}).out,
              HasSubstr("mdev"));
  EXPECT_EQ(run_axiscal({"noise", rest, "--rate", "1", "--deviations", "tdev"}).status, 2);
}

// A broken log gives an answer or a clear error with the documented exit status.
TEST_F(LogCommands, BrokenLogsGiveAnAnswerOrAClearError) {
  const std::string good = read_file(log_path_);
  const auto segment = [&](const std::string& text, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"segment", folder_.write("broken.csv", text), "--columns",
                                          "ax,ay,az"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_axiscal(arguments);
  };
  EXPECT_EQ(segment("").status, 3);
  EXPECT_EQ(segment("t,ax,ay,az\n").status, 3);
  EXPECT_EQ(segment("t,ax,ay\n1,2,3\n").status, 3);
  EXPECT_EQ(segment(good.substr(0, good.size() / 2 + 7)).status, 0);  // a log that is still growing
  EXPECT_EQ(segment(good.substr(0, 500)).status, 1);                  // too short for a rest
  EXPECT_THAT(segment(good.substr(0, 500)).err, HasSubstr("no rest of 1 s or more was found"));
  EXPECT_EQ(run_axiscal({"segment", folder_.path("none.csv")}).status, 3);
  std::filesystem::create_directory(folder_.path("empty"));
  EXPECT_EQ(run_axiscal({"segment", folder_.path("empty")}).status, 3);
  EXPECT_EQ(run_axiscal({"segment"}).status, 2);
  EXPECT_EQ(segment(good, {"--window", "-1"}).status, 2);
  EXPECT_EQ(segment(good, {"--rate", "100", "--time", "t"}).status, 2);
  EXPECT_EQ(segment(good, {"--plan", log_path_}).status, 3);
  EXPECT_EQ(segment(good, {"--recognise", "--plan", sheet_path_}).status, 2);
  // All rests have one orientation, so a calibration is not possible.
  const std::string still = folder_.write(
      "still.csv", csv_of(simulate_imu_log(
                       some_imu(), std::vector<Eigen::Matrix3d>(12, Eigen::Matrix3d::Identity()))));
  const ProgramResult one = run_axiscal({"calibrate", "--imu", still, "--gyroscope", "gx,gy,gz",
                                         "-o", folder_.path("one-{slot}.json")});
  EXPECT_EQ(one.status, 1);
  EXPECT_THAT(one.err, HasSubstr("needs rests in many attitudes"));
  EXPECT_EQ(run_axiscal({"calibrate", "--imu", log_path_, "--gyroscope", "gx,gy,gz", "-o",
                         folder_.path("one.json")})
                .status,
            2);
  EXPECT_EQ(run_axiscal({"noise", still, "--columns", "wx"}).status, 3);
}

TEST_F(LogCommands, ColumnsThatAreNoneAreRefused) {
  EXPECT_THAT(run_axiscal({"segment", log_path_, "--columns", "t,ay,az"}).err,
              HasSubstr("column 't' is the column of times"));
  EXPECT_EQ(run_axiscal({"calibrate", "--imu", log_path_, "--gyroscope", "t,gx,gy"}).status, 3);
  for (const char* option : {"--gyroscope", "--magnetometer"}) {
    const ProgramResult result = run_axiscal(
        {"segment", log_path_, "--columns", "ax,ay,az", "--recognise", option, "gx,gy,none"});
    EXPECT_EQ(result.status, 3);
    EXPECT_THAT(result.err, HasSubstr("column 'none' is missing"));
  }
}

TEST_F(LogCommands, TheGyroscopeIsHeldAgainstTheSheet) {
  std::vector<RunSheetRow> other = sheet_;
  other[5].entry.point = other[5].entry.point.turned_round();
  const ProgramResult result =
      run_axiscal({"segment", log_path_, "--columns", "ax,ay,az", "--gyroscope", "gx,gy,gz",
                   "--plan", folder_.write("other.csv", run_sheet_csv(other))});
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.err, HasSubstr("rest 6: the sheet states"));
  EXPECT_THAT(result.err, testing::Not(HasSubstr("rest 5:")));
}

TEST_F(LogCommands, TheFirstFenceMakesTheSlopeKnown) {
  const std::string first(face_name(sheet_[0].entry.point.fence()));
  const ProgramResult result =
      run_axiscal({"calibrate", "--imu", log_path_, "--cube", "--first-fence", first, "--json"});
  ASSERT_EQ(result.status, 0) << result.err;
  const json records = json::parse(result.out);
  EXPECT_NEAR(records[0]["levelness"]["mean"]["x"].get<double>(), 0.003, 4e-4);
  EXPECT_NEAR(records[0]["levelness"]["mean"]["y"].get<double>(), -0.002, 4e-4);
  // The columns of the gyroscope are recognised by their names.
  EXPECT_EQ(records[1]["method"], "turns");
}

// A million rows through a pipe. The benchmark tests the memory (RLIMIT); here only the result is
// tested.
TEST_F(LogCommands, AMillionRowsGoThrough) {
  std::string text = "ax,ay,az\n";
  RandomStream random(1);
  std::vector<std::string> rows;
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector2d xy = 1e3 * random.normals<2>();
    rows.push_back(number_text(std::round(xy(0))) + "," + number_text(std::round(xy(1))) +
                   ",16384\n");
  }
  text.reserve(20000000);
  for (int i = 0; i < 1000000; ++i) {
    text += rows[static_cast<std::size_t>(i * 7 % 1000)];
  }
  const ProgramResult result = run_axiscal(
      {"segment", "-", "--columns", "ax,ay,az", "--rate", "1000"}, {.stdin_text = text});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("1000000 samples"));
}

}  // namespace
}  // namespace axiscal::test
