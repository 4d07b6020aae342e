// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/run_readings.hpp"

#include "axiscal/core/error.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

// Readings whose value tells which they are: 10 x file + row.
RunFile file_of(const std::string& path, int file, const std::vector<std::string>& serials) {
  RunFile one{.digest = {.path = path, .sha256 = "s" + path}, .table = {}};
  const auto n = static_cast<Eigen::Index>(serials.size());
  one.table.observations.response.resize(n, 1);
  for (Eigen::Index i = 0; i < n; ++i) {
    one.table.observations.readings.push_back({.run = static_cast<int>(i) + 1});
    one.table.observations.response(i, 0) = 10.0 * file + static_cast<double>(i);
  }
  one.table.serials = serials;
  one.table.serial = serials.front();
  return one;
}

RunFile without_serials(RunFile file) {
  file.table.serial.clear();
  file.table.serials.clear();
  return file;
}

std::string refusal_of(std::vector<RunFile> files, Units units) {
  try {
    static_cast<void>(join_files(std::move(files), units));
  } catch (const DataError& error) {
    return error.what();
  }
  return "";
}

TEST(JoinFiles, MakesBlocksAndKeepsWhatTheFilesSay) {
  RunFile first = file_of("a.csv", 1, {"7", "7"});
  first.table.ignored_columns = {"note", "who"};
  const RunReadings run = join_files({first, file_of("b.csv", 2, {"7"})}, Units::one);
  ASSERT_EQ(run.observations.readings.size(), 3U);
  EXPECT_EQ(run.observations.readings[2].run, 3);
  EXPECT_NE(run.observations.readings[2].block, run.observations.readings[0].block);
  EXPECT_EQ(run.observations.response(2, 0), 20.0);
  EXPECT_EQ(run.serial, "7");
  ASSERT_EQ(run.inputs.size(), 2U);
  EXPECT_EQ(run.inputs[1].sha256, "sb.csv");
  EXPECT_EQ(run.notes, std::vector<std::string>{"a.csv: columns note, who were ignored"});
}

TEST(JoinFiles, TakesOneUnitOrSaysWhoseReadingsTheyAre) {
  const RunFile seven = file_of("a.csv", 1, {"7"});
  const RunFile eight = file_of("b.csv", 2, {"8"});
  EXPECT_THAT(refusal_of({seven, eight}, Units::one), testing::HasSubstr("b.csv: column 'serial'"));
  EXPECT_TRUE(has_several_units(join_files({seven, eight}, Units::several)));
  EXPECT_THAT(
      refusal_of({seven, eight, without_serials(file_of("c.csv", 3, {""}))}, Units::several),
      testing::HasSubstr("c.csv: column 'serial' is missing"));
  // All that is stated is one unit: then the file without a serial is of it too.
  const RunReadings run =
      join_files({seven, without_serials(file_of("c.csv", 3, {""}))}, Units::several);
  EXPECT_TRUE(run.serials.empty());
  EXPECT_EQ(run.serial, "7");
}

TEST(JoinFiles, RefusesOtherSlots) {
  RunFile left = file_of("a.csv", 1, {"7"});
  left.table.slots = {"L"};
  EXPECT_THAT(refusal_of({left, file_of("b.csv", 2, {"7"})}, Units::one),
              testing::HasSubstr("b.csv: the columns are of other slots"));
}

TEST(SplitBySerial, KeepsTheOrderOfUnitsAndOfTheirReadings) {
  const RunReadings run =
      join_files({file_of("a.csv", 1, {"b", "a", "b", "a", "c"})}, Units::several);
  const std::vector<RunReadings> units = split_by_serial(run, "");
  ASSERT_EQ(units.size(), 3U);
  EXPECT_EQ(units[0].serial, "b");
  EXPECT_EQ(units[1].serial, "a");
  ASSERT_EQ(units[1].observations.readings.size(), 2U);
  EXPECT_EQ(units[1].observations.response(0, 0), 11.0);
  EXPECT_EQ(units[1].observations.response(1, 0), 13.0);
  EXPECT_EQ(units[2].serials, std::vector<std::string>{"c"});

  const std::vector<RunReadings> stated =
      split_by_serial(join_files({without_serials(file_of("a.csv", 1, {""}))}, Units::one), "X");
  ASSERT_EQ(stated.size(), 1U);
  EXPECT_EQ(stated.front().serial, "X");
}

}  // namespace
}  // namespace axiscal
