// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>

#include <gmock/gmock.h>

#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/calib/run.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/units.hpp"
#include "matchers.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using TableOfReadings = axiscal::Run;  // another class than test::Run

CsvReader reader_of_sheet(const std::string& text) {
  auto at = std::make_shared<std::size_t>(0);
  return {[text, at](char* buffer, std::size_t size) {
            const std::size_t count = std::min(size, text.size() - *at);
            std::memcpy(buffer, text.data() + *at, count);
            *at += count;
            return count;
          },
          "sheet.csv"};
}

TableOfReadings table_of(const std::string& text, const ObservationColumns& columns = {}) {
  CsvReader csv = reader_of_sheet(text);
  return read_observations(csv, columns);
}

std::string complaint_of_table(const std::string& text, const ObservationColumns& columns = {}) {
  return test::complaint_of<DataError>([&] { static_cast<void>(table_of(text, columns)); });
}

// A file with `count` readings of one axis, numbered from 1.
TableOfReadings file_of_readings(const std::string& path, std::size_t count) {
  TableOfReadings file;
  file.inputs = {{.path = path}};
  file.axes = {"x"};
  file.observations.response.resize(static_cast<Eigen::Index>(count), 1);
  for (std::size_t i = 0; i < count; ++i) {
    file.observations.readings.push_back({.run = static_cast<int>(i) + 1});
    file.observations.response(static_cast<Eigen::Index>(i), 0) = static_cast<double>(i) + 1.0;
  }
  return file;
}

// ---- files put together ----

TEST(JoinedFiles, TellHowManyReadingsEachBrought) {
  const TableOfReadings run = join_runs(
      {file_of_readings("a.csv", 3), file_of_readings("b.csv", 1), file_of_readings("c.csv", 2)},
      Units::one);
  EXPECT_THAT(run.rows_of_inputs, ElementsAre(3U, 1U, 2U));
  EXPECT_EQ(run.inputs.size(), 3U);
  EXPECT_EQ(run.inputs[2].path, "c.csv");
  EXPECT_EQ(run.observations.response.col(0), (Eigen::VectorXd(6) << 1, 2, 3, 1, 1, 2).finished());
  EXPECT_EQ(run.axes, std::vector<std::string>{"x"});
}

// If a file lacks the column, the cells of its readings are empty, whatever its position.
TEST(JoinedFiles, KeepDatesAndOperatorsAtTheirReadings) {
  TableOfReadings with = file_of_readings("with.csv", 2);
  with.dates = {"2026-11-20", "2026-11-21"};
  with.operators = {"A. Smith", "B. Jones"};
  const TableOfReadings without = file_of_readings("without.csv", 1);
  const TableOfReadings first = join_runs({with, without, with}, Units::one);
  EXPECT_THAT(first.dates, ElementsAre("2026-11-20", "2026-11-21", "", "2026-11-20", "2026-11-21"));
  EXPECT_THAT(first.operators, ElementsAre("A. Smith", "B. Jones", "", "A. Smith", "B. Jones"));
  const TableOfReadings last = join_runs({without, without, with}, Units::one);
  EXPECT_THAT(last.dates, ElementsAre("", "", "2026-11-20", "2026-11-21"));
  EXPECT_THAT(join_runs({without, without}, Units::one).dates, IsEmpty());
}

TEST(JoinedFiles, AreMeasuredAtTheLastDateThatIsStated) {
  std::vector<TableOfReadings> files;
  for (const char* measured : {"2026-03-01", "2026-11-02", "", "2025-12-31"}) {
    files.push_back(file_of_readings("a.csv", 1));
    files.back().measured = measured;
  }
  EXPECT_EQ(measured_at(join_runs(files, Units::one)), "2026-11-02");
}

TEST(JoinedFiles, KeepNotesAndNameOneIgnoredColumn) {
  TableOfReadings file = file_of_readings("a.csv", 1);
  file.notes = {"a note"};
  file.ignored_columns = {"colour"};
  const TableOfReadings run = join_runs({file, file_of_readings("b.csv", 1)}, Units::one);
  EXPECT_THAT(run.notes,
              testing::UnorderedElementsAre("a note", "a.csv: column colour was ignored"));
}

