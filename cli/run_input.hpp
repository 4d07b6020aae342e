// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axiscal/calib/calibrate_run.hpp"
#include "axiscal/calib/experiment_json.hpp"
#include "axiscal/calib/run.hpp"
#include "input.hpp"

namespace axiscal::cli {

/// Reads the experiment's observations, each file once.
/// @return the files in their order.
/// @param reading  how their tables are read.
/// @param beside  columns of another instrument that was recorded at the same time, read in the
///                same pass.
/// @param observations_beside  receives the values of these columns.
/// @throws DataError  for their content.
[[nodiscard]] std::vector<Run> read_files(const ExperimentFile& experiment,
                                          Units units = Units::one,
                                          const TableReading& reading = {},
                                          const std::optional<ObservationColumns>& beside = {},
                                          Observations* observations_beside = nullptr);

/// The same joined into one run: several files are blocks.
[[nodiscard]] Run read_run(const ExperimentFile& experiment,
                           Units units = Units::one,
                           const TableReading& reading = {});

/// @return the positioner with the mounts of --assembly if that is given; otherwise with its own.
/// @throws UsageError  as mounts_of_assembly().
[[nodiscard]] Positioner with_assembly(const Positioner& positioner,
                                       const std::optional<std::string>& assembly,
                                       const std::vector<std::string>& slots);

/// Prints notes and warnings to standard error, each record's under its slot.
void print_remarks(const std::vector<Calibration>& calibrations);

}  // namespace axiscal::cli
