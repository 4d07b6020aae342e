// SPDX-License-Identifier: Apache-2.0
// Small plain runs have equations of their own: they say what those of any run say.
#include "axiscal/calib/small_run.hpp"

#include <cmath>
#include <optional>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "axiscal/calib/deletion_fit.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/generalized_fit.hpp"
#include "axiscal/calib/levelness_test.hpp"
#include "axiscal/calib/linearised_run.hpp"
#include "axiscal/calib/parameter_names.hpp"
#include "axiscal/calib/scaled_qr.hpp"
#include "axiscal/calib/state_of_run.hpp"
#include "axiscal/core/random.hpp"
#include "clear_run.hpp"
#include "detection.hpp"
#include "labelled_set.hpp"
#include "scatter_components.hpp"

namespace axiscal {
namespace {

// Good runs, and those with a mistake that may be large or hardly seen.
ReadingSet some_run(std::uint64_t seed, int orientations) {
  ReadingSet set =
      test::labelled_set(test::some_response(), test::gravity_in_table(test::sloping_gravity),
                         standard_design(orientations), 1e-3, seed);
  if (seed % 3 == 1) {
    set.response(static_cast<Eigen::Index>(seed % 11), static_cast<Eigen::Index>(seed % 2)) +=
        1e-3 * static_cast<double>(seed % 7);
  } else if (seed % 3 == 2) {
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      set.response.row(i).array() += 1e-4 * static_cast<double>(seed % 5) * static_cast<double>(i);
    }
  }
  return set;
}

// The same readings, which are plain no more.
ReadingSet not_plain(ReadingSet set) {
  set.weights *= 1.0 + 1e-13;
  return set;
}

// Each run at the field that is fitted, or with the field given.
template <typename Check>
void for_some_runs(const Check& check) {
  for (const int orientations : {12, 24}) {
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
      for (const bool known : {true, false}) {
        SCOPED_TRACE(testing::Message() << orientations << " orientations, seed " << seed
                                        << (known ? ", field given" : ", field fitted"));
        const ReadingSet set = some_run(seed, orientations);
        const ReadingSet other = not_plain(set);
        const Estimate estimate =
            known ? estimate_known(set, test::gravity_in_table(test::sloping_gravity))
                  : estimate_joint(set);
        StateOfRun small(set, known);
        StateOfRun any(other, known);
        ASSERT_NE(small.small(estimate.field), nullptr);
        ASSERT_EQ(any.small(estimate.field), nullptr);
        check(small, any, estimate);
      }
    }
  }
}

TEST(SmallRun, IsTheLinearisedRun) {
  for_some_runs([](StateOfRun& small, StateOfRun& any, const Estimate& estimate) {
    const LinearisedRun run(any, estimate);
    const SmallRun same(*small.small(estimate.field), estimate.statistics.residual_sd,
                        !small.known_field());
    EXPECT_TRUE(same.is_determined());
    EXPECT_DOUBLE_EQ(same.degrees_of_freedom(), run.degrees_of_freedom());
    for (Eigen::Index k = 0; k < 3; ++k) {
      for (Eigen::Index i = 0; i < run.readings(); ++i) {
        EXPECT_NEAR(same.residual(i, k), run.residual(i, k), 1e-8);
      }
      const Eigen::MatrixXd of_small = same.shared_basis_of_axis(k);
      const Eigen::MatrixXd of_any = run.shared_basis_of_axis(k);
      EXPECT_LT((of_small * of_small.transpose() - of_any * of_any.transpose()).norm(), 1e-9);
    }
    if (!small.known_field()) {
      EXPECT_NEAR(same.small_condition().value(), condition_of(run.columns()), 1e-10);
    }
  });
}

TEST(SmallRun, JudgesItsReadingsByTheOthersAlike) {
  for_some_runs([](StateOfRun& small, StateOfRun& any, const Estimate& estimate) {
    const DeletionFit own(small, estimate.field);
    const DeletionFit general(any, estimate.field);
    const std::vector<std::vector<std::size_t>> some = {{0, 1}, {3, 7}, {2, 5, 6, 8}};
    for (const std::vector<std::size_t>& readings : some) {
      const auto d = static_cast<Eigen::Index>(readings.size());
      Eigen::MatrixXd contrasts = Eigen::MatrixXd::Zero(d / 2, d);
      for (Eigen::Index q = 0; q < d / 2; ++q) {
        contrasts.row(q).segment<2>(2 * q) << 0.5, -0.5;
      }
      const std::optional<double> p = general.p_value(readings, contrasts);
      const std::optional<double> of_small = own.p_value(readings, contrasts);
      ASSERT_EQ(p.has_value(), of_small.has_value());
      if (p) {
        EXPECT_NEAR(*of_small, *p, 1e-5 * *p);
      }
    }
  });
}

