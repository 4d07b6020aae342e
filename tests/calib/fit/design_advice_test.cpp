// SPDX-License-Identifier: Apache-2.0
// Undetermined coefficients of a design, and the readings that would determine them. The tests add
// the advised readings and compute the rank by Eigen.
#include "calib/fit/design_advice.hpp"

#include <algorithm>
#include <sstream>

#include <Eigen/Dense>
#include <gmock/gmock.h>

#include "axiscal/core/error.hpp"
#include "labelled_set.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Readings at `points` in a field that is not along the table's normal.
ReadingSet set_at_points(const std::vector<DesignPoint>& points,
                         const Eigen::Vector3d& in_table = test::sloping_gravity) {
  std::vector<DesignEntry> design;
  for (const DesignPoint& point : points) {
    design.push_back({.point = point});
  }
  return test::labelled_set(test::some_response(), test::gravity_in_table(in_table), design, 0.0,
                            1);
}

const Eigen::Vector3d field_upright(0.0, 0.0, 1.0);

// Parses an advice such as "rest +Z, fence +X; rest -Z, fence +X at level 0".
std::vector<DesignEntry> points_of_advice(const std::string& advice) {
  std::vector<DesignEntry> points;
  std::stringstream all(advice);
  std::string one;
  while (std::getline(all, one, ';')) {
    for (DesignEntry entry : standard_design(24)) {
      const std::size_t at = one.find(entry.point.name());
      if (at != std::string::npos) {
        const std::size_t level = one.find("at level ");
        entry.level = level == std::string::npos ? 1.0 : std::stod(one.substr(level + 9));
        points.push_back(entry);
      }
    }
  }
  return points;
}

Eigen::Index rank_by_lu(const Eigen::MatrixXd& X) {
  Eigen::FullPivLU<Eigen::MatrixXd> lu(X);
  lu.setThreshold(1e-9);
  return lu.rank();
}

Eigen::MatrixXd with_points(const Eigen::MatrixXd& design,
                            const std::vector<DesignEntry>& points,
                            const RowsForPoint& rows) {
  Eigen::MatrixXd all = design;
  for (const DesignEntry& entry : points) {
    const Eigen::MatrixXd more = rows(entry.point, entry.level.of_all());
    Eigen::MatrixXd longer(all.rows() + more.rows(), all.cols());
    longer << all, more;
    all = longer;
  }
  return all;
}

TEST(PointsToAdd, CloseTheDesignAndNoneIsIdle) {
  const std::vector<std::vector<DesignPoint>> starts = {
      {{Face::minus_z, Face::plus_x}},
      {{Face::minus_z, Face::plus_x}, {Face::plus_z, Face::plus_x}},
      {{Face::minus_z, Face::plus_x}, {Face::minus_z, Face::plus_y}, {Face::plus_x, Face::plus_y}},
  };
  for (const std::vector<DesignPoint>& taken : starts) {
    const ReadingSet set = set_at_points(taken, field_upright);
    const TableField field = test::gravity_in_table(field_upright);
    const Eigen::MatrixXd design = test::rows_of(set, field_upright);
    const RowsForPoint rows = rows_of_points(set, field);
    const std::vector<DesignEntry> added = points_of_advice(points_to_add(design, rows));
    ASSERT_EQ(static_cast<Eigen::Index>(added.size()), 4 - rank_by_lu(design));
    EXPECT_EQ(rank_by_lu(with_points(design, added, rows)), 4);
    for (std::size_t without = 0; without < added.size(); ++without) {
      std::vector<DesignEntry> rest = added;
      rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(without));
      EXPECT_EQ(rank_by_lu(with_points(design, rest, rows)), 3);
    }
  }
}

TEST(PointsToAdd, AreNoneForACompleteDesign) {
  const ReadingSet set = set_at_points({{Face::minus_z, Face::plus_x},
                                        {Face::plus_z, Face::plus_x},
                                        {Face::plus_x, Face::plus_y},
                                        {Face::plus_y, Face::plus_z}},
                                       field_upright);
  EXPECT_EQ(points_to_add(test::rows_of(set, field_upright),
                          rows_of_points(set, test::gravity_in_table(field_upright))),
            "");
}

