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

/// A vector at the place of the calibration that serves as the reference: gravity, the geomagnetic
/// field, the light of a lamp.
///
/// Example: `experiment.field = GeomagneticField(site, 2026.5)`. The field must be constant in the
/// room, or moves() must return true. Derive from this class to calibrate with a field of your own.
/// A calibration calls only the functions of the first group below. Override the second group too
/// if files should be able to state the kind (docs/howto.md, "Add a field").
class AXISCAL_EXPORT ReferenceField {
 public:
  ReferenceField() = default;
  virtual ~ReferenceField() = default;

  // ---- functions for every field ----

  /// @return the field [unit()], frame enu (east, north, up at the site); zero if it depends on the
  ///         table's place, which is not known here.
  [[nodiscard]] virtual Eigen::Vector3d value_in_enu() const = 0;

  /// @return the unit of value_in_enu() as written in records, e.g. "m/s^2"; empty for the default
  ///         unit of the kind.
  [[nodiscard]] virtual std::string_view unit() const = 0;

  /// @return the name of the kind of field, e.g. "gravity".
  [[nodiscard]] virtual std::string_view kind() const = 0;

  /// @return true if the field changes from reading to reading, e.g. the direction of the sun.
  [[nodiscard]] virtual bool moves() const { return false; }

  /// @return true if a field that moves needs the readings' times in UTC; false if times by any
  ///         common clock are enough.
  [[nodiscard]] virtual bool needs_utc() const { return true; }

  /// @param time_s  seconds since 1970-01-01, UTC.
  /// @return the field at that time [unit()], frame enu; value_in_enu() if the field does not move.
  ///         Its length may change with the time too.
  [[nodiscard]] virtual Eigen::Vector3d value_in_enu_at([[maybe_unused]] double time_s) const {
    return value_in_enu();
  }

  /// @return length of value_in_enu() [unit()].
  [[nodiscard]] virtual double magnitude() const { return value_in_enu().norm(); }

  /// @return standard uncertainty of magnitude() [unit()]; 0 if no uncertainty is stated.
  [[nodiscard]] virtual double magnitude_uncertainty() const { return 0.0; }

  /// @return true if the experimenter makes the field with a source that is mounted on the table.
  ///         Then value_in_enu() returns the field in the table's frame, and each reading's `level`
  ///         multiplies it.
  [[nodiscard]] virtual bool is_induced() const { return false; }

  // ---- functions for a kind of field that can be specified in a file ----

  /// Writes the properties of this field into an experiment's setup. The default writes nothing.
  virtual void state([[maybe_unused]] FieldSetup& setup) const {}

  /// Computes the field in the table from the stated inputs. The default uses value_in_enu(), and
  /// throws if another magnitude or role is stated.
  /// @throws SetupError, RefusedError  for the same reasons as resolve_field().
  virtual void resolve(FieldResolver& of) const;

  /// @return the vector of a moving field at a time, frame table [any unit]. The default rotates
  ///         value_in_enu_at() to the table.
  /// @throws SetupError  if the fence's azimuth is needed and not stated.
  [[nodiscard]] virtual Eigen::Vector3d moving_in_table(const TablePlace& place,
                                                        double time_s) const;

  /// @return the name of the moving object, for messages: "the field NAME", "the sun's place".
  [[nodiscard]] virtual std::string moving_name() const;

  /// Reads or writes the JSON members that only this kind of field has.
  virtual void members([[maybe_unused]] JsonMembers& io) {}

 protected:
  ReferenceField(const ReferenceField&) = default;
  ReferenceField(ReferenceField&&) = default;
  ReferenceField& operator=(const ReferenceField&) = default;
  ReferenceField& operator=(ReferenceField&&) = default;
};

}  // namespace axiscal