TEST(JoinedFiles, MayStateTheUnitInOneFileOnly) {
  TableOfReadings stated = file_of_readings("a.csv", 2);
  stated.serial = "7";
  stated.serials = {"7", "7"};
  for (const bool first : {true, false}) {
    std::vector<TableOfReadings> files = {file_of_readings("b.csv", 1)};
    files.insert(first ? files.begin() : files.end(), stated);
    const TableOfReadings run = join_runs(files, Units::one);
    EXPECT_EQ(run.serial, "7");
    EXPECT_THAT(run.serials, IsEmpty());
    EXPECT_FALSE(has_several_units(run));
  }
}

TEST(JoinedFiles, KeepTheSlotsAndTheirAxes) {
  TableOfReadings file = file_of_readings("a.csv", 1);
  file.slots = {"L", "R"};
  file.axes_of_slots = {{"x"}, {"x", "y"}};
  const TableOfReadings run = join_runs({file, file}, Units::one);
  EXPECT_THAT(run.slots, ElementsAre("L", "R"));
  EXPECT_EQ(run.axes_of_slots, file.axes_of_slots);
  TableOfReadings turned = file;
  turned.slots = {"R", "L"};
  EXPECT_THROW(static_cast<void>(join_runs({file, turned}, Units::one)), DataError);
}

// ---- when and by whom ----

TEST(MeasuredAt, PrefersTheStatementThenTheClockThenTheDates) {
  TableOfReadings run = file_of_readings("a.csv", 3);
  EXPECT_EQ(measured_at(run), "");
  run.dates = {"2026-11-21", "2026-11-22", "2026-11-20"};
  EXPECT_EQ(measured_at(run), "2026-11-22");
  for (std::size_t i = 0; i < 3; ++i) {
    run.observations.readings[i].time_s = 10.0 * static_cast<double>(i);  // [s] from the start
  }
  EXPECT_EQ(measured_at(run), "2026-11-22");
  run.observations.readings[1].time_s = 1795132810.0;
  EXPECT_EQ(measured_at(run), "2026-11-20T00:00:10Z");
  run.measured = "2020-01-01";
  EXPECT_EQ(measured_at(run), "2020-01-01");
}

TEST(OperatorsOf, NameEachOnceInTheirOrder) {
  TableOfReadings run = file_of_readings("a.csv", 5);
  EXPECT_EQ(operators_of(run), "");
  run.operators = {"B. Jones", "", "A. Smith", "B. Jones", "A. Smith"};
  EXPECT_EQ(operators_of(run), "B. Jones, A. Smith");
}

TEST(MakeRun, NumbersTheReadingsFromOne) {
  const std::vector<DesignPoint> points = {{Face::plus_x, Face::plus_y},
                                           {Face::minus_z, Face::minus_x}};
  Eigen::MatrixXd response(2, 3);
  response << 1, 2, 3, 4, 5, 6;
  const TableOfReadings run = make_run(points, response);
  EXPECT_EQ(run.observations.response, response);
  EXPECT_EQ(run.observations.readings[1].run, 2);
  EXPECT_EQ(*run.observations.readings[1].point, points[1]);
  EXPECT_THAT(run.inputs, IsEmpty());
  EXPECT_THAT(test::complaint_of<DomainError>(
                  [&] { static_cast<void>(make_run(points, response.topRows(1))); }),
              HasSubstr("2 design points for 1 readings"));
}

// ---- units under test ----

// Readings of 17 units in random order. Each unit gets its own readings in their order.
TEST(UnitsUnderTest, PartTheReadingsAmongThem) {
  RandomStream random(3);
  TableOfReadings run = file_of_readings("a.csv", 200);
  std::map<std::string, std::vector<double>> expected;
  std::vector<std::string> order;
  for (std::size_t i = 0; i < 200; ++i) {
    const std::string serial = "S" + std::to_string(random.index(17));
    if (!expected.contains(serial)) {
      order.push_back(serial);
    }
    expected[serial].push_back(static_cast<double>(i) + 1.0);
    run.serials.push_back(serial);
    run.dates.push_back("d" + std::to_string(i + 1));
    run.operators.push_back("o" + std::to_string(i + 1));
  }
  run.serial = run.serials.front();
  EXPECT_TRUE(has_several_units(run));
  const UnitsOfRun units(run, "not this");
  ASSERT_EQ(units.size(), order.size());
  std::size_t all = 0;
  for (std::size_t u = 0; u < units.size(); ++u) {
    EXPECT_EQ(units.serial(u), order[u]);
    const TableOfReadings unit = units[u];
    const std::vector<double>& own = expected.at(order[u]);
    all += own.size();
    ASSERT_EQ(units.readings(u), own.size());
    EXPECT_EQ(unit.serial, order[u]);
    EXPECT_EQ(unit.serials, std::vector<std::string>(own.size(), order[u]));
    EXPECT_EQ(unit.axes, run.axes);
    EXPECT_EQ(unit.inputs.front().path, "a.csv");
    for (std::size_t i = 0; i < own.size(); ++i) {
      EXPECT_EQ(unit.observations.response(static_cast<Eigen::Index>(i), 0), own[i]);
      EXPECT_EQ(unit.dates[i], "d" + std::to_string(static_cast<int>(own[i])));
      EXPECT_EQ(unit.operators[i], "o" + std::to_string(static_cast<int>(own[i])));
    }
  }
  EXPECT_EQ(all, 200U);
  const std::vector<TableOfReadings> at_once = split_by_serial(run, "");
  ASSERT_EQ(at_once.size(), units.size());
  EXPECT_EQ(at_once.back().observations.response, units[units.size() - 1].observations.response);
}

