// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/field/field_level.hpp"
#include "axiscal/field/field_setup.hpp"
#include "core/json_members.hpp"

namespace axiscal {

/// Converts the level of a reading (the factor that multiplies the induced field) to and from JSON.
/// The JSON is one number, or an object that contains a number for each named part of the field.
[[nodiscard]] Json level_json(const FieldLevel& level);
[[nodiscard]] FieldLevel level_of(const JsonValue& json);

/// Reads a field from an object, or from an array of parts that are summed.
void read_field(const JsonValue& json, FieldSetup& field);

/// Reads or writes the field of an experiment: an object, or an array of parts that are summed.
/// @throws DataError  if the JSON does not have this form, or a kind or unit is not known.
void field_member(JsonMembers& io, const char* key, FieldSetup& field);

/// Reads or writes the second fields of an experiment (option --also), to which the instrument also
/// responds. The input may be the name of a kind, an object, or an array of both. The output is an
/// array of objects.
void second_fields_member(JsonMembers& io, const char* key, std::vector<FieldSetup>& also);

}  // namespace axiscal
