// SPDX-License-Identifier: Apache-2.0
// Calibrates from a file of observations, and prints the result with its warnings.
#include <axiscal/calib/calibrate.hpp>
#include <axiscal/calib/calibration_json.hpp>
#include <axiscal/calib/summary.hpp>
#include <axiscal/core/error.hpp>
#include <axiscal/field/gravity_field.hpp>
#include <cstdio>

int main(int argc, char** argv) {
  try {
    const axiscal::Run run = axiscal::read_run(argc > 1 ? argv[1] : "run.csv");
    const axiscal::Calibration result =
        axiscal::calibrate(run, axiscal::accelerometer("V"), axiscal::gravity());
    std::printf("%s\n", axiscal::summary(result).c_str());
    std::printf("the record has %zu bytes of JSON\n", axiscal::calibration_json(result).size());
  } catch (const axiscal::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
