// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "axiscal/core/number_text.hpp"
#include "instruments/src/kinds/kinds.hpp"

namespace axiscal {
namespace {

constexpr std::array<std::string_view, 2> names = {"heading_deg", "dip_deg"};

// Computes the tilt-compensated heading of the axis x (forward), clockwise from north, and the dip,
// positive down.
DerivedValues derive(const DeriveInput& input) noexcept {
  const Eigen::Vector3d up = input.up->normalized();
  const Eigen::Vector3d& field = input.field_in_sensor;
  const double upward = field.dot(up);
  const Eigen::Vector3d north = field - upward * up;
  const Eigen::Vector3d east = north.cross(up);
  double heading_rad = std::atan2(east.x(), north.x()) + input.declination_rad;
  heading_rad -= 2.0 * std::numbers::pi * std::floor(heading_rad / (2.0 * std::numbers::pi));
  return {.values = {heading_rad * deg_per_rad, std::atan2(-upward, north.norm()) * deg_per_rad}};
}

std::vector<KindQuantity> describe(const CalibratedInstrument& calibrated) {
  const std::string& unit = calibrated.instrument.unit;
  std::vector<KindQuantity> quantities;
  quantities.push_back(quantity_of(calibrated, "hard_iron", "", unit,
                                   [](const LinearResponse& r) { return r.bias; }));
  if (calibrated.instrument.axis_count() == 3) {
    quantities.push_back(quantity_of(calibrated, "hard_iron_in_field_unit", "",
                                     calibrated.field_unit,
                                     [](const LinearResponse& r) -> Eigen::VectorXd {
                                       return Eigen::Matrix3d(r.sensitivity).inverse() * r.bias;
                                     }));
    // The correction: field = soft_iron_correction (reading - hard_iron).
    for (int row = 0; row < 3; ++row) {
      quantities.push_back(quantity_of(
          calibrated, "soft_iron_correction", std::string(1, "xyz"[row]),
          unit_per(calibrated.field_unit, unit), [row](const LinearResponse& r) -> Eigen::VectorXd {
            return Eigen::Matrix3d(r.sensitivity).inverse().row(row).transpose();
          }));
    }
  }
  if (calibrated.in_table && calibrated.field_kind == "geomagnetic") {
    quantities.push_back(angle_of_field(
        calibrated, "dip_to_table_deg",
        [](const Eigen::Vector3d& f) { return std::atan2(-f.z(), std::hypot(f.x(), f.y())); }));
    quantities.push_back(
        angle_of_field(calibrated, "fence_azimuth_from_magnetic_north_deg", fence_azimuth_from));
  }
  return quantities;
}

}  // namespace

InstrumentKind magnetometer_kind() {
  return {.name = "magnetometer",
          .derived_names = names,
          .derive = derive,
          .derives_with_attitude = true,
          .usual_field = "geomagnetic",
          .relative_field_will_do = true,
          .sensor = VehicleSensor::magnetometer,
          .columns = {.letters = "mhb", .word = "mag"},
          .describe = describe};
}

}  // namespace axiscal
