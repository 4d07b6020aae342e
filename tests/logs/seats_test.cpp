// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/seats.hpp"

#include <Eigen/Geometry>
#include <gmock/gmock.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/positioner/positioner.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<RunSheetRow> some_sheet(std::uint64_t seed = 3) {
  return make_run_sheet(standard_design(12), 1, seed);
}

Eigen::Matrix3d table_from_cube(const RunSheetRow& row) {
  return Positioner().rotation_table_from_positioner(row.entry.point);
}

// Readings of an accelerometer with bias and gain errors in the seats of a sheet.
Eigen::MatrixX3d readings_of(const std::vector<RunSheetRow>& sheet) {
  Eigen::MatrixX3d means(static_cast<Eigen::Index>(sheet.size()), 3);
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    const Eigen::Vector3d up = table_from_cube(sheet[i]).transpose() * Eigen::Vector3d::UnitZ();
    means.row(static_cast<Eigen::Index>(i)) =
        (Eigen::Vector3d(200.0, -300.0, 500.0) +
         Eigen::Vector3d(1000.0, 1100.0, 900.0).cwiseProduct(up))
            .transpose();
  }
  return means;
}

TEST(RestingFaces, AreSeenInSpiteOfBiasAndGain) {
  const std::vector<RunSheetRow> sheet = some_sheet();
  const auto faces = resting_faces(readings_of(sheet));
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    EXPECT_EQ(faces[i], sheet[i].entry.point.rest()) << i;
  }
}

// Readings of any instrument in a field that is fixed in the table, at the levels of the sheet.
Eigen::MatrixXd readings_in(const std::vector<RunSheetRow>& sheet,
                            const Eigen::Vector3d& field,
                            const Eigen::MatrixXd& sensitivity,
                            double noise,
                            std::uint64_t seed) {
  RandomStream random(seed);
  Eigen::MatrixXd means(static_cast<Eigen::Index>(sheet.size()), sensitivity.rows());
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    const Eigen::VectorXd v = sensitivity * (sheet[i].entry.level.of_all() *
                                             (table_from_cube(sheet[i]).transpose() * field));
    for (Eigen::Index k = 0; k < v.size(); ++k) {
      means(static_cast<Eigen::Index>(i), k) = 3.0 + v(k) + noise * random.normal();
    }
  }
  return means;
}

TEST(LabelByPlan, TrustsTheSheetsOrderForAnyInstrument) {
  const Eigen::MatrixXd three = Eigen::MatrixXd::Identity(3, 3);
  const Eigen::MatrixXd one = three.row(2);
  const Eigen::Vector3d compass(0.3, 0.35, -0.89);
  const Eigen::Vector3d earth_rate(0.5, 0.45, 0.74);
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const std::vector<RunSheetRow> sheet = some_sheet(seed);
    for (const auto& [field, sensitivity] :
         std::vector<std::pair<Eigen::Vector3d, Eigen::MatrixXd>>{
             {compass, three},
             {earth_rate, three},
             {Eigen::Vector3d::UnitZ(), one},
             {Eigen::Vector3d::UnitZ(), three}}) {
      const SeatLabels labels =
          label_by_plan(readings_in(sheet, field, sensitivity, 1e-3, seed), sheet, false);
      ASSERT_EQ(labels.points.size(), sheet.size());
      EXPECT_THAT(labels.messages, IsEmpty());
      for (std::size_t i = 0; i < sheet.size(); ++i) {
        EXPECT_EQ(labels.points[i], sheet[i].entry.point) << i;
      }
    }
    std::vector<DesignEntry> steps;
    for (const DesignEntry& entry : standard_design(12)) {
      for (const double level : {-1.0, 0.0, 1.0}) {
        steps.push_back({.point = entry.point, .level = level});
      }
    }
    const std::vector<RunSheetRow> turntable = make_run_sheet(steps, 1, seed);
    const SeatLabels labels = label_by_plan(
        readings_in(turntable, Eigen::Vector3d::UnitZ(), three, 1e-3, seed), turntable, false);
    for (std::size_t i = 0; i < turntable.size(); ++i) {
      EXPECT_EQ(labels.rows[i], i);
    }
  }
}

