// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/field/field_level.hpp"
#include "axiscal/field/field_setup.hpp"
#include "core/json_members.hpp"

namespace axiscal {

/// A reading's level: a number, or an object of numbers by the parts' names.
[[nodiscard]] Json level_json(const FieldLevel& level);
[[nodiscard]] FieldLevel level_of(const JsonValue& json);

/// The value that states a field.
void read_field(const JsonValue& json, FieldSetup& field);

/// The field of an experiment in its file: an object, or an array of parts that are summed.
/// @throws DataError  as JsonValue, also for a kind or unit that is not known.
void field_member(JsonMembers& io, const char* key, FieldSetup& field);

/// Second fields: a kind's name, an object, or an array. They are written as an array of objects.
void second_fields_member(JsonMembers& io, const char* key, std::vector<FieldSetup>& also);

}  // namespace axiscal
