// SPDX-License-Identifier: Apache-2.0
// Records of units over several years: lines by closed formulas, and dates at which limits are
// reached.
#include "axiscal/calib/history.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/error.hpp"
#include "matchers.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr double days_per_year = 365.2425;

double year_of_date(const std::string& date) {
  const auto number = [&](std::size_t from, std::size_t count) {
    return std::stoi(date.substr(from, count));
  };
  const std::chrono::sys_days day = std::chrono::year(number(0, 4)) /
                                    std::chrono::month(static_cast<unsigned>(number(5, 2))) /
                                    std::chrono::day(static_cast<unsigned>(number(8, 2)));
  return static_cast<double>(day.time_since_epoch().count()) / days_per_year;
}

struct DatedBias {
  std::string date;
  double bias = 0.0;
  double u = 1e-3;
};

// A record with the date and the x.bias of `one`.
Calibration dated_record(const std::string& serial, const DatedBias& one) {
  static const Calibration made = [] {
    const SensorModel truth = test::accelerometer_truth();
    return calibrate(test::experiment_for(truth), test::observe(truth, {.noise_sd = 1e-4}));
  }();
  Calibration record = made;
  record.sensor.instrument.serial = serial;
  record.provenance.measured = one.date;
  record.sensor.response.bias(0) = one.bias;
  record.fit.uncertainty.reset();
  record.fit.statistics->components.clear();
  record.fit.statistics->covariance = one.u * one.u * Eigen::MatrixXd::Identity(12, 12);
  return record;
}

class HistoryOfFolder : public ::testing::Test {
 protected:
  void put(const std::vector<DatedBias>& values, const std::string& serial = "A-1") {
    for (const DatedBias& one : values) {
      folder_.write(serial + "_" + std::to_string(++count_) + ".json",
                    calibration_json(dated_record(serial, one)));
    }
  }

  [[nodiscard]] std::vector<UnitHistory> read(const std::optional<Limits>& limits = {}) {
    passed_over_.clear();
    not_held_.clear();
    return read_history(records_in_folder(folder_.path("")), limits, &passed_over_, &not_held_);
  }

  // @return the trend of x.bias of the only unit.
  [[nodiscard]] ParameterTrend trend(std::optional<double> low = {},
                                     std::optional<double> high = {}) {
    const std::vector<UnitHistory> units =
        low || high ? read(Limits{.limits = {{.parameter = "x.bias", .low = low, .high = high}}})
                    : read();
    EXPECT_EQ(units.size(), 1U);
    EXPECT_EQ(units.front().trends.front().parameter, "x.bias");
    return units.front().trends.front();
  }

  test::ScratchFolder folder_;
  std::vector<std::string> passed_over_;
  std::vector<std::string> not_held_;

 private:
  int count_ = 0;
};

// A weighted straight line by a textbook's formulas.
struct WeightedLine {
  double mean_year = 0.0;
  double mean = 0.0;
  double slope = 0.0;
  double variance_of_mean = 0.0;
  double variance_of_slope = 0.0;

  [[nodiscard]] double at(double year) const { return mean + slope * (year - mean_year); }
  [[nodiscard]] double u_at(double year) const {
    return std::sqrt(variance_of_mean + std::pow(year - mean_year, 2) * variance_of_slope);
  }
};

WeightedLine weighted_line(const std::vector<DatedBias>& values) {
  double w = 0.0;
  double wt = 0.0;
  double wy = 0.0;
  for (const DatedBias& one : values) {
    const double weight = 1.0 / (one.u * one.u);
    w += weight;
    wt += weight * year_of_date(one.date);
    wy += weight * one.bias;
  }
  WeightedLine line{.mean_year = wt / w, .mean = wy / w};
  double squares = 0.0;
  double products = 0.0;
  for (const DatedBias& one : values) {
    const double t = year_of_date(one.date) - line.mean_year;
    squares += t * t / (one.u * one.u);
    products += t * one.bias / (one.u * one.u);
  }
  line.slope = products / squares;
  double chi_squared = 0.0;
  for (const DatedBias& one : values) {
    chi_squared += std::pow((one.bias - line.at(year_of_date(one.date))) / one.u, 2);
  }
  // If the scatter is larger than the stated uncertainty, the variances are multiplied.
  const double n = static_cast<double>(values.size());
  const double factor = n > 2.0 ? std::max(1.0, chi_squared / (n - 2.0)) : 1.0;
  line.variance_of_mean = factor / w;
  line.variance_of_slope = factor / squares;
  return line;
}