// If no point can make the rank full, there is no advice.
TEST(PointsToAdd, AreNoneIfNoPointHelps) {
  const ReadingSet set = set_at_points({{Face::minus_z, Face::plus_x}}, field_upright);
  const Eigen::MatrixXd design = Eigen::MatrixXd::Ones(1, 3);
  const RowsForPoint constant = [](const DesignPoint&, double) {
    return Eigen::MatrixXd(Eigen::RowVector3d(1.0, 0.0, 0.0));
  };
  EXPECT_EQ(points_to_add(design, constant), "");
}

// A lamp along the table's normal and one possible rest face. Without levels no point helps. With
// levels one reading at another level separates the bias from the lamp.
TEST(PointsToAdd, TryLevelsIfTheyHelp) {
  const ReadingSet set = set_at_points({{Face::minus_z, Face::plus_x}}, field_upright);
  const TableField field = test::gravity_in_table(field_upright);
  // The cube can lie on this rest face only.
  const RowsForPoint rows = [&](const DesignPoint& point, double level) -> Eigen::MatrixXd {
    if (point.rest() != Face::minus_z) {
      throw RefusedError("the cube cannot lie in this way");
    }
    return rows_of_points(set, field)(point, level)(Eigen::all, {0, 3});
  };
  const Eigen::MatrixXd design = rows({Face::minus_z, Face::plus_x}, 1.0);
  EXPECT_EQ(points_to_add(design, rows), "");
  const std::string advice = points_to_add(design, rows, true);
  EXPECT_THAT(advice, HasSubstr("at level -1"));
  EXPECT_EQ(rank_by_lu(with_points(design, points_of_advice(advice), rows)), 2);
}

TEST(RowsOfPoints, AreThoseOfReadingsThere) {
  const ReadingSet set =
      set_at_points({{Face::minus_z, Face::plus_x}, {Face::plus_y, Face::minus_x}});
  const RowsForPoint rows = rows_of_points(set, test::gravity_in_table(test::sloping_gravity));
  const Eigen::MatrixXd expected = test::rows_of(set, test::sloping_gravity);
  EXPECT_MATRIX_NEAR(rows({Face::minus_z, Face::plus_x}, 1.0), expected.row(0), 1e-14);
  Eigen::RowVectorXd reversed = expected.row(1);
  reversed.tail<3>() *= -0.5;
  EXPECT_MATRIX_NEAR(rows({Face::plus_y, Face::minus_x}, -0.5), reversed, 1e-14);
}

TEST(OpenParameters, AreThoseOfAComponentThatNoReadingMet) {
  const ReadingSet set = set_at_points({{Face::minus_z, Face::plus_x},
                                        {Face::plus_z, Face::plus_x},
                                        {Face::minus_x, Face::plus_y},
                                        {Face::plus_x, Face::plus_y}},
                                       field_upright);
  const OpenParameters open = open_parameters(set, test::rows_of(set, field_upright));
  EXPECT_THAT(open.names, ElementsAre("x.sensitivity.y", "y.sensitivity.y", "z.sensitivity.y"));
  EXPECT_FALSE(open.left_out);
  EXPECT_MATRIX_NEAR(open.seen, test::rows_of(set, field_upright), 0.0);
}

TEST(OpenParameters, AreJudgedByTheReadingsThatAnAxisUses) {
  ReadingSet set = set_at_points({{Face::minus_z, Face::plus_x},
                                  {Face::plus_z, Face::plus_x},
                                  {Face::minus_x, Face::plus_y},
                                  {Face::minus_y, Face::plus_z}},
                                 field_upright);
  const Eigen::MatrixXd design = test::rows_of(set, field_upright);
  EXPECT_THAT(open_parameters(set, design).names, IsEmpty());
  set.weights(2, 1) = 0.0;  // the only reading along x
  const OpenParameters open = open_parameters(set, design);
  EXPECT_THAT(open.names, ElementsAre("y.sensitivity.x"));
  EXPECT_TRUE(open.left_out);
  Eigen::MatrixXd used = design;
  used.row(2).setZero();
  EXPECT_MATRIX_NEAR(open.seen, used, 0.0);
}

