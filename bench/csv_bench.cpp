// SPDX-License-Identifier: Apache-2.0
// Benchmarks of the CSV reader alone, and of the reader with the reduction of every row. A memcpy
// of the text serves for comparison.
#include <algorithm>
#include <cstring>
#include <string>

#include <benchmark/benchmark.h>

#include "axiscal/calib/reduction_csv.hpp"
#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/random.hpp"

namespace {

const std::string& table() {
  static const std::string text = [] {
    axiscal::RandomStream random(1);
    std::string rows = "t,x,y,z\n";
    for (int i = 0; i < 100000; ++i) {
      rows += std::to_string(i);
      for (int k = 0; k < 3; ++k) {
        rows += ',' + axiscal::number_text(std::round(1e9 * random.normal()) * 1e-9);
      }
      rows += '\n';
    }
    return rows;
  }();
  return text;
}

axiscal::CsvReader reader_of(const std::string& text) {
  return {[&text, at = std::size_t{0}](char* buffer, std::size_t size) mutable {
            const std::size_t count = std::min(size, text.size() - at);
            std::memcpy(buffer, text.data() + at, count);
            at += count;
            return count;
          },
          "bench.csv"};
}

void count_bytes(benchmark::State& state) {
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(table().size()));
}

void copy_text(benchmark::State& state) {
  std::string copy(table().size(), ' ');
  for (auto _ : state) {
    std::memcpy(copy.data(), table().data(), copy.size());
    benchmark::DoNotOptimize(copy.data());
  }
  count_bytes(state);
}
BENCHMARK(copy_text);

void read_three_columns(benchmark::State& state) {
  for (auto _ : state) {
    axiscal::CsvReader csv = reader_of(table());
    double sum = 0.0;
    while (csv.next() == axiscal::CsvReader::Row::good) {
      for (std::size_t k = 1; k < 4; ++k) {
        sum += *axiscal::parse_number(csv.cells()[k]);
      }
    }
    benchmark::DoNotOptimize(sum);
  }
  count_bytes(state);
}
BENCHMARK(read_three_columns)->Unit(benchmark::kMillisecond);

void apply_to_text(benchmark::State& state) {
  axiscal::Calibration calibration;
  calibration.sensor.instrument.kind = "accelerometer";
  calibration.sensor.response.bias = Eigen::Vector3d(0.01, -0.02, 0.03);
  calibration.sensor.response.sensitivity = 2.5 * Eigen::Matrix3d::Identity();
  const axiscal::Reducer reducer(calibration);
  for (auto _ : state) {
    axiscal::CsvReader csv = reader_of(table());
    std::size_t written = 0;
    axiscal::reduce_csv(csv, axiscal::reading_columns(calibration.sensor.instrument), reducer, {},
                        [&](std::string_view block) { written += block.size(); });
    benchmark::DoNotOptimize(written);
  }
  count_bytes(state);
}
BENCHMARK(apply_to_text)->Unit(benchmark::kMillisecond);

}  // namespace
