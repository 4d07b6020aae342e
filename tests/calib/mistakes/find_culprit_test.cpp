// SPDX-License-Identifier: Apache-2.0
// find_culprit() on constructed sets of readings.
#include <gtest/gtest.h>

#include "calib/mistakes/culprit.hpp"
#include "calib/mistakes/src/mistake_kind.hpp"
#include "labelled_set.hpp"

namespace axiscal {
namespace {

ReadingSet good_run(std::uint64_t seed) {
  return test::labelled_set(test::some_response(), test::gravity_in_table(test::sloping_gravity),
                            standard_design(24), 1e-4, seed);
}

TEST(FindCulprit, FindsNothingInAGoodRun) {
  const ReadingSet set = good_run(3);
  const Estimate estimate = estimate_joint(set);
  ASSERT_TRUE(can_be_searched(set, estimate));
  EXPECT_FALSE(find_culprit(set, estimate, false).culprit.has_value());
}

TEST(FindCulprit, NamesAWrongPose) {
  ReadingSet set = good_run(4);
  const DesignPoint other = set.readings[9].point->turned_round();
  set.readings[9].point = other;
  set.rotation_sensor_from_table.put(9, set.orientation(other));
  const std::optional<Culprit> culprit = find_culprit(set, estimate_joint(set), false).culprit;
  ASSERT_TRUE(culprit.has_value());
  EXPECT_EQ(culprit->correction.code, WarningCode::wrong_pose);
  EXPECT_EQ(culprit->correction.runs, std::vector<int>{10});
  EXPECT_EQ(culprit->warnings.front().runs, std::vector<int>{10});
}

TEST(FindCulprit, NamesADrift) {
  ReadingSet set = good_run(5);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    set.response.row(i).array() += 4e-4 * static_cast<double>(i);
  }
  const std::optional<Culprit> culprit = find_culprit(set, estimate_joint(set), false).culprit;
  ASSERT_TRUE(culprit.has_value());
  EXPECT_EQ(culprit->correction.code, WarningCode::drift);
  EXPECT_GT(culprit->effect, 0.0);
}

// The quick test and the hypotheses of a kind detect the kind's own mistake.
TEST(MistakeKind, DetectsItsOwn) {
  ReadingSet set = good_run(6);
  for (Eigen::Index i = 12; i < set.size(); ++i) {  // the table moves by 5 mrad at reading 12
    const Eigen::Vector3d moved = test::sloping_gravity + Eigen::Vector3d(5e-3, 0.0, 0.0);
    set.response.row(i) += (test::some_response().sensitivity *
                            set.rotation_sensor_from_table[static_cast<std::size_t>(i)] *
                            (moved - test::sloping_gravity))
                               .transpose();
  }
  const SuspectRun run(set, estimate_joint(set), false);
  const MistakeKind kind = table_moved_kind();
  EXPECT_LT(kind.quick_p(run, run.plain()), 1e-6);
  double least = run.plain().total();
  kind.detect(run, [&](const HypothesisFit& with, const CandidateHypothesis& how) {
    EXPECT_GT(how.tests, 1.0);
    EXPECT_TRUE(how.of_few);
    EXPECT_LE(how.at_least, 1.0);
    least = with.fitted ? std::min(least, with.total()) : least;
  });
  EXPECT_LT(least, 0.05 * run.plain().total());
  EXPECT_GT(drift_kind().of_all_axes(run).total(), least);
}

}  // namespace
}  // namespace axiscal
