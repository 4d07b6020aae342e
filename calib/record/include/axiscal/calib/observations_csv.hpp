// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "axiscal/calib/observations.hpp"
#include "axiscal/core/csv_reader.hpp"
#include "axiscal/instruments/instrument.hpp"
#include "axiscal/positioner/design.hpp"

namespace axiscal {

/// A table of observations as read.
struct ObservationsTable {
  Observations observations;
  std::string serial;  ///< the unit under test, of the first row, where a column states it
  std::vector<std::string> serials;          ///< every row's; empty without such a column
  std::vector<std::string> ignored_columns;  ///< columns that nothing was done with
  /// Where the columns are SLOT.axis: the slots in the columns' order; the responses are those of
  /// the first slot's axes, then the second's, ...
  std::vector<std::string> slots;
};

/// Which columns a table of observations must have.
struct ObservationColumns {
  /// The response columns; where the first is missing, SLOT.axis of one slot or more.
  std::vector<std::string> axes = {"x", "y", "z"};
  std::vector<DifferentialAxis> differences;  ///< axes that are the difference of two columns
  std::optional<ReadingRange> range;          ///< each of their columns'
  bool needs_labels = false;                  ///< `rest` and `fence`, even where the field is given
  bool needs_samples = false;                 ///< `samples`
  bool needs_temperature = false;             ///< `temperature`
  bool takes_several_units = false;           ///< else a second `serial` is an error
  bool needs_sd = false;                      ///< `AXIS_sd` for each axis, positive
};

/// Reads observations (formats.md, Observations).
///
/// @param csv      the table, positioned behind its header.
/// @param wanted   what it must have; more is read where it is there.
/// @throws DataError  `PATH:LINE: column 'x': ...` for a missing needed column, an unknown face, a
///                    cell that is no finite number, a ragged row and the like.
[[nodiscard]] ObservationsTable read_observations(CsvReader& csv, const ObservationColumns& wanted);

/// Reads a design or run sheet: columns `rest`, `fence` and, where it is there, `level`.
/// @throws DataError  as read_observations().
[[nodiscard]] std::vector<DesignEntry> read_design(CsvReader& csv);

/// Reads a run sheet as run_sheet_csv() writes it: as read_design(), and where they are there
/// `run`, `block` and `temperature`; runs are else numbered from 1.
/// @throws DataError  as read_observations().
[[nodiscard]] std::vector<RunSheetRow> read_run_sheet(CsvReader& csv);

/// @return what is known of the readings of a sheet before they are taken.
[[nodiscard]] std::vector<Reading> readings_of(const std::vector<RunSheetRow>& sheet);

/// @return the sheet as CSV: `run,block,rest,fence[,level][,temperature]`; `level` where one is not
///         1, `temperature` where one is planned.
[[nodiscard]] std::string run_sheet_csv(const std::vector<RunSheetRow>& sheet);

/// @return the observations as CSV: the sheet's columns and one for each axis; `samples`, `AXIS_sd`
///         and `time` where they are known.
[[nodiscard]] std::string observations_csv(const Observations& observations,
                                           const std::vector<std::string>& axes);

}  // namespace axiscal
