// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include <gmock/gmock.h>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/sensor_model.hpp"
#include "axiscal/calib/temperature.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/random.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

// ---- polynomials of bias and scale ----

// Random temperature terms of three axes. The orders of bias and scale may differ.
TemperatureResponse random_terms(int bias_order, int scale_order, bool own, RandomStream& random) {
  TemperatureResponse terms;
  if (own) {
    terms.spans.clear();
    for (int k = 0; k < 3; ++k) {
      terms.spans.push_back({.reference = 20.0 + k, .low = -10.0 + k, .high = 50.0 + k});
    }
  } else {
    terms.spans = {{.reference = 22.0, .low = -10.0, .high = 50.0}};
  }
  const auto matrix = [&](int order, double size) {
    Eigen::MatrixXd all(3, order);
    for (Eigen::Index k = 0; k < 3; ++k) {
      for (int j = 0; j < order; ++j) {
        all(k, j) = size * std::pow(0.02, j) * random.normal();
      }
    }
    return all;
  };
  terms.bias = matrix(bias_order, 1e-3);
  terms.scale = matrix(scale_order, 1e-3);
  return terms;
}

double sum_of_powers(const Eigen::RowVectorXd& coefficients, double d) {
  double sum = 0.0;
  for (Eigen::Index j = 0; j < coefficients.size(); ++j) {
    sum += coefficients(j) * std::pow(d, static_cast<double>(j + 1));
  }
  return sum;
}

TEST(TemperatureTerms, AreSumsOfPowersOfTheDifference) {
  RandomStream random(3);
  for (const bool own : {false, true}) {
    const TemperatureResponse terms = random_terms(3, 2, own, random);
    EXPECT_EQ(terms.has_own_sensors(), own);
    for (Eigen::Index k = 0; k < 3; ++k) {
      for (const double t : {-8.0, 19.5, 40.0}) {
        const double d = t - (own ? 20.0 + static_cast<double>(k) : 22.0);
        EXPECT_NEAR(terms.bias_shift(k, t), sum_of_powers(terms.bias.row(k), d), 1e-15);
        EXPECT_NEAR(terms.scale_at(k, t), 1.0 + sum_of_powers(terms.scale.row(k), d), 1e-15);
      }
    }
  }
}

TEST(TemperatureTerms, AddNothingAtTheReference) {
  RandomStream random(4);
  for (const bool own : {false, true}) {
    const TemperatureResponse terms = random_terms(2, 2, own, random);
    const SensorTemperature reference = terms.reference();
    EXPECT_EQ(reference.has_own(), own);
    for (Eigen::Index k = 0; k < 3; ++k) {
      EXPECT_EQ(reference.of(k), terms.span_of(k).reference);
      EXPECT_EQ(terms.bias_shift(k, reference.of(k)), 0.0);
      EXPECT_EQ(terms.scale_at(k, reference.of(k)), 1.0);
      EXPECT_EQ(terms.bias_corrected(k, 3.0, 0.5, reference.of(k)), 2.5);
    }
  }
}

TEST(TemperatureTerms, OfOrderZeroLeaveEveryReading) {
  TemperatureResponse terms;
  terms.bias.resize(3, 0);
  terms.scale.resize(3, 0);
  EXPECT_EQ(terms.bias_shift(1, 80.0), 0.0);
  EXPECT_EQ(terms.scale_at(1, -300.0), 1.0);
}

// Removing the temperature terms inverts the response at any temperature.
TEST(TemperatureTerms, AreTakenOutOfReadings) {
  RandomStream random(5);
  SensorModel sensor = test::accelerometer_truth();
  for (const bool own : {false, true}) {
    sensor.temperature = random_terms(2, 3, own, random);
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d f = random.normals<3>();
      const double t = 60.0 * random.uniform() - 10.0;
      const SensorTemperature at =
          own ? SensorTemperature({t, t + 1.0, t - 2.0}) : SensorTemperature(t);
      const Eigen::VectorXd v = response_at(sensor, f, at);
      EXPECT_MATRIX_NEAR(reading_at_reference(sensor, v, at), sensor.response.at(f), 1e-13);
      EXPECT_EQ(reading_at_reference(sensor, v, std::nullopt), v);
      for (Eigen::Index k = 0; k < 3; ++k) {
        const double above =
            sensor.temperature->bias_corrected(k, v(k), sensor.response.bias(k), at.of(k));
        EXPECT_NEAR(above, sensor.response.sensitivity.row(k).dot(f), 1e-13);
      }
    }
  }
}

