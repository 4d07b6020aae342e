// SPDX-License-Identifier: Apache-2.0
// Code for comparison with the library's fit to the magnitude only (goal 5 of bench/README.md). It
// fits the same readings by Ceres, once with analytic and once with automatic derivatives, from the
// same start values. The results are compared with fit_magnitude() before the timing.
#include <ceres/ceres.h>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <benchmark/benchmark.h>

#include "axiscal/calib/magnitude_fit.hpp"
#include "magnitude_readings.hpp"

namespace {

constexpr int count = magnitude_reading_count;

// The residuals |A (v - b)| - 1 of the readings v in a field of magnitude 1. The parameters p are
// the bias b and the upper triangle of the calibration matrix A, row by row.
struct Deviations {
  const Eigen::MatrixX3d* v;

  template <typename Number>
  bool operator()(const Number* p, Number* residuals) const {
    for (int i = 0; i < count; ++i) {
      const Number x = (*v)(i, 0) - p[0];
      const Number y = (*v)(i, 1) - p[1];
      const Number z = (*v)(i, 2) - p[2];
      const Number fx = p[3] * x + p[4] * y + p[5] * z;
      const Number fy = p[6] * y + p[7] * z;
      const Number fz = p[8] * z;
      residuals[i] = sqrt(fx * fx + fy * fy + fz * fz) - 1.0;
    }
    return true;
  }
};

class AnalyticDeviations : public ceres::SizedCostFunction<count, 9> {
 public:
  explicit AnalyticDeviations(const Eigen::MatrixX3d& v) : v_(v) {}

  bool Evaluate(double const* const* parameters,
                double* residuals,
                double** jacobians) const override {
    const double* const p = parameters[0];
    for (int i = 0; i < count; ++i) {
      const double x = v_(i, 0) - p[0];
      const double y = v_(i, 1) - p[1];
      const double z = v_(i, 2) - p[2];
      const double fx = p[3] * x + p[4] * y + p[5] * z;
      const double fy = p[6] * y + p[7] * z;
      const double fz = p[8] * z;
      const double length = std::sqrt(fx * fx + fy * fy + fz * fz);
      residuals[i] = length - 1.0;
      if (jacobians != nullptr && jacobians[0] != nullptr) {
        double* const row = jacobians[0] + 9 * i;
        const double ux = fx / length;
        const double uy = fy / length;
        const double uz = fz / length;
        row[0] = -ux * p[3];
        row[1] = -ux * p[4] - uy * p[6];
        row[2] = -ux * p[5] - uy * p[7] - uz * p[8];
        row[3] = ux * x;
        row[4] = ux * y;
        row[5] = ux * z;
        row[6] = uy * y;
        row[7] = uy * z;
        row[8] = uz * z;
      }
    }
    return true;
  }

 private:
  const Eigen::MatrixX3d& v_;
};

struct Ellipsoid {
  double parameters[9] = {0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.5, 0.0, 0.5};
  double rss = 0.0;
};

Ellipsoid by_ceres(ceres::CostFunction* deviations) {
  Ellipsoid at;
  ceres::Problem problem;
  problem.AddResidualBlock(deviations, nullptr, at.parameters);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  at.rss = 2.0 * summary.final_cost;
  return at;
}

void compare(const Ellipsoid& found) {
  const axiscal::MagnitudeFit fit =
      axiscal::fit_magnitude(magnitude_readings(), 1.0, axiscal::MagnitudeShape::triangular);
  // fit_magnitude() weights each reading by the noise of its magnitude, but Ceres does not. The
  // tolerances allow for this difference.
  const double rss = fit.residual_sd * fit.residual_sd * fit.degrees_of_freedom;
  if (std::abs(found.rss / rss - 1.0) > 1e-3 ||
      std::abs(found.parameters[0] - fit.response.bias(0)) > 1e-4) {
    std::fprintf(stderr, "magnitude fits differ: %.9g %.9g, %.9g %.9g\n", found.rss, rss,
                 found.parameters[0], fit.response.bias(0));
    std::exit(1);
  }
}

void magnitude_fit_200_ceres(benchmark::State& state) {
  compare(by_ceres(new AnalyticDeviations(magnitude_readings())));
  for (auto _ : state) {
    benchmark::DoNotOptimize(by_ceres(new AnalyticDeviations(magnitude_readings())).rss);
  }
}
BENCHMARK(magnitude_fit_200_ceres)->Unit(benchmark::kMicrosecond);

void magnitude_fit_200_ceres_autodiff(benchmark::State& state) {
  const auto automatic = [] {
    return new ceres::AutoDiffCostFunction<Deviations, count, 9>(
        new Deviations{&magnitude_readings()});
  };
  compare(by_ceres(automatic()));
  for (auto _ : state) {
    benchmark::DoNotOptimize(by_ceres(automatic()).rss);
  }
}
BENCHMARK(magnitude_fit_200_ceres_autodiff)->Unit(benchmark::kMicrosecond);

}  // namespace