const std::vector<DatedBias> quiet_years = {{"2019-03-01", 0.1002, 1e-3},
                                            {"2020-03-15", 0.1101, 2e-3},
                                            {"2021-04-01", 0.1199, 1e-3},
                                            {"2022-03-01", 0.1301, 5e-4},
                                            {"2023-06-01", 0.1422, 1e-3}};

void expect_line(const ParameterTrend& trend, const std::vector<DatedBias>& values) {
  const WeightedLine line = weighted_line(values);
  const auto nu = static_cast<double>(values.size()) - 2.0;
  const double u = std::sqrt(line.variance_of_slope);
  EXPECT_NEAR(trend.slope_per_year / line.slope, 1.0, 1e-9);
  EXPECT_NEAR(trend.slope_u_per_year / u, 1.0, 1e-9);
  EXPECT_NEAR(trend.p_value / student_t_two_sided_p(line.slope / u, nu), 1.0, 1e-6);
}

TEST_F(HistoryOfFolder, HasTheWeightedLineThroughItsRecords) {
  put(quiet_years);
  expect_line(trend(), quiet_years);
}

TEST_F(HistoryOfFolder, HasAnUncertaintyOfTheScatterIfThatIsLarger) {
  std::vector<DatedBias> restless = quiet_years;
  restless[1].bias += 0.03;
  restless[3].bias -= 0.02;
  put(restless);
  expect_line(trend(), restless);
  EXPECT_GT(trend().p_value, 0.01);
}

TEST_F(HistoryOfFolder, PutsRecordsInTheOrderOfTheirDates) {
  put({quiet_years[3], quiet_years[0], quiet_years[4], quiet_years[2], quiet_years[1]});
  const std::vector<UnitHistory> units = read();
  ASSERT_EQ(units.size(), 1U);
  EXPECT_EQ(units.front().serial, "A-1");
  EXPECT_THAT(units.front().dates,
              ElementsAre("2019-03-01", "2020-03-15", "2021-04-01", "2022-03-01", "2023-06-01"));
  EXPECT_THAT(units.front().paths.front(), HasSubstr("A-1_2.json"));
  ASSERT_EQ(units.front().trends.size(), 12U);
  EXPECT_THAT(units.front().trends.front().values,
              ElementsAre(0.1002, 0.1101, 0.1199, 0.1301, 0.1422));
  EXPECT_NEAR(units.front().trends.front().u[3], 5e-4, 1e-15);
  // The slope of a constant parameter is 0.
  EXPECT_NEAR(units.front().trends[1].slope_per_year, 0.0, 1e-12);
  EXPECT_NEAR(units.front().trends[1].p_value, 1.0, 1e-6);
}

TEST_F(HistoryOfFolder, OfTwoRecordsHasTheirDifference) {
  put({quiet_years[0], quiet_years[3]});
  const ParameterTrend two = trend();
  const double years = year_of_date("2022-03-01") - year_of_date("2019-03-01");
  EXPECT_NEAR(two.slope_per_year, (0.1301 - 0.1002) / years, 1e-12);
  EXPECT_NEAR(two.slope_u_per_year, std::hypot(1e-3, 5e-4) / years, 1e-12);
  EXPECT_TRUE(std::isnan(two.p_value));
}

TEST_F(HistoryOfFolder, OfOneDateHasNoLine) {
  put({quiet_years[0], quiet_years[0]});
  const ParameterTrend same = trend({}, 0.2);
  EXPECT_TRUE(std::isnan(same.slope_per_year));
  EXPECT_TRUE(std::isnan(same.slope_u_per_year));
  EXPECT_TRUE(same.meets_limit_on.empty());
  EXPECT_FALSE(same.outside);
  EXPECT_THAT(history_text(read().front()), testing::Not(HasSubstr("per year")));
}

