// SPDX-License-Identifier: Apache-2.0
// The starts of method joint, compared with the linear regression on [1, vec R], and its best
// solution.
#include "calib/fit/src/joint_start.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Dense>
#include <gmock/gmock.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "calib/fit/src/joint_solution.hpp"
#include "labelled_set.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

// A field that is inclined to the table. Method joint knows only its length.
const Eigen::Vector3d inclined_field(0.5, -0.6, 0.7);

TableField open_field(const Eigen::Vector3d& in_table) {
  FieldDescription field{.kind = "geomagnetic", .unit = "1", .magnitude = in_table.norm()};
  return TableField({field}).with_all(in_table);
}

ReadingSet set_in(const TableField& field, int points, double noise_sd, std::uint64_t seed = 1) {
  return test::labelled_set(test::some_response(), field, standard_design(points), noise_sd, seed);
}

std::vector<Eigen::Index> all_rows(const ReadingSet& set) {
  std::vector<Eigen::Index> rows(static_cast<std::size_t>(set.size()));
  std::iota(rows.begin(), rows.end(), 0);
  return rows;
}

// @return the angle between two lines [rad], whatever their signs.
double angle_of_lines(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  return std::acos(std::min(1.0, std::abs(a.normalized().dot(b.normalized()))));
}

TEST(LinearDirections, AreExactWithoutNoise) {
  for (const int points : {12, 24}) {
    const ReadingSet set = set_in(open_field(inclined_field), points, 0.0);
    const Eigen::VectorXd found = linear_directions(set, all_rows(set));
    ASSERT_EQ(found.size(), 3) << points;
    EXPECT_NEAR(found.norm(), 1.0, 1e-12);
    EXPECT_LT(angle_of_lines(found, inclined_field), 1e-7);
  }
}

// M_k of each axis is fitted by QR. The direction is the first right singular vector of the stacked
// M_k.
TEST(LinearDirections, AgreeWithTheSingularVectorByHand) {
  const ReadingSet set = set_in(open_field(inclined_field), 24, 0.05);
  Eigen::MatrixXd X(24, 10);
  for (Eigen::Index i = 0; i < 24; ++i) {
    const Eigen::Matrix3d& R = set.rotation_sensor_from_table[static_cast<std::size_t>(i)];
    X(i, 0) = 1.0;
    for (Eigen::Index a = 0; a < 3; ++a) {
      for (Eigen::Index b = 0; b < 3; ++b) {
        X(i, 1 + 3 * a + b) = R(a, b);
      }
    }
  }
  Eigen::Matrix3d sums = Eigen::Matrix3d::Zero();
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::VectorXd x = X.colPivHouseholderQr().solve(set.response.col(k));
    Eigen::Matrix3d M;
    M << x(1), x(2), x(3), x(4), x(5), x(6), x(7), x(8), x(9);
    sums += M.transpose() * M;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(sums);
  const Eigen::Vector3d expected = eigen.eigenvectors().col(2);
  EXPECT_LT(angle_of_lines(linear_directions(set, all_rows(set)), expected), 1e-7);
  EXPECT_GT(angle_of_lines(expected, inclined_field), 1e-4);
}

// The rank is below 10 with six points, and with nine used readings of 24.
TEST(LinearDirections, AreNoneIfTheRankIsLess) {
  const ReadingSet six = set_in(open_field(inclined_field), 6, 0.0);
  EXPECT_EQ(linear_directions(six, all_rows(six)).size(), 0);
  ReadingSet set = set_in(open_field(inclined_field), 24, 0.0);
  std::vector<Eigen::Index> few = all_rows(set);
  few.resize(9);
  EXPECT_EQ(linear_directions(set, few).size(), 0);
  set.weights.bottomRows(15).setZero();
  EXPECT_EQ(linear_directions(set, all_rows(set)).size(), 0);
}

// An axis with too few readings is left out, and the other axes give the direction.
TEST(LinearDirections, UseTheAxesThatDetermineThem) {
  ReadingSet set = set_in(open_field(inclined_field), 24, 0.0);
  set.weights.col(1).tail(15).setZero();
  set.response.col(1).tail(15).setConstant(1e6);
  EXPECT_LT(angle_of_lines(linear_directions(set, all_rows(set)), inclined_field), 1e-7);
}

