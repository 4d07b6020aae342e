// SPDX-License-Identifier: Apache-2.0
// The program of the README: twelve readings in a file, and an angle by them.
#include <axiscal/axiscal.hpp>
#include <cstdio>

int main() {
  axiscal::InputFile file("run.csv");
  axiscal::CsvReader csv([&](char* to, std::size_t n) { return file.read(to, n); }, file.path());
  axiscal::Experiment experiment;
  experiment.instrument.kind = "accelerometer";
  experiment.field.kind = "gravity";
  const axiscal::Reducer reducer(
      axiscal::calibrate(experiment, axiscal::read_observations(csv, {}).observations));
  const double volts[] = {0.870, 0.0, 2.360};
  std::printf("pitch %.2f degrees\n", reducer.reduce(volts).derived.values[0]);
}
