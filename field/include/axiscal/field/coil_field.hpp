// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"
#include "axiscal/field/reference_field.hpp"

namespace axiscal {

/// The winding of a coil system.
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
  double current_A = 1.0;  ///< current if the level of a reading is 1
  double size_m = 1.0;     ///< radius of round coils, side of square coils
  Eigen::Vector3d axis_in_table = Eigen::Vector3d::UnitZ();  ///< direction of the field
};

/// Computes the flux density at the centre of a coil system.
///
/// @return the flux density B [T] in the table's frame, along the axis.
/// @throws DomainError  unless turns and size are positive, and current and axis are not zero.
/// @par Source
/// Helmholtz: B = (4/5)^(3/2) mu_0 N I / R. Merritt, Purcell & Stroink, Rev. Sci. Instrum. 54
/// (1983) 879: positions and current ratio of the four-coil system; a square loop of side d on its
/// axis gives 2 mu_0 I a^2 / (pi (a^2 + z^2) sqrt(2 a^2 + z^2)), a = d/2.
[[nodiscard]] AXISCAL_EXPORT Eigen::Vector3d coil_field_in_table_T(const Coil& coil);

/// The magnetic field of a coil system around the cube, of the kind `induced_magnetic`. The level
/// of a reading multiplies the coil's current.
class AXISCAL_EXPORT CoilField final : public ReferenceField {
 public:
  /// A coil system of unknown geometry. The experiment states the vector or magnitude of its field.
  /// If it is part of a sum with a known field, its magnitude may be unknown.
  CoilField() = default;

  /// @throws DomainError  as coil_field_in_table_T().
  explicit CoilField(const Coil& coil, std::string unit = "");

  /// @return the coil's field [unit(); nT if unit() is empty], in the table's frame because the
  ///         field is induced (see ReferenceField::is_induced()); zero without a coil.
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
