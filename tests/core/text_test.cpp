// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "axiscal/core/error.hpp"
#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/version.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

constexpr std::array<std::string_view, 4> names = {"observations", "instrument", "field", "method"};

TEST(NearestName, FindsTypingErrors) {
  EXPECT_EQ(nearest_name("feild", names), "field");
  EXPECT_EQ(nearest_name("Methods", names), "method");
  EXPECT_EQ(nearest_name("observation", names), "observations");
  EXPECT_EQ(nearest_name("obser", names), "observations");
  EXPECT_EQ(nearest_name("xyz", names), "");
  EXPECT_EQ(did_you_mean("instrumnet", names), "; did you mean 'instrument'?");
  EXPECT_EQ(did_you_mean("zzz", names), "");
}

TEST(ParseTimestamp, AgreesWithKnownTimes) {
  EXPECT_EQ(parse_timestamp("1970-01-01"), 0.0);
  EXPECT_EQ(parse_timestamp("2000-01-01T00:00:00Z"), 946684800.0);
  EXPECT_EQ(parse_timestamp("2026-11-20T20:04:54.5Z"), 1795205094.5);
  EXPECT_EQ(parse_timestamp("2026-11-20 21:04:54.5+01:00"), 1795205094.5);
  EXPECT_EQ(parse_timestamp(timestamp_now()).has_value(), true);
}

TEST(ParseTimestamp, RefusesWhatIsNoTime) {
  for (const char* text : {"", "2026", "2026-13-01", "2026-02-30", "20261120", "2026-11-20T",
                           "2026-11-20T25:00", "2026-11-20T10:00:00X", "2026-11-20T10:00+1"}) {
    EXPECT_FALSE(parse_timestamp(text)) << text;
  }
}

TEST(DataError, SaysWhere) {
  EXPECT_STREQ(DataError("a.csv", "gone").what(), "a.csv: gone");
  EXPECT_STREQ(DataError("a.csv", std::size_t{7}, "bad").what(), "a.csv:7: bad");
  EXPECT_STREQ(DataError("a.json", "/field/kind", "bad").what(), "a.json: /field/kind: bad");
}

TEST(SoftwareName, HasAVersion) {
  EXPECT_EQ(software_name(), "axiscal 0.1.0");
}

}  // namespace
}  // namespace axiscal
