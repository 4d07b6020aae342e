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

/// Computes the magnitude of one part of a field, and its vector in the table's frame, from the
/// stated inputs. This class contains the steps that all kinds share. ReferenceField::resolve()
/// contains the steps of one kind.
class AXISCAL_EXPORT FieldResolver {
 public:
  /// @param part           the stated inputs.
  /// @param place          site, orientation and date of the table.
  /// @param occasion       time and unit of the readings, and the largest magnitude of the fields
  ///                       stated with them.
  /// @param beside_others  true if `part` is one of several parts of a sum.
  FieldResolver(const FieldSetup& part,
                const TablePlace& place,
                const FieldOccasion& occasion,
                bool beside_others);

  /// Computes the part.
  /// @throws SetupError, RefusedError  for the same reasons as resolve_part().
  [[nodiscard]] FieldDescription resolve();

  /// given() returns the stated inputs, and found() the results so far.
  [[nodiscard]] const FieldSetup& given() const { return given_; }
  [[nodiscard]] FieldDescription& found() { return found_; }

  /// The table's site. Fields that do not state their own site use it.
  [[nodiscard]] const std::optional<Site>& site() const { return place_.site; }

  /// @throws SetupError  if the longitude of the table's site is not stated.
  void require_longitude() const;

  /// True if the time of day is known, from the readings or from the place's date.
  [[nodiscard]] bool is_time_of_day_known() const;

  /// The time of the readings, if it is known.
  [[nodiscard]] const std::optional<double>& reading_time_s() const { return occasion_.time_s; }

  /// The date stated for the table [s since 1970-01-01 UTC]. If no date is stated, it is the
  /// present time.
  [[nodiscard]] double date_s() const;

  /// The stated magnitude. If it is missing, the length of the stated vector; nullopt if both are
  /// missing.
  [[nodiscard]] std::optional<double> given_magnitude() const;

  void set_magnitude(double magnitude);

  /// Sets the magnitude to given_magnitude(). If given_magnitude() is nullopt and may_be_open() is
  /// true, marks the magnitude as unknown. If given_magnitude() is nullopt and may_be_open() is
  /// false, sets the magnitude to largest_field_length().
  /// @param otherwise  text of the error message after "field KIND".
  /// @param settings   further settings, besides the field's magnitude, by which users can avoid
  ///                   the error.
  /// @throws SetupError  if none of these magnitudes is known.
  void set_given_magnitude(const std::string& otherwise, std::vector<Setting> settings);

  /// As set_given_magnitude(), but sets 1 if no magnitude is known and the unit is "1".
  void set_given_magnitude_or_1(const std::string& otherwise, std::vector<Setting> settings);

  /// Marks the magnitude as unknown, so that it is fitted. The magnitude of another part must be
  /// known.
  void mark_magnitude_unknown();

  /// @return true if the magnitude may stay unknown. This is the case if it is stated as unknown,
  ///         or if this is a local part of a sum and given_magnitude() is nullopt.
  [[nodiscard]] bool may_be_open() const;

  /// @return the largest magnitude of the fields that are stated with the readings; nullopt if no
  ///         reading states its field.
  [[nodiscard]] const std::optional<double>& largest_field_length() const {
    return occasion_.largest;
  }

  /// Sets the uncertainty of the magnitude to the stated one; if none is stated, to `magnitude_u`.
  void set_model_u(double magnitude_u);

  /// Sets the field's vector in the table's frame. The vector is scaled to the magnitude of the
  /// part.
  /// @param value    a vector with the field's direction, any length, frame enu. If `induced` is
  ///                 true, the frame is the table's.
  /// @param induced  true if the field's source is mounted on the table, so that the field in the
  ///                 table's frame does not depend on the table's slope and heading.
  void set_direction(const Eigen::Vector3d& value, bool induced);

  /// Sets the field's vector, in the table's frame, to the result of `make` [unit]. If a magnitude
  /// is stated, the vector is scaled to that magnitude.
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
