// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"
#include "axiscal/field/reference_field.hpp"

namespace axiscal {

/// The arrangement of the coils in a coil system.
enum class CoilShape {
  helmholtz,  ///< two round coils at a distance of one radius
  merritt,    ///< four square coils of side d at +-0.128106 d and +-0.505492 d; the inner coils
              ///< have 11/26 of the turns of the outer coils
};

/// @return the shape called "helmholtz" or "merritt", or nullopt.
[[nodiscard]] AXISCAL_EXPORT std::optional<CoilShape> parse_coil_shape(std::string_view name);

/// A coil system around the cube.
struct AXISCAL_EXPORT Coil {
  CoilShape shape = CoilShape::helmholtz;
  double turns = 1.0;      ///< number of turns of each round coil, or of each outer square coil
  double current_A = 1.0;  ///< current during a reading of level 1
  double size_m = 1.0;     ///< radius of round coils, side of square coils
  Eigen::Vector3d axis_in_table = Eigen::Vector3d::UnitZ();  ///< the field's direction, any length
};

/// Computes the flux density at the centre of a coil system.
///
/// @return the flux density B [T] in the table's frame, along the axis.
/// @throws DomainError  unless turns and size are positive, and current and axis are not zero.
/// @par Source
/// Helmholtz: B = (4/5)^(3/2) mu_0 N I / R. Merritt, Purcell & Stroink, Rev. Sci. Instrum. 54
/// (1983) 879: positions and current ratio of the four-coil system. A square loop of side 2 a has
/// B = 2 mu_0 I a^2 / (pi (a^2 + z^2) sqrt(2 a^2 + z^2)) on its axis, at the distance z.
[[nodiscard]] AXISCAL_EXPORT Eigen::Vector3d coil_field_in_table_T(const Coil& coil);

/// A field of the kind `induced_magnetic`: the magnetic field of a coil system around the cube. The
/// level of a reading multiplies the coil's current.
class AXISCAL_EXPORT CoilField final : public ReferenceField {
 public:
  /// A coil system of unknown geometry. The experiment states the vector or magnitude of its field.
  /// The magnitude of the coil's field may be unknown if a known field is added to it.
  CoilField() = default;

  /// @throws DomainError  for the same reasons as coil_field_in_table_T().
  explicit CoilField(const Coil& coil, std::string unit = "");

  /// @return the coil's field, or zero if the coil is unknown. The unit is unit(), or nT if unit()
  ///         is empty. The frame is the table's, because the field is induced (see
  ///         ReferenceField::is_induced()).
  [[nodiscard]] Eigen::Vector3d value_in_enu() const override;
  [[nodiscard]] std::string_view unit() const override { return unit_; }
  [[nodiscard]] std::string_view kind() const override { return "induced_magnetic"; }
  [[nodiscard]] bool is_induced() const override { return true; }

  void state(FieldSetup& setup) const override;
  void resolve(FieldResolver& of) const override;
  void members(JsonMembers& io) override;

 private:
  std::optional<Coil> coil_;
  std::string unit_;
};

}  // namespace axiscal
