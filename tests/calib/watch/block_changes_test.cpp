// SPDX-License-Identifier: Apache-2.0
// Records of several blocks, compared with closed formulas for few degrees of freedom and with
// random records.
#include "calib/watch/src/block_changes.hpp"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>

#include "axiscal/calib/drift_check.hpp"
#include "axiscal/core/random.hpp"
#include "calib/record/parameter_names.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

constexpr double u_within = 1e-3;        // of each parameter, from the readings
constexpr double nu_of_readings = 30.0;  // degrees of freedom of each axis

// P(|T| > t) for an even number of degrees of freedom (Abramowitz & Stegun, 26.7.4).
double even_t_p(double t, int nu) {
  const double cosine_squared = nu / (nu + t * t);
  double term = 1.0;
  double sum = 1.0;
  for (int i = 2; i < nu; i += 2) {
    term *= cosine_squared * (i - 1.0) / i;
    sum += term;
  }
  return 1.0 - std::sqrt(1.0 - cosine_squared) * sum;
}

// Fisher's method for three probabilities: P(chi^2(6) > -2 sum ln p).
double fisher_of_three(double p1, double p2, double p3) {
  const double y = -std::log(p1) - std::log(p2) - std::log(p3);
  return std::exp(-y) * (1.0 + y + 0.5 * y * y);
}

// A record of m axes with the identity as sensitivity. The biases scatter between blocks.
Calibration record_in_blocks(Eigen::Index m, int blocks, double mean_square) {
  Calibration record;
  record.sensor.instrument.kind = "generic";
  record.sensor.instrument.axes.resize(static_cast<std::size_t>(m));
  record.sensor.field = {.kind = "gravity", .unit = "g", .magnitude = 1.0};
  record.sensor.response = {.bias = Eigen::VectorXd::Zero(m),
                            .sensitivity = Eigen::MatrixXd::Identity(m, 3)};
  FitStatistics statistics;
  statistics.parameter_names = parameter_names(record.sensor.instrument.axes);
  statistics.covariance = u_within * u_within * Eigen::MatrixXd::Identity(4 * m, 4 * m);
  statistics.degrees_of_freedom = Eigen::VectorXd::Constant(m, nu_of_readings);
  statistics.residual_sd = Eigen::VectorXd::Constant(m, 3.0 * u_within);
  record.fit.statistics = statistics;
  record.fit.conditions.blocks = blocks;
  if (blocks > 1) {
    record.fit.conditions.block_mean_square = Eigen::VectorXd::Constant(m, mean_square);
    record.fit.conditions.block_degrees_of_freedom = blocks - 1.0;
  }
  return record;
}

double p_of(const Calibration& old, const Calibration& fresh) {
  std::vector<std::string> notes;
  return p_of_block_changes(old, fresh, notes).value();
}

TEST(ScatterOfBlocks, IsThatOfTheParameter) {
  Calibration record = record_in_blocks(3, 4, 0.25);
  record.fit.conditions.block_mean_square(2) = 0.75;
  record.fit.conditions.sensitivity_mean_square = Eigen::MatrixXd::Zero(3, 3);
  record.fit.conditions.sensitivity_mean_square(1, 2) = 0.5;
  record.fit.conditions.sensitivity_degrees_of_freedom = 2.0;
  const BlockScatter bias = scatter_of_blocks(record, "z.bias");
  EXPECT_EQ(bias.mean_square, 0.75);
  EXPECT_EQ(bias.degrees_of_freedom, 3.0);
  EXPECT_EQ(bias.blocks, 4.0);
  const BlockScatter cross = scatter_of_blocks(record, "y.sensitivity.z");
  EXPECT_EQ(cross.mean_square, 0.5);
  EXPECT_EQ(cross.degrees_of_freedom, 2.0);
}

TEST(ScatterOfBlocks, IsUnknownOfOneBlockAndOfOtherNames) {
  EXPECT_EQ(scatter_of_blocks(record_in_blocks(3, 1, 0.0), "x.bias").degrees_of_freedom, 0.0);
  const Calibration record = record_in_blocks(3, 4, 0.25);
  EXPECT_EQ(scatter_of_blocks(record, "x.sensitivity.x").degrees_of_freedom, 0.0);
  EXPECT_EQ(scatter_of_blocks(record, "w.bias").degrees_of_freedom, 0.0);
  // If the number of blocks is unknown, it is taken as one.
  EXPECT_EQ(scatter_of_blocks(record_in_blocks(3, 0, 0.0), "x.bias").blocks, 1.0);
}

