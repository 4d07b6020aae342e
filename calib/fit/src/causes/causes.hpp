// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/fit/cause.hpp"

namespace axiscal {

/// Errors that readings share: uncertain inputs, and the seat of the cube.
[[nodiscard]] Cause inputs_and_seats_cause();

/// The turn of the instrument in each mount.
[[nodiscard]] Cause mounts_cause();

/// Soaks that do not lie on the polynomials over temperature.
[[nodiscard]] Cause soaks_cause();

/// Rounding steps of the readings that are wider than their noise.
[[nodiscard]] Cause rounding_cause();

/// Errors that the readings of a laying or of a pose share.
[[nodiscard]] Cause poses_cause();

/// Biases that differ from block to block.
[[nodiscard]] Cause blocks_cause();

/// Sensitivities that differ from block to block.
[[nodiscard]] Cause block_sensitivities_cause();

/// Noise that differs along the field and across it, and a field whose magnitude varies slowly.
[[nodiscard]] Cause field_scatter_cause();

/// Consecutive readings that are correlated.
[[nodiscard]] Cause correlation_cause();

}  // namespace axiscal
