// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/simulate.hpp"

#include <cmath>
#include <cstddef>
#include <utility>

#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/lit_response.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/field/field_setup.hpp"
#include "axiscal/field/table_field.hpp"
#include "calib/plan/src/world_effects.hpp"
#include "core/formatted.hpp"

namespace axiscal {

SensorModel on_level_table(SensorModel truth) {
  FieldDescription& field = truth.field;
  // The vertical in the table's frame: the direction of gravity or, without gravity, the axis of a
  // turntable.
  const Eigen::Vector3d* up = nullptr;
  if (field.parts.empty() && field.in_table && field_kind(field.kind).along_normal) {
    up = &*field.in_table;
  }
  for (const FieldDescription& part : field.parts) {
    up = part.in_table && field_kind(part.kind).vertical ? &*part.in_table : up;
  }
  for (const AlsoResponse& also : truth.also) {
    up = field_kind(also.kind).vertical ? &also.in_table : up;
  }
  if (up == nullptr) {
    return truth;  // the record does not determine the slope
  }
  const Eigen::Vector3d direction = (up->z() < 0.0 ? -1.0 : 1.0) * up->normalized();
  // A direction with a smaller component z is nearly in the table's plane, so it does not determine
  // the slope.
  constexpr double least_height = 0.1;
  if (direction.z() < least_height) {
    return truth;
  }
  const Eigen::Matrix3d level_from_sloping =
      rotation_sloping_from_level({direction.x(), direction.y()}).transpose();
  if (field.in_table && field.parts.empty()) {
    field.in_table = level_from_sloping * *field.in_table;
  }
  for (FieldDescription& part : field.parts) {
    if (!part.set_by_level && part.in_table) {
      part.in_table = level_from_sloping * *part.in_table;
    }
  }
  for (AlsoResponse& also : truth.also) {
    also.in_table = level_from_sloping * also.in_table;
  }
  return truth;
}

SensorModel with_field_of_site(SensorModel truth) {
  FieldDescription& field = truth.field;
  if (field.in_table || !field.site || !field.parts.empty()) {
    return truth;
  }
  Experiment experiment;
  experiment.field = setup_of(field, false);
  experiment.table.site = field.site;
  experiment.table.date = field.date;
  experiment.table.fence_azimuth_rad = 0.0;
  field.in_table = make_field_description(experiment).in_table;
  return truth;
}

SimulatedRun simulate_run(const SensorModel& truth,
                          const std::vector<RunSheetRow>& sheet,
                          const SimulationOptions& options) {
  RandomStream random = stream_of_noise(options);
  return simulate_run(truth, sheet, options, random);
}

RandomStream stream_of_noise(const SimulationOptions& options) {
  return RandomStream(options.seed, 1 + options.stream);
}

SimulatedRun simulate_run(const SensorModel& truth,
                          const std::vector<RunSheetRow>& sheet,
                          const SimulationOptions& options,
                          RandomStream& random) {
  check_simulation(truth, options);
  // The slope and the azimuth of the fence do not rotate a part of a sum of fields whose source is
  // on the table, because the source moves with the table. A single field is always rotated, even
  // if its source, a lamp or a coil, is on the table.
  const Eigen::Matrix3d turned = rotation_sloping_from_level(options.slope) *
                                 rotation_table_from_enu(options.fence_azimuth_rad);
  const bool is_sum = !truth.field.parts.empty();
  std::vector<Eigen::Vector3d> vectors;
  for (const FieldDescription& part : truth.field.as_parts()) {
    const Eigen::Vector3d value =
        part.in_table.value_or(Eigen::Vector3d(0.0, 0.0, is_sum ? 0.0 : part.magnitude));
    const bool stays = is_sum && part.set_by_level;
    vectors.emplace_back(stays ? value : Eigen::Vector3d(turned * value));
  }
  const TableField field = TableField(truth.field.as_parts()).with(std::move(vectors));
  const Eigen::VectorXd noise_sd = noise_of_axes(options, truth.response.bias.size());
  WorldEffects troubles(options.world, noise_sd, options.seed, options.stream, sheet.size());
  SimulatedRun run;
  Observations& observations = run.observations;
  observations.has_block = true;
  observations.response.resize(static_cast<Eigen::Index>(sheet.size()), truth.response.bias.size());
  observations.readings = readings_of(sheet);
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    const RunSheetRow& row = sheet[i];
    std::optional<SensorTemperature>& temperature = observations.readings[i].temperature;
    if (temperature && options.temperature_sd > 0.0) {
      *temperature = temperature->changed_by(options.temperature_sd * random.normal());
    }
    observations.has_level = observations.has_level || row.entry.level != FieldLevel(1.0);
    troubles.next(row.block);
    troubles.lay();
    if (options.world.mount_rad > 0.0) {
      observations.readings[i].mount = row.block;
    }
    const Eigen::Matrix3d rotation_sensor_from_table = troubles.as_seated(
        options.rotation_sensor_from_positioner *
        options.positioner.rotation_table_from_positioner(row.entry.point).transpose());
    const Eigen::Vector3d field_in_sensor =
        troubles.size_of_field() * (rotation_sensor_from_table * field.at(row.entry.level));
    Eigen::VectorXd response = truth.instrument.one_sided
                                   ? light_response_at(truth, field, row.entry.level,
                                                       rotation_sensor_from_table, temperature)
                                   : response_at(truth, field_in_sensor, temperature);
    response +=
        (troubles.gains().array() - 1.0).matrix().cwiseProduct(response - truth.response.bias);
    response += nonlinear_part(options.world, truth, field_in_sensor);
    for (const AlsoResponse& also : truth.also) {
      response += also.sensitivity * (rotation_sensor_from_table * (turned * also.in_table));
    }
    response += troubles.added(random, [&] { return parts_along(truth, field_in_sensor); });
    observations.response.row(static_cast<Eigen::Index>(i)) = rounded(std::move(response), options);
  }
  if (!observations.response.allFinite()) {
    throw DomainError("simulate: noise or field are so large that readings overflow");
  }
  run.bias_of_run = troubles.bias_of_run();
  return run;
}

Observations simulate(const SensorModel& truth,
                      const std::vector<RunSheetRow>& sheet,
                      const SimulationOptions& options) {
  return simulate_run(truth, sheet, options).observations;
}

}  // namespace axiscal
