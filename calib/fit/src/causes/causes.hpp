// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/fit/cause.hpp"

namespace axiscal {

/// Returns the cause for errors that readings share. They come from uncertain input quantities and
/// from the seat of the cube.
[[nodiscard]] Cause inputs_and_seats_cause();

/// Returns the cause for rotations of the instrument from mount to mount.
[[nodiscard]] Cause mounts_cause();

/// Returns the cause for soaks (readings at one temperature level) that deviate from the
/// polynomials in temperature.
[[nodiscard]] Cause soaks_cause();

/// Returns the cause for readings whose rounding step is wider than their noise.
[[nodiscard]] Cause rounding_cause();

/// Returns the cause for errors that consecutive readings at one design point share, or that all
/// readings of a pose share.
[[nodiscard]] Cause poses_cause();

/// Returns the cause for biases that differ between blocks.
[[nodiscard]] Cause blocks_cause();

/// Returns the cause for sensitivities that differ between blocks.
[[nodiscard]] Cause block_sensitivities_cause();

/// Returns the cause for noise that differs between the directions along and across the field, and
/// for a field whose magnitude varies slowly.
[[nodiscard]] Cause field_scatter_cause();

/// Returns the cause for correlation of consecutive readings.
[[nodiscard]] Cause correlation_cause();

}  // namespace axiscal
