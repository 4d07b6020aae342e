// SPDX-License-Identifier: Apache-2.0
// Models of the Earth's gravity and magnetic field, evaluated by GeographicLib.
#include "field/src/earth_models.hpp"

#include <vector>

#include <GeographicLib/Geocentric.hpp>
#include <GeographicLib/GravityModel.hpp>
#include <GeographicLib/MagneticModel.hpp>
#include <GeographicLib/NormalGravity.hpp>
#include <GeographicLib/SphericalHarmonic1.hpp>

#include "axiscal/core/error.hpp"
#include "axiscal/field/gravity_field.hpp"
#include "core/formatted.hpp"
#include "field/src/wmm2025_coefficients.hpp"

namespace axiscal {
namespace {

class BuiltIn final : public GeomagneticModel::Coefficients {
 public:
  [[nodiscard]] Range range() const override { return {2025.0, 2030.0, -1000.0, 850e3}; }

  [[nodiscard]] Eigen::Vector3d at(const Site& site, double year) const override {
    Eigen::Vector3d at;
    std::vector<GeographicLib::Math::real> axes;
    axes.resize(9);
    GeographicLib::Geocentric::WGS84().Forward(site.latitude_deg, site.longitude_deg, site.height_m,
                                               at.x(), at.y(), at.z(), axes);
    constexpr double epoch = 2025.0;
    Eigen::Vector3d gradient;
    potential_(year - epoch, at.x(), at.y(), at.z(), gradient.x(), gradient.y(), gradient.z());
    // Forward() returns the rotation matrix from enu to geocentric axes, row by row.
    using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    return -reference_radius_m * (Eigen::Map<const RowMajor>(axes.data()).transpose() * gradient);
  }

 private:
  static constexpr int degree = 12;
  static constexpr double reference_radius_m = 6371200.0;

  // potential_ keeps pointers to these vectors.
  std::vector<double> cosines_{wmm2025_cosines.begin(), wmm2025_cosines.end()};
  std::vector<double> sines_{wmm2025_sines.begin(), wmm2025_sines.end()};
  std::vector<double> cosine_rates_{wmm2025_cosine_rates.begin(), wmm2025_cosine_rates.end()};
  std::vector<double> sine_rates_{wmm2025_sine_rates.begin(), wmm2025_sine_rates.end()};
  GeographicLib::SphericalHarmonic1 potential_{cosines_,
                                               sines_,
                                               degree,
                                               cosine_rates_,
                                               sine_rates_,
                                               degree,
                                               reference_radius_m,
                                               GeographicLib::SphericalHarmonic::SCHMIDT};
};

class Installed final : public GeomagneticModel::Coefficients {
 public:
  explicit Installed(const std::string& name) : model_(name) {}

  [[nodiscard]] Range range() const override {
    return {model_.MinTime(), model_.MaxTime(), model_.MinHeight(), model_.MaxHeight()};
  }

  [[nodiscard]] Eigen::Vector3d at(const Site& site, double year) const override {
    Eigen::Vector3d value;
    model_(year, site.latitude_deg, site.longitude_deg, site.height_m, value.x(), value.y(),
           value.z());
    return value;
  }

 private:
  GeographicLib::MagneticModel model_;
};

}  // namespace

std::shared_ptr<const GeomagneticModel::Coefficients> geomagnetic_coefficients(
    const std::string& name) {
  if (name == built_in_magnetic_model) {
    static const auto built_in = std::make_shared<const BuiltIn>();
    return built_in;
  }
  try {
    return std::make_shared<const Installed>(name);
  } catch (const GeographicLib::GeographicErr& error) {
    throw DataError(name,
                    formatted("magnetic model not found in the folder {} ({}); install it for "
                              "GeographicLib, set GEOGRAPHICLIB_MAGNETIC_PATH, or use "
                              "wmm2025, which is built in",
                              GeographicLib::MagneticModel::DefaultMagneticPath(), error.what()));
  }
}

Eigen::Vector3d gravity_in_enu(const Site& site, const std::string& model) {
  check_site(site);
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();
  if (model == "wgs84") {
    GeographicLib::NormalGravity::WGS84().Gravity(site.latitude_deg, site.height_m, gravity.y(),
                                                  gravity.z());
    return Eigen::Vector3d::Zero() - gravity;
  }
  try {
    const GeographicLib::GravityModel installed(model);
    installed.Gravity(site.latitude_deg, site.longitude_deg, site.height_m, gravity.x(),
                      gravity.y(), gravity.z());
  } catch (const GeographicLib::GeographicErr& error) {
    throw DataError(model,
                    formatted("gravity model not found in the folder {} ({}); install it for "
                              "GeographicLib, set GEOGRAPHICLIB_GRAVITY_PATH, or use "
                              "wgs84, which is built in",
                              GeographicLib::GravityModel::DefaultGravityPath(), error.what()));
  }
  return Eigen::Vector3d::Zero() - gravity;
}

}  // namespace axiscal
