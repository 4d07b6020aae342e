// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include <gmock/gmock.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "calib/record/linear_propagation.hpp"
#include "calib/record/parameter_names.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::ElementsAre;

// Student's t for 95 %, from tables.
constexpr double t_of_5 = 2.570582;
constexpr double t_of_10 = 2.228139;
constexpr double t_of_infinity = 1.959964;

Eigen::MatrixXd random_covariance(Eigen::Index size, RandomStream& random) {
  const Eigen::MatrixXd root =
      Eigen::MatrixXd::NullaryExpr(size, size + 2, [&] { return random.normal(); });
  return root * root.transpose() / static_cast<double>(size);
}

Eigen::RowVectorXd random_row(Eigen::Index size, RandomStream& random) {
  return Eigen::RowVectorXd::NullaryExpr(size, [&] { return random.normal(); });
}

// A record with these axes. Its covariance is from the readings, without correlation between axes.
Calibration record_of_axes(const std::vector<std::string>& axes, RandomStream& random) {
  const auto m = static_cast<Eigen::Index>(axes.size());
  Calibration record;
  record.sensor.instrument.axes = axes;
  record.sensor.response = {
      .bias = Eigen::VectorXd::NullaryExpr(m, [&] { return random.normal(); }),
      .sensitivity =
          SensitivityMatrix(Eigen::MatrixXd::NullaryExpr(m, 3, [&] { return random.normal(); }))};
  FitStatistics& statistics = record.fit.statistics.emplace();
  statistics.parameter_names = parameter_names(axes);
  statistics.covariance = Eigen::MatrixXd::Zero(4 * m, 4 * m);
  for (Eigen::Index k = 0; k < m; ++k) {
    statistics.covariance.block<4, 4>(4 * k, 4 * k) = random_covariance(4, random);
  }
  statistics.degrees_of_freedom = Eigen::VectorXd::LinSpaced(m, 8.0, 8.0 + static_cast<double>(m));
  return record;
}

double quadratic(const Eigen::RowVectorXd& gradient, const Eigen::MatrixXd& covariance) {
  return gradient * covariance * gradient.transpose();
}

// ---- names of parameters ----

TEST(ParameterNames, StandAxisByAxis) {
  EXPECT_THAT(
      parameter_names({"x", "lux"}),
      ElementsAre("x.bias", "x.sensitivity.x", "x.sensitivity.y", "x.sensitivity.z", "lux.bias",
                  "lux.sensitivity.x", "lux.sensitivity.y", "lux.sensitivity.z"));
  EXPECT_THAT(parameter_names({"w"}, {"gravity"}, 2),
              ElementsAre("w.bias", "w.sensitivity.x", "w.sensitivity.y", "w.sensitivity.z",
                          "w.gravity.x", "w.gravity.y", "w.gravity.z", "w.bias.d", "w.bias.d2",
                          "w.scale.d", "w.scale.d2"));
  EXPECT_TRUE(parameter_names({}).empty());
}

TEST(ParameterNames, OfSomeColumnsAreThoseOfAll) {
  const std::vector<std::string> axes = {"x", "y"};
  std::vector<Eigen::Index> all(10);
  std::iota(all.begin(), all.end(), 0);
  EXPECT_EQ(names_of_columns(axes, all, {"gravity", "light"}),
            parameter_names(axes, {"gravity", "light"}));
  EXPECT_THAT(
      names_of_columns(axes, {0, 9, 4}, {"gravity", "light"}),
      ElementsAre("x.bias", "x.light.z", "x.gravity.x", "y.bias", "y.light.z", "y.gravity.x"));
  EXPECT_TRUE(names_of_columns(axes, {}).empty());
}

TEST(ParameterNames, OfPowersHaveANumberFromTwoOn) {
  EXPECT_EQ(power_suffix(1), ".d");
  EXPECT_EQ(power_suffix(2), ".d2");
  EXPECT_EQ(power_suffix(11), ".d11");
  EXPECT_TRUE(temperature_suffixes(0).empty());
  EXPECT_THAT(temperature_suffixes(1), ElementsAre(".bias.d", ".scale.d"));
}

