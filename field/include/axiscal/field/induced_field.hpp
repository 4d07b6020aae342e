// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "axiscal/field/reference_field.hpp"

namespace axiscal {

/// A field that the experimenter makes: a turntable's rotation, a coil's field, a lamp's light.
///
/// It is fixed in the table's frame, and a reading's `level` is the multiple of it that was set.
class InducedField final : public ReferenceField {
 public:
  /// @param kind            "induced_rotation", "induced_magnetic", "light" or a name of your own.
  /// @param value_in_table  at level 1 [unit], frame table; not zero.
  /// @param unit            of the vector.
  /// @throws DomainError  if the vector is zero or not finite.
  InducedField(std::string kind, const Eigen::Vector3d& value_in_table, std::string unit);

  /// @return the vector in a table that is level with its fence to the north.
  [[nodiscard]] Eigen::Vector3d value_in_enu() const override { return value_; }
  [[nodiscard]] std::string_view unit() const override { return unit_; }
  [[nodiscard]] std::string_view kind() const override { return kind_; }
  [[nodiscard]] bool is_induced() const override { return true; }

 private:
  std::string kind_;
  Eigen::Vector3d value_;
  std::string unit_;
};

/// How a coil system is wound.
enum class CoilShape {
  helmholtz,  ///< two round coils, a radius apart
  merritt,    ///< four square coils of side d at +-0.128106 d and +-0.505492 d, the inner ones with
              ///< 11/26 of the outer ones' turns
};

/// @return the shape called "helmholtz" or "merritt", or nothing.
[[nodiscard]] std::optional<CoilShape> parse_coil_shape(std::string_view name);

/// A coil system around the cube.
struct Coil {
  CoilShape shape = CoilShape::helmholtz;
  double turns = 1.0;      ///< how many each (outer) coil has
  double current_A = 1.0;  ///< at level 1
  double size_m = 1.0;     ///< radius of the round, side of the square coils
  Eigen::Vector3d axis_in_table = Eigen::Vector3d::UnitZ();  ///< direction of the field
};

/// The flux density at the coil's centre.
///
/// @return B [T], along the axis, frame table.
/// @throws DomainError  unless turns and size are positive, current and axis not zero.
/// @par Source
/// Helmholtz: B = (4/5)^(3/2) mu_0 N I / R. Merritt, Purcell & Stroink, Rev. Sci. Instrum. 54
/// (1983) 879: positions and current ratio of the four-coil system; a square loop of side d on its
/// axis gives 2 mu_0 I a^2 / (pi (a^2 + z^2) sqrt(2 a^2 + z^2)), a = d/2.
[[nodiscard]] Eigen::Vector3d coil_field_in_table_T(const Coil& coil);

/// A collimated lamp: its light comes from one direction.
struct Lamp {
  Eigen::Vector3d direction_in_table = Eigen::Vector3d::UnitZ();  ///< towards the lamp, any length
  double irradiance = 1.0;  ///< on a surface square to the light [unit]
};

/// @return the field of several lamps at once: the sum of irradiance times direction, which is what
///         an axis with a cosine response that sees all of them answers to [unit], frame table.
/// @throws DomainError  if there is no lamp, or one has no direction or irradiance.
[[nodiscard]] Eigen::Vector3d lamps_in_table(const std::vector<Lamp>& lamps);

}  // namespace axiscal
