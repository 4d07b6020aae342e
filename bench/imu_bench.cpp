// SPDX-License-Identifier: Apache-2.0
// Benchmarks of the whole calibration of an IMU, and of reading a log. The calibration uses a
// simulated recording. For comparison with imu_tk_stand_in.cpp, the environment variable
// AXISCAL_XSENS may state the path of imu_tk's recording xsens_acc_gyro.csv.
#include <cstdlib>
#include <filesystem>

#include <benchmark/benchmark.h>

#include "axiscal/logs/imu.hpp"
#include "axiscal/logs/simulate_log.hpp"

namespace {

struct Recording {
  axiscal::RecordedLog log;
  axiscal::ImuOptions options;
};

const Recording& recording() {
  static const Recording made = [] {
    Recording one;
    const char* const path = std::getenv("AXISCAL_XSENS");
    if (path != nullptr) {
      axiscal::LogFile file(path);
      one.log = {.name = path, .columns = file.columns(), .samples = axiscal::read_log(file)};
      one.options.accelerometer = {"acc_x", "acc_y", "acc_z"};
      one.options.gyroscope = {"gyr_x", "gyr_y", "gyr_z"};
      one.options.turns.rate_per_unit = 1.0 / 6258;
    } else {
      axiscal::ImuSimulation imu;
      imu.accelerometer = {.bias = Eigen::Vector3d(0.01, 0.02, 0.03),
                           .sensitivity = Eigen::Matrix3d::Identity()};
      imu.gyroscope = imu.accelerometer;
      imu.accelerometer_sd = imu.gyroscope_sd = 1e-3;
      imu.rest_s = 10.0;
      one.log = axiscal::simulate_imu_log(imu, axiscal::random_attitudes(38, 1));
      one.options.accelerometer = {"ax", "ay", "az"};
      one.options.gyroscope = {"gx", "gy", "gz"};
      one.options.turns.rate_per_unit = 1.0;
    }
    one.options.experiment.field.unit = "m/s^2";
    one.options.experiment.field.magnitude = 9.81744;
    one.options.experiment.fit.shape = axiscal::MagnitudeShape::triangular;
    return one;
  }();
  return made;
}

void calibrate_imu(benchmark::State& state) {
  const auto& [log, options] = recording();  // reads the recording before the timed loop
  for (auto _ : state) {
    benchmark::DoNotOptimize(axiscal::calibrate_imu(log, options).turns->rounds);
  }
}
BENCHMARK(calibrate_imu)->Unit(benchmark::kMillisecond);

// Calibrates with static intervals that are detected in the columns of the accelerometer. For
// imu_tk's recording only one threshold is used. It is the threshold that imu_tk selects: six times
// the variance of the first 50 s.
void calibrate_imu_at_one_threshold(benchmark::State& state) {
  axiscal::ImuOptions options = recording().options;
  options.segment.columns = options.accelerometer;
  if (std::getenv("AXISCAL_XSENS") != nullptr) {
    options.segment.threshold = 113.6;
  }
  for (auto _ : state) {
    benchmark::DoNotOptimize(axiscal::calibrate_imu(recording().log, options).turns->rounds);
  }
}
BENCHMARK(calibrate_imu_at_one_threshold)->Unit(benchmark::kMillisecond);

// Reads a file in blocks, and reports bytes per second. The environment variable AXISCAL_CSV states
// the path of the file.
void ingest_csv(benchmark::State& state) {
  const char* const path = std::getenv("AXISCAL_CSV");
  if (path == nullptr) {
    state.SkipWithError("the environment variable AXISCAL_CSV is not set");
    return;
  }
  double sum = 0.0;
  for (auto _ : state) {
    axiscal::LogFile file(path);
    axiscal::LogBlock block;
    while (const std::size_t count = file.read(block, 16384)) {
      sum += block[0][count - 1];
    }
  }
  benchmark::DoNotOptimize(sum);
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) *
                          static_cast<std::int64_t>(std::filesystem::file_size(path)));
}
BENCHMARK(ingest_csv)->Unit(benchmark::kMillisecond);

}  // namespace
