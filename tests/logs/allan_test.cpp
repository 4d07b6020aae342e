// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/allan.hpp"

#include <cmath>
#include <cstdint>
#include <fstream>
#include <map>
#include <numbers>
#include <numeric>
#include <sstream>

#include <gmock/gmock.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/logs/log_file.hpp"
#include "axiscal/logs/noise_json.hpp"
#include "axiscal/logs/noise_model.hpp"
#include "axiscal/logs/other_deviations.hpp"
#include "data.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

// The set of ten points with tau = 1 s (NIST SP 1065, p. 107).
TEST(AllanDeviation, OfTheNbsSetOfTen) {
  const std::vector<double> y = {892, 809, 823, 798, 671, 644, 883, 903, 677};
  const std::vector<std::size_t> lengths = {1, 2};
  const std::vector<AllanPoint> curve = allan_deviation(y, 1.0, lengths);
  EXPECT_NEAR(curve[0].deviation, 91.22945, 5e-6);
  EXPECT_NEAR(curve[1].deviation, 85.95287, 5e-6);
  // The in-place version gives the same deviation. Its memory then contains the phase.
  std::vector<double> own = y;
  EXPECT_NEAR(allan_deviation_in_place(own, 1.0, lengths)[1].deviation, 85.95287, 5e-6);
  EXPECT_NEAR(own[1], y[0] + y[1] - 2.0 * std::accumulate(y.begin(), y.end(), 0.0) / 9.0, 1e-9);
  EXPECT_NEAR(own.back(), 0.0, 1e-9);
  // The phase gives the same deviation.
  std::vector<double> phase = {0.0};
  for (const double value : y) {
    phase.push_back(phase.back() + value);
  }
  EXPECT_NEAR(allan_deviation_of_phase(phase, 1.0, lengths)[1].deviation, 85.95287, 5e-6);
}

// The set of 1000 points by n' = 16807 n mod (2^31 - 1) (NIST SP 1065, p. 108).
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
    EXPECT_NEAR(curve[i].deviation / table[5][i], 1.0, 5.1e-5) << lengths[i];  // 5 digits stated
  }
}

// A recording of ten minutes at rest. The expected values are in SOURCE.md, by the mean rate.
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
              testing::HasSubstr("at least two samples"));
  // If the in-place version throws, the samples are not changed.
  for (const std::vector<double>& samples :
       {std::vector<double>{1.0}, std::vector<double>{1.0, std::nan(""), 2.0}}) {
    std::vector<double> own = samples;
    EXPECT_THROW(static_cast<void>(allan_deviation_in_place(own, 1.0, std::vector<std::size_t>{1})),
                 DomainError);
    EXPECT_EQ(own.front(), 1.0);
    EXPECT_EQ(own.back(), samples.back());
  }
  EXPECT_THROW(static_cast<void>(allan_deviation(std::vector<double>{1.0, std::nan(""), 2.0}, 1.0,
                                                 std::vector<std::size_t>{1})),
               DomainError);
}

// The deviation of white noise is sigma / sqrt(m). The stated 68 % intervals cover it in about 68 %
// of cases.
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

// White noise N and random walk K of known size are found within their intervals.
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
  EXPECT_GE(held, 34);  // out of 40
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

// The exact curve of white noise N and random walk K.
std::vector<AllanPoint> exact_curve(double N, double K, double longest_s, double freedom) {
  std::vector<AllanPoint> curve;
  for (double tau = 0.1; tau <= longest_s; tau *= 2.0) {
    curve.push_back({.tau_s = tau,
                     .deviation = std::sqrt(N * N / tau + K * K * tau / 3.0),
                     .degrees_of_freedom = freedom});
  }
  return curve;
}

TEST(BestDwell, IsWhereTheCurveIsLeast) {
  // N^2 / t + K^2 t / 3 has its minimum at t = sqrt(3) N / K = 17 s.
  const std::vector<AllanPoint> curve = exact_curve(0.1, 0.01, 1000.0, 100.0);
  const Dwell dwell = best_dwell(curve);
  EXPECT_GE(dwell.best_s, 12.0);
  EXPECT_LE(dwell.best_s, 26.0);
  EXPECT_LT(dwell.sensible_s, dwell.best_s);
  EXPECT_NEAR(dwell.sensible_deviation, 1.1 * dwell.deviation, 1e-9 * dwell.deviation);
  EXPECT_NEAR(deviation_at(curve, dwell.sensible_s), dwell.sensible_deviation, 1e-9);
  EXPECT_FALSE(dwell.beyond_record);
  EXPECT_TRUE(best_dwell(exact_curve(0.1, 0.01, 5.0, 100.0)).beyond_record);
}