// On the stated date the line reaches its limit. At the ends of the interval the bounds of its
// confidence band reach it.
TEST_F(HistoryOfFolder, DatesTheLimitWithItsInterval) {
  put(quiet_years);
  const double limit = 0.19;
  const ParameterTrend found = trend(0.0, limit);
  const WeightedLine line = weighted_line(quiet_years);
  const double t = student_t_factor(0.95, 3.0);
  const double two_days = 2.0 / days_per_year * line.slope;
  ASSERT_FALSE(found.meets_limit_until.empty());
  const double on = year_of_date(found.meets_limit_on);
  const double from = year_of_date(found.meets_limit_from);
  const double until = year_of_date(found.meets_limit_until);
  EXPECT_NEAR(line.at(on), limit, two_days);
  EXPECT_NEAR(line.at(from) + t * line.u_at(from), limit, two_days);
  EXPECT_NEAR(line.at(until) - t * line.u_at(until), limit, two_days);
  EXPECT_LT(from, on);
  EXPECT_LT(on, until);
  EXPECT_FALSE(found.outside);
  EXPECT_THAT(
      history_text(read(Limits{.limits = {{.parameter = "x.bias", .high = limit}}}).front()),
      HasSubstr("will reach its limit on " + found.meets_limit_on + " (95 % interval: from " +
                found.meets_limit_from + " to " + found.meets_limit_until + ")"));
}

TEST_F(HistoryOfFolder, DatesNoLimitThatTheLineLeaves) {
  put(quiet_years);
  EXPECT_TRUE(trend(0.0, {}).meets_limit_on.empty());   // the line moves away from the limit
  EXPECT_TRUE(trend({}, 5.0).meets_limit_on.empty());   // reached after several hundred years
  EXPECT_FALSE(trend({}, 1.0).meets_limit_on.empty());  // reached in less than 100 years
  const ParameterTrend beyond = trend({}, 0.12);
  EXPECT_TRUE(beyond.outside);
  EXPECT_TRUE(beyond.meets_limit_on.empty());
  EXPECT_THAT(history_text(read(Limits{.limits = {{.parameter = "x.bias", .high = 0.12}}}).front()),
              HasSubstr("outside its limits"));
}

TEST_F(HistoryOfFolder, IsTheSameUpsideDown) {
  std::vector<DatedBias> mirrored = quiet_years;
  for (DatedBias& one : mirrored) {
    one.bias = -one.bias;
  }
  put(quiet_years, "up");
  put(mirrored, "down");
  const Limits limits{.limits = {{.parameter = "x.bias", .low = -0.19, .high = 0.19}}};
  const std::vector<UnitHistory> units = read(limits);
  ASSERT_EQ(units.size(), 2U);
  const ParameterTrend& down = units[0].trends.front();
  const ParameterTrend& up = units[1].trends.front();
  EXPECT_EQ(units[0].serial, "down");
  EXPECT_NEAR(down.slope_per_year, -up.slope_per_year, 1e-12);
  EXPECT_EQ(down.meets_limit_on, up.meets_limit_on);
  EXPECT_EQ(down.meets_limit_from, up.meets_limit_from);
  EXPECT_EQ(down.meets_limit_until, up.meets_limit_until);
}

// If the slope may be 0, `meets_limit_until` is empty.
TEST_F(HistoryOfFolder, LeavesTheIntervalOpenForASlopeThatMayBeNone) {
  const std::vector<DatedBias> uncertain = {{"2020-01-01", 0.100, 0.02},
                                            {"2021-01-01", 0.108, 0.02},
                                            {"2022-01-01", 0.112, 0.02},
                                            {"2023-01-01", 0.120, 0.02}};
  put(uncertain);
  const ParameterTrend found = trend({}, 0.125);
  EXPECT_FALSE(found.meets_limit_on.empty());
  EXPECT_EQ(found.meets_limit_from, "2023-01-01");  // may be reached already
  EXPECT_TRUE(found.meets_limit_until.empty());
}

TEST_F(HistoryOfFolder, PassesOverOtherFilesAndSaysWhy) {
  put({quiet_years[0]});
  folder_.write("notes.txt", "no record");
  folder_.write("broken.json", "{");
  folder_.write("limits.json", R"({"format":"axiscal-limits","version":1,"limits":[]})");
  const std::vector<UnitHistory> units = read();
  EXPECT_EQ(units.size(), 1U);
  EXPECT_THAT(passed_over_, ElementsAre(HasSubstr("broken.json"), HasSubstr("limits.json")));
  EXPECT_EQ(read_records(records_in_folder(folder_.path(""))).size(), 1U);
  for (const char* const missing : {"none", "notes.txt"}) {
    EXPECT_THAT(test::complaint_of<DataError>([&] {
                  static_cast<void>(read_history(records_in_folder(folder_.path(missing))));
                }),
                HasSubstr("is not a folder that can be read"));
    EXPECT_THROW(static_cast<void>(read_records(records_in_folder(folder_.path(missing)))),
                 DataError);
  }
}

