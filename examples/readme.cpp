// SPDX-License-Identifier: Apache-2.0
// The program of README.md. It calibrates with twelve readings from a file, prints a summary, and
// converts a reading to an angle.
#include <axiscal/axiscal.hpp>
#include <cstdio>

int main() {
  const axiscal::Run run = axiscal::read_run("run.csv");
  const axiscal::Calibration cal =
      axiscal::calibrate(run, axiscal::accelerometer("V"), axiscal::gravity());
  std::puts(axiscal::summary(cal).c_str());
  const axiscal::Quantity bias = cal.parameter("x.bias");  // value, u, U, dof
  std::printf("bias of x %.5f +- %.5f V (95 %%)\n", bias.value, bias.U);
  const axiscal::Reducer reduce(cal);
  const double volts[] = {0.870, 0.0, 2.360};
  std::printf("pitch %.2f degrees\n", reduce(volts)["pitch_deg"]);
  axiscal::write(cal, "cal.json");
}
