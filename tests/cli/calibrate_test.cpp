// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <sstream>

#include "matchers.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

const std::vector<std::string> gravity = {"--instrument", "accelerometer", "--field",
                                          "gravity",      "--unit",        "V"};

ProgramResult calibrate(std::vector<std::string> files,
                        const std::vector<std::string>& more = {},
                        const ProgramInput& input = {}) {
  files.insert(files.begin(), "calibrate");
  files.insert(files.end(), gravity.begin(), gravity.end());
  files.insert(files.end(), more.begin(), more.end());
  return run_axiscal(files, input);
}

Eigen::MatrixXd sensitivity_of(const json& record) {
  Eigen::MatrixXd S(3, 3);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      S(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          record["coefficients"]["sensitivity"][i][j].get<double>();
    }
  }
  return S;
}

// @return the words of the first line that begins with `label`.
std::vector<std::string> row_of(const std::string& text, const std::string& label) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::vector<std::string> row;
    for (std::string word; words >> word;) {
      row.push_back(word);
    }
    if (!row.empty() && row[0] == label && row.size() > 1 &&
        row[1].find_first_of("0123456789") != std::string::npos) {
      return row;
    }
  }
  return {};
}

// The record's member `experiment` with the readings added is an experiment.
TEST(CalibrateCommand, StoresAnExperimentThatCanBeDoneAgain) {
  const ScratchFolder folder;
  const std::string run = folder.write(
      "run.csv",
      observations_text(accelerometer_truth(), {.slope = {0.003, -0.002}, .noise_sd = 1e-4}));
  ASSERT_EQ(calibrate({run}, {"--method", "joint", "--drift", "none", "--resolution", "1e-5",
                              "--leave-out", "3", "-o", folder.path("cal.json")})
                .status,
            0);
  const json record = read_json(folder.path("cal.json"));
  json experiment = record["experiment"];
  EXPECT_EQ(experiment["field"]["kind"], "gravity");
  EXPECT_EQ(experiment["leave_out"], json({3}));
  experiment["observations"] = {run};
  const std::string again = folder.write("again.json", experiment.dump());
  ASSERT_EQ(run_axiscal({"calibrate", again, "-o", folder.path("cal2.json")}).status, 0);
  const json second = read_json(folder.path("cal2.json"));
  EXPECT_EQ(second["coefficients"], record["coefficients"]);
  EXPECT_EQ(second["uncertainty"], record["uncertainty"]);
  EXPECT_EQ(second["experiment"], record["experiment"]);
}

TEST(CalibrateCommand, WritesTheRecordAndPrintsTheTables) {
  const ScratchFolder folder;
  const SensorModel truth = accelerometer_truth();
  const std::string run = folder.write(
      "run.csv", observations_text(truth, {.slope = {0.003, -0.002}, .noise_sd = 1e-4, .seed = 4}));
  const ProgramResult result =
      calibrate({run}, {"--serial", "QA-113", "--all", "-o", folder.path("cal.json")});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.err, testing::Not(HasSubstr("warning"))) << "a good run has none";
  EXPECT_THAT(result.err, HasSubstr("only repeatability"));
  const json record = read_json(folder.path("cal.json"));
  EXPECT_EQ(record["instrument"]["serial"], "QA-113");
  EXPECT_EQ(record["inputs"][0]["path"], run);
  EXPECT_MATRIX_NEAR(sensitivity_of(record), truth.response.sensitivity, 5e-4);
  // The printed values are those of the record, rounded to two digits of the uncertainty.
  const std::vector<std::string> y = row_of(result.out, "y");
  const std::vector<std::string> interval = row_of(result.out, "+-");
  ASSERT_EQ(y.size(), 5U) << result.out;
  ASSERT_EQ(interval.size(), 5U);
  for (std::size_t j = 0; j < 3; ++j) {
    const double U = record["statistics"]["interval_95"]["sensitivity"][1][j];
    EXPECT_NEAR(std::stod(y[2 + j]), record["coefficients"]["sensitivity"][1][j].get<double>(),
                0.051 * U);
    EXPECT_NEAR(std::stod(interval[2 + j]),
                record["statistics"]["interval_95"]["sensitivity"][0][j].get<double>(),
                0.051 * record["statistics"]["interval_95"]["sensitivity"][0][j].get<double>());
  }
  const std::vector<std::string> mean = row_of(result.out, "mean");
  EXPECT_NEAR(std::stod(mean[1]), 1e3 * record["levelness"]["mean"]["x"].get<double>(), 0.01);
  EXPECT_THAT(result.out, HasSubstr("the faces agree"));
  EXPECT_THAT(result.out, HasSubstr("[V/g]"));
  EXPECT_THAT(result.out, HasSubstr("record: " + folder.path("cal.json")));
  std::istringstream lines(result.out);
  for (std::string line; std::getline(lines, line);) {
    if (line.find(run) == std::string::npos && line.find("record:") == std::string::npos) {
      EXPECT_LE(line.size(), 80U) << line;
    }
  }
}

