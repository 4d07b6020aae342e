// SPDX-License-Identifier: Apache-2.0
// Benchmarks for the speed goals in bench/README.md. The library and other code for comparison (the
// peers) are in one program. Their results are compared before they are timed. The environment
// variable AXISCAL_BENCH_SAMPLES states the number of samples (default: one million; in
// bench/README.md: ten million).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>

#include <Eigen/LU>
#include <Eigen/QR>
#include <benchmark/benchmark.h>

#include "axiscal/calib/magnitude_fit.hpp"
#include "axiscal/calib/repeated_design.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/kernels/reduce_columns.hpp"
#include "axiscal/logs/allan.hpp"
#include "axiscal/logs/static_detector.hpp"
#include "kernels/regression_trials.hpp"
#include "kernels/sliding_variance.hpp"
#include "magnitude_readings.hpp"

namespace {

std::size_t samples() {
  const char* const text = std::getenv("AXISCAL_BENCH_SAMPLES");
  return text != nullptr ? std::strtoull(text, nullptr, 10) : 1000000;
}

// Five columns of n numbers each, 64-byte aligned.
class Columns {
 public:
  explicit Columns(std::size_t n) : n_(n) {
    for (auto& column : columns_) {
      column.reset(static_cast<double*>(std::aligned_alloc(64, (n * 8 + 63) / 64 * 64)));
      std::fill_n(column.get(), n, 0.0);
    }
  }
  [[nodiscard]] std::span<double> operator[](std::size_t i) const {
    return {columns_[i].get(), n_};
  }
  [[nodiscard]] axiscal::ReadColumns read() const { return {(*this)[0], (*this)[1], (*this)[2]}; }
  [[nodiscard]] axiscal::WrittenColumns written() const {
    return {(*this)[0], (*this)[1], (*this)[2]};
  }

 private:
  struct Free {
    void operator()(double* at) const { std::free(at); }
  };
  std::size_t n_;
  std::array<std::unique_ptr<double[], Free>, 5> columns_;
};

const Columns& readings() {
  static const Columns columns = [] {
    const std::size_t n = samples();
    Columns made(n);
    std::mt19937_64 engine(1);
    std::normal_distribution<double> normal;
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector3d f =
          Eigen::Vector3d(normal(engine), normal(engine), normal(engine)).normalized();
      for (std::size_t k = 0; k < 3; ++k) {
        made[k][i] = 0.01 + 2.5 * f(static_cast<Eigen::Index>(k));
      }
    }
    return made;
  }();
  return columns;
}

const Columns& results() {
  static const Columns columns(samples());
  return columns;
}

const axiscal::ColumnReduction reduction = {
    .bias = {0.01, 0.01, 0.01},
    .inverse = {0.4, 0.001, -0.002, 0.001, 0.4, 0.003, -0.002, 0.003, 0.4},
    .magnitude = 1.0};

void fail(const char* what) {
  std::fprintf(stderr, "speed_bench: %s differ\n", what);
  std::exit(1);
}

void count_rows(benchmark::State& state) {
  state.counters["rows"] = benchmark::Counter(static_cast<double>(samples()),
                                              benchmark::Counter::kIsIterationInvariantRate);
}

// ---- Goal 1: application of a calibration to many readings ----

void memcpy_3_columns(benchmark::State& state) {
  static_cast<void>(readings());
  static_cast<void>(results());
  for (auto _ : state) {
    for (std::size_t k = 0; k < 3; ++k) {
      std::memcpy(results()[k].data(), readings()[k].data(), samples() * 8);
    }
    benchmark::ClobberMemory();
  }
  count_rows(state);
}
BENCHMARK(memcpy_3_columns)->Unit(benchmark::kMillisecond);

// Moves 64 bytes per row (32 read, 32 written). apply_with_angles also moves 64 bytes per row (24
// read, 40 written).
void memcpy_4_columns(benchmark::State& state) {
  static_cast<void>(readings());
  static_cast<void>(results());
  for (auto _ : state) {
    for (std::size_t k = 0; k < 4; ++k) {
      std::memcpy(results()[k].data(), readings()[k % 3].data(), samples() * 8);
    }
    benchmark::ClobberMemory();
  }
  count_rows(state);
}
BENCHMARK(memcpy_4_columns)->Unit(benchmark::kMillisecond);

