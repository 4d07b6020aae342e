// SPDX-License-Identifier: Apache-2.0
// Experiments by the command: kinds of instruments by formulas, fields with several parts.
#include <algorithm>
#include <filesystem>
#include <map>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/calib/simulate.hpp"
#include "program.hpp"

namespace axiscal {
namespace {

// A kind of instrument that is stated by formulas. The record has its quantities, and apply adds
// its column.
TEST(InstrumentFile, GoesWithEveryCommand) {
  const test::ScratchFolder scratch;
  const std::string kind = scratch.write("mill.json", R"js({"format": "axiscal-instrument-kind",
    "version": 1, "name": "field_mill", "usual_field": "custom",
    "derived": [{"name": "zenith_angle_deg", "formula": "atan2(hypot(x, y), z) * 180 / pi"}],
    "quantities": [{"name": "gain", "formula": "sqrt(sx^2 + sy^2 + sz^2)", "unit": "mV/(V/m)"}]})js");
  std::string rows = "run,rest,fence,x,y,z\n";
  // Readings of each axis in a field of 100 V/m along the table's normal, for a gain of 2 and a
  // bias of 0.
  const std::vector<std::pair<std::string, std::string>> poses = {
      {"-Z,-X", "0,0,200"},     {"-Z,+X", "0,0.02,200"},  {"+Z,-X", "0,0,-200"},
      {"+Z,+X", "0,0,-200.02"}, {"-X,-Y", "200,0,0"},     {"-X,+Y", "200,0.01,0"},
      {"+X,-Y", "-200,0,0"},    {"+X,+Y", "-200,0,0.01"}, {"-Y,-Z", "0,200,0"},
      {"-Y,+Z", "0,200,0.01"},  {"+Y,-Z", "0,-200,0"},    {"+Y,+Z", "0.01,-200,0"}};
  int run = 0;
  for (const auto& [pose, values] : poses) {
    rows += std::to_string(++run) + "," + pose + "," + values + "\n";
  }
  const std::string data = scratch.write("run.csv", rows);
  const std::string record = scratch.path("cal.json");
  const test::ProgramResult made =
      test::run_axiscal({"calibrate", data, "--instrument", kind, "--unit", "mV", "--field-table",
                         "0,0,100", "--field-unit", "V/m", "-o", record});
  ASSERT_EQ(made.status, 0) << made.err;
  const nlohmann::json written = test::read_json(record);
  EXPECT_EQ(written.at("instrument").at("kind"), "field_mill");
  EXPECT_EQ(written.at("quantities").size(), 3U);
  EXPECT_NEAR(written.at("quantities")[0].at("values")[0], 2.0, 1e-3);
  const std::string readings = scratch.write("new.csv", "x,y,z\n0,120,160\n");
  const test::ProgramResult applied =
      test::run_axiscal({"apply", record, readings, "--instrument", kind});
  ASSERT_EQ(applied.status, 0) << applied.err;
  const auto cells = test::csv_cells(applied.out);
  const auto column = std::find(cells[0].begin(), cells[0].end(), "zenith_angle_deg");
  ASSERT_NE(column, cells[0].end()) << applied.out;
  // The angle is atan(120 / 160). Bias and cross-axis terms of the record change it by about 1e-4.
  EXPECT_NEAR(std::stod(cells[1][static_cast<std::size_t>(column - cells[0].begin())]), 36.8699,
              0.01);
  const test::ProgramResult without = test::run_axiscal({"apply", record, readings});
  EXPECT_NE(without.status, 0);
  EXPECT_NE(without.err.find("--instrument"), std::string::npos) << without.err;
}

// Readings under a lamp that is switched on and off, in room light that is not stated.
std::string under_a_lamp_in(const Eigen::Vector3d& room, std::uint64_t seed) {
  const auto light = [](const Eigen::Vector3d& in_table, bool induced) {
    FieldDescription part{.kind = "light", .unit = "1", .magnitude = in_table.norm()};
    part.in_table = in_table;
    part.set_by_level = induced;
    return part;
  };
  SensorModel truth;
  truth.instrument = {.kind = "optical", .unit = "V"};
  truth.field = {.kind = "light+light", .unit = "1"};
  truth.field.parts = {light(room, false), light({0.4, 0.15, 0.9}, true)};
  truth.field.parts[1].in_table->normalize();
  truth.response = {.bias = Eigen::Vector3d(0.02, -0.01, 0.03),
                    .sensitivity = 1.1 * Eigen::Matrix3d::Identity()};
  std::vector<DesignEntry> design = standard_design(12);
  for (const DesignEntry& entry : standard_design(12)) {
    design.push_back({.point = entry.point, .level = 0.0});
  }
  return observations_csv(
      simulate(truth, make_run_sheet(design, 1, seed), {.noise_sd = 3e-4, .seed = seed}),
      {"x", "y", "z"});
}

TEST(CheckCommand, TakesARoomsLightAsItIsNow) {
  const test::ScratchFolder scratch;
  const std::string record = scratch.path("cal.json");
  const std::string then = scratch.write("then.csv", under_a_lamp_in({-0.06, 0.13, 0.08}, 1));
  const std::string now = scratch.write("now.csv", under_a_lamp_in({0.16, -0.03, 0.12}, 2));
  ASSERT_EQ(test::run_axiscal({"calibrate", then, "--instrument", "optical", "--unit", "V",
                               "--field", "light:local+light:induced", "--field-magnitude",
                               "unknown+1", "-o", record})
                .status,
            0);
  const test::ProgramResult check = test::run_axiscal({"check", record, now, "--json"});
  EXPECT_EQ(check.status, 0) << check.out;
}

}  // namespace
}  // namespace axiscal
