// SPDX-License-Identifier: Apache-2.0
// Each kind of mistake is put into good readings. The tests expect that it is named and that its
// correction gives the true coefficients.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <set>
#include <span>
#include <string>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"
#include "calib/fit/estimation.hpp"
#include "calib/mistakes/culprit.hpp"
#include "calib/mistakes/src/mistake_kind.hpp"
#include "labelled_set.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

constexpr double kinds_noise = 1e-4;

enum class SmallRun { three_axes, one_axis, two_blocks };

LinearResponse truth_in(SmallRun setup) {
  LinearResponse response = test::some_response();
  if (setup == SmallRun::one_axis) {
    response.bias = response.bias.head(1).eval();
    response.sensitivity = response.sensitivity.topRows(1).eval();
  }
  return response;
}

// The field after the table was levelled again. Its length does not change.
Eigen::Vector3d levelled_again() {
  return test::sloping_gravity.norm() * Eigen::Vector3d(-0.002, 0.004, 1.0).normalized();
}

// True b and S of all axes, 4 x m.
Eigen::MatrixXd true_coefficients(SmallRun setup) {
  const LinearResponse response = truth_in(setup);
  Eigen::MatrixXd all(4, response.bias.size());
  all.row(0) = response.bias.transpose();
  all.bottomRows(3) = response.sensitivity.transpose();
  return all;
}

// Adds the effect of a change `by` of the field in the table to reading i.
void move_field(ReadingSet& set,
                const LinearResponse& truth,
                std::size_t i,
                const Eigen::Vector3d& by) {
  set.response.row(static_cast<Eigen::Index>(i)) +=
      (truth.sensitivity * (set.rotation_sensor_from_table[i] * by)).transpose();
}

// A good run in random order. If it has two blocks, the table has another slope in the second
// block.
ReadingSet kinds_run(SmallRun setup, int points, std::uint64_t seed) {
  std::vector<DesignEntry> design = standard_design(points);
  RandomStream(seed, 1).shuffle(std::span(design));
  ReadingSet set = test::labelled_set(
      truth_in(setup), test::gravity_in_table(test::sloping_gravity), design, kinds_noise, seed);
  if (setup == SmallRun::two_blocks) {
    for (std::size_t i = set.readings.size() / 2; i < set.readings.size(); ++i) {
      set.readings[i].block = 2;
      move_field(set, truth_in(setup), i, levelled_again() - test::sloping_gravity);
    }
    set.field = set.field.tilted_by_block({1, 2}).with_all(test::sloping_gravity);
  }
  return set;
}

struct PutMistake {
  const char* name;
  MistakeKind (*kind)();
  WarningCode code;
  bool of_one_axis;  // true if one axis is enough to show it
  bool mends;        // true if corrected readings are good
  // Puts the mistake into a good run at reading i. @return the runs that must be named.
  std::vector<int> (*put)(ReadingSet& set, const LinearResponse& truth, std::size_t i);
};

void relabel(ReadingSet& set, std::size_t i, const DesignPoint& point) {
  set.readings[i].point = point;
  set.rotation_sensor_from_table.put(i, set.orientation(point));
}

// @return the first reading from i on, cyclically, for which `is_true` holds.
std::size_t first_from(const ReadingSet& set,
                       std::size_t i,
                       const std::function<bool(Eigen::Index)>& is_true) {
  for (std::size_t at = 0; at < set.readings.size(); ++at) {
    const std::size_t j = (i + at) % set.readings.size();
    if (is_true(static_cast<Eigen::Index>(j))) {
      return j;
    }
  }
  ADD_FAILURE() << "no such reading";
  return i;
}

std::vector<int> put_upside_down(ReadingSet& set, const LinearResponse&, std::size_t i) {
  const DesignPoint point = *set.readings[i].point;
  relabel(set, i, {opposite(point.rest()), point.fence()});
  return {set.readings[i].run};
}

