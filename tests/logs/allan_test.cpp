// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/allan.hpp"

#include <cmath>
#include <cstdint>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>

#include <gmock/gmock.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/logs/log_file.hpp"
#include "axiscal/logs/noise_model.hpp"
#include "data.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

// NIST SP 1065, p. 107: the ten-point set, tau 1 s.
TEST(AllanDeviation, OfTheNbsSetOfTen) {
  const std::vector<double> y = {892, 809, 823, 798, 671, 644, 883, 903, 677};
  const std::vector<std::size_t> lengths = {1, 2};
  const std::vector<AllanPoint> curve = allan_deviation(y, 1.0, lengths);
  EXPECT_NEAR(curve[0].deviation, 91.22945, 5e-6);
  EXPECT_NEAR(curve[1].deviation, 85.95287, 5e-6);
  // Its phase gives the same.
  std::vector<double> phase = {0.0};
  for (const double value : y) {
    phase.push_back(phase.back() + value);
  }
  EXPECT_NEAR(allan_deviation_of_phase(phase, 1.0, lengths)[1].deviation, 85.95287, 5e-6);
}

// NIST SP 1065, p. 108: a thousand points by the rule n' = 16807 n mod (2^31 - 1).
TEST(AllanDeviation, OfTheNbsSetOfAThousand) {
  std::vector<double> y;
  std::uint64_t n = 1234567890;
  for (int i = 0; i < 1000; ++i) {
    y.push_back(static_cast<double>(n) / 2147483647.0);
    n = 16807 * n % 2147483647;
  }
  const std::vector<AllanPoint> curve =
      allan_deviation(y, 1.0, std::vector<std::size_t>{1, 10, 100});
  EXPECT_NEAR(curve[0].deviation, 2.922319e-01, 5e-8);
  EXPECT_NEAR(curve[1].deviation, 9.159953e-02, 5e-9);
  EXPECT_NEAR(curve[2].deviation, 3.241343e-02, 5e-9);
}

TEST(AllanDeviation, OfStable32sPhaseFile) {
  AXISCAL_NEED_DATA(path, "allan_nbs14_stable32/PHASE.DAT");
  AXISCAL_NEED_DATA(reference, "allan_nbs14_stable32/phase_dat_oadev.txt");
  LogFile log(path, {.names = {"x"}});
  const LogBlock phase = read_log(log);
  LogFile expected(reference, {.names = {"af", "tau", "n", "alpha", "min", "sigma", "max"}});
  const LogBlock table = read_log(expected);
  ASSERT_GT(table[0].size(), 100U);
  std::vector<std::size_t> lengths;
  for (const double m : table[0]) {
    lengths.push_back(static_cast<std::size_t>(m));
  }
  const std::vector<AllanPoint> curve = allan_deviation_of_phase(phase[0], 1.0, lengths);
  for (std::size_t i = 0; i < curve.size(); ++i) {
    EXPECT_EQ(static_cast<double>(curve[i].terms), table[2][i]);
    EXPECT_NEAR(curve[i].deviation / table[5][i], 1.0, 5.1e-5) << lengths[i];  // five digits
  }
}

// The rest of ten minutes: SOURCE.md's values, by the mean rate.
TEST(AllanDeviation, OfARecordingAtRest) {
  AXISCAL_NEED_DATA(path, "static_mpu6050_hmc5883l_10min/mpu6050.csv");
  LogFile log(path);
  const LogBlock all = read_log(log);
  const std::vector<std::size_t> lengths = {1, 10, 100, 1000};
  const auto check = [&](const char* column, double scale, const std::vector<double>& expected) {
    const std::vector<AllanPoint> curve = allan_deviation(all[log.need(column)], 99.32, lengths);
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      EXPECT_NEAR(scale * curve[i].deviation / expected[i], 1.0, 5e-6) << column << i;
    }
  };
  check("gx", 1.0 / 131.0, {0.125846, 0.0394156, 0.01285, 0.00562792});
  check("ax", 1.0 / 4096.0, {0.00320033, 0.000951154, 0.000308663, 9.3725e-05});
}

TEST(AllanDeviation, RefusesWhatHasNone) {
  EXPECT_THAT(test::complaint_of<DomainError>([] {
                static_cast<void>(
                    allan_deviation(std::vector<double>{1.0}, 1.0, std::vector<std::size_t>{1}));
              }),
              testing::HasSubstr("three samples"));
  EXPECT_THROW(static_cast<void>(allan_deviation(std::vector<double>{1.0, std::nan(""), 2.0}, 1.0,
                                                 std::vector<std::size_t>{1})),
               DomainError);
}

