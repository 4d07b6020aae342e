// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/calib/run.hpp"

// A session treats several instruments in one cube as one instrument, so that one check of the pose
// uses the readings of all of them. The axes of this joint instrument are named SLOT.axis; a slot
// is the place of one instrument in the cube.
namespace axiscal {

/// @param experiment  an experiment with one instrument and a positioner that contains the mounts
///                    of all slots.
/// @param slots       the names of two or more slots.
/// @return the joint experiment; its instrument has the axes of all slots.
[[nodiscard]] Experiment assembled(Experiment experiment, const std::vector<std::string>& slots);

/// @return the slots of an assembled instrument with their axes; empty for a single instrument.
[[nodiscard]] std::vector<SlotColumns> slots_of(const Instrument& instrument);

/// @return the nominal unit directions of the m axes as rows, m x 3, in the frame of the
///         experiment's mount. In an assembled instrument, each direction is rotated by the mount
///         of its slot. If a direction is unknown, its row is zero.
[[nodiscard]] SensitivityMatrix nominal_axes(const Experiment& experiment);

/// Calibrates one instrument, or each slot of an assembled instrument, from a session's readings.
/// @throws SetupError, RefusedError  if calibrate() or calibrate_assembly() throws it.
[[nodiscard]] std::vector<Calibration> calibrate_session(const Experiment& experiment,
                                                         const Observations& observations);

}  // namespace axiscal
