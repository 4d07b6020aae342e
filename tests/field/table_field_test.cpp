// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/table_field.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "axiscal/core/error.hpp"

namespace axiscal {
namespace {

// on_turntable(): the Earth's rotation and a turntable. beside_coil(): a local field and that of a
// coil.
TableField on_turntable() {
  return TableField({{.kind = "induced_rotation", .turning = true},
                     {.kind = "earth_rotation", .set_by_level = false}});
}

TableField beside_coil() {
  return TableField({{.kind = "geomagnetic", .set_by_level = false},
                     {.kind = "induced_magnetic", .free_length = true}});
}

// @return the derivative of at() by one vector, by central differences.
Eigen::Matrix3d differences(const TableField& field,
                            double level,
                            std::size_t tilt,
                            std::size_t which) {
  constexpr double h = 1e-6;
  Eigen::Matrix3d change;
  for (Eigen::Index j = 0; j < 3; ++j) {
    std::vector<Eigen::Vector3d> more = field.vectors();
    std::vector<Eigen::Vector3d> less = field.vectors();
    more[which](j) += h;
    less[which](j) -= h;
    change.col(j) =
        (field.with(more).at(level, tilt) - field.with(less).at(level, tilt)) / (2.0 * h);
  }
  return change;
}

TEST(TableField, OfOneKindIsMultipliedByTheLevel) {
  const TableField field({{.kind = "gravity", .set_by_level = false}});
  EXPECT_FALSE(field.is_sum());
  EXPECT_FALSE(field.level_can_be_set());
  EXPECT_EQ(field.vector_count(), 1U);
  EXPECT_EQ(field.with_all({0.0, 0.1, 2.0}).at(-0.5), Eigen::Vector3d(0.0, -0.05, -1.0));
  EXPECT_EQ(field.name_of(0), "the field");
}

TEST(TableField, HasAVectorForEachTilt) {
  const std::vector<Eigen::Vector3d> vectors = {{1.0, 0.0, 0.0}, {0.0, 2.0, 0.0}, {0.0, 0.0, 3.0}};
  const TableField field = TableField().tilted_by_block({2, 5, 9}).with(vectors);
  EXPECT_EQ(field.vector_count(), 3U);
  EXPECT_EQ(field.at(1.0, field.tilt_of_block(9)), vectors[2]);
  EXPECT_EQ(field.at(1.0, field.tilt_of_block(5)), vectors[1]);
  EXPECT_EQ(field.tilt_of_block(7), 0U);
  EXPECT_EQ(field.name_of(1), "the field in block 5");
  EXPECT_EQ(field.change(2.0, 1, 0), Eigen::Matrix3d::Zero());
  EXPECT_EQ(field.change(2.0, 1, 1), 2.0 * Eigen::Matrix3d::Identity());
}

TEST(TableField, LeavesOfTheEarthsRotationWhatLiesAlongTheTurntable) {
  const TableField field = on_turntable().with({{0.0, 0.0, 10.0}, {3.0, 0.0, 4.0}});
  EXPECT_TRUE(field.turns());
  EXPECT_EQ(field.at(2.0), Eigen::Vector3d(0.0, 0.0, 24.0));
  EXPECT_EQ(field.at(-1.0), Eigen::Vector3d(0.0, 0.0, -6.0));
  EXPECT_EQ(field.at(0.0), field.vector(1));  // at level 0 the table does not turn
}

TEST(TableField, AddsWhatIsLocalAndWhatIsMade) {
  const TableField field = beside_coil();
  EXPECT_TRUE(field.level_can_be_set());
  EXPECT_FALSE(field.turns());
  EXPECT_EQ(field.with({{1.0, 2.0, 3.0}, {10.0, 0.0, 0.0}}).at(-1.0),
            Eigen::Vector3d(-9.0, 2.0, 3.0));
  EXPECT_EQ(field.name_of(1), "the field induced_magnetic");
}

TEST(TableField, ChangesAsItsDifferencesSay) {
  const TableField tilted = TableField().tilted_by_block({1, 2});
  for (const TableField& layout : {on_turntable(), beside_coil(), tilted}) {
    const TableField field = layout.with({{0.4, -0.2, 9.0}, {3.0, 1.0, 4.0}});
    for (const double level : {1.0, -1.5, 0.0}) {
      for (std::size_t which = 0; which < 2; ++which) {
        const Eigen::Matrix3d expected = differences(field, level, 1, which);
        EXPECT_LT((field.change(level, 1, which) - expected).norm(), 1e-8)
            << field.name_of(which) << " at level " << level;
      }
    }
  }
}

TEST(TableField, MovesAlongItsTangents) {
  const TableField field = beside_coil().with({{0.4, -0.2, 9.0}, {3.0, 1.0, 4.0}});
  const std::vector<TableField::Tangents> tangents = field.tangents();
  ASSERT_EQ(tangents[0].cols(), 2);
  ASSERT_EQ(tangents[1].cols(), 3);
  EXPECT_EQ(field.step_unit(1), field.vector(0).norm());  // the part with the known length
  Eigen::VectorXd step(5);
  step << 0.3, -0.2, 1e-3, -2e-3, 3e-3;
  const TableField moved = field.moved(tangents, step);
  EXPECT_NEAR(moved.vector(0).norm(), field.vector(0).norm(), 1e-14);
  EXPECT_LT((moved.vector(1) - field.vector(1) - field.step_unit(1) * step.tail<3>()).norm(),
            1e-14);
}

// A part of unknown size may be 0 and may change its sign in a step.
TEST(TableField, LetsAPartOfUnknownSizeVanish) {
  const TableField field = beside_coil().with({{0.0, 0.0, 2.0}, {0.0, 0.0, 0.0}});
  Eigen::VectorXd step = Eigen::VectorXd::Zero(5);
  step(2) = -0.5;
  EXPECT_EQ(field.moved(field.tangents(), step).vector(1), Eigen::Vector3d(-1.0, 0.0, 0.0));
}

TEST(TableField, TakesALevelOfEachPart) {
  const TableField field = TableField({{.kind = "geomagnetic", .set_by_level = false},
                                       {.kind = "induced_magnetic", .name = "north"},
                                       {.kind = "induced_magnetic", .name = "up"}})
                               .with({{1.0, 1.0, 1.0}, {0.0, 10.0, 0.0}, {0.0, 0.0, 10.0}});
  const FieldLevel level({{"north", -1.0}, {"up", 0.5}});
  EXPECT_EQ(field.at(level), Eigen::Vector3d(1.0, -9.0, 6.0));
  EXPECT_EQ(field.change(level, 0, 1), -1.0 * Eigen::Matrix3d::Identity());
  EXPECT_EQ(field.name_of(2), "the field up");
  EXPECT_EQ(level.text(), "north -1, up 0.5");
}

TEST(TableField, NeedsAPart) {
  EXPECT_THROW(TableField(std::vector<FieldDescription>{}), DomainError);
}

}  // namespace
}  // namespace axiscal
