// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations.hpp"
#include "calib/calibrate/src/fitted_run.hpp"
#include "calib/calibrate/src/prepared_run.hpp"

namespace axiscal {

/// A series of consecutive readings that are copies of earlier readings, for example because a
/// block of rows was pasted twice.
struct RepeatedReadings {
  /// For each copy, the rows of the original and of the copy; in the order of the copies.
  std::vector<std::pair<std::size_t, std::size_t>> rows;
};

/// Finds copies: readings in one pose that agree in every digit of every axis. They are reported if
/// noise and rounding would cause such an agreement by chance in fewer than 1 of 1,000 runs
/// (docs/method/repeats.md).
///
/// @param fit  the fit of the run; the noise is estimated from its residuals.
/// @return one entry for each series of consecutive copies; empty if there are none.
[[nodiscard]] std::vector<RepeatedReadings> find_repeats(const PreparedRun& run,
                                                         const FittedRun& fit);

/// @return the rows of the copies.
[[nodiscard]] std::vector<std::size_t> duplicate_rows(const std::vector<RepeatedReadings>& repeats);

/// @return one warning for each entry: "runs 13 to 24 repeat runs 1 to 12 ...".
[[nodiscard]] std::vector<CalibrationWarning> warnings_of(
    const std::vector<RepeatedReadings>& repeats, const Observations& observations);

}  // namespace axiscal