// What is roughly unlikely is so: a face that is passed over is none that would be the least
// likely.
TEST(SmallRun, SaysRoughlyHowUnlikelyReadingsAre) {
  int asked = 0;
  for_some_runs([&](StateOfRun& small, StateOfRun&, const Estimate& estimate) {
    const DeletionFit own(small, estimate.field);
    const Eigen::MatrixXd contrast = Eigen::RowVector2d(0.5, -0.5);
    for (std::size_t i = 0; i + 1 < static_cast<std::size_t>(small.set().size()); ++i) {
      const std::vector<std::size_t> readings = {i, i + 1};
      const std::optional<double> roughly = own.rough_p_value(readings, contrast);
      EXPECT_FALSE(roughly && small.known_field());
      if (roughly) {
        const double p = own.p_value(readings, contrast).value();
        EXPECT_LT(*roughly, 1.2 * p + 0.04);
        EXPECT_GT(*roughly, p / 1.2 - 0.04);
        ++asked;
      }
    }
  });
  EXPECT_GT(asked, 1000);
}

// Axes of unlike noise, whose variances are found in many steps.
TEST(SmallRun, SaysSoOfAxesThatScatterUnlike) {
  const Eigen::MatrixXd contrast = Eigen::RowVector2d(0.5, -0.5);
  int asked = 0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    SCOPED_TRACE(seed);
    RandomStream random(seed, 9);
    ReadingSet set =
        test::labelled_set(test::some_response(), test::gravity_in_table(test::sloping_gravity),
                           standard_design(12), 1e-4, seed);
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double sd = 1e-3 * std::pow(10.0, 2.0 * random.uniform() - 1.0);
      for (Eigen::Index i = 0; i < set.size(); ++i) {
        set.response(i, k) += sd * random.normal();
      }
    }
    const Estimate estimate = estimate_joint(set);
    StateOfRun run(set, false);
    const DeletionFit own(run, estimate.field);
    for (std::size_t i = 0; i + 1 < static_cast<std::size_t>(set.size()); i += 3) {
      const std::vector<std::size_t> readings = {i, i + 1};
      const std::optional<double> roughly = own.rough_p_value(readings, contrast);
      const std::optional<double> p = own.p_value(readings, contrast);
      EXPECT_FALSE(roughly && !p);
      if (roughly && p) {
        EXPECT_LT(*roughly, 1.2 * *p + 0.04);
        EXPECT_GT(*roughly, *p / 1.2 - 0.04);
        ++asked;
      }
    }
  }
  EXPECT_GT(asked, 1200);
}

TEST(SmallRun, IsAsLevel) {
  int unlevel = 0;
  for_some_runs([&](StateOfRun& small, StateOfRun& any, const Estimate& estimate) {
    Estimate own = estimate;
    Estimate general = estimate;
    test_levelness(small, own);
    test_levelness(any, general);
    EXPECT_NEAR(own.levelness->p_value, general.levelness->p_value,
                1e-5 * general.levelness->p_value);
    ASSERT_EQ(own.levelness->suspect.has_value(), general.levelness->suspect.has_value());
    if (own.levelness->suspect) {
      EXPECT_EQ(own.levelness->suspect->point, general.levelness->suspect->point);
      ++unlevel;
    }
  });
  EXPECT_GT(unlevel, 0);
}

TEST(SmallRun, BendsAlike) {
  for_some_runs([](StateOfRun& small, StateOfRun& any, const Estimate& estimate) {
    const Method method = small.known_field() ? Method::known : Method::joint;
    const std::optional<CurvatureTest> own = test_curvature({}, small, method, estimate);
    const std::optional<CurvatureTest> general = test_curvature({}, any, method, estimate);
    ASSERT_TRUE(own && general);
    EXPECT_NEAR(own->p_value, general->p_value, 1e-8 * general->p_value);
    EXPECT_LT((own->bends - general->bends).norm(), 1e-8 * general->bends.norm());
  });
}

TEST(SmallRun, IsSolvedForItsFieldAlike) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    const ReadingSet set = some_run(seed, seed % 2 == 0 ? 12 : 24);
    const Estimate own = estimate_joint(set);
    const Estimate general = estimate_joint(not_plain(set));
    EXPECT_LT((own.field.vector(0) - general.field.vector(0)).norm(), 1e-9);
    EXPECT_LT((own.response.sensitivity - general.response.sensitivity).norm(), 1e-9);
    EXPECT_LT((own.statistics.residual_sd - general.statistics.residual_sd).norm(),
              1e-6 * general.statistics.residual_sd.norm());
    EXPECT_NEAR(own.statistics.condition_number, general.statistics.condition_number, 1e-8);
  }
}

