// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/pose_model.hpp"

#include <gtest/gtest.h>

#include "axiscal/acquisition/pose_path.hpp"
#include "axiscal/core/random.hpp"

namespace axiscal {
namespace {

TEST(FewestTurns, LeadToThePointInThreeTurnsAtMost) {
  for (const DesignEntry& from : standard_design(24)) {
    for (const DesignEntry& to : standard_design(24)) {
      const std::vector<CubeTurn> turns = fewest_turns(from.point, to.point);
      EXPECT_LE(turns.size(), 3U);
      EXPECT_EQ(turns.empty(), from.point == to.point);
      DesignPoint here = from.point;
      for (const CubeTurn turn : turns) {
        here = after_turn(here, turn);
      }
      EXPECT_EQ(here, to.point);
    }
  }
}

// Turns as a person at the table sees them: to tip the cube towards oneself moves its front face
// down and its back face up.
TEST(FewestTurns, MoveTheFacesAsHandsDo) {
  const DesignPoint start(Face::minus_z, Face::plus_y);  // x to the right, y to the fence, z up
  EXPECT_EQ(after_turn(start, CubeTurn::tip_towards), DesignPoint(Face::minus_y, Face::minus_z));
  EXPECT_EQ(after_turn(start, CubeTurn::tip_away), DesignPoint(Face::plus_y, Face::plus_z));
  EXPECT_EQ(after_turn(start, CubeTurn::tip_right), DesignPoint(Face::plus_x, Face::plus_y));
  EXPECT_EQ(after_turn(start, CubeTurn::tip_left), DesignPoint(Face::minus_x, Face::plus_y));
  // A turn to the left is counter-clockwise from above and brings the right face to the fence.
  EXPECT_EQ(after_turn(start, CubeTurn::turn_left), DesignPoint(Face::minus_z, Face::plus_x));
  EXPECT_EQ(after_turn(start, CubeTurn::turn_right), DesignPoint(Face::minus_z, Face::minus_x));
  EXPECT_EQ(after_turn(start, CubeTurn::turn_round), DesignPoint(Face::minus_z, Face::minus_y));
}

// An accelerometer in volts whose biases are far larger than the response to gravity. The table
// slopes by 5 mrad.
struct Bench {
  LinearResponse truth{.bias = Eigen::Vector3d(1.65, 1.60, 1.70), .sensitivity = {}};
  Eigen::Vector3d field{4e-3, -3e-3, 1.0};
  RandomStream random{3};

  Bench() {
    truth.sensitivity = SensitivityMatrix(3, 3);
    truth.sensitivity << 0.33, 0.004, -0.003, 0.002, 0.32, 0.005, -0.004, 0.003, 0.34;
  }

