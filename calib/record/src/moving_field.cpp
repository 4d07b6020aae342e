// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/moving_field.hpp"

#include "axiscal/calib/resolved_field.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/field/sun.hpp"

namespace axiscal {
namespace {

const FieldPart* sun_part(const FieldSetup& field) {
  if (field.sun) {
    return &field;
  }
  for (const FieldPart& part : field.others) {
    if (part.sun) {
      return &part;
    }
  }
  return nullptr;
}

}  // namespace

bool field_moves(const Experiment& experiment) {
  return sun_part(experiment.field) != nullptr;
}

Eigen::Matrix3d turn_of_field(const Experiment& experiment, double from_s, double to_s) {
  const FieldPart* const sun = sun_part(experiment.field);
  if (sun == nullptr) {
    return Eigen::Matrix3d::Identity();
  }
  if (!experiment.fence_azimuth_rad) {
    throw SetupError(
        "the sun moves between the readings; how it does in the table needs --fence-azimuth, to a "
        "few degrees");
  }
  if (!experiment.field.others.empty() || !experiment.also.empty()) {
    throw SetupError("field light by the sun goes with no other field");
  }
  if (!experiment.field.site) {
    throw SetupError("the sun's place needs the site: --latitude and --longitude");
  }
  const Eigen::Matrix3d rotation_table_from_level =
      rotation_sloping_from_level(experiment.slope) *
      rotation_table_from_enu(*experiment.fence_azimuth_rad);
  const auto direction_at = [&](double time_s) -> Eigen::Vector3d {
    return rotation_table_from_level *
           sun_position(*experiment.field.site, time_s, sun->refraction).direction_in_enu;
  };
  return smallest_rotation(direction_at(from_s), direction_at(to_s));
}

FieldDescription make_field_description(const Experiment& experiment, double time_s) {
  return describe_field(experiment, resolve_field(experiment, time_s));
}

}  // namespace axiscal
