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

/// The values of one coefficient over the years, with a straight line fitted to them.
struct ParameterTrend {
  std::string parameter;
  std::vector<double> values;   ///< one for each record
  std::vector<double> u;        ///< standard uncertainties of `values`; NaN if not stated
  double slope_per_year = 0.0;  ///< slope of the weighted line; NaN with fewer than two dates
  double slope_u_per_year = 0.0;
  /// Probability of such a slope without a trend; NaN with fewer than three records.
  double p_value = 1.0;
  std::optional<double> low;  ///< the stated limits
  std::optional<double> high;
  bool outside = false;        ///< true if the newest value is outside the limits
  std::string meets_limit_on;  ///< date at which the line crosses a limit; empty if it never does
  /// The 95 % interval of meets_limit_on. An end is empty if it is unknown or not within 100 years.
  std::string meets_limit_from, meets_limit_until;
};

/// The records of one unit (one serial number), the oldest first.
struct UnitHistory {
  std::string serial;
  std::vector<std::string> paths;
  std::vector<std::string> dates;  ///< date of the readings of each calibration
  std::vector<ParameterTrend> trends;
};

/// Texts that may be calibration records, each with a name for messages.
struct RecordTexts {
  std::vector<std::string> names;                      ///< names of the n texts
  std::function<std::string(std::size_t place)> text;  ///< returns text number `place`, 0 to n - 1
};

/// @return the files of a folder whose names end in .json.
/// @throws DataError  if the folder cannot be read.
[[nodiscard]] AXISCAL_EXPORT RecordTexts records_in_folder(const std::string& folder);

/// @return the lines of a text, one record each, as `calibrate --stream` writes them.
/// @param name  the name of the text, for messages.
[[nodiscard]] AXISCAL_EXPORT RecordTexts records_in_lines(const std::string& text,
                                                          const std::string& name);

/// Reads calibration records and sorts them by serial number. Texts that are not records are
/// ignored.
/// @param limits       the limits for which the dates of crossing are computed.
/// @param passed_over  receives, for each text that is not a record, the reason why it is not one;
///                     may be null.
/// @param not_held     receives the names of parameters that have limits but that no history
///                     contains, for example the residual sd; may be null.
/// @throws DomainError  if `limits` names a parameter that no record can contain.
[[nodiscard]] std::vector<UnitHistory> read_history(const RecordTexts& records,
                                                    const std::optional<Limits>& limits = {},
                                                    std::vector<std::string>* passed_over = nullptr,
                                                    std::vector<std::string>* not_held = nullptr);

/// @return the records, for process_scatter(). Texts that are not records are ignored.
[[nodiscard]] AXISCAL_EXPORT std::vector<Calibration> read_records(const RecordTexts& records);

/// Estimates, from earlier calibrations, how much an instrument's biases scatter between blocks.
/// Only calibrations with the instrument's serial number are used, or with the instrument's model
/// if the model is stated.
/// A record of several blocks contributes its mean square between blocks. Records of one block
/// contribute the scatter of their biases about the unit's mean. Only records of methods that use
/// labelled poses are used. If several records share readings, only the first is used.
///
/// @param leave_out  the SHA-256 digests of the files of this run; records of these files are not
///                   used.
/// @return nullopt if the earlier records do not determine the scatter.
/// @par Source
/// method.md, section 4; NIST/SEMATECH e-Handbook of Statistical Methods, 2.4.5.
[[nodiscard]] AXISCAL_EXPORT std::optional<ProcessScatter> process_scatter(
    const std::vector<Calibration>& records,
    const Instrument& instrument,
    const std::vector<InputFileDigest>& leave_out = {});

[[nodiscard]] AXISCAL_EXPORT std::string history_text(const UnitHistory& unit);
[[nodiscard]] AXISCAL_EXPORT std::string history_json(const std::vector<UnitHistory>& units);

}  // namespace axiscal
