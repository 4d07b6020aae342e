// SPDX-License-Identifier: Apache-2.0
// The statistics of a fleet: capability, control charts, retests, outliers, a prior from the batch.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "axiscal/report/fleet_report.hpp"

namespace axiscal {

/// The share count / of, with its 95 % Wilson score interval.
struct Share {
  std::size_t count = 0, of = 0;
  double low = 0.0, high = 1.0;

  [[nodiscard]] double value() const {
    return of == 0 ? 0.0 : static_cast<double>(count) / static_cast<double>(of);
  }
};

[[nodiscard]] Share share_of(std::size_t count, std::size_t of);

/// The tests of each unit, in the order of their dates.
struct FleetUnits {
  /// For each unit its tests; the last one is valid.
  std::vector<std::vector<const FleetTest*>> tests;

  [[nodiscard]] const FleetTest& last(std::size_t unit) const { return *tests[unit].back(); }
};

/// @return the units in the order of the dates of their last tests.
[[nodiscard]] FleetUnits units_of(const Fleet& fleet);

/// The capability of the process for one coefficient.
struct Capability {
  std::size_t units = 0;  ///< number of units that have a value of this coefficient
  double mean = 0.0;
  double sd = 0.0;  ///< standard deviation of all units
  /// Pooled standard deviation within the batches. If there is only one batch, it is computed from
  /// the differences of units that follow each other by date.
  double sd_within = 0.0;
  double ppk = 0.0;       ///< (distance of the mean to the nearer limit) / (3 sd); NaN: no limits
  double ppk_low = 0.0;   ///< lower end of the 95 % interval of ppk (Bissell 1990)
  double cpk = 0.0;       ///< the same ratio with sd_within instead of sd
  double median_u = 0.0;  ///< median of the units' standard uncertainties
  /// The same median if the batch is used as a prior (capability_of()); NaN if it cannot be used
  /// for every unit.
  double median_u_with_prior = 0.0;
  /// Lines of the control chart: the mean, and mean - 3 sd_within, mean + 3 sd_within.
  double center = 0.0, below = 0.0, above = 0.0;
  std::size_t outside = 0;  ///< number of units outside below .. above
};

/// Computes the capability of the process for one coefficient.
///
/// The distribution of a batch is a prior for the coefficient of each of its units. The prior
/// reduces the uncertainty u of a unit. Let s be Capability::sd_within, e the part of u that comes
/// from reading noise, and c the other part, so that u^2 = e^2 + c^2. The prior replaces e^2
/// by e^2 s^2 / (e^2 + s^2), and c stays the same. Because s includes the noise, the reduced
/// uncertainty is not too small. The prior is used only if every batch has at least 20 units. It is
/// not valid for a unit outside the distribution of its batch.
[[nodiscard]] Capability capability_of(const Fleet& fleet,
                                       const FleetUnits& units,
                                       std::size_t parameter);

/// A unit outside the distribution of its batch.
struct FleetOutlier {
  const FleetTest* test = nullptr;
  std::size_t parameter = 0;
  double z = 0.0;  ///< distance from the median of the batch in robust standard deviations
};

/// Finds the units outside the distributions of their batches. If there are no true outliers, the
/// probability that any unit is found for any parameter is about 1 % (Bonferroni). Batches of fewer
/// than eight units are joined to one batch.
/// @return the outliers, beginning with the largest |z|.
[[nodiscard]] std::vector<FleetOutlier> outliers_of(const Fleet& fleet, const FleetUnits& units);

/// The meaning of a retest.
enum class RetestKind {
  bad_test,  ///< first failed, then passed with other coefficients: the first test was wrong
  marginal,  ///< one passed, one failed, with the same coefficients: the unit is near a limit
  bad_unit,  ///< both tests failed, with the same coefficients
  unstable,  ///< the last test failed, with other coefficients than the first
  passed_both
};

[[nodiscard]] const char* name_of(RetestKind kind);

struct Retest {
  const FleetTest* first = nullptr;
  const FleetTest* last = nullptr;
  RetestKind kind = RetestKind::passed_both;
  double largest_z = 0.0;  ///< largest |change of a coefficient| / its uncertainty from noise
};

/// Compares the first and the last test of each unit with two tests or more. The coefficients of
/// the two tests differ if the change of some coefficient is significant. The significance level is
/// 1 % for all coefficients of a unit together, and the uncertainty of a change includes only the
/// noise of the readings. If one of the tests has no coefficients, the coefficients differ.
/// @return one element for each such unit.
[[nodiscard]] std::vector<Retest> retests_of(const FleetUnits& units);

/// The units of a station, an operator or a batch.
struct FleetGroup {
  std::string name;
  Share passed;
  /// For each parameter: mean of the group minus mean of all units, divided by the standard error
  /// of the group's mean.
  std::vector<double> z;
};

/// Groups the units by a member of their last tests.
/// @param member  the member: FleetTest::station, operated_by or batch.
/// @return the groups, sorted by name; empty if there are fewer than two.
/// @param capabilities  of each parameter, by capability_of().
[[nodiscard]] std::vector<FleetGroup> groups_of(const FleetUnits& units,
                                                const std::vector<Capability>& capabilities,
                                                const std::string FleetTest::*member);

}  // namespace axiscal
