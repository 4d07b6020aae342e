// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/simulate.hpp"

#include <cmath>
#include <cstddef>

#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/field/field_kind.hpp"
#include "troubles.hpp"

namespace axiscal {

Calibration on_level_table(Calibration truth) {
  FieldDescription& field = truth.field;
  // What gravity, or else a turntable's axis, says of the table's slope.
  const Eigen::Vector3d* up = nullptr;
  if (field.parts.empty() && field.in_table && field_kind(field.kind).along_normal) {
    up = &*field.in_table;
  }
  for (const FieldPartDescription& part : field.parts) {
    up = field_kind(part.kind).vertical ? &part.in_table : up;
  }
  for (const AlsoResponse& also : truth.also) {
    up = field_kind(also.kind).vertical ? &also.in_table : up;
  }
  if (up == nullptr) {
    return truth;  // its slope is not known from the record
  }
  const Eigen::Vector3d direction = (up->z() < 0.0 ? -1.0 : 1.0) * up->normalized();
  constexpr double least_height = 0.1;  // a field in the table's plane tells no slope
  if (direction.z() < least_height) {
    return truth;
  }
  const Eigen::Matrix3d level_from_sloping =
      rotation_sloping_from_level({direction.x(), direction.y()}).transpose();
  if (field.in_table && field.parts.empty()) {
    field.in_table = level_from_sloping * *field.in_table;
  }
  for (FieldPartDescription& part : field.parts) {
    if (!part.set_by_level) {
      part.in_table = level_from_sloping * part.in_table;
    }
  }
  for (AlsoResponse& also : truth.also) {
    also.in_table = level_from_sloping * also.in_table;
  }
  return truth;
}

Calibration with_field_of_site(Calibration truth) {
  FieldDescription& field = truth.field;
  if (field.in_table || !field.site || !field.parts.empty()) {
    return truth;
  }
  Experiment experiment;
  experiment.field.kind = field.kind;
  experiment.field.unit = field.unit;
  experiment.field.magnitude = field.magnitude;
  experiment.field.site = field.site;
  experiment.field.date = field.date;
  experiment.field.model = field.model;
  experiment.fence_azimuth_rad = 0.0;
  field.in_table = make_field_description(experiment).in_table;
  return truth;
}

SimulatedRun simulate_run(const Calibration& truth,
                          const std::vector<RunSheetRow>& sheet,
                          const SimulationOptions& options) {
  check_simulation(truth, options);
  // Of a sum what is made on the table stays as it is when the table is tilted or turned. A field
  // alone is always turned: a lamp or coil that does not stand as the record says.
  const Eigen::Matrix3d turned = rotation_sloping_from_level(options.slope) *
                                 rotation_table_from_enu(options.fence_azimuth_rad);
  std::vector<Eigen::Vector3d> parts;
  for (const FieldPartDescription& part : truth.field.parts) {
    parts.emplace_back(part.set_by_level ? part.in_table : Eigen::Vector3d(turned * part.in_table));
  }
  const TableField sum = parts.empty() ? TableField() : TableField(truth.field.parts);
  const auto field_in_table = [&](double level) -> Eigen::Vector3d {
    return parts.empty() ? Eigen::Vector3d(turned * truth.field.at_level(level))
                         : sum.at(parts, level);
  };
  RandomStream random(options.seed, 1 + options.stream);
  const Eigen::VectorXd noise_sd = noise_of_axes(options, truth.response.bias.size());
  Troubles troubles(options.world, noise_sd, options.seed, options.stream, sheet.size());
  SimulatedRun run;
  Observations& observations = run.observations;
  observations.has_block = true;
  observations.response.resize(static_cast<Eigen::Index>(sheet.size()), truth.response.bias.size());
  observations.readings = readings_of(sheet);
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    const RunSheetRow& row = sheet[i];
    std::optional<double>& temperature = observations.readings[i].temperature;
    if (temperature && options.temperature_sd > 0.0) {
      *temperature += options.temperature_sd * random.normal();
    }
    observations.has_level = observations.has_level || row.entry.level != 1.0;
    troubles.next(row.block);
    troubles.lay();
    if (options.world.mount_rad > 0.0) {
      observations.readings[i].mount = row.block;
    }
    const Eigen::Matrix3d rotation_sensor_from_table = troubles.as_seated(
        options.rotation_sensor_from_positioner *
        options.positioner.rotation_table_from_positioner(row.entry.point).transpose());
    const Eigen::Vector3d field_in_sensor =
        rotation_sensor_from_table * field_in_table(row.entry.level);
    Eigen::VectorXd response = response_at(truth, field_in_sensor, temperature) +
                               nonlinear_part(options.world, truth, field_in_sensor);
    if (truth.instrument.one_sided) {
      // No light from behind: what is left is the dark reading.
      response = response.cwiseMax(truth.response.bias);
    }
    for (const AlsoResponse& also : truth.also) {
      response += also.sensitivity * (rotation_sensor_from_table * (turned * also.in_table));
    }
    response += troubles.added(random);
    observations.response.row(static_cast<Eigen::Index>(i)) = rounded(std::move(response), options);
  }
  if (!observations.response.allFinite()) {
    throw DomainError("simulate: noise or field are so large that readings overflow");
  }
  run.bias_of_run = troubles.bias_of_run();
  return run;
}

Observations simulate(const Calibration& truth,
                      const std::vector<RunSheetRow>& sheet,
                      const SimulationOptions& options) {
  return simulate_run(truth, sheet, options).observations;
}

}  // namespace axiscal
