// SPDX-License-Identifier: Apache-2.0
#include "calib/mistakes/src/mistake_kind.hpp"

#include <set>

#include <gtest/gtest.h>

namespace axiscal {
namespace {

TEST(MistakeKind, SaysWhatToDoForEachCodeOnce) {
  std::set<std::string_view> codes;
  for (const MistakeKind& kind : mistake_kinds()) {
    EXPECT_TRUE(kind.of_reading != nullptr || kind.of_run != nullptr);
    for (const MistakeAdvice& advice : kind.advice) {
      const std::string_view name = warning_name(advice.code);
      EXPECT_TRUE(codes.insert(name).second) << name;
      EXPECT_TRUE(advice.one.ends_with(".")) << name;
    }
  }
  // The codes of docs/messages.md that are about contradicting readings.
  EXPECT_EQ(codes, (std::set<std::string_view>{"wrong_pose", "exchanged", "columns_exchanged",
                                               "sign", "unit_factor", "outlier", "wrong_level",
                                               "stuck", "tilted_seat", "table_moved", "drift",
                                               "saturated", "bias_step", "memory"}));
}

TEST(Explanations, AreRankedByTheirLikelihood) {
  const auto fit_of = [](double rss) {
    HypothesisFit fit;
    fit.fitted = true;
    fit.rss = Eigen::Vector3d::Constant(rss);
    fit.degrees_of_freedom = Eigen::Vector3d::Constant(8.0);
    return fit;
  };
  Explanations found;
  found.add(fit_of(2.0), {}, 10.0, Correction{.code = WarningCode::stuck}, "");
  found.add(fit_of(1.0), {}, 10.0, Correction{.code = WarningCode::sign}, "");
  found.add(fit_of(1.0), {}, 20.0, Correction{.code = WarningCode::exchanged}, "");
  found.add(fit_of(2.0), {}, 10.0, Correction{.code = WarningCode::wrong_pose}, "", 100.0);
  found.add(HypothesisFit{}, {}, 1.0, Correction{.code = WarningCode::drift}, "");
  std::vector<WarningCode> codes;
  for (const Explanation& explanation : std::move(found).ranked()) {
    codes.push_back(explanation.correction.code);
  }
  EXPECT_EQ(codes, (std::vector{WarningCode::wrong_pose, WarningCode::sign, WarningCode::exchanged,
                                WarningCode::stuck}));
}

}  // namespace
}  // namespace axiscal