void apply_components(benchmark::State& state) {
  const Columns plain(std::min<std::size_t>(samples(), 10000));
  const auto part = [&](std::size_t k) {
    return std::span<const double>(readings()[k]).first(plain[0].size());
  };
  axiscal::reduce_columns_plain(reduction, {part(0), part(1), part(2)}, plain.written());
  axiscal::reduce_columns(reduction, readings().read(), results().written());
  for (std::size_t i = 0; i < plain[0].size(); ++i) {
    if (std::abs(plain[1][i] - results()[1][i]) > 1e-14) {
      fail("components");
    }
  }
  for (auto _ : state) {
    axiscal::reduce_columns(reduction, readings().read(), results().written());
    benchmark::ClobberMemory();
  }
  count_rows(state);
}
BENCHMARK(apply_components)->Unit(benchmark::kMillisecond);

void apply_components_plain_loop(benchmark::State& state) {
  for (auto _ : state) {
    axiscal::reduce_columns_plain(reduction, readings().read(), results().written());
    benchmark::ClobberMemory();
  }
  count_rows(state);
}
BENCHMARK(apply_components_plain_loop)->Unit(benchmark::kMillisecond);

void apply_with_angles(benchmark::State& state) {
  for (auto _ : state) {
    axiscal::reduce_columns(reduction, readings().read(), results().written(),
                            {results()[3], results()[4]});
    benchmark::ClobberMemory();
  }
  count_rows(state);
}
BENCHMARK(apply_with_angles)->Unit(benchmark::kMillisecond);

void apply_with_angles_libm(benchmark::State& state) {
  for (auto _ : state) {
    axiscal::reduce_columns_plain(reduction, readings().read(), results().written());
    axiscal::add_angles_plain(reduction, results().read(), {results()[3], results()[4]});
    benchmark::ClobberMemory();
  }
  count_rows(state);
}
BENCHMARK(apply_with_angles_libm)->Unit(benchmark::kMillisecond);

// ---- Goal 2: many fits with the same design ----

constexpr Eigen::Index units = 256;  // instruments per iteration; their readings fit the cache

Eigen::Matrix<double, 12, 4> design_of_12() {
  Eigen::Matrix<double, 12, 4> X = Eigen::Matrix<double, 12, 4>::Zero();
  X.col(0).setOnes();
  for (Eigen::Index i = 0; i < 12; ++i) {
    X(i, 1 + i / 4) = i % 4 < 2 ? 1.0 : -1.0;
  }
  return X;
}

// Returns the readings of three axes of all units in 12 positions, as a (3 * units) x 12 matrix in
// column-major order. fit_repeatedly() reads the same memory as a 12 x (3 * units) matrix in
// row-major order.
const Eigen::MatrixXd& responses() {
  static const Eigen::MatrixXd all = [] {
    axiscal::RandomStream random(2);
    Eigen::MatrixXd made(3 * units, 12);
    for (double& value : made.reshaped()) {
      value = random.normal();
    }
    return made;
  }();
  return all;
}

void fit_eigen_qr_12x4x3(benchmark::State& state) {
  const Eigen::Matrix<double, 12, 4> X = design_of_12();
  Eigen::Index unit = 0;
  for (auto _ : state) {
    const Eigen::Matrix<double, 12, 3> Y =
        responses().middleRows<3>(3 * (unit++ % units)).transpose();
    benchmark::DoNotOptimize(X.data());
    const Eigen::Matrix<double, 4, 3> b = X.colPivHouseholderQr().solve(Y);
    benchmark::DoNotOptimize(b.data());
  }
}
BENCHMARK(fit_eigen_qr_12x4x3);

