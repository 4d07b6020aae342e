// SPDX-License-Identifier: Apache-2.0
#include "run_input.hpp"

#include <algorithm>
#include <iterator>
#include <set>

#include "axiscal/calib/assembly.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "column_advice.hpp"
#include "core/formatted.hpp"
#include "input.hpp"
#include "summary.hpp"
#include "usage_error.hpp"

namespace axiscal::cli {

std::vector<Run> read_files(const ExperimentFile& experiment,
                            Units units,
                            const TableReading& reading,
                            const std::optional<ObservationColumns>& beside,
                            Observations* observations_beside) {
  if (experiment.paths.observations.empty()) {
    throw UsageError(
        "the files of the readings are missing: name them on the command line or in the "
        "experiment");
  }
  const ObservationColumns columns = observation_columns(experiment.experiment, units);
  std::vector<Run> files;
  std::vector<Observations> parts_beside;
  for (const std::string& path : experiment.paths.observations) {
    ObservationsFile file;
    try {
      file = read_observations_file(path, columns, beside, reading);
    } catch (const MissingColumnError& error) {
      const bool is_axis =
          std::find(columns.axes.begin(), columns.axes.end(), error.column()) != columns.axes.end();
      std::vector<std::string> there;
      std::copy_if(columns.axes.begin(), columns.axes.end(), std::back_inserter(there),
                   [&](const std::string& axis) {
                     return std::find(error.columns().begin(), error.columns().end(), axis) !=
                            error.columns().end();
                   });
      const std::string advice = is_axis ? column_advice(error, "--axes", "") : "";
      throw error.with(
          advice.empty() && is_axis && !there.empty()
              ? formatted("; if the instrument has no such axis, use --axes {}", joined(there, ","))
              : advice);
    }
    files.push_back(std::move(file.run));
    if (beside) {
      parts_beside.push_back(std::move(file.beside));
    }
  }
  if (beside && observations_beside != nullptr) {
    *observations_beside = concatenate(parts_beside);
  }
  return files;
}

Run read_run(const ExperimentFile& experiment, Units units, const TableReading& reading) {
  return join_runs(read_files(experiment, units, reading), units);
}

Positioner with_assembly(const Positioner& positioner,
                         const std::optional<std::string>& assembly,
                         const std::vector<std::string>& slots) {
  if (!assembly || (slots.empty() && !positioner.mounts().empty())) {
    return positioner;
  }
  try {
    return positioner.with_mounts(mounts_of_assembly(*assembly, slots));
  } catch (const DomainError& error) {
    throw UsageError("--assembly", error);
  }
}

void print_remarks(const std::vector<Calibration>& calibrations) {
  std::set<std::string> said;  // a note that several slots have in common is printed once
  for (const Calibration& calibration : calibrations) {
    const std::string slot = calibrations.size() > 1 && !calibration.provenance.slot.empty()
                                 ? formatted("slot {}: ", calibration.provenance.slot)
                                 : "";
    for (const CalibrationNote& note : calibration.findings.notes) {
      const bool in_summary = note.code == NoteCode::not_counted;
      if (!in_summary && said.insert(note.message).second) {
        print_remark("note", note.message);
      }
    }
    for (const CalibrationWarning& warning : calibration.findings.warnings) {
      if (said.insert(warning.message).second) {
        print_remark("warning",
                     (warning.code == WarningCode::slot_levelness ? "" : slot) + warning.message);
      }
    }
  }
}

}  // namespace axiscal::cli
