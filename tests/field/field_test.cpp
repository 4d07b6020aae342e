// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <sstream>

#include <Eigen/Geometry>

#include "axiscal/core/error.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/coil_field.hpp"
#include "axiscal/field/custom_field.hpp"
#include "axiscal/field/earth_rotation_field.hpp"
#include "axiscal/field/field_unit.hpp"
#include "axiscal/field/geomagnetic_field.hpp"
#include "axiscal/field/gravity_field.hpp"
#include "axiscal/field/induced_field.hpp"
#include "axiscal/field/light_field.hpp"
#include "axiscal/field/sun.hpp"
#include "data.hpp"
#include "matchers.hpp"
#include "program.hpp"

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
    // The published constants have 11 digits, hence the tolerance.
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

// ---- geomagnetic ----

// Reads lines of numbers, separated by spaces or commas. Skips other lines.
std::vector<std::vector<double>> read_numbers(const std::string& path) {
  std::ifstream file(path);
  std::vector<std::vector<double>> rows;
  for (std::string line; std::getline(file, line);) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream cells(line);
    std::vector<double> row;
    for (double value = 0.0; cells >> value;) {
      row.push_back(value);
    }
    if (row.size() > 1) {
      rows.push_back(row);
    }
  }
  return rows;
}

TEST(GeomagneticModel, AgreesWithNoaasTestValues) {
  AXISCAL_NEED_DATA(path, "geomag/WMM2025_TEST_VALUES_odd.txt");
  const GeomagneticModel model;
  double furthest_nT = 0.0;
  const std::vector<std::vector<double>> rows = read_numbers(path);
  ASSERT_GE(rows.size(), 50U);
  for (const std::vector<double>& row : rows) {
    // Columns: year, height [km], latitude, longitude, D, I, H, X (north), Y (east), Z (down), F.
    const Eigen::Vector3d value = model.value_in_enu_nT(
        {.latitude_deg = row[2], .longitude_deg = row[3], .height_m = 1e3 * row[1]}, row[0]);
    const Eigen::Vector3d expected(row[8], row[7], -row[9]);
    furthest_nT = std::max(furthest_nT, (value - expected).cwiseAbs().maxCoeff());
    EXPECT_NEAR(declination_of(value) * deg_per_rad, row[4], 0.0051);
    EXPECT_NEAR(inclination_of(value) * deg_per_rad, row[5], 0.0051);
  }
  EXPECT_LT(furthest_nT, 1e-3);
}

TEST(GeomagneticModel, AgreesWithTheReportsTable) {
  AXISCAL_NEED_DATA(path, "geomag/WMM2025_REPORT_TABLE_odd.txt");
  std::ifstream file(path);
  const GeomagneticModel model;
  int rows = 0;
  for (std::string line; std::getline(file, line);) {
    std::istringstream cells(line);
    std::vector<double> row;
    for (double value = 0.0; cells >> value;) {
      row.push_back(value);
    }
    if (row.size() < 9 || row[0] < 2025.0 || row[0] > 2030.0) {
      continue;
    }
    // Columns: year, height [km], latitude, longitude, X, Y, Z, ..., rounded to 0.1 nT.
    const Eigen::Vector3d value = model.value_in_enu_nT(
        {.latitude_deg = row[2], .longitude_deg = row[3], .height_m = 1e3 * row[1]}, row[0]);
    EXPECT_MATRIX_NEAR(value, Eigen::Vector3d(row[5], row[4], -row[6]), 0.051);
    ++rows;
  }
  EXPECT_GE(rows, 6);
}

// GeographicLib reads the model's files, which the same script made, and gives the same field.
TEST(GeomagneticModel, BuiltInIsWhatGeographicLibReads) {
  const test::ScratchFolder folder;
  std::filesystem::create_directory(folder.path("magnetic"));
  const std::filesystem::path data(AXISCAL_SOURCE_DIR "/field/data");
  std::filesystem::copy(data / "wmm2025.wmm", folder.path("magnetic/same.wmm"));
  std::filesystem::copy(data / "wmm2025.wmm.cof", folder.path("magnetic/same.wmm.cof"));
  ASSERT_EQ(setenv("GEOGRAPHICLIB_MAGNETIC_PATH", folder.path("magnetic").c_str(), 1), 0);
  const GeomagneticModel built_in;
  const GeomagneticModel installed("same");
  for (const double latitude_deg : {-90.0, -45.0, 0.0, 12.5, 89.0}) {
    const Site site{.latitude_deg = latitude_deg, .longitude_deg = 77.0, .height_m = 1234.0};
    EXPECT_MATRIX_NEAR(built_in.value_in_enu_nT(site, 2027.3),
                       installed.value_in_enu_nT(site, 2027.3), 1e-9);
  }
  EXPECT_FALSE(installed.uncertainty(Eigen::Vector3d(1.0, 2.0, 3.0)).has_value());
  try {
    GeomagneticModel missing("no-such-model");
    FAIL();
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr(folder.path("magnetic")));
  }
  unsetenv("GEOGRAPHICLIB_MAGNETIC_PATH");
}