// Each number of the sensor has another value. By the parameters' names each number is found
// exactly once.
TEST(ParameterNames, FindEachNumberOfASensorOnce) {
  constexpr int order = 2;
  SensorModel sensor;
  sensor.instrument.axes = {"a", "ab"};
  double next = 1.0;
  sensor.response.bias.resize(2);
  sensor.response.sensitivity.resize(2, 3);
  sensor.also = {{.kind = "gravity"}, {.kind = "light"}};
  TemperatureResponse& terms = sensor.temperature.emplace();
  terms.bias.resize(2, order);
  terms.scale.resize(2, order);
  for (AlsoResponse& also : sensor.also) {
    also.sensitivity.resize(2, 3);
  }
  for (Eigen::Index k = 0; k < 2; ++k) {
    sensor.response.bias(k) = next++;
    for (Eigen::Index j = 0; j < 3; ++j) {
      sensor.response.sensitivity(k, j) = next++;
    }
    for (AlsoResponse& also : sensor.also) {
      for (Eigen::Index j = 0; j < 3; ++j) {
        also.sensitivity(k, j) = next++;
      }
    }
    for (Eigen::MatrixXd* of_terms : {&terms.bias, &terms.scale}) {
      for (Eigen::Index j = 0; j < order; ++j) {
        (*of_terms)(k, j) = next++;
      }
    }
  }
  double expected = 1.0;
  for (const std::string& name :
       parameter_names(sensor.instrument.axes, {"gravity", "light"}, order)) {
    EXPECT_EQ(parameter_value(sensor, name), expected) << name;
    expected += 1.0;
  }
  EXPECT_EQ(expected, next);
  for (const char* wrong : {"a", "a.", "a.bia", "a.bias.d3", "a.bias.d0", "a.sensitivity",
                            "a.sensitivity.w", "abc.bias", "a.sun.x", "", "a.scale"}) {
    EXPECT_THAT(
        test::complaint_of<DomainError>([&] { static_cast<void>(parameter_value(sensor, wrong)); }),
        testing::HasSubstr("is not a parameter"))
        << wrong;
  }
}

// ---- intervals ----

FitStatistics statistics_of_two_axes(RandomStream& random) {
  FitStatistics statistics;
  statistics.parameter_names = parameter_names({"x", "y"});
  statistics.covariance = random_covariance(8, random);
  statistics.degrees_of_freedom = Eigen::Vector2d(5.0, 10.0);
  return statistics;
}

TEST(ParameterIntervals, AreStudentsTOfEachAxis) {
  RandomStream random(21);
  FitStatistics statistics = statistics_of_two_axes(random);
  fill_intervals(statistics);
  ASSERT_EQ(statistics.interval_95.size(), 8);
  for (Eigen::Index i = 0; i < 8; ++i) {
    const double t = i < 4 ? t_of_5 : t_of_10;
    EXPECT_EQ(statistics.interval_dof(i), i < 4 ? 5.0 : 10.0);
    EXPECT_NEAR(statistics.interval_95(i), t * std::sqrt(statistics.covariance(i, i)), 1e-5);
  }
}

TEST(ParameterIntervals, StayIfTheyAreThere) {
  RandomStream random(22);
  FitStatistics statistics = statistics_of_two_axes(random);
  statistics.interval_dof = Eigen::VectorXd::Constant(8, 10.0);
  statistics.interval_95 = Eigen::VectorXd::Constant(8, 7.0);
  fill_intervals(statistics);
  EXPECT_EQ(statistics.interval_95, Eigen::VectorXd::Constant(8, 7.0));
  put_intervals(statistics);
  EXPECT_MATRIX_NEAR(statistics.interval_95, t_of_10 * statistics.covariance.diagonal().cwiseSqrt(),
                     1e-5);
}

