// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "axiscal/calib/resolved_field.hpp"
#include "axiscal/core/setting.hpp"
#include "axiscal/field/field_kind.hpp"

namespace axiscal {

/// One part of a field on its way from what an experiment states to what can be known of it: what
/// the kinds have in common. Each kind's own way is a function of its own, in field_kinds/.
class PartResolver {
 public:
  PartResolver(const Experiment& experiment, const FieldPart& part, std::optional<double> time_s);

  /// @throws SetupError, RefusedError  as resolve_part().
  [[nodiscard]] ResolvedPart resolve();

  /// What is stated, and what has been found of it.
  [[nodiscard]] const FieldPart& given() const { return given_; }
  [[nodiscard]] ResolvedPart& part() { return part_; }

  [[nodiscard]] bool has_site() const { return experiment_.field.site.has_value(); }
  [[nodiscard]] const Site& site() const { return *experiment_.field.site; }

  /// @throws SetupError  where the site's longitude is not stated.
  void require_longitude() const;

  /// Whether the time of day is known, by the readings or the experiment's date.
  [[nodiscard]] bool knows_time() const;

  /// The time of the readings, where it is known.
  [[nodiscard]] const std::optional<double>& reading_time_s() const { return time_s_; }

  /// The experiment's date, or today [s].
  [[nodiscard]] double date_s() const;

  /// The given magnitude, else the given vector's length; nothing where neither is there.
  [[nodiscard]] std::optional<double> given_magnitude() const;

  void put_magnitude(double magnitude);

  /// The given magnitude.
  /// @param otherwise  what is said behind the field's name where there is none.
  /// @param settings   that would say it too.
  void put_given_magnitude(const std::string& otherwise, std::vector<Setting> settings);

  /// A model's own uncertainty, unless the user states another.
  void put_model_u(double magnitude_u);

  /// The field's value in the table, of the part's magnitude.
  /// @param value    where it points; frame enu, or where it is made on the table that one's.
  void put_value(const Eigen::Vector3d& value, bool induced);

  /// A vector in the table that follows from what makes it; a magnitude that is given wins.
  void put_made(const std::function<Eigen::Vector3d()>& make);

 private:
  void check_given() const;
  void resolve_own();
  void resolve_kind();
  [[nodiscard]] std::string unit_unless_stated(const FieldKind& kind) const;

  const Experiment& experiment_;
  const FieldPart& given_;
  std::optional<double> time_s_;
  ResolvedPart part_;
};

void resolve_gravity(PartResolver& of);
void resolve_geomagnetic(PartResolver& of);
void resolve_earth_rotation(PartResolver& of);
void resolve_turntable(PartResolver& of);
void resolve_induced_magnetic(PartResolver& of);
void resolve_light(PartResolver& of);
void resolve_custom(PartResolver& of);

/// @return the names of all kinds, for messages: "gravity, geomagnetic, ...".
[[nodiscard]] std::string list_of_field_kinds();

}  // namespace axiscal
