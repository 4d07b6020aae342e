// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "axiscal/calib/reduction.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/field/field_unit.hpp"
#include "calib/apply/src/changed_parameters.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns the factor by which each parameter changes if the field's unit changes.
Eigen::VectorXd units_of_parameters(const std::vector<std::string>& names, double factor) {
  Eigen::VectorXd units(static_cast<Eigen::Index>(names.size()));
  for (std::size_t i = 0; i < names.size(); ++i) {
    const bool per_field = names[i].find(".sensitivity.") != std::string::npos;
    units(static_cast<Eigen::Index>(i)) = per_field ? 1.0 / factor : 1.0;
  }
  return units;
}

// Returns the value of 1 g at the place of the record [m/s^2].
double gravity_of(const FieldDescription& field) {
  if (field.unit == "m/s^2") {
    return field.magnitude;
  }
  if (!field.local_gravity) {
    throw DomainError(
        "the field in the record is in g, but the record does not state local gravity; calibrate "
        "again with the site's latitude and height, or with the field in m/s^2");
  }
  return *field.local_gravity;
}

double relative(double u, double value) {
  return value > 0.0 ? u / value : 0.0;
}

// Returns the relative uncertainty of the calibration's field in SI units. It is 0 for a sum of
// fields, because each part has its own source of uncertainty in the record.
double relative_u_of_field(const FieldDescription& field) {
  if (!field.parts.empty()) {
    return 0.0;
  }
  return field.unit == "g" ? relative(field.local_gravity_u, field.local_gravity.value_or(0.0))
                           : relative(field.magnitude_u, field.magnitude);
}

// Converts a field other than gravity, or gravity if unit and place do not change.
FieldConversion plain_conversion(const FieldDescription& field,
                                 const std::string& unit,
                                 const FieldAtReadings& there) {
  FieldConversion conversion{.unit = unit};
  conversion.factor = factor_between(field.unit, unit);
  const double as_calibrated = conversion.factor * field.magnitude;
  conversion.magnitude = there.magnitude.value_or(as_calibrated);
  // If the unit is g, the magnitude of the record's field is exact by definition.
  const double here_u = field.unit == "g" ? 0.0 : relative_u_of_field(field);
  conversion.component_u = here_u;
  if (conversion.magnitude != as_calibrated || there.magnitude_u > 0.0) {
    conversion.ratio_u = std::hypot(here_u, relative(there.magnitude_u, conversion.magnitude));
  }
  return conversion;
}

// Converts gravity to another place, or between g and m/s^2.
FieldConversion gravity_conversion(const FieldDescription& field,
                                   const std::string& unit,
                                   const FieldAtReadings& there) {
  FieldConversion conversion{.unit = unit};
  const double here = gravity_of(field);  // the value of 1 g in the record
  const double at_record = field.unit == "g" ? here * field.magnitude : field.magnitude;
  const double gravity_there = there.gravity_m_s2.value_or(at_record);
  constexpr double same = 1e-9;
  const bool elsewhere = std::abs(gravity_there / at_record - 1.0) > same;
  const double here_u = relative_u_of_field(field);
  const double there_u = elsewhere ? relative(there.gravity_u_m_s2, gravity_there) : here_u;
  if (unit == "m/s^2") {
    conversion.factor = field.unit == "g" ? here : 1.0;
    conversion.magnitude = there.magnitude.value_or(gravity_there);
    conversion.component_u = here_u;
  } else {
    conversion.factor = (field.unit == "g" ? here : 1.0) / gravity_there;
    conversion.magnitude = there.magnitude.value_or(1.0);
    conversion.component_u = elsewhere ? std::hypot(here_u, there_u) : 0.0;
  }
  if (there.magnitude && unit == "m/s^2") {
    conversion.ratio_u = std::hypot(here_u, relative(there.magnitude_u, *there.magnitude));
  } else {
    conversion.ratio_u = std::hypot(elsewhere ? std::hypot(here_u, there_u) : 0.0,
                                    relative(there.magnitude_u, conversion.magnitude));
  }
  return conversion;
}

}  // namespace