// A polynomial with another reference, by Taylor's formula.
Eigen::RowVectorXd moved_polynomial(const Eigen::RowVectorXd& all, double by) {
  Eigen::RowVectorXd moved = Eigen::RowVectorXd::Zero(all.size());
  for (Eigen::Index i = 0; i < all.size(); ++i) {
    double choose = 1.0;  // binomial coefficient, i over j
    for (Eigen::Index j = 0; j <= i; ++j) {
      moved(j) += choose * all(i) * std::pow(by, static_cast<double>(i - j));
      choose *= static_cast<double>(i - j) / static_cast<double>(j + 1);
    }
  }
  return moved;
}

TEST(TemperatureTerms, DescribeTheSameSensorAtAnyReference) {
  RandomStream random(6);
  SensorModel sensor = test::accelerometer_truth();
  sensor.temperature = random_terms(3, 3, false, random);
  SensorModel moved = sensor;
  const double by = 8.0;
  moved.temperature->spans.front().reference += by;
  for (Eigen::Index k = 0; k < 3; ++k) {
    Eigen::RowVectorXd bias(4);
    bias << sensor.response.bias(k), sensor.temperature->bias.row(k);
    Eigen::RowVectorXd scale(4);
    scale << 1.0, sensor.temperature->scale.row(k);
    bias = moved_polynomial(bias, by);
    scale = moved_polynomial(scale, by);
    moved.response.bias(k) = bias(0);
    moved.response.sensitivity.row(k) *= scale(0);
    moved.temperature->bias.row(k) = bias.tail(3);
    moved.temperature->scale.row(k) = scale.tail(3) / scale(0);
  }
  for (const double t : {-20.0, 22.0, 30.0, 65.0}) {
    const Eigen::Vector3d f = random.normals<3>();
    EXPECT_MATRIX_NEAR(response_at(moved, f, SensorTemperature(t)),
                       response_at(sensor, f, SensorTemperature(t)), 1e-13);
  }
}

// The unit of the sensor does not matter: for t' = a t + c a term of power j is divided by a^j.
TEST(TemperatureTerms, DescribeTheSameSensorInAnyUnitOfTemperature) {
  RandomStream random(7);
  const TemperatureResponse celsius = random_terms(3, 2, true, random);
  TemperatureResponse fahrenheit = celsius;
  const auto converted_from = [](double t) { return 1.8 * t + 32.0; };
  for (TemperatureSpan& span : fahrenheit.spans) {
    span = {.reference = converted_from(span.reference),
            .low = converted_from(span.low),
            .high = converted_from(span.high)};
  }
  for (Eigen::Index j = 0; j < 3; ++j) {
    fahrenheit.bias.col(j) /= std::pow(1.8, static_cast<double>(j + 1));
    if (j < 2) {
      fahrenheit.scale.col(j) /= std::pow(1.8, static_cast<double>(j + 1));
    }
  }
  for (const double t : {-25.0, 0.0, 35.0, 70.0}) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      EXPECT_NEAR(fahrenheit.bias_shift(k, converted_from(t)), celsius.bias_shift(k, t), 1e-14);
      EXPECT_NEAR(fahrenheit.scale_at(k, converted_from(t)), celsius.scale_at(k, t), 1e-14);
    }
    EXPECT_EQ(fahrenheit.is_extrapolated(converted_from(t)), celsius.is_extrapolated(t));
  }
}

TEST(TemperatureSpans, IncludeTheirEnds) {
  TemperatureResponse terms;
  terms.spans = {{.reference = 20.0, .low = -10.0, .high = 50.0}};
  for (const double inside : {-10.0, 20.0, 50.0}) {
    EXPECT_FALSE(terms.is_extrapolated(inside)) << inside;
  }
  EXPECT_TRUE(terms.is_extrapolated(std::nextafter(-10.0, -100.0)));
  EXPECT_TRUE(terms.is_extrapolated(std::nextafter(50.0, 100.0)));
  // If the record has one sensor, the mean of the axes' temperatures is used.
  EXPECT_FALSE(terms.is_extrapolated(SensorTemperature({-20.0, 20.0, 60.0})));
  EXPECT_TRUE(terms.is_extrapolated(SensorTemperature({40.0, 50.0, 63.0})));
}

