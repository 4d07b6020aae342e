// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/src/groups.hpp"

#include <cstddef>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axiscal {
namespace {

using testing::ElementsAre;

TEST(Groups, AreInTheOrderOfTheirFirstMembers) {
  const std::vector<char> keys = {'b', 'a', 'b', 'x', 'c', 'a', 'b'};
  const Groups groups(
      keys.size(), [&](std::size_t i) { return keys[i]; },
      [&](std::size_t i) { return keys[i] != 'x'; });
  ASSERT_EQ(groups.size(), 3U);
  EXPECT_THAT(groups[0], ElementsAre(0, 2, 6));
  EXPECT_THAT(groups[1], ElementsAre(1, 5));
  EXPECT_THAT(groups[2], ElementsAre(4));
  EXPECT_THAT(groups.numbers(), ElementsAre(0, 1, 0, Groups::none, 2, 1, 0));
}

TEST(Groups, MayBeNone) {
  EXPECT_EQ(Groups(0, [](std::size_t) { return 0; }).size(), 0U);
  const Groups none(
      5, [](std::size_t) { return 0; }, [](std::size_t) { return false; });
  EXPECT_EQ(none.size(), 0U);
}

// Few members are searched linearly and many by a tree. Both give the same groups.
TEST(Groups, OfManyAreThoseOfFew) {
  const auto key_of = [](std::size_t i) { return std::pair(i * i % 7, i % 3 == 0); };
  const Groups few(40, key_of);
  const Groups many(400, key_of);
  ASSERT_GE(many.size(), few.size());
  for (std::size_t i = 0; i < 40; ++i) {
    EXPECT_EQ(few.numbers()[i], many.numbers()[i]);
  }
  std::size_t members = 0;
  for (std::size_t g = 0; g < many.size(); ++g) {
    members += many[g].size();
    for (const std::size_t i : many[g]) {
      EXPECT_EQ(many.numbers()[i], static_cast<int>(g));
      EXPECT_EQ(key_of(i), key_of(many[g].front()));
    }
  }
  EXPECT_EQ(members, 400U);
}

}  // namespace
}  // namespace axiscal
