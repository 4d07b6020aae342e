// SPDX-License-Identifier: Apache-2.0
#include "calib/cube/src/characterize_checks.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/field/field_kind.hpp"
#include "core/formatted.hpp"

namespace axiscal {

void check_references(const std::vector<Reference>& references) {
  std::set<std::string> slots;
  for (const Reference& reference : references) {
    if (reference.slot.empty() || !slots.insert(reference.slot).second) {
      throw DomainError("characterize: each reference needs a unique slot name");
    }
    const Calibration& calibration = reference.calibration;
    const std::string slot = formatted("slot {}: ", reference.slot);
    if (calibration.sensor.response.bias.size() < 3) {
      throw RefusedError(slot +
                         "the instrument has fewer than three axes; it cannot measure a cube");
    }
    if (reference.observations.response.cols() != calibration.sensor.response.bias.size()) {
      throw DomainError(slot + "the readings and the record have different numbers of axes");
    }
    const std::optional<Eigen::Vector3d>& field = calibration.sensor.field.in_table;
    const bool along_normal = field_kind(calibration.sensor.field.kind).vertical ||
                              (field && std::abs(field->z()) > 0.99 * field->norm());
    if (!along_normal) {
      throw RefusedError(formatted(
          "{}the field is {}, but a cube can be measured only in a field along the table's normal, "
          "for example gravity",
          slot, calibration.sensor.field.kind));
    }
    for (const Reading& reading : reference.observations.readings) {
      if (!reading.point) {
        throw RefusedError(formatted("{}run {} lacks a design point", slot, reading.run));
      }
    }
  }
}

void require_faces(const std::vector<SolidReference>& references) {
  std::set<Face> taken;
  for (const SolidReference& reference : references) {
    for (const Reading& reading : reference.run.readings) {
      taken.insert(reading.point->rest());
    }
  }
  std::vector<std::string> missing;
  for (const Face face : all_faces) {
    if (!taken.contains(face)) {
      missing.emplace_back(face_name(face));
    }
  }
  if (!missing.empty()) {
    throw RefusedError(formatted(
        "no reading has the rest face {}, so the normal of this face is undetermined; add readings "
        "on this face",
        joined(missing)));
  }
}

void require_opposites(const SolidReference& reference) {
  std::set<std::pair<std::size_t, DesignPoint>> there;
  for (std::size_t i = 0; i < reference.run.readings.size(); ++i) {
    there.emplace(reference.levels[i], *reference.run.readings[i].point);
  }
  for (std::size_t level = 0; level < reference.level_count; ++level) {
    const bool has_pair = std::any_of(there.begin(), there.end(), [&](const auto& entry) {
      return entry.first == level && there.contains({level, entry.second.turned_round()});
    });
    if (!has_pair) {
      throw RefusedError(formatted(
          "slot {}: no reading has an opposite reading (same rest face, but the opposite fence "
          "face), so the readings do not separate the table's slope from the cube's faces; repeat "
          "the reading on each rest face with the opposite face at the fence",
          reference.slot));
    }
  }
}

}  // namespace axiscal