// The reading must have its first axis in the table's plane, so that the axis responds to the
// slope.
std::vector<int> put_turned_round(ReadingSet& set, const LinearResponse&, std::size_t i) {
  i = first_from(set, i, [&](Eigen::Index j) { return std::abs(set.response(j, 0)) < 1.0; });
  relabel(set, i, set.readings[i].point->turned_round());
  return {set.readings[i].run};
}

std::vector<int> put_columns(ReadingSet& set, const LinearResponse&, std::size_t i) {
  i = first_from(set, i, [&](Eigen::Index j) {
    return std::abs(set.response(j, 0) - set.response(j, 1)) > 1.0;
  });
  const auto row = static_cast<Eigen::Index>(i);
  std::swap(set.response(row, 0), set.response(row, 1));
  return {set.readings[i].run};
}

std::vector<int> put_sign(ReadingSet& set, const LinearResponse&, std::size_t i) {
  i = first_from(set, i, [&](Eigen::Index j) { return std::abs(set.response(j, 0)) > 1.0; });
  set.response(static_cast<Eigen::Index>(i), 0) *= -1.0;
  return {set.readings[i].run};
}

std::vector<int> put_factor(ReadingSet& set, const LinearResponse&, std::size_t i) {
  set.response.row(static_cast<Eigen::Index>(i)) /= standard_gravity;
  return {set.readings[i].run};
}

std::vector<int> put_outlier(ReadingSet& set, const LinearResponse&, std::size_t i) {
  set.response.row(static_cast<Eigen::Index>(i)) +=
      Eigen::RowVector3d(0.37, -0.61, 0.23).head(set.axis_count());
  return {set.readings[i].run};
}

std::vector<int> put_two_outliers(ReadingSet& set, const LinearResponse& truth, std::size_t i) {
  const std::size_t j = (i + 5) % set.readings.size();
  put_outlier(set, truth, i);
  set.response.row(static_cast<Eigen::Index>(j)) -=
      Eigen::RowVector3d(0.29, 0.17, -0.53).head(set.axis_count());
  return {set.readings[std::min(i, j)].run, set.readings[std::max(i, j)].run};
}

std::vector<int> put_exchanged(ReadingSet& set, const LinearResponse&, std::size_t i) {
  const auto row = static_cast<Eigen::Index>(i);
  const auto other = static_cast<Eigen::Index>(first_from(set, i, [&](Eigen::Index j) {
    return std::abs(set.response(j, 0) - set.response(row, 0)) > 1.0;
  }));
  set.response.row(row).swap(set.response.row(other));
  return {static_cast<int>(std::min(row, other)) + 1, static_cast<int>(std::max(row, other)) + 1};
}

std::vector<int> put_repeat(ReadingSet& set, const LinearResponse&, std::size_t i) {
  const std::size_t other = first_from(set, i + 1, [&](Eigen::Index j) {
    return set.readings[static_cast<std::size_t>(j)].point->rest() != set.readings[i].point->rest();
  });
  set.response.row(static_cast<Eigen::Index>(i)) =
      set.response.row(static_cast<Eigen::Index>(other)).eval();
  return {set.readings[i].run};
}

std::vector<int> put_tilt(ReadingSet& set, const LinearResponse& truth, std::size_t i) {
  const Eigen::Matrix3d turn = rotation_by(Eigen::Vector3d(6e-3, -4e-3, 0.0));
  move_field(set, truth, i, turn * test::sloping_gravity - test::sloping_gravity);
  return {set.readings[i].run};
}

// The table moves in the last quarter of the run. The first axis is in the table's plane before and
// after the move, so the pair of readings is determined.
std::vector<int> put_table_moved(ReadingSet& set, const LinearResponse& truth, std::size_t) {
  const Eigen::Matrix3d turn = rotation_by(Eigen::Vector3d(-1e-3, 6e-3, 0.0));
  const std::size_t cut = first_from(set, set.readings.size() * 3 / 4, [&](Eigen::Index j) {
    return j > 2 && set.response.col(0).segment(j - 1, 2).cwiseAbs().maxCoeff() < 1.0;
  });
  for (std::size_t j = cut; j < set.readings.size(); ++j) {
    move_field(set, truth, j, turn * test::sloping_gravity - test::sloping_gravity);
  }
  return {set.readings[cut - 1].run, set.readings[cut].run};
}

