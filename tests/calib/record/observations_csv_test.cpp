// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/observations_csv.hpp"

#include <cstring>

#include "axiscal/core/error.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

CsvReader reader_of(const std::string& text) {
  return {[text, at = std::size_t{0}](char* buffer, std::size_t size) mutable {
            const std::size_t count = std::min(size, text.size() - at);
            std::memcpy(buffer, text.data() + at, count);
            at += count;
            return count;
          },
          "run.csv"};
}

axiscal::Run read(const std::string& text, const ObservationColumns& columns = {}) {
  CsvReader csv = reader_of(text);
  return read_observations(csv, columns);
}

std::string csv_complaint(const std::string& text, const ObservationColumns& columns = {}) {
  try {
    static_cast<void>(read(text, columns));
  } catch (const DataError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(ReadObservations, TakesColumnsInAnyOrder) {
  const axiscal::Run table = read(
      "operator,z,fence,y,REST,x,rest,temperature,time,block,run,level\n"
      "A,3,Y-,2,?,1,+x,21.5,2026-11-20T00:00:10Z,2,7,-1\n");
  EXPECT_THAT(table.operators, ElementsAre("A"));
  EXPECT_THAT(table.ignored_columns, ElementsAre("REST"));
  const Reading& reading = table.observations.readings.at(0);
  EXPECT_EQ(reading.run, 7);
  EXPECT_EQ(reading.block, 2);
  EXPECT_EQ(reading.level, -1.0);
  EXPECT_EQ(*reading.point, DesignPoint(Face::plus_x, Face::minus_y));
  EXPECT_EQ(reading.temperature, 21.5);
  EXPECT_EQ(reading.time_s, 1795132810.0);
  EXPECT_EQ(table.observations.response, Eigen::RowVector3d(1.0, 2.0, 3.0));
}

TEST(ReadObservations, TakesFieldsInsteadOfLabels) {
  const axiscal::Run table = read("fx,fy,fz,x,y,z\n0,0,1,1,2,3\n");
  EXPECT_EQ(*table.observations.readings[0].field_in_sensor, Eigen::Vector3d(0.0, 0.0, 1.0));
  EXPECT_FALSE(table.observations.readings[0].point);
  // If the axes are named fx, fy and fz, these columns are responses and not fields.
  const axiscal::Run forces =
      read("rest,fence,fx,fy,fz\n+X,+Y,1,2,3\n", {.axes = {"fx", "fy", "fz"}});
  EXPECT_FALSE(forces.observations.readings[0].field_in_sensor);
}

TEST(ReadObservations, TakesWhatSpreadsheetsMake) {
  const axiscal::Run table = read(
      "\xEF\xBB\xBF# by hand\r\n\"rest\",\"fence\", x , y,z,samples,x_sd,y_sd,z_sd,serial\r\n"
      "\r\n\"+X\",Y+,\"1.5\", -2 ,+3e0,10,1,2,3,\"QA,1\"\r\n");
  EXPECT_EQ(table.observations.response, Eigen::RowVector3d(1.5, -2.0, 3.0));
  EXPECT_EQ((*table.observations.samples)(0), 10.0);
  EXPECT_EQ((*table.observations.response_sd)(0, 2), 3.0);
  EXPECT_EQ(table.serial, "QA,1");
  EXPECT_TRUE(table.ignored_columns.empty());
}

TEST(ReadObservations, SaysWhatIsWrongWhere) {
  const std::string header = "rest,fence,x,y,z\n";
  const auto row = [&](const std::string& text) {
    return csv_complaint(header + "#\n" + text + "\n");
  };
  EXPECT_THAT(row("+W,+Y,1,2,3"), HasSubstr("run.csv:3: column 'rest': '+W' is not a face"));
  EXPECT_THAT(row("+X,-X,1,2,3"),
              HasSubstr("run.csv:3: column 'fence': '-X' and rest '+X' are on one axis"));
  for (const char* cell : {"abc", "nan", "inf", "1e999", "1.2V", "\"1,5\""}) {
    EXPECT_THAT(row("+X,+Y,1," + std::string(cell) + ",3"), HasSubstr("run.csv:3: column 'y': '"))
        << cell;
  }
  EXPECT_THAT(row("+X,+Y,1,,3"),
              HasSubstr("column 'y' is empty. Fill in the value, or delete the row"));
  EXPECT_THAT(row("+X,+Y,\"1,5\",2,3"), HasSubstr("write '.' as the decimal point"));
  EXPECT_THAT(row("+X,+Y,1,5,2,3"),
              HasSubstr("run.csv:3: the row has 6 cells, but the header has 5 (a decimal comma"));
  EXPECT_THAT(row("+X,+Y,1"), HasSubstr("run.csv:3: the row has 3 cells"));
  EXPECT_THAT(row("+X,\"+Y,1,2,3"), HasSubstr("run.csv:3: a cell begins with a quote"));
  EXPECT_THAT(row(std::string("+X,+Y,1,2,\0", 11)), HasSubstr("run.csv:3: a NUL byte"));
  EXPECT_THAT(row("+X,+Y,1,2,\xE9"), HasSubstr("run.csv:3: not UTF-8"));
  EXPECT_THAT(csv_complaint(header), HasSubstr("run.csv:1: the table has a header"));
  EXPECT_THAT(csv_complaint("fence,x,y,z\n"), HasSubstr("column 'rest' is missing"));
  EXPECT_THAT(csv_complaint("rest,fence,x,y\n"), HasSubstr("run.csv:1: column 'z' is missing"));
  EXPECT_THAT(csv_complaint("fx,x,y,z\n1,1,2,3\n"), HasSubstr("column 'fy' is missing"));
  EXPECT_THAT(csv_complaint("rest;fence;x;y;z\n"), HasSubstr("separated by semicolons"));
  EXPECT_THAT(csv_complaint("rest,fence,X,y,z\n"), HasSubstr("did you mean 'X'?"));
  EXPECT_THAT(csv_complaint("run,rest,fence,x,y,z\n1.5,+X,+Y,1,2,3\n"), HasSubstr("column 'run'"));
  EXPECT_THAT(csv_complaint("time,rest,fence,x,y,z\nnoon,+X,+Y,1,2,3\n"),
              HasSubstr("column 'time'"));
  EXPECT_THAT(csv_complaint("samples,rest,fence,x,y,z\n0,+X,+Y,1,2,3\n"),
              HasSubstr("column 'samples': '0' must be greater than 0"));
  EXPECT_THAT(csv_complaint("serial,rest,fence,x,y,z\nA,+X,+Y,1,2,3\nB,+X,+Y,1,2,3\n"),
              HasSubstr("run.csv:3: column 'serial': 'B' follows 'A'"));
}

TEST(ReadObservations, TakesWholeNumbersAsDataFramesWriteThem) {
  EXPECT_EQ(read("run,rest,fence,x,y,z\n7.0,+X,+Y,1,2,3\n").observations.readings.at(0).run, 7);
  EXPECT_THAT(csv_complaint("run,rest,fence,x,y,z\n7.5,+X,+Y,1,2,3\n"),
              HasSubstr("'7.5' is not a whole number"));
}

TEST(ReadObservations, NeedsTheColumnsThatAreAskedFor) {
  const std::string fields = "fx,fy,fz,x,y,z\n0,0,1,1,2,3\n";
  EXPECT_THAT(csv_complaint(fields, {.needs_labels = true}), HasSubstr("column 'rest' is missing"));
  EXPECT_THAT(csv_complaint(fields, {.needs_samples = true}), HasSubstr("column 'samples'"));
  EXPECT_THAT(csv_complaint(fields, {.needs_sd = true}), HasSubstr("column 'x_sd'"));
  EXPECT_THAT(csv_complaint("fx,fy,fz,x,x_sd\n0,0,1,1,-1\n", {.axes = {"x"}, .needs_sd = true}),
              HasSubstr("column 'x_sd': '-1'"));
}

TEST(ObservationsCsv, ComesBack) {
  const SensorModel truth = test::accelerometer_truth();
  const test::Run run{.replicates = 2, .noise_sd = 0.1};
  const Observations observations = test::observe(truth, run);
  const axiscal::Run table = read(test::observations_text(truth, run));
  EXPECT_EQ(table.observations.response, observations.response);
  for (std::size_t i = 0; i < 24; ++i) {
    EXPECT_EQ(table.observations.readings[i].point, observations.readings[i].point);
    EXPECT_EQ(table.observations.readings[i].run, observations.readings[i].run);
    EXPECT_EQ(table.observations.readings[i].block, observations.readings[i].block);
  }
}

TEST(RunSheetCsv, CanBeTheDesignOfAnother) {
  std::vector<DesignEntry> design = standard_design(6);
  CsvReader plain = reader_of(run_sheet_csv(make_run_sheet(design, 1, 3)));
  EXPECT_FALSE(plain.column("level"));
  EXPECT_EQ(read_design(plain).size(), 6U);
  design[2].level = -0.5;
  CsvReader with_level = reader_of(run_sheet_csv(make_run_sheet(design, 1, 3)));
  double sum = 0.0;
  for (const DesignEntry& entry : read_design(with_level)) {
    sum += entry.level.of_all();
  }
  EXPECT_EQ(sum, 4.5);
  CsvReader empty = reader_of("rest,fence\n");
  EXPECT_THROW(static_cast<void>(read_design(empty)), DataError);
}

TEST(Concatenate, MakesBlocksOfFilesAndNumbersRunsOn) {
  const SensorModel truth = test::accelerometer_truth();
  const Observations one = test::observe(truth, {});
  const Observations two = test::observe(truth, {.replicates = 2});
  const Observations all = concatenate({one, two});
  EXPECT_EQ(all.size(), 36);
  EXPECT_EQ(all.response.rows(), 36);
  EXPECT_EQ(all.readings[12].run, 13);
  EXPECT_EQ(all.readings[12].block, 2);
  EXPECT_EQ(all.readings[35].run, 36);
  EXPECT_EQ(all.readings[35].block, 3);
  EXPECT_THROW(static_cast<void>(concatenate({})), DomainError);
  Observations with_samples = one;
  with_samples.samples = Eigen::VectorXd::Ones(12);
  EXPECT_THROW(static_cast<void>(concatenate({with_samples, one})), DomainError);
  Observations late = one;
  late.readings[0].run = 2147483647;
  EXPECT_THROW(static_cast<void>(concatenate({late, one})), DomainError);
}

}  // namespace
}  // namespace axiscal
