// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/field/table_place.hpp"

namespace axiscal {

class FieldResolver;
class JsonMembers;
struct FieldSetup;

/// A vector of the surroundings that serves as the reference: gravity, the geomagnetic field, the
/// light of a lamp.
///
/// `experiment.field = GeomagneticField(site, 2026.5)`. Any field whose direction is fixed in the
/// room will do, and one that moves if it says how. Derive from this class to calibrate against a
/// field of your own: a calibration asks for nothing but the functions of the first group. Those of
/// the second are for a kind that files can state too (docs/howto.md, "Add a field").
class AXISCAL_EXPORT ReferenceField {
 public:
  ReferenceField() = default;
  virtual ~ReferenceField() = default;

  // ---- what every field says ----

  /// @return the field [unit()], frame enu (east, north, up at the site); zero where it is not
  ///         known without the table's place.
  [[nodiscard]] virtual Eigen::Vector3d value_in_enu() const = 0;

  /// @return the unit of value_in_enu(), e.g. "m/s^2"; it becomes part of the record. Empty: the
  ///         first of its kind's.
  [[nodiscard]] virtual std::string_view unit() const = 0;

  /// @return the kind of field as records name it, e.g. "gravity".
  [[nodiscard]] virtual std::string_view kind() const = 0;

  /// @return true if the field changes from reading to reading, as the direction of the sun.
  [[nodiscard]] virtual bool moves() const { return false; }

  /// @return true if a field that moves needs times in UTC; otherwise any clock that the readings
  ///         share is enough.
  [[nodiscard]] virtual bool needs_utc() const { return true; }

  /// @param time_s  seconds since 1970-01-01, UTC.
  /// @return the field then [unit()], frame enu; of a field that does not move value_in_enu(). Its
  ///         length may change too.
  [[nodiscard]] virtual Eigen::Vector3d value_in_enu_at([[maybe_unused]] double time_s) const {
    return value_in_enu();
  }

  /// @return length of value_in_enu() [unit()].
  [[nodiscard]] virtual double magnitude() const { return value_in_enu().norm(); }

  /// @return standard uncertainty of magnitude() [unit()]; 0 where none is stated.
  [[nodiscard]] virtual double magnitude_uncertainty() const { return 0.0; }

  /// @return true if the table produces the field. value_in_enu() is then its value in the table's
  ///         frame, wherever the table stands, and the `level` of a reading multiplies it.
  [[nodiscard]] virtual bool is_induced() const { return false; }

  // ---- what a kind that is stated in files says besides ----

  /// Writes the properties of this field into an experiment's setup. The default does not write
  /// any, and resolve() calls the functions above.
  virtual void state([[maybe_unused]] FieldSetup& setup) const {}

  /// Computes the field in the table from the stated inputs. The default uses the value above, and
  /// refuses another stated value.
  /// @throws SetupError, RefusedError  as resolve_field().
  virtual void resolve(FieldResolver& of) const;

  /// @return where a field that moves points in the table at a time [any unit]; as it comes, by
  ///         value_in_enu_at() and how the table lies.
  /// @throws SetupError  where that is not stated.
  [[nodiscard]] virtual Eigen::Vector3d moving_in_table(const TablePlace& place,
                                                        double time_s) const;

  /// @return the name of the moving object, for messages: "the field NAME", "the sun's place".
  [[nodiscard]] virtual std::string moving_name() const;

  /// The members that files have for this kind besides those of every field, by one table for
  /// reading and writing.
  virtual void members([[maybe_unused]] JsonMembers& io) {}

 protected:
  ReferenceField(const ReferenceField&) = default;
  ReferenceField(ReferenceField&&) = default;
  ReferenceField& operator=(const ReferenceField&) = default;
  ReferenceField& operator=(ReferenceField&&) = default;
};

}  // namespace axiscal