TEST(GeomagneticModel, FilesAndSourceAreWhatTheScriptMakes) {
  const test::ScratchFolder folder;
  const std::string command = "/usr/bin/env python3 " AXISCAL_SOURCE_DIR "/scripts/make_wmm.py " +
                              folder.path("made") + " 2>/dev/null";
  if (std::system("/usr/bin/env python3 -c '' 2>/dev/null") != 0) {
    GTEST_SKIP() << "no python3";
  }
  ASSERT_EQ(std::system(command.c_str()), 0);
  for (const char* name : {"field/data/wmm2025.wmm", "field/data/wmm2025.wmm.cof",
                           "field/src/wmm2025_coefficients.cpp"}) {
    EXPECT_EQ(test::read_file(folder.path("made/" + std::string(name))),
              test::read_file(std::string(AXISCAL_SOURCE_DIR "/") + name))
        << name;
  }
}

TEST(GeomagneticModel, AgreesWithGeographicLibsToolForIgrf14) {
  AXISCAL_NEED_DATA(path, "geomag/geographiclib_MagneticField_igrf14_odd.csv");
  const std::string folder =
      (std::filesystem::path(path).parent_path() / "geographiclib/magnetic").string();
  ASSERT_EQ(setenv("GEOGRAPHICLIB_MAGNETIC_PATH", folder.c_str(), 1), 0);
  const GeomagneticModel model("igrf14");
  const std::vector<std::vector<double>> rows = read_numbers(path);
  ASSERT_GE(rows.size(), 40U);
  for (const std::vector<double>& row : rows) {
    const Eigen::Vector3d value = model.value_in_enu_nT(
        {.latitude_deg = row[1], .longitude_deg = row[2], .height_m = row[3]}, row[0]);
    EXPECT_MATRIX_NEAR(value, Eigen::Vector3d(row[8], row[7], -row[9]), 2e-5);
  }
  unsetenv("GEOGRAPHICLIB_MAGNETIC_PATH");
}

TEST(GeomagneticModel, RefusesDatesAndHeightsOutOfItsRange) {
  const GeomagneticModel model;
  const Site site{.latitude_deg = 48.0, .longitude_deg = 11.0};
  EXPECT_THROW(static_cast<void>(model.value_in_enu_nT(site, 2024.99)), RefusedError);
  EXPECT_THROW(static_cast<void>(model.value_in_enu_nT(site, 2030.01)), RefusedError);
  Site high = site;
  high.height_m = 900e3;
  EXPECT_THROW(static_cast<void>(model.value_in_enu_nT(high, 2026.0)), RefusedError);
  EXPECT_NO_THROW(GravityField{site});  // gravity needs no date
}

TEST(GeomagneticField, HasItsModelsUncertainty) {
  const GeomagneticField field({.latitude_deg = 48.1, .longitude_deg = 11.6}, 2026.5, "uT");
  EXPECT_NEAR(field.magnitude(), 48.8, 0.2);
  EXPECT_NEAR(field.magnitude_uncertainty(), 0.138, 1e-12);
  const GeomagneticModel model;
  const auto u = model.uncertainty(Eigen::Vector3d(0.0, 20000.0, -40000.0));
  EXPECT_NEAR(u->declination_rad * deg_per_rad, std::hypot(0.26, 5417.0 / 20000.0), 1e-12);
}

// ---- gravity by models, and measured ----

TEST(GravityInEnu, AgreesWithGeographicLibsToolForEgm96) {
  AXISCAL_NEED_DATA(path, "gravity/geographiclib_Gravity_egm96_odd.csv");
  const std::string folder =
      (std::filesystem::path(path).parent_path() / "geographiclib/gravity").string();
  ASSERT_EQ(setenv("GEOGRAPHICLIB_GRAVITY_PATH", folder.c_str(), 1), 0);
  const std::vector<std::vector<double>> rows = read_numbers(path);
  ASSERT_GE(rows.size(), 40U);
  for (const std::vector<double>& row : rows) {
    const Eigen::Vector3d force = gravity_in_enu(
        {.latitude_deg = row[0], .longitude_deg = row[1], .height_m = row[2]}, "egm96");
    EXPECT_MATRIX_NEAR(force, -Eigen::Vector3d(row[3], row[4], row[5]), 1e-8);
  }
  unsetenv("GEOGRAPHICLIB_GRAVITY_PATH");
  EXPECT_THROW(static_cast<void>(gravity_in_enu(Site{}, "no-such-model")), DataError);
}

