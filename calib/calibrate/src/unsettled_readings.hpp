// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "calib/calibrate/src/prepared_run.hpp"

namespace axiscal {

/// The readings that were taken before the instrument had settled, just after the cube was laid
/// down.
struct UnsettledReadings {
  std::vector<std::size_t> rows;
  CalibrationWarning warning;
};

/// Tests whether the first readings after the cube is laid down differ from the later ones. A
/// laying is a series of consecutive readings in one pose. For each laying, two differences are
/// computed: the first reading minus the mean of the laying's other readings, and the last reading
/// minus the mean of the other readings. Noise and drift have the same effect on both differences.
/// If the first differences are larger, the instrument had not settled (docs/method/settling.md).
///
/// Only layings of at least four readings are used. The readings need design points.
/// @return nullopt if the instrument had settled, or if there are too few layings for the test.
[[nodiscard]] std::optional<UnsettledReadings> find_unsettled(const PreparedRun& run);

}  // namespace axiscal
