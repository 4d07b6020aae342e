// SPDX-License-Identifier: Apache-2.0
#include "calib/calibrate/src/stated_attitudes.hpp"

#include <algorithm>
#include <cmath>

#include "axiscal/calib/method_kind.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/field/settings.hpp"
#include "axiscal/field/table_field.hpp"
#include "axiscal/instruments/inclination.hpp"
#include "core/formatted.hpp"

namespace axiscal {

bool has_attitudes(const Observations& observations) {
  return std::any_of(observations.readings.begin(), observations.readings.end(),
                     [](const Reading& reading) { return reading.attitude.has_value(); });
}

bool takes_attitudes(const Experiment& experiment, const Observations& observations) {
  const MethodKind& method = method_kind(experiment.fit.method.value_or(Method::known));
  if (!has_attitudes(observations) || (method.fits_sensitivity && !method.directions_known)) {
    return false;
  }
  const FieldSetup& field = experiment.field;
  const bool is_known = experiment.table.site || field.in_table;
  return method.fits_sensitivity || is_known || !field_kind(field.kind()).rotation;
}

Observations with_fields_of_attitudes(const Experiment& experiment, Observations observations) {
  if (field_moves(experiment)) {
    throw SetupError(experiment.field.moving_part()->of->moving_name() +
                         " moves while the readings are taken, so attitudes cannot be used; give "
                         "fx, fy, fz for each reading",
                     {settings::field});
  }
  std::vector<FieldDescription> parts = resolve_field(experiment);
  for (FieldDescription& part : parts) {
    if (!part.in_table && !field_kind(part.kind).local && parts.size() == 1) {
      // By default, the field is along the table's normal and points up.
      part.in_table = part.magnitude * Eigen::Vector3d::UnitZ();
    }
    if (!part.in_table) {
      throw SetupError(
          "attitudes require the direction of the field in the table's frame: give the site, or "
          "the field's vector in this frame ('in_table')",
          {settings::field_table});
    }
  }
  const TableField field = TableField(parts).as_stated();
  constexpr double upright = 1e-9;
  const Eigen::Vector3d mean = field.mean();
  const bool turns_with_heading = mean.head<2>().norm() > upright * mean.norm();
  for (Reading& reading : observations.readings) {
    if (!reading.attitude) {
      throw RefusedError(formatted(
          "run {}: the attitude (pitch_deg, roll_deg) is missing, but other readings have one",
          reading.run));
    }
    if (turns_with_heading && !reading.attitude->heading_rad) {
      throw RefusedError(
          formatted("run {}: field {} is not vertical, so pitch and roll do not determine its "
                    "direction in the instrument; also give 'heading_deg' (clockwise from north)",
                    reading.run, experiment.field.kind()));
    }
    const double heading_rad = reading.attitude->heading_rad.value_or(0.0) -
                               experiment.table.fence_azimuth_rad.value_or(0.0);
    const Eigen::Matrix3d R =
        rotation_sensor_from_level(reading.attitude->pitch_rad, reading.attitude->roll_rad,
                                   heading_rad, experiment.instrument.convention);
    reading.field_in_sensor =
        experiment.rotation_sensor_from_positioner * (R * field.at(reading.level));
  }
  return observations;
}

}  // namespace axiscal
