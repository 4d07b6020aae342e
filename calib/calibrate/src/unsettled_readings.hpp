// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "calib/calibrate/src/prepared_run.hpp"

namespace axiscal {

/// The first readings of the poses, before the instrument had settled.
struct UnsettledReadings {
  std::vector<std::size_t> rows;
  CalibrationWarning warning;
};

/// Finds readings at the start of each laying that differ from the later ones. The test compares
/// the first reading of a laying less the mean of the others with the last one less the mean of the
/// others; noise and drifts make both alike (docs/method/settling.md).
///
/// Layings of at least four consecutive readings count. Readings need design points.
/// @return nullopt if the readings had settled, or if there are too few layings to tell.
[[nodiscard]] std::optional<UnsettledReadings> find_unsettled(const PreparedRun& run);

}  // namespace axiscal
