// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/core/export.hpp"
#include "axiscal/field/reference_field.hpp"

namespace axiscal {

/// A collimated lamp: its light comes from one direction.
struct AXISCAL_EXPORT Lamp {
  Eigen::Vector3d direction_in_table = Eigen::Vector3d::UnitZ();  ///< towards the lamp, any length
  double irradiance = 1.0;  ///< irradiance of a surface perpendicular to the light [unit]
};

/// @return the field of several lamps together: the sum of irradiance times unit direction [unit],
///         frame table. An axis with a cosine response that is lit by all lamps responds to this
///         sum.
/// @throws DomainError  if the list is empty, a lamp's direction is zero, or its irradiance is not
///                      positive.
[[nodiscard]] AXISCAL_EXPORT Eigen::Vector3d lamps_in_table(const std::vector<Lamp>& lamps);

/// The light of lamps on the table, of the sun, or of a source whose direction is unknown and is
/// fitted.
class AXISCAL_EXPORT LightField final : public ReferenceField {
 public:
  /// Light from one source, whose direction the experiment states or the fit determines.
  LightField() = default;

  /// @param lamps  lamps that are all on at the same time; the level of a reading multiplies their
  ///               light.
  /// @param unit   unit of the lamps' irradiance.
  /// @throws DomainError  for the same reasons as lamps_in_table().
  explicit LightField(std::vector<Lamp> lamps, std::string unit = "1");

  /// The sun's light. Its direction follows from the table's site and the readings' times.
  /// @param refraction  true: refraction by the atmosphere is included.
  [[nodiscard]] static LightField sun(bool refraction = false);

  /// @return the sum of the lamps [unit()], frame table; zero without lamps.
  [[nodiscard]] Eigen::Vector3d value_in_enu() const override;
  [[nodiscard]] std::string_view unit() const override { return unit_; }
  [[nodiscard]] std::string_view kind() const override { return "light"; }
  [[nodiscard]] bool moves() const override { return is_sun_; }
  [[nodiscard]] bool is_induced() const override { return true; }

  void state(FieldSetup& setup) const override;
  void resolve(FieldResolver& of) const override;
  [[nodiscard]] Eigen::Vector3d moving_in_table(const TablePlace& place,
                                                double time_s) const override;
  [[nodiscard]] std::string moving_name() const override { return "the sun's place"; }
  void members(JsonMembers& io) override;

 private:
  void resolve_sun(FieldResolver& of) const;

  std::vector<Lamp> lamps_;
  bool is_sun_ = false;
  bool refraction_ = false;
  std::string unit_;
};

}  // namespace axiscal