// A point with few degrees of freedom that is low by chance is not the best dwell.
TEST(BestDwell, IsNotLedByAPointThatIsHardlyKnown) {
  std::vector<AllanPoint> curve = exact_curve(0.1, 0.01, 1000.0, 100.0);
  curve.back().degrees_of_freedom = 1.0;
  curve.back().deviation = 1e-6;
  EXPECT_LT(best_dwell(curve).best_s, 30.0);
}

TEST(DeviationAt, IsStraightInLogarithms) {
  const std::vector<AllanPoint> curve = {{.tau_s = 1.0, .deviation = 4.0},
                                         {.tau_s = 4.0, .deviation = 2.0}};
  EXPECT_NEAR(deviation_at(curve, 2.0), std::sqrt(8.0), 1e-12);
  EXPECT_NEAR(deviation_at(curve, 16.0), 1.0, 1e-12);
  EXPECT_NEAR(deviation_at(curve, 0.25), 8.0, 1e-12);
  EXPECT_THROW(static_cast<void>(deviation_at({}, 1.0)), DomainError);
}

// A low-pass filter reduces the noise at the shortest octaves. These points are the most precise,
// and must not dominate the fit. With plain weights the fit had bias instability instead of white
// noise.
TEST(FitNoise, IsNotLedByAFilter) {
  const double N = 0.02;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    std::vector<double> y = simulated({.white = N * 10.0, .walk = 3e-4}, 400000, seed);
    double smooth = 0.0;
    for (double& value : y) {
      smooth += (value - smooth) / 3.0;
      value = smooth;
    }
    const NoiseModel model = fit_noise(allan_deviation(y, 100.0, octave_lengths(y.size())));
    const NoiseCoefficient& white = model.coefficients[static_cast<std::size_t>(NoiseKind::white)];
    EXPECT_NEAR(white.value / N, 1.0, 0.15) << seed;
    EXPECT_TRUE(model.from_tau_s > 0.01 || model.model_error > 0.0) << seed;
  }
}

// A correlated process of the sensor (Gauss-Markov) exceeds the white noise. Then the kinds can
// describe the curve without white noise, although it falls like white noise over a decade or more.
TEST(FitNoise, NeverDeniesWhiteNoiseThatTheCurveShows) {
  const double N = 0.0019;
  for (const double strength : {0.5, 1.0, 2.0, 4.0}) {
    std::vector<AllanPoint> curve;
    for (double tau = 0.02; tau < 3000.0; tau *= 2.0) {
      constexpr double T = 40.0;
      const double x = tau / T;
      const double hump = std::pow(strength * N, 2) * T / tau *
                          (1.0 - (3.0 - 4.0 * std::exp(-x) + std::exp(-2.0 * x)) / (2.0 * x));
      const double filtered = tau < 0.03 ? 0.6 : 1.0;
      curve.push_back({.tau_s = tau,
                       .deviation = std::sqrt(filtered * N * N / tau + hump),
                       .degrees_of_freedom = 3.0 * 20000.0 / tau});
    }
    const NoiseModel model = fit_noise(curve);
    const NoiseCoefficient& white = model.coefficients[static_cast<std::size_t>(NoiseKind::white)];
    EXPECT_GT(white.value, 0.7 * N) << strength;
    EXPECT_LT(white.value, 1.4 * N) << strength;
  }
}

TEST(FitNoise, TakesNFromTheStretchThatFallsAsWhiteNoise) {
  // A curve for which the stretch decides: white noise over six octaves, and steps at both ends.
  std::vector<AllanPoint> curve;
  int i = 0;
  for (double tau = 0.01; tau < 300.0; tau *= 2.0, ++i) {
    const double off = i < 2 ? 3.0 : i > 8 ? 4.0 : 1.0;
    curve.push_back({.tau_s = tau,
                     .deviation = off * 0.02 / std::sqrt(tau),
                     .degrees_of_freedom = 4000.0 / tau});
  }
  const NoiseModel model = fit_noise(curve);
  const NoiseCoefficient& white = model.coefficients[static_cast<std::size_t>(NoiseKind::white)];
  EXPECT_GT(white.value, 0.7 * 0.02);
  EXPECT_GT(white.high, 0.019);
}

