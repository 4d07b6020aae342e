// SPDX-License-Identifier: Apache-2.0
// Temperature terms, compared with an explicit Gauss-Newton fit, and the choice of their order.
#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <gmock/gmock.h>

#include "axiscal/calib/simulate.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "calib/fit/estimate_by_method.hpp"
#include "calib/fit/temperature_fit.hpp"
#include "labelled_set.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

constexpr double warm_noise = 1e-4;

// Readings at the 24 points at each temperature. `differences` are from the reference temperature.
ReadingSet warm_set(const std::vector<double>& differences,
                    int order,
                    double noise_sd,
                    std::uint64_t seed = 1) {
  std::vector<DesignEntry> design;
  for (std::size_t t = 0; t < differences.size(); ++t) {
    for (const DesignEntry& entry : standard_design(24)) {
      design.push_back(entry);
    }
  }
  ReadingSet set = test::labelled_set(
      test::some_response(), test::gravity_in_table(test::sloping_gravity), design, noise_sd, seed);
  set.temperature.order = order;
  set.temperature.d.resize(set.size(), 3);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    set.temperature.d.row(i).setConstant(differences[static_cast<std::size_t>(i / 24)]);
    set.readings[static_cast<std::size_t>(i)].block = 1 + static_cast<int>(i / 24);
  }
  return set;
}

// Changes of bias and scale of each axis per degree.
const Eigen::Vector3d bias_slope(1e-3, -2e-3, 3e-3);
const Eigen::Vector3d scale_slope(2e-3, 1e-3, -3e-3);

ReadingSet warmed(ReadingSet set) {
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double d = set.temperature.d(i, k);
      const double b = test::some_response().bias(k);
      set.response(i, k) =
          b + bias_slope(k) * d + (1.0 + scale_slope(k) * d) * (set.response(i, k) - b);
    }
  }
  return set;
}

// Vector (b, S, b1, c) of an axis by Gauss-Newton on v = b + b1 d + (1 + c d) S f.
Eigen::VectorXd direct_fit(const ReadingSet& set, Eigen::Index axis) {
  const Eigen::MatrixXd F = test::rows_of(set, test::sloping_gravity).rightCols<3>();
  const Eigen::VectorXd d = set.temperature.d.col(axis);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(6);
  x.segment<3>(1) = 1.8 * Eigen::Vector3d::Unit(axis);
  for (int round = 0; round < 50; ++round) {
    const Eigen::VectorXd sensed = F * x.segment<3>(1);
    const Eigen::VectorXd scale = (1.0 + x(5) * d.array()).matrix();
    Eigen::MatrixXd J(set.size(), 6);
    J << Eigen::VectorXd::Ones(set.size()), scale.asDiagonal() * F, d, d.cwiseProduct(sensed);
    const Eigen::VectorXd model = x(0) + (x(4) * d + scale.cwiseProduct(sensed)).array();
    x += J.colPivHouseholderQr().solve(set.response.col(axis) - model);
  }
  return x;
}

TEST(FitOverTemperature, AgreeWithADirectFit) {
  const ReadingSet set = warmed(warm_set({-20.0, 5.0, 15.0}, 1, warm_noise));
  const Estimate estimate = estimate_by(Method::known, set, false);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::VectorXd x = direct_fit(set, k);
    EXPECT_NEAR(estimate.response.bias(k), x(0), 1e-10);
    EXPECT_MATRIX_NEAR(Eigen::Vector3d(estimate.response.sensitivity.row(k)),
                       Eigen::Vector3d(x.segment<3>(1)), 1e-9);
    EXPECT_NEAR(estimate.temperature.bias(k, 0), x(4), 1e-11);
    EXPECT_NEAR(estimate.temperature.scale(k, 0), x(5), 1e-10);
    EXPECT_EQ(estimate.statistics.degrees_of_freedom(k), 72.0 - 6.0);
  }
}