TEST(TemperatureSpans, OfEachAxisAreLeftByAnyOfThem) {
  TemperatureResponse terms;
  terms.spans = {{.reference = 0.0, .low = 0.0, .high = 10.0},
                 {.reference = 0.0, .low = 100.0, .high = 110.0}};
  EXPECT_FALSE(terms.is_extrapolated(SensorTemperature({5.0, 105.0})));
  EXPECT_TRUE(terms.is_extrapolated(SensorTemperature({11.0, 105.0})));
  EXPECT_TRUE(terms.is_extrapolated(SensorTemperature({5.0, 99.0})));
}

TEST(SpanText, NamesAxesOnlyIfTheyHaveSensorsOfTheirOwn) {
  TemperatureResponse terms;
  terms.spans = {{.reference = 25.0}};
  const auto reference = [](const TemperatureSpan& span) { return number_text(span.reference); };
  EXPECT_EQ(span_text(terms, {"x", "y", "z"}, reference), "25");
  terms.spans = {{.reference = 25.0}, {.reference = 26.5}, {.reference = -3.0}};
  EXPECT_EQ(span_text(terms, {"x", "y", "z"}, reference), "x 25, y 26.5, z -3");
}

// ---- soak levels ----

struct HeldRun {
  std::vector<double> temperatures;
  std::vector<int> levels;
};

