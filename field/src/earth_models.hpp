// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "axiscal/field/geomagnetic_field.hpp"

namespace axiscal {

/// The name of the magnetic model that is compiled into the library.
inline constexpr std::string_view built_in_magnetic_model = "wmm2025";

/// A geomagnetic model: its coefficients, and the range of years and heights in which it is valid.
class GeomagneticModel::Coefficients {
 public:
  struct Range {
    double first_year, last_year, lowest_m, highest_m;
  };

  Coefficients() = default;
  virtual ~Coefficients() = default;
  Coefficients(const Coefficients&) = delete;
  Coefficients& operator=(const Coefficients&) = delete;

  [[nodiscard]] virtual Range range() const = 0;
  [[nodiscard]] virtual Eigen::Vector3d at(const Site& site, double year) const = 0;
};

/// Returns the coefficients of the built-in model or of a model installed for GeographicLib.
/// @throws DataError   if the model is not installed.
/// @throws SetupError  if the library was built without GeographicLib.
[[nodiscard]] std::shared_ptr<const GeomagneticModel::Coefficients> geomagnetic_coefficients(
    const std::string& model);

}  // namespace axiscal
