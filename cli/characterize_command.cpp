// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <set>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "axiscal/calib/assembly.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/characterize.hpp"
#include "axiscal/core/json_document.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/positioner/cube_geometry.hpp"
#include "axiscal/positioner/positioner_json.hpp"
#include "commands.hpp"
#include "input.hpp"
#include "summary.hpp"

namespace axiscal::cli {
namespace {

struct ReferenceFiles {
  std::string record;
  std::string observations;
};

std::vector<ReferenceFiles> reference_files(const CharacterizeCommand& command) {
  std::vector<ReferenceFiles> files;
  for (const std::string& text : command.references) {
    const std::size_t parting = text.find('=');
    if (parting == std::string::npos || parting == 0 || parting + 1 == text.size()) {
      throw UsageError("--reference: '" + text + "' must be RECORD.json=OBS.csv");
    }
    files.push_back({.record = text.substr(0, parting), .observations = text.substr(parting + 1)});
    for (const std::string& input : {files.back().record, files.back().observations}) {
      forbid_overwriting(command.output, input);
    }
  }
  return files;
}

// The instrument's readings in a table of one instrument, or of several where its slot is there.
Observations own_readings(const ObservationsTable& table,
                          const std::string& slot,
                          const ReferenceFiles& files) {
  if (table.slots.empty()) {
    return table.observations;
  }
  std::vector<SlotObservations> parts = split_by_slot(table.observations, table.slots);
  for (SlotObservations& part : parts) {
    if (part.slot == slot || parts.size() == 1) {
      return std::move(part.observations);
    }
  }
  throw DataError(files.observations, "the columns are of slots " + joined(table.slots) +
                                          ", but the record " + files.record +
                                          (slot.empty() ? " states none" : " is of slot " + slot));
}

std::vector<Reference> read_references(const std::vector<ReferenceFiles>& all) {
  std::vector<Reference> references;
  std::set<std::string> names;
  for (const ReferenceFiles& files : all) {
    Reference reference;
    reference.instrument = std::filesystem::weakly_canonical(files.record).string();
    reference.calibration = read_calibration(files.record);
    const Calibration& record = reference.calibration;
    if (record.status == "refused") {
      throw RefusedError(files.record +
                         ": this calibration was refused; a cube cannot be measured "
                         "with it");
    }
    const ObservationsFile table = read_observations_file(
        files.observations, {.axes = record.instrument.axes, .needs_labels = true});
    reference.observations = own_readings(table.table, record.slot, files);
    const std::string name = !record.slot.empty() ? record.slot
                             : !record.instrument.serial.empty()
                                 ? record.instrument.serial
                                 : std::filesystem::path(files.record).stem().string();
    reference.slot = name;
    for (int number = 2; !names.insert(reference.slot).second; ++number) {
      reference.slot = name + "#" + std::to_string(number);
    }
    references.push_back(std::move(reference));
  }
  return references;
}

std::string micro(double radian) {
  return std::isfinite(radian) ? fmt::format("{:.2f}", 1e6 * radian) : "-";
}

std::string p_text(double p) {
  return std::isfinite(p) ? fmt::format("{:.2g}", p) : "-";
}

std::string text_of(const Characterization& result) {
  const Positioner& cube = result.positioner;
  const NormalCovariance& C = *cube.description().normal_covariance;
  std::string text =
      fmt::format("cube {}: measured with {} reference{}", cube.id(), result.references.size(),
                  result.references.size() == 1 ? "" : "s");
  text += fmt::format(
      "\n\nFace normals, off the nominal ones [urad]\n  {:<6}{:>10}{:>10}{:>10}{:>8}"
      "{:>8}{:>8}\n",
      "face", "x", "y", "z", "u(x)", "u(y)", "u(z)");
  for (const Face face : all_faces) {
    const Eigen::Vector3d off = cube.normal(face) - nominal_normal(face);
    const Eigen::Index at = 3 * static_cast<Eigen::Index>(face);
    text += fmt::format("  {:<6}", face_name(face));
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      text += fmt::format("{:>10}", micro(off(axis)));
    }
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      text += fmt::format("{:>8}", micro(std::sqrt(C(at + axis, at + axis))));
    }
    text += "\n";
  }
  const CubeGeometry geometry = describe_geometry(cube);
  text +=
      fmt::format("  out of square by up to {} urad, out of parallel by up to {} urad\n",
                  micro(geometry.worst_from_square_rad), micro(geometry.worst_from_parallel_rad));
  text += fmt::format("\nInstruments\n  {:<20}{:>12}{:>12}{:>20}{:>8}\n", "slot", "mount [mrad]",
                      "scatter", "slope [mrad]", "p");
  for (const ReferenceResult& reference : result.references) {
    const Eigen::AngleAxisd turn(reference.rotation_sensor_from_positioner);
    text += fmt::format(
        "  {:<20}{:>12.3f}{:>12.2e}{:>20}{:>8}\n", reference.slot.substr(0, 19),
        1e3 * std::abs(turn.angle()), reference.residual_sd,
        fmt::format("{:.3f}, {:.3f}", 1e3 * reference.slope.x(), 1e3 * reference.slope.y()),
        p_text(reference.p_value));
  }
  if (std::isfinite(result.p_value)) {
    text += fmt::format("  the instruments {} (p = {:.2g})\n",
                        result.consistent ? "agree" : "DISAGREE", result.p_value);
  }
  for (const MountRepeatability& repeatability : result.repeatability) {
    text += wrapped(fmt::format("  mount repeatability of {} ({} fittings): {} urad per axis",
                                repeatability.slots.front(), repeatability.slots.size(),
                                micro(repeatability.sd_rad)),
                    80) +
            "\n";
  }
  for (const std::string& note : cube.description().notes) {
    text += "\n" + wrapped(note, 80) + "\n";
  }
  return text;
}

