// SPDX-License-Identifier: Apache-2.0
// The page of a fleet: its statistics against numbers that were computed by hand or by simulation.
#include "axiscal/report/fleet_report.hpp"

#include <cmath>
#include <random>

#include "axiscal/core/error.hpp"
#include "matchers.hpp"
#include "report/src/fleet_statistics.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;
using testing::Not;

std::string date_of(int number) {
  return "2026-01-" + std::to_string(10 + number / 1000) +
         "T00:00:" + std::to_string(1000 + number % 1000);
}

FleetTest test_of(const std::string& serial, double value, double u = 0.1, double u_noise = 0.1) {
  static int number = 0;
  return {.serial = serial,
          .date = date_of(number++),
          .station = {},
          .operated_by = {},
          .batch = {},
          .reason = {},
          .values = {value},
          .u = {u},
          .u_noise = {u_noise}};
}

Fleet fleet_of(const std::vector<double>& values) {
  Fleet fleet{.kind = "accelerometer",
              .model = "M1",
              .source = "lab.db",
              .parameters = {{.name = "x.bias", .low = 0.0, .high = 10.0}},
              .tests = {}};
  for (const double value : values) {
    fleet.tests.push_back(test_of("u" + std::to_string(fleet.tests.size()), value));
  }
  return fleet;
}

TEST(FleetStatistics, CapabilityByHand) {
  const Fleet fleet = fleet_of({1.0, 2.0, 3.0, 4.0, 5.0});
  const Capability one = capability_of(fleet, units_of(fleet), 0);
  EXPECT_EQ(one.units, 5U);
  EXPECT_DOUBLE_EQ(one.mean, 3.0);
  EXPECT_NEAR(one.sd, std::sqrt(2.5), 1e-12);
  EXPECT_NEAR(one.sd_within, 1.0 / 1.128379, 1e-6);  // all moving ranges are 1
  EXPECT_NEAR(one.ppk, 3.0 / (3.0 * std::sqrt(2.5)), 1e-12);
  EXPECT_NEAR(one.cpk, 1.128379, 1e-5);
  EXPECT_LT(one.ppk_low, one.ppk);
  EXPECT_TRUE(std::isnan(one.median_u_with_prior));  // five units are not enough
}

TEST(FleetStatistics, BatchesHaveMeansOfTheirOwn) {
  Fleet fleet = fleet_of({1.0, 2.0, 3.0, 7.0, 8.0, 9.0});
  for (std::size_t i = 0; i < 6; ++i) {
    fleet.tests[i].batch = i < 3 ? "a" : "b";
  }
  EXPECT_NEAR(capability_of(fleet, units_of(fleet), 0).sd_within, 1.0, 1e-12);
  const FleetUnits units = units_of(fleet);
  const std::vector<Capability> capabilities = {capability_of(fleet, units, 0)};
  const std::vector<FleetGroup> groups = groups_of(units, capabilities, &FleetTest::batch);
  ASSERT_EQ(groups.size(), 2U);
  const double sd = std::sqrt((16.0 + 9.0 + 4.0 + 4.0 + 9.0 + 16.0) / 5.0);
  EXPECT_NEAR(groups[0].z[0], -3.0 * std::sqrt(3.0) / sd, 1e-12);
  EXPECT_TRUE(groups_of(units, capabilities, &FleetTest::station).empty());
}

TEST(FleetStatistics, SharesByWilson) {
  // Brown, Cai, DasGupta (2001): 10 of 10.
  const Share share = share_of(10, 10);
  EXPECT_NEAR(share.low, 0.7225, 1e-4);
  EXPECT_DOUBLE_EQ(share.high, 1.0);
  EXPECT_DOUBLE_EQ(share_of(0, 0).low, 0.0);
}

// The uncertainty with the batch as a prior is not smaller than the errors of the estimates that it
// belongs to, also if all units share an error.
TEST(FleetStatistics, APriorFromTheBatchIsHonest) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  constexpr double between = 0.5;
  constexpr double noise = 1.0;
  for (const double common : {0.0, 1.0}) {
    double squares = 0.0;
    double stated = 0.0;
    double without = 0.0;
    for (int batch = 0; batch < 200; ++batch) {
      const double shared = common * normal(random);
      std::vector<double> truth;
      Fleet fleet = fleet_of({});
      for (int unit = 0; unit < 40; ++unit) {
        truth.push_back(3.0 + between * normal(random));
        fleet.tests.push_back(test_of("u" + std::to_string(1000 + unit),
                                      truth.back() + shared + noise * normal(random),
                                      std::hypot(common, noise), noise));
      }
      const Capability one = capability_of(fleet, units_of(fleet), 0);
      const double shrink = std::min(1.0, noise * noise / (one.sd_within * one.sd_within));
      for (std::size_t i = 0; i < truth.size(); ++i) {
        const double value = fleet.tests[i].values[0];
        const double estimate = value - shrink * (value - one.mean);
        squares += (estimate - truth[i]) * (estimate - truth[i]);
        stated += one.median_u_with_prior * one.median_u_with_prior;
        without += one.median_u * one.median_u;
      }
    }
    EXPECT_LT(squares, 1.03 * stated) << common;
    EXPECT_LT(stated, 0.8 * without) << common;
  }
}

