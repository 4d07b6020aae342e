// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/experiment.hpp"

#include "axiscal/core/error.hpp"
#include "axiscal/field/field_unit.hpp"
#include "axiscal/instruments/instrument_kind.hpp"

namespace axiscal {

void set_default_field(const Instrument& instrument, const TablePlace& place, FieldSetup& field) {
  if (field.is_stated() || instrument.kind.empty()) {
    return;
  }
  const InstrumentKind& kind = find_instrument_kind(instrument.kind);
  const bool has_size = field.magnitude || !field.unit.empty() || field.in_table ||
                        (place.site && place.has_longitude);
  field.of = make_field(kind.relative_field_will_do && !has_size ? "custom" : kind.usual_field);
}

void set_default_field(Experiment& experiment) {
  set_default_field(experiment.instrument, experiment.table, experiment.field);
  for (SlotSetup& slot : experiment.slots) {
    set_default_field(slot.instrument, experiment.table, slot.field);
  }
}

std::optional<double> expected_sensitivity(const Experiment& experiment,
                                           const std::string& field_unit) {
  if (experiment.nominal_sensitivity) {
    return experiment.nominal_sensitivity;
  }
  const std::string& unit = experiment.instrument.unit;
  if (unit == "1" || unit.empty()) {
    return {};
  }
  return reading_factor_between(field_unit, unit);
}

std::vector<FieldDescription> resolve_field(const Experiment& experiment,
                                            std::optional<double> time_s,
                                            std::optional<double> largest) {
  return resolve_field(
      experiment.field, experiment.table,
      {.time_s = time_s, .reading_unit = experiment.instrument.unit, .largest = largest});
}

FieldDescription make_field_description(const Experiment& experiment,
                                        std::optional<double> time_s,
                                        std::optional<double> largest) {
  return describe_field(experiment.table, resolve_field(experiment, time_s, largest));
}

bool field_moves(const Experiment& experiment) {
  return experiment.field.moving_part() != nullptr;
}

Eigen::Matrix3d change_of_field(const Experiment& experiment, double from_s, double to_s) {
  const FieldSetup* const moving = experiment.field.moving_part();
  if (moving != nullptr && !experiment.also.empty()) {
    throw SetupError(moving->of->moving_name() +
                     " moves, so it cannot be combined with second fields ('also')");
  }
  return change_of_field(experiment.field, experiment.table, from_s, to_s);
}

}  // namespace axiscal
