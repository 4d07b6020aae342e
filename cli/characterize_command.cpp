// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <set>
#include <utility>

#include <Eigen/Geometry>

#include "axiscal/calib/assembly.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/characterize.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/positioner/cube_geometry.hpp"
#include "axiscal/positioner/positioner_json.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"
#include "input.hpp"
#include "subcommands.hpp"
#include "summary.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {
namespace {

struct CharacterizeCommand {
  std::vector<std::string> references;  ///< arguments of the form RECORD=OBSERVATIONS
  std::string id;
  std::string output;
  std::optional<std::string> drawing, level_by, leave_out;
  bool hold_bias_and_scale = false;
  bool json = false;
};

void add_options(OptionSet& options, CharacterizeCommand& command) {
  options.add_repeated(
      "--reference", command.references, "RECORD=OBS",
      "record of an instrument, and readings of the instrument in the cube; repeat the option for "
      "each instrument");
  options.add("--id", command.id, "NAME", "name of the cube", Need::required);
  options.add("-o,--output", command.output, "FILE",
              "file of the measured cube (JSON); - is stdout", Need::required);
  options.add("--drawing", command.drawing, "FILE",
              "positioner file of the cube as drawn; its feet give the exact attitude in each "
              "seat");
  options.add("--level-by", command.level_by, "run|block",
              "estimate one slope of the table for each reference ('run') or for each block "
              "('block') [default: run]");
  options.add("--leave-out", command.leave_out, "SLOTS", "slots to leave out, for example A,B");
  options.add_flag("--hold-bias-and-scale", command.hold_bias_and_scale,
                   "take bias and scale from the records [default: fit them again]");
  options.add_flag("--json", command.json, "print JSON instead of tables");
}

struct ReferenceFiles {
  std::string record;
  std::string observations;
  std::string slot;  // slot whose columns are read; empty: the slot that the record states
};

// Splits the argument OBS.csv:SLOT into file name and slot. If a file is named `OBS.csv:SLOT`, the
// argument is not split.
void part_slot(ReferenceFiles& files) {
  const std::size_t parting = files.observations.rfind(':');
  std::error_code none;
  if (parting != std::string::npos && parting > 0 && parting + 1 < files.observations.size() &&
      !std::filesystem::exists(files.observations, none)) {
    files.slot = files.observations.substr(parting + 1);
    files.observations.resize(parting);
  }
}

std::vector<ReferenceFiles> reference_files(const CharacterizeCommand& command) {
  std::vector<ReferenceFiles> files;
  for (const std::string& text : command.references) {
    const std::size_t parting = text.find('=');
    if (parting == std::string::npos || parting == 0 || parting + 1 == text.size()) {
      throw UsageError(formatted("--reference: '{}' must be RECORD.json=OBS.csv", text));
    }
    files.push_back({.record = text.substr(0, parting), .observations = text.substr(parting + 1)});
    part_slot(files.back());
  }
  return files;
}

// Returns the readings of one instrument. The table may contain the readings of several slots.
Observations own_readings(const Run& table, const std::string& slot, const ReferenceFiles& files) {
  if (table.slots.empty()) {
    return table.observations;
  }
  std::vector<SlotObservations> parts = split_by_slot(table);
  for (SlotObservations& part : parts) {
    if (part.slot == slot || parts.size() == 1) {
      return std::move(part.observations);
    }
  }
  throw DataError(
      files.observations,
      formatted("the columns belong to the slots {}, but the record {}{}; name the slot: "
                "--reference {}={}:SLOT",
                joined(table.slots), files.record,
                slot.empty() ? " names no slot" : " is of slot " + slot, files.record,
                files.observations));
}

std::vector<Reference> read_references(const std::vector<ReferenceFiles>& all) {
  std::vector<Reference> references;
  std::set<std::string> names;
  std::set<std::pair<std::string, std::string>> readings;  // file and slot
  for (const ReferenceFiles& files : all) {
    Reference reference;
    reference.calibration = read_calibration(files.record);
    // Records with equal serial numbers belong to one instrument, whatever their file names are.
    const std::string& serial = reference.calibration.sensor.instrument.serial;
    reference.instrument =
        serial.empty() ? std::filesystem::weakly_canonical(files.record).string()
                       : formatted("{} {}", reference.calibration.sensor.instrument.kind, serial);
    const Calibration& record = reference.calibration;
    if (record.findings.status == CalibrationStatus::refused) {
      throw RefusedError(files.record +
                         ": this calibration was refused, so it cannot be used to measure a cube");
    }
    const ObservationsFile table = read_observations_file(
        files.observations, {.axes = record.sensor.instrument.axes, .needs_labels = true});
    const std::vector<std::string>& slots = table.run.slots;
    const std::string wanted = files.slot.empty() ? record.provenance.slot : files.slot;
    const std::string read = slots.empty() ? "" : slots.size() == 1 ? slots.front() : wanted;
    if (!readings.emplace(files.observations, read).second) {
      throw UsageError(formatted(
          "--reference: the readings {} are given twice; each mounting requires separate readings",
          files.observations));
    }
    reference.observations = own_readings(table.run, wanted, files);
    const std::string name = !read.empty()     ? read
                             : !wanted.empty() ? wanted
                             : !serial.empty()
                                 ? serial
                                 : std::filesystem::path(files.record).stem().string();
    reference.slot = name;
    for (int number = 2; !names.insert(reference.slot).second; ++number) {
      reference.slot = formatted("{}#{}", name, number);
    }
    references.push_back(std::move(reference));
  }
  return references;
}

std::string micro(double radian) {
  return std::isfinite(radian) ? formatted("{:.2f}", 1e6 * radian) : "-";
}

std::string p_text(double p) {
  return std::isfinite(p) ? formatted("{:.2g}", p) : "-";
}

std::string text_of(const Characterization& result) {
  const Positioner& cube = result.positioner;
  const NormalCovariance& C = *cube.description().normal_covariance;
  std::string text = formatted("cube {}: measured with {} reference{}", cube.id(),
                               result.references.size(), result.references.size() == 1 ? "" : "s");
  text += formatted(
      "\n\nFace normals minus nominal normals [urad]\n"
      "  {:<6}{:>10}{:>10}{:>10}{:>8}{:>8}{:>8}\n",
      "face", "x", "y", "z", "u(x)", "u(y)", "u(z)");
  for (const Face face : all_faces) {
    const Eigen::Vector3d off = cube.normal(face) - nominal_normal(face);
    const Eigen::Index at = 3 * static_cast<Eigen::Index>(face);
    text += formatted("  {:<6}", face_name(face));
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      text += formatted("{:>10}", micro(off(axis)));
    }
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      text += formatted("{:>8}", micro(std::sqrt(C(at + axis, at + axis))));
    }
    text += "\n";
  }
  const CubeGeometry geometry = describe_geometry(cube);
  text += formatted("  largest deviation from squareness {} urad, from parallelism {} urad\n",
                    micro(geometry.worst_from_square_rad), micro(geometry.worst_from_parallel_rad));
  text += formatted("\nInstruments\n  {:<18}{:>13}{:>12}{:>20}{:>10}\n", "slot", "mount [urad]",
                    "scatter", "slope [urad]", "p");
  for (const ReferenceResult& reference : result.references) {
    const Eigen::AngleAxisd turn(reference.rotation_sensor_from_positioner);
    text += formatted("  {:<18}{:>13}{:>12.2e}{:>20}{:>10}\n", reference.slot.substr(0, 17),
                      micro(std::abs(turn.angle())), reference.residual_sd,
                      formatted("{}, {}", micro(reference.slope.x()), micro(reference.slope.y())),
                      p_text(reference.p_value));
  }
  if (std::isfinite(result.p_value)) {
    text += formatted("  the instruments {} (p = {:.2g})\n",
                      result.consistent ? "agree" : "DISAGREE", result.p_value);
  }
  for (const MountRepeatability& repeatability : result.repeatability) {
    text += wrapped(formatted("  mount repeatability of {} (mounted {} times): standard deviation "
                              "{} urad per axis",
                              repeatability.slots.front(), repeatability.slots.size(),
                              micro(repeatability.sd_rad)),
                    80) +
            "\n";
  }
  for (const std::string& note : cube.description().notes) {
    if (std::find(result.warnings.begin(), result.warnings.end(), note) != result.warnings.end()) {
      continue;  // the text of the warnings already contains this note
    }
    text += formatted("\n{}\n", wrapped(note, 80));
  }
  return text;
}