TEST(GravityInEnu, IsOffFromMeasuredGravityByWhatTheLibraryStates) {
  AXISCAL_NEED_DATA(path, "gravity/southern_africa_ground_gravity.csv");
  double sum = 0.0;
  double squares = 0.0;
  double count = 0.0;
  for (const std::vector<double>& row : read_numbers(path)) {
    const double measured = 1e-5 * row[3];
    const double normal =
        gravity_in_enu({.latitude_deg = row[1], .longitude_deg = row[0], .height_m = row[2]})
            .norm();
    sum += measured - normal;
    squares += std::pow(measured - normal, 2);
    count += 1.0;
  }
  ASSERT_GT(count, 1000.0);
  // The heights are above the sea and are taken as heights above the ellipsoid. A geoid of 30 m
  // causes 1e-4 m/s^2.
  const double rms = std::sqrt(squares / count);
  RecordProperty("mean_m_s2", std::to_string(sum / count));
  RecordProperty("rms_m_s2", std::to_string(rms));
  EXPECT_NEAR(rms, 4e-4, 1e-4);
}

// ---- Earth rotation, induced fields, units ----

TEST(EarthRotationField, PointsToThePole) {
  const EarthRotationField field({.latitude_deg = 30.0}, "deg/h");
  EXPECT_NEAR(field.magnitude(), 15.041067, 1e-6);  // 360 degrees in a sidereal day
  EXPECT_NEAR(field.value_in_enu().z(), 0.5 * field.magnitude(), 1e-12);
  EXPECT_EQ(field.value_in_enu().x(), 0.0);
}

// Field of a closed loop of straight wires at a point [T], by Biot and Savart's law in small steps.
Eigen::Vector3d loop_field_T(const std::vector<Eigen::Vector3d>& corners,
                             double ampere_turns,
                             const Eigen::Vector3d& at) {
  Eigen::Vector3d field = Eigen::Vector3d::Zero();
  constexpr int steps = 2000;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector3d from = corners[i];
    const Eigen::Vector3d d = (corners[(i + 1) % corners.size()] - from) / steps;
    for (int s = 0; s < steps; ++s) {
      const Eigen::Vector3d r = at - (from + (s + 0.5) * d);
      field += 1e-7 * ampere_turns * d.cross(r) / std::pow(r.norm(), 3);
    }
  }
  return field;
}

std::vector<Eigen::Vector3d> polygon(int corners, double radius, double z) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2.0 * std::numbers::pi * (i + 0.5) / corners;
    points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
  }
  return points;
}

TEST(CoilField, AgreesWithBiotAndSavart) {
  const Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  const Coil helmholtz{.turns = 10.0, .current_A = 0.5, .size_m = 0.3};
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const double z : {-0.15, 0.15}) {
    sum += loop_field_T(polygon(400, 0.3, z), 5.0, centre);
  }
  EXPECT_NEAR(coil_field_in_table_T(helmholtz).z() / sum.z(), 1.0, 1e-4);

  const Coil merritt{.shape = CoilShape::merritt,
                     .turns = 26.0,
                     .current_A = 0.5,
                     .size_m = 0.6,
                     .axis_in_table = {0.0, 0.0, 2.0}};
  const auto merritt_at = [&](const Eigen::Vector3d& at) {
    Eigen::Vector3d field = Eigen::Vector3d::Zero();
    for (const double sign : {-1.0, 1.0}) {
      const double r = 0.3 * std::numbers::sqrt2;
      field += loop_field_T(polygon(4, r, sign * 0.505492 * 0.6), 13.0, at);
      field += loop_field_T(polygon(4, r, sign * 0.128106 * 0.6), 5.5, at);
    }
    return field;
  };
  EXPECT_NEAR(coil_field_in_table_T(merritt).z() / merritt_at(centre).z(), 1.0, 1e-5);
  // With four coils the field is uniform up to a quarter of the side from the centre.
  EXPECT_NEAR(merritt_at({0.0, 0.0, 0.12}).z() / merritt_at(centre).z(), 1.0, 2e-3);
  EXPECT_THROW(static_cast<void>(coil_field_in_table_T({.turns = 0.0})), DomainError);
}

