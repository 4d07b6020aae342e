// SPDX-License-Identifier: Apache-2.0
// Benchmarks of one calibration: QR decomposition by Eigen, the regression of the library, and a
// whole call of calibrate().
#include <cmath>
#include <string>

#include <Eigen/QR>
#include <benchmark/benchmark.h>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/least_squares.hpp"
#include "axiscal/calib/run_columns.hpp"
#include "axiscal/calib/simulate.hpp"
#include "axiscal/field/gravity_field.hpp"

namespace {

using axiscal::Calibration;
using axiscal::Experiment;
using axiscal::Method;
using axiscal::Observations;
using axiscal::SensorModel;

SensorModel truth() {
  SensorModel truth;
  truth.instrument.kind = "accelerometer";
  truth.field = {.kind = "gravity", .unit = "g", .magnitude = 1.0};
  truth.response.bias = Eigen::Vector3d(0.012, -0.034, 0.005);
  truth.response.sensitivity = 2.5 * Eigen::Matrix3d::Identity();
  truth.response.sensitivity(0, 1) = 0.02;
  return truth;
}

Observations readings(int replicates) {
  axiscal::SimulationOptions options;
  options.noise_sd = 1e-4;
  options.slope = {0.003, -0.002};
  return axiscal::simulate(
      truth(), axiscal::make_run_sheet(axiscal::standard_design(12), replicates, 1), options);
}

Eigen::MatrixXd design() {
  const Observations run = readings(1);
  Eigen::MatrixXd X(12, 4);
  for (Eigen::Index i = 0; i < 12; ++i) {
    X.row(i) << 1.0, run.response.row(i);
  }
  return X;
}

void eigen_qr_12x4x3(benchmark::State& state) {
  const Eigen::Matrix<double, 12, 4> X = design();
  const Eigen::Matrix<double, 12, 3> Y = readings(1).response;
  for (auto _ : state) {
    benchmark::DoNotOptimize(X.data());
    const Eigen::Matrix<double, 4, 3> b = X.colPivHouseholderQr().solve(Y);
    benchmark::DoNotOptimize(b.data());
  }
}
BENCHMARK(eigen_qr_12x4x3);

void core_fit_12x4x3_with_statistics(benchmark::State& state) {
  const Eigen::MatrixXd X = design();
  const Eigen::MatrixXd Y = readings(1).response;
  for (auto _ : state) {
    const axiscal::LeastSquaresDesign factored(X);
    for (Eigen::Index k = 0; k < 3; ++k) {
      benchmark::DoNotOptimize(factored.fit(Y.col(k)).residual_sd);
    }
  }
}
BENCHMARK(core_fit_12x4x3_with_statistics);

void calibrate(benchmark::State& state, Method method, int replicates) {
  Experiment experiment;
  experiment.instrument.kind = "accelerometer";
  experiment.field.of = axiscal::make_field("gravity");
  experiment.fit.method = method;
  if (method == Method::known) {
    experiment.table.slope = {0.003, -0.002};
  }
  const Observations run = readings(replicates);
  for (auto _ : state) {
    benchmark::DoNotOptimize(axiscal::calibrate(experiment, run).sensor.response.bias.data());
  }
}
BENCHMARK_CAPTURE(calibrate, paired_12, Method::paired, 1);
BENCHMARK_CAPTURE(calibrate, joint_12, Method::joint, 1);
BENCHMARK_CAPTURE(calibrate, known_12, Method::known, 1);
BENCHMARK_CAPTURE(calibrate, paired_12x10, Method::paired, 10);
BENCHMARK_CAPTURE(calibrate, joint_12x10, Method::joint, 10);

// The call that bench/calibrate_from_python.py makes in Python, with the same readings.
void calibrate_as_python_does(benchmark::State& state) {
  axiscal::RunColumns columns;
  columns.rest = {"-Z", "+Z", "-Y", "+Y", "-X", "+X", "-Z", "+Z", "-Y", "+Y", "-X", "+X"};
  columns.fence = {"+X", "+X", "+X", "+X", "+Y", "+Y", "-X", "-X", "-X", "-X", "-Y", "-Y"};
  Eigen::MatrixXd readings(12, 3);
  for (Eigen::Index i = 0; i < 12; ++i) {
    const std::string& rest = columns.rest[static_cast<std::size_t>(i)];
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double up = rest[1] != "XYZ"[k] ? 0.0 : rest[0] == '-' ? 1.0 : -1.0;
      readings(i, k) =
          2.5 * up + 0.01 + 1e-4 * std::sin(std::pow(static_cast<double>(3 * i + k), 2));
    }
  }
  for (auto _ : state) {
    benchmark::DoNotOptimize(axiscal::calibrate(axiscal::make_run(columns, readings),
                                                axiscal::accelerometer("V"), axiscal::gravity())
                                 .sensor.response.bias.data());
  }
}
BENCHMARK(calibrate_as_python_does);

void write_record(benchmark::State& state) {
  Experiment experiment;
  experiment.instrument.kind = "accelerometer";
  experiment.field.of = axiscal::make_field("gravity");
  const Calibration calibration = axiscal::calibrate(experiment, readings(1));
  for (auto _ : state) {
    benchmark::DoNotOptimize(axiscal::calibration_json(calibration).size());
  }
}
BENCHMARK(write_record);

}  // namespace