// A drift that is 0 in the middle of the run.
std::vector<int> put_drift(ReadingSet& set, const LinearResponse&, std::size_t) {
  const Eigen::RowVector3d whole(0.02, -0.01, 0.03);
  const auto last = static_cast<double>(set.size() - 1);
  for (Eigen::Index j = 0; j < set.size(); ++j) {
    set.response.row(j) += (static_cast<double>(j) / last - 0.5) * whole.head(set.axis_count());
  }
  return {};
}

// The readings at one end of the first axis are too small by 0.03.
std::vector<int> put_limit(ReadingSet& set, bool top) {
  std::vector<int> named;
  for (Eigen::Index j = 0; j < set.size(); ++j) {
    if (top ? set.response(j, 0) > 1.8 : set.response(j, 0) < -1.6) {
      set.response(j, 0) += top ? -0.03 : 0.03;
      named.push_back(set.readings[static_cast<std::size_t>(j)].run);
    }
  }
  return named;
}

std::vector<int> put_upper_limit(ReadingSet& set, const LinearResponse&, std::size_t) {
  return put_limit(set, true);
}

std::vector<int> put_lower_limit(ReadingSet& set, const LinearResponse&, std::size_t) {
  return put_limit(set, false);
}

// The levels are alternately -1 and 1. The label of reading i has the wrong sign.
std::vector<int> put_level(ReadingSet& set, const LinearResponse& truth, std::size_t i) {
  for (std::size_t j = 0; j < set.readings.size(); j += 2) {
    const auto row = static_cast<Eigen::Index>(j);
    set.readings[j].level = -1.0;
    set.response.row(row) = 2.0 * truth.bias.transpose() - set.response.row(row);
  }
  set.readings[i].level = -set.readings[i].level.of_all();
  return {set.readings[i].run};
}

constexpr std::array put_mistakes = {
    PutMistake{"upside_down", wrong_pose_kind, WarningCode::wrong_pose, true, true,
               put_upside_down},
    PutMistake{"turned_round", wrong_pose_kind, WarningCode::wrong_pose, true, true,
               put_turned_round},
    PutMistake{"columns", wrong_value_kind, WarningCode::columns_exchanged, false, true,
               put_columns},
    PutMistake{"sign", wrong_value_kind, WarningCode::sign, true, true, put_sign},
    PutMistake{"factor", wrong_value_kind, WarningCode::unit_factor, true, true, put_factor},
    PutMistake{"outlier", wrong_value_kind, WarningCode::outlier, true, true, put_outlier},
    PutMistake{"two_outliers", wrong_value_kind, WarningCode::outlier, false, true,
               put_two_outliers},
    PutMistake{"level", wrong_level_kind, WarningCode::wrong_level, true, true, put_level},
    PutMistake{"repeat", stuck_kind, WarningCode::stuck, false, true, put_repeat},
    PutMistake{"tilt", tilted_seat_kind, WarningCode::tilted_seat, false, true, put_tilt},
    PutMistake{"exchanged", exchanged_kind, WarningCode::exchanged, true, true, put_exchanged},
    PutMistake{"table", table_moved_kind, WarningCode::table_moved, true, false, put_table_moved},
    PutMistake{"drift", drift_kind, WarningCode::drift, true, false, put_drift},
    PutMistake{"upper_limit", saturated_kind, WarningCode::saturated, true, false, put_upper_limit},
    PutMistake{"lower_limit", saturated_kind, WarningCode::saturated, true, false, put_lower_limit},
};

