// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/calib/run.hpp"

// A session of several instruments in one cube is that of one instrument with all their axes,
// called SLOT.axis: one pose check sees what each of them says.
namespace axiscal {

/// @param experiment  of one instrument; its positioner has the mounts of the slots.
/// @param slots       two or more.
/// @return the joint experiment: the axes of its instrument are those of all slots.
[[nodiscard]] Experiment assembled(Experiment experiment, const std::vector<std::string>& slots);

/// @return the slots of an assembled instrument with their axes; none for a single instrument.
[[nodiscard]] std::vector<SlotColumns> slots_of(const Instrument& instrument);

/// @return the nominal direction of each axis in the frame of the experiment's mount, m x 3: a
///         component, rotated by the mount of the slot; a row of zeros if it is unknown.
[[nodiscard]] SensitivityMatrix nominal_axes(const Experiment& experiment);

/// Calibrates what a session took: one instrument, or each slot of an assembled one.
/// @throws SetupError, RefusedError  as calibrate(), calibrate_assembly().
[[nodiscard]] std::vector<Calibration> calibrate_session(const Experiment& experiment,
                                                         const Observations& observations);

}  // namespace axiscal
