// SPDX-License-Identifier: Apache-2.0
#include "axiscal/report/run_sheet_page.hpp"

#include "matchers.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;
using testing::Not;

int count_of(const std::string& text, const std::string& part) {
  int count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

TEST(SeatSvg, NamesTheFacesAsTheyAreSeen) {
  // With rest -X and fence +Y the top is +X, the front is -Y, and the right side is x = y cross z =
  // -Z.
  const std::string svg = seat_svg({Face::minus_x, Face::plus_y});
  EXPECT_THAT(svg, HasSubstr("aria-label=\"Face -X on the table, face +Y at the fence\""));
  EXPECT_THAT(svg, HasSubstr(">\u2212X on the table</text>"));
  EXPECT_THAT(svg, HasSubstr(">+Y at the fence</text>"));
  const std::size_t top = svg.find(">+X</text>");
  const std::size_t front = svg.find(">\u2212Y</text>");
  const std::size_t side = svg.find(">\u2212Z</text>");
  ASSERT_NE(top, std::string::npos);
  ASSERT_NE(front, std::string::npos);
  ASSERT_NE(side, std::string::npos);
  EXPECT_LT(top, front);
  EXPECT_LT(front, side);
}

TEST(RunSheetPage, HasAPictureForEveryStepAndNeedsNothingElse) {
  const std::vector<RunSheetRow> sheet = make_run_sheet(standard_design(12), 2, 5);
  const std::string page =
      run_sheet_page(sheet, {.kind = "accelerometer"}, "Run sheet of <QA & \"113\">");
  EXPECT_EQ(count_of(page, "<svg"), 24);
  EXPECT_EQ(count_of(page, "<li data-cells=\"1,"), 1);
  EXPECT_EQ(count_of(page, "<li data-cells="), 24);
  EXPECT_EQ(count_of(page, "data-axis"), 24 * 3 + 2)
      << "room for each axis; the script names it twice";
  EXPECT_EQ(count_of(page, "<ol>"), 2);
  EXPECT_EQ(count_of(page, "</ol>"), 2);
  EXPECT_THAT(page, HasSubstr("Run 24"));
  EXPECT_THAT(page, HasSubstr("Run sheet of &lt;QA &amp; &quot;113&quot;&gt;"));
  EXPECT_THAT(page, HasSubstr("default-src 'none'"));
  EXPECT_THAT(page, HasSubstr("script-src 'unsafe-inline'"));
  EXPECT_THAT(page, Not(HasSubstr("src=")));
  EXPECT_THAT(page, Not(HasSubstr("http:")));
  EXPECT_THAT(page, Not(HasSubstr("https:")));
  EXPECT_THAT(page, Not(HasSubstr("level ")));
}

TEST(RunSheetPage, StatesLevelsWhereThereAreAny) {
  std::vector<RunSheetRow> sheet = make_run_sheet(standard_design(6), 1, 5);
  sheet[2].entry.level = -1.0;
  const std::string page = run_sheet_page(sheet, {.kind = "generic"}, "Coil");
  EXPECT_THAT(page, HasSubstr("Run 3, level -1"));
  EXPECT_THAT(page, Not(HasSubstr("<h2>")));
}

}  // namespace
}  // namespace axiscal