TEST(FitOverTemperature, AreExactByEveryMethodWithoutNoise) {
  const ReadingSet set = warmed(warm_set({-20.0, 5.0, 15.0}, 1, 0.0));
  for (const Method method : {Method::known, Method::joint, Method::paired}) {
    const Estimate estimate = estimate_by(method, set, false);
    EXPECT_MATRIX_NEAR(estimate.response.sensitivity, test::some_response().sensitivity, 1e-8);
    EXPECT_MATRIX_NEAR(estimate.temperature.bias, bias_slope, 1e-9);
    EXPECT_MATRIX_NEAR(estimate.temperature.scale, scale_slope, 1e-9);
    // Readings reduced to the reference temperature are those of the response without temperature
    // terms.
    const ReadingSet at_mean = at_reference(set, estimate);
    for (Eigen::Index i = 0; i < set.size(); i += 7) {
      const Eigen::VectorXd plain = test::some_response().at(
          set.rotation_sensor_from_table[static_cast<std::size_t>(i)] * test::sloping_gravity);
      EXPECT_MATRIX_NEAR(Eigen::VectorXd(at_mean.response.row(i)), plain, 1e-8);
    }
  }
}

// Another unit of the temperature changes the terms per degree and nothing else.
TEST(FitOverTemperature, FollowTheUnitOfTheTemperature) {
  const ReadingSet set = warmed(warm_set({-20.0, 5.0, 15.0}, 1, warm_noise));
  ReadingSet other = set;
  other.temperature.d *= 1.8;
  const Estimate a = estimate_by(Method::joint, set, false);
  const Estimate b = estimate_by(Method::joint, other, false);
  EXPECT_MATRIX_NEAR(b.response.sensitivity, a.response.sensitivity, 1e-8);
  EXPECT_MATRIX_NEAR(1.8 * b.temperature.bias, a.temperature.bias, 1e-10);
  EXPECT_MATRIX_NEAR(1.8 * b.temperature.scale, a.temperature.scale, 1e-10);
}

// Axis z has a separate sensor, which reads 3 + 2 d instead of d.
TEST(FitOverTemperature, GoByTheSensorOfEachAxis) {
  ReadingSet set = warm_set({-20.0, 5.0, 15.0}, 1, 0.0);
  set.temperature.d.col(2) = (2.0 * set.temperature.d.col(2).array() + 3.0).matrix();
  const Estimate estimate = estimate_by(Method::known, warmed(set), false);
  EXPECT_MATRIX_NEAR(estimate.temperature.bias, bias_slope, 1e-9);
  EXPECT_MATRIX_NEAR(estimate.temperature.scale, scale_slope, 1e-9);
  EXPECT_MATRIX_NEAR(estimate.response.bias, test::some_response().bias, 1e-9);
}

TEST(TemperatureCount, IsOfSoaksOrOfDifferentTemperatures) {
  ReadingSet set = warm_set({-20.0, 5.0, 15.0}, 1, 0.0);
  EXPECT_EQ(temperature_count(set), 3);
  set.temperature.d(0, 0) += 0.3;
  EXPECT_EQ(temperature_count(set), 4);
  set.temperature.soak.assign(72, 0);
  set.temperature.soak[5] = 1;
  EXPECT_EQ(temperature_count(set), 2);
}

TEST(StartedOverTemperature, StartsWithoutScale) {
  const ReadingSet set = warmed(warm_set({-20.0, 5.0, 15.0}, 2, 0.0));
  ReadingSet without = set;
  without.temperature = {};
  const Estimate estimate = estimate_known(without, test::gravity_in_table(test::sloping_gravity));
  const ReadingSet started = initialize_temperature_terms(set, estimate);
  EXPECT_MATRIX_NEAR(started.temperature.scale, Eigen::MatrixXd::Zero(3, 2), 0.0);
  EXPECT_MATRIX_NEAR(started.temperature.along, estimate.response.sensitivity, 0.0);
  EXPECT_MATRIX_NEAR(started.response, set.response, 0.0);
}