TEST(LinearDirections, DoNotDependOnTheSensorsFrame) {
  const ReadingSet set = set_in(open_field(inclined_field), 24, 0.02);
  ReadingSet turned = set;
  turned.rotation_sensor_from_table.clear();
  const Eigen::Matrix3d Q = rotation_by(Eigen::Vector3d(0.4, 0.2, -0.9));
  for (std::size_t i = 0; i < set.readings.size(); ++i) {
    turned.rotation_sensor_from_table.push_back(Q * set.rotation_sensor_from_table[i]);
  }
  const Eigen::VectorXd found = linear_directions(set, all_rows(set));
  EXPECT_LT(angle_of_lines(found, linear_directions(turned, all_rows(turned))), 1e-7);
}

TEST(LinearDirections, TurnWithTheTable) {
  const ReadingSet set = set_in(open_field(inclined_field), 24, 0.02);
  ReadingSet turned = set;
  turned.rotation_sensor_from_table.clear();
  const Eigen::Matrix3d Q = rotation_by(Eigen::Vector3d(0.4, 0.2, -0.9));
  for (std::size_t i = 0; i < set.readings.size(); ++i) {
    turned.rotation_sensor_from_table.push_back(set.rotation_sensor_from_table[i] * Q.transpose());
  }
  const Eigen::Vector3d found = linear_directions(set, all_rows(set));
  EXPECT_LT(angle_of_lines(Q * found, linear_directions(turned, all_rows(turned))), 1e-7);
}

TEST(LinearDirections, LeaveATemperatureOut) {
  ReadingSet set = set_in(open_field(inclined_field), 24, 0.0);
  set.temperature.order = 1;
  set.temperature.d.resize(24, 3);
  RandomStream random(3);
  for (Eigen::Index i = 0; i < 24; ++i) {
    set.temperature.d.row(i).setConstant(random.normal());
    set.response.row(i).array() += 0.8 * set.temperature.d(i, 0);
  }
  EXPECT_LT(angle_of_lines(linear_directions(set, all_rows(set)), inclined_field), 1e-7);
}

// A local field and an induced field. readings() has all 24 points at each level.
struct TwoParts {
  Eigen::Vector3d local{0.3, 0.1, -0.8};
  Eigen::Vector3d induced{-0.2, 1.4, 0.5};

  [[nodiscard]] TableField field() const {
    FieldDescription place{.kind = "geomagnetic", .unit = "1", .magnitude = local.norm()};
    place.set_by_level = false;
    FieldDescription coil{.kind = "induced_magnetic", .unit = "1", .magnitude = induced.norm()};
    return TableField({place, coil}).with({local, induced});
  }

  [[nodiscard]] ReadingSet readings(const std::vector<double>& levels) const {
    std::vector<DesignEntry> design;
    for (const double level : levels) {
      for (DesignEntry entry : standard_design(24)) {
        entry.level = level;
        design.push_back(entry);
      }
    }
    ReadingSet set = test::labelled_set(test::some_response(), field(), design, 0.0, 1);
    for (std::size_t i = 0; i < design.size(); ++i) {
      set.readings[i].level = design[i].level;
      const Eigen::Vector3d met = set.rotation_sensor_from_table[i] * field().at(design[i].level);
      set.response.row(static_cast<Eigen::Index>(i)) = test::some_response().at(met);
    }
    set.field = field().without_vectors();
    return set;
  }
};

TEST(LinearDirections, OfASumAreThoseOfItsParts) {
  const TwoParts parts;
  const ReadingSet set = parts.readings({1.0, 0.0, -1.0});
  const Eigen::VectorXd found = linear_directions(set, all_rows(set));
  ASSERT_EQ(found.size(), 6);
  Eigen::VectorXd both(6);
  both << parts.local, parts.induced;
  EXPECT_LT(angle_of_lines(found, both), 1e-7);
  const ReadingSet one_level = parts.readings({1.0});
  EXPECT_EQ(linear_directions(one_level, all_rows(one_level)).size(), 0);
}

TEST(StartFields, OfASumHaveTheStatedLengths) {
  const TwoParts parts;
  ReadingSet set = parts.readings({1.0, 0.0, -1.0});
  const std::vector<TableField> starts = start_fields(set);
  ASSERT_EQ(starts.size(), 1U);
  const double sign = std::copysign(1.0, starts[0].vector(0).dot(parts.local));
  EXPECT_MATRIX_NEAR(sign * starts[0].vector(0), parts.local, 1e-9);
  EXPECT_MATRIX_NEAR(sign * starts[0].vector(1), parts.induced, 1e-9);
  // If one length is unknown, it follows from the other one.
  std::vector<FieldDescription> described = set.field.parts();
  described[1].free_length = true;
  described[1].magnitude = 1.0;
  set.field = TableField(described);
  const TableField free = start_fields(set).front();
  EXPECT_NEAR(free.vector(1).norm(), parts.induced.norm(), 1e-9);
  EXPECT_NEAR(free.vector(0).norm(), parts.local.norm(), 1e-9);
}