// The digest of the text "abc" is in FIPS 180-2, appendix B.1.
TEST(CalibrateCommand, StatesTheDigestOfItsInput) {
  const ScratchFolder folder;
  const std::string text = observations_text(accelerometer_truth(), {});
  const std::string run = folder.write("run.csv", text);
  const json record = json::parse(calibrate({run}, {"--json"}).out);
  const std::string command = "sha256sum '" + run + "'";
  FILE* pipe = ::popen(command.c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  char digest[65] = {};
  ASSERT_EQ(std::fread(digest, 1, 64, pipe), 64U);
  ::pclose(pipe);
  EXPECT_EQ(record["inputs"][0]["sha256"], digest);
}

TEST(CalibrateCommand, ReadsPipesAndPrintsJson) {
  const SensorModel truth = accelerometer_truth();
  const std::string text = observations_text(truth, {.slope = {0.02, -0.01}});
  const ProgramResult result = calibrate({"-"}, {"--json"}, {.stdin_text = text});
  EXPECT_EQ(result.status, 0) << result.err;
  const json record = json::parse(result.out);
  EXPECT_EQ(record["inputs"][0]["path"], "-");
  EXPECT_MATRIX_NEAR(sensitivity_of(record), truth.response.sensitivity, 1e-12);
  const ProgramResult to_stdout = calibrate({"-"}, {"-o", "-"}, {.stdin_text = text});
  EXPECT_EQ(json::parse(to_stdout.out)["status"], "ok");
}

// Readings without noise that go through files give the true coefficients to 1e-12, for slopes up
// to 2 degrees.
TEST(CalibrateCommand, ReturnsTheTruthThroughFiles) {
  const ScratchFolder folder;
  const std::string truth = folder.write("truth.json", R"({"format": "axiscal-calibration",
      "version": 1, "instrument": {"kind": "accelerometer", "axes": ["x", "y", "z"], "unit": "V"},
      "field": {"kind": "gravity", "unit": "g", "magnitude": 1},
      "coefficients": {"bias": [0.012, -0.034, 0.005],
        "sensitivity": [[2.5, 0.01, -0.02], [0.015, 2.48, 0.03], [-0.01, 0.02, 2.52]]}})");
  for (const char* slope : {"0,0", "-0.001,0.002", "0.0349,-0.02"}) {
    const std::string run = folder.path("run.csv");
    ASSERT_EQ(run_axiscal({"simulate", "--truth", truth, "--slope", slope, "-o", run}).status, 0);
    for (const char* method : {"paired", "joint"}) {
      const ProgramResult result = calibrate({run}, {"--method", method, "--json"});
      ASSERT_EQ(result.status, 0) << result.err;
      const json record = json::parse(result.out);
      EXPECT_MATRIX_NEAR(sensitivity_of(record), accelerometer_truth().response.sensitivity, 1e-12);
      EXPECT_EQ(record["status"], "ok");
    }
  }
}

TEST(CalibrateCommand, TakesWhatOperatorsWrite) {
  const ScratchFolder folder;
  const std::string text = observations_text(accelerometer_truth(), {.slope = {0.001, 0.002}});
  std::string messy = "\xEF\xBB\xBF# taken on a Friday\r\n";
  int line_number = 0;
  for (const std::vector<std::string>& cells : csv_cells(text)) {
    if (line_number++ == 0) {
      messy += "operator," + cells[0] + "," + cells[1] + ",\"rest\",fence,x,y,z,remark\r\n";
      continue;
    }
    const std::string rest{cells[2][1], cells[2][0]};  // the form X+
    const std::string fence{cells[3][0], static_cast<char>(cells[3][1] + 32)};
    messy += "A," + cells[0] + "," + cells[1] + "," + rest + ",\"" + fence + "\"," + cells[4] +
             ",\"" + cells[5] + "\", " + cells[6] + " ,\"fine, \"\"really\"\"\"\r\n\r\n# next\r\n";
  }
  const ProgramResult clean = calibrate({folder.write("clean.csv", text)}, {"--json"});
  const ProgramResult result = calibrate({folder.write("messy.csv", messy)}, {"--json"});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_EQ(json::parse(result.out)["coefficients"], json::parse(clean.out)["coefficients"]);
  EXPECT_THAT(result.err, HasSubstr("column remark was ignored"));
  EXPECT_EQ(json::parse(result.out)["operator"], "A");
}

