// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/number_text.hpp"
#include "instruments/src/kinds/kinds.hpp"

namespace axiscal {
namespace {

constexpr std::array<std::string_view, 3> names = {"direction_x", "direction_y", "direction_z"};

DerivedValues derive(const DeriveInput& input) noexcept {
  const Eigen::Vector3d direction = input.field_in_sensor.normalized();
  return {.values = {direction.x(), direction.y(), direction.z()}};
}

std::vector<KindQuantity> describe(const CalibratedInstrument& calibrated) {
  std::vector<KindQuantity> quantities;
  for (Eigen::Index k = 0; k < calibrated.instrument.axis_count(); ++k) {
    const std::string& axis = calibrated.instrument.axes[static_cast<std::size_t>(k)];
    quantities.push_back(quantity_of(
        calibrated, "responsivity", axis,
        unit_per(calibrated.instrument.unit, calibrated.field_unit), [k](const LinearResponse& r) {
          return Eigen::VectorXd::Constant(1, r.sensitivity.row(k).norm());
        }));
    quantities.push_back(quantity_of(calibrated, "boresight", axis, "1",
                                     [k](const LinearResponse& r) -> Eigen::VectorXd {
                                       return r.sensitivity.row(k).transpose().normalized();
                                     }));
  }
  if (calibrated.in_table) {
    KindQuantity direction{.name = "direction_to_source_in_table", .of = "", .unit = "1"};
    for (int j = 0; j < 3; ++j) {
      const auto component = [j](const Eigen::Vector3d& f) { return f.normalized()(j); };
      direction.values.push_back(component(*calibrated.in_table));
      direction.u.push_back(propagate_field_uncertainty(calibrated, component));
    }
    quantities.push_back(std::move(direction));
  }
  return quantities;
}

}  // namespace

InstrumentKind optical_kind() {
  return {.name = "optical",
          .derived_names = names,
          .derive = derive,
          .sees_one_side = true,
          .describe = describe};
}

}  // namespace axiscal