// Degrees of freedom by Welch and Satterthwaite, for each parameter that the component affects.
TEST(ParameterIntervals, GrowWithAComponentOfTheScatter) {
  RandomStream random(23);
  FitStatistics statistics = statistics_of_two_axes(random);
  const Eigen::MatrixXd before = statistics.covariance;
  fill_intervals(statistics);
  const Eigen::VectorXd old_intervals = statistics.interval_95;
  ScatterComponent blocks{
      .name = "blocks", .covariance = Eigen::MatrixXd::Zero(8, 8), .degrees_of_freedom = 20.0};
  blocks.covariance(0, 0) = 0.7;
  blocks.covariance(4, 4) = 1.3;
  add_component(blocks, statistics);
  EXPECT_MATRIX_NEAR(statistics.covariance, before + blocks.covariance, 1e-15);
  EXPECT_MATRIX_NEAR(statistics.covariance_of_readings(), before, 1e-14);
  ASSERT_EQ(statistics.components.size(), 1U);
  EXPECT_EQ(statistics.components.front().name, "blocks");
  for (Eigen::Index i = 0; i < 8; ++i) {
    const double more = blocks.covariance(i, i);
    if (more == 0.0) {
      EXPECT_EQ(statistics.interval_95(i), old_intervals(i)) << i;
      EXPECT_EQ(statistics.interval_dof(i), i < 4 ? 5.0 : 10.0) << i;
      continue;
    }
    const double own = before(i, i);
    const double nu =
        std::pow(own + more, 2) / (own * own / (i < 4 ? 5.0 : 10.0) + more * more / 20.0);
    EXPECT_NEAR(statistics.interval_dof(i), nu, 1e-9 * nu) << i;
    EXPECT_GT(statistics.interval_95(i), old_intervals(i)) << i;
  }
}

// Each standard error is stored with its parameter, for a record with all kinds of parameters.
TEST(ParameterIntervals, PutEachStandardErrorInItsPlace) {
  RandomStream random(24);
  Calibration record = record_of_axes({"x", "y"}, random);
  constexpr Eigen::Index p = 4 + 3 + 2 * 2;
  record.sensor.also = {{.kind = "gravity",
                         .sensitivity = SensitivityMatrix::Zero(2, 3),
                         .sensitivity_se = SensitivityMatrix::Zero(2, 3)}};
  record.sensor.temperature = TemperatureResponse{.bias = Eigen::MatrixXd::Zero(2, 2),
                                                  .scale = Eigen::MatrixXd::Zero(2, 2),
                                                  .bias_se = Eigen::MatrixXd::Zero(2, 2),
                                                  .scale_se = Eigen::MatrixXd::Zero(2, 2)};
  FitStatistics& statistics = *record.fit.statistics;
  // The variance of parameter i is (i + 1)^2, so each standard error identifies its parameter.
  statistics.covariance = Eigen::VectorXd::LinSpaced(2 * p, 1.0, 2.0 * p).cwiseAbs2().asDiagonal();
  statistics.degrees_of_freedom = Eigen::Vector2d(5.0, 10.0);
  add_intervals(record);
  ASSERT_EQ(statistics.parameter_names.size(), static_cast<std::size_t>(2 * p));
  const auto place = [&](const std::string& name) {
    return static_cast<double>(*statistics.position_of(name)) + 1.0;
  };
  for (Eigen::Index k = 0; k < 2; ++k) {
    const std::string axis(1, "xy"[k]);
    EXPECT_DOUBLE_EQ(statistics.bias_se(k), place(axis + ".bias"));
    for (Eigen::Index j = 0; j < 3; ++j) {
      const std::string component(1, "xyz"[j]);
      EXPECT_DOUBLE_EQ(statistics.sensitivity_se(k, j), place(axis + ".sensitivity." + component));
      EXPECT_DOUBLE_EQ(record.sensor.also[0].sensitivity_se(k, j),
                       place(axis + ".gravity." + component));
    }
    for (int j = 0; j < 2; ++j) {
      EXPECT_DOUBLE_EQ(record.sensor.temperature->bias_se(k, j),
                       place(axis + ".bias" + power_suffix(j + 1)));
      EXPECT_DOUBLE_EQ(record.sensor.temperature->scale_se(k, j),
                       place(axis + ".scale" + power_suffix(j + 1)));
    }
    EXPECT_NEAR(statistics.coverage_factor(k), k == 0 ? t_of_5 : t_of_10, 1e-6);
  }
  EXPECT_NEAR(statistics.interval_95(2 * p - 1), t_of_10 * 2.0 * p, 1e-4);
}