  PlacedReading reading(const DesignPoint& point, const DesignPoint& lies) {
    constexpr double noise = 1e-5;
    Eigen::Vector3d mean =
        truth.at(Positioner().rotation_table_from_positioner(lies).transpose() * field);
    for (Eigen::Index k = 0; k < 3; ++k) {
      mean(k) += noise * random.normal();
    }
    return {
        .entry = DesignEntry{.point = point}, .mean = mean, .u = Eigen::Vector3d::Constant(noise)};
  }
};

PoseModel model_without_knowledge() {
  PoseModelSetup setup;
  setup.instrument = {.kind = "accelerometer", .unit = "V"};
  setup.nominal_axes = Eigen::Matrix3d::Identity();
  setup.field.kind = "gravity";
  setup.field.in_table = Eigen::Vector3d::UnitZ();
  return PoseModel(setup);
}

TEST(PoseModel, FromTheSecondFaceOnTellsAWrongFace) {
  Bench bench;
  const PoseModel model = model_without_knowledge();
  const std::vector<DesignEntry> sheet = standard_design(12);
  std::vector<PlacedReading> known = {bench.reading(sheet[0].point, sheet[0].point)};
  EXPECT_FALSE(model.judge({}, known.front()).has_value());
  int told = 0;
  int asked = 0;
  for (const DesignEntry& entry : sheet) {
    if (entry.point.rest() == sheet[0].point.rest()) {
      continue;
    }
    for (const DesignEntry& lies : standard_design(24)) {
      if (lies.point.rest() == entry.point.rest() || lies.point.rest() == sheet[0].point.rest()) {
        continue;  // the session detects an unchanged face
      }
      const auto judgement = model.judge(known, bench.reading(entry.point, lies.point));
      ASSERT_TRUE(judgement);
      ++asked;
      told += judgement->looks_like_another && judgement->best.rest() == lies.point.rest() ? 1 : 0;
    }
  }
  EXPECT_GE(told, asked * 9 / 10);
}

TEST(PoseModel, WithTheSlopeKnownTellsATurnOnTheSameFace) {
  Bench bench;
  const PoseModel model = model_without_knowledge();
  std::vector<PlacedReading> known;
  const std::vector<DesignEntry> sheet = standard_design(12);
  for (std::size_t i = 0; i + 1 < sheet.size(); ++i) {
    known.push_back(bench.reading(sheet[i].point, sheet[i].point));
  }
  const DesignPoint last = sheet.back().point;
  const auto right = model.judge(known, bench.reading(last, last));
  EXPECT_FALSE(right->looks_like_another);
  EXPECT_FALSE(right->fits_none);
  const auto turned = model.judge(known, bench.reading(last, last.turned_round()));
  EXPECT_TRUE(turned->looks_like_another);
  EXPECT_EQ(turned->best, last.turned_round());
  // The fitted slope of the table agrees with the true one.
  const auto fit = model.fit(known);
  EXPECT_NEAR(fit->field_in_table.x(), 4e-3, 1e-4);
  EXPECT_NEAR(fit->field_in_table.y(), -3e-3, 1e-4);
  EXPECT_LT(fit->slope_u.maxCoeff(), 1e-4);
  // A cube that is tilted by 20 mrad fits no pose.
  PlacedReading tilted = bench.reading(last, last);
  tilted.mean(0) += 0.33 * 0.02;
  tilted.mean(1) -= 0.33 * 0.02;
  EXPECT_TRUE(model.judge(known, tilted)->fits_none);
}

TEST(PoseModel, AFieldInTheHorizonOfAnUnknownHeadingIsFound) {
  Bench bench;
  const double azimuth = 2.0;
  bench.field = {0.4 * std::cos(azimuth), 0.4 * std::sin(azimuth), -0.9};
  bench.field.normalize();
  PoseModelSetup setup;
  setup.instrument = {.kind = "magnetometer", .unit = "V"};
  setup.nominal_axes = Eigen::Matrix3d::Identity();
  setup.field.kind = "geomagnetic";
  setup.field.in_table = Eigen::Vector3d(0.0, 0.4, -0.9).normalized();
  setup.direction_sd_rad = 0.35;
  const PoseModel model(setup);
  std::vector<PlacedReading> known;
  const std::vector<DesignEntry> sheet = standard_design(12);
  for (std::size_t i = 0; i + 1 < sheet.size(); ++i) {
    known.push_back(bench.reading(sheet[i].point, sheet[i].point));
  }
  const DesignPoint last = sheet.back().point;
  EXPECT_FALSE(model.judge(known, bench.reading(last, last))->looks_like_another);
  EXPECT_TRUE(model.judge(known, bench.reading(last, last.turned_round()))->looks_like_another);
}

TEST(PoseModel, OneSidedAxesAreLeftAlone) {
  PoseModelSetup setup;
  setup.instrument = {.kind = "optical", .one_sided = true};
  setup.nominal_axes = Eigen::Matrix3d::Identity();
  setup.field.in_table = Eigen::Vector3d::UnitZ();
  EXPECT_FALSE(PoseModel(setup).is_usable());
}

}  // namespace
}  // namespace axiscal
