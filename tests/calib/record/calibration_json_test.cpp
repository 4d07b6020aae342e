// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/calibration_json.hpp"

#include <cmath>
#include <filesystem>

#include <nlohmann/json.hpp>

#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "matchers.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using nlohmann::json;
using test::accelerometer_truth;
using test::experiment_for;
using test::observe;
using testing::HasSubstr;

json smallest_record() {
  return {{"format", "axiscal-calibration"},
          {"version", 1},
          {"instrument", {{"kind", "accelerometer"}, {"axes", {"x", "y"}}, {"unit", "V"}}},
          {"field", {{"kind", "gravity"}, {"unit", "g"}, {"magnitude", 1.0}}},
          {"coefficients", {{"bias", {0.1, 0.2}}, {"sensitivity", {{1, 0, 0}, {0, 1, 0}}}}}};
}

std::string complaint(const json& record) {
  return test::complaint_of<DataError>(
      [&] { static_cast<void>(parse_calibration(record.dump(), "cal.json")); });
}

TEST(CalibrationJson, IsWrittenAgainByteForByte) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  experiment.table.site = Site{.latitude_deg = 52.0, .longitude_deg = 8.0};
  experiment.table.date = "2026-11-20";
  for (const Method method : {Method::paired, Method::joint, Method::known}) {
    for (const bool robust : {false, true}) {
      experiment.fit.method = method;
      experiment.fit.robust = robust;
      experiment.leave_out = {3};
      Observations observations =
          observe(truth, {.replicates = 2, .slope = {0.003, -0.002}, .noise_sd = 1e-4, .seed = 3});
      observations.readings[0].temperature = 21.5;
      observations.response(5, 1) += 0.01;  // causes a warning
      Calibration calibration = calibrate(experiment, observations);
      calibration.provenance.inputs = {{.path = "a \"quoted\" name.csv", .sha256 = "00ff"}};
      calibration.findings.notes = {{NoteCode::drift, "a note"}};
      calibration.sensor.instrument.serial = "QA-113 \xC3\xA9";
      EXPECT_TRUE(robust || !calibration.findings.warnings.empty());
      const std::string text = calibration_json(calibration);
      EXPECT_EQ(calibration_json(parse_calibration(text, "cal.json")), text);
    }
  }
}

TEST(CalibrationJson, InOneLineIsTheSameRecord) {
  const SensorModel truth = accelerometer_truth();
  for (const int replicates : {1, 20}) {  // 240 readings are written by columns
    const Calibration calibration = calibrate(
        experiment_for(truth),
        observe(truth, {.replicates = replicates, .slope = {0.003, -0.002}, .noise_sd = 1e-4}));
    const std::string line = calibration_json(calibration, JsonLayout::one_line);
    EXPECT_EQ(line.find('\n'), std::string::npos);
    EXPECT_EQ(nlohmann::ordered_json::parse(line),
              nlohmann::ordered_json::parse(calibration_json(calibration)));
    EXPECT_EQ(calibration_json(parse_calibration(line, "line"), JsonLayout::one_line), line);
  }
}

TEST(CalibrationJson, IsNotWrittenIfItCouldNotBeReadAgain) {
  const SensorModel truth = accelerometer_truth();
  Calibration calibration =
      calibrate(experiment_for(truth), observe(truth, {.replicates = 1, .noise_sd = 1e-4}));
  calibration.sensor.response.bias(1) = std::nan("");
  const test::ScratchFolder folder;
  for (const std::string& path : {folder.path("cal.json"), std::string()}) {
    EXPECT_THAT(test::complaint_of<DomainError>([&] {
                  if (path.empty()) {
                    static_cast<void>(calibration_json(calibration));
                  } else {
                    write(calibration, path);
                  }
                }),
                HasSubstr("could not be read again: bias must be finite numbers"));
  }
  EXPECT_FALSE(std::filesystem::exists(folder.path("cal.json")));
}

// Writing a record does not modify it, so other threads may read it.
TEST(CalibrationJson, ChangesNothingThatItWrites) {
  const SensorModel truth = accelerometer_truth();
  Calibration calibration =
      calibrate(experiment_for(truth), observe(truth, {.noise_sd = 1e-4, .seed = 3}));
  FieldDescription part = calibration.sensor.field;
  part.in_table.reset();
  part.unit = "mg";
  calibration.sensor.field.parts = {part};
  calibration.sensor.rotation_sensor_from_assembly = Eigen::Matrix3d::Identity();
  calibration.findings.warnings = {{.code = WarningCode::outlier, .runs = {3}, .message = "odd"}};
  static_cast<void>(calibration_json(calibration));
  EXPECT_FALSE(calibration.sensor.field.parts.front().in_table);
  EXPECT_EQ(calibration.sensor.field.parts.front().unit, "mg");
}

