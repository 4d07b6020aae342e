// SPDX-License-Identifier: Apache-2.0
// Your own kind of instrument, in one file: an electric field mill in a field with known
// components.
#include <axiscal/calib/calibrate.hpp>
#include <axiscal/calib/reduction.hpp>
#include <axiscal/calib/simulate.hpp>
#include <axiscal/core/units.hpp>
#include <axiscal/field/custom_field.hpp>
#include <cmath>
#include <cstdio>

namespace {

constexpr std::array<std::string_view, 1> derived = {"zenith_angle_deg"};

axiscal::DerivedValues zenith_angle(const axiscal::DeriveInput& input) noexcept {
  const Eigen::Vector3d& E = input.field_in_sensor;
  return {.values = {std::atan2(std::hypot(E.x(), E.y()), E.z()) * axiscal::deg_per_rad}};
}

std::vector<axiscal::KindQuantity> gains(const axiscal::CalibratedInstrument& calibrated) {
  axiscal::KindQuantity gain{.name = "gain", .of = "", .unit = "mV per V/m"};
  for (Eigen::Index k = 0; k < calibrated.response.bias.size(); ++k) {
    gain.values.push_back(calibrated.response.sensitivity.row(k).norm());
    gain.u.push_back(std::nan(""));
  }
  return {gain};
}

}  // namespace

int main() {
  const axiscal::InstrumentKind kind = {.name = "field_mill",
                                        .derived_names = derived,
                                        .derive = zenith_angle,
                                        .describe = gains};
  axiscal::add_instrument_kind(kind);

  axiscal::SensorModel truth;
  truth.instrument = {.kind = std::string(kind.name), .unit = "mV"};
  truth.field.kind = "custom";
  truth.field.unit = "V/m";
  truth.field.in_table = Eigen::Vector3d(0.0, 30.0, 120.0);
  truth.response.bias = Eigen::Vector3d(1.0, 2.0, 3.0);
  truth.response.sensitivity = 4.0 * Eigen::Matrix3d::Identity();
  axiscal::Experiment experiment;
  experiment.instrument = truth.instrument;
  experiment.field = axiscal::CustomField();
  experiment.field.unit = truth.field.unit;
  experiment.field.in_table = truth.field.in_table;
  const axiscal::Calibration result = axiscal::calibrate(
      experiment,
      axiscal::simulate(truth, axiscal::make_run_sheet(axiscal::standard_design(12), 1, 1),
                        {.noise_sd = 0.01}));
  for (const axiscal::KindQuantity& quantity : axiscal::quantities_of(result)) {
    std::printf("%s of x: %.2f %s\n", quantity.name.c_str(), quantity.values[0],
                quantity.unit.c_str());
  }
  const axiscal::Reducer reducer(result);
  const double readings[] = {1.0, 2.0 + 400.0, 3.0 + 400.0};
  std::printf("zenith angle %.1f degrees\n", reducer(readings)["zenith_angle_deg"]);
  return 0;
}
