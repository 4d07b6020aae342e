// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "axiscal/calib/observations.hpp"
#include "axiscal/calib/run.hpp"
#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/instruments/instrument.hpp"
#include "axiscal/positioner/design.hpp"

namespace axiscal {

/// Reads observations (formats.md, Observations).
///
/// @param csv      the table, positioned after its header.
/// @param wanted   the required columns; optional columns are read if they exist.
/// @throws DataError  `PATH:LINE: column 'x': ...` for a missing column, an unknown face, a cell
///         that is not a finite number, a ragged row and similar defects.
[[nodiscard]] AXISCAL_EXPORT Run read_observations(CsvReader& csv,
                                                   const ObservationColumns& wanted);

/// @return true if a column of this name states the pose or the field of a reading, for example
///         `rest`, `fx`, `pitch_deg`, `angle` or `rate`.
[[nodiscard]] AXISCAL_EXPORT bool is_label_of_pose(std::string_view name);

/// @return the columns whose names have no standard meaning: the axes, or columns of another
///         program.
[[nodiscard]] AXISCAL_EXPORT std::vector<std::string> unknown_columns(
    const std::vector<std::string>& header);

/// Reads a design or run sheet: columns `rest`, `fence` and, if it exists, `level`.
/// @throws DataError  as read_observations().
[[nodiscard]] AXISCAL_EXPORT std::vector<DesignEntry> read_design(CsvReader& csv);

/// Reads a run sheet that run_sheet_csv() wrote: the columns of read_design(), and `run`, `block`
/// and `temperature` if they exist. Without a column `run`, readings are numbered from 1.
/// @throws DataError  as read_observations().
[[nodiscard]] AXISCAL_EXPORT std::vector<RunSheetRow> read_run_sheet(CsvReader& csv);

/// @return the readings that a sheet plans: run, block, design point, level and temperature.
[[nodiscard]] AXISCAL_EXPORT std::vector<Reading> readings_of(
    const std::vector<RunSheetRow>& sheet);

/// @param axes  names of the instrument's axes; empty: the sheet lacks columns for readings.
/// @return the sheet as CSV: the columns `run,block,rest,fence`, `level` if a level differs from 1,
///         an empty column for each axis, and `temperature`, which is empty if temperatures are not
///         planned. The filled sheet is the input of a calibration; its column `temperature` may
///         stay empty.
[[nodiscard]] AXISCAL_EXPORT std::string run_sheet_csv(const std::vector<RunSheetRow>& sheet,
                                                       const std::vector<std::string>& axes = {});

/// The cells of a run sheet, without readings and temperatures.
struct RunSheetCells {
  std::vector<std::string> header;             ///< "run", "block", "rest", "fence", "level"
  std::vector<std::vector<std::string>> rows;  ///< one row for each step
};

[[nodiscard]] AXISCAL_EXPORT RunSheetCells run_sheet_cells(const std::vector<RunSheetRow>& sheet);

/// @return the observations as CSV: the columns of a run sheet, and one column for each axis.
///         `rest` and `fence` are included if a reading has a design point; `samples`, `AXIS_sd`
///         and `time` are included if they are known.
[[nodiscard]] AXISCAL_EXPORT std::string observations_csv(const Observations& observations,
                                                          const std::vector<std::string>& axes);

}  // namespace axiscal
