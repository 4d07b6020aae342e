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
/// @param csv      the table, positioned behind its header.
/// @param wanted   what it must have; more is read where it is there.
/// @throws DataError  `PATH:LINE: column 'x': ...` for a missing column, an unknown face, a cell
///         that is not a finite number, a ragged row and similar defects.
[[nodiscard]] AXISCAL_EXPORT Run read_observations(CsvReader& csv,
                                                   const ObservationColumns& wanted);

/// @return true if a column states the pose or the field of a reading: rest, fx, pitch_deg, angle,
///         rate, ...
[[nodiscard]] AXISCAL_EXPORT bool is_label_of_pose(std::string_view name);

/// @return the columns of a table without a pose or a field: its axes, or another program's
///         columns.
[[nodiscard]] AXISCAL_EXPORT std::vector<std::string> unknown_columns(
    const std::vector<std::string>& header);

/// Reads a design or run sheet: columns `rest`, `fence` and, if it exists, `level`.
/// @throws DataError  as read_observations().
[[nodiscard]] AXISCAL_EXPORT std::vector<DesignEntry> read_design(CsvReader& csv);

/// Reads a run sheet as run_sheet_csv() writes it: as read_design(), and where they are there
/// `run`, `block` and `temperature`; runs are else numbered from 1.
/// @throws DataError  as read_observations().
[[nodiscard]] AXISCAL_EXPORT std::vector<RunSheetRow> read_run_sheet(CsvReader& csv);

/// @return the planned data of the readings of a sheet.
[[nodiscard]] AXISCAL_EXPORT std::vector<Reading> readings_of(
    const std::vector<RunSheetRow>& sheet);

/// @param axes  of the instrument; empty: the sheet lacks columns for readings.
/// @return the sheet as CSV: `run,block,rest,fence[,level]`, with `level` if one differs from 1;
///         then an empty column for each axis, to be filled in, and `temperature`, empty if
///         temperatures are not planned. The filled sheet is the input of a calibration; its
///         temperature column may stay empty.
[[nodiscard]] AXISCAL_EXPORT std::string run_sheet_csv(const std::vector<RunSheetRow>& sheet,
                                                       const std::vector<std::string>& axes = {});

/// The content of a sheet for each step, without readings and temperatures.
struct RunSheetCells {
  std::vector<std::string> header;             ///< "run", "block", "rest", "fence", "level"
  std::vector<std::vector<std::string>> rows;  ///< one a step
};

[[nodiscard]] AXISCAL_EXPORT RunSheetCells run_sheet_cells(const std::vector<RunSheetRow>& sheet);

/// @return the observations as CSV: the sheet's columns (rest and fence where a reading has a
/// design
///         point) and one for each axis; `samples`, `AXIS_sd`
///         and `time` where they are known.
[[nodiscard]] AXISCAL_EXPORT std::string observations_csv(const Observations& observations,
                                                          const std::vector<std::string>& axes);

}  // namespace axiscal