TEST(SmallRun, IsClearOnlyWhereNothingIsFound) {
  int clear = 0;
  int bad = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE(seed);
    const ReadingSet set = some_run(seed, 12);
    const Estimate estimate = estimate_joint(set);
    StateOfRun state(set, false);
    const bool is_clear = looks_clearly_good(*state.small(estimate.field), true);
    const bool is_bad = looks_bad(SuspectRun(set, estimate, false));
    EXPECT_FALSE(is_clear && is_bad);
    EXPECT_FALSE(looks_clearly_good(*state.small(estimate.field), false) &&
                 looks_bad(SuspectRun(set, estimate, true)));
    clear += is_clear ? 1 : 0;
    bad += is_bad ? 1 : 0;
  }
  // Most good runs are clear, and the mistakes are not.
  EXPECT_GT(clear, 100);
  EXPECT_GT(bad, 60);
}

// Readings whose field jitters, or wanders, or whose noise is alike from one to the next.
ReadingSet disturbed_run(std::uint64_t seed, int orientations) {
  ReadingSet set =
      test::labelled_set(test::some_response(), test::gravity_in_table(test::sloping_gravity),
                         standard_design(orientations), 1e-3, seed);
  RandomStream random(seed, 1);
  const double jitter = 1e-3 * static_cast<double>(seed % 4 == 1 ? seed % 5 : 0);
  const double wander = 1e-3 * static_cast<double>(seed % 4 == 2 ? seed % 5 : 0);
  const double alike = 1e-3 * static_cast<double>(seed % 4 == 3 ? seed % 5 : 0);
  double size = 0.0;
  Eigen::RowVector3d noise = Eigen::RowVector3d::Zero();
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    size = 0.9 * size + wander * random.normal();
    for (double& one : noise) {
      one = 0.8 * one + alike * random.normal();
    }
    set.response.row(i) *= 1.0 + jitter * random.normal() + size;
    set.response.row(i) += noise;
  }
  return set;
}

TEST(SmallRun, HasNoFieldScatterOnlyWhereNoneIsFound) {
  int clear = 0;
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    for (const bool known : {true, false}) {
      SCOPED_TRACE(testing::Message() << seed << (known ? ", field given" : ", field fitted"));
      const ReadingSet set = disturbed_run(seed, seed % 3 == 0 ? 24 : 12);
      Estimate estimate = known ? estimate_known(set, test::gravity_in_table(test::sloping_gravity))
                                : estimate_joint(set);
      fill_intervals(estimate.statistics);
      StateOfRun state(set, known);
      const bool is_clear = has_clearly_no_field_scatter(*state.small(estimate.field), estimate);
      const Eigen::VectorXd before = estimate.statistics.interval_95;
      add_field_scatter(LinearisedRun(state, estimate), false, estimate);
      const bool is_found = estimate.statistics.interval_95 != before;
      EXPECT_FALSE(is_clear && is_found);
      clear += is_clear ? 1 : 0;
      found += is_found ? 1 : 0;
    }
  }
  EXPECT_GT(clear, 100);
  EXPECT_GT(found, 60);
}

TEST(SmallRun, IsAlikeFromReadingToReadingAsAnyRun) {
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    const ReadingSet set = disturbed_run(seed, 12);
    const ReadingSet other = not_plain(set);
    Estimate own = estimate_joint(set);
    fill_intervals(own.statistics);
    Estimate general = own;
    StateOfRun small(set, false);
    StateOfRun any(other, false);
    ASSERT_NE(small.small(own.field), nullptr);
    add_serial_correlation(small, own);
    add_serial_correlation(any, general);
    EXPECT_EQ(own.notes.size(), general.notes.size());
    EXPECT_LT((own.response.bias - general.response.bias).norm(), 1e-9);
    found += own.notes.empty() ? 0 : 1;
  }
  EXPECT_GT(found, 10);
}

TEST(SmallRun, IsNoRunWithMoreToIt) {
  const ReadingSet plain = some_run(3, 12);
  EXPECT_TRUE(SmallState::can_be(plain));
  EXPECT_FALSE(SmallState::can_be(not_plain(plain)));
  ReadingSet robust = plain;
  robust.robust = true;
  EXPECT_FALSE(SmallState::can_be(robust));
  ReadingSet drifting = plain;
  drifting.effects.columns = Eigen::VectorXd::LinSpaced(plain.size(), -0.5, 0.5);
  EXPECT_FALSE(SmallState::can_be(drifting));
  ReadingSet left_out = plain;
  left_out.weights(2, 1) = 0.0;
  EXPECT_FALSE(SmallState::can_be(left_out));
}

}  // namespace
}  // namespace axiscal