TEST(FitNoise, SaysWhenTheKindsDoNotDescribeTheCurve) {
  const std::vector<AllanPoint> good = exact_curve(0.1, 0.01, 1000.0, 400.0);
  EXPECT_GT(fit_noise(good).p_value, 0.05);
  EXPECT_EQ(fit_noise(good).model_error, 0.0);
  std::vector<AllanPoint> bad = good;
  for (std::size_t i = 0; i < bad.size(); ++i) {
    bad[i].deviation *= i % 2 == 0 ? 1.3 : 1.0 / 1.3;  // no kind of noise has such a wave
  }
  const NoiseModel model = fit_noise(bad);
  EXPECT_LT(model.p_value, 0.05);
  EXPECT_GT(model.model_error, 0.1);
  EXPECT_NEAR(model.coefficient(NoiseKind::white), 0.1, 0.03);
  const NoiseCoefficient& white = model.coefficients[static_cast<std::size_t>(NoiseKind::white)];
  EXPECT_LE(white.low, 0.9 * white.value);
  EXPECT_GE(white.high, 1.1 * white.value);
}

// Tables of the sets of 10 and 1000 points (NIST SP 1065, pp. 107, 108).
TEST(OtherDeviations, OfTheNbsSets) {
  const std::vector<double> ten = {892, 809, 823, 798, 671, 644, 883, 903, 677};
  const std::vector<std::size_t> two = {1, 2};
  const std::vector<double> modified = other_deviations(OtherDeviation::modified, ten, 1.0, two);
  EXPECT_NEAR(modified[0], 91.22945, 5e-6);
  EXPECT_NEAR(modified[1], 74.78849, 5e-6);
  EXPECT_NEAR(other_deviations(OtherDeviation::hadamard, ten, 1.0, two)[1], 85.61487, 5e-6);
  EXPECT_NEAR(other_deviations(OtherDeviation::total, ten, 1.0, two)[1], 93.90379, 5e-6);
  std::vector<double> thousand;
  std::uint64_t n = 1234567890;
  for (int i = 0; i < 1000; ++i) {
    thousand.push_back(static_cast<double>(n) / 2147483647.0);
    n = 16807 * n % 2147483647;
  }
  const std::vector<std::size_t> lengths = {10, 100};
  const auto expect = [&](OtherDeviation which, double at_10, double at_100) {
    const std::vector<double> found = other_deviations(which, thousand, 1.0, lengths);
    EXPECT_NEAR(found[0], at_10, 5e-9) << name_of(which);
    EXPECT_NEAR(found[1], at_100, 5e-9) << name_of(which);
  };
  expect(OtherDeviation::modified, 6.172376e-02, 2.170921e-02);
  expect(OtherDeviation::hadamard, 9.581083e-02, 3.237638e-02);
  expect(OtherDeviation::total, 9.134743e-02, 3.406530e-02);
}

TEST(OtherDeviations, OfStable32sPhaseFile) {
  AXISCAL_NEED_DATA(path, "allan_nbs14_stable32/PHASE.DAT");
  LogFile log(path, {.names = {"x"}});
  const LogBlock phase = read_log(log);
  for (const auto& [which, file] :
       {std::pair(OtherDeviation::modified, "mdev"), std::pair(OtherDeviation::hadamard, "ohdev"),
        std::pair(OtherDeviation::total, "totdev")}) {
    AXISCAL_NEED_DATA(reference,
                      std::string("allan_nbs14_stable32/phase_dat_") + file + "_octave.txt");
    LogFile expected(reference, {.names = {"af", "tau", "n", "alpha", "min", "sigma", "max"}});
    const LogBlock table = read_log(expected);
    ASSERT_GT(table[0].size(), 5U);
    std::vector<std::size_t> lengths;
    for (const double m : table[0]) {
      lengths.push_back(static_cast<std::size_t>(m));
    }
    const std::vector<double> found = other_deviations_of_phase(which, phase[0], 1.0, lengths);
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_NEAR(found[i] / table[5][i], 1.0, 5.1e-5) << file << " " << lengths[i];
    }
  }
}

TEST(OtherDeviations, OfTooFewSamplesAreNone) {
  const std::vector<double> y = {1.0, 2.0, 4.0, 8.0, 16.0};
  const std::vector<std::size_t> lengths = {1, 2, 5};
  for (const OtherDeviation which : all_other_deviations) {
    const std::vector<double> found = other_deviations(which, y, 1.0, lengths);
    EXPECT_TRUE(std::isfinite(found[0])) << name_of(which);
    EXPECT_TRUE(std::isnan(found[2])) << name_of(which);
    EXPECT_EQ(other_deviation_of(name_of(which)), which);
  }
  EXPECT_FALSE(other_deviation_of("adev"));
  EXPECT_THROW(
      static_cast<void>(other_deviations(OtherDeviation::total, {{1.0, NAN, 2.0}}, 1.0, lengths)),
      DomainError);
}