TEST(CalibrateCommand, TakesSeveralFilesAsBlocks) {
  const ScratchFolder folder;
  const SensorModel truth = accelerometer_truth();
  const std::string one =
      folder.write("1.csv", observations_text(truth, {.noise_sd = 1e-4, .seed = 1}));
  const std::string two =
      folder.write("2.csv", observations_text(truth, {.noise_sd = 1e-4, .seed = 2}));
  const json record = json::parse(calibrate({one, two}, {"--json"}).out);
  EXPECT_EQ(record["conditions"]["blocks"], 2);
  EXPECT_EQ(record["conditions"]["kind"], "intermediate");
  EXPECT_EQ(record["residuals"][12]["run"], 13);
  EXPECT_EQ(record["residuals"][12]["block"], 2);
  EXPECT_EQ(record["inputs"].size(), 2U);
  EXPECT_EQ(record["levelness"]["estimates"].size(), 12U);
}

TEST(CalibrateCommand, TakesAnExperimentAndOptionsWin) {
  const ScratchFolder folder;
  folder.write("run.csv", observations_text(accelerometer_truth(), {.slope = {0.001, 0.002}}));
  const std::string experiment = folder.write("e.json", R"({"format": "axiscal-experiment",
      "version": 1, "observations": "run.csv", "method": "joint",
      "instrument": {"kind": "inclinometer", "unit": "V", "serial": "A"},
      "field": {"kind": "gravity"}, "leave_out": [3]})");
  const json record = json::parse(
      run_axiscal({"calibrate", experiment, "--serial", "B", "--json", "--leave-out", "4,5"}).out);
  EXPECT_EQ(record["instrument"]["kind"], "inclinometer");
  EXPECT_EQ(record["instrument"]["serial"], "B");
  EXPECT_EQ(record["method"], "joint");
  EXPECT_EQ(record["leave_out"], (std::vector<int>{4, 5}));
  EXPECT_EQ(record["statistics"]["observations"], 10);
  EXPECT_EQ(record["residuals"].size(), 12U);
}

TEST(CalibrateCommand, RefusesWhatTheReadingsDoNotDetermine) {
  const ScratchFolder folder;
  const std::string cal = folder.write("cal.json", "earlier");
  const auto refusal = [&](const std::string& text, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"-o", cal};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramResult result = calibrate({folder.write("run.csv", text)}, arguments);
    EXPECT_EQ(result.status, 1) << result.out;
    EXPECT_EQ(read_file(cal), "earlier");
    return result.err;
  };
  const std::string header = "rest,fence,x,y,z\n";
  std::string two_faces;
  for (const char* points : {"+X,+Y", "+X,-Y", "-X,+Y", "-X,-Y"}) {
    two_faces += std::string(points) + ",1,2,3\n";
  }
  EXPECT_THAT(refusal(header + two_faces, {}),
              testing::AllOf(HasSubstr("x.sensitivity.y"), HasSubstr("z.sensitivity.z"),
                             HasSubstr("add readings at rest")));
  EXPECT_THAT(refusal(header + "+X,+Y,1,2,3\n+X,+Y,1,2,3\n+X,+Y,1,2,3\n+X,+Y,1,2,3\n", {}),
              HasSubstr("x.bias"));
  EXPECT_THAT(refusal(header + "+X,+Y,1,2,3\n", {"--method", "paired"}), HasSubstr("opposite"));
  const SensorModel truth = accelerometer_truth();
  std::string five = observations_text(truth, {.points = 6});
  five.erase(five.rfind('\n', five.size() - 2) + 1);
  EXPECT_THAT(refusal(five, {}), HasSubstr("add readings at rest"));
  EXPECT_THAT(refusal("level," + header + "2,+X,+Y,1,2,3\n", {}),
              HasSubstr("run 1: the level is 2"));
}