// Of white noise sigma / sqrt(m); the stated 68 % intervals hold it in about 68 %.
TEST(AllanDeviation, StatesIntervalsThatHold) {
  int held = 0;
  int all = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    RandomStream random(seed);
    std::vector<double> y(2000);
    for (double& value : y) {
      value = random.normal();
    }
    for (const AllanPoint& point :
         allan_deviation(y, 1.0, std::vector<std::size_t>{1, 4, 16, 64})) {
      const double truth = 1.0 / std::sqrt(static_cast<double>(point.samples));
      held += point.low < truth && truth < point.high ? 1 : 0;
      ++all;
    }
  }
  EXPECT_NEAR(static_cast<double>(held) / all, 0.683, 0.08);
}

// ---- noise model ----

struct Noises {
  double white = 0.0;
  double walk = 0.0;
  double step = 0.0;
};

std::vector<double> simulated(const Noises& noises, std::size_t n, std::uint64_t seed) {
  RandomStream random(seed);
  std::vector<double> y(n);
  double walk = 0.0;
  for (double& value : y) {
    walk += noises.walk * random.normal();
    value = walk + noises.white * random.normal();
    if (noises.step > 0.0) {
      value = noises.step * std::round(value / noises.step);
    }
  }
  return y;
}

// White noise N and rate random walk K of known size come out within their intervals.
TEST(FitNoise, FindsWhatWasPutIn) {
  constexpr double rate = 100.0;
  const double N = 0.02;
  const double K = 0.003;
  int held = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const std::vector<double> y =
        simulated({.white = N * std::sqrt(rate), .walk = K / std::sqrt(rate)}, 200000, seed);
    const NoiseModel model = fit_noise(allan_deviation(y, rate, octave_lengths(y.size())));
    EXPECT_NEAR(model.coefficient(NoiseKind::white) / N, 1.0, 0.03);
    EXPECT_NEAR(model.coefficient(NoiseKind::random_walk) / K, 1.0, 0.5);
    for (const auto& [kind, truth] :
         {std::pair(NoiseKind::white, N), std::pair(NoiseKind::random_walk, K)}) {
      const NoiseCoefficient& one = model.coefficients[static_cast<std::size_t>(kind)];
      held += one.low <= truth && truth <= one.high ? 1 : 0;
    }
    EXPECT_NEAR(model.deviation_at(1.0), std::sqrt(N * N + K * K / 3.0), 0.001);
  }
  EXPECT_GE(held, 34);  // of 40
}

TEST(FitNoise, SaysNothingOfWhatDoesNotShow) {
  const std::vector<double> y = simulated({.white = 1.0}, 100000, 4);
  const NoiseModel model = fit_noise(allan_deviation(y, 1.0, octave_lengths(y.size())));
  EXPECT_NEAR(model.coefficient(NoiseKind::white), 1.0, 0.01);
  EXPECT_LT(model.coefficient(NoiseKind::random_walk), 2e-3);
  for (const NoiseCoefficient& one : model.coefficients) {
    EXPECT_GE(one.high, one.value);
    EXPECT_LE(one.low, one.value);
  }
}

TEST(BestDwell, IsWhereTheCurveIsLeast) {
  NoiseModel model;
  for (const NoiseKind kind : all_noise_kinds) {
    model.coefficients.push_back({.kind = kind});
  }
  model.coefficients[static_cast<std::size_t>(NoiseKind::white)].value = 0.1;
  model.coefficients[static_cast<std::size_t>(NoiseKind::random_walk)].value = 0.01;
  // N^2 / t + K^2 t / 3 is least at t = sqrt(3) N / K.
  const Dwell dwell = best_dwell(model, 1000.0);
  EXPECT_NEAR(dwell.best_s, std::sqrt(3.0) * 10.0, 0.4);
  EXPECT_LT(dwell.sensible_s, 0.7 * dwell.best_s);
  EXPECT_NEAR(dwell.sensible_deviation, 1.1 * dwell.deviation, 0.02 * dwell.deviation);
  EXPECT_FALSE(dwell.beyond_record);
  EXPECT_TRUE(best_dwell(model, 5.0).beyond_record);
}

