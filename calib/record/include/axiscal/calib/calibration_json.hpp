// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/core/json_layout.hpp"

namespace axiscal {

/// @return the record as JSON (formats.md, Record); NaN is written as null.
/// @throws DomainError  if the record could not be read again, for example because a coefficient
///         is NaN.
[[nodiscard]] AXISCAL_EXPORT std::string calibration_json(const Calibration& calibration,
                                                          JsonLayout layout = JsonLayout::lines);

/// @return a verdict as JSON, in the form that a record contains.
[[nodiscard]] AXISCAL_EXPORT std::string verdict_json(const Verdict& verdict);

/// Reads a record from its text. If calibration_json() wrote the text, calibration_json() of the
/// result gives the same text again.
///
/// The required keys are `format`, `version`, `coefficients`, in `instrument` the keys `kind`,
/// `axes` and `unit`, and in `field` the keys `kind`, `unit` and `magnitude`. All other keys are
/// optional. Unknown keys are ignored.
///
/// @param path  the file's name for messages.
/// @throws DataError  if the text is not a valid record, or if its format version is later than
///                    the versions that this library reads.
[[nodiscard]] AXISCAL_EXPORT Calibration parse_calibration(std::string_view text,
                                                           const std::string& path);

/// Writes a record file. If the writing fails, an existing file is unchanged.
/// @throws RefusedError  if the calibration was refused and `force` is `no`.
/// @throws OutputError   if the file cannot be written.
/// @throws DomainError   as calibration_json().
AXISCAL_EXPORT void write(const Calibration& calibration,
                          const std::string& path,
                          Force force = Force::no);

/// Reads a record from a file with parse_calibration(); `-` is standard input.
[[nodiscard]] AXISCAL_EXPORT Calibration read_calibration(const std::string& path);

}  // namespace axiscal
