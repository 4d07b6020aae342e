// SPDX-License-Identifier: Apache-2.0
// The statistics of a fleet: capability, control charts, retests, outliers, a prior from the batch.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "axiscal/report/fleet_report.hpp"

namespace axiscal {

/// A share with its 95 % interval by Wilson's score.
struct Share {
  std::size_t count = 0, of = 0;
  double low = 0.0, high = 1.0;

  [[nodiscard]] double value() const {
    return of == 0 ? 0.0 : static_cast<double>(count) / static_cast<double>(of);
  }
};

[[nodiscard]] Share share_of(std::size_t count, std::size_t of);

/// The tests of each unit, by date.
struct FleetUnits {
  std::vector<std::vector<const FleetTest*>> tests;  ///< n units; the last test is the valid one

  [[nodiscard]] const FleetTest& last(std::size_t unit) const { return *tests[unit].back(); }
};

/// @return the units in the order of the dates of their last tests.
[[nodiscard]] FleetUnits units_of(const Fleet& fleet);

/// The capability of the process for one coefficient.
struct Capability {
  std::size_t units = 0;  ///< that have a value
  double mean = 0.0;
  double sd = 0.0;         ///< of all units
  double sd_within = 0.0;  ///< within batches; by moving ranges if there is one batch only
  double ppk = 0.0;        ///< distance of the mean to the nearer limit, over 3 sd; NaN: no limits
  double ppk_low = 0.0;    ///< lower 95 % limit of ppk (Bissell 1990)
  double cpk = 0.0;        ///< as ppk, with sd_within
  double median_u = 0.0;   ///< standard uncertainty of one unit
  double median_u_with_prior = 0.0;               ///< NaN if a prior from the batch is not allowed
  double center = 0.0, below = 0.0, above = 0.0;  ///< of the control chart: mean +- 3 sd_within
  std::size_t outside = 0;                        ///< units outside the control limits
};

/// The units of a batch are a sample of its distribution, so the batch is a prior for each of them.
/// Let s be the standard deviation within the batch, e the part of u that comes from reading noise,
/// and c the part that all units share, with u^2 = e^2 + c^2. The prior replaces e^2 by
/// e^2 s^2 / (e^2 + s^2); c stays. s includes the noise, so the result is not too small. It needs
/// 20 units per batch, and does not apply to units outside the distribution.
[[nodiscard]] Capability capability_of(const Fleet& fleet,
                                       const FleetUnits& units,
                                       std::size_t parameter);

/// A unit outside the distribution of its batch.
struct FleetOutlier {
  const FleetTest* test = nullptr;
  std::size_t parameter = 0;
  double z = 0.0;  ///< distance from the median of the batch in robust standard deviations
};

/// @return the units outside their batch at 1 % for all units and parameters together (Bonferroni),
///         the farthest first. Batches of fewer than eight units are joined.
[[nodiscard]] std::vector<FleetOutlier> outliers_of(const Fleet& fleet, const FleetUnits& units);

/// The meaning of a retest.
enum class RetestKind {
  bad_test,  ///< failed, then passed with other coefficients: the first test was wrong
  marginal,  ///< failed, then passed with the same coefficients: the unit is near a limit
  bad_unit,  ///< failed twice with the same coefficients
  unstable,  ///< failed twice with different coefficients
  passed_both
};

[[nodiscard]] const char* name_of(RetestKind kind);

struct Retest {
  const FleetTest* first = nullptr;
  const FleetTest* last = nullptr;
  RetestKind kind = RetestKind::passed_both;
  double largest_z = 0.0;  ///< largest change of a coefficient over its standard uncertainty
};

/// @return the units with two tests or more: their first and their last test. Coefficients differ
///         if a change is significant at 1 % for all of them together; only the noise of the
///         readings counts in a change. A test without coefficients differs.
[[nodiscard]] std::vector<Retest> retests_of(const FleetUnits& units);

/// The units of a station, an operator or a batch.
struct FleetGroup {
  std::string name;
  Share passed;
  std::vector<double> z;  ///< of each parameter: mean of the group less that of all, over its sd
};

/// @param member  FleetTest::station, operated_by or batch.
/// @return the groups by name; empty if there are fewer than two.
[[nodiscard]] std::vector<FleetGroup> groups_of(const Fleet& fleet,
                                                const FleetUnits& units,
                                                const std::string FleetTest::*member);

}  // namespace axiscal