// One iteration fits all 256 units.
void fit_same_design_256_units(benchmark::State& state) {
  const Eigen::Matrix<double, 12, 4> X = design_of_12();
  const axiscal::RepeatedDesign design = axiscal::repeated_design(X);
  const std::span<const double> y(responses().data(), static_cast<std::size_t>(responses().size()));
  std::vector<double> estimates(4 * 3 * units);
  std::vector<double> rss(3 * units);
  axiscal::fit_repeatedly(design, y, estimates, rss);
  const Eigen::Vector4d first = X.colPivHouseholderQr().solve(responses().row(0).transpose());
  for (Eigen::Index j = 0; j < 4; ++j) {
    if (std::abs(first(j) - estimates[static_cast<std::size_t>(j * 3 * units)]) > 1e-14) {
      fail("fits");
    }
  }
  for (auto _ : state) {
    axiscal::fit_repeatedly(design, y, estimates, rss);
    benchmark::DoNotOptimize(rss.data());
    benchmark::ClobberMemory();
  }
}
BENCHMARK(fit_same_design_256_units);

// ---- Goal 3: Monte Carlo simulation ----

axiscal::RegressionTrials trials_of_12() {
  axiscal::RegressionTrials trials{.at = axiscal::repeated_design(design_of_12()), .responses = 3};
  trials.unscaled_variance = {1.0 / 12.0, 0.25, 0.25, 0.25};
  trials.truth = {0.1, 1.0, 0.0, 0.0, 0.2, 0.0, 1.0, 0.0, 0.3, 0.0, 0.0, 1.0};
  trials.noise_sd = {1e-3, 1e-3, 1e-3};
  trials.coverage_factor = 2.306;
  return trials;
}

void monte_carlo_4096(benchmark::State& state) {
  const axiscal::RegressionTrials trials = trials_of_12();
  std::uint64_t block = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        axiscal::run_regression_trials(trials, 1, block++, axiscal::regression_trials_block));
  }
}
BENCHMARK(monte_carlo_4096)->Unit(benchmark::kMicrosecond);

// Code for comparison: std::normal_distribution and a fixed pseudo-inverse.
void monte_carlo_4096_std_normal(benchmark::State& state) {
  const Eigen::Matrix<double, 12, 4> X = design_of_12();
  const Eigen::Matrix<double, 4, 12> P = X.completeOrthogonalDecomposition().pseudoInverse();
  std::mt19937_64 engine(1);
  std::normal_distribution<double> normal(0.0, 1e-3);
  for (auto _ : state) {
    Eigen::Matrix<double, 4, 3> squares = Eigen::Matrix<double, 4, 3>::Zero();
    double rss = 0.0;
    for (std::size_t t = 0; t < axiscal::regression_trials_block; ++t) {
      Eigen::Matrix<double, 12, 3> y;
      for (double& value : y.reshaped()) {
        value = normal(engine);
      }
      const Eigen::Matrix<double, 4, 3> b = P * y;
      squares += b.cwiseAbs2();
      rss += (y - X * b).squaredNorm();
    }
    benchmark::DoNotOptimize(squares.data());
    benchmark::DoNotOptimize(rss);
  }
}
BENCHMARK(monte_carlo_4096_std_normal)->Unit(benchmark::kMicrosecond);

// ---- Goal 5: fit to the magnitude only ----

void magnitude_fit_200(benchmark::State& state) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        axiscal::fit_magnitude(magnitude_readings(), 1.0, axiscal::MagnitudeShape::triangular)
            .residual_sd);
  }
}
BENCHMARK(magnitude_fit_200)->Unit(benchmark::kMicrosecond);

// ---- Goal 6: detection of static intervals ----

void sliding_variance_101(benchmark::State& state) {
  const std::array<std::span<const double>, 3> columns = {readings()[0], readings()[1],
                                                          readings()[2]};
  std::vector<double> joined(samples() - 100);
  for (auto _ : state) {
    axiscal::joined_sliding_variance(columns, 101, joined);
    benchmark::ClobberMemory();
  }
  count_rows(state);
}
BENCHMARK(sliding_variance_101)->Unit(benchmark::kMillisecond);

// Code for comparison: running sums in plain code.
void sliding_variance_101_running_sums(benchmark::State& state) {
  std::vector<double> joined(samples() - 100);
  for (auto _ : state) {
    std::fill(joined.begin(), joined.end(), 0.0);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::span<const double> x = readings()[k];
      double sum = 0.0;
      double squares = 0.0;
      for (std::size_t i = 0; i < 101; ++i) {
        sum += x[i];
        squares += x[i] * x[i];
      }
      for (std::size_t i = 0; i < joined.size(); ++i) {
        const double variance = (squares - sum * sum / 101.0) / 100.0;
        joined[i] += variance * variance;
        if (i + 101 < x.size()) {
          sum += x[i + 101] - x[i];
          squares += x[i + 101] * x[i + 101] - x[i] * x[i];
        }
      }
    }
    benchmark::ClobberMemory();
  }
  count_rows(state);
}
BENCHMARK(sliding_variance_101_running_sums)->Unit(benchmark::kMillisecond);

