// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/table_text.hpp"

#include <string>
#include <vector>

#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/core/error.hpp"
#include "matchers.hpp"
#include "program.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

// The same 12 readings in different text formats.
struct Look {
  const char* name;
  std::string text;
};

void PrintTo(const Look& look, std::ostream* os) {
  *os << look.name;
}

constexpr int rows = 4;

std::string table(const std::string& header,
                  const std::string& delimiter,
                  bool decimal_comma = false,
                  const std::string& before = "",
                  const std::string& after = "") {
  const std::vector<std::vector<std::string>> cells = {
      {"1", "+X", "+Y", "0.925", "-0.0014", "0.019"},
      {"2", "-X", "+Y", "-0.881", "0.25", "1e-3"},
      {"3", "+Z", "-Y", "0.01", "0.002", "0.93"},
      {"4", "-Z", "-Y", "0.02", "0.004", "-0.87"}};
  std::string text = header;
  for (const auto& row : cells) {
    text += before;
    for (std::size_t c = 0; c < row.size(); ++c) {
      std::string cell = row[c];
      const std::size_t point = cell.find('.');
      if (decimal_comma && point != std::string::npos) {
        cell[point] = ',';
      }
      text += (c > 0 ? delimiter : "") + cell;
    }
    text += after + "\n";
  }
  return text;
}

std::string utf16(const std::string& text, bool is_big) {
  std::string wide = is_big ? "\xFE\xFF" : "\xFF\xFE";
  for (const char c : text) {
    wide += is_big ? std::string(1, '\0') + c : std::string(1, c) + '\0';
  }
  return wide;
}

std::string with(std::string text, const std::string& what, const std::string& by) {
  for (std::size_t at = text.find(what); at != std::string::npos;
       at = text.find(what, at + by.size())) {
    text.replace(at, what.size(), by);
  }
  return text;
}

const std::string header = "run,rest,fence,x,y,z\n";
const std::string plain = table(header, ",");

std::vector<Look> looks() {
  return {
      {"Plain", plain},
      {"GermanSpreadsheet", table("run;rest;fence;x;y;z\n", ";", true)},
      {"Tabs", table("run\trest\tfence\tx\ty\tz\n", "\t")},
      {"Pipes", table("run|rest|fence|x|y|z\n", "|")},
      {"Markdown", table("| run | rest | fence | x | y | z |\n|---|---|---|---|---|---|\n", " | ",
                         false, "| ", " |")},
      {"Blanks", table("run rest fence x y z\n", " ")},
      {"Separator", table("sep=;\nrun;rest;fence;x;y;z\n", ";")},
      {"Preamble", table("Laboratory 7\nOperator: N. N.\nDate: 2026-11-25\n" + header, ",")},
      {"Units", table("Run,Rest,FENCE,x [V],Y (V),z (V)\n", ",")},
      {"UnitsBeneath", table(header + "-,-,-,V,V,V\n", ",")},
      {"ByteOrderMark", "\xEF\xBB\xBF" + plain},
      {"Utf16Little", utf16(plain, false)},
      {"Utf16Big", utf16(plain, true)},
      {"Latin1", table("Gr\xF6\xDF"
                       "e in V\n" +
                           header,
                       ",")},
      {"Quoted", table("\"run\",\"rest\",\"fence\",\"x\",\"y\",\"z\"\n", ",")},
      {"SingleQuoted",
       "'run','rest','fence','x','y','z'\n" + with(plain.substr(header.size()), "+X", "'+X'")},
      {"CarriageReturns", with(plain, "\n", "\r\n")},
      {"CarriageReturnsAlone", with(plain, "\n", "\r")},
      {"CommentedHeader", table("# run,rest,fence,x,y,z\n", ",")},
      {"TrailingDelimiter", table("run,rest,fence,x,y,z,\n", ",", false, "", ",")},
      {"NoHeader", table("", ",")},
      {"EmptyRows", plain + ",,,,,\n,,,,,\n"},
      {"TypesetMinus", with(table(header, ","), "-", "\xE2\x88\x92")},
      {"Remarks", "run,operator,rest,fence,x,y,z\n" +
                      with(with(with(with(plain.substr(header.size()), "1,+X", "1,\"a, b\",+X"),
                                     "2,-X", "2,c,-X"),
                                "3,+Z", "3,d,+Z"),
                           "4,-Z", "4,e,-Z")},
      {"JsonRecords",
       R"([{"run":1,"rest":"+X","fence":"+Y","x":0.925,"y":-0.0014,"z":0.019},
           {"run":2,"rest":"-X","fence":"+Y","x":-0.881,"y":0.25,"z":1e-3},
           {"run":3,"rest":"+Z","fence":"-Y","x":0.01,"y":0.002,"z":0.93},
           {"run":4,"rest":"-Z","fence":"-Y","x":0.02,"y":0.004,"z":-0.87}])"},
      {"JsonColumns",
       R"({"run":[1,2,3,4],"rest":["+X","-X","+Z","-Z"],"fence":["+Y","+Y","-Y","-Y"],
           "x":[0.925,-0.881,0.01,0.02],"y":[-0.0014,0.25,0.002,0.004],
           "z":[0.019,0.001,0.93,-0.87]})"},
  };
}

