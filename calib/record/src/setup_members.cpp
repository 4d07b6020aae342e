// SPDX-License-Identifier: Apache-2.0
#include "calib/record/src/setup_members.hpp"

#include "axiscal/core/error.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

void differences_members(JsonMembers& io, std::vector<DifferentialAxis>& differences) {
  if (!io.reads()) {
    io.object("differences", !differences.empty(), [&](JsonMembers& one) {
      for (const DifferentialAxis& difference : differences) {
        one.put(difference.axis.c_str(), std::vector{difference.plus, difference.minus});
      }
    });
  } else if (const auto all = io.from().find("differences")) {
    for (const std::string& axis : all->keys()) {
      const std::vector<std::string> columns = all->at(axis).texts();
      if (columns.size() != 2) {
        all->at(axis).fail("must be two columns: [plus, minus]");
      }
      differences.push_back({.axis = axis, .plus = columns[0], .minus = columns[1]});
    }
  }
}

void convention_member(JsonMembers& io, Instrument& instrument) {
  std::string name = instrument.convention == AxisConvention::forward_right_down ? "frd" : "";
  io.value_if_any("convention", name);
  if (!name.empty()) {
    io.check("convention", [&] { instrument.convention = parse_convention(name); });
  }
}

void range_members(JsonMembers& io, Instrument& instrument) {
  if (io.has("range", instrument.range.has_value())) {
    ReadingRange range = instrument.range.value_or(ReadingRange{});
    io.need_pair("range", range.low, range.high);
    io.check("range", range.low < range.high, "must be [low, high] with low less than high");
    io.keep(instrument.range, range);
  }
  io.flag_unless("one_sided", instrument.one_sided, false);
}

// Returns the axes in the form of set_axes(): "x", or "d=p-n" for a difference.
std::vector<std::string> axis_texts(const Instrument& instrument) {
  std::vector<std::string> texts;
  for (const std::string& axis : instrument.axes) {
    texts.push_back(axis);
    for (const DifferentialAxis& difference : instrument.differences) {
      if (difference.axis == axis) {
        texts.back() = formatted("{}={}-{}", axis, difference.plus, difference.minus);
      }
    }
  }
  return texts;
}

// Reads or writes one part of a sum of fields. Properties that all parts share are members of the
// sum.
void part_members(JsonMembers& io, FieldDescription& part) {
  io.need("kind", part.kind);
  io.value_if_any("name", part.name);
  io.need("magnitude", part.magnitude);
  io.value_if_any("magnitude_u", part.magnitude_u);
  Eigen::Vector3d in_table = part.in_table.value_or(Eigen::Vector3d::Zero());
  io.need_vector("in_table", in_table, 3);
  io.keep(part.in_table, in_table);
  io.need("set_by_level", part.set_by_level);
  io.need("turning", part.turning);
}

void members(JsonMembers& io, Site& site) {
  io.need("latitude_deg", site.latitude_deg);
  io.need("longitude_deg", site.longitude_deg);
  io.need("height_m", site.height_m);
}

void in_table_members(JsonMembers& io, FieldDescription& field) {
  if (!io.reads()) {
    io.put("in_table", field.in_table ? json_from(*field.in_table) : Json());
  } else if (const auto in_table = io.from().find("in_table")) {
    field.in_table = in_table->vector(3);
    io.check("in_table", field.in_table->norm() > 0.0, "must not be zero");
  }
  if (io.has("in_table_covariance", field.in_table_covariance.has_value())) {
    Eigen::Matrix3d covariance = field.in_table_covariance.value_or(Eigen::Matrix3d::Zero());
    io.matrix("in_table_covariance", covariance, 3, 3);
    io.keep(field.in_table_covariance, covariance);
    io.number("in_table_degrees_of_freedom", field.in_table_degrees_of_freedom);
  }
}

}  // namespace

void members(JsonMembers& io, Instrument& instrument) {
  io.need("kind", instrument.kind);
  io.check("kind", [&] { static_cast<void>(find_instrument_kind(instrument.kind)); });
  io.value("serial", instrument.serial);
  io.value_if_any("model", instrument.model);
  io.need("axes", instrument.axes);
  io.check("axes", [&] { check_axes(instrument); });
  io.need("unit", instrument.unit);
  convention_member(io, instrument);
  differences_members(io, instrument.differences);
  range_members(io, instrument);
}

void stated_members(JsonMembers& io, Instrument& instrument) {
  io.value_if_any("kind", instrument.kind);
  if (!instrument.kind.empty()) {
    io.check("kind", [&] { static_cast<void>(find_instrument_kind(instrument.kind)); });
  }
  io.value_if_any("serial", instrument.serial);
  if (!instrument.serial.empty()) {
    io.check("serial", [&] { check_serial(instrument.serial); });
  }
  io.value_if_any("model", instrument.model);
  if (io.has("axes", true)) {
    std::vector<std::string> texts = axis_texts(instrument);
    io.need("axes", texts);
    io.check("axes", [&] { set_axes(instrument, texts); });
  }
  io.value("unit", instrument.unit);
  convention_member(io, instrument);
  range_members(io, instrument);
}

void members(JsonMembers& io, FieldDescription& field) {
  io.need("kind", field.kind);
  io.need("unit", field.unit);
  io.need("magnitude", field.magnitude);
  io.check("magnitude", field.magnitude > 0.0, "must be positive");
  io.check("unit", !field_kind(field.kind).vertical || field.unit == "g" || field.unit == "m/s^2",
           "must be g or m/s^2 for gravity");
  in_table_members(io, field);
  io.value_if_any("magnitude_u", field.magnitude_u);
  io.value_if_any("model", field.model);
  io.value_if_any("local_gravity_m_s2", field.local_gravity);
  io.value_if_any("local_gravity_u_m_s2", field.local_gravity_u);
  io.list_if_any("parts", field.parts,
                 [](JsonMembers& one, FieldDescription& part) { part_members(one, part); });
  for (FieldDescription& part : field.parts) {
    io.keep(part.unit, field.unit);
  }
  io.object_if_any("site", field.site, [](JsonMembers& one, Site& site) { members(one, site); });
  io.value_if_any("date", field.date);
}

// Reads or writes an object with one member for each kind of additional field.
void also_members(JsonMembers& io, std::vector<AlsoResponse>& all, Eigen::Index m) {
  if (io.reads()) {
    for (const std::string& kind : io.from().keys()) {
      all.push_back({.kind = kind, .unit = "", .sensitivity = {}, .sensitivity_se = {}});
    }
  }
  for (AlsoResponse& also : all) {
    io.need_object(also.kind.c_str(), [&](JsonMembers& one) {
      one.need("unit", also.unit);
      if (one.has("in_table", true)) {
        one.need_vector("in_table", also.in_table, 3);
      }
      one.need_matrix("sensitivity", also.sensitivity, m, 3);
      one.matrix("standard_error", also.sensitivity_se, m, 3);
    });
  }
}

}  // namespace axiscal
