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
  helmholtz,  ///< two round coils, a radius apart
  merritt,    ///< four square coils of side d at +-0.128106 d and +-0.505492 d, the inner ones with
              ///< 11/26 of the outer ones' turns
};

/// @return the shape called "helmholtz" or "merritt", or nullopt.
[[nodiscard]] AXISCAL_EXPORT std::optional<CoilShape> parse_coil_shape(std::string_view name);

/// A coil system around the cube.
struct AXISCAL_EXPORT Coil {
  CoilShape shape = CoilShape::helmholtz;
  double turns = 1.0;      ///< number of turns of each (outer) coil
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
[[nodiscard]] AXISCAL_EXPORT Eigen::Vector3d coil_field_in_table_T(const Coil& coil);

/// The magnetic field of a coil system around the cube, `induced_magnetic`: a reading's level is
/// the multiple of the coil's current.
class AXISCAL_EXPORT CoilField final : public ReferenceField {
 public:
  /// A coil whose vector or magnitude the experiment states. Together with a known field it may be
  /// unknown.
  CoilField() = default;

  /// @throws DomainError  as coil_field_in_table_T().
  explicit CoilField(const Coil& coil, std::string unit = "");

  /// @return the coil's field in the table [unit(), else nT]; zero without a coil.
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
