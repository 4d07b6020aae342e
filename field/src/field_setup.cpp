// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/field_setup.hpp"

#include <algorithm>
#include <cmath>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/field/field_resolver.hpp"
#include "axiscal/field/field_unit.hpp"
#include "axiscal/field/settings.hpp"
#include "core/formatted.hpp"
#include "core/json_members.hpp"

namespace axiscal {
namespace {

void convert(FieldDescription& part, const std::string& unit) {
  double factor = 1.0;
  try {
    factor = factor_between(part.unit, unit);
  } catch (const DomainError&) {
    throw SetupError(
        formatted("field: all parts must be of the same physical quantity; {} is in {}, but the "
                  "first part is in {}",
                  part.kind, part.unit, unit));
  }
  part.magnitude *= factor;
  part.magnitude_u *= factor;
  if (part.in_table) {
    *part.in_table *= factor;
  }
  part.unit = unit;
}

// Returns the unit for the numbers of a sum that are stated without a unit. It is the unit of the
// first part whose magnitude determines a unit; empty if there is no such part.
std::string unit_told_by_magnitude(const FieldSetup& setup,
                                   const TablePlace& place,
                                   const FieldOccasion& occasion) {
  for (const FieldSetup* const part : setup.parts()) {
    const FieldKind& kind = field_kind(part->kind());
    if (!setup.others.empty() && part->of && part->unit.empty() && kind.greatest_magnitude > 0.0 &&
        (part->magnitude || part->in_table)) {
      FieldSetup own = *part;
      own.others.clear();
      return FieldResolver(own, place, occasion, true).resolve().unit;
    }
  }
  return "";
}

// Throws if two parts have the same name, because readings state the level of a part by its name.
void check_names(const std::vector<FieldDescription>& parts) {
  for (std::size_t p = 0; p < parts.size(); ++p) {
    for (std::size_t q = 0; q < p && !parts[p].name.empty(); ++q) {
      if (parts[q].level_name() == parts[p].level_name()) {
        throw SetupError(
            formatted("field: two parts have the name '{}'; give each part a different name",
                      parts[p].name),
            {settings::field});
      }
    }
  }
}

}  // namespace

FieldSetup::FieldSetup(std::shared_ptr<const ReferenceField> field) : of(field) {
  if (field) {
    field->state(*this);  // state() may replace `of` by another field
  }
}

FieldSetup& FieldSetup::operator+=(FieldSetup part) {
  std::vector<FieldSetup> more = std::move(part.others);
  part.others.clear();
  others.push_back(std::move(part));
  others.insert(others.end(), more.begin(), more.end());
  return *this;
}

bool FieldSetup::is_induced() const {
  return role ? *role == FieldRole::induced : of && of->is_induced();
}

std::vector<const FieldSetup*> FieldSetup::parts() const {
  std::vector<const FieldSetup*> all = {this};
  for (const FieldSetup& other : others) {
    all.push_back(&other);
  }
  return all;
}

std::vector<FieldSetup*> FieldSetup::parts() {
  std::vector<FieldSetup*> all = {this};
  for (FieldSetup& other : others) {
    all.push_back(&other);
  }
  return all;
}

const FieldSetup* FieldSetup::moving_part() const {
  for (const FieldSetup* const part : parts()) {
    if (part->of && part->of->moves()) {
      return part;
    }
  }
  return nullptr;
}

std::shared_ptr<const ReferenceField> make_field(
    std::string_view kind, const std::map<std::string, std::string>& members) {
  if (kind.empty()) {
    return nullptr;
  }
  check_field_kind(kind);
  const FieldKind& entry = field_kind(kind);
  if (entry.make == nullptr) {
    throw SetupError(formatted("field {}: only a program can create it, not a file", kind));
  }
  std::shared_ptr<ReferenceField> field = entry.make();
  if (!members.empty()) {
    Json json = Json::object();
    for (const auto& [key, value] : members) {
      json[key] = value;
    }
    const JsonValue value = parse_json(json.dump(), "field " + std::string(kind));
    JsonMembers io(value);
    field->members(io);
  }
  return field;
}

FieldSetup setup_of(const FieldDescription& field, bool with_vector) {
  const auto one = [&](const FieldDescription& part, bool is_part) {
    FieldSetup setup(
        field_kind(part.kind).make != nullptr
            ? make_field(part.kind, part.model.empty() || part.model == "sun"
                                        ? std::map<std::string, std::string>{}
                                        : std::map<std::string, std::string>{{"model", part.model}})
            : nullptr);
    setup.name = part.name;
    setup.unit = field.unit;
    setup.magnitude_u = part.magnitude_u;
    if (is_part) {
      setup.in_table = part.in_table;
      setup.role = part.set_by_level ? FieldRole::induced : FieldRole::local;
    } else {
      setup.magnitude = part.magnitude;
      if (with_vector) {
        setup.in_table = part.in_table;
      }
    }
    return setup;
  };
  if (field.parts.empty()) {
    return one(field, false);
  }
  FieldSetup sum = one(field.parts.front(), true);
  for (std::size_t p = 1; p < field.parts.size(); ++p) {
    sum += one(field.parts[p], true);
  }
  return sum;
}

void check_field_unit(std::string_view kind, const std::string& unit) {
  const auto units = field_kind(kind).units;
  if (!units.empty() && std::find(units.begin(), units.end(), unit) == units.end()) {
    const std::vector<std::string> names(units.begin(), units.end());
    throw SetupError(
        formatted("field {}: the unit must be {}, not '{}'", kind, joined(names, " or "), unit));
  }
}

FieldDescription resolve_part(const FieldSetup& part,
                              const TablePlace& place,
                              const FieldOccasion& occasion) {
  return FieldResolver(part, place, occasion, false).resolve();
}

std::vector<FieldDescription> resolve_field(const FieldSetup& setup,
                                            const TablePlace& place,
                                            const FieldOccasion& occasion) {
  if (place.site) {
    check_site(*place.site);
  }
  if (!(place.slope.norm() < 1.0)) {
    throw SetupError("the table's slope: X^2 + Y^2 must be less than 1", {settings::slope});
  }
  if (setup.in_table && place.slope.norm() > 0.0) {
    throw SetupError(
        "the slope and the field's vector both define the direction of the field in the table's "
        "frame; give only one of the two",
        {settings::slope, settings::field_table});
  }
  const std::string told = unit_told_by_magnitude(setup, place, occasion);
  std::vector<FieldDescription> parts;
  for (const FieldSetup* const part : setup.parts()) {
    FieldSetup own = *part;
    own.others.clear();
    const auto units = field_kind(own.kind()).units;
    if (own.unit.empty() && own.of && own.of->unit().empty() &&
        std::find(units.begin(), units.end(), told) != units.end()) {
      own.unit = told;
    }
    parts.push_back(FieldResolver(own, place, occasion, !setup.others.empty()).resolve());
    convert(parts.back(), parts.front().unit);
  }
  if (parts.size() == 1 && parts.front().free_length) {
    throw SetupError(formatted("field {}: its magnitude is unknown; give the magnitude, the vector "
                               "in the table's frame, or a coil",
                               parts.front().kind),
                     {settings::field_table, settings::field_magnitude});
  }
  const bool all_free = std::all_of(parts.begin(), parts.end(),
                                    [](const FieldDescription& part) { return part.free_length; });
  if (all_free) {
    throw SetupError("field: the magnitude of at least one part must be known");
  }
  const auto turning = std::count_if(parts.begin(), parts.end(),
                                     [](const FieldDescription& part) { return part.turning; });
  if (turning > 1) {
    throw SetupError("field: a table turns about only one axis; give only one induced_rotation");
  }
  check_names(parts);
  return parts;
}

FieldDescription describe_field(const TablePlace& place,
                                const std::vector<FieldDescription>& parts) {
  FieldDescription field = sum_of(parts);
  field.site = place.site;
  field.date = place.date;
  const bool dated = std::any_of(parts.begin(), parts.end(), [](const FieldDescription& part) {
    return field_kind(part.kind).dated && !part.model.empty();
  });
  if (field.date.empty() && dated) {
    field.date = output_timestamp().substr(0, 10);  // the model was evaluated for today
  }
  return field;
}

Eigen::Matrix3d rotation_of_moving(const TablePlace& place, const ReferenceField& field) {
  if (!place.fence_azimuth_rad) {
    throw SetupError(field.moving_name() +
                         " moves between the readings; give the fence's azimuth (an accuracy of a "
                         "few degrees is sufficient)",
                     {settings::fence_azimuth});
  }
  return rotation_sloping_from_level(place.slope) *
         rotation_table_from_enu(*place.fence_azimuth_rad);
}

Eigen::Matrix3d change_of_field(const FieldSetup& setup,
                                const TablePlace& place,
                                double from_s,
                                double to_s) {
  const FieldSetup* const moving = setup.moving_part();
  if (moving == nullptr) {
    return Eigen::Matrix3d::Identity();
  }
  const ReferenceField& field = *moving->of;
  if (!setup.others.empty()) {
    throw SetupError(field.moving_name() + " moves, so it cannot be combined with another field");
  }
  const Eigen::Vector3d from = field.moving_in_table(place, from_s);
  const Eigen::Vector3d to = field.moving_in_table(place, to_s);
  if (!(from.norm() > 0.0 && to.norm() > 0.0)) {
    throw RefusedError(field.moving_name() + " is zero at the time of a reading");
  }
  return to.norm() / from.norm() * smallest_rotation(from.normalized(), to.normalized());
}

// ---- Defaults of ReferenceField ----

void ReferenceField::resolve(FieldResolver& of) const {
  of.resolve_by_value(*this);
}

Eigen::Vector3d ReferenceField::moving_in_table(const TablePlace& place, double time_s) const {
  const Eigen::Vector3d value = value_in_enu_at(time_s);
  return is_induced() ? value : Eigen::Vector3d(rotation_of_moving(place, *this) * value);
}

std::string ReferenceField::moving_name() const {
  return "the field " + std::string(kind());
}

}  // namespace axiscal