// Fits the corrected readings with an unknown field.
HypothesisFit mended(ReadingSet set, const Correction& correction) {
  std::vector<std::size_t> gone;
  for (std::size_t i = 0; i < set.readings.size(); ++i) {
    const int run = set.readings[i].run;
    for (const auto& [which, point] : correction.points) {
      if (which == run) {
        relabel(set, i, point);
      }
    }
    for (const auto& [which, level] : correction.levels) {
      set.readings[i].level = which == run ? level : set.readings[i].level;
    }
    for (const auto& [which, response] : correction.responses) {
      if (which == run) {
        set.response.row(static_cast<Eigen::Index>(i)) = response;
      }
    }
    if (std::count(correction.leave_out.begin(), correction.leave_out.end(), run) > 0) {
      gone.push_back(i);
    }
  }
  HypothesisFit fit =
      HypothesisFitter(set.field, false, Eigen::VectorXd::Ones(set.axis_count())).fit(set, gone);
  fit.forget_readings();
  return fit;
}

struct KindCase {
  PutMistake mistake;
  SmallRun setup;
  int points;
};

std::vector<KindCase> kind_cases(bool searched) {
  std::vector<KindCase> all;
  for (const PutMistake& mistake : put_mistakes) {
    for (const int points : {12, 24}) {
      for (const SmallRun setup :
           {SmallRun::three_axes, SmallRun::one_axis, SmallRun::two_blocks}) {
        const bool is_shown = setup != SmallRun::one_axis || mistake.of_one_axis;
        const bool is_slow = setup == SmallRun::two_blocks &&
                             (points == 12 || (mistake.mends && mistake.kind != wrong_pose_kind));
        const bool is_again = mistake.put == put_lower_limit || mistake.put == put_two_outliers;
        if (is_shown && !(searched && (is_slow || is_again))) {
          all.push_back({mistake, setup, points});
        }
      }
    }
  }
  return all;
}

std::string name_of_case(const testing::TestParamInfo<KindCase>& info) {
  constexpr std::array setups = {"three_axes", "one_axis", "two_blocks"};
  return std::string(info.param.mistake.name) + "_" +
         setups[static_cast<std::size_t>(info.param.setup)] + "_" +
         std::to_string(info.param.points);
}

// A run with one mistake at reading 4.
class MistakeOfKind : public testing::TestWithParam<KindCase> {
 protected:
  MistakeOfKind()
      : set_(kinds_run(GetParam().setup, GetParam().points, 40)),
        named_(GetParam().mistake.put(set_, truth_in(GetParam().setup), 4)),
        estimate_(estimate_joint(set_)),
        truth_(true_coefficients(GetParam().setup)) {}

  [[nodiscard]] double error_of(const HypothesisFit& fit) const {
    return (fit.coefficients - truth_).cwiseAbs().maxCoeff();
  }

  static constexpr double small = 6.0 * kinds_noise;

  ReadingSet set_;
  std::vector<int> named_;
  Estimate estimate_;
  Eigen::MatrixXd truth_;
};

// The search takes much longer than the explanations, so it is tested on fewer runs.
class FoundMistake : public MistakeOfKind {};

TEST_P(FoundMistake, IsNamed) {
  ASSERT_TRUE(can_be_searched(set_, estimate_));
  const std::optional<Culprit> culprit = find_culprit(set_, estimate_, false).culprit;
  ASSERT_TRUE(culprit.has_value());
  ASSERT_FALSE(culprit->warnings.empty());
  EXPECT_EQ(warning_name(culprit->warnings.front().code), warning_name(GetParam().mistake.code))
      << culprit->warnings.front().message;
  if (GetParam().mistake.code == WarningCode::saturated) {
    // With u from -1 to 1 along the axis, a shift of one end is a shift of the other end plus a
    // change of the sensitivity: (u^2 + u) / 2 - (u^2 - u) / 2 = u. Either end may be named.
    EXPECT_EQ(culprit->warnings.front().runs.size(), named_.size());
    for (const int run : culprit->warnings.front().runs) {
      EXPECT_GT(std::abs(set_.response(run - 1, 0)), 1.5) << run;
    }
  } else {
    EXPECT_EQ(culprit->warnings.front().runs, named_) << culprit->warnings.front().message;
  }
  EXPECT_EQ(culprit->correction.code, culprit->warnings.front().code);
  EXPECT_GT(culprit->effect, 0.0);
  for (const CalibrationWarning& other : culprit->warnings) {
    EXPECT_TRUE(other.message.ends_with(".") || other.message.ends_with(")")) << other.message;
  }
}