std::string refusal_over_temperature(const ReadingSet& set,
                                     std::vector<std::string>* names = nullptr) {
  try {
    static_cast<void>(estimate_by(Method::known, set, false));
  } catch (const RankDeficientError& error) {
    if (names != nullptr) {
      *names = error.undetermined();
    }
    return error.what();
  }
  return "accepted";
}

TEST(StartedOverTemperature, NamesTheTermsThatTooFewTemperaturesLeaveOpen) {
  std::vector<std::string> names;
  EXPECT_THAT(refusal_over_temperature(warm_set({-10.0, 10.0}, 2, warm_noise), &names),
              HasSubstr("readings at 2 temperatures do not determine"));
  EXPECT_THAT(names, testing::ElementsAre("x.bias.d2", "x.scale.d2", "y.bias.d2", "y.scale.d2",
                                          "z.bias.d2", "z.scale.d2"));
  const std::string one = refusal_over_temperature(warm_set({4.0, 4.0}, 1, warm_noise), &names);
  EXPECT_THAT(one, HasSubstr("readings at 1 temperature do not determine"));
  EXPECT_THAT(one, HasSubstr("or use temperature order 0"));
  EXPECT_EQ(names.size(), 6U);
}

// At the warm temperature the cube has one pose only, so changes of bias and scale cannot be
// separated.
TEST(StartedOverTemperature, AsksForBothSignsAtEachTemperature) {
  ReadingSet set = warm_set({0.0}, 1, warm_noise);
  for (const Eigen::Index i : {3, 4}) {
    set.temperature.d.row(i).setConstant(20.0);
  }
  const Eigen::Matrix3d same = set.rotation_sensor_from_table[3];
  set.rotation_sensor_from_table.put(4, same);
  set.response.row(4) = set.response.row(3);
  std::vector<std::string> names;
  EXPECT_THAT(refusal_over_temperature(set, &names), HasSubstr("each axis up and down"));
  EXPECT_THAT(names, testing::IsSupersetOf({"x.bias.d", "x.scale.d", "z.bias.d", "z.scale.d"}));
  EXPECT_THAT(names, testing::Not(testing::Contains("x.sensitivity.x")));
}

// ---- the order ----

// AICc = n ln(RSS / n) + 2 K + 2 K (K + 1) / (n - K - 1). K includes the variance.
TEST(AxisAicc, IsAkaikesCriterion) {
  for (const double n : {10.0, 24.0, 100.0}) {
    for (const double p : {1.0, 4.0, 6.0}) {
      const double rss = 0.37;
      const double K = p + 1.0;
      const double expected = n * std::log(rss / n) + 2.0 * K + 2.0 * K * (K + 1.0) / (n - K - 1.0);
      EXPECT_NEAR(axis_aicc(std::sqrt(rss / (n - p)), n - p, p), expected, 1e-10);
    }
  }
}

TEST(AxisAicc, IsInfiniteForTooFewReadings) {
  EXPECT_TRUE(std::isinf(axis_aicc(0.1, 2.0, 4.0)));
  EXPECT_TRUE(std::isfinite(axis_aicc(0.1, 3.0, 4.0)));
}

// Another unit of the readings adds the same constant to AICc for all orders.
TEST(AxisAicc, ComparesOrdersInAnyUnit) {
  const double difference = axis_aicc(0.2, 20.0, 4.0) - axis_aicc(0.15, 18.0, 6.0);
  EXPECT_NEAR(axis_aicc(200.0, 20.0, 4.0) - axis_aicc(150.0, 18.0, 6.0), difference, 1e-9);
}

