// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/run_readings.hpp"

#include <algorithm>
#include <cstddef>
#include <unordered_map>

#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/number_text.hpp"

namespace axiscal {
namespace {

void check_same_unit(const RunReadings& run, const RunFile& file) {
  if (!run.serial.empty() && !file.table.serial.empty() && run.serial != file.table.serial) {
    throw DataError(file.digest.path, formatted("column 'serial': '{}', but an earlier file is of "
                                                "'{}'; one unit at a time is taken here",
                                                file.table.serial, run.serial));
  }
}

void note_ignored_columns(const RunFile& file, std::vector<std::string>& notes) {
  const std::vector<std::string>& ignored = file.table.ignored_columns;
  if (!ignored.empty()) {
    const bool one = ignored.size() == 1;
    notes.push_back(formatted("{}: {}{}{} ignored", file.digest.path, one ? "column " : "columns ",
                              joined(ignored), one ? " was" : " were"));
  }
}

}  // namespace

ObservationColumns observation_columns(const Experiment& experiment, Units units) {
  const Method method = experiment.method.value_or(Method::known);
  return {.axes = experiment.instrument.axes,
          .differences = experiment.instrument.differences,
          .range = experiment.instrument.range,
          .needs_labels = method == Method::paired || method == Method::joint,
          .needs_samples = experiment.weighting == Weighting::samples,
          .needs_temperature = experiment.temperature.order > 0 ||
                               experiment.temperature.automatic || method == Method::bias,
          .takes_several_units = units == Units::several,
          .needs_sd = experiment.weighting == Weighting::sd};
}

RunReadings join_files(std::vector<RunFile> files, Units units) {
  RunReadings run;
  std::vector<Observations> parts;
  std::string without_serial;  // a file without that column
  for (RunFile& file : files) {
    if (units == Units::one) {
      check_same_unit(run, file);
    }
    if (!parts.empty() && run.slots != file.table.slots) {
      throw DataError(file.digest.path, "the columns are of other slots than the first file's");
    }
    without_serial = file.table.serials.empty() ? file.digest.path : without_serial;
    run.slots = file.table.slots;
    run.serial = file.table.serial.empty() ? run.serial : file.table.serial;
    note_ignored_columns(file, run.notes);
    run.inputs.push_back(file.digest);
    run.serials.insert(run.serials.end(), file.table.serials.begin(), file.table.serials.end());
    parts.push_back(std::move(file.table.observations));
  }
  if (!without_serial.empty()) {
    if (has_several_units(run)) {
      throw DataError(without_serial,
                      "column 'serial' is missing: of which of the units are these readings?");
    }
    run.serials.clear();  // all are of the one unit
  }
  run.observations = concatenate(parts);
  return run;
}

bool has_several_units(const RunReadings& run) {
  return std::any_of(run.serials.begin(), run.serials.end(),
                     [&](const std::string& serial) { return serial != run.serials.front(); });
}

std::vector<RunReadings> split_by_serial(const RunReadings& run, const std::string& stated_serial) {
  if (run.serials.empty()) {
    RunReadings only = run;
    only.serial = stated_serial.empty() ? run.serial : stated_serial;
    return {only};
  }
  // Thousands of units in one file: each row is looked at once.
  std::vector<std::string> serials;  // in the order of the file
  std::unordered_map<std::string, std::vector<std::size_t>> rows;
  for (std::size_t i = 0; i < run.serials.size(); ++i) {
    std::vector<std::size_t>& own = rows[run.serials[i]];
    if (own.empty()) {
      serials.push_back(run.serials[i]);
    }
    own.push_back(i);
  }
  std::vector<RunReadings> units;
  for (const std::string& serial : serials) {
    const std::vector<std::size_t>& own = rows.at(serial);
    units.push_back({.observations = select_rows(run.observations, own),
                     .inputs = run.inputs,
                     .notes = run.notes,
                     .serial = serial,
                     .serials = std::vector<std::string>(own.size(), serial),
                     .slots = run.slots});
  }
  return units;
}

}  // namespace axiscal
