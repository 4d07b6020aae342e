// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/resolved_field.hpp"

#include <algorithm>
#include <cmath>

#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/field/field_unit.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "part_resolver.hpp"

namespace axiscal {
namespace {

void convert(ResolvedPart& part, const std::string& unit) {
  double factor = 1.0;
  try {
    factor = factor_between(part.unit, unit);
  } catch (const DomainError&) {
    throw SetupError(
        formatted("field: its parts must be of one quantity; {} is in {}, the first part in {}",
                  part.part.kind, part.unit, unit));
  }
  part.part.magnitude *= factor;
  part.part.in_table *= factor;
  part.part.magnitude_u *= factor;
  part.unit = unit;
}

}  // namespace

void check_field_kind(const std::string& kind) {
  if (field_kind(kind).name.empty()) {
    std::vector<std::string_view> names;
    for (const FieldKind& known : field_kinds()) {
      names.push_back(known.name);
    }
    throw SetupError(
        formatted("unknown field '{}'{}", kind,
                  did_you_mean(kind, names, "this version knows: " + list_of_field_kinds())));
  }
}

void take_usual_field(Experiment& experiment) {
  if (experiment.field.kind.empty() && !experiment.field.custom &&
      !experiment.instrument.kind.empty()) {
    experiment.field.kind = find_instrument_kind(experiment.instrument.kind).usual_field;
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

void check_field_unit(const std::string& kind, const std::string& unit) {
  const auto units = field_kind(kind).units;
  if (!units.empty() && std::find(units.begin(), units.end(), unit) == units.end()) {
    const std::vector<std::string> names(units.begin(), units.end());
    throw SetupError(
        formatted("field {}: the unit must be {}, not '{}'", kind, joined(names, " or "), unit));
  }
}

bool is_made_on_table(const FieldPart& part) {
  if (part.custom) {
    return part.custom->is_induced();
  }
  return part.role ? *part.role == FieldRole::induced : !field_kind(part.kind).local;
}

ResolvedPart resolve_part(const Experiment& experiment,
                          const FieldPart& part,
                          std::optional<double> time_s) {
  return PartResolver(experiment, part, time_s).resolve();
}

std::vector<ResolvedPart> resolve_field(const Experiment& experiment,
                                        std::optional<double> time_s) {
  const FieldSetup& setup = experiment.field;
  if (setup.site) {
    check_site(*setup.site);
  }
  if (!(experiment.slope.norm() < 1.0)) {
    throw SetupError("the table's slope: X^2 + Y^2 must be less than 1", {Setting::slope});
  }
  if (setup.in_table && experiment.slope.norm() > 0.0) {
    throw SetupError(
        "the slope and the field's vector both say how the field lies in the table; state one of "
        "them",
        {Setting::slope, Setting::field_table});
  }
  std::vector<ResolvedPart> parts = {resolve_part(experiment, setup, time_s)};
  for (const FieldPart& other : setup.others) {
    parts.push_back(resolve_part(experiment, other, time_s));
    convert(parts.back(), parts.front().unit);
  }
  if (parts.size() == 1 && parts.front().part.free_length) {
    throw SetupError(
        formatted(
            "field {}: its magnitude is not known; state it, its vector in the table, or a coil",
            parts.front().part.kind),
        {Setting::field_table, Setting::field_magnitude});
  }
  const bool all_free = std::all_of(parts.begin(), parts.end(),
                                    [](const ResolvedPart& part) { return part.part.free_length; });
  if (all_free) {
    throw SetupError("field: of no part the magnitude is known, so nothing fixes the scale");
  }
  const auto turning = std::count_if(parts.begin(), parts.end(),
                                     [](const ResolvedPart& part) { return part.part.turning; });
  if (turning > 1) {
    throw SetupError("field: a table turns about one axis; give one induced_rotation");
  }
  return parts;
}

FieldDescription describe_field(const Experiment& experiment,
                                const std::vector<ResolvedPart>& parts) {
  const FieldSetup& setup = experiment.field;
  FieldDescription field;
  field.unit = parts.front().unit;
  for (const ResolvedPart& part : parts) {
    field.model = field.model.empty() ? part.model : field.model;
  }
  field.local_gravity = parts.front().local_gravity;
  field.local_gravity_u = parts.front().local_gravity_u;
  field.site = setup.site;
  field.date = setup.date;
  const bool dated = std::any_of(parts.begin(), parts.end(), [](const ResolvedPart& part) {
    return field_kind(part.part.kind).dated && !part.model.empty();
  });
  if (field.date.empty() && dated) {
    field.date = timestamp_now().substr(0, 10);  // the model's field changes with it
  }
  if (parts.size() == 1) {
    const ResolvedPart& only = parts.front();
    field.kind = only.part.kind;
    field.magnitude = only.part.magnitude;
    field.magnitude_u = only.part.magnitude_u;
    if (only.has_value) {
      field.in_table = only.part.in_table;
    }
    return field;
  }
  bool has_value = true;
  for (const ResolvedPart& part : parts) {
    field.kind += (field.kind.empty() ? "" : "+") + part.part.kind;
    field.parts.push_back(part.part);
    field.magnitude_u = std::hypot(field.magnitude_u, part.part.magnitude_u);
    has_value = has_value && part.has_value;
  }
  if (has_value) {
    field.in_table = field.at_level(1.0);
    field.magnitude = field.in_table->norm();
  } else {
    field.magnitude = parts.front().part.magnitude;
  }
  return field;
}

FieldDescription make_field_description(const Experiment& experiment) {
  return describe_field(experiment, resolve_field(experiment));
}

Eigen::Vector3d FieldDescription::at_level(double level) const {
  if (parts.empty()) {
    return level * in_table.value_or(Eigen::Vector3d(0.0, 0.0, magnitude));
  }
  TableField::Vectors values;
  for (const FieldPartDescription& part : parts) {
    values.push_back(part.in_table);
  }
  return TableField(parts).at(values, level);
}

}  // namespace axiscal