// ---- linear functions of the parameters ----

TEST(InheritedScatter, IsTheSumOverTheAxes) {
  RandomStream random(31);
  const Calibration record = record_of_axes({"x", "y", "z"}, random);
  const LinearPropagation inheritance(record);
  for (int i = 0; i < 10; ++i) {
    const Eigen::RowVectorXd gradient = random_row(12, random);
    const VarianceShares shares = inheritance.scatter(gradient);
    ASSERT_EQ(shares.axes.size(), 3U);
    EXPECT_TRUE(shares.components.empty());
    EXPECT_EQ(shares.others, 0.0);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto at = 4 * static_cast<Eigen::Index>(k);
      const Eigen::RowVectorXd own = gradient.segment<4>(at);
      const double expected = quadratic(own, record.fit.statistics->covariance.block<4, 4>(at, at));
      EXPECT_NEAR(shares.axes[k].variance, expected, 1e-12 * expected);
      EXPECT_EQ(shares.axes[k].degrees_of_freedom,
                record.fit.statistics->degrees_of_freedom(static_cast<Eigen::Index>(k)));
    }
  }
}

// Method joint: the part of the variance that axes share by the direction is divided between the
// axes in proportion.
TEST(InheritedScatter, DividesWhatTheAxesShareInProportion) {
  RandomStream random(32);
  Calibration record = record_of_axes({"x", "y", "z"}, random);
  Eigen::MatrixXd& C = record.fit.statistics->covariance;
  const Eigen::RowVectorXd shared = random_row(12, random);
  C += shared.transpose() * shared;
  const LinearPropagation inheritance(record);
  const Eigen::RowVectorXd gradient = random_row(12, random);
  const VarianceShares shares = inheritance.scatter(gradient);
  Eigen::Vector3d own;
  for (Eigen::Index k = 0; k < 3; ++k) {
    own(k) = quadratic(gradient.segment<4>(4 * k), C.block<4, 4>(4 * k, 4 * k));
  }
  const double all = quadratic(gradient, C);
  double sum = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    sum += shares.axes[k].variance;
    EXPECT_NEAR(shares.axes[k].variance, all * own(static_cast<Eigen::Index>(k)) / own.sum(),
                1e-12 * all);
  }
  EXPECT_NEAR(sum, all, 1e-12 * all);
}

TEST(InheritedScatter, GrowsWithTheSquareOfTheGradient) {
  RandomStream random(33);
  const Calibration record = record_of_axes({"x", "y"}, random);
  const LinearPropagation inheritance(record);
  const Eigen::RowVectorXd gradient = random_row(8, random);
  const VarianceShares one = inheritance.scatter(gradient);
  const VarianceShares three = inheritance.scatter(-3.0 * gradient);
  const VarianceShares none = inheritance.scatter(Eigen::RowVectorXd::Zero(8));
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_NEAR(three.axes[k].variance, 9.0 * one.axes[k].variance, 1e-12);
    EXPECT_EQ(none.axes[k].variance, 0.0);
  }
}

