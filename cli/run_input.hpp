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

/// Reads the files with the experiment's observations. Each file is read only once.
/// @return one run per file, in the order of the files.
/// @param reading              options for reading the tables.
/// @param beside               columns of a second instrument that was recorded at the same time.
/// @param observations_beside  receives the observations of the second instrument.
/// @throws DataError  if the content of a file is invalid.
[[nodiscard]] std::vector<Run> read_files(const ExperimentFile& experiment,
                                          Units units = Units::one,
                                          const TableReading& reading = {},
                                          const std::optional<ObservationColumns>& beside = {},
                                          Observations* observations_beside = nullptr);

/// Reads the files like read_files(), and joins them to one run. Each file becomes a block of that
/// run.
[[nodiscard]] Run read_run(const ExperimentFile& experiment,
                           Units units = Units::one,
                           const TableReading& reading = {});

/// @return the positioner with the mounts that --assembly states; unchanged without that option.
/// @throws UsageError  if mounts_of_assembly() throws it.
[[nodiscard]] Positioner with_assembly(const Positioner& positioner,
                                       const std::optional<std::string>& assembly,
                                       const std::vector<std::string>& slots);

/// Prints the notes and warnings of records to standard error. If there are several records,
/// each warning begins with its slot.
void print_remarks(const std::vector<Calibration>& calibrations);

}  // namespace axiscal::cli