TEST(TrialOf, AddsTheAxesUp) {
  const ReadingSet set = warmed(warm_set({-20.0, 5.0, 15.0}, 1, warm_noise));
  const Estimate estimate = estimate_by(Method::known, set, false);
  const TemperatureOrderTrial trial = trial_of(set, estimate);
  EXPECT_EQ(trial.order, 1);
  double sum = 0.0;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double rss = 66.0 * std::pow(estimate.statistics.residual_sd(k), 2);
    sum += 72.0 * std::log(rss / 72.0) + 2.0 * 7.0 * 72.0 / (72.0 - 8.0);
  }
  EXPECT_NEAR(trial.aicc, sum, 1e-8);
}

std::vector<TemperatureOrderTrial> trials_of(const std::vector<double>& aicc,
                                             const std::vector<double>& p) {
  std::vector<TemperatureOrderTrial> trials;
  for (std::size_t i = 0; i < aicc.size(); ++i) {
    trials.push_back({.order = static_cast<int>(i), .aicc = aicc[i], .lack_of_fit_p_value = p[i]});
  }
  return trials;
}

TEST(ChosenOrder, IsTheOneOfLeastAicc) {
  EXPECT_EQ(chosen_order(trials_of({-10.0, -30.0, -20.0}, {0.5, 0.5, 0.5})), 1);
  EXPECT_EQ(chosen_order(trials_of({-10.0}, {0.0})), 0);
  // If two orders have equal AICc, the lower order is chosen.
  EXPECT_EQ(chosen_order(trials_of({-10.0, -10.0}, {0.5, 0.5})), 0);
}

TEST(ChosenOrder, GoesOnWhileTheNextMendsALackOfFit) {
  EXPECT_EQ(chosen_order(trials_of({-10.0, -30.0, -20.0}, {0.0, 1e-4, 0.4})), 2);
  // The next order does not remove the lack of fit.
  EXPECT_EQ(chosen_order(trials_of({-10.0, -30.0, -20.0}, {0.0, 1e-4, 5e-4})), 1);
  // Without a p value the lack of fit is unknown.
  EXPECT_EQ(chosen_order(trials_of({-10.0, -30.0, -20.0}, {0.0, not_a_number, 0.4})), 1);
}

class OrdersOfARun : public testing::Test {
 protected:
  // @param bend  coefficient of d^2 in the biases.
  [[nodiscard]] std::vector<TemperatureOrderTrial> trials(const std::vector<double>& temperatures,
                                                          double bend) const {
    SensorModel truth = test::accelerometer_truth();
    TemperatureResponse& terms = truth.temperature.emplace();
    terms.spans = {{.reference = 20.0, .low = 0.0, .high = 40.0}};
    terms.bias.setConstant(3, 2, bend);
    terms.bias.col(0).setConstant(1e-3);
    terms.scale.setZero(3, 2);
    const Observations observations =
        simulate(truth, make_run_sheet(standard_design(24), 1, 2, temperatures),
                 {.noise_sd = warm_noise, .seed = 2});
    const Experiment experiment = test::experiment_for(truth);
    const ReadingSource source(experiment, observations, Weighting::none, false);
    std::vector<FieldDescription> parts = resolve_field(experiment);
    parts[0].in_table = Eigen::Vector3d::UnitZ();
    return try_orders(Method::known, source, parts, false);
  }
};

TEST_F(OrdersOfARun, GoAsFarAsTheTemperatures) {
  EXPECT_EQ(trials({20.0, 20.0}, 0.0).size(), 1U);
  EXPECT_EQ(trials({10.0, 30.0}, 0.0).size(), 2U);
  EXPECT_EQ(trials({0.0, 10.0, 30.0, 40.0}, 0.0).size(), 3U);
}

TEST_F(OrdersOfARun, ShowThePolynomialThatIsThere) {
  EXPECT_EQ(chosen_order(trials({0.0, 10.0, 30.0, 40.0}, 0.0)), 1);
  EXPECT_EQ(chosen_order(trials({0.0, 10.0, 30.0, 40.0}, 1e-5)), 2);
}

}  // namespace
}  // namespace axiscal
