// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include <Eigen/Core>

namespace axiscal {

/// What the world offers to calibrate against: a known vector at a site.
///
/// Any field whose direction is fixed in the room will do. Derive from this class to calibrate
/// against a field of your own: a calibration asks for nothing but these functions.
class ReferenceField {
 public:
  ReferenceField() = default;
  virtual ~ReferenceField() = default;

  /// @return the field [unit()], frame enu (east, north, up at the site).
  [[nodiscard]] virtual Eigen::Vector3d value_in_enu() const = 0;

  /// @return whether value_in_enu_at() changes from reading to reading, as with the sun's place.
  [[nodiscard]] virtual bool moves() const { return false; }

  /// @param time_s  seconds since 1970-01-01, UTC.
  /// @return the field then [unit()], frame enu; of a field that does not move value_in_enu(). Its
  ///         length may change too.
  [[nodiscard]] virtual Eigen::Vector3d value_in_enu_at([[maybe_unused]] double time_s) const {
    return value_in_enu();
  }

  /// @return the unit of value_in_enu(), e.g. "m/s^2"; it becomes part of the record.
  [[nodiscard]] virtual std::string_view unit() const = 0;

  /// @return the kind of field as records name it, e.g. "gravity".
  [[nodiscard]] virtual std::string_view kind() const = 0;

  /// @return length of value_in_enu() [unit()].
  [[nodiscard]] virtual double magnitude() const { return value_in_enu().norm(); }

  /// @return standard uncertainty of magnitude() [unit()]; 0 where none is stated.
  [[nodiscard]] virtual double magnitude_uncertainty() const { return 0.0; }

  /// @return whether the field is made on the table: value_in_enu() is then its value in the table
  ///         wherever that stands, and a reading's `level` the multiple of it that was set.
  [[nodiscard]] virtual bool is_induced() const { return false; }

 protected:
  ReferenceField(const ReferenceField&) = default;
  ReferenceField(ReferenceField&&) = default;
  ReferenceField& operator=(const ReferenceField&) = default;
  ReferenceField& operator=(ReferenceField&&) = default;
};

}  // namespace axiscal