FieldConversion field_conversion(const FieldDescription& field,
                                 const std::string& unit,
                                 const FieldAtReadings& there) {
  const std::string& wanted = unit.empty() ? field.unit : unit;
  const bool gravity =
      field.unit == "g" || (field.unit == "m/s^2" && field_kind(field.kind).vertical);
  if (!gravity) {
    return plain_conversion(field, wanted, there);
  }
  if (wanted != "g" && wanted != "m/s^2") {
    throw DomainError(formatted("the unit '{}' cannot be converted to '{}'", field.unit, wanted));
  }
  return wanted == field.unit && !there.gravity_m_s2 ? plain_conversion(field, wanted, there)
                                                     : gravity_conversion(field, wanted, there);
}

Calibration converted(Calibration calibration, const FieldConversion& conversion) {
  const double factor = conversion.factor;
  FieldDescription& field = calibration.sensor.field;
  calibration.sensor.response.sensitivity /= factor;
  if (conversion.unit != "g") {
    field.local_gravity.reset();
  } else if (field.unit == "m/s^2" || field.local_gravity) {
    field.local_gravity = (field.unit == "m/s^2" ? 1.0 : *field.local_gravity) / factor;
  }
  const double scale = conversion.magnitude / field.magnitude;
  const std::string old_unit = field.unit;
  field.unit = conversion.unit;
  field.magnitude = conversion.magnitude;
  field.magnitude_u *= scale;
  if (field.in_table) {
    *field.in_table *= scale;
  }
  if (field.in_table_covariance) {
    *field.in_table_covariance *= scale * scale;
  }
  for (FieldDescription& part : field.parts) {
    part.magnitude *= scale;
    if (part.in_table) {
      *part.in_table *= scale;
    }
  }
  if (calibration.fit.statistics) {
    FitStatistics& statistics = *calibration.fit.statistics;
    statistics.sensitivity_se /= factor;
    const Eigen::VectorXd units = units_of_parameters(statistics.parameter_names, factor);
    transform_parameters(units.asDiagonal().toDenseMatrix(), calibration.fit);
    calibration.fit.conditions.sensitivity_mean_square /= factor * factor;
    if (calibration.fit.uncertainty) {
      for (UncertaintySource& source : calibration.fit.uncertainty->sources) {
        const bool of_field = source.covariance.size() > 0 && source.input_unit == old_unit;
        source.input_u *= of_field ? factor : 1.0;
        source.input_unit = of_field ? field.unit : source.input_unit;
      }
    }
  }
  for (ReadingResidual& residual : calibration.fit.residuals) {
    residual.magnitude *= factor;
  }
  return calibration;
}

Calibration in_assembly_frame(Calibration calibration) {
  SensorModel& sensor = calibration.sensor;
  if (!sensor.rotation_sensor_from_assembly) {
    return calibration;
  }
  const Eigen::Matrix3d mount = *sensor.rotation_sensor_from_assembly;
  sensor.rotation_sensor_from_assembly.reset();
  sensor.response.sensitivity *= mount;
  for (AlsoResponse& also : sensor.also) {
    also.sensitivity *= mount;
  }
  if (!calibration.fit.statistics) {
    return calibration;
  }
  // Each row of sensitivities is rotated like the components of the field.
  const std::vector<std::string>& names = calibration.fit.statistics->parameter_names;
  const auto count = static_cast<Eigen::Index>(names.size());
  Eigen::MatrixXd T = Eigen::MatrixXd::Identity(count, count);
  for (Eigen::Index i = 0; i + 2 < count; ++i) {
    if (names[static_cast<std::size_t>(i)].ends_with(".x")) {
      T.block<3, 3>(i, i) = mount.transpose();
    }
  }
  transform_parameters(T, calibration.fit);
  // These variances are transformed as if the three components were independent.
  calibration.fit.conditions.sensitivity_mean_square *= mount.cwiseAbs2();
  FitStatistics& statistics = *calibration.fit.statistics;
  for (Eigen::Index k = 0; k < statistics.sensitivity_se.rows(); ++k) {
    const std::string& axis = sensor.instrument.axes[static_cast<std::size_t>(k)];
    for (Eigen::Index j = 0; j < 3; ++j) {
      const auto at = statistics.position_of(axis + ".sensitivity." + "xyz"[j]);
      if (at && statistics.covariance.rows() > *at) {
        statistics.sensitivity_se(k, j) = std::sqrt(statistics.covariance(*at, *at));
      }
    }
  }
  return calibration;
}

}  // namespace axiscal
