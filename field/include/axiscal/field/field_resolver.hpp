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

/// Resolves one part of a field: it computes the vector in the table from the stated inputs. This
/// class has the steps that all kinds share. ReferenceField::resolve() has the steps of a kind.
class AXISCAL_EXPORT FieldResolver {
 public:
  /// @param part           the stated inputs.
  /// @param place          site, orientation and date of the table.
  /// @param occasion       time and unit of the readings.
  /// @param beside_others  true if it is a part of a sum.
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

  /// @throws SetupError  if the longitude of the table's site is not stated.
  void require_longitude() const;

  /// True if the time of day is known, from the readings or from the place's date.
  [[nodiscard]] bool is_time_of_day_known() const;

  /// The time of the readings, if it is known.
  [[nodiscard]] const std::optional<double>& reading_time_s() const { return occasion_.time_s; }

  /// The date of the table's place, or the present time if there is no date [s since 1970-01-01
  /// UTC].
  [[nodiscard]] double date_s() const;

  /// The given magnitude, else the length of the given vector; nullopt if both are missing.
  [[nodiscard]] std::optional<double> given_magnitude() const;

  void set_magnitude(double magnitude);

  /// Sets the magnitude to the given one. If it is missing, the magnitude stays unknown if
  /// may_be_open(). Otherwise it is the largest field of the readings.
  /// @param otherwise  text of the error after "field KIND", if there is no magnitude.
  /// @param settings   further settings that would remedy the error.
  /// @throws SetupError  if there is no magnitude.
  void set_given_magnitude(const std::string& otherwise, std::vector<Setting> settings);

  /// As set_given_magnitude(), but if the unit is "1" the magnitude is 1 instead of an error.
  void set_given_magnitude_or_1(const std::string& otherwise, std::vector<Setting> settings);

  /// Marks the magnitude as unknown. It is then fitted together with parts of known magnitude.
  void mark_magnitude_unknown();

  /// True if the magnitude may stay unknown: it is stated as unknown, or this is a local part of a
  /// sum without a stated number.
  [[nodiscard]] bool may_be_open() const;

  /// @return length of the largest field in the readings; nullopt if they do not contain fields.
  [[nodiscard]] const std::optional<double>& largest_field_length() const {
    return occasion_.largest;
  }

  /// Sets the model's uncertainty of the magnitude, unless the user states another.
  void set_model_u(double magnitude_u);

  /// Sets the field's vector in the table. Its length is the part's magnitude.
  /// @param value    a vector with the field's direction, frame enu; frame table if `induced`.
  /// @param induced  true if the field is made on the table, so that it does not depend on the
  ///                 table's slope and heading.
  void set_direction(const Eigen::Vector3d& value, bool induced);

  /// Sets the field's vector in the table to the result of `make` [unit]. A stated magnitude
  /// replaces its length.
  void set_made(const std::function<Eigen::Vector3d()>& make);

  /// Resolves the part by the field's own value, as the default of ReferenceField::resolve() does.
  void resolve_by_value(const ReferenceField& field);

 private:
  void check_given() const;
  void prepare();
  [[nodiscard]] std::string unit_from_magnitude(const FieldKind& kind) const;
  [[nodiscard]] std::string unit_unless_stated(const FieldKind& kind) const;

  const FieldSetup& given_;
  const TablePlace& place_;
  const FieldOccasion& occasion_;
  bool beside_others_;
  FieldDescription found_;
};

}  // namespace axiscal