TEST(LabelByPlan, SaysWhatDoesNotFitAndRefusesToGuess) {
  const std::vector<RunSheetRow> sheet = some_sheet();
  const Eigen::Vector3d compass(0.3, 0.35, -0.89);
  const Eigen::MatrixXd three = Eigen::MatrixXd::Identity(3, 3);
  Eigen::MatrixXd means = readings_in(sheet, compass, three, 1e-3, 1);
  const Eigen::RowVectorXd other = means.row(0) * -0.7 + means.row(1) * 0.2;
  means.row(5) = other;
  EXPECT_GT(misfit_of_order(means, sheet).value(), 0.02);
  EXPECT_THAT(label_by_plan(means, sheet, false).messages,
              ElementsAre(HasSubstr("do not agree with the order of the sheet")));
  EXPECT_THAT(test::complaint_of<RefusedError>(
                  [&] { static_cast<void>(label_by_plan(means.topRows(11), sheet, false)); }),
              HasSubstr("11 rests, but the sheet has 12 rows"));
}

TEST(RestingFaces, AreNoneOnAnEdgeAndRefusedWhereAnAxisWasNeverTurned) {
  Eigen::MatrixX3d means = readings_of(some_sheet());
  means.row(4) = Eigen::RowVector3d(200.0 + 707.0, -300.0 + 777.0, 500.0);
  EXPECT_FALSE(resting_faces(means)[4].has_value());
  EXPECT_THAT(test::complaint_of<RefusedError>([] {
                Eigen::MatrixX3d flat(4, 3);
                flat << 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0;
                static_cast<void>(resting_faces(flat));
              }),
              HasSubstr("axis z has no rests in both directions"));
  EXPECT_THAT(test::complaint_of<RefusedError>([] {
                Eigen::MatrixX3d one_of_each(3, 3);
                one_of_each << 1, 0, 0, 0, 1, 0, 0, 0, 1;
                static_cast<void>(resting_faces(one_of_each));
              }),
              HasSubstr("because opposite faces"));
}

TEST(LabelBySheet, FollowsTheSheet) {
  const std::vector<RunSheetRow> sheet = some_sheet();
  const SeatLabels labels = label_by_sheet(resting_faces(readings_of(sheet)), sheet);
  EXPECT_THAT(labels.messages, IsEmpty());
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    EXPECT_EQ(labels.points[i], sheet[i].entry.point);
    EXPECT_EQ(labels.rows[i], i);
  }
}

// One seat is left out, one is taken twice, and one is on the wrong face. Each is reported, and the
// other rests get their rows.
TEST(LabelBySheet, SaysWhichSeatsDoNotFit) {
  const std::vector<RunSheetRow> sheet = some_sheet();
  std::vector<RunSheetRow> skipped = sheet;
  skipped.erase(skipped.begin() + 5);
  const SeatLabels without = label_by_sheet(
      [&] {
        std::vector<std::optional<Face>> faces;
        for (const RunSheetRow& row : skipped) {
          faces.emplace_back(row.entry.point.rest());
        }
        return faces;
      }(),
      sheet);
  ASSERT_EQ(without.messages.size(), 1U);
  EXPECT_THAT(without.messages[0], HasSubstr("of the sheet"));
  EXPECT_THAT(without.messages[0], HasSubstr("is not in the log"));
  EXPECT_EQ(without.rows.back(), 11U);

  std::vector<std::optional<Face>> faces;
  for (const RunSheetRow& row : sheet) {
    faces.emplace_back(row.entry.point.rest());
  }
  std::vector<std::optional<Face>> twice = faces;
  twice.insert(twice.begin(), opposite(*faces[0]));
  const SeatLabels extra = label_by_sheet(twice, sheet);
  ASSERT_EQ(extra.messages.size(), 1U);
  EXPECT_THAT(extra.messages[0], HasSubstr("agrees with no row of the sheet and is left out"));
  EXPECT_FALSE(extra.points[0].has_value());
  EXPECT_EQ(extra.rows[1], 0U);

  faces[7] = opposite(*faces[7]);
  const SeatLabels wrong = label_by_sheet(faces, sheet);
  ASSERT_EQ(wrong.messages.size(), 1U);
  EXPECT_THAT(wrong.messages[0], HasSubstr("run 8 (rest 8): the sheet states rest "));
  EXPECT_EQ(wrong.points[7], sheet[7].entry.point);
}

