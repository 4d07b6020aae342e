// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/fit/cause.hpp"

namespace axiscal {

/// Returns the cause "inputs_and_seats": errors that several readings share. They come from
/// uncertain input quantities and from the seat of the cube.
[[nodiscard]] Cause inputs_and_seats_cause();

/// Returns the cause "mounts": rotations of the instrument from mount to mount.
[[nodiscard]] Cause mounts_cause();

/// Returns the cause "soaks": deviations of soaks (readings at one temperature level) from the
/// polynomials in temperature.
[[nodiscard]] Cause soaks_cause();

/// Returns the cause "rounding": readings whose rounding step is wider than their noise.
[[nodiscard]] Cause rounding_cause();

/// Returns the cause "poses": errors that consecutive readings at one design point share, or that
/// all readings of a pose share.
[[nodiscard]] Cause poses_cause();

/// Returns the cause "blocks": biases that differ between blocks.
[[nodiscard]] Cause blocks_cause();

/// Returns the cause "block_sensitivities": sensitivities that differ between blocks.
[[nodiscard]] Cause block_sensitivities_cause();

/// Returns the cause "field_scatter": noise that differs between the directions along and across
/// the field, or a field whose magnitude varies slowly.
[[nodiscard]] Cause field_scatter_cause();

/// Returns the cause "correlation": correlation of consecutive readings.
[[nodiscard]] Cause correlation_cause();

}  // namespace axiscal