TEST(FleetStatistics, OutliersOfGoodFleetsAreRare) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  int false_alarms = 0;
  int found = 0;
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<double> values;
    for (int unit = 0; unit < 60; ++unit) {
      values.push_back(normal(random));
    }
    Fleet fleet = fleet_of(values);
    false_alarms += outliers_of(fleet, units_of(fleet)).empty() ? 0 : 1;
    fleet.tests[7].values[0] = 8.0;
    const std::vector<FleetOutlier> outliers = outliers_of(fleet, units_of(fleet));
    found += !outliers.empty() && outliers.front().test->serial == "u7" ? 1 : 0;
  }
  EXPECT_LE(false_alarms, 6);  // 1 % of 200, with its scatter
  EXPECT_GE(found, 190);
}

TEST(FleetStatistics, RetestsTellBadTestsFromBadUnits) {
  Fleet fleet = fleet_of({});
  const auto add = [&](const std::string& serial, double value, bool passed) {
    fleet.tests.push_back(test_of(serial, value));
    fleet.tests.back().passed = passed;
  };
  add("once", 1.0, true);
  add("bad test", 5.0, false);
  add("bad test", 1.0, true);
  add("bad unit", 5.0, false);
  add("bad unit", 5.05, false);
  add("marginal", 2.0, false);
  add("marginal", 2.05, true);
  add("unstable", 3.0, false);
  add("unstable", 9.0, false);
  add("no record", 0.0, false);
  fleet.tests.back().values.clear();
  fleet.tests.back().u.clear();
  fleet.tests.back().u_noise.clear();
  add("no record", 1.0, true);
  std::map<std::string, RetestKind> kinds;
  for (const Retest& one : retests_of(units_of(fleet))) {
    kinds[one.first->serial] = one.kind;
  }
  EXPECT_EQ(kinds.size(), 5U);
  EXPECT_EQ(kinds["bad test"], RetestKind::bad_test);
  EXPECT_EQ(kinds["bad unit"], RetestKind::bad_unit);
  EXPECT_EQ(kinds["marginal"], RetestKind::marginal);
  EXPECT_EQ(kinds["unstable"], RetestKind::unstable);
  EXPECT_EQ(kinds["no record"], RetestKind::bad_test);
}

TEST(FleetReport, ShowsAFleetOnAPageOfItsOwn) {
  Fleet fleet = fleet_of({1.0, 2.0, 3.0, 4.0, 12.0});
  fleet.tests.back().passed = false;
  fleet.tests.back().reason = "x.bias above 10 <b>";
  fleet.tests.back().serial = "<script>";
  const std::string page = fleet_report(fleet);
  for (const char* const part :
       {"Yield", "4 of 5 units, 80.0 %", "Reasons of failures", "Cpk", "x.bias by time"}) {
    EXPECT_THAT(page, HasSubstr(part));
  }
  EXPECT_THAT(page, HasSubstr("x.bias above 10 &lt;b&gt;"));
  EXPECT_THAT(page, Not(HasSubstr("above 10 <b>")));
  fleet.tests.front().values.push_back(1.0);
  EXPECT_THROW(static_cast<void>(fleet_report(fleet)), DomainError);
  EXPECT_THROW(static_cast<void>(fleet_report(Fleet{})), DomainError);
}

TEST(FleetReport, HundredThousandUnitsAreAtMostTwoMegabytes) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  Fleet fleet{
      .kind = "accelerometer", .model = {}, .source = "s.db", .parameters = {}, .tests = {}};
  for (int k = 0; k < 12; ++k) {
    fleet.parameters.push_back({.name = "p" + std::to_string(k), .low = -3.0, .high = 3.0});
  }
  for (int unit = 0; unit < 100000; ++unit) {
    FleetTest test{.serial = "S" + std::to_string(unit),
                   .date = date_of(unit / 100),
                   .station = "st" + std::to_string(unit % 5),
                   .operated_by = "op" + std::to_string(unit % 7),
                   .batch = "b" + std::to_string(unit / 100),
                   .reason = {}};
    for (int k = 0; k < 12; ++k) {
      test.values.push_back(normal(random));
      test.u.push_back(0.3);
      test.u_noise.push_back(0.2);
      if (std::abs(test.values.back()) > 3.0) {
        test.passed = false;
        test.reason = fleet.parameters[static_cast<std::size_t>(k)].name + " outside";
      }
    }
    fleet.tests.push_back(std::move(test));
  }
  EXPECT_LE(fleet_report(fleet).size(), 2000000U);
}

}  // namespace
}  // namespace axiscal