TEST_F(HistoryOfFolder, TellsLimitsItDoesNotHoldFromUnknownOnes) {
  put({quiet_years[0], quiet_years[1]});
  static_cast<void>(read(Limits{.limits = {{.parameter = "x.bias", .high = 1.0},
                                           {.parameter = "y.residual_sd", .high = 1.0},
                                           {.parameter = "levelness.x", .high = 1.0}}}));
  EXPECT_THAT(not_held_, ElementsAre("y.residual_sd", "levelness.x"));
  EXPECT_THAT(test::complaint_of<DomainError>([&] {
                static_cast<void>(read(Limits{.limits = {{.parameter = "w.bias", .high = 1.0}}}));
              }),
              HasSubstr("limit 'w.bias': a history contains only biases and sensitivities"));
  // In an empty folder no axes are known, so every name is accepted.
  const test::ScratchFolder empty;
  EXPECT_TRUE(read_history(records_in_folder(empty.path("")),
                           Limits{.limits = {{.parameter = "w.bias", .high = 1.0}}})
                  .empty());
}

TEST_F(HistoryOfFolder, NeedsADateInEachRecord) {
  Calibration record = dated_record("A-1", {"", 0.1});
  record.provenance.created.clear();
  folder_.write("undated.json", calibration_json(record));
  EXPECT_THAT(test::complaint_of<DataError>([&] { static_cast<void>(read()); }),
              HasSubstr("is not a date; the history needs the date of the calibration"));
}

TEST_F(HistoryOfFolder, IsWrittenAsJson) {
  put(quiet_years);
  put({{"2022-01-01", 0.5}}, "B-2");
  const std::vector<UnitHistory> units =
      read(Limits{.limits = {{.parameter = "x.bias", .high = 0.19}}});
  const auto json = nlohmann::json::parse(history_json(units));
  ASSERT_EQ(json.size(), 2U);
  EXPECT_EQ(json[0].at("serial"), "A-1");
  EXPECT_EQ(json[0].at("records").size(), 5U);
  const nlohmann::json& first = json[0].at("trends")[0];
  EXPECT_EQ(first.at("values")[4], 0.1422);
  EXPECT_EQ(first.at("meets_limit_on"), units[0].trends[0].meets_limit_on);
  EXPECT_EQ(first.at("outside"), false);
  const nlohmann::json& single = json[1].at("trends")[0];
  EXPECT_TRUE(single.at("slope_per_year").is_null());
  EXPECT_TRUE(single.at("p_value").is_null());
  EXPECT_EQ(single.at("outside"), true);
  EXPECT_FALSE(single.contains("meets_limit_on"));
}

// The scatters within the units of one model are pooled, weighted by their degrees of freedom.
TEST(ProcessOfRecords, PoolsMeanSquaresByTheirDegreesOfFreedom) {
  const auto record_with = [](const std::string& serial, int number, double bias) {
    Calibration record = dated_record(serial, {"2020-01-01", bias});
    record.fit.conditions = {};
    record.provenance.inputs = {{.path = "r", .sha256 = serial + std::to_string(number)}};
    record.sensor.instrument.model = "M";
    return record;
  };
  std::vector<Calibration> records = {record_with("A", 1, 0.10), record_with("A", 2, 0.14),
                                      record_with("A", 3, 0.12), record_with("B", 1, 0.50),
                                      record_with("C", 1, 0.90)};
  records[4].fit.conditions.block_mean_square = Eigen::Vector3d::Constant(1e-3);
  records[4].fit.conditions.block_degrees_of_freedom = 4.0;
  const Instrument unit = records.front().sensor.instrument;
  const ProcessScatter scatter = process_scatter(records, unit).value();
  // Unit A has the variance 0.02^2 with two degrees of freedom. Unit B has one record and
  // contributes nothing.
  EXPECT_NEAR(scatter.mean_square(0), (8e-4 + 4.0 * 1e-3) / 6.0, 1e-12);
  EXPECT_EQ(scatter.degrees_of_freedom, 6.0);
  EXPECT_EQ(scatter.records, 4);
  // A second record of the same readings and a refused record are ignored.
  records.push_back(record_with("A", 3, 0.12));
  records.push_back(record_with("A", 4, 0.99));
  records.back().findings.status = CalibrationStatus::refused;
  EXPECT_EQ(process_scatter(records, unit)->records, 4);
  EXPECT_NEAR(process_scatter(records, unit)->mean_square(0), scatter.mean_square(0), 1e-15);
  EXPECT_FALSE(process_scatter({records[3]}, unit));
}

}  // namespace
}  // namespace axiscal
