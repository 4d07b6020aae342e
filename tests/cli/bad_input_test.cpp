// SPDX-License-Identifier: Apache-2.0
// For every file that cannot be used the command exits with 3, the message begins with the place,
// and an earlier output is not changed.
#include <filesystem>

#include "matchers.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

struct BadFile {
  const char* name;
  std::string content;
  std::string line;     // LINE of PATH:LINE:
  std::string message;  // part of the message after it
};

class BadObservations : public testing::TestWithParam<BadFile> {};

TEST_P(BadObservations, AreRefusedWithTheirPlace) {
  const ScratchFolder folder;
  const BadFile& bad = GetParam();
  const std::string path = folder.write("run.csv", bad.content);
  const std::string output = folder.write("cal.json", "earlier");
  const ProgramResult result = run_axiscal(
      {"calibrate", path, "--instrument", "accelerometer", "--field", "gravity", "-o", output});
  EXPECT_EQ(result.status, 3) << result.err;
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, StartsWith(path + ":" + bad.line + ": "));
  EXPECT_THAT(result.err, HasSubstr(bad.message));
  EXPECT_EQ(read_file(output), "earlier");
  EXPECT_EQ(folder.file_count(), 2U);
  // Standard input gives the same error.
  const ProgramResult piped =
      run_axiscal({"calibrate", "-", "--instrument", "accelerometer", "--field", "gravity"},
                  {.stdin_text = bad.content});
  EXPECT_EQ(piped.status, 3);
  EXPECT_THAT(piped.err, StartsWith("-:" + bad.line + ": "));
}

std::vector<BadFile> bad_files() {
  using std::string_literals::operator""s;
  const std::string header = "rest,fence,x,y,z\n";
  const std::string good = "+X,+Y,1,2,3\n";
  const auto cell = [&](const std::string& text) {
    return header + good + "+X,-Y,1," + text + ",3\n";
  };
  std::string binary = "\x89PNG\r\n\x1A\n\0\0\0\rIHDR"s;
  return {
      {"Empty", "", "1", "empty"},
      {"CommentsOnly", "# nothing\n\n", "1", "empty"},
      {"HeaderOnly", header, "1", "the table has a header"},
      {"MissingColumn", "rest,fence,x,y\n+X,+Y,1,2\n", "1", "column 'z' is missing"},
      {"DuplicateColumn", "rest,fence,x,y,x\n", "1", "column 'x': occurs twice"},
      {"UnknownFace", header + good + "+W,+Y,1,2,3\n", "3", "column 'rest': '+W'"},
      {"SameAxis", header + good + "+X,-X,1,2,3\n", "3", "column 'fence'"},
      {"Word", cell("abc"), "3", "column 'y': 'abc'"},
      {"EmptyCell", cell(""), "3", "column 'y' is empty"},
      {"Nan", cell("nan"), "3", "column 'y'"},
      {"Inf", cell("-inf"), "3", "column 'y'"},
      {"Overflow", cell("1e999"), "3", "column 'y'"},
      {"QuotedDecimalComma", cell("\"1,5\""), "3", "write '.' as the decimal point"},
      {"DecimalComma", cell("1,5"), "3", "use '.'"},
      {"TrailingJunk", cell("1.2V"), "3", "column 'y': '1.2V'"},
      {"ShortRow", header + good + "+X,-Y,1,2\n", "3", "4 cells"},
      {"LongRow", header + good + "+X,-Y,1,2,3,4\n", "3", "6 cells"},
      {"OpenQuote", header + good + "+X,\"-Y,1,2,3\n" + good, "3", "quote"},
      {"NulByte", header + good + "+X,-Y,1,2,3\0\n"s, "3", "NUL"},
      {"Utf16", "\xFF\xFEr\0e\0s\0t\0"s, "1", "column 'x' is missing"},
      {"Utf16BigEndian", "\xFE\xFF\0r\0e\0s\0t"s, "1", "column 'x' is missing"},
      {"Latin1", header + "# caf\xE9\n" + good + "+X,-Y,1,2,3\xB0\n", "4",
       "is not a finite number"},
      {"Binary", binary, "1", "UTF-8"},
      {"EndlessLine", header + std::string(3U << 20U, '7'), "2", "1 MiB"},
      {"Semicolons", "rest;fence;x;y;z\n", "1", "commas"},
  };
}

