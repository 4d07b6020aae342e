// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/table_field.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "axiscal/core/error.hpp"

namespace axiscal {
namespace {

// The Earth's rotation under a turntable, and a local field beside one that a coil makes.
TableField on_turntable() {
  return TableField({{.kind = "induced_rotation", .turning = true},
                     {.kind = "earth_rotation", .set_by_level = false}});
}

TableField beside_coil() {
  return TableField({{.kind = "geomagnetic", .set_by_level = false},
                     {.kind = "induced_magnetic", .free_length = true}});
}

// What `at` changes with one vector, by central differences.
Eigen::Matrix3d differences(const TableField& field,
                            const TableField::Vectors& vectors,
                            double level,
                            std::size_t tilt,
                            std::size_t which) {
  constexpr double h = 1e-6;
  Eigen::Matrix3d change;
  for (Eigen::Index j = 0; j < 3; ++j) {
    TableField::Vectors more = vectors;
    TableField::Vectors less = vectors;
    more[which](j) += h;
    less[which](j) -= h;
    change.col(j) = (field.at(more, level, tilt) - field.at(less, level, tilt)) / (2.0 * h);
  }
  return change;
}

TEST(TableField, OfOneKindIsMultipliedByTheLevel) {
  const TableField field({{.kind = "gravity", .set_by_level = false}});
  EXPECT_FALSE(field.is_sum());
  EXPECT_FALSE(field.level_can_be_set());
  EXPECT_EQ(field.vector_count(), 1U);
  EXPECT_EQ(field.at({Eigen::Vector3d(0.0, 0.1, 2.0)}, -0.5), Eigen::Vector3d(0.0, -0.05, -1.0));
  EXPECT_EQ(field.name_of(0), "the field");
}

TEST(TableField, HasAVectorForEachTilt) {
  TableField field;
  field.tilt_by_block({2, 5, 9});
  const TableField::Vectors vectors = {{1.0, 0.0, 0.0}, {0.0, 2.0, 0.0}, {0.0, 0.0, 3.0}};
  EXPECT_EQ(field.vector_count(), 3U);
  EXPECT_EQ(field.at(vectors, 1.0, field.tilt_of_block(9)), vectors[2]);
  EXPECT_EQ(field.at(vectors, 1.0, field.tilt_of_block(5)), vectors[1]);
  EXPECT_EQ(field.tilt_of_block(7), 0U);
  EXPECT_EQ(field.name_of(1), "the field in block 5");
  EXPECT_EQ(field.change(vectors, 2.0, 1, 0), Eigen::Matrix3d::Zero());
  EXPECT_EQ(field.change(vectors, 2.0, 1, 1), 2.0 * Eigen::Matrix3d::Identity());
}

TEST(TableField, LeavesOfTheEarthsRotationWhatLiesAlongTheTurntable) {
  const TableField field = on_turntable();
  const TableField::Vectors vectors = {{0.0, 0.0, 10.0}, {3.0, 0.0, 4.0}};
  EXPECT_TRUE(field.turns());
  EXPECT_EQ(field.at(vectors, 2.0), Eigen::Vector3d(0.0, 0.0, 24.0));
  EXPECT_EQ(field.at(vectors, -1.0), Eigen::Vector3d(0.0, 0.0, -6.0));
  EXPECT_EQ(field.at(vectors, 0.0), vectors[1]);  // the table stands, and averages nothing
}

TEST(TableField, AddsWhatIsLocalAndWhatIsMade) {
  const TableField field = beside_coil();
  EXPECT_TRUE(field.level_can_be_set());
  EXPECT_FALSE(field.turns());
  EXPECT_EQ(field.at({{1.0, 2.0, 3.0}, {10.0, 0.0, 0.0}}, -1.0), Eigen::Vector3d(-9.0, 2.0, 3.0));
  EXPECT_EQ(field.name_of(1), "the field induced_magnetic");
}

TEST(TableField, ChangesAsItsDifferencesSay) {
  const TableField::Vectors vectors = {{0.4, -0.2, 9.0}, {3.0, 1.0, 4.0}};
  TableField tilted;
  tilted.tilt_by_block({1, 2});
  for (const TableField& field : {on_turntable(), beside_coil(), tilted}) {
    for (const double level : {1.0, -1.5, 0.0}) {
      for (std::size_t which = 0; which < 2; ++which) {
        const Eigen::Matrix3d expected = differences(field, vectors, level, 1, which);
        EXPECT_LT((field.change(vectors, level, 1, which) - expected).norm(), 1e-8)
            << field.name_of(which) << " at level " << level;
      }
    }
  }
}

TEST(TableField, MovesAlongItsTangents) {
  const TableField field = beside_coil();
  const TableField::Vectors vectors = {{0.4, -0.2, 9.0}, {3.0, 1.0, 4.0}};
  const TableField::Tangents known = field.tangents(vectors, 0);
  const TableField::Tangents open = field.tangents(vectors, 1);
  ASSERT_EQ(known.cols(), 2);
  ASSERT_EQ(open.cols(), 3);
  EXPECT_LT((open.transpose() * open - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  const Eigen::Vector3d step(1e-6, -2e-6, 3e-6);
  const Eigen::Vector3d moved = TableField::moved(vectors[1], open, step);
  EXPECT_LT((moved - vectors[1] - vectors[1].norm() * open * step).norm(), 1e-10);
  const Eigen::Vector3d turned = TableField::moved(vectors[0], known, Eigen::Vector2d(0.3, -0.2));
  EXPECT_NEAR(turned.norm(), vectors[0].norm(), 1e-14);
}

TEST(TableField, NeedsAPart) {
  EXPECT_THROW(TableField(std::vector<FieldPartDescription>{}), DomainError);
}

}  // namespace
}  // namespace axiscal
