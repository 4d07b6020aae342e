// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/calibrate_run.hpp"

#include <algorithm>
#include <cctype>

#include "axiscal/calib/assembly.hpp"
#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/experiment_json.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/field/settings.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "axiscal/instruments/settings.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

std::vector<Calibration> calibrate_one(Experiment experiment,
                                       const Run& run,
                                       Suggestions suggestions,
                                       std::vector<CalibrationNote>& notes) {
  const std::vector<Mount>& mounts = experiment.positioner.mounts();
  experiment.slot = slot_of(experiment, run);
  experiment.rotation_sensor_from_positioner =
      mount_rotation(experiment.positioner, experiment.slot);
  if (!experiment.slot.empty() && mounts.size() == 1) {
    notes.push_back(
        {NoteCode::mount,
         formatted("the instrument is in slot {} of the positioner; the rotation of this slot's "
                   "mount is used",
                   experiment.slot)});
  } else if (experiment.slot.empty() && !mounts.empty()) {
    notes.push_back({NoteCode::mount,
                     "the positioner's mounts are not used, because no slot is named: the "
                     "instrument's frame is taken as the cube's frame"});
  }
  std::vector<Calibration> one;  // an initializer list would copy the record
  one.push_back(suggestions == Suggestions::accept
                    ? calibrate_with_suggestions(experiment, run.observations)
                    : calibrate(experiment, run.observations));
  return one;
}

// Throws if the name of a slot is typical of another kind of instrument than `kind`.
void require_one_kind(const std::string& kind, const std::vector<std::string>& slots) {
  const VehicleSensor own = find_instrument_kind(kind).sensor;
  for (const std::string& slot : slots) {
    std::string name = slot;
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    for (const InstrumentKind& other : instrument_kinds()) {
      if (own != VehicleSensor::none && other.sensor != own && !other.columns.word.empty() &&
          name.find(other.columns.word) != std::string::npos) {
        throw SetupError(
            formatted(
                "the name of slot '{}' suggests the kind {}, but the slot would be calibrated as "
                "{}; give the kind of each slot, for example {}={}, or leave out the columns of "
                "this slot",
                slot, other.name, kind, slot, other.name),
            {settings::instrument});
      }
    }
  }
}

std::vector<Calibration> calibrate_slots(const Experiment& experiment,
                                         const Run& run,
                                         Suggestions suggestions,
                                         std::vector<CalibrationNote>& notes) {
  if (!experiment.slot.empty()) {
    throw SetupError(
        formatted("slot '{}' is given, but the names of the columns already contain the slots: {}",
                  experiment.slot, joined(run.slots)));
  }
  if (experiment.slots.empty()) {
    require_one_kind(experiment.instrument.kind, run.slots);
  }
  if (suggestions == Suggestions::accept) {
    throw SetupError(
        "suggested corrections can be accepted only for one instrument, not for several slots");
  }
  if (experiment.positioner.mounts().empty() && run.slots.size() > 1) {
    notes.push_back({NoteCode::mount,
                     "neither an assembly nor a positioner states the mounts, so each instrument's "
                     "frame is taken as the cube's frame"});
  }
  return calibrate_assembly(experiment, split_by_slot(run));
}

}  // namespace

std::string slot_of(const Experiment& experiment, const Run& run) {
  const std::vector<Mount>& mounts = experiment.positioner.mounts();
  const bool only_mount = experiment.slot.empty() && run.slots.empty() && mounts.size() == 1 &&
                          !is_of_reference(experiment.positioner, mounts.front().slot);
  return only_mount ? mounts.front().slot : experiment.slot;
}

std::vector<Calibration> calibrate_run(Experiment experiment,
                                       const Run& run,
                                       Suggestions suggestions) {
  if (experiment.instrument.serial.empty()) {
    experiment.instrument.serial = run.serial;
  }
  std::vector<CalibrationNote> notes;
  if (!run.field_unit.empty() && experiment.field.unit.empty()) {
    experiment.field.unit = run.field_unit;
  } else if (!run.field_unit.empty() && experiment.field.unit != run.field_unit) {
    throw SetupError(formatted("the column with the field of each reading is in {}, but the unit "
                               "of the field is given as {}; use only one unit",
                               run.field_unit, experiment.field.unit),
                     {settings::field});
  }
  for (const std::string& note : run.notes) {
    notes.push_back({NoteCode::input, note});
  }
  const std::string stated = can_be_stated(experiment) ? experiment_json(experiment) : "";
  std::vector<Calibration> calibrations =
      run.slots.empty() ? calibrate_one(std::move(experiment), run, suggestions, notes)
                        : calibrate_slots(experiment, run, suggestions, notes);
  for (Calibration& calibration : calibrations) {
    calibration.provenance.inputs = run.inputs;
    calibration.provenance.measured = measured_at(run);
    calibration.provenance.operated_by = operators_of(run);
    calibration.provenance.experiment = stated;
    calibration.findings.notes.insert(calibration.findings.notes.end(), notes.begin(), notes.end());
  }
  return calibrations;
}

}  // namespace axiscal
