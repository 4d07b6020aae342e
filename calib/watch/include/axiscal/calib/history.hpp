// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/limits.hpp"
#include "axiscal/calib/process_scatter.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// How one coefficient went over the years.
struct ParameterTrend {
  std::string parameter;
  std::vector<double> values;   ///< one for each record
  std::vector<double> u;        ///< their standard uncertainties; NaN where not stated
  double slope_per_year = 0.0;  ///< weighted line through them; NaN with fewer than two dates
  double slope_u_per_year = 0.0;
  double p_value = 1.0;  ///< probability of such a slope without a trend; NaN with fewer than three
  std::optional<double> low;  ///< the limits that were given
  std::optional<double> high;
  bool outside = false;        ///< the newest value does not meet its limits
  std::string meets_limit_on;  ///< date at which the line meets one; empty: never, or none given
  /// The first and last date at which it may, 95 %; empty: not known, or not within 100
  /// years.
  std::string meets_limit_from, meets_limit_until;
};

/// The records of one unit, the oldest first.
struct UnitHistory {
  std::string serial;
  std::vector<std::string> paths;
  std::vector<std::string> dates;  ///< of the calibrations: when the readings were taken
  std::vector<ParameterTrend> trends;
};

/// Texts that may be records, with their names for messages.
struct RecordTexts {
  std::vector<std::string> names;                      ///< n
  std::function<std::string(std::size_t place)> text;  ///< reads one of them; from 0 to n - 1
};

/// @return the files of a folder whose names end in .json.
/// @throws DataError  if the folder cannot be read.
[[nodiscard]] AXISCAL_EXPORT RecordTexts records_in_folder(const std::string& folder);

/// @return the lines of a text, one record each, as `calibrate --stream` writes them.
/// @param name  of the text, for messages.
[[nodiscard]] AXISCAL_EXPORT RecordTexts records_in_lines(const std::string& text,
                                                          const std::string& name);

/// Reads calibration records by serial number. Texts that are not records are passed over.
/// @param limits  for the dates at which tolerances will be met.
/// @param passed_over  receives the reasons why texts are not records; null: not needed.
/// @param not_held     receives the parameters of limits that a history does not contain, for
///                     example the residual sd; null: not needed.
/// @throws DomainError  for a limit of a parameter that no record has.
[[nodiscard]] std::vector<UnitHistory> read_history(const RecordTexts& records,
                                                    const std::optional<Limits>& limits = {},
                                                    std::vector<std::string>* passed_over = nullptr,
                                                    std::vector<std::string>* not_held = nullptr);

/// @return the records, for process_scatter(); texts that are not records are passed over.
[[nodiscard]] AXISCAL_EXPORT std::vector<Calibration> read_records(const RecordTexts& records);

/// The change of an instrument's biases between blocks in earlier calibrations. It uses the records
/// of its serial number and, with a model, those of its model. A record of several blocks gives its
/// own mean square. If a unit's records have one block each, the scatter between the records
/// counts. Records of methods paired, joint and known count; if several records share readings,
/// only the first counts.
///
/// @param leave_out  digests (SHA-256) of files whose records do not count: those of the run
/// itself.
/// @return nullopt if earlier records do not show it.
/// @par Source
/// method.md, section 4; NIST/SEMATECH e-Handbook of Statistical Methods, 2.4.5.
[[nodiscard]] AXISCAL_EXPORT std::optional<ProcessScatter> process_scatter(
    const std::vector<Calibration>& records,
    const Instrument& instrument,
    const std::vector<InputFileDigest>& leave_out = {});

[[nodiscard]] AXISCAL_EXPORT std::string history_text(const UnitHistory& unit);
[[nodiscard]] AXISCAL_EXPORT std::string history_json(const std::vector<UnitHistory>& units);

}  // namespace axiscal
