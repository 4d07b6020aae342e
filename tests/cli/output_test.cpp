// SPDX-License-Identifier: Apache-2.0
// An output file is replaced completely or not changed.
#include <filesystem>

#include <sys/stat.h>

#include "matchers.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

using testing::HasSubstr;

// Adds a column `serial` to the readings.
std::string with_serial(const std::string& observations, const std::string& serial) {
  std::string text;
  for (std::size_t from = 0; from < observations.size();) {
    const std::size_t end = observations.find('\n', from);
    text += observations.substr(from, end - from) + (from == 0 ? ",serial" : "," + serial) + "\n";
    from = end + 1;
  }
  return text;
}

class Output : public testing::Test {
 protected:
  std::vector<std::string> calibrate_to(const std::string& output) const {
    return {"calibrate", run_, "--instrument", "accelerometer", "--field", "gravity", "-o", output};
  }

  const ScratchFolder folder_;
  const std::string run_ =
      folder_.write("run.csv", observations_text(accelerometer_truth(), {.noise_sd = 1e-4}));
};

TEST_F(Output, OnAFullDiskTheEarlierFileStays) {
  const std::string output = folder_.write("cal.json", "earlier");
  // The limit of the file size simulates a full disk.
  const ProgramResult result = run_axiscal(calibrate_to(output), {.file_size_limit = 1000});
  EXPECT_EQ(result.status, 4);
  EXPECT_THAT(result.err, HasSubstr(output));
  EXPECT_EQ(read_file(output), "earlier");
  EXPECT_EQ(folder_.file_count(), 2U) << "no temporary file is left";
  const std::string readings = folder_.write(
      "in.csv", "x,y,z\n" + [] {
        std::string rows;
        for (int i = 0; i < 200; ++i) {
          rows += "0.1,0.2,2.5\n";
        }
        return rows;
      }());
  const std::string record = folder_.path("good.json");
  ASSERT_EQ(run_axiscal(calibrate_to(record)).status, 0);
  EXPECT_EQ(
      run_axiscal({"apply", record, readings, "-o", output}, {.file_size_limit = 1000}).status, 4);
  EXPECT_EQ(read_file(output), "earlier");
}

TEST_F(Output, AMissingFolderIsSaid) {
  for (const std::string& output : {folder_.path("no/cal.json"), folder_.path("")}) {
    const ProgramResult result = run_axiscal(calibrate_to(output));
    EXPECT_EQ(result.status, 4) << output;
    EXPECT_THAT(result.err, HasSubstr(output));
    EXPECT_EQ(run_axiscal({"plan", "-o", output}).status, 4);
  }
}

TEST_F(Output, ADeviceStaysADevice) {
  EXPECT_EQ(run_axiscal(calibrate_to("/dev/null")).status, 0);
  struct stat status {};
  ASSERT_EQ(::stat("/dev/null", &status), 0);
  EXPECT_TRUE(S_ISCHR(status.st_mode));
  EXPECT_EQ(run_axiscal(calibrate_to("/dev/full")).status, 4);
  EXPECT_EQ(run_axiscal({"plan"}, {.stdout_path = "/dev/full"}).status, 4);
  EXPECT_EQ(run_axiscal({"--help"}, {.stdout_path = "/dev/full"}).status, 4);
}

TEST_F(Output, ALinkIsFollowed) {
  const std::string target = folder_.write("target.json", "earlier");
  std::filesystem::create_symlink(target, folder_.path("link.json"));
  EXPECT_EQ(run_axiscal(calibrate_to(folder_.path("link.json"))).status, 0);
  EXPECT_TRUE(std::filesystem::is_symlink(folder_.path("link.json")));
  EXPECT_EQ(read_json(target)["status"], "ok");
}

// Each input of each command is named as an output, by its path and by a symbolic link.
TEST_F(Output, NoInputIsOverwritten) {
  const std::string record = folder_.path("cal.json");
  ASSERT_EQ(run_axiscal(calibrate_to(record)).status, 0);
  const std::string readings = folder_.write("in.csv", "x,y,z\n0,0,2.5\n");
  const std::string limits =
      folder_.write("limits.json",
                    R"({"format": "axiscal-limits", "version": 1, "rule": "simple",
          "limits": [{"parameter": "x.bias", "low": -9, "high": 9}]})");
  const std::string unit = folder_.write("r.csv", with_serial(read_file(run_), "r"));
  const std::string experiment =
      folder_.write("exp.json",
                    R"({"format": "axiscal-experiment", "version": 1, "observations": "run.csv",
          "instrument": {"kind": "accelerometer"}, "field": {"kind": "gravity"}})");
  const std::vector<std::string> as = {"--instrument", "accelerometer", "--field", "gravity"};
  const auto calibrate = [&](std::vector<std::string> words) {
    words.insert(words.begin(), "calibrate");
    words.insert(words.end(), as.begin(), as.end());
    return words;
  };
  const std::string sheet = folder_.write("sheet.csv", "rest,fence\n+X,+Y\n");
  const std::vector<std::pair<std::string, std::vector<std::string>>> calls = {
      {run_, calibrate({run_, "--table", run_})},
      {run_, calibrate({run_, "-o", run_})},
      {unit, calibrate({unit, "-o", folder_.path("{serial}.csv")})},
      {limits, calibrate({run_, "--limits", limits, "--table", limits})},
      {limits, calibrate({run_, "--limits", limits, "-o", limits})},
      {experiment, {"calibrate", experiment, "-o", experiment}},
      {run_, {"calibrate", experiment, "-o", run_}},
      {record, {"apply", record, readings, "-o", record}},
      {readings, {"apply", record, readings, "-o", readings}},
      {readings, {"apply", record, readings, "--follow", "-o", readings}},
      {record, {"check", record, run_, "-o", record}},
      {run_, {"check", record, run_, "-o", run_}},
      {record, {"export", record, "--format", "csv", "-o", record}},
      {record, {"simulate", "--truth", record, "-o", record}},
      {sheet, {"simulate", "--truth", record, "--design", sheet, "-o", sheet}},
      {sheet, {"plan", "--design", sheet, "-o", sheet}},
      {record, {"budget", record, "-o", record}},
      {readings, {"noise", readings, "--rate", "100", "-o", readings}},
  };
  for (const auto& [input, words] : calls) {
    const std::string before = read_file(input);
    const std::size_t files = folder_.file_count();
    const ProgramResult result = run_axiscal(words);
    const std::string call = testing::PrintToString(words);
    if (words.front() != "noise") {  // noise fails earlier: too few samples
      EXPECT_EQ(result.status, 2) << call << result.err;
      EXPECT_THAT(result.err, HasSubstr("is an input of this command and would be overwritten"))
          << call;
    }
    EXPECT_EQ(read_file(input), before) << call;
    EXPECT_EQ(folder_.file_count(), files) << call;
  }
  // Standard output is appended to the input, which would never end.
  const std::string appended = "'" + command_path() + "' apply '" + record + "' '" + readings +
                               "' >> '" + readings + "' 2>&1";
  EXPECT_EQ(WEXITSTATUS(std::system(appended.c_str())), 2);
  EXPECT_THAT(read_file(readings), testing::StartsWith("x,y,z\n0,0,2.5\n"));
}