// (S, f) and (-S, -f) fit equally well. The stated direction gives the sign.
TEST(StartFields, PointTheWayThatIsGiven) {
  for (const double sign : {1.0, -1.0}) {
    FieldDescription part{.kind = "geomagnetic", .magnitude = inclined_field.norm()};
    part.start.sign_by = sign * Eigen::Vector3d(0.1, 0.0, 1.0);
    ReadingSet set = set_in(open_field(inclined_field), 24, 1e-3);
    set.field = TableField({part});
    const std::vector<TableField> starts = start_fields(set);
    ASSERT_EQ(starts.size(), 1U);
    EXPECT_MATRIX_NEAR(sign * starts[0].vector(0), inclined_field, 5e-3);
    EXPECT_NEAR(starts[0].vector(0).norm(), inclined_field.norm(), 1e-12);
  }
}

TEST(StartFields, HaveOneVectorForEachTiltedBlock) {
  ReadingSet set = set_in(open_field(inclined_field), 24, 0.0);
  const Eigen::Vector3d second = rotation_by(Eigen::Vector3d(0.02, -0.03, 0.0)) * inclined_field;
  const Eigen::Index n = set.size();
  ReadingSet both = set;
  both.response.conservativeResize(2 * n, Eigen::NoChange);
  both.weights = Eigen::MatrixXd::Ones(2 * n, 3);
  for (std::size_t i = 0; i < set.readings.size(); ++i) {
    both.readings.push_back(set.readings[i]);
    both.readings.back().block = 2;
    both.rotation_sensor_from_table.push_back(set.rotation_sensor_from_table[i]);
    both.response.row(n + static_cast<Eigen::Index>(i)) =
        test::some_response().at(set.rotation_sensor_from_table[i] * second);
  }
  both.field = open_field(inclined_field).without_vectors().tilted_by_block({1, 2});
  const std::vector<TableField> starts = start_fields(both);
  ASSERT_EQ(starts.size(), 1U);
  const double sign = std::copysign(1.0, starts[0].vector(0).dot(inclined_field));
  EXPECT_MATRIX_NEAR(sign * starts[0].vector(0), inclined_field, 1e-9);
  EXPECT_MATRIX_NEAR(sign * starts[0].vector(1), second, 1e-9);
}

TEST(StartFields, AreAllAroundIfNobodySaysMore) {
  ReadingSet set = set_in(open_field(inclined_field), 6, 0.0);
  set.field = set.field.without_vectors();
  const std::vector<TableField> starts = start_fields(set);
  ASSERT_EQ(starts.size(), 26U);
  double nearest = 2.0;
  for (const TableField& start : starts) {
    EXPECT_NEAR(start.vector(0).norm(), inclined_field.norm(), 1e-12);
    nearest = std::min(nearest, angle_of_lines(start.vector(0), inclined_field));
  }
  EXPECT_LT(nearest, 0.5);
}

TEST(StartFields, AreTheStatedDirectionIfThereIsOne) {
  ReadingSet set = set_in(open_field(inclined_field), 6, 0.0);
  FieldDescription part{.kind = "geomagnetic", .magnitude = 3.0};
  part.in_table = Eigen::Vector3d(0.0, 3.0, 4.0);
  set.field = TableField({part});
  const std::vector<TableField> starts = start_fields(set);
  ASSERT_EQ(starts.size(), 1U);
  EXPECT_MATRIX_NEAR(starts[0].vector(0), Eigen::Vector3d(0.0, 1.8, 2.4), 1e-12);
  // If the heading is unknown, the starts are directions all around.
  part.start.has_heading = false;
  set.field = TableField({part});
  EXPECT_EQ(start_fields(set).size(), 26U);
}

// ---- the best solution ----