TEST(Lamps, AddUp) {
  const Eigen::Vector3d sum =
      lamps_in_table({{.direction_in_table = {2.0, 0.0, 0.0}},
                      {.direction_in_table = {0.0, 0.0, 1.0}, .irradiance = 3.0}});
  EXPECT_MATRIX_NEAR(sum, Eigen::Vector3d(1.0, 0.0, 3.0), 1e-15);
  EXPECT_THROW(static_cast<void>(lamps_in_table({})), DomainError);
  EXPECT_TRUE(InducedField("light", sum, "1").is_induced());
}

TEST(FactorBetween, ConvertsUnitsOfOneQuantity) {
  EXPECT_DOUBLE_EQ(factor_between("nT", "uT"), 1e-3);
  EXPECT_DOUBLE_EQ(factor_between("G", "nT"), 1e5);
  EXPECT_DOUBLE_EQ(factor_between("deg/h", "rad/s"), std::numbers::pi / 648000.0);
  EXPECT_DOUBLE_EQ(factor_between("furlong", "furlong"), 1.0);
  EXPECT_THROW(static_cast<void>(factor_between("nT", "rad/s")), DomainError);
  EXPECT_THROW(static_cast<void>(factor_between("g", "m/s^2")), DomainError);
  EXPECT_EQ(reading_factor_between("g", "m/s^2"), 9.80665);
  EXPECT_EQ(reading_factor_between("m/s^2", "g"), 1.0 / 9.80665);
  EXPECT_EQ(reading_factor_between("nT", "uT"), 1e-3);
  EXPECT_EQ(reading_factor_between("nT", "V"), std::nullopt);
}

// ---- sun ----

TEST(SunPosition, AgreesWithTheNrelReport) {
  // Reda & Andreas, NREL/TP-560-34302, table A4.2: 2003-10-17 12:30:30 at UTC-7, without refraction
  // 39.872046, with it (820 hPa, 11 C) 39.888378.
  const Site golden{.latitude_deg = 39.742476, .longitude_deg = -105.1786, .height_m = 1830.14};
  const double time_s = *parse_timestamp("2003-10-17T19:30:30Z");
  const SunPosition sun = sun_position(golden, time_s);
  EXPECT_NEAR(sun.azimuth_rad * deg_per_rad, 194.340241, 0.01);
  EXPECT_NEAR(sun.elevation_rad * deg_per_rad, 39.872046, 0.01);
  const SunPosition lifted = sun_position(golden, time_s, true);
  EXPECT_GT(lifted.elevation_rad, sun.elevation_rad);
  EXPECT_NEAR(lifted.elevation_rad * deg_per_rad, 39.888378, 0.014);
  EXPECT_NEAR(lifted.direction_in_enu.norm(), 1.0, 1e-15);
}

TEST(SunPosition, StandsAtTheEquinoxesAndSolsticesWhereTheAlmanacSays) {
  // U.S. Naval Observatory, Earth's seasons. At the pole the elevation is the declination.
  const Site pole{.latitude_deg = 90.0};
  const auto declination_deg = [&](const char* date) {
    constexpr double parallax_deg = 8.794 / 3600.0;
    return sun_position(pole, *parse_timestamp(date)).elevation_rad * deg_per_rad + parallax_deg;
  };
  EXPECT_NEAR(declination_deg("2025-03-20T09:01Z"), 0.0, 0.01);
  EXPECT_NEAR(declination_deg("2025-09-22T18:19Z"), 0.0, 0.01);
  EXPECT_NEAR(declination_deg("2024-06-20T20:51Z"), 23.4362, 0.01);
  EXPECT_NEAR(declination_deg("2024-12-21T09:20Z"), -23.4361, 0.01);
  EXPECT_THROW(static_cast<void>(sun_position(pole, std::nan(""))), DomainError);
}

TEST(DecimalYear, GoesThereAndBack) {
  EXPECT_DOUBLE_EQ(decimal_year_of(*parse_date("2026-01-01")), 2026.0);
  EXPECT_NEAR(decimal_year_of(*parse_date("2024-07-02")), 2024.5, 1e-9);  // in a leap year
  EXPECT_NEAR(decimal_year_of(*parse_date("2026.25")), 2026.25, 1e-9);
  EXPECT_FALSE(parse_date("soon").has_value());
}

}  // namespace
}  // namespace axiscal