// Times the whole detector: all thresholds, and intervals with their means, scatter, correlation
// and drift.
void static_detector_101(benchmark::State& state) {
  constexpr std::size_t block = 16384;
  const std::vector<char> whole(block, 0);
  std::vector<double> time_s(block);
  for (auto _ : state) {
    axiscal::StaticDetector detector({.detection = {0, 1, 2}}, 3);
    for (std::size_t i = 0; i < samples(); i += block) {
      const std::size_t count = std::min(block, samples() - i);
      axiscal::LogBlock part;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::span<const double> x = std::span<const double>(readings()[k]).subspan(i, count);
        part.emplace_back(x.begin(), x.end());
      }
      detector.add(std::span<const double>(time_s).first(count), part,
                   std::span<const char>(whole).first(count));
    }
    benchmark::DoNotOptimize(detector.finish().size());
  }
  count_rows(state);
}
BENCHMARK(static_detector_101)->Unit(benchmark::kMillisecond);

// ---- Goal 7: Allan deviation ----

void allan_octaves(benchmark::State& state) {
  const std::vector<std::size_t> lengths = axiscal::octave_lengths(samples());
  std::vector<double> record;
  for (auto _ : state) {
    state.PauseTiming();
    record.assign(readings()[0].begin(), readings()[0].end());
    state.ResumeTiming();
    benchmark::DoNotOptimize(axiscal::allan_deviation_in_place(record, 100.0, lengths).data());
  }
  count_rows(state);
}
BENCHMARK(allan_octaves)->Unit(benchmark::kMillisecond);

void allan_octaves_plain(benchmark::State& state) {
  const std::vector<std::size_t> lengths = axiscal::octave_lengths(samples());
  const std::size_t n = samples();
  const auto deviations = [&] {
    std::vector<double> x(n + 1, 0.0);
    double mean = 0.0;
    for (const double y : readings()[0]) {
      mean += y / static_cast<double>(n);
    }
    for (std::size_t i = 0; i < n; ++i) {
      x[i + 1] = x[i] + readings()[0][i] - mean;
    }
    std::vector<double> all;
    for (const std::size_t m : lengths) {
      double sum = 0.0;
      for (std::size_t i = 0; i + 2 * m <= n; ++i) {
        const double d = x[i + 2 * m] - 2.0 * x[i + m] + x[i];
        sum += d * d;
      }
      const auto mm = static_cast<double>(m);
      all.push_back(std::sqrt(sum / (2.0 * mm * mm * static_cast<double>(n + 1 - 2 * m))));
    }
    return all;
  };
  const std::vector<axiscal::AllanPoint> curve =
      axiscal::allan_deviation(readings()[0], 100.0, lengths);
  const std::vector<double> plain = deviations();
  for (std::size_t i = 0; i < plain.size(); ++i) {
    if (std::abs(curve[i].deviation / plain[i] - 1.0) > 1e-9) {
      fail("Allan deviations");
    }
  }
  for (auto _ : state) {
    benchmark::DoNotOptimize(deviations().data());
  }
  count_rows(state);
}
BENCHMARK(allan_octaves_plain)->Unit(benchmark::kMillisecond);

}  // namespace

const Eigen::MatrixX3d& magnitude_readings() {
  static const Eigen::MatrixX3d all = [] {
    axiscal::RandomStream random(3);
    Eigen::MatrixX3d v(magnitude_reading_count, 3);
    for (Eigen::Index i = 0; i < v.rows(); ++i) {
      const Eigen::Vector3d f = random.normals<3>().normalized();
      v.row(i) = Eigen::RowVector3d(0.05, -0.02, 0.03) + 2.0 * f.transpose();
      v(i, 0) += 0.02 * f.y() + 1e-3 * random.normal();
    }
    return v;
  }();
  return all;
}
