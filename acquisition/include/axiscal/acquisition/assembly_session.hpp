// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/calib/run.hpp"

// A session treats several instruments in one cube as one instrument. Its axes are named SLOT.axis.
// One pose check therefore uses the readings of all instruments.
namespace axiscal {

/// @param experiment  an experiment with one instrument; its positioner contains the mounts of all
///                    slots.
/// @param slots       the names of two or more slots.
/// @return the joint experiment; its instrument has the axes of all slots.
[[nodiscard]] Experiment assembled(Experiment experiment, const std::vector<std::string>& slots);

/// @return the slots of an assembled instrument with their axes; empty for a single instrument.
[[nodiscard]] std::vector<SlotColumns> slots_of(const Instrument& instrument);

/// @return the nominal unit direction of each axis in the frame of the experiment's mount, m x 3,
///         rotated by the mount of the axis's slot; a row of zeros if the direction is unknown.
[[nodiscard]] SensitivityMatrix nominal_axes(const Experiment& experiment);

/// Calibrates one instrument, or each slot of an assembled instrument, from a session's readings.
/// @throws SetupError, RefusedError  if calibrate() or calibrate_assembly() throws it.
[[nodiscard]] std::vector<Calibration> calibrate_session(const Experiment& experiment,
                                                         const Observations& observations);

}  // namespace axiscal