// A record of more than 200 readings has one list for each member. The rows of earlier versions can
// still be read.
TEST(CalibrationJson, WritesManyReadingsAsATable) {
  const SensorModel truth = accelerometer_truth();
  const Calibration calibration = calibrate(
      experiment_for(truth), observe(truth, {.replicates = 20, .noise_sd = 1e-4, .seed = 3}));
  const std::string text = calibration_json(calibration);
  json record = json::parse(text);
  ASSERT_TRUE(record["residuals"].is_object());
  EXPECT_EQ(record["residuals"]["run"].size(), 240U);
  const Calibration read = parse_calibration(text, "cal.json");
  EXPECT_EQ(calibration_json(read), text);
  EXPECT_EQ(read.fit.residuals[77].run, calibration.fit.residuals[77].run);
  json rows = json::array();
  for (std::size_t i = 0; i < 240; ++i) {
    json row;
    for (const auto& [name, column] : record["residuals"].items()) {
      row[name] = column[i];
    }
    rows.push_back(row);
  }
  json old_form = record;
  old_form["residuals"] = rows;
  EXPECT_EQ(calibration_json(parse_calibration(old_form.dump(), "cal.json")), text);
  record["residuals"]["run"].erase(5);
  EXPECT_THAT(complaint(record), HasSubstr("entries, but the first column"));
}

TEST(CalibrationJson, HasTheKeysOfTheContract) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  experiment.fit.method = Method::paired;
  const json record = json::parse(calibration_json(
      calibrate(experiment, observe(truth, {.slope = {0.003, 0.0}, .noise_sd = 1e-4}))));
  EXPECT_EQ(record["format"], "axiscal-calibration");
  EXPECT_EQ(record["version"], 1);
  EXPECT_EQ(record["status"], "ok");
  EXPECT_EQ(record["method"], "paired");
  EXPECT_EQ(record["field"]["in_table"].size(), 3U);
  EXPECT_EQ(record["coefficients"]["sensitivity"].size(), 3U);
  EXPECT_EQ(record["statistics"]["standard_error"]["sensitivity"][2].size(), 3U);
  EXPECT_EQ(record["statistics"]["covariance"].size(), 12U);
  EXPECT_EQ(record["statistics"]["parameter_names"][5], "y.sensitivity.x");
  EXPECT_EQ(record["levelness"]["estimates"].size(), 6U);
  EXPECT_EQ(record["levelness"]["estimates"][0]["fence"].get<std::string>()[0], '+');
  EXPECT_EQ(record["levelness"]["consistent"], true);
  EXPECT_EQ(record["residuals"].size(), 12U);
  EXPECT_EQ(record["residuals"][0]["run"], 1);
  EXPECT_TRUE(record["warnings"].is_array() && record["warnings"].empty());
  EXPECT_FALSE(record["coefficients"].contains("temperature"));
  EXPECT_EQ(record["coefficients"]["polar"].size(), 3U);
  // The interval is that of Student's t with 2 degrees of freedom: six averages of pairs less four
  // coefficients.
  const double se = record["statistics"]["standard_error"]["bias"][0];
  EXPECT_NEAR(record["statistics"]["interval_95"]["bias"][0].get<double>() / se, 4.30265, 1e-4);
}

TEST(CalibrationJson, ReadsTheSmallestRecord) {
  const Calibration calibration = parse_calibration(smallest_record().dump(), "cal.json");
  EXPECT_EQ(calibration.sensor.instrument.axes, (std::vector<std::string>{"x", "y"}));
  EXPECT_EQ(calibration.sensor.response.bias(1), 0.2);
  EXPECT_FALSE(calibration.fit.statistics);
  json with_more = smallest_record();
  with_more["colour"] = "blue";
  EXPECT_EQ(complaint(with_more), "accepted") << "unknown keys are ignored";
}

TEST(CalibrationJson, SaysWhatIsWrongWhere) {
  const auto changed = [](const char* pointer, const json& value) {
    json record = smallest_record();
    record[json::json_pointer(pointer)] = value;
    return complaint(record);
  };
  EXPECT_THAT(changed("/version", 3), HasSubstr("cal.json: /version: version 3"));
  EXPECT_THAT(changed("/format", "x"), HasSubstr("/format"));
  EXPECT_THAT(changed("/instrument/kind", "sextant"), HasSubstr("/instrument/kind: unknown kind"));
  EXPECT_THAT(changed("/instrument/axes", 3), HasSubstr("/instrument/axes: must be a list"));
  EXPECT_THAT(changed("/field/magnitude", 0), HasSubstr("/field/magnitude: must be positive"));
  EXPECT_THAT(changed("/coefficients/bias", json::array({1})),
              HasSubstr("/coefficients/bias: must have 2 numbers"));
  EXPECT_THAT(changed("/coefficients/sensitivity/1/2", "0"),
              HasSubstr("/coefficients/sensitivity/1/2: must be a number"));
  EXPECT_THAT(changed("/coefficients/temperature", {{"reference", 20}}),
              HasSubstr("/coefficients/temperature/range: is missing"));
  json record = smallest_record();
  record.erase("coefficients");
  EXPECT_THAT(complaint(record), HasSubstr("/coefficients: is missing"));
  EXPECT_THAT(complaint(json::array()), HasSubstr("cal.json: /: must be an object"));
}

}  // namespace
}  // namespace axiscal