TEST(LabelByTurns, FindsTheFenceFaces) {
  const std::vector<RunSheetRow> sheet = some_sheet(9);
  RandomStream random(2);
  std::vector<Eigen::Matrix3d> turns;
  for (std::size_t i = 0; i + 1 < sheet.size(); ++i) {
    // An integrated gyroscope has errors of some degrees.
    const Eigen::Vector3d error = random.normals<3>();
    turns.emplace_back(table_from_cube(sheet[i]).transpose() * table_from_cube(sheet[i + 1]) *
                       Eigen::AngleAxisd(0.05 * error.norm(), error.normalized()));
  }
  const auto faces = resting_faces(readings_of(sheet));
  const SeatLabels labels = label_by_turns(faces, turns, sheet[0].entry.point);
  EXPECT_THAT(labels.messages, IsEmpty());
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    EXPECT_EQ(labels.points[i], sheet[i].entry.point) << i;
  }
  turns[3] = turns[3] * Eigen::AngleAxisd(0.8, Eigen::Vector3d::UnitX());
  const SeatLabels off = label_by_turns(faces, turns, sheet[0].entry.point);
  EXPECT_THAT(off.messages,
              testing::Contains(HasSubstr("degrees from the nearest possible design point")));
  EXPECT_FALSE(off.points[4].has_value());
}

TEST(LabelByHeading, FindsTheFenceFaces) {
  const std::vector<RunSheetRow> sheet = some_sheet(5);
  Eigen::MatrixX3d ups(12, 3);
  Eigen::MatrixX3d fields(12, 3);
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    const Eigen::Matrix3d cube_from_table = table_from_cube(sheet[i]).transpose();
    ups.row(static_cast<Eigen::Index>(i)) = cube_from_table.col(2).transpose();
    fields.row(static_cast<Eigen::Index>(i)) =
        (cube_from_table * Eigen::Vector3d(12.0, 14.0, -40.0) + Eigen::Vector3d(2, -1, 1))
            .transpose();
  }
  const SeatLabels labels =
      label_by_heading(resting_faces(readings_of(sheet)), ups, fields, sheet[0].entry.point);
  EXPECT_THAT(labels.messages, IsEmpty());
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    EXPECT_EQ(labels.points[i], sheet[i].entry.point) << i;
  }
  std::vector<std::optional<Face>> faces = resting_faces(readings_of(sheet));
  faces[3].reset();
  EXPECT_THAT(label_by_heading(faces, ups, fields, sheet[0].entry.point).messages,
              ElementsAre(HasSubstr("rest 4 is unknown: the accelerometer shows no face")));
}

TEST(LabelByOrder, TakesTheFencesInTurn) {
  const SeatLabels labels =
      label_by_order({Face::plus_x, Face::minus_z, std::nullopt, Face::plus_x, Face::minus_z});
  EXPECT_EQ(labels.points[0], DesignPoint(Face::plus_x, Face::plus_y));
  EXPECT_EQ(labels.points[1], DesignPoint(Face::minus_z, Face::plus_x));
  EXPECT_FALSE(labels.points[2].has_value());
  EXPECT_EQ(labels.points[3], DesignPoint(Face::plus_x, Face::minus_y));
  EXPECT_EQ(labels.points[4], DesignPoint(Face::minus_z, Face::minus_x));
  EXPECT_THAT(labels.messages,
              ElementsAre(HasSubstr("rest 3 is unknown: the accelerometer shows no face")));
}

}  // namespace
}  // namespace axiscal
