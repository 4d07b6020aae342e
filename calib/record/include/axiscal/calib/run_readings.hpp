// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/calib/observations_csv.hpp"

namespace axiscal {

/// The readings of a run with what their files say of them: of one instrument, of the slots of an
/// assembly, or of many units one after another.
struct RunReadings {
  Observations observations;
  std::vector<InputFileDigest> inputs;
  std::vector<std::string> notes;
  std::string serial;                ///< the first reading's
  std::vector<std::string> serials;  ///< every reading's; empty without such a column
  std::vector<std::string> slots;    ///< an assembly's, as in ObservationsTable
};

/// Whether the readings may be of more than one unit under test.
enum class Units { one, several };

/// @return the columns that an experiment's files need.
[[nodiscard]] ObservationColumns observation_columns(const Experiment& experiment, Units units);

/// One file of a run.
struct RunFile {
  InputFileDigest digest;
  ObservationsTable table;
};

/// Joins the files of a run, one or more; several are blocks.
///
/// @throws DataError  if they are of other slots, or `serial` is missing from one where the others
///                    are of several units, or is not the same where only one unit is taken.
[[nodiscard]] RunReadings join_files(std::vector<RunFile> files, Units units);

/// @return whether the readings are of more than one unit under test.
[[nodiscard]] bool has_several_units(const RunReadings& run);

/// @return the readings of each unit, in the order in which they first come; without a column
///         `serial` all are of one unit, of the serial that was stated.
[[nodiscard]] std::vector<RunReadings> split_by_serial(const RunReadings& run,
                                                       const std::string& stated_serial);

}  // namespace axiscal