TEST(CovarianceWithinBlocks, IsThatOfReadingsSeatsAndInputs) {
  Calibration record = record_in_blocks(1, 3, 0.1);
  FitStatistics& statistics = *record.fit.statistics;
  const Eigen::MatrixXd of_readings = statistics.covariance;
  const Eigen::MatrixXd seats = Eigen::Vector4d(0.0, 1e-6, 2e-6, 3e-6).asDiagonal();
  for (const char* const name : {"blocks", "block_sensitivities", "seats"}) {
    const bool is_seats = std::string(name) == "seats";
    statistics.components.push_back(
        {.name = name,
         .covariance = is_seats ? seats : Eigen::MatrixXd(Eigen::Matrix4d::Identity()),
         .degrees_of_freedom = 2.0});
    statistics.covariance += statistics.components.back().covariance;
  }
  const Eigen::MatrixXd input = 1e-7 * Eigen::Matrix4d::Ones();
  record.fit.uncertainty =
      UncertaintyBudget{.sources = {{.name = "fit", .type = "A"},
                                    {.name = "positioner", .type = "B", .covariance = input}}};
  EXPECT_MATRIX_NEAR(covariance_within_blocks(record), of_readings + seats + input, 1e-14);
}

// One axis, B old and m new blocks: d is tested against M (1 / B + 1 / m) with B + m - 2 degrees of
// freedom. The smaller p of two tests is doubled, and that of three classes is tripled.
TEST(BlockChanges, OfOneBiasAgreeWithStudentsT) {
  struct Case {
    int before;
    double square_before;
    int after;
    double square_after;
  };
  for (const Case& one : {Case{3, 1e-4, 1, 0.0}, Case{2, 1e-4, 2, 3e-4}, Case{4, 2e-4, 2, 6e-4},
                          Case{1, 0.0, 5, 1e-4}}) {
    const Calibration old = record_in_blocks(1, one.before, one.square_before);
    Calibration fresh = record_in_blocks(1, one.after, one.square_after);
    const int nu = one.before + one.after - 2;
    const double mean_square =
        ((one.before - 1) * one.square_before + (one.after - 1) * one.square_after) / nu;
    const double u = std::sqrt(mean_square * (1.0 / one.before + 1.0 / one.after));
    for (const double t : {10.0, 14.0, -20.0}) {
      fresh.sensor.response.bias(0) = t * u;
      EXPECT_NEAR(p_of(old, fresh) / std::min(6.0 * even_t_p(t, nu), 1.0), 1.0, 1e-6) << nu << t;
    }
    fresh.sensor.response.bias(0) = 2.0 * u;  // a usual difference of blocks
    EXPECT_GT(p_of(old, fresh), 0.2);
  }
}

// If the blocks agree by chance, the noise of the readings is still used.
TEST(BlockChanges, AreNotFarBeyondBlocksIfTheyAreWithinTheNoise) {
  const Calibration old = record_in_blocks(1, 3, 1e-14);
  Calibration fresh = record_in_blocks(1, 1, 0.0);
  const double z = 2.9;
  fresh.sensor.response.bias(0) = z * std::sqrt(2.0) * u_within;
  EXPECT_NEAR(p_of(old, fresh), 3.0 * even_t_p(z, 60), 1e-9);
}

TEST(BlockChanges, OfMainTermsAreCombinedByFishersMethod) {
  const Calibration old = record_in_blocks(3, 4, 1e-4);
  Calibration fresh = record_in_blocks(3, 1, 0.0);
  const Eigen::Vector3d z(2.0, -2.5, 3.0);
  fresh.sensor.response.sensitivity.diagonal() += std::sqrt(2.0) * u_within * z;
  const double expected =
      3.0 * fisher_of_three(even_t_p(z.x(), 60), even_t_p(-z.y(), 60), even_t_p(z.z(), 60));
  EXPECT_NEAR(p_of(old, fresh) / expected, 1.0, 1e-9);
}

TEST(BlockChanges, OfSensitivitiesCountAgainstTheirOwnScatter) {
  Calibration old = record_in_blocks(3, 4, 1e-4);
  Calibration fresh = record_in_blocks(3, 1, 0.0);
  fresh.sensor.response.sensitivity(0, 0) += 0.02;  // 14 standard uncertainties
  EXPECT_LT(p_of(old, fresh), 1e-6);
  old.fit.conditions.sensitivity_mean_square = Eigen::MatrixXd::Constant(3, 3, 4e-4);
  old.fit.conditions.sensitivity_degrees_of_freedom = 3.0;
  EXPECT_GT(p_of(old, fresh), 0.5);
}

// The third axis scatters 100 times as much. The sum of squares hides a change of the first axis;
// the tests of single axes find it.
TEST(BlockChanges, OfAQuietAxisAreSeenAmongRestlessOnes) {
  Calibration old = record_in_blocks(3, 5, 1e-4);
  old.fit.conditions.block_mean_square(2) = 1.0;
  Calibration fresh = record_in_blocks(3, 1, 0.0);
  const double t = 20.0;
  fresh.sensor.response.bias(0) = t * std::sqrt(1e-4 * (1.0 / 5.0 + 1.0));
  EXPECT_NEAR(p_of(old, fresh) / (6.0 * fisher_of_three(even_t_p(t, 4), 1.0, 1.0)), 1.0, 1e-6);
}

