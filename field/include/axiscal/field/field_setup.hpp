// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/field/field_description.hpp"
#include "axiscal/field/field_role.hpp"
#include "axiscal/field/reference_field.hpp"
#include "axiscal/field/table_place.hpp"

namespace axiscal {

/// The reference field of an experiment: one field, or the sum of several.
///
/// @code
/// experiment.field = axiscal::GeomagneticField(site, 2026.5, "uT");
/// experiment.field.magnitude = 48.2;               // a measured value instead of the model's
/// experiment.field += axiscal::CoilField(coil);    // added, multiplied by the readings' level
/// @endcode
struct AXISCAL_EXPORT FieldSetup {
  FieldSetup() = default;

  /// Not explicit, so that a field can be assigned to an experiment directly.
  FieldSetup(std::shared_ptr<const ReferenceField> field);  // NOLINT(google-explicit-constructor)
  template <std::derived_from<ReferenceField> Field>
  FieldSetup(std::shared_ptr<Field> field)  // NOLINT(google-explicit-constructor)
      : FieldSetup(std::shared_ptr<const ReferenceField>(std::move(field))) {}
  template <std::derived_from<ReferenceField> Field>
  FieldSetup(Field field)  // NOLINT(google-explicit-constructor)
      : FieldSetup(std::shared_ptr<const ReferenceField>(
            std::make_shared<const Field>(std::move(field)))) {}

  std::shared_ptr<const ReferenceField> of;  ///< the field; null if it is not stated
  std::string name;  ///< NAME in the readings' column level.NAME for this field; may be empty
  std::optional<FieldRole> role;  ///< local or induced; nullopt for the usual role of the kind
  /// Unit of the numbers below. If it is empty, the first of these that exists is used: the kind's
  /// first unit in which the stated magnitude is possible; the unit() of `of`; the unit of the
  /// readings, if the kind allows it and no number is stated (not for gravity); the kind's default
  /// unit.
  std::string unit;
  std::optional<double> magnitude;          ///< magnitude [unit]; for nullopt see resolve_field()
  bool magnitude_unknown = false;           ///< true if the magnitude is to be fitted
  double magnitude_u = 0.0;                 ///< standard uncertainty of the magnitude [unit]
  std::optional<Eigen::Vector3d> in_table;  ///< the field's vector [unit], frame table
  std::vector<FieldSetup> others;           ///< the other parts, local or induced, of a sum

  /// Adds a part.
  FieldSetup& operator+=(FieldSetup part);

  [[nodiscard]] bool is_stated() const { return of != nullptr; }

  /// @return the field's kind; empty if no field is stated.
  [[nodiscard]] std::string_view kind() const { return of ? of->kind() : std::string_view(); }

  /// @return true if the experimenter makes the field. This is stated by `role`, or if `role` is
  ///         nullopt, by is_induced() of `of`.
  [[nodiscard]] bool is_induced() const;

  /// @return the parts of a sum, this one first.
  [[nodiscard]] std::vector<const FieldSetup*> parts() const;
  [[nodiscard]] std::vector<FieldSetup*> parts();

  /// @return the part that changes from reading to reading; null if there is no such part.
  [[nodiscard]] const FieldSetup* moving_part() const;
};

/// @param kind     name of the kind. If it is empty, the result is null.
/// @param members  names and values of the JSON members that this kind has in addition to those
///                 of every field, e.g. {"model", "igrf14"}.
/// @return a field of that kind.
/// @throws SetupError  if the kind or a member is unknown; the message lists the kinds.
[[nodiscard]] AXISCAL_EXPORT std::shared_ptr<const ReferenceField> make_field(
    std::string_view kind, const std::map<std::string, std::string>& members = {});

/// Reads a field of an experiment's file (formats.md, Experiment): an object, or an array of parts
/// that are summed.
/// @param path  the file's path; `-` is standard input.
/// @throws DataError  if the file does not have this format.
[[nodiscard]] AXISCAL_EXPORT FieldSetup read_field(const std::string& path);

/// Converts the field of a record to the inputs for a new experiment.
/// @param with_vector  true: the inputs include the vector in the table. For parts of a sum they
///                     always include it.
[[nodiscard]] AXISCAL_EXPORT FieldSetup setup_of(const FieldDescription& field, bool with_vector);

/// @throws SetupError  if the unit is not possible for this kind of field.
AXISCAL_EXPORT void check_field_unit(std::string_view kind, const std::string& unit);

/// Properties of the readings that are needed to resolve a field.
struct FieldOccasion {
  std::optional<double> time_s;   ///< time of the readings [s since 1970-01-01 UTC]; if nullopt,
                                  ///< the table's date is used
  std::string reading_unit;       ///< unit of the readings, used for the field if no number of the
                                  ///< field is stated
  std::optional<double> largest;  ///< largest magnitude of the fields stated with the readings
                                  ///< [unit], used if no magnitude is stated or computable
};

/// Computes the field from the inputs, before any reading is used. The result is a list of its
/// parts in the unit of the first part.
///
/// The magnitude is the stated one. If none is stated, it is the length of the stated in_table. If
/// in_table is not stated either, the magnitude is computed from a model at the site and date, the
/// geometry of a coil, or the sum of the lamps' light. However, it is 1 if the unit is `g`, or if
/// the unit is `1` and there are no lamps.
///
/// If in_table is not stated, it is the field at the site, rotated by the fence's azimuth and the
/// known slope. The vector of a turntable is along the table's normal. If one part of a sum has a
/// known magnitude, the magnitudes of other parts may be unknown.
/// @throws SetupError    if kind or unit are not known, or a magnitude cannot be computed.
/// @throws RefusedError  if place or date are outside a model's range, or the sun is below the
///                       horizon.
[[nodiscard]] AXISCAL_EXPORT std::vector<FieldDescription> resolve_field(
    const FieldSetup& setup, const TablePlace& place, const FieldOccasion& occasion);

/// Does the same as resolve_field(), but for a single field instead of a sum, e.g. for a second
/// field to which the instrument also responds (option --also).
[[nodiscard]] AXISCAL_EXPORT FieldDescription resolve_part(const FieldSetup& part,
                                                           const TablePlace& place,
                                                           const FieldOccasion& occasion);

/// @return the sum of the parts, with the site and date of `place`.
[[nodiscard]] AXISCAL_EXPORT FieldDescription
describe_field(const TablePlace& place, const std::vector<FieldDescription>& parts);

/// @return the rotation from enu to the table's frame, computed from the fence's azimuth and the
///         slope.
/// @param field  a field that moves; it is named in the error message.
/// @throws SetupError  if the fence's azimuth is not stated.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d rotation_of_moving(const TablePlace& place,
                                                                const ReferenceField& field);

/// Computes the matrix that transforms the vector of a moving field at the time `from_s` into its
/// vector at the time `to_s`. It is a rotation times the ratio of the two vectors' lengths.
///
/// @param from_s, to_s  seconds since 1970-01-01, UTC.
/// @return 3 x 3, in the table's frame; the identity if the field does not move.
/// @throws SetupError  if a moving field is a part of a sum, or the fence's azimuth is not stated.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d change_of_field(const FieldSetup& setup,
                                                             const TablePlace& place,
                                                             double from_s,
                                                             double to_s);

}  // namespace axiscal
