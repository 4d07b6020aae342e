// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/calib/observations_csv.hpp"

namespace axiscal::cli {

/// What the files of a run say, and remarks on them.
struct Run {
  Observations observations;
  Observations observations_beside;  ///< of the columns asked for beside them; else empty
  std::vector<InputFileDigest> inputs;
  std::vector<std::string> notes;
  std::string serial;                ///< of the first reading
  std::vector<std::string> serials;  ///< of every reading; empty without such a column
  std::vector<std::string> slots;    ///< of an assembly, as in ObservationsTable
};

/// Whether the readings may be of more than one unit under test.
enum class Units { one, several };

/// Reads the experiment's observations, each file once; several files are blocks.
/// @param beside  columns of another instrument that was recorded together, read in the same pass.
/// @throws DataError  for their content.
[[nodiscard]] Run read_run(const Experiment& experiment,
                           Units units = Units::one,
                           const std::optional<ObservationColumns>& beside = {});

/// The mounts of an assembly's slots.
/// @param assembly  "parallel", "single", "triple": as the cube; "h", "h:y": see h_shaped_mounts().
/// @throws UsageError  for another name, or one that does not suit the number of slots.
[[nodiscard]] std::vector<Mount> mounts_of_assembly(const std::string& assembly,
                                                    const std::vector<std::string>& slots);

/// @return the slot of a single instrument: the stated one, or that of the positioner's only mount
///         (not of a reference instrument); empty where there is none, or columns state slots.
[[nodiscard]] std::string slot_of(const Experiment& experiment, const Run& run);

/// Calibrates what was read: one record, or one for each slot of an assembly.
///
/// @param assembly  as mounts_of_assembly(), instead of the positioner's mounts; empty for those.
/// @param accept_suggestion  as calibrate_with_suggestions().
[[nodiscard]] std::vector<Calibration> calibrate_run(Experiment experiment,
                                                     const Run& run,
                                                     const std::string& assembly,
                                                     bool accept_suggestion = false);

/// @return whether the readings are of more than one unit under test.
[[nodiscard]] bool has_several_units(const Run& run);

/// @return the readings of each unit, in the order in which they first come; without a column
///         `serial` all are of one unit, of the serial that was stated.
[[nodiscard]] std::vector<Run> split_by_serial(const Run& run, const std::string& stated_serial);

/// Prints notes and warnings to standard error, each record's under its slot.
void print_remarks(const std::vector<Calibration>& calibrations);

}  // namespace axiscal::cli