TEST_F(Output, ABatchNeedsFilesOfTheirOwn) {
  const std::string unit = folder_.write("units.csv", with_serial(read_file(run_), "t"));
  const ProgramResult result =
      run_axiscal({"calibrate", unit, "--instrument", "accelerometer", "--field", "gravity", "-o",
                   folder_.path("{serial}.json"), "--table", folder_.path("t.json")});
  EXPECT_EQ(result.status, 2);
  EXPECT_THAT(result.err, HasSubstr("would be written twice"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path("t.json"))) << "said before the work";
}

TEST_F(Output, SerialsThatAreNoNamesAreRefusedBeforeTheFirstFile) {
  const std::string good = with_serial(read_file(run_), "good");
  const std::string bad = with_serial(read_file(run_), "\x1b[2Jbad");
  const std::string two = folder_.write("two.csv", good + bad.substr(bad.find('\n') + 1));
  const std::vector<std::string> as = {
      "--instrument", "accelerometer", "--field", "gravity", "-o", folder_.path("{serial}.json")};
  const auto calibrated = [&](std::vector<std::string> words) {
    words.insert(words.begin(), "calibrate");
    words.insert(words.end(), as.begin(), as.end());
    return run_axiscal(words);
  };
  const ProgramResult result = calibrated({two});
  EXPECT_EQ(result.status, 3);
  EXPECT_THAT(result.err,
              HasSubstr("two.csv:14: column 'serial': the serial number contains a control"));
  EXPECT_EQ(folder_.file_count(), 2U) << "no record of the good one either";
  EXPECT_EQ(calibrated({run_, "--serial", std::string(201, 's')}).status, 2);
  EXPECT_EQ(calibrated({run_, "--serial", "a\xC2\x85z"}).status, 2) << "U+0085, a new line";
  EXPECT_EQ(calibrated({run_, "--serial", std::string(199, 's')}).status, 0);
}

TEST_F(Output, AClosedStandardOutputIsNotMixedIntoTheRecord) {
  const std::string record = folder_.path("cal.json");
  const std::string command = "'" + command_path() + "' calibrate '" + run_ +
                              "' --instrument accelerometer --field gravity -o '" + record +
                              "' >&- 2>&-";
  EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 4);  // cannot write the summary
  EXPECT_EQ(read_json(record)["status"], "ok");
}

TEST_F(Output, ARefusalStaysOneWhenNobodyReads) {
  const std::string six = folder_.write(
      "six.csv",
      observations_text(accelerometer_truth(),
                        {.points = 6, .slope = {1e-4, -1e-4}, .noise_sd = 1e-3, .seed = 3}));
  const std::string command = "{ '" + command_path() + "' calibrate '" + six +
                              "' --instrument accelerometer --field gravity 2>'" +
                              folder_.path("err") + "'; echo $? >'" + folder_.path("status") +
                              "'; } | true";
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(read_file(folder_.path("status")), "1\n");
  EXPECT_THAT(read_file(folder_.path("err")), HasSubstr("refused"));
}

TEST_F(Output, AReaderThatStopsEndsTheCommandQuietly) {
  const std::string record = folder_.path("cal.json");
  ASSERT_EQ(run_axiscal(calibrate_to(record)).status, 0);
  const std::string command =
      "{ yes 0.1,0.2,2.5 | head -n 300000 | sed '1i x,y,z'; } 2>/dev/null | " + std::string("{ '") +
      command_path() + "' apply '" + record + "' - 2>'" + folder_.path("err") + "'; echo $? >'" +
      folder_.path("status") + "'; } | head -n 1 >'" + folder_.path("out") + "'";
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(read_file(folder_.path("err")), "");
  EXPECT_EQ(read_file(folder_.path("status")), "0\n");
  EXPECT_THAT(read_file(folder_.path("out")), testing::StartsWith("x,y,z,field_x"));
}

}  // namespace
}  // namespace axiscal::test