TEST(BlockChanges, AreTheSameFromEitherSideAndInAnyUnit) {
  const Calibration old = record_in_blocks(3, 3, 1e-4);
  Calibration fresh = record_in_blocks(3, 2, 2e-4);
  fresh.sensor.response.bias = Eigen::Vector3d(0.04, -0.02, 0.01);
  fresh.sensor.response.sensitivity(1, 2) = 0.004;
  const double p = p_of(old, fresh);
  EXPECT_LT(p, 0.9);
  EXPECT_NEAR(p_of(fresh, old), p, 1e-12);
  const auto in_unit = [](Calibration record, double factor) {
    record.sensor.response.bias *= factor;
    record.sensor.response.sensitivity *= factor;
    record.fit.statistics->covariance *= factor * factor;
    record.fit.conditions.block_mean_square *= factor * factor;
    return record;
  };
  EXPECT_NEAR(p_of(in_unit(old, 1e4), in_unit(fresh, 1e4)), p, 1e-12);
}

TEST(BlockChanges, PassOverParametersThatOneRecordDoesNotKnow) {
  Calibration old = record_in_blocks(1, 3, 1e-4);
  Calibration fresh = record_in_blocks(1, 1, 0.0);
  fresh.sensor.response.sensitivity(0, 1) = 0.5;
  EXPECT_LT(p_of(old, fresh), 1e-6);
  old.fit.statistics->parameter_names = {"x.bias", "x.sensitivity.x"};
  old.fit.statistics->covariance = u_within * u_within * Eigen::Matrix2d::Identity();
  EXPECT_EQ(p_of(old, fresh), 1.0);
}

TEST(BlockChanges, AreUnknownIfNoRecordShowsTheScatter) {
  std::vector<std::string> notes;
  const Calibration one = record_in_blocks(3, 1, 0.0);
  Calibration several = record_in_blocks(3, 2, 1e-4);
  EXPECT_FALSE(p_of_block_changes(one, one, notes));
  EXPECT_TRUE(p_of_block_changes(one, several, notes));
  ASSERT_EQ(notes.size(), 1U);  // 2 + 1 blocks: one degree of freedom
  EXPECT_THAT(
      notes.front(),
      testing::HasSubstr("two blocks and the other has one: almost no change can be detected"));
  several.fit.statistics.reset();
  EXPECT_FALSE(p_of_block_changes(one, several, notes));
  EXPECT_FALSE(p_of_block_changes(several, one, notes));
}

// A record with random blocks: the biases scatter between blocks, and the readings have noise.
Calibration drawn_record(int blocks, double sd_of_blocks, RandomStream& random) {
  Calibration record = record_in_blocks(3, blocks, 0.0);
  Eigen::Matrix3Xd biases(3, blocks);
  for (double& bias : biases.reshaped()) {
    bias = std::hypot(sd_of_blocks, std::sqrt(blocks) * u_within) * random.normal();
  }
  record.sensor.response.bias = biases.rowwise().mean();
  for (double& value : record.sensor.response.sensitivity.reshaped()) {
    value += u_within * random.normal();
  }
  if (blocks > 1) {
    record.fit.conditions.block_mean_square =
        (biases.colwise() - biases.rowwise().mean()).rowwise().squaredNorm() / (blocks - 1.0);
  }
  return record;
}

TEST(BlockChanges, RaiseFewFalseAlarmsAndSeeALargeChange) {
  constexpr int trials = 300;
  constexpr double sd_of_blocks = 4.0 * u_within;
  RandomStream random(1);
  int alarms = 0;
  int alarms_by_readings = 0;
  int seen = 0;
  for (int trial = 0; trial < trials; ++trial) {
    Calibration old = drawn_record(4, sd_of_blocks, random);
    Calibration fresh = drawn_record(trial % 2 == 0 ? 1 : 3, sd_of_blocks, random);
    alarms += check_drift(old, fresh, 0.05).drifted ? 1 : 0;
    Calibration moved = fresh;
    moved.sensor.response.bias(1) += 40.0 * sd_of_blocks;
    seen += p_of(old, moved) < 0.05 ? 1 : 0;
    for (Calibration* const record : {&old, &fresh}) {
      record->fit.conditions = {};
    }
    alarms_by_readings += check_drift(old, fresh, 0.05).drifted ? 1 : 0;
  }
  EXPECT_LE(alarms, 30);  // expected: at most 15
  EXPECT_GE(alarms_by_readings, 150);
  EXPECT_GE(seen, 270);
}

}  // namespace
}  // namespace axiscal