// Axes are separate although the name of one is the beginning of another's.
TEST(InheritedScatter, KeepsAxesApartWhoseNamesBeginAlike) {
  RandomStream random(34);
  const Calibration record = record_of_axes({"a", "ax", "ax1"}, random);
  const LinearPropagation inheritance(record);
  for (Eigen::Index k = 0; k < 3; ++k) {
    Eigen::RowVectorXd gradient = Eigen::RowVectorXd::Zero(12);
    gradient.segment<4>(4 * k) = random_row(4, random);
    const VarianceShares shares = inheritance.scatter(gradient);
    for (Eigen::Index j = 0; j < 3; ++j) {
      const double variance = shares.axes[static_cast<std::size_t>(j)].variance;
      EXPECT_TRUE(j == k ? variance > 0.0 : variance == 0.0) << k << ' ' << j;
    }
  }
}

// The result does not depend on the order of the axes.
TEST(InheritedScatter, TurnsWithTheOrderOfTheAxes) {
  RandomStream random(35);
  const Calibration record = record_of_axes({"x", "y", "z"}, random);
  const std::vector<std::size_t> order = {2, 0, 1};
  Calibration turned = record;
  std::vector<Eigen::Index> places;
  for (std::size_t k = 0; k < 3; ++k) {
    turned.sensor.instrument.axes[k] = record.sensor.instrument.axes[order[k]];
    for (Eigen::Index j = 0; j < 4; ++j) {
      places.push_back(4 * static_cast<Eigen::Index>(order[k]) + j);
    }
    turned.fit.statistics->degrees_of_freedom(static_cast<Eigen::Index>(k)) =
        record.fit.statistics->degrees_of_freedom(static_cast<Eigen::Index>(order[k]));
  }
  turned.fit.statistics->covariance = record.fit.statistics->covariance(places, places).eval();
  turned.fit.statistics->parameter_names = parameter_names(turned.sensor.instrument.axes);
  const Eigen::RowVectorXd gradient = random_row(12, random);
  const Eigen::RowVectorXd of_turned = gradient(places);
  const VarianceShares one = LinearPropagation(record).scatter(gradient);
  const VarianceShares other = LinearPropagation(turned).scatter(of_turned);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(other.axes[k].variance, one.axes[order[k]].variance, 1e-13);
    EXPECT_EQ(other.axes[k].degrees_of_freedom, one.axes[order[k]].degrees_of_freedom);
  }
  EXPECT_NEAR(propagate(record, gradient).expanded, propagate(turned, of_turned).expanded, 1e-12);
}

// ---- all sources ----

// Adds a component of the scatter and two stated inputs to a record of two axes.
Calibration record_with_sources(RandomStream& random) {
  Calibration record = record_of_axes({"x", "y"}, random);
  add_component(
      {.name = "blocks", .covariance = random_covariance(8, random), .degrees_of_freedom = 6.0},
      *record.fit.statistics);
  record.fit.uncertainty.emplace().sources = {
      {.name = "positioner", .type = "B", .covariance = random_covariance(8, random)},
      {.name = "fit", .type = "A"},
      {.name = "mount", .type = "B", .covariance = random_covariance(8, random)}};
  return record;
}

TEST(InheritedUncertainty, WithoutABudgetIsTheFits) {
  RandomStream random(41);
  const Calibration record = record_of_axes({"x", "y"}, random);
  const Eigen::RowVectorXd gradient = random_row(8, random);
  std::vector<double> by_source;
  const VarianceShares shares = LinearPropagation(record).all(gradient, by_source);
  ASSERT_EQ(by_source.size(), 1U);
  EXPECT_NEAR(by_source[0], std::sqrt(quadratic(gradient, record.fit.statistics->covariance)),
              1e-12);
  EXPECT_EQ(shares.others, 0.0);
}

