// SPDX-License-Identifier: Apache-2.0
// Many units in one stream: a file, a pipe, shards and a resumed run give the same lines.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include <nlohmann/json.hpp>

#include "matchers.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

using testing::HasSubstr;

// `units` units of 12 readings each, with a column `serial`. Unit 3 has a cell that is not a
// number.
std::string stream_of(int units) {
  std::istringstream run(observations_text(accelerometer_truth(), {}));
  std::string header;
  std::getline(run, header);
  std::vector<std::string> rows;
  for (std::string row; std::getline(run, row);) {
    rows.push_back(row);
  }
  std::string text = "serial," + header + "\n";
  for (int unit = 0; unit < units; ++unit) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const std::string row =
          unit == 3 && i == 4 ? rows[i].substr(0, rows[i].rfind(',')) + ",oops" : rows[i];
      text += "u" + std::to_string(unit) + "," + row + "\n";
    }
  }
  return text;
}

class StreamTest : public testing::Test {
 protected:
  StreamTest() { setenv("SOURCE_DATE_EPOCH", "1700000000", 1); }
  ~StreamTest() override { unsetenv("SOURCE_DATE_EPOCH"); }

  ProgramResult run(std::vector<std::string> more, const std::string& input = "-") const {
    std::vector<std::string> arguments = {"calibrate",     input,    "--stream", "--instrument",
                                          "accelerometer", "--unit", "V"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_axiscal(arguments, {.stdin_text = input == "-" ? text_ : ""});
  }

  ScratchFolder folder_;
  std::string text_ = stream_of(25);
  std::string path_ = folder_.write("units.csv", text_);
};

TEST_F(StreamTest, LinesAreThoseOfEachUnit) {
  const std::string output = folder_.path("r.jsonl");
  const ProgramResult result = run({"-o", output, "--table", folder_.path("t.csv")}, path_);
  EXPECT_EQ(result.status, 1);  // because of unit 3
  EXPECT_THAT(result.err, HasSubstr("yield: 24 of 25"));
  std::istringstream lines(read_file(output));
  std::string line;
  int unit = 0;
  for (; std::getline(lines, line); ++unit) {
    const auto record = nlohmann::json::parse(line);
    if (unit == 3) {
      EXPECT_EQ(record["result"], "error");
      EXPECT_THAT(record["reason"].get<std::string>(), HasSubstr("unit u3:6: column 'z': 'oops'"));
      continue;
    }
    EXPECT_EQ(record["format"], "axiscal-calibration");
    EXPECT_EQ(record["instrument"]["serial"], "u" + std::to_string(unit));
    EXPECT_EQ(record["residuals"][0]["run"], 1);
  }
  EXPECT_EQ(unit, 25);
  const std::string table = read_file(folder_.path("t.csv"));
  EXPECT_THAT(table, HasSubstr("serial,result,reason,x.bias,u_x.bias"));
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 26);
}

TEST_F(StreamTest, PipePartsAndKillsGiveTheSameBytes) {
  const auto at = [&](const std::string& name) { return folder_.path(name); };
  ASSERT_EQ(run({"-o", at("r.jsonl"), "--table", at("t.csv")}, path_).status, 1);
  const std::string records = read_file(at("r.jsonl"));
  const std::string table = read_file(at("t.csv"));
  run({"-o", at("pipe.jsonl")});
  EXPECT_EQ(read_file(at("pipe.jsonl")), records);

  std::vector<std::string> merge_records = {"merge", "-o", at("m.jsonl")};
  std::vector<std::string> merge_tables = {"merge", "-o", at("m.csv")};
  for (const std::string part : {"1", "2", "3"}) {
    run({"--shard", part + "/3", "-o", at("p" + part + ".jsonl"), "--table",
         at("p" + part + ".csv")});
    merge_records.push_back(at("p" + part + ".jsonl"));
    merge_tables.push_back(at("p" + part + ".csv"));
  }
  ASSERT_EQ(run_axiscal(merge_records).status, 0);
  ASSERT_EQ(run_axiscal(merge_tables).status, 0);
  EXPECT_EQ(read_file(at("m.jsonl")), records);
  EXPECT_EQ(read_file(at("m.csv")), table);
  merge_records.pop_back();
  EXPECT_THAT(run_axiscal(merge_records).err, HasSubstr("is missing"));

  // The outputs are cut at any byte, as after a kill, and the run is resumed.
  for (const std::size_t cut : {0U, 1U, 5000U, 40000U, 100000U}) {
    folder_.write("k.jsonl", records.substr(0, cut));
    folder_.write("k.csv", table.substr(0, 2000));
    const ProgramResult resumed =
        run({"--resume", "-o", at("k.jsonl"), "--table", at("k.csv")}, path_);
    EXPECT_EQ(resumed.status, 1);
    EXPECT_THAT(resumed.err, HasSubstr("yield: 24 of 25"));
    EXPECT_EQ(read_file(at("k.jsonl")), records) << cut;
    EXPECT_EQ(read_file(at("k.csv")), table) << cut;
  }
}