std::string json_of(const Characterization& result) {
  Json json = {{"id", result.positioner.id()},  {"normal_u_rad", result.normal_u_rad},
               {"noise_rad", result.noise_rad}, {"transferred_rad", result.transferred_rad},
               {"p_value", result.p_value},     {"consistent", result.consistent},
               {"suspect", result.suspect},     {"references", Json::array()},
               {"repeatability", Json::array()}};
  for (const ReferenceResult& reference : result.references) {
    json["references"].push_back(
        {{"slot", reference.slot},
         {"rotation_sensor_from_positioner",
          json_from_matrix(reference.rotation_sensor_from_positioner)},
         {"mount_se_rad", json_from(reference.mount_se_rad)},
         {"residual_sd", reference.residual_sd},
         {"slope", {{"x", reference.slope.x()}, {"y", reference.slope.y()}}},
         {"p_value", reference.p_value}});
  }
  for (const MountRepeatability& repeatability : result.repeatability) {
    json["repeatability"].push_back({{"slots", repeatability.slots},
                                     {"sd_rad", repeatability.sd_rad},
                                     {"degrees_of_freedom", repeatability.degrees_of_freedom}});
  }
  return json_text(json);
}

// The result with the files that it came from.
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
    const std::optional<LevelBy> level_by = parse_level_by(*command.level_by);
    if (!level_by) {
      throw UsageError("--level-by: must be run or block, not '" + *command.level_by + "'");
    }
    options.level_by = *level_by;
  }
  if (command.leave_out) {
    for (const std::string_view slot : split(*command.leave_out, ',')) {
      options.leave_out.emplace_back(slot);
    }
  }
  return options;
}

}  // namespace

int run(const CharacterizeCommand& command) {
  const std::vector<ReferenceFiles> files = reference_files(command);
  const CharacterizeOptions options = options_of(command);
  const std::vector<Reference> references = read_references(files);
  const Characterization result = characterize(references, options);
  write_whole_file(command.output, positioner_text(result, references, files));
  if (command.output != "-") {
    write_whole_file("-", command.json ? json_of(result) : text_of(result));
  }
  if (!result.consistent) {
    const std::string what =
        result.suspect.empty()
            ? "warning: the two instruments disagree about the cube (p = " +
                  p_text(result.p_value) + "); a third would tell which one is wrong"
            : "warning: slot " + result.suspect +
                  " disagrees with the others about the cube (p = " + p_text(result.p_value) +
                  "); calibrate that instrument again, or leave it out with --leave-out " +
                  result.suspect;
    std::fprintf(stderr, "%s\n", wrapped(what, 80).c_str());
  }
  return 0;
}

}  // namespace axiscal::cli