class StrangersTable : public testing::TestWithParam<Look> {};

TEST_P(StrangersTable, ReadsAsThePlainOne) {
  const test::ScratchFolder folder;
  TableText text(folder.write("table.csv", GetParam().text));
  CsvReader csv = text.reader({"run", "rest", "fence", "x", "y", "z"});
  const axiscal::Run read = read_observations(csv, {});
  TableText expected_text(folder.write("plain.csv", plain));
  CsvReader expected_csv = expected_text.reader({});
  const axiscal::Run expected = read_observations(expected_csv, {});
  ASSERT_EQ(read.observations.response.rows(), rows);
  EXPECT_EQ(read.observations.response, expected.observations.response);
  for (std::size_t i = 0; i < rows; ++i) {
    ASSERT_TRUE(read.observations.readings[i].point.has_value());
    EXPECT_EQ(read.observations.readings[i].point->name(),
              expected.observations.readings[i].point->name());
  }
}

INSTANTIATE_TEST_SUITE_P(Looks, StrangersTable, testing::ValuesIn(looks()), [](const auto& look) {
  return std::string(look.param.name);
});

TEST(TableText, KeepsLinesOfDefects) {
  const test::ScratchFolder folder;
  const std::string path =
      folder.write("table.csv", "Laboratory\n\nrest;fence;x;y;z\n+X;+Y;1,5;2;3\n+X;-Y;1,5;two;3\n");
  TableText text(path);
  CsvReader csv = text.reader({});
  EXPECT_THAT(test::complaint_of<DataError>([&] { static_cast<void>(read_observations(csv, {})); }),
              HasSubstr("table.csv:5: column 'y': 'two'"));
  EXPECT_EQ(marked_cell(path, 5, "y"), "  +X;-Y;1,5;two;3\n            ^");
}

TEST(TableText, RenamesAndScales) {
  const test::ScratchFolder folder;
  LogFormat format;
  format.columns = {{.name = "x", .column = "up", .factor = -2.0}};
  TableText text(folder.write("table.csv", "rest,fence,up,y,z\n+X,+Y,1,2,3\n"), format);
  CsvReader csv = text.reader({}, {{.name = "z2", .column = "z"}});
  EXPECT_EQ(csv.header(), (std::vector<std::string>{"rest", "fence", "x", "y", "z2"}));
  ASSERT_EQ(csv.next(), CsvReader::Row::good);
  EXPECT_EQ(csv.cells()[2], "-2");
}

TEST(TableText, SaysThatRecordsContainNoValues) {
  const test::ScratchFolder folder;
  for (const std::string text : {"[]\n[]\n", "[{}]", "[[], {}]", "{\"x\": []}"}) {
    const std::string path = folder.write("table.json", text);
    EXPECT_THAT(test::complaint_of<DataError>([&] { TableText table(path); }),
                testing::AllOf(HasSubstr("table.json"), HasSubstr("contain")))
        << text;
  }
}

TEST(TableText, IsNoRecording) {
  const test::ScratchFolder folder;
  std::string log =
      "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format\n"
      "FMT, 129, 30, IMU, Iffffff, TimeMS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ\n";
  for (int i = 0; i < 5; ++i) {
    log += "IMU, " + std::to_string(10 * i) + ", 0, 0, 0, 0, 0, -9.8\n";
  }
  const std::string path = folder.write("flight.log", log);
  EXPECT_THAT(test::complaint_of<DataError>([&] { TableText text(path); }),
              testing::AllOf(HasSubstr("is a recording (dataflash-text)"),
                             HasSubstr("IMU (accelerometer)")));
}

}  // namespace
}  // namespace axiscal
