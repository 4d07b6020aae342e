// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/fitted_parameters.hpp"

#include <nlohmann/json.hpp>

#include "axiscal/calib/calibration_json.hpp"
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

class FittedParametersOfFile : public ::testing::Test {
 protected:
  FittedParameters read(const std::string& text) {
    return parse_fitted_parameters(text, "cal.json");
  }

  static Calibration calibration() {
    const SensorModel truth = accelerometer_truth();
    Experiment experiment = experiment_for(truth);
    experiment.instrument.serial = "QA-113";
    experiment.stated.resolution = 1e-3;
    return calibrate(experiment, observe(truth, {.replicates = 3, .noise_sd = 1e-4, .seed = 3}));
  }
};

void expect_same(const FittedParameters& a, const FittedParameters& b) {
  EXPECT_EQ(a.date, b.date);
  EXPECT_EQ(a.serial, b.serial);
  EXPECT_EQ(a.axes, b.axes);
  EXPECT_EQ(a.values, b.values);
  EXPECT_TRUE(a.u.isApprox(b.u, 1e-15)) << a.u << "\n" << b.u;
}

TEST_F(FittedParametersOfFile, AreThoseOfTheRecord) {
  const Calibration record = calibration();
  const FittedParameters read = this->read(calibration_json(record));
  EXPECT_EQ(read.date, record.provenance.created);
  EXPECT_EQ(read.serial, "QA-113");
  EXPECT_EQ(read.axes, record.sensor.instrument.axes);
  ASSERT_EQ(read.values.size(), 12);
  ASSERT_GT(parameter_covariance(record)(1, 1), record.fit.statistics->covariance(1, 1));
  for (Eigen::Index i = 0; i < 12; ++i) {
    const std::string& name = record.fit.statistics->parameter_names[static_cast<std::size_t>(i)];
    EXPECT_EQ(read.values(i), parameter_value(record.sensor, name)) << name;
    EXPECT_NEAR(read.u(i), std::sqrt(parameter_covariance(record)(i, i)), 1e-15) << name;
  }
}

// If the text has escapes or another order, it is read by the reader of whole records.
TEST_F(FittedParametersOfFile, AreTheSameByTheOtherReader) {
  const std::string text = calibration_json(calibration());
  const FittedParameters plain = read(text);
  std::string escaped = text;
  escaped.replace(text.find("\"QA-113\""), 8, R"("QA\u002d113")");
  expect_same(read(escaped), plain);
  json other_order = json::parse(text);  // members sorted by name
  expect_same(read(other_order.dump()), plain);
}

TEST_F(FittedParametersOfFile, AreTheFitsAloneWhereASourceIsOfIt) {
  const std::string text = calibration_json(calibration());
  std::string escaped = text;  // escapes the type of the source
  const std::size_t type = escaped.find("\"A\"", escaped.find("\"sources\""));
  ASSERT_NE(type, std::string::npos);
  escaped.replace(type, 3, R"("\u0041")");
  expect_same(read(escaped), read(text));
}

TEST_F(FittedParametersOfFile, NeedNoStatistics) {
  json record = json::parse(calibration_json(calibration()));
  record.erase("statistics");
  const FittedParameters read = this->read(record.dump());
  EXPECT_EQ(read.values.size(), 12);
  EXPECT_TRUE(read.u.array().isNaN().all());
}

TEST_F(FittedParametersOfFile, AreRefusedWithThePlace) {
  const auto complaint = [&](const std::string& text) {
    return test::complaint_of<DataError>([&] { static_cast<void>(read(text)); });
  };
  EXPECT_THAT(complaint("{\"format\": \"axiscal-calibration\", \"version\": 1,\n\"notes\": [}"),
              HasSubstr("cal.json:2:"));
  const std::string text = calibration_json(calibration());
  EXPECT_THAT(complaint(text.substr(0, text.size() / 2)), HasSubstr("not valid JSON"));
  json record = json::parse(text);
  record["version"] = 3;
  EXPECT_THAT(complaint(record.dump()), HasSubstr("/version"));
  record["version"] = 1;
  record["instrument"]["axes"] = {"x", "x", "z"};
  EXPECT_THAT(complaint(record.dump()), HasSubstr("/instrument/axes"));
  record["instrument"]["axes"] = {"x", "y", "z"};
  record["coefficients"]["sensitivity"][1][2] = nullptr;
  EXPECT_THAT(complaint(record.dump()), HasSubstr("/coefficients/sensitivity/1/2"));
}

}  // namespace
}  // namespace axiscal
