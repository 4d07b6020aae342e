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
  /// @param beside_others  true if `part` is one of several parts of a sum.
  FieldResolver(const FieldSetup& part,
                const TablePlace& place,
                const FieldOccasion& occasion,
                bool beside_others);

  /// @throws SetupError, RefusedError  as resolve_part().
  [[nodiscard]] FieldDescription resolve();

  /// The stated inputs are in given(), and the results so far in found().
  [[nodiscard]] const FieldSetup& given() const { return given_; }
  [[nodiscard]] FieldDescription& found() { return found_; }

  /// The table's site. It is used by fields that do not state a site.
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

  /// Sets the magnitude to given_magnitude(). If that is missing and may_be_open(), the magnitude
  /// is marked as unknown. Otherwise it is largest_field_length().
  /// @param otherwise  text of the error message after "field KIND".
  /// @param settings   further settings that would remedy the error.
  /// @throws SetupError  if none of these magnitudes is known.
  void set_given_magnitude(const std::string& otherwise, std::vector<Setting> settings);

  /// As set_given_magnitude(), but sets 1 if no magnitude is known and the unit is "1".
  void set_given_magnitude_or_1(const std::string& otherwise, std::vector<Setting> settings);

  /// Marks the magnitude as unknown, so that it is fitted. Another part must have a known one.
  void mark_magnitude_unknown();

  /// True if the magnitude may stay unknown: it is stated as unknown, or this is a local part of a
  /// sum and given_magnitude() is empty.
  [[nodiscard]] bool may_be_open() const;

  /// @return length of the largest field in the readings; nullopt if they do not contain fields.
  [[nodiscard]] const std::optional<double>& largest_field_length() const {
    return occasion_.largest;
  }

  /// Sets the uncertainty of the magnitude to the stated one; if none is stated, to `magnitude_u`.
  void set_model_u(double magnitude_u);

  /// Sets the field's vector in the table. Its length is the part's magnitude.
  /// @param value    a vector with the field's direction, frame enu; frame table if `induced`.
  /// @param induced  true if the field is made on the table, so that it does not depend on the
  ///                 table's slope and heading.
  void set_direction(const Eigen::Vector3d& value, bool induced);

  /// Sets the field's vector in the table to the result of `make` [unit]. A stated magnitude
  /// replaces its length.
  void set_made(const std::function<Eigen::Vector3d()>& make);

  /// Sets vector and magnitude to the value of `field`. This is the default of
  /// ReferenceField::resolve().
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
