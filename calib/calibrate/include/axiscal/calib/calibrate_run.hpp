// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/run.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The treatment of readings that contradict each other.
enum class Suggestions {
  name,    ///< a warning describes the likeliest mistake
  accept,  ///< calibrate_with_suggestions() corrects the mistake; not possible for an assembly
};

/// @return the slot of a single instrument. If no slot is stated and the positioner has only one
///         mount, it is the slot of this mount, unless the mount belongs to a reference instrument.
///         It is empty if there is no such slot.
[[nodiscard]] AXISCAL_EXPORT std::string slot_of(const Experiment& experiment, const Run& run);

/// Calibrates each file of a run separately and compares the results, to check that all files are
/// from the same instrument. Two files agree if the magnitudes of the sensitivities differ by at
/// most 0.2 %, the angles between the axes by at most 5 mrad, and the biases by at most 5 % of the
/// full response. A larger difference is accepted if it is at most six standard errors. The mount
/// and the table's slope may change from file to file. A file is skipped if it does not determine a
/// calibration.
/// @throws RefusedError  if two files do not agree; the message names the two files and the
///                       difference.
AXISCAL_EXPORT void require_one_instrument(const Experiment& experiment, const Run& run);

/// Calibrates a run.
///
/// @param experiment  the experiment; its positioner contains the mounts. If Experiment::slot is
///                    empty, slot_of() gives the slot.
/// @return one record, or one record for each slot of an assembly. Each record contains the input
///         files' names and notes on assumptions about the mounts.
/// @throws SetupError  if a slot is stated although the columns name slots, or if `suggestions` is
///                     `accept` for an assembly. Other errors as in calibrate() and
///                     calibrate_assembly().
[[nodiscard]] AXISCAL_EXPORT std::vector<Calibration> calibrate_run(
    Experiment experiment, const Run& run, Suggestions suggestions = Suggestions::name);

}  // namespace axiscal
