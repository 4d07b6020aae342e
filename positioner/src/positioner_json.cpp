// SPDX-License-Identifier: Apache-2.0
#include "axiscal/positioner/positioner_json.hpp"

#include <algorithm>
#include <array>

#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/json_document.hpp"

namespace axiscal {
namespace {

constexpr std::array<std::string_view, 4> file_keys = {"format", "version", "id", "faces"};
constexpr std::array<std::string_view, 1> face_keys = {"normal"};

// Known to the file format, but this version cannot use them and must not pass them over.
void reject_later_keys(const JsonValue& value, std::initializer_list<std::string_view> keys) {
  for (const std::string_view key : keys) {
    if (const std::optional<JsonValue> later = value.find(key)) {
      later->fail("this version of axiscal reads face normals only and cannot use this key");
    }
  }
}

}  // namespace

Positioner parse_positioner(std::string_view text, const std::string& path) {
  const JsonValue file = parse_json(text, path);
  file.require_format("axiscal-positioner");
  reject_later_keys(file, {"normal_covariance", "mounts", "table"});
  file.allow_keys(file_keys);
  const std::optional<JsonValue> id = file.find("id");
  const JsonValue faces = file.at("faces");
  std::array<std::string_view, all_faces.size()> names;
  std::transform(all_faces.begin(), all_faces.end(), names.begin(), face_name);
  faces.allow_keys(names);
  std::array<Eigen::Vector3d, 6> normals;
  for (const Face face : all_faces) {
    const JsonValue entry = faces.at(face_name(face));
    reject_later_keys(entry, {"feet"});
    entry.allow_keys(face_keys);
    const JsonValue normal = entry.at("normal");
    const Eigen::Vector3d n = normal.vector(3);
    if (const std::string defect = defect_of_normal(face, n); !defect.empty()) {
      normal.fail(defect);
    }
    normals[static_cast<std::size_t>(face)] = n;
  }
  return Positioner(normals, id ? id->text() : "");
}

Positioner read_positioner(const std::string& path) {
  return parse_positioner(read_whole_file(path), path);
}

}  // namespace axiscal
