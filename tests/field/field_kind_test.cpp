// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/field_kind.hpp"

#include <set>

#include <gtest/gtest.h>

#include "axiscal/field/field_unit.hpp"

namespace axiscal {
namespace {

TEST(FieldKind, IsFoundByItsName) {
  std::set<std::string_view> names;
  for (const FieldKind& kind : field_kinds()) {
    EXPECT_EQ(&field_kind(kind.name), &kind);
    names.insert(kind.name);
  }
  EXPECT_EQ(names.size(), field_kinds().size());
  EXPECT_EQ(names.count("gravity"), 1U);
}

TEST(FieldKind, OfAUsersOwnKnowsNothing) {
  for (const char* const name : {"lodestone", "", "geomagnetic+induced_magnetic"}) {
    const FieldKind& kind = field_kind(name);
    EXPECT_TRUE(kind.units.empty()) << name;
    EXPECT_FALSE(kind.local || kind.vertical || kind.along_normal || kind.rotation || kind.dated)
        << name;
  }
}

TEST(FieldKind, HasUnitsOfOneQuantity) {
  for (const FieldKind& kind : field_kinds()) {
    for (const std::string_view unit : kind.units) {
      // The units `g` and `1` cannot be converted to other units.
      if (unit != "g" && unit != "1" && kind.units.front() != "g" && kind.units.front() != "1") {
        EXPECT_GT(factor_between(kind.units.front(), unit), 0.0) << kind.name;
      }
    }
  }
}

}  // namespace
}  // namespace axiscal
