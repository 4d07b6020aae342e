// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/simulate.hpp"

#include <cmath>

#include "axiscal/core/error.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using test::accelerometer_truth;
using test::observe;

TEST(Simulate, ReadsWhatTheModelSays) {
  const SensorModel truth = accelerometer_truth();
  const std::vector<RunSheetRow> sheet = {{.entry = {.point = {Face::minus_z, Face::plus_y}}},
                                          {.entry = {.point = {Face::plus_x, Face::plus_y}}}};
  const double x = 0.01;
  const double y = -0.02;
  const double z = std::sqrt(1.0 - x * x - y * y);
  const Observations observed = simulate(truth, sheet, {.slope = {x, y}});
  // With rest -Z and fence +Y the cube's axes are those of the table. With rest +X the table's z, y
  // and x = y cross z are -X, Y and Z of the cube.
  EXPECT_MATRIX_NEAR(observed.response.row(0).transpose(),
                     truth.response.at(Eigen::Vector3d(x, y, z)), 1e-15);
  EXPECT_MATRIX_NEAR(observed.response.row(1).transpose(),
                     truth.response.at(Eigen::Vector3d(-z, y, x)), 1e-15);
}

TEST(Simulate, HasNoiseOfTheStatedSizeAndSeed) {
  const SensorModel truth = accelerometer_truth();
  const Observations exact = observe(truth, {.replicates = 500, .seed = 3});
  const Observations noisy = observe(truth, {.replicates = 500, .noise_sd = 0.1, .seed = 3});
  const Eigen::MatrixXd noise = noisy.response - exact.response;
  // The standard deviation of the sd of 18000 normal numbers is 0.5 %.
  EXPECT_NEAR(std::sqrt(noise.array().square().mean()), 0.1, 0.0027);
  EXPECT_NEAR(noise.mean(), 0.0, 0.004);
  EXPECT_EQ(noisy.response,
            observe(truth, {.replicates = 500, .noise_sd = 0.1, .seed = 3}).response);
}

TEST(Simulate, TurnsTheFieldWithTheFence) {
  SensorModel truth = accelerometer_truth();
  truth.field.in_table = Eigen::Vector3d(0.0, 0.6, 0.8);  // north, where the fence is
  const std::vector<RunSheetRow> sheet = {{.entry = {.point = {Face::minus_z, Face::plus_y}}}};
  const Observations east = simulate(truth, sheet, {.fence_azimuth_rad = std::acos(0.0)});
  // With the fence in the east, north is -x of the table.
  EXPECT_MATRIX_NEAR(east.response.row(0).transpose(),
                     truth.response.at(Eigen::Vector3d(-0.6, 0.0, 0.8)), 1e-15);
}

// on_level_table() removes the slope of a record, so that only the slope in the options is
// simulated.
TEST(OnLevelTable, TakesTheTruthsOwnSlopeOut) {
  SensorModel truth = accelerometer_truth();
  truth.field.in_table = Eigen::Vector3d(0.02, -0.03, 0.0).array() + 0.0;
  truth.field.in_table->z() = std::sqrt(1.0 - truth.field.in_table->head<2>().squaredNorm());
  EXPECT_MATRIX_NEAR(*on_level_table(truth).field.in_table, Eigen::Vector3d::UnitZ(), 1e-15);
  const std::vector<RunSheetRow> sheet = {{.entry = {.point = {Face::minus_z, Face::plus_y}}}};
  const Observations observed = simulate(on_level_table(truth), sheet, {.slope = {0.001, 0.0}});
  EXPECT_MATRIX_NEAR(observed.response.row(0).transpose(),
                     truth.response.at(Eigen::Vector3d(0.001, 0.0, std::sqrt(1.0 - 1e-6))), 1e-15);
  truth.field.kind = "geomagnetic";  // it does not show the slope
  EXPECT_EQ(on_level_table(truth).field.in_table, truth.field.in_table);
}

TEST(Simulate, RejectsBadOptions) {
  const SensorModel truth = accelerometer_truth();
  EXPECT_THROW(static_cast<void>(observe(truth, {.noise_sd = -1.0})), DomainError);
  EXPECT_THROW(static_cast<void>(observe(truth, {.slope = {0.8, 0.8}})), DomainError);
}

}  // namespace
}  // namespace axiscal
