// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/calib/run.hpp"

namespace axiscal {

/// The readings of one instrument of an assembly.
struct SlotObservations {
  std::string slot;
  Observations observations;
};

/// Parts the readings of several instruments.
///
/// @param run  its responses are the axes of the first slot, then those of the second, ...
/// @throws DomainError  if there are no slots, or the responses are not as many as their axes.
[[nodiscard]] std::vector<SlotObservations> split_by_slot(const Run& run);

/// How the instrument of a slot sits in its positioner.
///
/// Mounts that characterize() wrote are those of its reference instruments, and hold for these
/// alone: they must be asked for by name.
///
/// @param slot  its name, or empty where none is stated.
/// @return the rotation of the positioner's mount of that name; where none is stated that of
///         its only mount, unless it is a reference's; else 1.
/// @throws SetupError  if the positioner has mounts, but none for the slot.
[[nodiscard]] Eigen::Matrix3d mount_rotation(const Positioner& positioner, const std::string& slot);

/// @return whether the slot's mount is that of an instrument that the positioner was measured with.
[[nodiscard]] bool is_of_reference(const Positioner& positioner, const std::string& slot);

/// The mounts of an assembly's slots.
///
/// @param assembly  "parallel", "single", "triple": as the cube; "h", "h:y": see h_shaped_mounts().
/// @throws DomainError  for another name, or one that does not suit the number of slots.
[[nodiscard]] std::vector<Mount> mounts_of_assembly(const std::string& assembly,
                                                    const std::vector<std::string>& slots);

/// The levelness of one instrument of an assembly.
struct SlotLevelness {
  std::string slot;
  Levelness levelness;
};

/// What several instruments on one table say of its levelness together.
///
/// The slots' own mounts do not matter to it: a slope follows from differences of readings with the
/// sensitivity that the same readings gave. What it sees is a loose instrument, a table that gives
/// way under one, readings of other points. The slopes (of the last block, where each has its own)
/// are weighted by 1 / variance. Each slot is held against the mean of the others, F(2, nu) with
/// both variances and their degrees of freedom, Bonferroni over the slots; below 0.001 the worst
/// one is named (of two, both disagree and neither is).
///
/// @param slots  two or more.
/// @throws DomainError  if there are fewer.
/// @par Source
/// method.md, section 9; beyond US 7,467,536.
[[nodiscard]] CombinedLevelness combine_levelness(const std::vector<SlotLevelness>& slots);

/// How the axes of one instrument are turned against those of another: each frame is the rotation
/// that comes nearest to its axes' directions, so that what is not square in an instrument turns
/// its frame by the least. What is not known of the cube turns both alike and is not counted.
///
/// @param from, to  of instruments of three axes, calibrated in one cube.
/// @return to's frame seen from that of `from`, with its uncertainty by the scatter of both.
/// @throws DomainError  for other than three axes.
/// @par Source
/// method.md, section 9.
[[nodiscard]] SlotAlignment alignment_of(const Calibration& from, const Calibration& to);

/// @return the turn of the other's frame beside its quarter turns (of a mirrored one), as a
/// rotation
///         vector [rad].
[[nodiscard]] Eigen::Vector3d turn_beside_quarters(const SlotAlignment& alignment);

/// Calibrates several instruments from one run: each in its slot, with its mount's rotation.
///
/// Instruments of several kinds (Experiment::slots) have each their own field, and share cube and
/// table: where some of them measure the table's slope and none is stated, the others, whose field
/// is known at the site, take it as known with its standard error.
///
/// @param experiment  of all of them; its slot and mount, and of several kinds instrument and
///                    field, are set for each in turn.
/// @param slots       the readings of each.
/// @return a calibration for each slot, in their order, with the levelness that those in one kind
///         of field say together, and the alignments with the others; a slot that disagrees with
///         the others about the table has a warning.
/// @throws SetupError, RefusedError  as calibrate(); the message starts with the slot.
[[nodiscard]] std::vector<Calibration> calibrate_assembly(
    const Experiment& experiment, const std::vector<SlotObservations>& slots);

}  // namespace axiscal
