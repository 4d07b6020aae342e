// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/companion.hpp"
#include "axiscal/calib/reduction_csv.hpp"
#include "axiscal/core/output_file.hpp"
#include "commands.hpp"
#include "experiment_options.hpp"
#include "input.hpp"
#include "run_input.hpp"
#include "summary.hpp"

namespace axiscal::cli {
namespace {

constexpr std::string_view slot_place = "{slot}";

// The record's file for a slot: `{slot}` in the pattern is its name.
std::string output_for(const std::string& pattern, const std::string& slot) {
  std::string path = pattern;
  if (const std::size_t at = path.find(slot_place); at != std::string::npos) {
    if (slot.empty()) {
      throw UsageError("-o: '" + pattern +
                       "' holds {slot}, but no slot is stated, neither by columns SLOT.axis nor by "
                       "--slot");
    }
    if (slot.find('/') != std::string::npos) {
      throw UsageError("-o: slot '" + slot + "' cannot be part of a file's name");
    }
    path.replace(at, slot_place.size(), slot);
  }
  return path;
}

void check_output(const std::string& output,
                  const Experiment& experiment,
                  const Run& run,
                  const std::vector<std::string>& files,
                  const std::optional<std::string>& positioner) {
  if (run.slots.size() > 1 && output != "-" && output.find(slot_place) == std::string::npos) {
    throw UsageError("-o: the run has " + std::to_string(run.slots.size()) +
                     " slots, one record each; the file's name must hold {slot}");
  }
  const std::vector<std::string> slots =
      run.slots.empty() ? std::vector<std::string>{experiment.slot} : run.slots;
  for (const std::string& slot : slots) {
    const std::string path = output_for(output, slot);
    for (const std::string& input : experiment.observations) {
      forbid_overwriting(path, input);
    }
    for (const std::string& input : files) {
      forbid_overwriting(path, input);
    }
    if (positioner) {
      forbid_overwriting(path, *positioner);
    }
  }
}

// The records as one text: an object, or a list of them for several slots.
std::string records_text(const std::vector<Calibration>& calibrations) {
  if (calibrations.size() == 1) {
    return calibration_json(calibrations.front());
  }
  std::string text = "[\n";
  for (std::size_t i = 0; i < calibrations.size(); ++i) {
    std::string record = calibration_json(calibrations[i]);
    record.pop_back();
    text += record + (i + 1 < calibrations.size() ? ",\n" : "\n");
  }
  return text + "]\n";
}

// Takes over the frame of the instrument that was recorded with it.
void align(const std::string& record,
           const Calibration& companion,
           const Experiment& experiment,
           const Run& run,
           std::vector<Calibration>& calibrations) {
  if (calibrations.size() != 1) {
    throw UsageError("--align: goes with one instrument, not with several slots");
  }
  std::vector<Observations> parts;
  for (const std::string& path : experiment.observations) {
    const ObservationColumns columns{.axes = companion.instrument.axes,
                                     .differences = companion.instrument.differences,
                                     .range = companion.instrument.range};
    parts.push_back(read_observations_file(path, columns).table.observations);
  }
  try {
    align_with_companion(calibrations.front(), run.observations, companion, concatenate(parts),
                         record);
  } catch (const SetupError&) {
    throw;
  } catch (const DomainError& error) {
    throw DataError(record, error.what());
  }
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
  if (command.output && command.output->find("{serial}") != std::string::npos) {
    throw UsageError("-o: this version writes one record a slot and knows no {serial}");
  }
  Experiment experiment = make_experiment(command.experiment);
  std::optional<Calibration> companion;
  std::vector<std::string> columns_of_companion;
  if (command.align) {
    companion = read_calibration(*command.align);
    if (companion->status == "refused") {
      throw RefusedError(*command.align + ": this calibration was refused");
    }
    for (const ReadingColumn& column : reading_columns(companion->instrument)) {
      columns_of_companion.push_back(column.plus);
      columns_of_companion.push_back(column.minus);
    }
  }
  const Run run = read_run(experiment, columns_of_companion);
  experiment.slot = slot_of(experiment, run);
  if (command.output) {
    check_output(*command.output, experiment, run, command.experiment.files,
                 command.experiment.positioner);
    if (command.align) {
      forbid_overwriting(*command.output, *command.align);
    }
  }
  std::vector<Calibration> calibrations =
      calibrate_run(experiment, run, command.experiment.assembly.value_or(""));
  if (companion) {
    align(*command.align, *companion, experiment, run, calibrations);
  }
  std::string text;
  bool any_refused = false;
  bool any_stored = false;
  std::string refused_slots = "refused";
  for (const Calibration& calibration : calibrations) {
    const bool refused = calibration.status == "refused";
    any_refused = any_refused || refused;
    if (refused && !calibration.slot.empty()) {
      refused_slots += (refused_slots == "refused" ? ": slot " : ", ") + calibration.slot;
    }
    text += text.empty() ? "" : "\n";
    text += summary_text(calibration);
    if (command.output && *command.output != "-" && (!refused || command.force)) {
      const std::string path = output_for(*command.output, calibration.slot);
      write_whole_file(path, calibration_json(calibration));
      any_stored = any_stored || refused;
      text += "\nrecord: " + path + "\n";
    }
  }
  if (command.output == "-" && (!any_refused || command.force)) {
    write_whole_file("-", records_text(calibrations));
    any_stored = true;
  } else if (command.output != "-") {
    print(command.json ? records_text(calibrations) : text);
  }
  print_remarks(calibrations);
  if (any_refused) {
    std::fprintf(stderr, "axiscal: %s%s\n", refused_slots.c_str(),
                 any_stored ? "; the record is stored as such, as --force asks"
                            : "; its record is not stored (--force would)");
    return 1;
  }
  return 0;
}

}  // namespace axiscal::cli
