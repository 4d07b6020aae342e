// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/moving_field.hpp"

#include <algorithm>
#include <string>

#include "axiscal/calib/resolved_field.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/field/sun.hpp"

namespace axiscal {
namespace {

bool moves(const FieldPart& part) {
  return part.custom ? part.custom->moves() : part.sun;
}

const FieldPart* moving_part(const FieldSetup& field) {
  if (moves(field)) {
    return &field;
  }
  const auto other = std::find_if(field.others.begin(), field.others.end(), moves);
  return other == field.others.end() ? nullptr : &*other;
}

// Frame enu; of a field that is made on the table that one's.
Eigen::Vector3d value_of(const FieldSetup& field, const FieldPart& part, double time_s) {
  if (part.custom) {
    return part.custom->value_in_enu_at(time_s);
  }
  if (!field.site) {
    throw SetupError("the sun's place needs the site: latitude and longitude", {Setting::site});
  }
  return sun_position(*field.site, time_s, part.refraction).direction_in_enu;
}

std::string name_of(const FieldPart& part) {
  return part.custom ? "the field " + std::string(part.custom->kind()) : std::string("the sun");
}

}  // namespace

bool field_moves(const Experiment& experiment) {
  return moving_part(experiment.field) != nullptr;
}

std::string moving_field_name(const Experiment& experiment) {
  const FieldPart* const moving = moving_part(experiment.field);
  return moving == nullptr ? "" : moving->custom ? name_of(*moving) : "the sun's place";
}

Eigen::Matrix3d change_of_field(const Experiment& experiment, double from_s, double to_s) {
  const FieldPart* const moving = moving_part(experiment.field);
  if (moving == nullptr) {
    return Eigen::Matrix3d::Identity();
  }
  const bool on_table = moving->custom && moving->custom->is_induced();
  if (!on_table && !experiment.fence_azimuth_rad) {
    throw SetupError(name_of(*moving) +
                         " moves between the readings; how it does in the table needs the fence's "
                         "azimuth, to a few degrees",
                     {Setting::fence_azimuth});
  }
  if (!experiment.field.others.empty() || !experiment.also.empty()) {
    throw SetupError(moving->custom ? name_of(*moving) + " moves, and so goes with no other field"
                                    : "field light by the sun goes with no other field");
  }
  Eigen::Matrix3d rotation_table_from_its = Eigen::Matrix3d::Identity();
  if (!on_table) {
    rotation_table_from_its = rotation_sloping_from_level(experiment.slope) *
                              rotation_table_from_enu(*experiment.fence_azimuth_rad);
  }
  const Eigen::Vector3d from = value_of(experiment.field, *moving, from_s);
  const Eigen::Vector3d to = value_of(experiment.field, *moving, to_s);
  if (!(from.norm() > 0.0 && to.norm() > 0.0)) {
    throw RefusedError(name_of(*moving) + " vanishes while readings are taken");
  }
  return to.norm() / from.norm() *
         smallest_rotation((rotation_table_from_its * from).normalized(),
                           (rotation_table_from_its * to).normalized());
}

FieldDescription make_field_description(const Experiment& experiment, double time_s) {
  return describe_field(experiment, resolve_field(experiment, time_s));
}

}  // namespace axiscal
