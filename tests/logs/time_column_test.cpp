// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/time_column.hpp"

#include <cmath>

#include <gmock/gmock.h>

#include "axiscal/core/error.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

// @return 500 times at a rate, from `start_s` on, in units of `seconds_per_unit`.
std::vector<double> times(double rate_hz, double seconds_per_unit, double start_s = 0.0) {
  std::vector<double> all;
  for (int i = 0; i < 500; ++i) {
    all.push_back((start_s + i / rate_hz) / seconds_per_unit);
  }
  return all;
}

TimeUnit settled(const std::string& name, const std::vector<double>& all) {
  return settle_time_unit("log.csv", *find_time_column("log.csv", {name}, name), all);
}

TEST(TimeColumn, StatesItsUnitByItsName) {
  const auto find = [](const std::string& name) { return find_time_column("log.csv", {name}, ""); };
  EXPECT_FALSE(find("time")->unit_is_stated);
  EXPECT_EQ(find("Timestamp_MS")->seconds, 1e-3);
  EXPECT_EQ(find("t_usec")->seconds, 1e-6);
  EXPECT_TRUE(find("time_stamp_ns")->unit_is_stated);
  EXPECT_FALSE(find("temperature").has_value());
  EXPECT_THROW(static_cast<void>(find_time_column("log.csv", {"x"}, "t")), DataError);
}

TEST(TimeUnit, OfInertialLogsIsSeenFromTheRate) {
  struct Case {
    double rate_hz;
    double seconds;
    double start_s;
  };
  for (const Case& one : {Case{100.0, 1e-6, 0.0}, Case{50.0, 1e-3, 12.0}, Case{200.0, 1e-6, 3e3},
                          Case{100.0, 1e-3, 1.79e9}, Case{1000.0, 1e-6, 1.79e9},
                          Case{400.0, 1e-9, 1.79e9}, Case{1000.0, 1e-3, 1.79e9}}) {
    const TimeUnit unit = settled("time", times(one.rate_hz, one.seconds, one.start_s));
    EXPECT_EQ(unit.seconds, one.seconds) << one.rate_hz;
    EXPECT_THAT(unit.remark, HasSubstr("the times are assumed")) << one.rate_hz;
    EXPECT_THAT(unit.remark, HasSubstr("or give the rate"));
  }
  for (const double rate_hz : {0.6, 1.0, 50.0, 1e4, 9e5}) {
    EXPECT_EQ(settled("time", times(rate_hz, 1.0, 5.0)).seconds, 1.0);
    EXPECT_EQ(settled("time", times(rate_hz, 1.0, 5.0)).remark, "");
  }
  EXPECT_EQ(settled("time", times(100.0, 1.0, 1.79e9)).remark, "") << "seconds since 1970";
  EXPECT_EQ(settled("time", times(0.1, 1.0, 1.79e9)).seconds, 1.0) << "slow, since 1970";
}

TEST(TimeUnit, ThatIsNotClearIsRefused) {
  // Times that are plausible as milliseconds (1 Hz) and as microseconds (1 kHz), and times for
  // which no unit is plausible.
  for (const std::vector<double>& all : {times(1000.0, 1e-6), times(1e9, 1.0)}) {
    const std::string why =
        test::complaint_of<DataError>([&] { static_cast<void>(settled("time", all)); });
    EXPECT_THAT(why, HasSubstr("log.csv: column 'time': the unit of the times is not clear"));
    EXPECT_THAT(why, HasSubstr("time_us"));
  }
  EXPECT_EQ(settled("time_us", times(1000.0, 1e-6)).seconds, 1e-6);
}

TEST(TimeUnit, ThatIsStatedIsTakenAndDoubted) {
  const TimeUnit unit = settled("t_ms", times(100.0, 1e-6));
  EXPECT_EQ(unit.seconds, 1e-3);
  EXPECT_THAT(unit.remark, HasSubstr("0.1 Hz; is this unit right?"));
  EXPECT_EQ(settled("t_us", times(100.0, 1e-6)).remark, "");
}

TEST(UsualStep, LeavesGapsOut) {
  std::vector<double> all = times(100.0, 1.0);
  const std::vector<double> later = times(100.0, 1.0, 900.0);
  all.insert(all.end(), later.begin(), later.end());
  EXPECT_NEAR(usual_step(all), 0.01, 1e-12);
  EXPECT_TRUE(std::isnan(usual_step(std::vector<double>{3.0, 2.0, 1.0})));
}

}  // namespace
}  // namespace axiscal
