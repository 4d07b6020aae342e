// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/run.hpp"

#include "axiscal/core/error.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

// Readings of one axis with the values 10 x file + row.
axiscal::Run file_of(const std::string& path, int file, const std::vector<std::string>& serials) {
  axiscal::Run one{.observations = {}, .inputs = {{.path = path, .sha256 = "s" + path}}};
  const auto n = static_cast<Eigen::Index>(serials.size());
  one.observations.response.resize(n, 1);
  for (Eigen::Index i = 0; i < n; ++i) {
    one.observations.readings.push_back({.run = static_cast<int>(i) + 1});
    one.observations.response(i, 0) = 10.0 * file + static_cast<double>(i);
  }
  one.serials = serials;
  one.serial = serials.front();
  return one;
}

axiscal::Run without_serials(Run file) {
  file.serial.clear();
  file.serials.clear();
  return file;
}

std::string refusal_of(std::vector<axiscal::Run> files, Units units) {
  try {
    static_cast<void>(join_runs(std::move(files), units));
  } catch (const DataError& error) {
    return error.what();
  }
  return "";
}

TEST(JoinFiles, MakesBlocksAndKeepsWhatTheFilesSay) {
  axiscal::Run first = file_of("a.csv", 1, {"7", "7"});
  first.ignored_columns = {"note", "who"};
  const axiscal::Run run = join_runs({first, file_of("b.csv", 2, {"7"})}, Units::one);
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
  const axiscal::Run seven = file_of("a.csv", 1, {"7"});
  const axiscal::Run eight = file_of("b.csv", 2, {"8"});
  EXPECT_THAT(refusal_of({seven, eight}, Units::one), testing::HasSubstr("b.csv: column 'serial'"));
  EXPECT_TRUE(has_several_units(join_runs({seven, eight}, Units::several)));
  EXPECT_THAT(
      refusal_of({seven, eight, without_serials(file_of("c.csv", 3, {""}))}, Units::several),
      testing::HasSubstr("c.csv: column 'serial' is missing"));
  // If all stated serials are equal, the file without a serial belongs to the same unit.
  const axiscal::Run run =
      join_runs({seven, without_serials(file_of("c.csv", 3, {""}))}, Units::several);
  EXPECT_TRUE(run.serials.empty());
  EXPECT_EQ(run.serial, "7");
}

TEST(JoinFiles, RefusesOtherSlots) {
  axiscal::Run left = file_of("a.csv", 1, {"7"});
  left.slots = {"L"};
  EXPECT_THAT(refusal_of({left, file_of("b.csv", 2, {"7"})}, Units::one),
              testing::HasSubstr("b.csv: the slots in the names of the columns differ"));
}

TEST(SplitBySerial, KeepsTheOrderOfUnitsAndOfTheirReadings) {
  const axiscal::Run run =
      join_runs({file_of("a.csv", 1, {"b", "a", "b", "a", "c"})}, Units::several);
  const std::vector<axiscal::Run> units = split_by_serial(run, "");
  ASSERT_EQ(units.size(), 3U);
  EXPECT_EQ(units[0].serial, "b");
  EXPECT_EQ(units[1].serial, "a");
  ASSERT_EQ(units[1].observations.readings.size(), 2U);
  EXPECT_EQ(units[1].observations.response(0, 0), 11.0);
  EXPECT_EQ(units[1].observations.response(1, 0), 13.0);
  EXPECT_EQ(units[2].serials, std::vector<std::string>{"c"});

  const std::vector<axiscal::Run> stated =
      split_by_serial(join_runs({without_serials(file_of("a.csv", 1, {""}))}, Units::one), "X");
  ASSERT_EQ(stated.size(), 1U);
  EXPECT_EQ(stated.front().serial, "X");
}

}  // namespace
}  // namespace axiscal
