// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "commands.hpp"
#include "experiment_options.hpp"
#include "input.hpp"
#include "summary.hpp"

namespace axiscal::cli {
namespace {

ObservationColumns needed_columns(const Experiment& experiment) {
  return {.axes = experiment.instrument.axes,
          .needs_labels = experiment.method.value_or(Method::known) != Method::known,
          .needs_samples = experiment.weighting == Weighting::samples,
          .needs_sd = experiment.weighting == Weighting::sd};
}

// What was read, and remarks on it.
struct Run {
  Observations observations;
  std::vector<InputFileDigest> inputs;
  std::vector<std::string> notes;
  std::string serial;
};

Run read_run(const Experiment& experiment) {
  const ObservationColumns columns = needed_columns(experiment);
  Run run;
  std::vector<Observations> parts;
  for (const std::string& path : experiment.observations) {
    ObservationsFile file = read_observations_file(path, columns);
    if (!run.serial.empty() && !file.table.serial.empty() && run.serial != file.table.serial) {
      throw DataError(path, "column 'serial': '" + file.table.serial +
                                "', but an earlier file is "
                                "of '" +
                                run.serial + "'; calibrate one unit at a time");
    }
    run.serial = file.table.serial.empty() ? run.serial : file.table.serial;
    run.inputs.push_back({.path = path, .sha256 = file.sha256});
    const std::vector<std::string>& ignored = file.table.ignored_columns;
    if (!ignored.empty()) {
      run.notes.push_back(path + ": " + (ignored.size() == 1 ? "column " : "columns ") +
                          joined(ignored) + (ignored.size() == 1 ? " was" : " were") + " ignored");
    }
    parts.push_back(std::move(file.table.observations));
  }
  run.observations = concatenate(parts);
  return run;
}

// A reader that has gone away changes nothing of what the status says.
void print(const std::string& text) {
  try {
    write_whole_file("-", text);
  } catch (const ClosedPipe&) {
    return;
  }
}

}  // namespace

int run(const CalibrateCommand& command) {
  if (command.output && (command.output->find("{serial}") != std::string::npos ||
                         command.output->find("{slot}") != std::string::npos)) {
    throw UsageError("-o: this version writes one record and knows no {serial} or {slot}");
  }
  Experiment experiment = make_experiment(command.experiment);
  if (command.output) {
    for (const std::string& input : experiment.observations) {
      forbid_overwriting(*command.output, input);
    }
    for (const std::string& input : command.experiment.files) {
      forbid_overwriting(*command.output, input);
    }
  }
  Run run = read_run(experiment);
  if (experiment.instrument.serial.empty()) {
    experiment.instrument.serial = run.serial;
  }
  Calibration calibration = calibrate(experiment, run.observations);
  calibration.inputs = std::move(run.inputs);
  calibration.notes.insert(calibration.notes.end(), run.notes.begin(), run.notes.end());
  const bool refused = calibration.status == "refused";
  const std::string record = calibration_json(calibration);
  const bool store = command.output && (!refused || command.force);
  if (store) {
    write_whole_file(*command.output, record);
  }
  if (command.output != "-") {
    const std::string where = store ? "\nrecord: " + *command.output + "\n" : "";
    print(command.json ? record : summary_text(calibration) + where);
  }
  for (const std::string& note : calibration.notes) {
    std::fprintf(stderr, "note: %s\n", note.c_str());
  }
  for (const CalibrationWarning& warning : calibration.warnings) {
    std::fprintf(stderr, "%s\n", wrapped("warning: " + warning.message, 80).c_str());
  }
  if (refused) {
    std::fprintf(stderr, "axiscal: refused%s\n",
                 store ? "; the record is stored as such, as --force asks"
                       : "; no record is stored (--force would)");
    return 1;
  }
  return 0;
}

}  // namespace axiscal::cli
