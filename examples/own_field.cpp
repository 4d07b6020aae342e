// SPDX-License-Identifier: Apache-2.0
// Defines a new reference field by deriving from ReferenceField, and calibrates with it.
#include <axiscal/calib/calibrate.hpp>
#include <axiscal/calib/simulate.hpp>
#include <cstdio>

// The field on a table in a centrifuge: gravity, and a centripetal acceleration to the north.
class CentrifugeField final : public axiscal::ReferenceField {
 public:
  CentrifugeField(double radius_m, double rate_rad_per_s)
      : centripetal_(radius_m * rate_rad_per_s * rate_rad_per_s) {}
  Eigen::Vector3d value_in_enu() const override { return {0.0, centripetal_, 9.81}; }
  std::string_view unit() const override { return "m/s^2"; }
  std::string_view kind() const override { return "centrifuge"; }

 private:
  double centripetal_;
};

int main() {
  const CentrifugeField field(2.0, 3.0);
  axiscal::Experiment experiment;
  experiment.instrument.kind = "accelerometer";
  experiment.instrument.unit = "mV";
  experiment.field = field;

  axiscal::SensorModel truth;
  truth.instrument = experiment.instrument;
  truth.field.in_table = field.value_in_enu();
  truth.response.bias = Eigen::Vector3d(1.0, 2.0, 3.0);
  truth.response.sensitivity = 50.0 * Eigen::Matrix3d::Identity();
  axiscal::SimulationOptions options;
  options.noise_sd = 0.05;
  options.slope = {0.01, -0.02};  // the calibration does not know the slope
  const axiscal::Calibration result = axiscal::calibrate(
      experiment, axiscal::simulate(
                      truth, axiscal::make_run_sheet(axiscal::standard_design(12), 1, 1), options));
  std::printf("field %s, |f| = %.3f m/s^2, in the table's frame: %.3f %.3f %.3f\n",
              result.sensor.field.kind.c_str(), result.sensor.field.magnitude,
              result.sensor.field.in_table->x(), result.sensor.field.in_table->y(),
              result.sensor.field.in_table->z());
  const axiscal::Quantity sensitivity = result.parameter("x.sensitivity.x");
  std::printf("sensitivity of x: %.3f +- %.3f %s (95 %%), by method %s\n", sensitivity.value,
              sensitivity.U, sensitivity.unit.c_str(),
              std::string(axiscal::method_name(result.fit.method)).c_str());
  return 0;
}