// A curve without points or with times that do not ascend is refused. Earlier a plan with such a
// curve crashed.
TEST(NoiseJson, RefusesWhatIsNoCurve) {
  const auto text = [](const std::string& points) {
    return R"({"format": "axiscal-noise", "version": 1, "rate_hz": 1, "samples": 9, "columns": {"x": {"coefficients": {)"
           R"("quantisation": {"value": 0, "low": 0, "high": 0}, "white": {"value": 1, "low": 1, "high": 1},)"
           R"("bias_instability": {"value": 0, "low": 0, "high": 0}, "random_walk": {"value": 0, "low": 0, "high": 0},)"
           R"("ramp": {"value": 0, "low": 0, "high": 0}}, "dwell": {"best_s": 1, "deviation": 1, "sensible_s": 1,)"
           R"("sensible_deviation": 1}, "allan_deviation": [)" +
           points + "]}}}";
  };
  const std::string one = R"({"tau": 1, "samples": 1, "deviation": 1, "low": 1, "high": 1})";
  EXPECT_EQ(parse_noise(text(one), "n.json").columns.size(), 1U);
  EXPECT_THROW(static_cast<void>(parse_noise(text(""), "n.json")), DataError);
  EXPECT_THROW(static_cast<void>(parse_noise(text(one + "," + one), "n.json")), DataError);
}

// A plan uses the axes with one unit.
TEST(ColumnsOfInstrument, AreThoseOfOneUnit) {
  const auto names_for = [](const std::vector<std::string>& columns, const char* kind) {
    LogNoise noise;
    for (const std::string& name : columns) {
      noise.columns.push_back({.name = name});
    }
    std::vector<std::string> found;
    for (const ColumnNoise* const one : columns_of_instrument(noise, kind)) {
      found.push_back(one->name);
    }
    return found;
  };
  const std::vector<std::string> imu = {"ax", "ay", "az", "gx", "gy", "gz", "temperature"};
  using testing::ElementsAre;
  EXPECT_THAT(names_for(imu, "accelerometer"), ElementsAre("ax", "ay", "az"));
  EXPECT_THAT(names_for(imu, "gyroscope"), ElementsAre("gx", "gy", "gz"));
  EXPECT_THAT(names_for({"imu.gyro.X", "imu.accel.X", "imu.gyro.Y"}, "accelerometer"),
              ElementsAre("imu.accel.X"));
  EXPECT_THAT(names_for({"x", "y", "z"}, "gyroscope"), ElementsAre("x", "y", "z"));
}

// The published result for navchip (package avar), by the stated ranges of all three axes together.
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

// The published five-term fits of imu_utils: the fitted curve at 1 s and near its minimum.
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
    const double length_s = 7200.0;  // 2 h, for the degrees of freedom
    std::vector<AllanPoint> curve;
    for (std::size_t i = 0; i < tau[0].size(); ++i) {
      if (tau[0][i] > 0.1) {  // shorter times show vibration
        curve.push_back({.tau_s = tau[0][i],
                         .deviation = sigma[0][i] / deg_h_per_rad_s,
                         .degrees_of_freedom = std::max(1.0, length_s / tau[0][i])});
      }
    }
    const NoiseModel model = fit_noise(curve);
    EXPECT_NEAR(model.deviation_at(1.0) / gyr_n, 1.0, 0.08) << imu;
    EXPECT_NEAR(best_dwell(curve).deviation / gyr_w, 1.0, 0.12) << imu;
  }
}

// The published noise is from six hours. The log here has seven minutes, so only the white noise at
// m = 32 is compared (SOURCE.md).
TEST(AllanDeviation, OfTheUncuyoLogGivesItsWhiteNoise) {
  AXISCAL_NEED_DATA(path, "imu_mpu6050_uncuyo/static_log.csv");
  AXISCAL_NEED_DATA(parameters, "imu_mpu6050_uncuyo/params_acc.csv");
  LogFile log(path);
  const LogBlock all = read_log(log);
  LogFile fit(parameters, {.names = {"p"}});
  const std::vector<double> p = read_log(fit)[0];
  const std::vector<double> published = {1.026e-3, 8.75e-4, 1.93e-3};  // variance [(m/s^2)^2]
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<AllanPoint> curve = allan_deviation(
        all[log.need(std::string("a") + "xyz"[axis])], 100.0, std::vector<std::size_t>{32});
    const double variance = 32.0 * std::pow(p[3 + axis] * curve[0].deviation, 2);
    EXPECT_NEAR(variance / published[axis], 1.0, 1e-3);
  }
}

}  // namespace
}  // namespace axiscal