TEST(UnitsUnderTest, AreOneWithoutAColumnSerial) {
  TableOfReadings run = file_of_readings("a.csv", 4);
  run.serial = "7";
  const UnitsOfRun own(run, "");
  EXPECT_EQ(own.size(), 1U);
  EXPECT_EQ(own.serial(0), "7");
  EXPECT_EQ(own.readings(0), 4U);
  EXPECT_EQ(own.usual_readings(), 4U);
  EXPECT_EQ(own[0].observations.response, run.observations.response);
  EXPECT_EQ(UnitsOfRun(run, "stated")[0].serial, "stated");
}

TEST(UnitsUnderTest, HaveAUsualNumberOfReadings) {
  const auto usual = [](const std::vector<int>& counts) {
    TableOfReadings run;
    int unit = 0;
    std::size_t size = 0;
    for (const int count : counts) {
      size += static_cast<std::size_t>(count);
      run.serials.insert(run.serials.end(), static_cast<std::size_t>(count),
                         std::to_string(++unit));
    }
    run.observations = file_of_readings("", size).observations;
    return UnitsOfRun(run, "").usual_readings();
  };
  EXPECT_EQ(usual({12, 12, 11, 24}), 12U);
  EXPECT_EQ(usual({12, 24}), 24U) << "of two equally frequent ones the larger";
  EXPECT_EQ(usual({6, 12, 6, 12, 24}), 12U);
  EXPECT_EQ(usual({5}), 5U);
}

// ---- files ----

TEST(RunFromAFile, TakesItsColumnsAsAxesIfThereIsNoXYZ) {
  const test::ScratchFolder folder;
  const std::string path = folder.write(
      "a.csv", "run,rest,fence,acc1,acc2,heading_deg,temperature,time\n4,+X,+Y,1.5,2.5,90,20,3\n");
  const TableOfReadings run = read_run(path);
  EXPECT_THAT(run.axes, ElementsAre("acc1", "acc2"));
  EXPECT_EQ(run.observations.response, Eigen::RowVector2d(1.5, 2.5));
  ASSERT_EQ(run.inputs.size(), 1U);
  EXPECT_EQ(run.inputs.front().path, path);
  ASSERT_EQ(run.notes.size(), 1U);
  EXPECT_THAT(run.notes.front(), HasSubstr("column heading_deg was ignored"));
  // If there is a column z, the axes are x, y and z, and two columns are missing.
  const std::string z = folder.write("z.csv", "rest,fence,z,w\n+X,+Y,1,2\n");
  EXPECT_THAT(test::complaint_of<DataError>([&] { static_cast<void>(read_run(z)); }),
              HasSubstr("column 'x' is missing"));
}

TEST(RunFromAFile, NamesAFileThatIsNotThere) {
  const test::ScratchFolder folder;
  EXPECT_THAT(test::complaint_of<Error>(
                  [&] { static_cast<void>(read_run(folder.path("no such file.csv"))); }),
              HasSubstr("no such file.csv"));
}

