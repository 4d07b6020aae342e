// SPDX-License-Identifier: Apache-2.0
#include "run_input.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <set>
#include <unordered_map>

#include "axiscal/calib/assembly.hpp"
#include "axiscal/calib/calibrate.hpp"
#include "axiscal/core/number_text.hpp"
#include "command_line.hpp"
#include "input.hpp"
#include "summary.hpp"

namespace axiscal::cli {
namespace {

ObservationColumns needed_columns(const Experiment& experiment, Units units) {
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

void append(std::vector<std::string>& to, const std::vector<std::string>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

}  // namespace

std::vector<Mount> mounts_of_assembly(const std::string& assembly,
                                      const std::vector<std::string>& slots) {
  struct Known {
    std::string_view name;
    std::size_t slots;  // 0: any number
  };
  constexpr std::array<Known, 5> known = {
      {{"parallel", 0}, {"single", 1}, {"triple", 3}, {"h", 2}, {"h:y", 2}}};
  const auto* found = std::find_if(known.begin(), known.end(),
                                   [&](const Known& one) { return one.name == assembly; });
  if (found == known.end()) {
    throw UsageError("--assembly: must be parallel, single, triple, h or h:y, not '" + assembly +
                     "'");
  }
  if (slots.empty() || (found->slots != 0 && slots.size() != found->slots)) {
    throw UsageError("--assembly: '" + assembly + "' has " +
                     (found->slots == 0 ? "slots" : std::to_string(found->slots) + " slots") +
                     ", but the columns SLOT.axis have " + std::to_string(slots.size()));
  }
  if (assembly.starts_with("h")) {
    return h_shaped_mounts(slots[0], slots[1], assembly == "h" ? WebAxis::x : WebAxis::y);
  }
  return parallel_mounts(slots);
}

Run read_run(const Experiment& experiment,
             Units units,
             const std::optional<ObservationColumns>& beside) {
  if (experiment.observations.empty()) {
    throw UsageError(
        "no observations are named, neither on the command line nor by the experiment");
  }
  const ObservationColumns columns = needed_columns(experiment, units);
  Run run;
  std::vector<Observations> parts;
  std::vector<Observations> parts_beside;
  std::string without_serial;  // a file without that column
  for (const std::string& path : experiment.observations) {
    ObservationsFile file = read_observations_file(path, columns, beside);
    without_serial = file.table.serials.empty() ? path : without_serial;
    if (units == Units::one && !run.serial.empty() && !file.table.serial.empty() &&
        run.serial != file.table.serial) {
      throw DataError(path, "column 'serial': '" + file.table.serial +
                                "', but an earlier file is "
                                "of '" +
                                run.serial + "'; one unit at a time is taken here");
    }
    if (!parts.empty() && run.slots != file.table.slots) {
      throw DataError(path, "the columns are of other slots than the first file's");
    }
    run.slots = file.table.slots;
    run.serial = file.table.serial.empty() ? run.serial : file.table.serial;
    run.inputs.push_back({.path = path, .sha256 = file.sha256});
    const std::vector<std::string>& ignored = file.table.ignored_columns;
    if (!ignored.empty()) {
      run.notes.push_back(path + ": " + (ignored.size() == 1 ? "column " : "columns ") +
                          joined(ignored) + (ignored.size() == 1 ? " was" : " were") + " ignored");
    }
    run.serials.insert(run.serials.end(), file.table.serials.begin(), file.table.serials.end());
    parts.push_back(std::move(file.table.observations));
    if (beside) {
      parts_beside.push_back(std::move(file.beside));
    }
  }
  if (!without_serial.empty() && has_several_units(run)) {
    throw DataError(without_serial,
                    "column 'serial' is missing: of which of the units are these readings?");
  }
  if (!without_serial.empty()) {
    run.serials.clear();  // all are of the one unit
  }
  run.observations = concatenate(parts);
  if (beside) {
    run.observations_beside = concatenate(parts_beside);
  }
  return run;
}

bool has_several_units(const Run& run) {
  return std::any_of(run.serials.begin(), run.serials.end(),
                     [&](const std::string& serial) { return serial != run.serials.front(); });
}

std::vector<Run> split_by_serial(const Run& run, const std::string& stated_serial) {
  if (run.serials.empty()) {
    Run only = run;
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
  std::vector<Run> units;
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

std::string slot_of(const Experiment& experiment, const Run& run) {
  const std::vector<Mount>& mounts = experiment.positioner.mounts();
  const bool only_mount = experiment.slot.empty() && run.slots.empty() && mounts.size() == 1 &&
                          !is_of_reference(experiment.positioner, mounts.front().slot);
  return only_mount ? mounts.front().slot : experiment.slot;
}

std::vector<Calibration> calibrate_run(Experiment experiment,
                                       const Run& run,
                                       const std::string& assembly,
                                       bool accept_suggestion) {
  std::vector<std::string> notes = run.notes;
  if (experiment.instrument.serial.empty()) {
    experiment.instrument.serial = run.serial;
  }
  if (!assembly.empty()) {
    experiment.positioner =
        experiment.positioner.with_mounts(mounts_of_assembly(assembly, run.slots));
  }
  const std::vector<Mount>& mounts = experiment.positioner.mounts();
  std::vector<Calibration> calibrations;
  if (run.slots.empty()) {
    experiment.slot = slot_of(experiment, run);
    experiment.rotation_sensor_from_positioner =
        mount_rotation(experiment.positioner, experiment.slot);
    if (!experiment.slot.empty() && mounts.size() == 1) {
      notes.push_back("the instrument sits in the positioner's slot " + experiment.slot +
                      ", with its mount's rotation");
    } else if (experiment.slot.empty() && !mounts.empty()) {
      notes.emplace_back(
          "the positioner's mounts are not used, as no slot is stated (--slot): the instrument's "
          "frame is taken as the cube's");
    }
    calibrations.push_back(accept_suggestion
                               ? calibrate_with_suggestions(experiment, run.observations)
                               : calibrate(experiment, run.observations));
  } else {
    if (!experiment.slot.empty()) {
      throw UsageError("--slot: the columns state the slots themselves: " + joined(run.slots));
    }
    if (mounts.empty() && run.slots.size() > 1) {
      notes.emplace_back(
          "no mounts are stated (--assembly, or a positioner's mounts): each instrument's frame is "
          "taken as the cube's");
    }
    if (accept_suggestion) {
      throw UsageError("--accept-suggestion: goes with one instrument, not with several slots");
    }
    calibrations = calibrate_assembly(experiment, split_by_slot(run.observations, run.slots));
  }
  for (Calibration& calibration : calibrations) {
    calibration.inputs = run.inputs;
    append(calibration.notes, notes);
  }
  return calibrations;
}

void print_remarks(const std::vector<Calibration>& calibrations) {
  std::set<std::string> said;  // what all slots have in common is said once
  for (const Calibration& calibration : calibrations) {
    const std::string slot = calibrations.size() > 1 && !calibration.slot.empty()
                                 ? "slot " + calibration.slot + ": "
                                 : "";
    for (const std::string& note : calibration.notes) {
      if (said.insert(note).second) {
        print_remark("note", note);
      }
    }
    for (const CalibrationWarning& warning : calibration.warnings) {
      if (said.insert(warning.message).second) {
        print_remark("warning", (warning.code == "slot_levelness" ? "" : slot) + warning.message);
      }
    }
  }
}

}  // namespace axiscal::cli
