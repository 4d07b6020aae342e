// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace axiscal {

/// One test of an instrument (unit).
struct FleetTest {
  std::string serial, date;                 ///< date in ISO 8601
  std::string station, operated_by, batch;  ///< empty if unknown
  std::string reason;                       ///< reason why the unit did not pass
  bool passed = true;
  /// For each parameter of the fleet: the value, the standard uncertainty u of the value, and the
  /// part of u that comes from reading noise. An unknown number is NaN. The lists are empty if the
  /// test gave no record.
  std::vector<double> values, u, u_noise;
};

/// A coefficient that is compared between the units, with its limits.
struct FleetParameter {
  std::string name;                 ///< for example "x.bias"
  std::optional<double> low, high;  ///< limits, in the unit of the coefficient
};

/// The tests of many units of one kind.
struct Fleet {
  std::string kind, model;  ///< model may be empty
  std::string source;       ///< name of the store, for the title
  std::vector<FleetParameter> parameters;
  std::vector<FleetTest> tests;
};

/// Writes a page about the tests of a production line. It shows the yield, the reasons for failure,
/// the capability of each coefficient, control charts by time, station, operator and batch, the
/// retests, and the units outside the distribution of their batch. The page does not load other
/// files. Its size hardly depends on the number of units.
///
/// @return an HTML page, UTF-8.
/// @throws DomainError  if `tests` is empty, or if the number of values of a test differs from the
///                      number of parameters.
[[nodiscard]] std::string fleet_report(const Fleet& fleet);

}  // namespace axiscal