TEST(ColumnsOfAnExperiment, FollowFromItsMethodAndWeights) {
  Experiment experiment = test::experiment_for(test::accelerometer_truth());
  const auto columns = [&] { return observation_columns(experiment, Units::one); };
  EXPECT_EQ(columns().axes, experiment.instrument.axes);
  EXPECT_FALSE(columns().needs_labels);
  EXPECT_FALSE(columns().takes_several_units);
  EXPECT_TRUE(observation_columns(experiment, Units::several).takes_several_units);
  for (const auto& [method, needs_labels] :
       {std::pair(Method::joint, true), std::pair(Method::paired, true),
        std::pair(Method::known, false), std::pair(Method::magnitude, false),
        std::pair(Method::bias, false), std::pair(Method::faces, false)}) {
    experiment.fit.method = method;
    EXPECT_EQ(columns().needs_labels, needs_labels) << method_name(method);
  }
  experiment.fit.weighting = Weighting::samples;
  EXPECT_TRUE(columns().needs_samples && !columns().needs_sd);
  experiment.fit.weighting = Weighting::sd;
  EXPECT_TRUE(columns().needs_sd && !columns().needs_samples);
  EXPECT_FALSE(columns().needs_temperature);
  experiment.fit.temperature.automatic = true;
  EXPECT_TRUE(columns().needs_temperature);
  experiment.fit.temperature = {.order = 1};
  EXPECT_TRUE(columns().needs_temperature);
  experiment.slots = {{.slot = "A"}, {.slot = "M"}};
  experiment.slots[1].instrument.axes = {"u", "v"};
  ASSERT_EQ(columns().slots.size(), 2U);
  EXPECT_EQ(columns().slots[1].slot, "M");
  EXPECT_THAT(columns().slots[1].axes, ElementsAre("u", "v"));
}

TEST(ColumnsOfATable, WithoutAMeaningAreItsAxes) {
  EXPECT_THAT(unknown_columns({"run", "volt", "rest", "fence", "volt_sd", "x_temperature",
                               "temperature_y", "level", "level.north", "rate_dps", "axis", "lux",
                               "tilt_deg", "gain", "operator", "confirm", "mount"}),
              ElementsAre("volt", "gain"));
  EXPECT_THAT(unknown_columns({}), IsEmpty());
}

TEST(ColumnsOfATable, ThatStateAPoseAreKnown) {
  for (const char* name : {"rest", "fence", "fx", "fy", "pitch_deg", "roll_deg", "angle", "rate",
                           "rate_rad_s", "theta_rad", "field_nT"}) {
    EXPECT_TRUE(is_label_of_pose(name)) << name;
  }
  for (const char* name : {"x", "run", "time", "temperature", "heading_deg", "Rest", ""}) {
    EXPECT_FALSE(is_label_of_pose(name)) << name;
  }
}

// ---- fields, attitudes and slots of a table ----

TEST(TableOfKnownFields, HasASizeAlongAnAxis) {
  const TableOfReadings run =
      table_of("rate_dps,axis,x,y,z\n30,x,1,2,3\n-10,-Z,1,2,3\n5,+y,1,2,3\n");
  EXPECT_EQ(run.field_unit, "deg/s");
  const std::vector<Reading>& readings = run.observations.readings;
  EXPECT_EQ(*readings[0].field_in_sensor, Eigen::Vector3d(30.0, 0.0, 0.0));
  EXPECT_EQ(*readings[1].field_in_sensor, Eigen::Vector3d(0.0, 0.0, 10.0));
  EXPECT_EQ(*readings[2].field_in_sensor, Eigen::Vector3d(0.0, 5.0, 0.0));
  // With one axis no column `axis` is needed.
  const TableOfReadings light = table_of("lux,y\n400,1\n", {.axes = {"y"}});
  EXPECT_EQ(*light.observations.readings[0].field_in_sensor, Eigen::Vector3d(0.0, 400.0, 0.0));
  EXPECT_EQ(light.field_unit, "lux");
  EXPECT_THAT(complaint_of_table("rate,x,y,z\n1,1,2,3\n"), HasSubstr("but not its axis"));
  EXPECT_THAT(complaint_of_table("rate,axis,x,y,z\n1,w,1,2,3\n"), HasSubstr("'w' is not an axis"));
}