// 12 readings at each temperature in `held`, in random order.
HeldRun held_run(const std::vector<double>& held, double scatter, RandomStream& random) {
  HeldRun run;
  for (int i = 0; i < 12; ++i) {
    for (std::size_t level = 0; level < held.size(); ++level) {
      run.temperatures.push_back(held[level] + scatter * (random.uniform() - 0.5));
      run.levels.push_back(static_cast<int>(level));
    }
  }
  std::vector<std::size_t> order(run.levels.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  random.shuffle(std::span(order));
  HeldRun shuffled;
  for (const std::size_t i : order) {
    shuffled.temperatures.push_back(run.temperatures[i]);
    shuffled.levels.push_back(run.levels[i]);
  }
  return shuffled;
}

TEST(HeldTemperatures, AreFoundInAnyOrder) {
  RandomStream random(11);
  for (const std::vector<double>& held :
       {std::vector<double>{-10.0, 25.0, 55.0}, std::vector<double>{20.0, 40.0},
        std::vector<double>{-40.0, -20.0, 0.0, 20.0, 40.0, 60.0}}) {
    for (const double scatter : {0.0, 0.2, 1.0}) {
      const HeldRun run = held_run(held, scatter, random);
      EXPECT_EQ(soak_levels(run.temperatures), run.levels) << held.size() << ' ' << scatter;
    }
  }
}

// Offset and unit of the sensor do not matter. With a negative unit the order of the levels is
// reversed.
TEST(HeldTemperatures, DoNotDependOnTheSensor) {
  RandomStream random(12);
  const HeldRun run = held_run({-10.0, 25.0, 55.0}, 0.5, random);
  for (const double unit : {1e-3, 1.8, 4096.0, -2.0}) {
    std::vector<double> outputs = run.temperatures;
    std::vector<int> expected = run.levels;
    for (std::size_t i = 0; i < outputs.size(); ++i) {
      outputs[i] = unit * outputs[i] + 17.0;
      expected[i] = unit > 0.0 ? expected[i] : 2 - expected[i];
    }
    EXPECT_EQ(soak_levels(outputs), expected) << unit;
  }
}

TEST(HeldTemperatures, AreNotSeenInFewOrSpreadReadings) {
  EXPECT_THAT(soak_levels({}), IsEmpty());
  EXPECT_EQ(soak_levels({21.0}), std::vector<int>{0});
  // If each reading has another temperature, there are no levels.
  EXPECT_THAT(soak_levels({-10.0, 25.0}), IsEmpty());
  EXPECT_THAT(soak_levels({-10.0, 25.0, 55.0}), IsEmpty());
  // If a level is as wide as the gap to the next one, there are no levels either.
  EXPECT_THAT(soak_levels({0.0, 1.0, 2.2, 3.1, 4.0, 5.0, 6.1, 7.0, 20.0, 20.9}), IsEmpty());
}

// ---- the state of a soak ----

struct Log {
  std::vector<double> time_s;
  std::vector<double> value;

  [[nodiscard]] SoakState state(double window_s, double tolerance) const {
    return soak_state(time_s, value, window_s, tolerance);
  }
};

template <typename Function>
Log log_of(double end_s, double step_s, Function value_at) {
  Log log;
  for (int i = 0; i * step_s <= end_s; ++i) {
    log.time_s.push_back(i * step_s);
    log.value.push_back(value_at(i * step_s));
  }
  return log;
}

TEST(SoakOfARamp, IsSteadyIfTheWindowChangesLessThanTheTolerance) {
  for (const double rate : {2e-3, -2e-3}) {
    const Log ramp = log_of(1000.0, 10.0, [&](double t) { return 20.0 + rate * t; });
    const SoakState hot = ramp.state(200.0, 0.3);  // the change in the window is 0.4
    EXPECT_FALSE(hot.steady);
    EXPECT_NEAR(hot.rate, rate, 1e-12);
    EXPECT_LT(hot.rate_u, 1e-12);
    const SoakState steady = ramp.state(200.0, 0.5);
    EXPECT_TRUE(steady.steady);
    EXPECT_EQ(steady.remaining_s, 0.0);
  }
}

// The rate is the slope of the regression line in the window, by a textbook's formulas.
TEST(SoakOfANoisyRamp, IsTheRegressionOverTheWindow) {
  RandomStream random(14);
  const Log log =
      log_of(900.0, 7.0, [&](double t) { return 30.0 + 1e-3 * t + 0.05 * random.normal(); });
  const double window = 300.0;
  double n = 0.0;
  double sum_t = 0.0;
  double sum_v = 0.0;
  const auto each = [&](const auto& use) {
    for (std::size_t i = 0; i < log.time_s.size(); ++i) {
      if (log.time_s[i] >= log.time_s.back() - window) {
        use(log.time_s[i], log.value[i]);
      }
    }
  };
  each([&](double t, double v) {
    n += 1.0;
    sum_t += t;
    sum_v += v;
  });
  double s_tt = 0.0;
  double s_tv = 0.0;
  each([&](double t, double v) {
    s_tt += std::pow(t - sum_t / n, 2);
    s_tv += (t - sum_t / n) * (v - sum_v / n);
  });
  const double rate = s_tv / s_tt;
  double squares = 0.0;
  each([&](double t, double v) { squares += std::pow(v - sum_v / n - rate * (t - sum_t / n), 2); });
  const double rate_u = std::sqrt(squares / (n - 2.0) / s_tt);
  const SoakState state = log.state(window, 1e-6);
  EXPECT_NEAR(state.rate, rate, 1e-10);
  EXPECT_NEAR(state.rate_u, rate_u, 1e-10);
  // The state is steady if the trend plus its 95 % interval is within the tolerance.
  const double largest = std::abs(rate) + student_t_factor(0.95, n - 2.0) * rate_u;
  EXPECT_TRUE(log.state(window, 1.001 * largest * window).steady);
  EXPECT_FALSE(log.state(window, 0.999 * largest * window).steady);
}

// A log without a trend is not steady if its scatter is too large.
TEST(SoakOfAFlatLog, IsNotSteadyIfItScattersTooMuch) {
  RandomStream random(15);
  const auto scattered = [&](double sd) {
    return log_of(600.0, 60.0, [&](double) { return 20.0 + sd * random.normal(); });
  };
  EXPECT_FALSE(scattered(1.0).state(600.0, 0.2).steady);
  EXPECT_TRUE(scattered(0.01).state(600.0, 0.2).steady);
}

// After the remaining time the rate equals the limit.
TEST(SoakOfAnApproach, LastsAsLongAsTheExponentialSays) {
  constexpr double window = 120.0;
  constexpr double tolerance = 0.05;
  for (const double amplitude : {-35.0, 60.0}) {
    for (const double tau : {300.0, 900.0}) {
      const Log log =
          log_of(1.5 * tau, 2.0, [&](double t) { return 25.0 + amplitude * std::exp(-t / tau); });
      const SoakState state = log.state(window, tolerance);
      ASSERT_FALSE(state.steady);
      EXPECT_EQ(state.rate<0.0, amplitude> 0.0);
      const double expected = tau * std::log(std::abs(state.rate) * window / tolerance);
      EXPECT_NEAR(state.remaining_s, expected, 0.03 * expected);
    }
  }
}

TEST(SoakOfAnApproach, KnowsNoEndOfARateThatGrows) {
  const Log growing = log_of(600.0, 5.0, [](double t) { return std::exp(t / 200.0); });
  EXPECT_FALSE(growing.state(100.0, 0.01).steady);
  EXPECT_TRUE(std::isnan(growing.state(100.0, 0.01).remaining_s));
  const Log turning = log_of(600.0, 5.0, [](double t) { return 1e-3 * std::pow(t - 500.0, 2); });
  EXPECT_GT(turning.state(100.0, 0.01).rate, 0.0);
  EXPECT_TRUE(std::isnan(turning.state(100.0, 0.01).remaining_s));
}

// The zero of time and the unit of the temperature do not matter.
TEST(SoakOfAnApproach, DoesNotDependOnClockAndUnit) {
  const Log log = log_of(800.0, 5.0, [](double t) { return 50.0 - 30.0 * std::exp(-t / 400.0); });
  Log changed = log;
  for (std::size_t i = 0; i < log.time_s.size(); ++i) {
    changed.time_s[i] += 50000.0;
    changed.value[i] = 1.8 * log.value[i] + 32.0;
  }
  const SoakState one = log.state(150.0, 0.2);
  const SoakState other = changed.state(150.0, 1.8 * 0.2);
  EXPECT_EQ(one.steady, other.steady);
  EXPECT_NEAR(other.rate, 1.8 * one.rate, 1e-10);
  EXPECT_NEAR(other.rate_u, 1.8 * one.rate_u, 1e-10);
  EXPECT_NEAR(other.remaining_s, one.remaining_s, 1e-4);
}

TEST(SoakOfAShortLog, IsNotDecided) {
  const auto undecided = [](const SoakState& state) {
    return !state.steady && std::isnan(state.rate) && std::isnan(state.rate_u) &&
           std::isnan(state.remaining_s);
  };
  EXPECT_TRUE(undecided(Log().state(100.0, 1.0)));
  EXPECT_TRUE(undecided(log_of(40.0, 5.0, [](double) { return 20.0; }).state(100.0, 1.0)));
  EXPECT_TRUE(undecided(log_of(80.0, 80.0, [](double) { return 20.0; }).state(100.0, 1.0)));
  EXPECT_FALSE(undecided(log_of(80.0, 20.0, [](double) { return 20.0; }).state(100.0, 1.0)));
}

TEST(SoakOfAWrongLog, IsRefused) {
  const Log log = log_of(200.0, 10.0, [](double) { return 20.0; });
  EXPECT_THROW(static_cast<void>(log.state(0.0, 1.0)), DomainError);
  EXPECT_THROW(static_cast<void>(log.state(100.0, -1.0)), DomainError);
  EXPECT_THROW(static_cast<void>(log.state(100.0, std::numeric_limits<double>::quiet_NaN())),
               DomainError);
  Log backwards = log;
  std::swap(backwards.time_s[3], backwards.time_s[4]);
  EXPECT_THAT(
      test::complaint_of<DomainError>([&] { static_cast<void>(backwards.state(100.0, 1.0)); }),
      HasSubstr("ascending"));
  Log missing = log;
  missing.value.pop_back();
  EXPECT_THAT(
      test::complaint_of<DomainError>([&] { static_cast<void>(missing.state(100.0, 1.0)); }),
      HasSubstr("one temperature for each time"));
}

}  // namespace
}  // namespace axiscal
