// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>

#include "axiscal/core/error.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/custom_field.hpp"
#include "axiscal/field/gravity_field.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

TEST(GravityField, IsOneGUpByDefault) {
  const GravityField field;
  EXPECT_EQ(field.value_in_enu(), Eigen::Vector3d(0.0, 0.0, 1.0));
  EXPECT_EQ(field.unit(), "g");
  EXPECT_EQ(field.kind(), "gravity");
  EXPECT_EQ(field.magnitude(), 1.0);
}

TEST(GravityField, AgreesWithSomiglianaOnTheEllipsoid) {
  // WGS 84 (NIMA TR8350.2, 2000, table 3.4 and eq. 4-1): gamma_e, k, e^2.
  constexpr double gamma_e = 9.7803253359;
  constexpr double k = 0.00193185265241;
  constexpr double e2 = 6.69437999014e-3;
  for (const double latitude_deg : {-90.0, -33.3, 0.0, 12.0, 45.0, 52.1, 90.0}) {
    const double s2 = std::pow(std::sin(latitude_deg * rad_per_deg), 2);
    const double expected = gamma_e * (1.0 + k * s2) / std::sqrt(1.0 - e2 * s2);
    const GravityField field(Site{.latitude_deg = latitude_deg, .longitude_deg = 8.0});
    // The published constants have 11 digits.
    EXPECT_NEAR(field.magnitude(), expected, 1e-9) << latitude_deg;
    EXPECT_EQ(field.unit(), "m/s^2");
  }
}

TEST(GravityField, FallsWithHeight) {
  // Free-air gradient 0.3086 mGal/m at mid latitude.
  const Site low{.latitude_deg = 45.0};
  const Site high{.latitude_deg = 45.0, .height_m = 1000.0};
  EXPECT_NEAR(GravityField(low).magnitude() - GravityField(high).magnitude(), 3.086e-3, 2e-6);
}

TEST(GravityField, RejectsWhatIsOutOfRange) {
  EXPECT_THROW(GravityField(Site{.latitude_deg = 90.1}), DomainError);
  EXPECT_THROW(GravityField(Site{.latitude_deg = std::nan("")}), DomainError);
  EXPECT_THROW(GravityField(Site{.longitude_deg = -181.0}), DomainError);
  EXPECT_THROW(GravityField(Site{.height_m = std::numeric_limits<double>::infinity()}),
               DomainError);
  EXPECT_THROW(GravityField(0.0, "g"), DomainError);
  EXPECT_THROW(GravityField(std::nan(""), "g"), DomainError);
}

TEST(CustomField, IsWhatItWasGiven) {
  const CustomField field(Eigen::Vector3d(3.0, 0.0, -4.0), "uT");
  EXPECT_EQ(field.value_in_enu(), Eigen::Vector3d(3.0, 0.0, -4.0));
  EXPECT_EQ(field.magnitude(), 5.0);
  EXPECT_EQ(field.unit(), "uT");
  EXPECT_THROW(CustomField{Eigen::Vector3d(0.0, 0.0, 0.0)}, DomainError);
}

}  // namespace
}  // namespace axiscal
