// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "axiscal/core/number_text.hpp"
#include "instruments/src/kinds/kinds.hpp"

namespace axiscal {
namespace {

std::vector<KindQuantity> describe(const CalibratedInstrument& calibrated) {
  const std::string& unit = calibrated.instrument.unit;
  std::vector<KindQuantity> quantities;
  for (Eigen::Index k = 0; k < calibrated.instrument.axis_count(); ++k) {
    const std::string& axis = calibrated.instrument.axes[static_cast<std::size_t>(k)];
    const int main = main_axis(calibrated.instrument, calibrated.response, k);
    quantities.push_back(
        quantity_of(calibrated, "scale", axis, unit_per(unit, calibrated.field_unit),
                    [k](const LinearResponse& r) {
                      return Eigen::VectorXd::Constant(1, r.sensitivity.row(k).norm());
                    }));
    // The two cross-axis sensitivities divided by the main sensitivity, in cyclic order.
    quantities.push_back(
        quantity_of(calibrated, "misalignment", axis, "rad", [k, main](const LinearResponse& r) {
          const double along = r.sensitivity(k, main);
          return Eigen::VectorXd(
              Eigen::Vector2d(r.sensitivity(k, (main + 1) % 3), r.sensitivity(k, (main + 2) % 3)) /
              along);
        }));
  }
  if (calibrated.in_table && calibrated.field_kind == "earth_rotation") {
    quantities.push_back(
        angle_of_field(calibrated, "fence_azimuth_from_north_deg", fence_azimuth_from));
    quantities.push_back(angle_of_field(
        calibrated, "latitude_by_table_deg",
        [](const Eigen::Vector3d& w) { return std::atan2(w.z(), std::hypot(w.x(), w.y())); }));
  }
  return quantities;
}

}  // namespace

InstrumentKind gyroscope_kind() {
  return {.name = "gyroscope",
          .derived_names = {},
          .sensor = VehicleSensor::gyroscope,
          .columns = {.letters = "gw", .word = "gyr"},
          .answers_to_gravity = true,
          .describe = describe};
}

}  // namespace axiscal