TEST(TableOfAttitudes, IsInDegreesOrAsTheColumnSays) {
  const TableOfReadings run = table_of("pitch_deg,roll_deg,heading_deg,x,y,z\n30,-45,90,1,2,3\n");
  const StatedAttitude& attitude = *run.observations.readings[0].attitude;
  EXPECT_NEAR(attitude.pitch_rad, 30.0 * rad_per_deg, 1e-15);
  EXPECT_NEAR(attitude.roll_rad, -45.0 * rad_per_deg, 1e-15);
  EXPECT_NEAR(*attitude.heading_rad, 90.0 * rad_per_deg, 1e-15);
  const TableOfReadings pitch = table_of("tilt_rad,x\n0.5,1\n", {.axes = {"x"}});
  EXPECT_EQ(pitch.observations.readings[0].attitude->pitch_rad, 0.5);
  EXPECT_FALSE(pitch.observations.readings[0].attitude->heading_rad);
  // If the instrument has only the axis y, the angle is the roll.
  const TableOfReadings roll = table_of("angle,y\n-60,1\n", {.axes = {"y"}});
  EXPECT_NEAR(roll.observations.readings[0].attitude->roll_rad, -60.0 * rad_per_deg, 1e-15);
  EXPECT_EQ(roll.observations.readings[0].attitude->pitch_rad, 0.0);
  EXPECT_THAT(complaint_of_table("pitch_deg,rest,fence,x,y,z\n1,+X,+Y,1,2,3\n"),
              HasSubstr("column 'pitch_deg'"));
}

TEST(TableOfSlots, HasTheirColumnsOneSlotAfterAnother) {
  const TableOfReadings run =
      table_of("rest,fence,R.y,L.x,R.x,L.y,L.temperature,R.temperature\n+X,+Y,4,1,3,2,20,30\n",
               {.axes = {"x", "y"}});
  EXPECT_THAT(run.slots, ElementsAre("L", "R"));
  EXPECT_EQ(run.observations.response, Eigen::RowVector4d(1.0, 2.0, 3.0, 4.0));
  EXPECT_THAT(run.observations.readings[0].temperature->of_axes(), ElementsAre(20, 20, 30, 30));
  EXPECT_THAT(run.axes, ElementsAre("x", "y"));
  EXPECT_THAT(complaint_of_table("rest,fence,L.x,L.y,R.x\n+X,+Y,1,2,3\n", {.axes = {"x", "y"}}),
              HasSubstr("column 'R.y'"));
}

TEST(TableOfDifferences, SubtractsAndTellsWhichColumnsAreSaturated) {
  const ObservationColumns columns{.axes = {"d", "e"},
                                   .differences = {{.axis = "d", .plus = "p", .minus = "n"}},
                                   .range = ReadingRange{.low = 0.0, .high = 5.0}};
  const TableOfReadings run =
      table_of("rest,fence,p,n,e\n+X,+Y,3,1,2\n+X,+Y,5,1,2\n+X,+Y,3,0,9\n", columns);
  EXPECT_EQ(run.observations.response.col(0), Eigen::Vector3d(2.0, 4.0, 3.0));
  ASSERT_TRUE(run.observations.saturated);
  const auto& saturated = *run.observations.saturated;
  EXPECT_FALSE(saturated(0, 0));
  EXPECT_TRUE(saturated(1, 0));
  EXPECT_TRUE(saturated(2, 0));
  EXPECT_FALSE(saturated.col(1).any()) << "an axis of one column is looked at elsewhere";
}

TEST(TableOfTemperatures, HasThemInAllRowsOrInNone) {
  const std::string header = "rest,fence,x,y,z,temperature\n";
  const TableOfReadings blank = table_of(header + "+X,+Y,1,2,3,\n+X,-Y,1,2,3,\n");
  EXPECT_FALSE(blank.observations.readings[1].temperature);
  EXPECT_THAT(complaint_of_table(header + "+X,+Y,1,2,3,\n+X,-Y,1,2,3,21\n"),
              HasSubstr("sheet.csv:3: column 'temperature': this column has a value in this "
                        "row"));
  EXPECT_THAT(complaint_of_table(header + "+X,+Y,1,2,3,21\n+X,-Y,1,2,3,\n"),
              HasSubstr("column 'temperature' is empty"));
  EXPECT_THAT(complaint_of_table(header + "+X,+Y,1,2,3,\n", {.needs_temperature = true}),
              HasSubstr("column 'temperature'"));
  EXPECT_THAT(complaint_of_table("rest,fence,x,y,z,x_temperature\n+X,+Y,1,2,3,20\n"),
              HasSubstr("column 'y_temperature' is missing"));
}