INSTANTIATE_TEST_SUITE_P(Files,
                         BadObservations,
                         testing::ValuesIn(bad_files()),
                         [](const testing::TestParamInfo<BadFile>& test_case) {
                           return std::string(test_case.param.name);
                         });

TEST(BadInput, MissingFilesAndFoldersAreRefused) {
  const ScratchFolder folder;
  const std::string readings = folder.write("in.csv", "x,y,z\n0,0,1\n");
  const std::vector<std::string> gravity = {"--instrument", "accelerometer", "--field", "gravity"};
  for (const std::string& path : {folder.path("none.csv"), folder.path("")}) {
    std::vector<std::string> arguments = {"calibrate", path};
    arguments.insert(arguments.end(), gravity.begin(), gravity.end());
    const ProgramResult result = run_axiscal(arguments);
    EXPECT_EQ(result.status, 3);
    EXPECT_THAT(result.err, StartsWith(path + ": "));
    EXPECT_EQ(run_axiscal({"apply", path, readings}).status, 3);
    EXPECT_EQ(run_axiscal({"simulate", "--truth", path}).status, 3);
    if (!path.ends_with('/')) {
      EXPECT_EQ(run_axiscal({"plan", "--design", path}).status, 3);
    }
    EXPECT_EQ(run_axiscal({"calibrate", readings, "--positioner", path, "--instrument",
                           "accelerometer", "--field", "gravity"})
                  .status,
              3);
  }
}

TEST(BadInput, BadJsonIsRefusedWithItsPlace) {
  const ScratchFolder folder;
  const std::string readings = folder.write("in.csv", "x,y,z\n0,0,1\n");
  const auto record = [&](const std::string& content) {
    const std::string path = folder.write("r.json", content);
    const ProgramResult result = run_axiscal({"apply", path, readings});
    EXPECT_EQ(result.status, 3) << content;
    EXPECT_THAT(result.err, StartsWith(path + ":"));
    return result.err;
  };
  EXPECT_THAT(record(""), HasSubstr(":1: not valid JSON"));
  EXPECT_THAT(record("{\n\"format\":\n}"), HasSubstr(":3: not valid JSON"));
  EXPECT_THAT(record("[]"), HasSubstr(": /: must be an object"));
  EXPECT_THAT(record("\x89PNG"), HasSubstr(":1: "));
  EXPECT_THAT(record(R"({"format": "axiscal-calibration", "version": 7})"),
              HasSubstr(": /version: version 7"));
  EXPECT_THAT(record(R"({"format": "axiscal-experiment", "version": 1})"), HasSubstr(": /format:"));
  const auto experiment = [&](const std::string& content) {
    const std::string path = folder.write("e.json", content);
    const ProgramResult result = run_axiscal({"calibrate", path});
    EXPECT_EQ(result.status, 3) << content;
    EXPECT_THAT(result.err, StartsWith(path + ":"));
    return result.err;
  };
  EXPECT_THAT(experiment(R"({"format": "axiscal-experiment", "version": 1, "metod": "joint"})"),
              HasSubstr(": /metod: unknown key; did you mean 'method'?"));
  EXPECT_THAT(experiment(R"({"format": "axiscal-experiment", "version": 1, "robust": "yes"})"),
              HasSubstr(": /robust: must be"));
  EXPECT_THAT(experiment(R"({"format": "axiscal-experiment", "version": 2})"),
              HasSubstr(": /version:"));
}

TEST(BadInput, AnExperimentWithoutObservationsIsAUsageError) {
  const ScratchFolder folder;
  const std::string path =
      folder.write("e.json", R"({"format": "axiscal-experiment", "version": 1})");
  EXPECT_EQ(run_axiscal({"calibrate", path}).status, 2);
}

}  // namespace
}  // namespace axiscal::test
