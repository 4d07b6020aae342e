// SPDX-License-Identifier: Apache-2.0
// The commands export and import.
#include <filesystem>

#include <nlohmann/json.hpp>

#include "matchers.hpp"
#include "program.hpp"

namespace axiscal::test {
namespace {

using testing::HasSubstr;

class ExchangeCommands : public testing::Test {
 protected:
  std::string record(const std::string& status = "ok") {
    return folder_.write(
        "cal.json", R"({"format":"axiscal-calibration","version":1,"status":")" + status + R"(",
"instrument":{"kind":"accelerometer","serial":"A","axes":["x","y","z"],"unit":"m/s^2"},
"field":{"kind":"gravity","unit":"m/s^2","magnitude":9.81,"in_table":[0,0,9.81]},
"coefficients":{"bias":[0.1,-0.2,0.3],"sensitivity":[[1.0,0.02,0],[0,0.98,0],[0,0,1.03]]}})");
  }

  ScratchFolder folder_;
};

TEST_F(ExchangeCommands, ListNamesTheFormats) {
  const ProgramResult list = run_axiscal({"export", "--list"});
  EXPECT_EQ(list.status, 0);
  for (const char* const name : {"ardupilot", "betaflight", "c-header", "cpp-header", "csv",
                                 "kalibr", "px4", "ros", "x-io"}) {
    EXPECT_THAT("\n" + list.out, HasSubstr("\n" + std::string(name) + " ")) << name;
  }
}

TEST_F(ExchangeCommands, WhatDoesNotFitIsRefusedOrSaid) {
  const std::string output = folder_.path("drone.params");
  const ProgramResult refused = run_axiscal({"export", record(), "--format", "px4", "-o", output});
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.err, HasSubstr("cannot store cross-axis terms"));
  EXPECT_FALSE(std::filesystem::exists(output));
  const ProgramResult lossy =
      run_axiscal({"export", record(), "--format", "px4", "--lossy", "-o", output});
  EXPECT_EQ(lossy.status, 0);
  EXPECT_THAT(lossy.err, HasSubstr("cross-axis terms; without these"));
  EXPECT_THAT(read_file(output), HasSubstr("CAL_ACC0_XOFF\t0.1\t9"));
}

TEST_F(ExchangeCommands, ARefusedRecordNeedsForce) {
  EXPECT_EQ(run_axiscal({"export", record("refused"), "--format", "csv"}).status, 1);
  const ProgramResult forced =
      run_axiscal({"export", record("refused"), "--format", "csv", "--force"});
  EXPECT_EQ(forced.status, 0);
  EXPECT_THAT(forced.out, HasSubstr("# THIS CALIBRATION WAS REFUSED"));
}

TEST_F(ExchangeCommands, UsageIsSaid) {
  EXPECT_EQ(run_axiscal({"export", record()}).status, 2);
  const ProgramResult unknown = run_axiscal({"export", record(), "--format", "px5"});
  EXPECT_EQ(unknown.status, 2);
  EXPECT_THAT(unknown.err, HasSubstr("did you mean 'px4'?"));
  EXPECT_EQ(run_axiscal({"export", record(), "--format", "csv", "-o", record()}).status, 2);
  EXPECT_EQ(run_axiscal({"import", record()}).status, 2);
  EXPECT_EQ(run_axiscal({"import", "missing", "--format", "px4"}).status, 3);
}

TEST_F(ExchangeCommands, AnImportedCalibrationIsChecked) {
  const std::string params = folder_.path("drone.params");
  EXPECT_EQ(run_axiscal({"export", record(), "--format", "px4", "--lossy", "-o", params}).status,
            0);
  const std::string old = folder_.path("old.json");
  EXPECT_EQ(run_axiscal({"import", params, "--format", "px4", "-o", old}).status, 0);
  const std::string run = folder_.path("run.csv");
  EXPECT_EQ(run_axiscal({"simulate", "--truth", record(), "--noise", "1e-3", "-o", run}).status, 0);
  const ProgramResult checked = run_axiscal({"check", old, run, "--json"});
  // PX4's parameters lack the cross-axis term, so check reports it as a change.
  EXPECT_EQ(checked.status, 1) << checked.err;
  const nlohmann::json verdict = nlohmann::json::parse(checked.out);
  EXPECT_TRUE(verdict["drifted"]);
  for (const nlohmann::json& change : verdict["changes"]) {
    if (change["parameter"] == "x.sensitivity.y") {
      EXPECT_NEAR(change["new"].get<double>(), 0.02, 1e-3);
      EXPECT_NEAR(change["old"].get<double>(), 0.0, 1e-12);
    }
  }
}

TEST_F(ExchangeCommands, ReportIsOnePage) {
  const std::string run = folder_.path("run.csv");
  EXPECT_EQ(run_axiscal({"simulate", "--truth", record(), "--noise", "1e-3", "-o", run}).status, 0);
  const std::string made = folder_.path("made.json");
  EXPECT_EQ(run_axiscal({"calibrate", run, "--instrument", "accelerometer", "--field", "gravity",
                         "--field-magnitude", "9.81", "--field-unit", "m/s^2", "-o", made})
                .status,
            0);
  const std::string page = folder_.path("report.html");
  const ProgramResult report = run_axiscal({"report", made, run, "-o", page});
  EXPECT_EQ(report.status, 0) << report.err;
  EXPECT_EQ(report.err, "");
  EXPECT_THAT(read_file(page), HasSubstr("</html>"));
  const std::string other = folder_.path("other.csv");
  EXPECT_EQ(
      run_axiscal({"simulate", "--truth", record(), "--noise", "1e-3", "--seed", "2", "-o", other})
          .status,
      0);
  EXPECT_THAT(run_axiscal({"report", made, other, "-o", page}).err, HasSubstr("SHA-256"));
  EXPECT_EQ(run_axiscal({"report", made, "-o", made}).status, 2);
  EXPECT_EQ(run_axiscal({"report", made}).status, 2);
  EXPECT_EQ(run_axiscal({"report", folder_.path("none.json"), "-o", page}).status, 3);
}

}  // namespace
}  // namespace axiscal::test
