// SPDX-License-Identifier: Apache-2.0
#include "axiscal/positioner/positioner_json.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/LU>

#include "axiscal/core/input_file.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"

namespace axiscal {
namespace {

constexpr std::array<std::string_view, 10> file_keys = {
    "format", "version",           "id",     "created", "software",
    "faces",  "normal_covariance", "mounts", "table",   "from"};
constexpr std::array<std::string_view, 2> face_keys = {"normal", "feet"};
constexpr std::array<std::string_view, 2> foot_keys = {"centre_m", "radius_m"};
constexpr std::array<std::string_view, 2> mount_keys = {"rotation_sensor_from_positioner",
                                                        "repeatability_rad"};
constexpr std::array<std::string_view, 4> table_keys = {"surface", "fence_lean_rad", "adjusters",
                                                        "thread_pitch_m"};
constexpr std::array<std::string_view, 2> adjuster_keys = {"x_m", "y_m"};
constexpr std::array<std::string_view, 2> from_keys = {"references", "notes"};
constexpr std::array<std::string_view, 3> reference_keys = {"slot", "record", "observations"};

// ---- reading ----

Feet feet_of(const JsonValue& json) {
  const std::vector<JsonValue> balls = json.elements();
  Feet feet;
  if (balls.size() != feet.size()) {
    json.fail(formatted("a face stands on three feet, not {}", balls.size()));
  }
  for (std::size_t i = 0; i < feet.size(); ++i) {
    balls[i].allow_keys(foot_keys);
    feet[i].centre_m = balls[i].at("centre_m").vector(3);
    const JsonValue radius = balls[i].at("radius_m");
    feet[i].radius_m = radius.number();
    if (feet[i].radius_m < 0.0) {
      radius.fail("must not be negative");
    }
  }
  return feet;
}

FaceDescription face_of_json(Face face, const JsonValue& json) {
  json.allow_keys(face_keys);
  FaceDescription description;
  if (const std::optional<JsonValue> feet = json.find("feet")) {
    description.feet = feet_of(*feet);
    if (const std::string defect = defect_of_feet(face, *description.feet); !defect.empty()) {
      feet->fail("the feet " + defect);
    }
  }
  if (const std::optional<JsonValue> normal = json.find("normal")) {
    description.normal = normal->vector(3);
    if (const std::string defect = defect_of_normal(face, *description.normal); !defect.empty()) {
      normal->fail(defect);
    }
  }
  if (!description.normal && !description.feet) {
    json.fail("needs a 'normal' or 'feet'");
  }
  return description;
}

// Throws if all normals are those of a cube with left-handed axes. A later check would reject the
// normals one by one, but this message gives their common reason.
void reject_mirrored_faces(const JsonValue& faces) {
  std::array<Eigen::Vector3d, all_faces.size()> normals;
  for (const Face face : all_faces) {
    const std::optional<JsonValue> entry = faces.find(face_name(face));
    const std::optional<JsonValue> normal = entry ? entry->find("normal") : std::nullopt;
    if (!normal) {
      return;
    }
    normals[static_cast<std::size_t>(face)] = normal->vector(3);
  }
  Eigen::Matrix3d axes;
  for (int axis = 0; axis < 3; ++axis) {
    axes.col(axis) = normals[static_cast<std::size_t>(face_of(axis, true))] -
                     normals[static_cast<std::size_t>(face_of(axis, false))];
  }
  if (axes.determinant() < 0.0) {
    faces.fail(
        "the normals are those of a left-handed cube: two faces have exchanged names, or an axis "
        "is "
        "reversed");
  }
}

Mount mount_of(const std::string& slot, const JsonValue& json) {
  json.allow_keys(mount_keys);
  Mount mount{.slot = slot};
  const JsonValue rotation = json.at("rotation_sensor_from_positioner");
  mount.rotation_sensor_from_positioner = rotation.matrix(3, 3);
  rotation.check([&] { static_cast<void>(checked_mounts({mount})); });
  if (const std::optional<JsonValue> repeatability = json.find("repeatability_rad")) {
    mount.repeatability_rad = repeatability->number();
    repeatability->check([&] { static_cast<void>(checked_mounts({mount})); });
  }
  return mount;
}

Surface surface_of(const JsonValue& json) {
  json.allow_keys(table_keys);
  Surface surface;
  if (const std::optional<JsonValue> kind = json.find("surface")) {
    if (kind->text() != "one_piece" && kind->text() != "separate") {
      kind->fail(R"(must be "one_piece" or "separate")");
    }
    surface.kind = kind->text() == "separate" ? SurfaceKind::separate : SurfaceKind::one_piece;
  }
  if (const std::optional<JsonValue> lean = json.find("fence_lean_rad")) {
    surface.fence_lean_rad = lean->number();
    if (!(std::abs(surface.fence_lean_rad) <= 0.5)) {
      lean->fail("the fence must lean by at most 0.5 rad");
    }
  }
  if (const std::optional<JsonValue> adjusters = json.find("adjusters")) {
    for (const JsonValue& adjuster : adjusters->elements()) {
      adjuster.allow_keys(adjuster_keys);
      surface.adjusters_m.emplace_back(adjuster.at("x_m").number(), adjuster.at("y_m").number());
    }
    adjusters->check([&] { check_adjusters(surface.adjusters_m); });
  }
  if (const std::optional<JsonValue> pitch = json.find("thread_pitch_m")) {
    surface.thread_pitch_m = pitch->number();
    if (!(*surface.thread_pitch_m > 0.0)) {
      pitch->fail("must be positive");
    }
  }
  return surface;
}

void read_origin(const JsonValue& json, PositionerDescription& description) {
  json.allow_keys(from_keys);
  if (const std::optional<JsonValue> references = json.find("references")) {
    for (const JsonValue& reference : references->elements()) {
      reference.allow_keys(reference_keys);
      description.from.push_back({.slot = reference.text_or("slot"),
                                  .record = reference.text_or("record"),
                                  .observations = reference.text_or("observations")});
    }
  }
  if (const std::optional<JsonValue> notes = json.find("notes")) {
    description.notes = notes->texts();
  }
}

// ---- writing ----

Json json_of(const FaceDescription& face, const Eigen::Vector3d& normal) {
  Json json;
  // If only the feet of a face are known, its normal follows from them and is not written.
  if (face.normal || !face.feet) {
    json["normal"] = json_from(normal);
  }
  if (face.feet) {
    json["feet"] = Json::array();
    for (const Ball& ball : *face.feet) {
      json["feet"].push_back({{"centre_m", json_from(ball.centre_m)}, {"radius_m", ball.radius_m}});
    }
  }
  return json;
}

Json json_of(const Surface& surface) {
  Json json = {{"surface", surface.kind == SurfaceKind::separate ? "separate" : "one_piece"},
               {"fence_lean_rad", surface.fence_lean_rad}};
  if (!surface.adjusters_m.empty()) {
    json["adjusters"] = Json::array();
    for (const Eigen::Vector2d& position : surface.adjusters_m) {
      json["adjusters"].push_back({{"x_m", position.x()}, {"y_m", position.y()}});
    }
  }
  if (surface.thread_pitch_m) {
    json["thread_pitch_m"] = *surface.thread_pitch_m;
  }
  return json;
}

bool says_something(const Surface& surface) {
  return surface.kind != SurfaceKind::one_piece || surface.fence_lean_rad != 0.0 ||
         !surface.adjusters_m.empty() || surface.thread_pitch_m;
}

}  // namespace

Positioner parse_positioner(std::string_view text, const std::string& path) {
  const JsonValue file = parse_json(text, path);
  file.require_format("axiscal-positioner");
  file.allow_keys(file_keys);
  PositionerDescription description{.id = file.text_or("id"),
                                    .created = file.text_or("created"),
                                    .software = file.text_or("software")};
  const JsonValue faces = file.at("faces");
  std::array<std::string_view, all_faces.size()> names;
  std::transform(all_faces.begin(), all_faces.end(), names.begin(), face_name);
  faces.allow_keys(names);
  reject_mirrored_faces(faces);
  for (const Face face : all_faces) {
    description.faces[static_cast<std::size_t>(face)] =
        face_of_json(face, faces.at(face_name(face)));
  }
  if (const std::optional<JsonValue> covariance = file.find("normal_covariance")) {
    description.normal_covariance = covariance->matrix(18, 18);
    covariance->check([&] { check_normal_covariance(*description.normal_covariance); });
  }
  if (const std::optional<JsonValue> mounts = file.find("mounts")) {
    for (const std::string& slot : mounts->keys()) {
      description.mounts.push_back(mount_of(slot, mounts->at(slot)));
    }
  }
  if (const std::optional<JsonValue> table = file.find("table")) {
    description.surface = surface_of(*table);
  }
  if (const std::optional<JsonValue> from = file.find("from")) {
    read_origin(*from, description);
  }
  std::optional<Positioner> positioner;
  faces.check([&] { positioner.emplace(std::move(description)); });
  return *positioner;
}

Positioner read_positioner(const std::string& path) {
  return parse_positioner(read_whole_file(path), path);
}

std::string positioner_json(const Positioner& positioner) {
  const PositionerDescription& description = positioner.description();
  Json json = {{"format", "axiscal-positioner"}, {"version", 1}, {"id", description.id}};
  if (!description.created.empty()) {
    json["created"] = description.created;
  }
  if (!description.software.empty()) {
    json["software"] = description.software;
  }
  for (const Face face : all_faces) {
    json["faces"][std::string(face_name(face))] =
        json_of(description.faces[static_cast<std::size_t>(face)], positioner.normal(face));
  }
  if (description.normal_covariance) {
    json["normal_covariance"] = json_from_matrix(*description.normal_covariance);
  }
  for (const Mount& mount : description.mounts) {
    Json& own = json["mounts"][mount.slot];
    own["rotation_sensor_from_positioner"] =
        json_from_matrix(mount.rotation_sensor_from_positioner);
    if (mount.repeatability_rad > 0.0) {
      own["repeatability_rad"] = mount.repeatability_rad;
    }
  }
  if (says_something(description.surface)) {
    json["table"] = json_of(description.surface);
  }
  if (!description.from.empty() || !description.notes.empty()) {
    Json references = Json::array();
    for (const MeasuredFrom& from : description.from) {
      references.push_back(
          {{"slot", from.slot}, {"record", from.record}, {"observations", from.observations}});
    }
    json["from"] = {{"references", references}, {"notes", description.notes}};
  }
  return json_text(json);
}

}  // namespace axiscal