TEST_P(MistakeOfKind, IsMendedByItsExplanation) {
  SuspectRun run(set_, estimate_, false);
  ASSERT_TRUE(run.plain().fitted);
  run.fit_single_deletions();
  run.fit_pair_deletions();
  Explanations found;
  const MistakeKind kind = GetParam().mistake.kind();
  // Tests the wrong reading and two good ones.
  for (const int one : {named_.empty() ? 1 : named_.front(), 2, 11}) {
    if (kind.of_reading != nullptr) {
      kind.of_reading(run, static_cast<std::size_t>(one - 1), found);
    }
  }
  if (kind.of_run != nullptr) {
    kind.of_run(run, found);
  }
  const std::vector<Explanation> ranked = std::move(found).ranked();
  ASSERT_FALSE(ranked.empty());
  EXPECT_EQ(warning_name(ranked.front().correction.code), warning_name(GetParam().mistake.code));
  const auto about_them = std::find_if(ranked.begin(), ranked.end(), [&](const Explanation& one) {
    return one.correction.runs == named_;
  });
  ASSERT_TRUE(about_them != ranked.end());
  const Explanation& best = *about_them;
  EXPECT_TRUE(about_them == ranked.begin() || best.correction.code == WarningCode::saturated);
  EXPECT_LT(error_of(best.fit), small);
  EXPECT_LT(best.fit.total(), 0.1 * run.plain().total());
  // A moved table tilts the readings but changes the coefficients little.
  if (GetParam().mistake.code != WarningCode::table_moved) {
    EXPECT_GT(error_of(run.plain()), 3.0 * error_of(best.fit));
  }
  if (GetParam().mistake.mends) {
    EXPECT_LT(error_of(mended(set_, best.correction)), small);
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, FoundMistake, testing::ValuesIn(kind_cases(true)), name_of_case);
INSTANTIATE_TEST_SUITE_P(Kinds, MistakeOfKind, testing::ValuesIn(kind_cases(false)), name_of_case);

// Mistakes in the first and the last reading: upside down, and in another unit.
TEST(KindsOfMistakes, AreFoundInAnyReading) {
  for (const std::size_t i : {0U, 11U}) {
    ReadingSet set = kinds_run(SmallRun::three_axes, 12, 50 + i);
    const int run = set.readings[i].run;
    const ReadingSet good = set;
    const auto expect_found = [&](WarningCode code) {
      const std::optional<Culprit> culprit = find_culprit(set, estimate_joint(set), false).culprit;
      ASSERT_TRUE(culprit.has_value()) << warning_name(code) << " in " << i;
      EXPECT_EQ(warning_name(culprit->correction.code), warning_name(code)) << i;
      EXPECT_EQ(culprit->correction.runs, std::vector<int>{run}) << warning_name(code);
    };
    put_upside_down(set, truth_in(SmallRun::three_axes), i);
    expect_found(WarningCode::wrong_pose);
    set = good;
    set.response.row(static_cast<Eigen::Index>(i)) *= standard_gravity;
    expect_found(WarningCode::unit_factor);
  }
}

TEST(KindsOfMistakes, DoNotAccuseGoodRuns) {
  for (const SmallRun setup : {SmallRun::three_axes, SmallRun::one_axis, SmallRun::two_blocks}) {
    for (const int points : {12, 24}) {
      int accused = 0;
      constexpr int runs = 100;
      for (int t = 0; t < runs; ++t) {
        const ReadingSet set = kinds_run(setup, points, 2000 + static_cast<std::uint64_t>(t));
        accused += find_culprit(set, estimate_joint(set), false).culprit ? 1 : 0;
      }
      EXPECT_LE(accused, 4) << static_cast<int>(setup) << ", " << points;  // expected: 1
    }
  }
}

// The order of time is that of the run numbers. Neither the order of storage nor the units change
// the result.
TEST(KindsOfMistakes, AreNamedWhateverTheOrderOfStorageAndTheUnit) {
  const std::set<std::string> some = {"turned_round", "exchanged", "table", "drift",
                                      "two_outliers"};
  for (const PutMistake& mistake : put_mistakes) {
    if (some.count(mistake.name) == 0) {
      continue;
    }
    ReadingSet set = kinds_run(SmallRun::three_axes, 24, 60);
    const std::vector<int> named = mistake.put(set, truth_in(SmallRun::three_axes), 7);
    std::vector<Eigen::Index> order(24);
    std::iota(order.begin(), order.end(), 0);
    RandomStream(61).shuffle(std::span(order));
    ReadingSet other = set;
    other.rotation_sensor_from_table.clear();
    for (std::size_t i = 0; i < order.size(); ++i) {
      const auto from = static_cast<std::size_t>(order[i]);
      other.readings[i] = set.readings[from];
      other.rotation_sensor_from_table.push_back(set.rotation_sensor_from_table[from]);
    }
    other.response = 1e3 * set.response(order, Eigen::all).eval();
    const std::optional<Culprit> culprit =
        find_culprit(other, estimate_joint(other), false).culprit;
    ASSERT_TRUE(culprit.has_value()) << mistake.name;
    EXPECT_EQ(warning_name(culprit->correction.code), warning_name(mistake.code));
    std::vector<int> found = culprit->correction.runs;
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, named) << mistake.name;
  }
}

