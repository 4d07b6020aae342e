// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "calib/calibrate/src/prepared_run.hpp"

namespace axiscal {

/// The first readings of each laying of the cube, if the instrument had not settled yet.
struct UnsettledReadings {
  std::vector<std::size_t> rows;
  CalibrationWarning warning;
};

/// Finds readings at the start of each laying that differ from the later ones. A laying is a series
/// of consecutive readings in one pose. For each laying, the test computes two differences: the
/// first reading minus the mean of the others, and the last reading minus the mean of the others.
/// Noise and drift have the same effect on both differences, so larger first differences show that
/// the instrument had not settled (docs/method/settling.md).
///
/// Only layings of at least four readings are used. The readings need design points.
/// @return nullopt if the readings had settled, or if there are too few layings for the test.
[[nodiscard]] std::optional<UnsettledReadings> find_unsettled(const PreparedRun& run);

}  // namespace axiscal