std::string json_of(const Characterization& result) {
  Json json = {{"id", result.positioner.id()},  {"normal_u_rad", result.normal_u_rad},
               {"noise_rad", result.noise_rad}, {"transferred_rad", result.transferred_rad},
               {"p_value", result.p_value},     {"consistent", result.consistent},
               {"suspect", result.suspect},     {"warnings", result.warnings},
               {"references", Json::array()},   {"repeatability", Json::array()}};
  for (const ReferenceResult& reference : result.references) {
    json["references"].push_back(
        {{"slot", reference.slot},
         {"rotation_sensor_from_positioner",
          json_from_matrix(reference.rotation_sensor_from_positioner)},
         {"mount_se_rad", json_from(reference.mount_se_rad)},
         {"residual_sd", reference.residual_sd},
         {"worst_run", reference.worst_run},
         {"slope", {{"x", reference.slope.x()}, {"y", reference.slope.y()}}},
         {"p_value", reference.p_value}});
  }
  for (const MountRepeatability& repeatability : result.repeatability) {
    json["repeatability"].push_back({{"slots", repeatability.slots},
                                     {"sd_rad", repeatability.sd_rad},
                                     {"degrees_of_freedom", repeatability.degrees_of_freedom}});
  }
  const CubeGeometry geometry = describe_geometry(result.positioner);
  json["angles"] = Json::array();
  for (const FaceAngle& angle : geometry.angles) {
    json["angles"].push_back({{"faces", {face_name(angle.first), face_name(angle.second)}},
                              {"angle_rad", angle.angle_rad},
                              {"deviation_rad", angle.deviation_rad}});
  }
  for (const Face face : all_faces) {
    if (const std::optional<double>& offset = geometry.offset_m[static_cast<std::size_t>(face)]) {
      json["offset_m"][std::string(face_name(face))] = *offset;
    }
  }
  return json_text(json);
}

