// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "axiscal/field/geomagnetic_field.hpp"

namespace axiscal {

/// The magnetic model that no file is needed for.
inline constexpr std::string_view built_in_magnetic_model = "wmm2025";

/// Where the coefficients come from, and from when to when and how high they hold.
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

/// @throws DataError   if the model is not installed.
/// @throws SetupError  in a library without GeographicLib.
[[nodiscard]] std::shared_ptr<const GeomagneticModel::Coefficients> geomagnetic_coefficients(
    const std::string& model);

}  // namespace axiscal