TEST(InheritedUncertainty, HasEachSourceInItsOrder) {
  RandomStream random(42);
  const Calibration record = record_with_sources(random);
  const auto& sources = record.fit.uncertainty->sources;
  const LinearPropagation inheritance(record);
  for (int i = 0; i < 5; ++i) {
    const Eigen::RowVectorXd gradient = random_row(8, random);
    std::vector<double> by_source;
    const VarianceShares shares = inheritance.all(gradient, by_source);
    ASSERT_EQ(by_source.size(), 3U);
    const double positioner = quadratic(gradient, sources[0].covariance);
    const double mount = quadratic(gradient, sources[2].covariance);
    const double fit = quadratic(gradient, record.fit.statistics->covariance);
    EXPECT_NEAR(by_source[0], std::sqrt(positioner), 1e-12);
    EXPECT_NEAR(by_source[1], std::sqrt(fit), 1e-12);
    EXPECT_NEAR(by_source[2], std::sqrt(mount), 1e-12);
    EXPECT_NEAR(shares.others, positioner + mount, 1e-12);
    ASSERT_EQ(shares.components.size(), 1U);
    EXPECT_EQ(shares.components[0].degrees_of_freedom, 6.0);
    EXPECT_NEAR(shares.components[0].variance,
                quadratic(gradient, record.fit.statistics->components[0].covariance), 1e-12);
  }
}

// The combined variance is that of the sum of the covariances of all sources.
TEST(InheritedUncertainty, IsTheCovarianceOfAllSourcesTogether) {
  RandomStream random(43);
  const Calibration record = record_with_sources(random);
  const auto& sources = record.fit.uncertainty->sources;
  const Eigen::MatrixXd all =
      record.fit.statistics->covariance + sources[0].covariance + sources[2].covariance;
  EXPECT_MATRIX_NEAR(parameter_covariance(record), all, 1e-14);
  for (int i = 0; i < 5; ++i) {
    const Eigen::RowVectorXd gradient = random_row(8, random);
    VarianceShares shares;
    const CombinedUncertainty combined = propagate(record, gradient, &shares);
    EXPECT_NEAR(combined.u * combined.u, quadratic(gradient, all), 1e-11);
    EXPECT_NEAR(combined.coverage_factor, combined.expanded / combined.u, 1e-12);
    EXPECT_EQ(shares.axes.size(), 2U);
    EXPECT_GE(combined.coverage_factor, t_of_infinity);
  }
}

// The standard uncertainty of a linear function is its spread for random parameters.
TEST(InheritedUncertainty, IsTheSpreadOfDrawnParameters) {
  RandomStream random(44);
  const Calibration record = record_with_sources(random);
  const Eigen::MatrixXd root = Eigen::LLT<Eigen::MatrixXd>(parameter_covariance(record)).matrixL();
  const Eigen::RowVectorXd gradient = random_row(8, random);
  constexpr int trials = 20000;
  double squares = 0.0;
  for (int i = 0; i < trials; ++i) {
    squares += std::pow(gradient.dot(root * random.normals<8>()), 2);
  }
  EXPECT_NEAR(std::sqrt(squares / trials) / propagate(record, gradient).u, 1.0, 0.02);
}

TEST(InheritedUncertainty, OfOneParameterIsThatOfTheRecord) {
  RandomStream random(45);
  const Calibration record = record_with_sources(random);
  const std::vector<ParameterUncertainty> all = parameter_uncertainties(record);
  ASSERT_EQ(all.size(), 8U);
  for (Eigen::Index i = 0; i < 8; ++i) {
    const ParameterUncertainty& one = all[static_cast<std::size_t>(i)];
    const CombinedUncertainty expected = propagate(record, Eigen::RowVectorXd::Unit(8, i));
    EXPECT_EQ(one.name, record.fit.statistics->parameter_names[static_cast<std::size_t>(i)]);
    EXPECT_NEAR(one.uncertainty.u, expected.u, 1e-12);
    EXPECT_THAT(one.uncertainty.by_source,
                testing::Pointwise(testing::DoubleNear(1e-12), expected.by_source));
    // The interval of the fit and the combination of the shares nearly agree.
    EXPECT_NEAR(one.uncertainty.expanded / expected.expanded, 1.0, 0.02) << one.name;
    const Quantity quantity = record.parameter(one.name);
    EXPECT_EQ(quantity.U, one.uncertainty.expanded);
    EXPECT_EQ(quantity.value, parameter_value(record.sensor, one.name));
  }
}

