// SPDX-License-Identifier: Apache-2.0
// Benchmarks of the conversion of one reading to field components, residual and angles.
#include <cmath>

#include <Eigen/LU>
#include <benchmark/benchmark.h>

#include "axiscal/calib/reduction.hpp"

namespace {

axiscal::Calibration calibration_of(const char* kind) {
  axiscal::Calibration calibration;
  calibration.sensor.instrument.kind = kind;
  calibration.sensor.response.bias = Eigen::Vector3d(0.01, -0.02, 0.03);
  calibration.sensor.response.sensitivity = 2.5 * Eigen::Matrix3d::Identity();
  calibration.sensor.response.sensitivity(0, 1) = 0.02;
  return calibration;
}

constexpr std::array<double, 3> reading = {0.4, -0.6, 2.3};

void reduce(benchmark::State& state, const char* kind) {
  const axiscal::Reducer reducer(calibration_of(kind));
  std::array<double, 3> v = reading;
  for (auto _ : state) {
    benchmark::DoNotOptimize(v);
    benchmark::DoNotOptimize(reducer.reduce(v));
  }
}
BENCHMARK_CAPTURE(reduce, components, "generic");
BENCHMARK_CAPTURE(reduce, components_and_angles, "accelerometer");

// Gives a lower limit of the time for one reading. The code computes only the components and the
// residual.
void plain_components(benchmark::State& state) {
  const axiscal::Calibration calibration = calibration_of("generic");
  const Eigen::Matrix3d S = calibration.sensor.response.sensitivity;
  const Eigen::Matrix3d inverse = S.inverse();
  const Eigen::Vector3d bias = calibration.sensor.response.bias;
  Eigen::Vector3d v(reading[0], reading[1], reading[2]);
  for (auto _ : state) {
    benchmark::DoNotOptimize(v);
    const Eigen::Vector3d f = inverse * (v - bias);
    benchmark::DoNotOptimize(f);
    benchmark::DoNotOptimize(f.norm() - 1.0);
  }
}
BENCHMARK(plain_components);

}  // namespace
