// SPDX-License-Identifier: Apache-2.0
#include <set>

#include "matchers.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

std::string truth_record(const ScratchFolder& folder) {
  const std::string run = folder.write("r.csv", observations_text(accelerometer_truth(), {}));
  const std::string record = folder.path("truth.json");
  EXPECT_EQ(run_axiscal({"calibrate", run, "--instrument", "accelerometer", "--field", "gravity",
                         "--unit", "V", "-o", record})
                .status,
            0);
  return record;
}

TEST(PlanCommand, MakesARunSheet) {
  const ProgramResult result = run_axiscal({"plan", "--replicates", "2", "--seed", "5"});
  EXPECT_EQ(result.status, 0);
  const std::vector<std::vector<std::string>> rows = csv_cells(result.out);
  ASSERT_EQ(rows.size(), 25U);
  EXPECT_THAT(rows[0],
              testing::ElementsAre("run", "block", "rest", "fence", "x", "y", "z", "temperature"));
  for (const char* block : {"1", "2"}) {
    std::set<std::string> points;
    for (const std::vector<std::string>& row : rows) {
      if (row[1] == block) {
        points.insert(row[2] + row[3]);
      }
    }
    EXPECT_EQ(points.size(), 12U);
  }
  EXPECT_EQ(run_axiscal({"plan", "--replicates", "2", "--seed", "5"}).out, result.out);
  EXPECT_NE(run_axiscal({"plan", "--replicates", "2", "--seed", "6"}).out, result.out);
  EXPECT_EQ(csv_cells(run_axiscal({"plan", "--design", "24"}).out).size(), 25U);
  EXPECT_EQ(csv_cells(run_axiscal({"plan", "--design=6"}).out).size(), 7U);
}

TEST(PlanCommand, TakesAListOfPoints) {
  const ScratchFolder folder;
  const std::string points = folder.write("points.csv", "fence,rest,level\n+Y,+X,1\nX-,z+,-1\n");
  const std::vector<std::vector<std::string>> rows =
      csv_cells(run_axiscal({"plan", "--design", points}).out);
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0][4], "level");
  const std::set<std::string> found = {rows[1][2] + rows[1][3] + rows[1][4],
                                       rows[2][2] + rows[2][3] + rows[2][4]};
  EXPECT_EQ(found, (std::set<std::string>{"+X+Y1", "+Z-X-1"}));
}

TEST(SimulateCommand, RepeatsItsBytesForASeed) {
  const ScratchFolder folder;
  const std::string truth = truth_record(folder);
  const auto simulate = [&](const std::string& seed) {
    return run_axiscal({"simulate", "--truth", truth, "--seed", seed, "--noise", "1e-3",
                        "--replicates", "2", "--slope", "-0.001,0.002"})
        .out;
  };
  EXPECT_EQ(simulate("9"), simulate("9"));
  EXPECT_NE(simulate("9"), simulate("10"));
  const std::vector<std::vector<std::string>> rows = csv_cells(simulate("9"));
  EXPECT_EQ(rows.size(), 25U);
  EXPECT_THAT(rows[0], testing::ElementsAre("run", "block", "rest", "fence", "x", "y", "z"));
  // The run has the same sheet as the command plan.
  const std::vector<std::vector<std::string>> sheet =
      csv_cells(run_axiscal({"plan", "--seed", "9", "--replicates", "2"}).out);
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    EXPECT_EQ(std::vector<std::string>(rows[i].begin(), rows[i].begin() + 4),
              std::vector<std::string>(sheet[i].begin(), sheet[i].begin() + 4));
  }
}

TEST(SimulateCommand, TakesWhatCalibrateMade) {
  const ScratchFolder folder;
  const std::string truth = truth_record(folder);
  const std::string run = folder.path("run.csv");
  const std::string again = folder.path("again.json");
  ASSERT_EQ(run_axiscal({"simulate", "--truth", truth, "--slope", "0.01,0.005", "-o", run}).status,
            0);
  ASSERT_EQ(run_axiscal({"calibrate", run, "--instrument", "accelerometer", "--field", "gravity",
                         "-o", again})
                .status,
            0);
  // in_table of the record includes the slope, so a simulation without --slope gives the same
  // readings.
  ASSERT_EQ(run_axiscal({"simulate", "--truth", again, "-o", folder.path("2.csv")}).status, 0);
  const auto a = csv_cells(read_file(run));
  const auto b = csv_cells(read_file(folder.path("2.csv")));
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 1; i < a.size(); ++i) {
    EXPECT_EQ(a[i][3], b[i][3]);
    for (std::size_t k = 4; k < 7; ++k) {
      EXPECT_NEAR(std::stod(a[i][k]), std::stod(b[i][k]), 1e-12);
    }
  }
}

}  // namespace
}  // namespace axiscal::test
