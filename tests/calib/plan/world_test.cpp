// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/world.hpp"

#include <cmath>
#include <fstream>

#include "axiscal/calib/simulate.hpp"
#include "axiscal/core/error.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using test::accelerometer_truth;

std::vector<RunSheetRow> long_sheet(int replicates = 200) {
  return make_run_sheet(standard_design(12), replicates, 5);
}

// The errors that a world adds to the readings of an exact run.
Eigen::MatrixXd errors_of(const World& world, double noise_sd, int replicates = 200) {
  const SensorModel truth = accelerometer_truth();
  const std::vector<RunSheetRow> sheet = long_sheet(replicates);
  return simulate(truth, sheet, {.noise_sd = noise_sd, .world = world}).response -
         simulate(truth, sheet).response;
}

double lag_one(const Eigen::VectorXd& e) {
  const Eigen::VectorXd centred = e.array() - e.mean();
  return centred.head(e.size() - 1).dot(centred.tail(e.size() - 1)) / centred.squaredNorm();
}

TEST(World, IsReadFromOneLineAndWrittenBack) {
  const World world = world_of("block_sd=1e-3, ar=0.5,tails=4,k2=3e-4:0:0,stated=1");
  EXPECT_EQ(world.block_sd, 1e-3);
  EXPECT_EQ(world.ar, 0.5);
  EXPECT_EQ(world.tails, 4);
  EXPECT_EQ(world.k2, (std::vector{3e-4, 0.0, 0.0}));
  EXPECT_TRUE(world.stated);
  EXPECT_FALSE(world.is_white());
  EXPECT_EQ(world_text(world), "block_sd=0.001,ar=0.5,tails=4,k2=3e-04:0:0,stated=1");
  EXPECT_TRUE(World().is_white());
  EXPECT_EQ(world_text(World()), "");
}

TEST(World, IsReadFromAFile) {
  const std::string path = testing::TempDir() + "world.json";
  std::ofstream(path) << R"({"format": "axiscal-world", "version": 1, "drift": -2e-3,
                             "k3": [1e-4, 0, 0], "stated": true})";
  const World world = read_world(path);
  EXPECT_EQ(world.drift, -2e-3);
  EXPECT_EQ(world.k3, (std::vector{1e-4, 0.0, 0.0}));
  EXPECT_TRUE(world.stated);
  std::ofstream(path) << R"({"format": "axiscal-world", "version": 1, "tails": 2})";
  EXPECT_THROW(static_cast<void>(read_world(path)), DataError);
}

TEST(World, RefusesWhatItDoesNotKnow) {
  for (const char* text :
       {"blocksd=1", "ar=1", "ar=x", "tails=2.5", "round=-1", "drift", "ar=1:2"}) {
    EXPECT_THROW(static_cast<void>(world_of(text)), DomainError) << text;
  }
  EXPECT_THROW(static_cast<void>(
                   simulate(accelerometer_truth(), long_sheet(1), {.world = world_of("k2=1:2")})),
               DomainError);
}

TEST(Simulate, CorrelatesNoiseAndKeepsItsSize) {
  const Eigen::MatrixXd e = errors_of(world_of("ar=0.8"), 0.1);
  EXPECT_NEAR(std::sqrt(e.array().square().mean()), 0.1, 0.005);
  EXPECT_NEAR(lag_one(e.col(0)), 0.8, 0.04);
  const Eigen::MatrixXd with_white = errors_of(world_of("ar=0.8,ar_white=0.1"), 0.1);
  EXPECT_NEAR(lag_one(with_white.col(1)), 0.4, 0.06);
}

TEST(Simulate, HasHeavyTailsOfTheSameSize) {
  const Eigen::ArrayXXd e = errors_of(world_of("tails=5"), 0.1).array() / 0.1;
  EXPECT_NEAR(std::sqrt(e.square().mean()), 1.0, 0.05);
  // The kurtosis of Student's t with 5 degrees of freedom is 9, that of the normal distribution is
  // 3.
  EXPECT_GT(e.square().square().mean(), 4.5);
}

TEST(Simulate, ShiftsEachBlock) {
  const Eigen::MatrixXd e = errors_of(world_of("block_sd=0.01"), 0.0);
  double squares = 0.0;
  for (Eigen::Index block = 0; block < 200; ++block) {
    const Eigen::MatrixXd own = e.middleRows(12 * block, 12);
    EXPECT_MATRIX_NEAR(own.rowwise() - own.row(0), Eigen::MatrixXd::Zero(12, 3), 1e-12);
    squares += own.row(0).squaredNorm() / 600.0;
  }
  EXPECT_NEAR(std::sqrt(squares), 0.01, 0.001);
}

// The true bias of a walk is its mean over the run. A drift goes from -1/2 to +1/2 of its size.
TEST(Simulate, TellsTheBiasOfTheRun) {
  const SensorModel truth = accelerometer_truth();
  const std::vector<RunSheetRow> sheet = long_sheet(1);
  const SimulatedRun run =
      simulate_run(truth, sheet, {.world = world_of("walk_sd=0.01,drift=0.02")});
  const Eigen::MatrixXd e = run.observations.response - simulate(truth, sheet).response;
  EXPECT_MATRIX_NEAR(run.bias_of_run, e.colwise().mean().transpose(), 1e-12);
  const Eigen::MatrixXd drift = errors_of(world_of("drift=0.02"), 0.0, 1);
  EXPECT_NEAR(drift(0, 0), -0.01, 1e-12);
  EXPECT_NEAR(drift(11, 2), 0.01, 1e-12);
}

// The field in the cube is rotated by the seat for each reading, and by the mount for each block. A
// rotation about the field has no effect.
TEST(Simulate, LaysCubeAndInstrumentAnew) {
  const Eigen::Vector3d S = accelerometer_truth().response.sensitivity.diagonal();
  const Eigen::MatrixXd seats =
      errors_of(world_of("seat_rad=1e-4"), 0.0) * S.cwiseInverse().asDiagonal();
  // In each position two of three axes are across the field.
  EXPECT_NEAR(std::sqrt(seats.array().square().mean()), 1e-4 * std::sqrt(2.0 / 3.0), 5e-6);
  const Eigen::MatrixXd mounts = errors_of(world_of("mount_rad=1e-4"), 0.0);
  EXPECT_GT(mounts.cwiseAbs().maxCoeff(), 1e-4);
}

TEST(Simulate, RoundsAndBends) {
  const Eigen::MatrixXd response =
      simulate(accelerometer_truth(), long_sheet(1), {.world = world_of("round=0.01")}).response;
  EXPECT_MATRIX_NEAR(response, 0.01 * (response / 0.01).array().round().matrix(), 1e-12);
  const Eigen::MatrixXd bent = errors_of(world_of("k2=0.02:0:0"), 0.0, 1);
  EXPECT_NEAR(bent.col(0).maxCoeff(), 0.02, 1e-3);
  EXPECT_NEAR(bent.col(1).cwiseAbs().maxCoeff(), 0.0, 1e-15);
}

}  // namespace
}  // namespace axiscal