std::vector<Explanation> explanations_of_reading(const MistakeKind& kind,
                                                 const SuspectRun& run,
                                                 std::size_t i) {
  Explanations found;
  kind.of_reading(run, i, found);
  return std::move(found).ranked();
}

TEST(KindsOfMistakes, SayNothingThatOneAxisCannotShow) {
  ReadingSet set = kinds_run(SmallRun::one_axis, 12, 70);
  set.response.row(4) = set.response.row(1).eval();
  SuspectRun run(set, estimate_joint(set), false);
  run.fit_single_deletions();
  EXPECT_TRUE(explanations_of_reading(stuck_kind(), run, 4).empty());
  EXPECT_TRUE(explanations_of_reading(tilted_seat_kind(), run, 4).empty());
  for (const Explanation& one : explanations_of_reading(wrong_value_kind(), run, 4)) {
    EXPECT_NE(one.correction.code, WarningCode::columns_exchanged);
  }
}

TEST(KindsOfMistakes, AskForLevelsOnlyWhereTheyWereSet) {
  ReadingSet set = kinds_run(SmallRun::three_axes, 12, 71);
  SuspectRun all_at_one(set, estimate_joint(set), false);
  all_at_one.fit_single_deletions();
  EXPECT_TRUE(explanations_of_reading(wrong_level_kind(), all_at_one, 4).empty());
  set.readings[3].level = 0.5;
  set.response.row(3) = 0.5 * (set.response.row(3) + test::some_response().bias.transpose());
  SuspectRun run(set, estimate_joint(set), false);
  run.fit_single_deletions();
  // The levels are -1, 0, 0.5 and 1. The stated one is left out.
  EXPECT_EQ(explanations_of_reading(wrong_level_kind(), run, 4).size(), 3U);
}

TEST(KindsOfMistakes, LeaveAGivenFieldWhereItIs) {
  ReadingSet set = kinds_run(SmallRun::three_axes, 12, 72);
  put_table_moved(set, test::some_response(), 0);
  const SuspectRun run(set, estimate_known(set, set.field), true);
  const MistakeKind kind = table_moved_kind();
  EXPECT_EQ(kind.quick_p(run, run.plain()), 1.0);
  int considered = 0;
  kind.detect(run, [&](const HypothesisFit&, const CandidateHypothesis&) { ++considered; });
  EXPECT_EQ(considered, 0);
  Explanations found;
  kind.of_run(run, found);
  EXPECT_TRUE(std::move(found).ranked().empty());
}