// If all sources are stated inputs, the factor is that of a normal distribution; if all are
// scatter, Student's.
TEST(InheritedUncertainty, HasTheFactorOfItsSources) {
  RandomStream random(46);
  Calibration record = record_of_axes({"x"}, random);
  record.fit.statistics->degrees_of_freedom = Eigen::VectorXd::Constant(1, 10.0);
  const Eigen::RowVectorXd gradient = random_row(4, random);
  EXPECT_NEAR(propagate(record, gradient).coverage_factor, t_of_10, 1e-6);
  record.fit.uncertainty.emplace().sources = {
      {.name = "fit", .type = "A"},
      {.name = "mount", .type = "B", .covariance = 1e8 * Eigen::Matrix4d::Identity()}};
  EXPECT_NEAR(propagate(record, gradient).coverage_factor, t_of_infinity, 1e-5);
}

TEST(InheritedUncertainty, IsNotThereWithoutStatistics) {
  RandomStream random(47);
  Calibration record = record_of_axes({"x"}, random);
  EXPECT_TRUE(states_uncertainty(record));
  record.fit.statistics->degrees_of_freedom.setZero();
  EXPECT_FALSE(states_uncertainty(record));
  record.fit.statistics.reset();
  EXPECT_EQ(parameter_covariance(record).size(), 0);
  EXPECT_TRUE(parameter_uncertainties(record).empty());
  EXPECT_TRUE(std::isnan(record.parameter("x.bias").U));
  EXPECT_THROW(static_cast<void>(record.parameter("w.bias")), DomainError);
}

TEST(VarianceSharesSum, AppendsIndependentParts) {
  VarianceShares one{.axes = {{.variance = 1.0, .degrees_of_freedom = 7.0}}, .others = 2.0};
  const VarianceShares other{.axes = {{.variance = 3.0, .degrees_of_freedom = 9.0}},
                             .components = {{.variance = 5.0, .degrees_of_freedom = 11.0}},
                             .others = 4.0};
  one += other;
  EXPECT_EQ(one.axes.size(), 2U);
  EXPECT_EQ(one.components.size(), 1U);
  EXPECT_NEAR(combine(one).u, std::sqrt(15.0), 1e-15);
  EXPECT_NEAR(welch_degrees_of_freedom(one), 225.0 / (1.0 / 7.0 + 9.0 / 9.0 + 25.0 / 11.0), 1e-10);
  EXPECT_TRUE(std::isinf(welch_degrees_of_freedom({.others = 1.0})));
}

// The tabulated factors agree with known quantiles and with combine().
TEST(FactorsOfCoverage, AreStudentsT) {
  const CoverageFactors factors;
  EXPECT_NEAR(factors.at(1.0), 12.7062, 0.05);
  EXPECT_NEAR(factors.at(7.0), 2.364624, 0.01);
  EXPECT_NEAR(factors.at(12.0), 2.178813, 0.009);
  EXPECT_NEAR(factors.at(std::numeric_limits<double>::infinity()), t_of_infinity, 1e-4);
  EXPECT_EQ(factors.at(0.1), factors.at(1.0));
  EXPECT_TRUE(std::isnan(factors.at(std::numeric_limits<double>::quiet_NaN())));
  EXPECT_NEAR(CoverageFactors(0.99).at(10.0), 3.169273, 0.013);
  for (const double nu : {2.0, 5.0, 9.0, 30.0}) {
    const VarianceShares shares{.axes = {{.variance = 2.0, .degrees_of_freedom = nu}},
                                .others = 0.5};
    EXPECT_NEAR(factors.expanded(shares) / combine(shares).expanded, 1.0, 5e-3) << nu;
  }
  EXPECT_THROW(CoverageFactors(0.0), DomainError);
  EXPECT_THROW(CoverageFactors(1.0), DomainError);
}

}  // namespace
}  // namespace axiscal