TEST(TableOfDates, IsReadAsDatesOrNotAtAll) {
  const std::string header = "date,rest,fence,x,y,z\n";
  const TableOfReadings dated =
      table_of(header + "2026-11-20,+X,+Y,1,2,3\n,+X,-Y,1,2,3\n2026-11-21T10:00:05Z,+X,+Y,1,2,3\n");
  EXPECT_THAT(dated.dates, ElementsAre("2026-11-20", "", "2026-11-21T10:00:05Z"));
  EXPECT_EQ(measured_at(dated), "2026-11-21T10:00:05Z");
  const TableOfReadings unclear = table_of(header + "last Monday,+X,+Y,1,2,3\n");
  EXPECT_THAT(unclear.dates, IsEmpty());
  ASSERT_EQ(unclear.notes.size(), 1U);
  EXPECT_THAT(unclear.notes.front(), HasSubstr("'last Monday' is not a clear date"));
}

TEST(TableOfConfirmations, TakesOneZeroOrAnEmptyCell) {
  const std::string header = "confirm,rest,fence,x,y,z\n";
  const TableOfReadings run = table_of(header + "1,+X,+Y,1,2,3\n0,+X,+Y,1,2,3\n,+X,+Y,1,2,3\n");
  std::vector<bool> confirm;
  for (const Reading& reading : run.observations.readings) {
    confirm.push_back(reading.confirm);
  }
  EXPECT_THAT(confirm, ElementsAre(true, false, false));
  EXPECT_THAT(complaint_of_table(header + "yes,+X,+Y,1,2,3\n"), HasSubstr("'yes' must be 1 or 0"));
}

// ---- run sheets ----

TEST(RunSheets, ComeBackAsTheyWerePlanned) {
  std::vector<DesignEntry> design = standard_design(12);
  design[3].level = FieldLevel({{"north", -1.0}, {"up", 0.5}}, 2.0);
  const std::vector<RunSheetRow> sheet = make_run_sheet(design, 2, 5, {-10.0, 25.5, 55.0});
  CsvReader csv = reader_of_sheet(run_sheet_csv(sheet));
  const std::vector<RunSheetRow> back = read_run_sheet(csv);
  ASSERT_EQ(back.size(), sheet.size());
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    EXPECT_EQ(back[i].run, sheet[i].run);
    EXPECT_EQ(back[i].block, sheet[i].block);
    EXPECT_EQ(back[i].entry.point, sheet[i].entry.point);
    EXPECT_EQ(back[i].temperature, sheet[i].temperature);
    for (const char* part : {"north", "up", "other"}) {
      EXPECT_EQ(back[i].entry.level.of(part), sheet[i].entry.level.of(part)) << i << part;
    }
  }
}

TEST(RunSheets, AreNumberedFromOneIfTheyDoNotSay) {
  CsvReader csv = reader_of_sheet("rest,fence\n+X,+Y\n-Z,+X\n");
  const std::vector<RunSheetRow> sheet = read_run_sheet(csv);
  ASSERT_EQ(sheet.size(), 2U);
  EXPECT_EQ(sheet[1].run, 2);
  EXPECT_EQ(sheet[1].block, 1);
  EXPECT_FALSE(sheet[1].temperature);
  EXPECT_EQ(sheet[1].entry.level, FieldLevel(1.0));
  CsvReader wrong = reader_of_sheet("rest,fence\n+X,+Y\n+X,-X\n");
  EXPECT_THAT(test::complaint_of<DataError>([&] { static_cast<void>(read_run_sheet(wrong)); }),
              HasSubstr("sheet.csv:3: column 'fence'"));
  CsvReader empty = reader_of_sheet("rest,fence\n");
  EXPECT_THROW(static_cast<void>(read_run_sheet(empty)), DataError);
}

TEST(RunSheets, HaveCellsForEachStep) {
  const std::vector<RunSheetRow> sheet = make_run_sheet(standard_design(6), 2, 7, {20.0});
  const RunSheetCells cells = run_sheet_cells(sheet);
  EXPECT_THAT(cells.header, ElementsAre("run", "block", "rest", "fence"));
  ASSERT_EQ(cells.rows.size(), sheet.size());
  const std::vector<Reading> readings = readings_of(sheet);
  ASSERT_EQ(readings.size(), sheet.size());
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    EXPECT_THAT(cells.rows[i],
                ElementsAre(std::to_string(sheet[i].run), std::to_string(sheet[i].block),
                            std::string(face_name(sheet[i].entry.point.rest())),
                            std::string(face_name(sheet[i].entry.point.fence()))));
    EXPECT_EQ(*readings[i].point, sheet[i].entry.point);
    EXPECT_EQ(readings[i].temperature->mean(), 20.0);
  }
}