TEST(BestSolution, IsTheSameFromAnyStart) {
  const ReadingSet set = set_in(open_field(inclined_field), 24, 1e-3, 4);
  const Model model(set, false);
  const BestSolution linear = best_solution(set, model, start_fields(set));
  std::vector<TableField> around;
  for (const Eigen::Vector3d& direction : directions_on_sphere(26)) {
    around.push_back(set.field.with_all(inclined_field.norm() * direction));
  }
  const BestSolution searched = best_solution(set, model, around);
  EXPECT_EQ(linear.ambiguity, "");
  EXPECT_EQ(searched.ambiguity, "");
  EXPECT_LT(angle_of_lines(linear.solution.state->field().vector(0),
                           searched.solution.state->field().vector(0)),
            1e-7);
  EXPECT_LT(angle_of_lines(searched.solution.state->field().vector(0), inclined_field), 2e-3);
  EXPECT_MATRIX_NEAR(searched.solution.sigma, linear.solution.sigma, 1e-9);
}

// sigma_k^2 = RSS_k / nu_k. The sum of the nu_k is the number of values less the number of all
// unknowns.
TEST(BestSolution, WeighsAxesByTheirOwnScatter) {
  ReadingSet set = set_in(open_field(inclined_field), 24, 1e-4, 5);
  RandomStream random(6);
  for (Eigen::Index i = 0; i < 24; ++i) {
    set.response(i, 1) += 5e-3 * random.normal();
  }
  const JointSolution found = best_solution(set, Model(set, false), start_fields(set)).solution;
  EXPECT_TRUE(found.weights_are_estimated);
  EXPECT_NEAR(found.shares.degrees_of_freedom.sum(), 3.0 * 24.0 - 12.0 - 2.0, 1e-9);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const AxisSolution& axis = found.state->axes[static_cast<std::size_t>(k)];
    EXPECT_NEAR(axis.residuals.squaredNorm() / found.shares.degrees_of_freedom(k),
                found.sigma(k) * found.sigma(k), 1e-6 * found.sigma(k) * found.sigma(k))
        << k;
  }
  // The noisy axis contributes little to the direction, so it loses few degrees of freedom.
  EXPECT_GT(found.shares.degrees_of_freedom(1), 19.9);
  EXPECT_GT(found.sigma(1), 10.0 * found.sigma(0));
}

// Six points with one fence face each on a level table cannot separate a slope from changes of S.
TEST(RequireDirection, NamesThePointsThatWouldCloseIt) {
  const ReadingSet set = set_in(test::gravity_in_table(Eigen::Vector3d::UnitZ()), 6, 0.0, 7);
  JointSolution found = best_solution(set, Model(set, false), {set.field}).solution;
  found.sigma.setConstant(1e-4);
  const Fit run(set, found.state, found.sigma);
  try {
    require_direction(run, found);
    FAIL() << "a direction that is open was accepted";
  } catch (const RankDeficientError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("together"));
    EXPECT_THAT(error.what(), testing::HasSubstr("add readings at rest"));
    EXPECT_THAT(error.what(), testing::HasSubstr("method 'known'"));
    EXPECT_FALSE(error.undetermined().empty());
    EXPECT_FALSE(error.settings().empty());
  }
}

TEST(RequireDirection, AcceptsTheTwelvePoints) {
  const ReadingSet set = set_in(test::gravity_in_table(Eigen::Vector3d::UnitZ()), 12, 1e-4, 8);
  const JointSolution found = best_solution(set, Model(set, false), {set.field}).solution;
  const Fit run(set, found.state, Eigen::VectorXd::Constant(3, 1e-4));
  EXPECT_NO_THROW(require_direction(run, found));
}

TEST(RequireDegreesOfFreedom, NamesTheAxesThatLackThem) {
  const ReadingSet set = set_in(test::gravity_in_table(Eigen::Vector3d::UnitZ()), 12, 1e-4, 9);
  JointSolution found = best_solution(set, Model(set, false), {set.field}).solution;
  EXPECT_NO_THROW(require_degrees_of_freedom(set, found));
  found.shares.degrees_of_freedom(1) = 0.3;
  try {
    require_degrees_of_freedom(set, found);
    FAIL() << "an axis without degrees of freedom was accepted";
  } catch (const RankDeficientError& error) {
    EXPECT_THAT(error.undetermined(), testing::ElementsAre("y.bias", "y.sensitivity.x",
                                                           "y.sensitivity.y", "y.sensitivity.z"));
    // All 12 points are in the design, so the error names no points to add.
    EXPECT_THAT(error.what(), testing::HasSubstr("add readings, or use the method 'known'"));
  }
}

}  // namespace
}  // namespace axiscal
