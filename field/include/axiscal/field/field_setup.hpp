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
/// experiment.field.magnitude = 48.2;               // measured, and not the model's
/// experiment.field += axiscal::CoilField(coil);    // beside it, by the readings' level
/// @endcode
struct AXISCAL_EXPORT FieldSetup {
  FieldSetup() = default;

  /// Not explicit, so that a field is assigned to an experiment as it is.
  FieldSetup(std::shared_ptr<const ReferenceField> field);  // NOLINT(google-explicit-constructor)
  template <std::derived_from<ReferenceField> Field>
  FieldSetup(std::shared_ptr<Field> field)  // NOLINT(google-explicit-constructor)
      : FieldSetup(std::shared_ptr<const ReferenceField>(std::move(field))) {}
  template <std::derived_from<ReferenceField> Field>
  FieldSetup(Field field)  // NOLINT(google-explicit-constructor)
      : FieldSetup(std::shared_ptr<const ReferenceField>(
            std::make_shared<const Field>(std::move(field)))) {}

  std::shared_ptr<const ReferenceField> of;  ///< which field; null: not stated
  std::string name;  ///< its readings' levels are in the column level.NAME; may be empty
  std::optional<FieldRole> role;  ///< default: the kind's
  /// Empty: the first unit of the kind; without a magnitude, the unit of the readings if the kind
  /// has it.
  std::string unit;
  std::optional<double> magnitude;          ///< F [unit]; default: see resolve_field()
  bool magnitude_unknown = false;           ///< it is fitted; in a sum with a known part
  double magnitude_u = 0.0;                 ///< its standard uncertainty [unit]
  std::optional<Eigen::Vector3d> in_table;  ///< [unit], frame table
  std::vector<FieldSetup> others;           ///< further parts, local and induced, that add up

  /// Adds a part.
  FieldSetup& operator+=(FieldSetup part);

  [[nodiscard]] bool is_stated() const { return of != nullptr; }

  /// @return the field's kind; empty where none is stated.
  [[nodiscard]] std::string_view kind() const { return of ? of->kind() : std::string_view(); }

  /// @return true if the table produces it: by its role, its class, or its kind.
  [[nodiscard]] bool is_induced() const;

  /// @return the parts of a sum, this one first.
  [[nodiscard]] std::vector<const FieldSetup*> parts() const;
  [[nodiscard]] std::vector<FieldSetup*> parts();

  /// @return the part that changes from reading to reading; null where none does.
  [[nodiscard]] const FieldSetup* moving_part() const;
};

/// @param kind     its name; empty: none.
/// @param members  further members of the kind in files, as {"model", "igrf14"}.
/// @return a field of that kind.
/// @throws SetupError  for a kind or member that is not known; the message lists the kinds.
[[nodiscard]] AXISCAL_EXPORT std::shared_ptr<const ReferenceField> make_field(
    std::string_view kind, const std::map<std::string, std::string>& members = {});

/// Reads a field of an experiment's file (formats.md, Experiment): an object, or an array of parts
/// that are summed.
/// @param path  of the file; `-` is standard input.
/// @throws DataError  for a file that is no such thing.
[[nodiscard]] AXISCAL_EXPORT FieldSetup read_field(const std::string& path);

/// @return a record's field in the form of an experiment.
/// @param with_vector  whether where it lies in the table is stated too.
[[nodiscard]] AXISCAL_EXPORT FieldSetup setup_of(const FieldDescription& field, bool with_vector);

/// @throws SetupError  for a unit that a kind of field is not given in.
AXISCAL_EXPORT void check_field_unit(std::string_view kind, const std::string& unit);

/// Further inputs, besides the table's place, for resolving a field.
struct FieldOccasion {
  std::optional<double> time_s;   ///< from the readings if they have it; otherwise the place's date
  std::string reading_unit;       ///< unit of the readings; a field without any stated number
                                  ///< takes it
  std::optional<double> largest;  ///< length of the largest field that readings bring [unit]; it is
                                  ///< the magnitude of a field of which none is stated or computed
};

/// The field before anything is measured, part by part, in the unit of the first.
///
/// The magnitude is the stated one; else the length of in_table; else 1 for the units `g` and `1`;
/// else from a model at the site and date, from the geometry of a coil, or from the sum of lamps.
/// in_table is the stated vector; else the field at the site, rotated by the fence's azimuth and
/// the known slope; a turntable's is along the table's normal. In a sum with a part of known
/// magnitude, other magnitudes may be unknown.
/// @throws SetupError    if kind or unit are not known, or a magnitude cannot be computed.
/// @throws RefusedError  if a model does not hold there, or the sun is below the horizon.
[[nodiscard]] AXISCAL_EXPORT std::vector<FieldDescription> resolve_field(
    const FieldSetup& setup, const TablePlace& place, const FieldOccasion& occasion);

/// One part alone, e.g. a second field.
[[nodiscard]] AXISCAL_EXPORT FieldDescription resolve_part(const FieldSetup& part,
                                                           const TablePlace& place,
                                                           const FieldOccasion& occasion);

/// The sum of the parts, with the site and date of the computation.
[[nodiscard]] AXISCAL_EXPORT FieldDescription
describe_field(const TablePlace& place, const std::vector<FieldDescription>& parts);

/// @return rotation_table_from_enu at a place, for a field that moves.
/// @throws SetupError  if the fence's azimuth is not stated.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d rotation_of_moving(const TablePlace& place,
                                                                const ReferenceField& field);

/// The change of a moving field in the table: the value at one time becomes the value at another by
/// a rotation times the ratio of their lengths.
///
/// @param from_s, to_s  seconds since 1970-01-01, UTC.
/// @return frame table; the identity where the field does not move.
/// @throws SetupError  if it moves and the fence's azimuth is not stated, or it is not alone.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d change_of_field(const FieldSetup& setup,
                                                             const TablePlace& place,
                                                             double from_s,
                                                             double to_s);

}  // namespace axiscal