// Returns the content of the positioner file. It names the record and the readings of each
// reference.
std::string positioner_text(const Characterization& result,
                            const std::vector<Reference>& references,
                            const std::vector<ReferenceFiles>& files) {
  PositionerDescription description = result.positioner.description();
  for (MeasuredFrom& from : description.from) {
    for (std::size_t i = 0; i < references.size(); ++i) {
      if (references[i].slot == from.slot) {
        from.record = files[i].record;
        from.observations = files[i].observations;
      }
    }
  }
  return positioner_json(Positioner(std::move(description)));
}

CharacterizeOptions options_of(const CharacterizeCommand& command) {
  CharacterizeOptions options{.id = command.id,
                              .free_bias_and_scale = !command.hold_bias_and_scale};
  if (command.drawing) {
    options.drawing = read_positioner(*command.drawing);
  }
  if (command.level_by) {
    options.level_by = levelness_scope_of_option(*command.level_by);
  }
  if (command.leave_out) {
    for (const std::string_view slot : split(*command.leave_out, ',')) {
      options.leave_out.emplace_back(slot);
    }
  }
  return options;
}

int run(const CharacterizeCommand& command) {
  if (command.output == "-" && command.json) {
    throw UsageError(
        "-o -: the cube and the output of --json cannot both go to standard output; "
        "use -o FILE");
  }
  const std::vector<ReferenceFiles> files = reference_files(command);
  const CharacterizeOptions options = options_of(command);
  const std::vector<Reference> references = read_references(files);
  const Characterization result = characterize(references, options);
  write_text(command.output, positioner_text(result, references, files));
  if (command.output != "-") {
    write_text("-", command.json ? json_of(result) : text_of(result));
  }
  for (const std::string& warning : result.warnings) {
    print_remark("warning", warning);
  }
  return 0;
}

}  // namespace

Subcommand characterize_subcommand() {
  return make_subcommand<CharacterizeCommand>(
      "characterize", "measure a cube with calibrated instruments",
      "Take the 12 points several times (replicates). To measure the\n"
      "repeatability of the mount, mount an instrument several times, and give its\n"
      "record once for each mounting.",
      &add_options, &run);
}

}  // namespace axiscal::cli