TEST(CalibrateCommand, StoresARefusedRecordOnlyByForce) {
  const ScratchFolder folder;
  const std::string run = folder.write(
      "run.csv",
      observations_text(accelerometer_truth(),
                        {.points = 6, .slope = {1e-4, -1e-4}, .noise_sd = 1e-3, .seed = 3}));
  const std::string cal = folder.path("cal.json");
  const ProgramResult refused = calibrate({run}, {"-o", cal});
  EXPECT_EQ(refused.status, 1);
  EXPECT_EQ(folder.file_count(), 1U);
  EXPECT_THAT(refused.err, HasSubstr("refused"));
  EXPECT_EQ(calibrate({run}, {"-o", cal, "--force"}).status, 1);
  EXPECT_EQ(read_json(cal)["status"], "refused");
  const std::string readings = folder.write("in.csv", "x,y,z\n0,0,1\n");
  EXPECT_EQ(run_axiscal({"apply", cal, readings}).status, 1);
  EXPECT_EQ(run_axiscal({"apply", cal, readings, "--force"}).status, 0);
}

TEST(CalibrateCommand, WarnsOnStandardError) {
  const ScratchFolder folder;
  SensorModel truth = accelerometer_truth();
  truth.response.sensitivity.row(0) *= -1.0;
  const std::string run = folder.write("run.csv", observations_text(truth, {}));
  const ProgramResult result = calibrate({run}, {"-o", folder.path("cal.json")});
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.err, HasSubstr("warning: axis x is reversed"));
  const json record = read_json(folder.path("cal.json"));
  EXPECT_EQ(record["status"], "warning");
  EXPECT_EQ(record["warnings"][0]["code"], "axis_reversed");
}

TEST(CalibrateCommand, TakesAMeasuredCube) {
  const ScratchFolder folder;
  const std::string cube = folder.write("cube.json", R"({"format": "axiscal-positioner",
      "version": 1, "id": "cube-07", "faces": {
      "+X": {"normal": [0.9999995, 0.001, 0]}, "-X": {"normal": [-1, 0, 0]},
      "+Y": {"normal": [0, 1, 0]}, "-Y": {"normal": [0, -0.999998, 0.002]},
      "+Z": {"normal": [0, 0, 1]}, "-Z": {"normal": [0.0005, 0, -0.999999875]}}})");
  const std::string truth = folder.path("truth.json");
  const std::string run = folder.path("run.csv");
  ASSERT_EQ(calibrate({folder.write("a.csv", observations_text(accelerometer_truth(), {}))},
                      {"-o", truth})
                .status,
            0);
  ASSERT_EQ(run_axiscal({"simulate", "--truth", truth, "--positioner", cube, "--slope",
                         "0.004,-0.003", "-o", run})
                .status,
            0);
  const auto error = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return (sensitivity_of(json::parse(calibrate({run}, arguments).out)) -
            accelerometer_truth().response.sensitivity)
        .norm();
  };
  EXPECT_GT(error({}), 1e-3);
  EXPECT_LT(error({"--positioner", cube}), 1e-10);
  EXPECT_LT(error({"--positioner", cube, "--method", "joint"}), 1e-10);
}

TEST(CalibrateCommand, TakesGravityAtASite) {
  const std::string text = observations_text(accelerometer_truth(), {});
  const json record = json::parse(
      calibrate({"-"}, {"--json", "--field-unit", "m/s^2", "--latitude", "-90", "--height=0"},
                {.stdin_text = text})
          .out);
  EXPECT_NEAR(record["field"]["magnitude"].get<double>(), 9.8321849379, 1e-9);
  EXPECT_NEAR(record["coefficients"]["sensitivity"][0][0].get<double>(), 2.5 / 9.8321849379, 1e-10);
}

TEST(CalibrateCommand, TakesOneAndTwoAxes) {
  const ScratchFolder folder;
  const std::string text = observations_text(accelerometer_truth(), {.slope = {0.003, 0.001}});
  const std::string run = folder.write("run.csv", text);
  for (const std::string axes : {"x", "x,z"}) {
    const ProgramResult result = run_axiscal({"calibrate", run, "--instrument", "inclinometer",
                                              "--field", "gravity", "--axes", axes, "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    const json record = json::parse(result.out);
    EXPECT_NEAR(record["coefficients"]["sensitivity"][0][0].get<double>(), 2.5, 1e-12);
    EXPECT_NEAR(record["levelness"]["mean"]["x"].get<double>(), 0.003, 1e-12);
    EXPECT_TRUE(record["residuals"][0]["magnitude"].is_null());
  }
}

}  // namespace
}  // namespace axiscal::test
