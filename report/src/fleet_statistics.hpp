// SPDX-License-Identifier: Apache-2.0
// Statistics of many units: capability, control charts, retests, outliers, and the prior
// distribution of a coefficient from the batch.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "axiscal/report/fleet_report.hpp"

namespace axiscal {

/// A share count / of, with its Wilson score interval (95 %).
struct Share {
  std::size_t count = 0, of = 0;
  double low = 0.0, high = 1.0;

  [[nodiscard]] double value() const {
    return of == 0 ? 0.0 : static_cast<double>(count) / static_cast<double>(of);
  }
};

[[nodiscard]] Share share_of(std::size_t count, std::size_t of);

/// The tests of a fleet, grouped by unit.
struct FleetUnits {
  /// For each unit, its tests in the order of their dates. The last test decides the unit's result.
  std::vector<std::vector<const FleetTest*>> tests;

  [[nodiscard]] const FleetTest& last(std::size_t unit) const { return *tests[unit].back(); }
};

/// @return the units in the order of the dates of their last tests.
[[nodiscard]] FleetUnits units_of(const Fleet& fleet);

/// The capability of the process for one coefficient.
struct Capability {
  std::size_t units = 0;  ///< number of units that have a value of this coefficient
  double mean = 0.0;
  double sd = 0.0;  ///< standard deviation of the values of all units
  /// Pooled standard deviation within the batches. If there is only one batch, it is computed from
  /// the differences of units that follow each other by date.
  double sd_within = 0.0;
  double ppk = 0.0;       ///< (distance from the mean to the nearer limit) / (3 sd); NaN without
                          ///< limits
  double ppk_low = 0.0;   ///< lower end of the 95 % interval of ppk (Bissell 1990)
  double cpk = 0.0;       ///< ratio like ppk, with sd_within instead of sd
  double median_u = 0.0;  ///< median of the standard uncertainties of the units' values
  /// Median of the standard uncertainties if the distribution of the batch is used as a prior (see
  /// capability_of()). NaN if the prior cannot be used for every unit.
  double median_u_with_prior = 0.0;
  /// Lines of the control chart: mean, mean - 3 sd_within, and mean + 3 sd_within.
  double center = 0.0, below = 0.0, above = 0.0;
  std::size_t outside = 0;  ///< number of units that are not between below and above
};

/// Computes the capability of the process for one coefficient.
///
/// The distribution of a batch can serve as a prior distribution of the coefficient of each unit in
/// the batch. The prior reduces the uncertainty u of a unit. Let s be Capability::sd_within, e the
/// part of u that comes from reading noise, and c the other part, so that u^2 = e^2 + c^2. The
/// prior replaces e^2 by e^2 s^2 / (e^2 + s^2); c does not change. The reduced uncertainty is not
/// too small, because s includes the noise. The prior is used only if every batch has at least 20
/// units. It is not valid for a unit outside the distribution of its batch.
[[nodiscard]] Capability capability_of(const Fleet& fleet,
                                       const FleetUnits& units,
                                       std::size_t parameter);

/// A unit outside the distribution of its batch.
struct FleetOutlier {
  const FleetTest* test = nullptr;
  std::size_t parameter = 0;
  double z = 0.0;  ///< distance from the batch's median, in robust standard deviations
};

/// Finds the units outside the distributions of their batches. The probability of a false outlier
/// among all units and parameters is about 1 % (Bonferroni). Batches of fewer than eight units are
/// joined to one batch. If that batch has fewer than eight units, its units are not tested.
/// @return the outliers in the order of decreasing |z|.
[[nodiscard]] std::vector<FleetOutlier> outliers_of(const Fleet& fleet, const FleetUnits& units);

/// The conclusion from the first and the last test of a unit.
enum class RetestKind {
  bad_test,  ///< failed, then passed with other coefficients: the first test was wrong
  marginal,  ///< one test passed, one failed, with equal coefficients: the unit is near a limit
  bad_unit,  ///< both tests failed with equal coefficients
  unstable,  ///< the last test failed; its coefficients differ from those of the first
  passed_both
};

[[nodiscard]] const char* name_of(RetestKind kind);

struct Retest {
  const FleetTest* first = nullptr;
  const FleetTest* last = nullptr;
  RetestKind kind = RetestKind::passed_both;
  /// Largest |change of a coefficient|, divided by the standard uncertainty of the change due to
  /// reading noise.
  double largest_z = 0.0;
};

/// Compares the first and the last test of each unit that was tested at least twice. The
/// coefficients of the two tests are said to differ if the change of any coefficient is
/// significant. The significance level is 1 % for all coefficients of a unit together. The
/// uncertainty of a change includes only the noise of the readings. If one of the tests has no
/// coefficients, the coefficients are also said to differ.
/// @return one element for each unit that was tested at least twice.
[[nodiscard]] std::vector<Retest> retests_of(const FleetUnits& units);

/// A group of units that have the same station, operator or batch.
struct FleetGroup {
  std::string name;
  Share passed;
  /// For each parameter: (mean of the group - mean of all units) / standard error of the group's
  /// mean.
  std::vector<double> z;
};

/// Groups the units by the station, operator or batch of their last tests.
/// @param capabilities  results of capability_of(), one for each parameter.
/// @param member        FleetTest::station, FleetTest::operated_by or FleetTest::batch.
/// @return the groups, sorted by name; empty if there are fewer than two.
[[nodiscard]] std::vector<FleetGroup> groups_of(const FleetUnits& units,
                                                const std::vector<Capability>& capabilities,
                                                const std::string FleetTest::*member);

}  // namespace axiscal
