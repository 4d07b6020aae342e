// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/calib/run.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The readings of one instrument of an assembly.
struct SlotObservations {
  std::string slot;
  Observations observations;
};

/// Splits the readings of a run by slot.
///
/// @param run  a run whose response columns are the axes of the first slot, then those of the
///             second slot, and so on.
/// @throws DomainError  if the list of slots is empty, or if the number of responses differs from
///         the number of axes.
[[nodiscard]] AXISCAL_EXPORT std::vector<SlotObservations> split_by_slot(const Run& run);

/// Returns the orientation of a slot's instrument in the positioner.
///
/// A mount that characterize() wrote is valid only for the reference instrument that was used.
/// Therefore such a mount is used only if its slot is stated.
///
/// @param slot  name of the slot; empty if it is not stated.
/// @return the rotation of the positioner's mount for this slot. If `slot` is empty and the only
///         mount does not belong to a reference instrument, the rotation of this mount. Otherwise
///         the identity.
/// @throws SetupError  if the positioner has mounts, but lacks a mount for the slot.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d mount_rotation(const Positioner& positioner,
                                                            const std::string& slot);

/// @return true if the slot's mount belongs to a reference instrument of characterize().
[[nodiscard]] AXISCAL_EXPORT bool is_of_reference(const Positioner& positioner,
                                                  const std::string& slot);

/// Makes a mount for each slot of an assembly.
///
/// @param assembly  "parallel", "single" or "triple" if the axes of all instruments are parallel to
///                  the axes of the cube; "h" or "h:y" for an H-shaped frame, see
///                  h_shaped_mounts().
/// @throws DomainError  if the name is unknown, or if it does not suit the number of slots.
[[nodiscard]] AXISCAL_EXPORT std::vector<Mount> mounts_of_assembly(
    const std::string& assembly, const std::vector<std::string>& slots);

/// The slope of the table, estimated from the readings of one instrument of an assembly.
struct SlotLevelness {
  std::string slot;
  Levelness levelness;
};

/// Combines the slopes that several instruments measure on one table, and tests whether they agree.
///
/// The test detects a loose instrument, a table that bends under an instrument, or wrong design
/// points. The mounts do not affect it, because each slope is computed from differences of an
/// instrument's readings, divided by the sensitivity from the same readings. If each block has its
/// own slope, the slope of the last block is used. The mean of the slopes is weighted by the
/// inverse variances. Each slot's slope is compared with the mean of the other slots by an F(2, nu)
/// test. The variance of the difference is the sum of both variances, and nu follows from their
/// degrees of freedom. The smallest p-value is multiplied by the number of slots (Bonferroni). If
/// the result is below 0.001, the slot with the smallest p-value is the suspect. If there are only
/// two slots, no suspect is named.
///
/// @param slots  the slopes of two or more slots.
/// @throws DomainError  if there are fewer than two slots.
/// @par Source
/// method.md, section 9; beyond US 7,467,536.
[[nodiscard]] AXISCAL_EXPORT CombinedLevelness
combine_levelness(const std::vector<SlotLevelness>& slots);

/// Computes the rotation between the frames of two instruments. The frame of an instrument is the
/// orthogonal frame that is closest to the directions of the instrument's axes. An error of the
/// cube rotates both frames by the same angle, so the uncertainty does not include this error.
///
/// @param from, to  records of instruments with three axes that were calibrated in one cube.
/// @return the orientation of the frame of `to` relative to the frame of `from`, with its
///         uncertainty from the scatter of both instruments.
/// @throws DomainError  if an instrument does not have three axes.
/// @par Source
/// method.md, section 9.
[[nodiscard]] AXISCAL_EXPORT SlotAlignment alignment_of(const Calibration& from,
                                                        const Calibration& to);

/// @return the small rotation between the two frames, as a rotation vector [rad]. Rotations by
///         multiples of 90 degrees, and mirroring, are removed first. They are found by rounding
///         the entries of the rotation matrix to whole numbers.
[[nodiscard]] AXISCAL_EXPORT Eigen::Vector3d rotation_without_quarter_turns(
    const SlotAlignment& alignment);

/// Calibrates several instruments from one run. Each instrument is in its own slot of the cube. The
/// slot's mount states the rotation of the instrument in the cube.
///
/// If the instruments are of several kinds (Experiment::slots), each has its own field, and they
/// share the cube and the table. If the table's slope is not stated, the instruments in a vertical
/// field measure it. The other instruments use this slope with its standard error.
///
/// @param experiment  the experiment that all slots share. For the calibration of each slot,
///                    Experiment::slot and the mount are set to those of the slot. If
///                    Experiment::slots is not empty, the instrument and the field are set too.
/// @param slots       the readings of each slot.
/// @return a calibration for each slot, in the order of `slots`. It includes the combined levelness
///         of the slots and the alignments with the other slots. It has a warning if the slot and
///         the other slots measure different slopes of the table.
/// @throws SetupError, RefusedError  as calibrate(); the message starts with the slot.
[[nodiscard]] AXISCAL_EXPORT std::vector<Calibration> calibrate_assembly(
    const Experiment& experiment, const std::vector<SlotObservations>& slots);

}  // namespace axiscal
