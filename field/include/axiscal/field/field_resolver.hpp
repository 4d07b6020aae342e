// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "axiscal/core/export.hpp"
#include "axiscal/core/setting.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/field/field_setup.hpp"

namespace axiscal {

/// One part of a field while it is resolved from its inputs to a vector in the table. This class
/// has the steps that all kinds share. ReferenceField::resolve() has the steps of a kind.
class AXISCAL_EXPORT FieldResolver {
 public:
  /// @param part           the stated inputs.
  /// @param place          where the table stands, and how.
  /// @param occasion       when the readings were taken, and in which unit.
  /// @param beside_others  whether it is one part of a sum.
  FieldResolver(const FieldSetup& part,
                const TablePlace& place,
                const FieldOccasion& occasion,
                bool beside_others);

  /// @throws SetupError, RefusedError  as resolve_part().
  [[nodiscard]] FieldDescription resolve();

  /// The stated inputs, and the results so far.
  [[nodiscard]] const FieldSetup& given() const { return given_; }
  [[nodiscard]] FieldDescription& found() { return found_; }

  /// The table's site, for a field that has none of its own.
  [[nodiscard]] const std::optional<Site>& site() const { return place_.site; }

  /// @throws SetupError  where the table's longitude is not stated.
  void require_longitude() const;

  /// True if the time of day is known, from the readings or from the place's date.
  [[nodiscard]] bool is_time_of_day_known() const;

  /// The time of the readings, if it is known.
  [[nodiscard]] const std::optional<double>& reading_time_s() const { return occasion_.time_s; }

  /// The place's date, or today [s].
  [[nodiscard]] double date_s() const;

  /// The given magnitude, else the length of the given vector; nullopt if both are missing.
  [[nodiscard]] std::optional<double> given_magnitude() const;

  void set_magnitude(double magnitude);

  /// The given magnitude. If it is missing, the magnitude is unknown, provided that other parts can
  /// fix the scale.
  /// @param otherwise  what is said behind the field's name where there is none and none may be.
  /// @param settings   that would provide the value too.
  void set_given_magnitude(const std::string& otherwise, std::vector<Setting> settings);

  /// As set_given_magnitude(); the default is 1 if the unit is 1.
  void set_given_magnitude_or_1(const std::string& otherwise, std::vector<Setting> settings);

  /// The magnitude is unknown: it is fitted together with parts of known magnitude.
  void leave_magnitude_open();

  /// True if this is a local part without any stated number, in a sum.
  [[nodiscard]] bool may_be_open() const;

  /// @return length of the largest field in the readings; nullopt if they do not contain fields.
  [[nodiscard]] const std::optional<double>& largest_met() const { return occasion_.largest; }

  /// A model's own uncertainty, unless the user states another.
  void set_model_u(double magnitude_u);

  /// The field's value in the table, of the part's magnitude.
  /// @param value    where it points; frame enu, or where it is made on the table that one's.
  /// @param induced  whether it is made on the table, and so follows its slope and heading.
  void set_direction(const Eigen::Vector3d& value, bool induced);

  /// A vector in the table that follows from the source of the field. A stated magnitude takes
  /// precedence.
  void set_made(const std::function<Eigen::Vector3d()>& make);

  /// As ReferenceField::resolve() by the value that the field itself says.
  void resolve_by_value(const ReferenceField& field);

 private:
  void check_given() const;
  void prepare();
  [[nodiscard]] std::string unit_told_by_number(const FieldKind& kind) const;
  [[nodiscard]] std::string unit_unless_stated(const FieldKind& kind) const;

  const FieldSetup& given_;
  const TablePlace& place_;
  const FieldOccasion& occasion_;
  bool beside_others_;
  FieldDescription found_;
};

}  // namespace axiscal