TEST(KindsOfMistakes, SayWhichReadingWasRepeated) {
  ReadingSet set = kinds_run(SmallRun::three_axes, 12, 73);
  put_repeat(set, test::some_response(), 6);
  SuspectRun run(set, estimate_joint(set), false);
  run.fit_single_deletions();
  const std::vector<Explanation> found = explanations_of_reading(stuck_kind(), run, 6);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found.front().correction.leave_out, std::vector<int>{7});
  std::size_t same = 0;
  for (std::size_t j = 0; j < 12; ++j) {
    const bool repeats =
        j != 6 && set.response.row(static_cast<Eigen::Index>(j)) == set.response.row(6);
    same = repeats ? j : same;
  }
  EXPECT_EQ(found.front().words, "without this reading: it repeats run " +
                                     std::to_string(same + 1) + " to the last digit");
  EXPECT_TRUE(explanations_of_reading(stuck_kind(), run, 5).empty());
}

// P(F(2, d) > f) = (1 + 2 f / d)^(-d / 2), hence p = (left / total)^((dof - 2) / 2).
TEST(NestedFP, AgreesWithTheClosedFormulaForTwoParameters) {
  for (const double dof : {3.0, 8.0, 21.0, 58.0}) {
    for (const double share : {0.01, 0.2, 0.5, 0.9}) {
      const double expected = std::pow(1.0 - share, 0.5 * (dof - 2.0));
      EXPECT_NEAR(nested_f_p(7.0, dof, 7.0 * share, 2.0), expected, 1e-9 * (1.0 + expected));
    }
  }
}

TEST(NestedFP, JudgesNothingThatIsNotNested) {
  EXPECT_EQ(nested_f_p(1.0, 20.0, 0.5, 0.0), 1.0);   // frees no parameter
  EXPECT_EQ(nested_f_p(1.0, 20.0, 0.0, 2.0), 1.0);   // gains 0
  EXPECT_EQ(nested_f_p(1.0, 20.0, -0.3, 2.0), 1.0);  // fits worse
  EXPECT_EQ(nested_f_p(1.0, 3.0, 0.5, 2.5), 1.0);    // leaves no degree of freedom
  EXPECT_EQ(nested_f_p(1.0, 20.0, 1.0, 2.0), 0.0);   // leaves 0
  EXPECT_EQ(nested_f_p(1.0, 20.0, std::nan(""), 2.0), 1.0);
}

// In good runs p of a nested test is uniformly distributed. If the field is known, the model is
// linear and the quick test equals the test of the fit.
TEST(NestedFP, IsUniformInGoodRuns) {
  constexpr int runs = 600;
  double sum = 0.0;
  int below = 0;
  for (int t = 0; t < runs; ++t) {
    const ReadingSet set =
        kinds_run(SmallRun::three_axes, 12, 5000 + static_cast<std::uint64_t>(t));
    const SuspectRun run(set, estimate_known(set, set.field), true);
    const MistakeKind kind = drift_kind();
    const double p = kind.quick_p(run, run.plain());
    sum += p;
    below += p < 0.1 ? 1 : 0;
    if (t % 20 == 0) {
      const HypothesisFit with = kind.of_all_axes(run);
      const double by_fit =
          nested_f_p(run.plain().total(), run.plain().dof(), run.plain().total() - with.total(),
                     run.plain().dof() - with.dof());
      EXPECT_NEAR(p, by_fit, 1e-8);
    }
  }
  EXPECT_NEAR(sum / runs, 0.5, 4.0 * std::sqrt(1.0 / 12.0 / runs));
  EXPECT_NEAR(below, 0.1 * runs, 4.0 * std::sqrt(0.09 * runs));
}

}  // namespace
}  // namespace axiscal
