// SPDX-License-Identifier: Apache-2.0
#include "field/field_json.hpp"

#include <array>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/field/recorded_field.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr std::array<std::string_view, 8> members_of_all = {
    "kind", "name", "role", "unit", "magnitude", "magnitude_u", "in_table", "recorded"};

// Resolves a path that a document contains. A relative path is relative to the document's folder.
std::string path_beside(const std::string& document, const std::string& name) {
  const std::filesystem::path path(name);
  return path.is_absolute() ? name
                            : (std::filesystem::path(document).parent_path() / path).string();
}

std::shared_ptr<ReferenceField> read_kind(const JsonValue& json) {
  const auto kind = json.find("kind");
  if (!kind) {
    return nullptr;
  }
  const std::string name = kind->text();
  kind->check([&] { check_field_kind(name); });
  return field_kind(name).make();
}

void magnitude_member(JsonMembers& io, FieldSetup& part) {
  constexpr const char* key = "magnitude";
  if (!io.reads()) {
    if (part.magnitude_unknown) {
      io.put(key, "unknown");
    } else if (part.magnitude) {
      io.put(key, *part.magnitude);
    }
  } else if (const auto value = io.from().find(key)) {
    part.magnitude_unknown = value->is_text();
    if (!part.magnitude_unknown) {
      part.magnitude = value->number();
    }
    io.check(key, part.magnitude_unknown ? value->text() == "unknown" : *part.magnitude > 0.0,
             "must be positive, or \"unknown\"");
  }
}

// Reads or writes the members that all kinds have. ReferenceField::members() reads or writes the
// members of a single kind.
void common_members(JsonMembers& io, FieldSetup& part) {
  io.value_if_any("name", part.name);
  io.choice_if_any("role", part.role, role_name, parse_role, "local, induced");
  io.value_if_any("unit", part.unit);
  if (!part.unit.empty()) {
    io.check("unit", [&] { check_field_unit(part.kind(), part.unit); });
  }
  magnitude_member(io, part);
  io.value_if_any("magnitude_u", part.magnitude_u);
  if (!(part.magnitude_u >= 0.0)) {
    io.check("magnitude_u", false, "must not be negative");
  }
  if (io.has("in_table", part.in_table.has_value())) {
    Eigen::Vector3d in_table = part.in_table.value_or(Eigen::Vector3d::Zero());
    io.need_vector("in_table", in_table, 3);
    io.check("in_table", in_table.norm() > 0.0 && in_table.norm() < 1e150,
             "must not be zero, and must be shorter than 1e150");
    part.in_table = in_table;
  }
}

void read_part(const JsonValue& json, FieldSetup& part) {
  const std::shared_ptr<ReferenceField> field = read_kind(json);
  const FieldKind& kind = field_kind(field ? field->kind() : std::string_view());
  std::vector<std::string_view> keys(members_of_all.begin(), members_of_all.end());
  keys.insert(keys.end(), kind.members.begin(), kind.members.end());
  json.allow_keys(keys);
  JsonMembers io(json);
  if (field) {
    field->members(io);
    part = FieldSetup(field);
  }
  if (const auto recorded = json.find("recorded"); recorded && field) {
    part.of = std::make_shared<const RecordedField>(
        read_recorded_field(path_beside(json.path(), recorded->text()), part.of));
  }
  common_members(io, part);
}

void write_part(JsonWriter& to, FieldSetup part) {
  to.begin_object();
  if (!part.of) {
    to.end_object();
    return;
  }
  const FieldKind& kind = field_kind(part.kind());
  if (kind.make == nullptr) {
    throw DomainError(formatted(
        "the field {} was added by a program, so it cannot be written to a file", part.kind()));
  }
  JsonMembers io(to);
  io.put("kind", part.kind());
  common_members(io, part);
  // members() reads and writes, so it is not const. Writing does not change the field.
  const_cast<ReferenceField&>(*part.of).members(
      io);  // NOLINT(cppcoreguidelines-pro-type-const-cast)
  to.end_object();
}

void write_parts(JsonWriter& to, std::span<const FieldSetup* const> parts) {
  to.begin_list();
  for (const FieldSetup* const part : parts) {
    write_part(to, *part);
  }
  to.end_list();
}

void read_second_field(const JsonValue& json, std::vector<FieldSetup>& also) {
  if (json.is_text()) {
    json.check([&] { also.emplace_back(make_field(json.text())); });
  } else {
    read_part(json, also.emplace_back());
  }
}

}  // namespace

Json level_json(const FieldLevel& level) {
  return level.has_level_per_part() ? Json(level.of_parts()) : Json(level.of_all());
}

FieldLevel level_of(const JsonValue& json) {
  if (!json.is_object()) {
    return json.number();
  }
  FieldLevel::OfParts of_parts;
  for (const std::string& name : json.keys()) {
    of_parts[name] = json.at(name).number();
  }
  return FieldLevel(std::move(of_parts));
}

void read_field(const JsonValue& json, FieldSetup& field) {
  field = FieldSetup();
  if (!json.is_array()) {
    read_part(json, field);
    return;
  }
  const std::vector<JsonValue> parts = json.elements();
  if (parts.empty()) {
    json.fail("must have at least one part");
  }
  read_part(parts.front(), field);
  for (std::size_t i = 1; i < parts.size(); ++i) {
    read_part(parts[i], field.others.emplace_back());
  }
}

FieldSetup read_field(const std::string& path) {
  FieldSetup field;
  read_field(parse_json(read_whole_file(path), path), field);
  return field;
}

void field_member(JsonMembers& io, const char* key, FieldSetup& field) {
  if (!io.reads()) {
    if (!field.is_stated()) {
      return;
    }
    io.to().key(key);
    if (field.others.empty()) {
      write_part(io.to(), field);
    } else {
      write_parts(io.to(), field.parts());
    }
    return;
  }
  if (const auto json = io.from().find(key)) {
    read_field(*json, field);
  }
}

void second_fields_member(JsonMembers& io, const char* key, std::vector<FieldSetup>& also) {
  if (!io.reads()) {
    if (!also.empty()) {
      std::vector<const FieldSetup*> parts;
      for (const FieldSetup& one : also) {
        parts.push_back(&one);
      }
      io.to().key(key);
      write_parts(io.to(), parts);
    }
    return;
  }
  if (const auto json = io.from().find(key)) {
    also.clear();
    if (!json->is_array()) {
      read_second_field(*json, also);
      return;
    }
    for (const JsonValue& one : json->elements()) {
      read_second_field(one, also);
    }
  }
}

}  // namespace axiscal
