// SPDX-License-Identifier: Apache-2.0
#include "axiscal/positioner/design.hpp"

#include <map>
#include <set>

#include "axiscal/core/error.hpp"
#include "axiscal/positioner/positioner.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

TEST(ParseFace, TakesAllSpellings) {
  for (const Face face : all_faces) {
    const std::string name(face_name(face));
    EXPECT_EQ(parse_face(name), face);
    EXPECT_EQ(parse_face(std::string{name[1], name[0]}), face);
    EXPECT_EQ(parse_face(std::string{name[0], static_cast<char>(name[1] + 32)}), face);
  }
  for (const char* text : {"", "X", "+", "+W", "XX", "++", "+X ", "+XY"}) {
    EXPECT_FALSE(parse_face(text)) << text;
  }
}

TEST(DesignPoint, RefusesFacesOnOneAxis) {
  EXPECT_THROW(DesignPoint(Face::plus_x, Face::minus_x), DomainError);
  EXPECT_EQ(DesignPoint(Face::plus_x, Face::minus_y).name(), "rest +X, fence -Y");
  EXPECT_EQ(DesignPoint(Face::plus_x, Face::minus_y).turned_round(),
            DesignPoint(Face::plus_x, Face::plus_y));
}

TEST(StandardDesign, HasEachPointOnceAndEachOpposite) {
  for (const int points : {6, 12, 24}) {
    std::set<DesignPoint> seen;
    for (const DesignEntry& entry : standard_design(points)) {
      seen.insert(entry.point);
    }
    EXPECT_EQ(seen.size(), static_cast<std::size_t>(points));
    for (const DesignPoint& point : seen) {
      EXPECT_EQ(seen.contains(point.turned_round()), points > 6);
    }
  }
  EXPECT_THROW(static_cast<void>(standard_design(13)), DomainError);
}

// For the 12 points [1, vec R_i] has X^T X = diag(12, 4, ..., 4), and for 24 points twice that
// (method.md, section 2).
TEST(StandardDesign, HasOrthogonalColumnsForEveryFieldDirection) {
  const Positioner cube;
  for (const int points : {12, 24}) {
    const std::vector<DesignEntry> design = standard_design(points);
    Eigen::MatrixXd X(points, 10);
    for (int i = 0; i < points; ++i) {
      const Eigen::Matrix3d R =
          cube.rotation_table_from_positioner(design[static_cast<std::size_t>(i)].point);
      X.row(i) << 1.0, R.reshaped().transpose();
    }
    Eigen::VectorXd expected = Eigen::VectorXd::Constant(10, points / 3.0);
    expected(0) = points;
    EXPECT_MATRIX_NEAR(X.transpose() * X, expected.asDiagonal().toDenseMatrix(), 0.0);
  }
}

TEST(MakeRunSheet, HoldsTheWholeDesignInEachBlock) {
  const std::vector<RunSheetRow> sheet = make_run_sheet(standard_design(12), 3, 42);
  ASSERT_EQ(sheet.size(), 36U);
  std::map<int, std::set<DesignPoint>> blocks;
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    EXPECT_EQ(sheet[i].run, static_cast<int>(i) + 1);
    blocks[sheet[i].block].insert(sheet[i].entry.point);
  }
  ASSERT_EQ(blocks.size(), 3U);
  for (const auto& [block, points] : blocks) {
    EXPECT_EQ(points.size(), 12U);
  }
  const auto order = [](const std::vector<RunSheetRow>& rows) {
    std::vector<DesignPoint> points;
    for (const RunSheetRow& row : rows) {
      points.push_back(row.entry.point);
    }
    return points;
  };
  EXPECT_EQ(order(sheet), order(make_run_sheet(standard_design(12), 3, 42)));
  EXPECT_NE(order(sheet), order(make_run_sheet(standard_design(12), 3, 43)));
  EXPECT_THROW(static_cast<void>(make_run_sheet({}, 1, 1)), DomainError);
  EXPECT_THROW(static_cast<void>(make_run_sheet(standard_design(6), 0, 1)), DomainError);
}

}  // namespace
}  // namespace axiscal
