// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/journal_point.hpp"

#include <optional>

namespace axiscal {
namespace {

Face face_of(const JsonValue& value) {
  const std::optional<Face> face = parse_face(value.text());
  if (!face) {
    value.fail("must be a face (+X, -X, +Y, -Y, +Z or -Z)");
  }
  return *face;
}

}  // namespace

void put_point(Json& entry, const DesignPoint& point) {
  entry["rest"] = face_name(point.rest());
  entry["fence"] = face_name(point.fence());
}

DesignPoint point_of(const JsonValue& entry) {
  const Face rest = face_of(entry.at("rest"));
  const Face fence = face_of(entry.at("fence"));
  if (axis_of(rest) == axis_of(fence)) {
    entry.at("fence").fail("the fence face is on the same axis as the rest face");
  }
  return {rest, fence};
}

}  // namespace axiscal
