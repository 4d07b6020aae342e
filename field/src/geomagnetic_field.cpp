// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/geomagnetic_field.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include <GeographicLib/Geocentric.hpp>
#include <GeographicLib/MagneticModel.hpp>
#include <GeographicLib/SphericalHarmonic1.hpp>

#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/json_members.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/field_resolver.hpp"
#include "axiscal/field/field_unit.hpp"
#include "axiscal/field/settings.hpp"
#include "field_entries.hpp"
#include "field_members.hpp"
#include "wmm2025_coefficients.hpp"

namespace axiscal {

// Where the coefficients come from, and from when to when and how high they hold.
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

namespace {

constexpr std::string_view built_in_name = "wmm2025";

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
    // Forward() gives the matrix, row by row, that takes enu to geocentric axes.
    using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    return -reference_radius_m * (Eigen::Map<const RowMajor>(axes.data()).transpose() * gradient);
  }

 private:
  static constexpr int degree = 12;
  static constexpr double reference_radius_m = 6371200.0;

  // The sum keeps pointers to them.
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

std::shared_ptr<const GeomagneticModel::Coefficients> coefficients_of(const std::string& name) {
  if (name == built_in_name) {
    static const auto built_in = std::make_shared<const BuiltIn>();
    return built_in;
  }
  try {
    return std::make_shared<const Installed>(name);
  } catch (const GeographicLib::GeographicErr& error) {
    throw DataError(
        name, formatted("no such magnetic model: looked in {} ({}); install it for GeographicLib, "
                        "set GEOGRAPHICLIB_MAGNETIC_PATH, or use wmm2025, which is built in",
                        GeographicLib::MagneticModel::DefaultMagneticPath(), error.what()));
  }
}

}  // namespace

GeomagneticModel::GeomagneticModel(const std::string& name)
    : name_(name), coefficients_(coefficients_of(name)) {}

Eigen::Vector3d GeomagneticModel::value_in_enu_nT(const Site& site, double year) const {
  check_site(site);
  const Coefficients::Range range = coefficients_->range();
  if (!(year >= range.first_year && year <= range.last_year)) {
    throw RefusedError(
        formatted("magnetic model {} holds from {} to {}, not in {}; give another date or model",
                  name_, number_text(range.first_year), number_text(range.last_year),
                  number_text(std::round(year * 1e6) / 1e6)),
        {settings::date, settings::magnetic_model});
  }
  if (!(site.height_m >= range.lowest_m && site.height_m <= range.highest_m)) {
    throw RefusedError(formatted(
        "magnetic model {} holds from {} to {} m above the ellipsoid, not at {} m", name_,
        number_text(range.lowest_m), number_text(range.highest_m), number_text(site.height_m)));
  }
  return coefficients_->at(site, year);
}

std::optional<GeomagneticUncertainty> GeomagneticModel::uncertainty(
    const Eigen::Vector3d& value_in_enu_nT) const {
  if (name_ != built_in_name) {
    return std::nullopt;
  }
  const double horizontal_nT = std::hypot(value_in_enu_nT.x(), value_in_enu_nT.y());
  return GeomagneticUncertainty{
      .in_enu_nT = {89.0, 137.0, 141.0},
      .magnitude_nT = 138.0,
      .inclination_rad = 0.20 * rad_per_deg,
      .declination_rad = std::hypot(0.26, 5417.0 / horizontal_nT) * rad_per_deg};
}

double inclination_of(const Eigen::Vector3d& value_in_enu) {
  return std::atan2(-value_in_enu.z(), std::hypot(value_in_enu.x(), value_in_enu.y()));
}

double declination_of(const Eigen::Vector3d& value_in_enu) {
  return std::atan2(value_in_enu.x(), value_in_enu.y());
}

GeomagneticField::GeomagneticField(const Site& site,
                                   double year,
                                   std::string unit,
                                   const GeomagneticModel& model)
    : unit_(std::move(unit)), site_(site), year_(year), model_(model.name()) {
  const double per_nT = factor_between("nT", unit_);
  const Eigen::Vector3d value_nT = model.value_in_enu_nT(site, year);
  value_ = per_nT * value_nT;
  if (const auto u = model.uncertainty(value_nT)) {
    magnitude_u_ = per_nT * u->magnitude_nT;
  }
}

void GeomagneticField::state(FieldSetup& setup) const {
  setup.unit = unit_;
}

void GeomagneticField::resolve(FieldResolver& of) const {
  if (!site_ && !of.site()) {
    of.set_given_magnitude(": its magnitude is not known; state it, or the site", {settings::site});
    return;
  }
  if (!site_) {
    of.require_longitude();
  }
  const GeomagneticField there(site_ ? *site_ : *of.site(),
                               site_ ? year_ : decimal_year_of(of.date_s()), of.found().unit,
                               GeomagneticModel(model_));
  of.set_magnitude(of.given_magnitude().value_or(there.magnitude()));
  if (!of.given_magnitude()) {
    of.set_model_u(there.magnitude_uncertainty());
  }
  of.found().model = model_;
  of.set_direction(there.value_in_enu(), false);
}

void GeomagneticField::members(JsonMembers& io) {
  model_members(io, model_, "wmm2025");
  site_members(io, site_);
  if (site_) {
    io.need("date", year_);
  }
}

FieldKind geomagnetic_entry() {
  return {.name = "geomagnetic",
          .units = magnetic_units,
          .local = true,
          .dated = true,
          .members = members_with_date,
          .make = maker_of<GeomagneticField>()};
}

}  // namespace axiscal
