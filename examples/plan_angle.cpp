// SPDX-License-Identifier: Apache-2.0
// Plans a calibration. It finds the number of replicates for an uncertainty of 0.005 degrees, and
// the effect of tolerances of the cube.
#include <axiscal/calib/forecast.hpp>
#include <axiscal/calib/tolerance.hpp>
#include <axiscal/core/units.hpp>
#include <cstdio>

int main() {
  axiscal::ForecastSetup setup;
  setup.nominal.instrument.kind = "inclinometer";
  setup.nominal.field.kind = "gravity";
  setup.nominal.field.unit = "g";
  setup.nominal.response.bias = Eigen::Vector3d::Zero();
  setup.nominal.response.sensitivity = 2.5 * Eigen::Matrix3d::Identity();  // V/g
  setup.design = axiscal::standard_design(12);
  setup.method = axiscal::Method::paired;
  setup.noise_sd = 8e-4;  // V
  const double wanted_rad = 0.005 * axiscal::rad_per_deg;

  for (const double cube_u_rad : {0.0, 3e-5, 2e-4}) {
    setup.normal_u_rad = cube_u_rad;
    std::printf("standard uncertainty of the face normals %3.0f urad: ", 1e6 * cube_u_rad);
    if (const std::optional<double> replicates = axiscal::replicates_for_angle(setup, wanted_rad)) {
      setup.replicates = static_cast<int>(*replicates);
      const axiscal::Forecast forecast = axiscal::forecast(setup);
      std::printf(
          "%d replicates: the uncertainty of the angle is at most %.4f degrees in any "
          "attitude\n",
          setup.replicates,
          axiscal::largest_angle_uncertainty(forecast, forecast.covariance()) *
              axiscal::deg_per_rad);
    } else {
      std::printf("no number of replicates reaches the wanted angle\n");
    }
  }

  // Simulates cubes with the tolerances of a workshop. The calibration assumes the nominal cube.
  axiscal::ToleranceStudy study;
  study.nominal = setup.nominal;
  study.design = setup.design;
  study.drawing = axiscal::feet_of_frame({});
  study.trials = 300;
  for (const double height_m : {1e-6, 2e-6, 5e-6}) {
    study.tolerances.foot_height_m = height_m;
    const axiscal::ToleranceEffect effect = axiscal::study_tolerances(study).front();
    std::printf("feet made to within %.0f um: angle error %.4f degrees rms (simulated %.4f)\n",
                1e6 * height_m, effect.closed_form.angle_rad * axiscal::deg_per_rad,
                effect.simulated.angle_rad * axiscal::deg_per_rad);
  }
  return 0;
}
