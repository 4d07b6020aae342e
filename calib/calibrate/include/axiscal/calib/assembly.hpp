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

/// Parts the readings of several instruments.
///
/// @param run  its responses are the axes of the first slot, then those of the second, ...
/// @throws DomainError  if the list of slots is empty, or if the number of responses differs from
///         the number of axes.
[[nodiscard]] AXISCAL_EXPORT std::vector<SlotObservations> split_by_slot(const Run& run);

/// The orientation of a slot's instrument in its positioner.
///
/// Mounts that characterize() wrote are those of its reference instruments, and hold for these
/// alone: they must be asked for by name.
///
/// @param slot  its name, or empty where none is stated.
/// @return the rotation of the positioner's mount with that name. If a name is not stated, it is
///         the rotation of the only mount, unless that mount belongs to a reference; otherwise 1.
/// @throws SetupError  if the positioner has mounts, but none for the slot.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d mount_rotation(const Positioner& positioner,
                                                            const std::string& slot);

/// @return true if the slot's mount belongs to an instrument that the positioner was measured with.
[[nodiscard]] AXISCAL_EXPORT bool is_of_reference(const Positioner& positioner,
                                                  const std::string& slot);

/// The mounts of an assembly's slots.
///
/// @param assembly  "parallel", "single", "triple": as the cube; "h", "h:y": see h_shaped_mounts().
/// @throws DomainError  for another name, or one that does not suit the number of slots.
[[nodiscard]] AXISCAL_EXPORT std::vector<Mount> mounts_of_assembly(
    const std::string& assembly, const std::vector<std::string>& slots);

/// The levelness of one instrument of an assembly.
struct SlotLevelness {
  std::string slot;
  Levelness levelness;
};

/// The joint result of several instruments on one table for its levelness.
///
/// The slots' mounts do not affect the test: a slope follows from differences of readings, divided
/// by the sensitivity from the same readings. The test finds a loose instrument, a table that gives
/// way under one, or readings of other points. The slopes (those of the last block, if each block
/// has its own levelness) are weighted by 1 / variance. Each slot is compared with the mean of the
/// others, by F(2, nu) with both variances and their degrees of freedom, with Bonferroni's
/// correction over the slots. Below 0.001 the worst slot is named. If there are two slots, they
/// disagree with each other, and neither is named.
///
/// @param slots  two or more.
/// @throws DomainError  if there are fewer.
/// @par Source
/// method.md, section 9; beyond US 7,467,536.
[[nodiscard]] AXISCAL_EXPORT CombinedLevelness
combine_levelness(const std::vector<SlotLevelness>& slots);

/// The turns between the axes of one instrument and those of another. An instrument's frame is the
/// rotation closest to its axes' directions, so non-orthogonality turns the frame as little as
/// possible. An error of the cube turns both frames by the same amount and is not counted.
///
/// @param from, to  of instruments of three axes, calibrated in one cube.
/// @return the orientation of to's frame relative to that of `from`, with its uncertainty from the
///         scatter of both instruments.
/// @throws DomainError  for other than three axes.
/// @par Source
/// method.md, section 9.
[[nodiscard]] AXISCAL_EXPORT SlotAlignment alignment_of(const Calibration& from,
                                                        const Calibration& to);

/// @return the turn of the other's frame in addition to its quarter turns (and mirroring), as a
///         rotation vector [rad].
[[nodiscard]] AXISCAL_EXPORT Eigen::Vector3d turn_beside_quarters(const SlotAlignment& alignment);

/// Calibrates several instruments from one run: each in its slot, with its mount's rotation.
///
/// Instruments of several kinds (Experiment::slots) have each their own field, and share cube and
/// table: where some of them measure the table's slope and none is stated, the others, whose field
/// is known at the site, take it as known with its standard error.
///
/// @param experiment  of all slots; its slot and mount are set for each slot in turn, and also
///                    instrument and field if the kinds differ.
/// @param slots       the readings of each.
/// @return a calibration for each slot, in their order, with the levelness that those in one kind
///         of field say together, and the alignments with the others; a slot that disagrees with
///         the others about the table has a warning.
/// @throws SetupError, RefusedError  as calibrate(); the message starts with the slot.
[[nodiscard]] AXISCAL_EXPORT std::vector<Calibration> calibrate_assembly(
    const Experiment& experiment, const std::vector<SlotObservations>& slots);

}  // namespace axiscal