TEST_F(StreamTest, AnotherInputIsNotResumed) {
  const std::string output = folder_.path("r.jsonl");
  run({"-o", output}, path_);
  const std::string before = read_file(output);
  text_ = "serial,rest,fence,x,y,z\nother,-Z,+X,0,0,1\n" + text_.substr(text_.find('\n') + 1);
  const ProgramResult resumed = run({"--resume", "-o", output});
  EXPECT_EQ(resumed.status, 1);
  EXPECT_THAT(resumed.err, HasSubstr("order of its units has changed"));
  EXPECT_EQ(read_file(output), before);
}

// The stream reads the tables that a single unit's file may have: another delimiter, a decimal
// comma, units in the header, and column names in capitals.
TEST_F(StreamTest, TablesOfOtherLooksAreRead) {
  const std::size_t header = text_.find('\n');
  std::string own = text_.substr(header);
  std::replace(own.begin(), own.end(), ',', ';');
  std::replace(own.begin(), own.end(), '.', ',');
  std::string names = text_.substr(0, header);
  for (const std::string axis : {",x", ",y", ",z"}) {
    names.insert(names.find(axis) + axis.size(), " (V)");
  }
  std::replace(names.begin(), names.end(), ',', ';');
  names.replace(names.find("serial"), 6, "Serial");
  const std::string path = folder_.write("german.csv", names + own);
  const std::string plain = folder_.path("plain.csv");
  run({"--table", plain}, path_);
  const std::string german = folder_.path("table.csv");
  const ProgramResult result = run({"--table", german}, path);
  EXPECT_THAT(result.err, HasSubstr("column 'x (V)' is used as 'x'"));
  EXPECT_EQ(read_file(german), read_file(plain));
}

TEST_F(StreamTest, JsonLinesAreUnits) {
  text_ = R"({"serial":"a","readings":[{"rest":"-Z","fence":"+X","x":0,"y":0,"z":1}]})"
          "\n{\"serial\":1}\n";
  const ProgramResult result = run({"-o", "-"});
  EXPECT_EQ(result.status, 1);
  EXPECT_THAT(result.out, HasSubstr("\"serial\":\"a\""));
  EXPECT_THAT(result.out, HasSubstr("the line does not have the form {"));
}

TEST_F(StreamTest, MistakesAreNamed) {
  EXPECT_EQ(run({}).status, 2);
  EXPECT_THAT(run({"-o", "x.json"}).err, HasSubstr(".jsonl"));
  EXPECT_THAT(run({"-o", "-", "--shard", "4/3"}).err, HasSubstr("--shard"));
  text_ = "rest,fence,x,y,z\n-Z,+X,0,0,1\n";
  const ProgramResult result = run({"-o", "-"});
  EXPECT_EQ(result.status, 3);
  EXPECT_THAT(result.err, HasSubstr("'serial' is missing"));
}

}  // namespace
}  // namespace axiscal::test