TEST(OpenParameters, NameSecondFields) {
  ReadingSet set = set_at_points({{Face::minus_z, Face::plus_x},
                                  {Face::plus_z, Face::plus_x},
                                  {Face::minus_x, Face::plus_y},
                                  {Face::minus_y, Face::plus_z}},
                                 field_upright);
  set.also_kinds = {"geomagnetic"};
  set.also_in_table = {field_upright};  // parallel to the first field: not separable
  const Eigen::MatrixXd design = field_design(set, test::gravity_in_table(field_upright));
  ASSERT_EQ(design.cols(), 7);
  const OpenParameters open = open_parameters(set, design);
  EXPECT_THAT(open.names, testing::Contains("x.sensitivity.x"));
  EXPECT_THAT(open.names, testing::Contains(HasSubstr("geomagnetic")));
}

TEST(RequireDetermined, AcceptsACompleteDesign) {
  const ReadingSet set = set_at_points({{Face::minus_z, Face::plus_x},
                                        {Face::plus_z, Face::plus_x},
                                        {Face::minus_x, Face::plus_y},
                                        {Face::minus_y, Face::plus_z}},
                                       field_upright);
  EXPECT_NO_THROW(require_determined(set, test::rows_of(set, field_upright), nullptr));
}

std::string refusal_of_design(const ReadingSet& set,
                              const RowsForPoint& rows,
                              bool turned_round = false) {
  return test::complaint_of<RankDeficientError>(
      [&] { require_determined(set, test::rows_of(set, field_upright), rows, turned_round); });
}

TEST(RequireDetermined, NamesCoefficientsAndPoints) {
  const ReadingSet set =
      set_at_points({{Face::minus_z, Face::plus_x}, {Face::plus_z, Face::plus_x}}, field_upright);
  const RowsForPoint rows = rows_of_points(set, test::gravity_in_table(field_upright));
  const std::string plain = refusal_of_design(set, rows);
  EXPECT_THAT(plain, HasSubstr("do not determine x.sensitivity.x, x.sensitivity.y"));
  const std::vector<DesignEntry> added = points_of_advice(plain);
  ASSERT_EQ(added.size(), 2U);
  EXPECT_EQ(rank_by_lu(with_points(test::rows_of(set, field_upright), added, rows)), 4);
  EXPECT_THAT(plain, testing::Not(HasSubstr("opposite fence face")));
  EXPECT_THAT(refusal_of_design(set, rows, true),
              HasSubstr("each also with the opposite fence face"));
}

TEST(RequireDetermined, AsksForOtherDirectionsIfReadingsBringTheirFields) {
  const ReadingSet set =
      set_at_points({{Face::minus_z, Face::plus_x}, {Face::plus_z, Face::plus_x}}, field_upright);
  EXPECT_THAT(refusal_of_design(set, nullptr), HasSubstr("with the field in other directions"));
}

TEST(RequireDetermined, TellsOneSidedAxesToTakeDarkReadings) {
  ReadingSet set = set_at_points({{Face::minus_z, Face::plus_x},
                                  {Face::plus_z, Face::plus_x},
                                  {Face::minus_x, Face::plus_y},
                                  {Face::minus_y, Face::plus_z}},
                                 field_upright);
  set.weights(3, 2) = 0.0;
  try {
    require_determined(set, test::rows_of(set, field_upright),
                       rows_of_points(set, test::gravity_in_table(field_upright)));
    FAIL() << "an axis that sees too little was accepted";
  } catch (const RankDeficientError& error) {
    EXPECT_THAT(error.undetermined(), ElementsAre("z.sensitivity.y"));
    EXPECT_THAT(error.what(), HasSubstr("lamp off (level 0)"));
    EXPECT_FALSE(error.settings().empty());
  }
}

}  // namespace
}  // namespace axiscal