// A run sheet whose empty cells are filled in is a table of readings.
TEST(RunSheets, AreFilledInAsTables) {
  const std::vector<RunSheetRow> sheet = make_run_sheet(standard_design(12), 1, 9);
  const std::string text = run_sheet_csv(sheet, {"x", "y", "z"});
  EXPECT_EQ(text.substr(0, text.find('\n')), "run,block,rest,fence,x,y,z,temperature");
  EXPECT_THAT(complaint_of_table(text), HasSubstr("column 'x' is empty"));
  std::string filled;
  int row = 0;
  for (const std::vector<std::string>& cells : test::csv_cells(text)) {
    ASSERT_EQ(cells.size(), 8U);
    std::string line = cells[0] + "," + cells[1] + "," + cells[2] + "," + cells[3];
    line += row == 0 ? ",x,y,z,temperature"
                     : "," + std::to_string(row) + "," + std::to_string(2 * row) + ",0.5,";
    filled += line + "\n";
    ++row;
  }
  const TableOfReadings table = table_of(filled);
  ASSERT_EQ(table.observations.readings.size(), sheet.size());
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    EXPECT_EQ(*table.observations.readings[i].point, sheet[i].entry.point);
    EXPECT_EQ(table.observations.response(static_cast<Eigen::Index>(i), 1),
              2.0 * (static_cast<double>(i) + 1.0));
    EXPECT_FALSE(table.observations.readings[i].temperature);
  }
}

// The table has a column for everything that a reading can state.
TEST(ObservationsAsATable, ComeBackWithAllTheirColumns) {
  Observations all =
      test::observe(test::accelerometer_truth(), {.replicates = 2, .noise_sd = 1e-2, .seed = 6});
  RandomStream random(10);
  const Eigen::Index n = all.size();
  all.samples = Eigen::VectorXd::LinSpaced(n, 10.0, 9.0 + static_cast<double>(n));
  all.response_sd = Eigen::MatrixXd::NullaryExpr(n, 3, [&] { return random.uniform(); });
  for (std::size_t i = 0; i < all.readings.size(); ++i) {
    Reading& reading = all.readings[i];
    reading.time_s = 1795132810.0 + 7.5 * static_cast<double>(i);
    reading.mount = i < 12 ? 1 : 2;
    reading.confirm = i == 5;
    reading.level = i == 7 ? 0.25 : 1.0;
    reading.temperature = SensorTemperature({20.0 + random.normal(), 21.0 + random.normal(), 22.0});
  }
  const Observations back = table_of(observations_csv(all, {"x", "y", "z"})).observations;
  EXPECT_EQ(back.response, all.response);
  EXPECT_EQ(*back.samples, *all.samples);
  EXPECT_EQ(*back.response_sd, *all.response_sd);
  EXPECT_TRUE(back.has_level && back.has_block && back.has_fence);
  ASSERT_EQ(back.readings.size(), all.readings.size());
  for (std::size_t i = 0; i < all.readings.size(); ++i) {
    EXPECT_EQ(back.readings[i].time_s, all.readings[i].time_s);
    EXPECT_EQ(back.readings[i].mount, all.readings[i].mount);
    EXPECT_EQ(back.readings[i].confirm, all.readings[i].confirm);
    EXPECT_EQ(back.readings[i].level, all.readings[i].level);
    EXPECT_EQ(*back.readings[i].temperature, *all.readings[i].temperature);
    EXPECT_EQ(back.readings[i].point, all.readings[i].point);
  }
}

TEST(ObservationsAsATable, HaveNoColumnThatSaysNothing) {
  Observations all = test::observe(test::accelerometer_truth(), {});
  const auto header = [&] {
    const std::string text = observations_csv(all, {"x", "y", "z"});
    return text.substr(0, text.find('\n'));
  };
  EXPECT_EQ(header(), "run,block,rest,fence,x,y,z");
  for (Reading& reading : all.readings) {
    reading.time_s = 3.0;
  }
  EXPECT_EQ(header(), "run,block,rest,fence,x,y,z,time");
  all.readings.front().time_s.reset();  // if one time is missing, no column
  EXPECT_EQ(header(), "run,block,rest,fence,x,y,z");
  all.readings.front().temperature = 21.0;
  EXPECT_EQ(header(), "run,block,rest,fence,temperature,x,y,z");
}

}  // namespace
}  // namespace axiscal
