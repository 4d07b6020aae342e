// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// @return the record as JSON (formats.md, Record); NaN is written as null.
/// @throws DomainError  if parse_calibration() would refuse it, for example a coefficient that is
///         not a number.
[[nodiscard]] AXISCAL_EXPORT std::string calibration_json(const Calibration& calibration);

/// @return a verdict as it stands in a record.
[[nodiscard]] AXISCAL_EXPORT std::string verdict_json(const Verdict& verdict);

/// Reads a record. A record written by calibration_json() is read and written again without a
/// change.
///
/// Needed are `format`, `version`, `instrument.kind`, `.axes`, `.unit`, `field.kind`, `.unit`,
/// `.magnitude` and `coefficients`; the rest is optional, unknown keys are passed over.
///
/// @param path  the file's name for messages.
/// @throws DataError  if the text is no such record, or one that this version cannot use whole
///                    (a later version, temperature terms).
[[nodiscard]] AXISCAL_EXPORT Calibration parse_calibration(std::string_view text,
                                                           const std::string& path);

/// Writes a record's file. An existing file is replaced in one step or not at all.
/// @throws RefusedError  if the calibration was refused and `force` is `no`.
/// @throws OutputError   if it cannot be written; DomainError as calibration_json().
AXISCAL_EXPORT void write(const Calibration& calibration,
                          const std::string& path,
                          Force force = Force::no);

/// As parse_calibration(), from a file; `-` is standard input.
[[nodiscard]] AXISCAL_EXPORT Calibration read_calibration(const std::string& path);

}  // namespace axiscal