// The published navchip result (avar package): by the named scales of all three axes together.
TEST(CoefficientBySlope, AgreesWithThePublishedNavchip) {
  AXISCAL_NEED_DATA(path, "allan_avar_curves/navchip_av.csv");
  std::map<std::string, std::vector<AllanPoint>> curves;
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream cells(line);
    std::string name, tau, variance, deviation;
    std::getline(cells, name, ',');
    std::getline(cells, tau, ',');
    std::getline(cells, variance, ',');
    std::getline(cells, deviation, ',');
    curves[name].push_back({.tau_s = std::stod(tau), .deviation = std::stod(deviation)});
  }
  const auto over = [&](const char* sensor, NoiseKind kind, std::size_t first, std::size_t last) {
    std::vector<AllanPoint> points;
    for (const char axis : {'X', 'Y', 'Z'}) {
      const std::vector<AllanPoint>& curve = curves.at(std::string(sensor) + "." + axis);
      points.insert(points.end(), curve.begin() + static_cast<std::ptrdiff_t>(first - 1),
                    curve.begin() + static_cast<std::ptrdiff_t>(last));
    }
    return coefficient_by_slope(kind, points);
  };
  EXPECT_NEAR(over("Gyro", NoiseKind::white, 6, 8), 5.945877e-05, 5e-12);
  EXPECT_NEAR(over("Gyro", NoiseKind::quantisation, 1, 4), 7.208553e-06, 5e-13);
  EXPECT_NEAR(over("Gyro", NoiseKind::random_walk, 10, 13), 3.062325e-05, 5e-12);
  EXPECT_NEAR(over("Accel", NoiseKind::white, 1, 6), 5.233402e-04, 5e-11);
  EXPECT_NEAR(over("Accel", NoiseKind::random_walk, 14, 16), 6.422082e-05, 5e-12);
}

// The published five-term fits (imu_utils): the fitted curve at 1 s, and near its minimum.
TEST(FitNoise, AgreesWithTheFittedCurvesOfImuUtils) {
  constexpr double deg_h_per_rad_s = 206264.80625;
  for (const auto& [imu, gyr_n, gyr_w] :
       {std::tuple("A3", 1.1712350336249066e-04, 3.6395480767077183e-05),
        std::tuple("gx4", 6.5123262354603977e-05, 4.3243173464588734e-05),
        std::tuple("N3", 1.0527575833172373e-04, 3.9384242019484837e-05)}) {
    const std::string stem = std::string("allan_imu_utils_curves/data_") + imu + "_gyr_";
    AXISCAL_NEED_DATA(times, stem + "t.txt");
    AXISCAL_NEED_DATA(values, stem + "x.txt");
    LogFile time_log(times, {.names = {"tau"}});
    LogFile value_log(values, {.names = {"sigma"}});
    const LogBlock tau = read_log(time_log);
    const LogBlock sigma = read_log(value_log);
    const double length_s = 7200.0;  // two hours: how sure a point is
    std::vector<AllanPoint> curve;
    for (std::size_t i = 0; i < tau[0].size(); ++i) {
      if (tau[0][i] > 0.1) {  // below it the recordings show vibration
        curve.push_back({.tau_s = tau[0][i],
                         .deviation = sigma[0][i] / deg_h_per_rad_s,
                         .degrees_of_freedom = std::max(1.0, length_s / tau[0][i])});
      }
    }
    const NoiseModel model = fit_noise(curve);
    EXPECT_NEAR(model.deviation_at(1.0) / gyr_n, 1.0, 0.08) << imu;
    EXPECT_NEAR(best_dwell(model, curve.back().tau_s).deviation / gyr_w, 1.0, 0.12) << imu;
  }
}

// Six hours of noise were published, seven minutes are here: white noise by m = 32 (SOURCE.md).
TEST(AllanDeviation, OfTheUncuyoLogGivesItsWhiteNoise) {
  AXISCAL_NEED_DATA(path, "imu_mpu6050_uncuyo/static_log.csv");
  AXISCAL_NEED_DATA(parameters, "imu_mpu6050_uncuyo/params_acc.csv");
  LogFile log(path);
  const LogBlock all = read_log(log);
  LogFile fit(parameters, {.names = {"p"}});
  const std::vector<double> p = read_log(fit)[0];
  const std::vector<double> published = {1.026e-3, 8.75e-4, 1.93e-3};  // (m/s^2)^2 a sample
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<AllanPoint> curve = allan_deviation(
        all[log.need(std::string("a") + "xyz"[axis])], 100.0, std::vector<std::size_t>{32});
    const double variance = 32.0 * std::pow(p[3 + axis] * curve[0].deviation, 2);
    EXPECT_NEAR(variance / published[axis], 1.0, 1e-3);
  }
}

}  // namespace
}  // namespace axiscal
