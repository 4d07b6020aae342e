// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/csv_reader.hpp"

#include <algorithm>
#include <cstring>

#include "axiscal/core/error.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// A source that delivers the text in pieces of `piece` bytes, like a slow pipe.
CsvReader::Source source_of(const std::string& text, std::size_t piece = 1U << 20U) {
  return [text, piece, at = std::size_t{0}](char* buffer, std::size_t size) mutable {
    const std::size_t count = std::min({size, piece, text.size() - at});
    std::memcpy(buffer, text.data() + at, count);
    at += count;
    return count;
  };
}

std::vector<std::vector<std::string>> rows_of(CsvReader& csv) {
  std::vector<std::vector<std::string>> rows;
  while (csv.next() == CsvReader::Row::good) {
    rows.emplace_back(csv.cells().begin(), csv.cells().end());
  }
  return rows;
}

TEST(CsvReader, ReadsWhateverTheSizeOfThePieces) {
  const std::string text =
      "\xEF\xBB\xBF# a comment\r\n\r\na, b ,c\r\n1,2,3\r\n\"x,1\",\"say \"\"so\"\"\", 6 \r\n"
      "# another\n7,\"two\nlines\",9";
  for (const std::size_t piece : {1U, 2U, 3U, 7U, 1000U}) {
    CsvReader csv(source_of(text, piece), "t.csv");
    EXPECT_THAT(csv.header(), ElementsAre("a", "b", "c")) << piece;
    EXPECT_THAT(rows_of(csv),
                ElementsAre(ElementsAre("1", "2", "3"), ElementsAre("x,1", "say \"so\"", "6"),
                            ElementsAre("7", "two\nlines", "9")))
        << piece;
    EXPECT_EQ(csv.next(), CsvReader::Row::end);
  }
}

TEST(CsvReader, HandsOverLinesUnlessQuotesAreNear) {
  std::string text = "a,b\n";
  for (int i = 0; i < 60000; ++i) {
    text += std::to_string(i) + ",x\r\n";
  }
  const std::string plain = text;
  text += "60000,\"two\nlines\"\n# end\n60001,\"\"";
  CsvReader whole(source_of(text, 1000), "t.csv");
  CsvReader csv(source_of(text, 1000), "t.csv");
  std::size_t taken = 0;
  int read = 0;
  for (;;) {
    if (std::optional<CsvReader::Lines> lines = csv.take_lines()) {
      ++taken;
      EXPECT_LE(lines->text.size(), 1U << 18U);
      CsvReader part(csv, *std::move(lines));
      EXPECT_EQ(part.header(), csv.header());
      while (part.next() == CsvReader::Row::good) {
        ASSERT_EQ(whole.next(), CsvReader::Row::good);
        EXPECT_EQ(part.text(), whole.text());
        EXPECT_EQ(part.line(), whole.line());
        ++read;
      }
    } else if (csv.next() == CsvReader::Row::good) {
      ASSERT_EQ(whole.next(), CsvReader::Row::good);
      EXPECT_EQ(csv.text(), whole.text());
      EXPECT_EQ(csv.line(), whole.line());
      ++read;
    } else {
      break;
    }
  }
  EXPECT_EQ(read, 60002);
  EXPECT_GE(taken, plain.size() >> 18U);
  EXPECT_EQ(whole.next(), CsvReader::Row::end);
}

TEST(CsvReader, CountsLinesOverCommentsAndQuotedLineEnds) {
  CsvReader csv(source_of("a,b\n\n\"1\n1\",2\n#c\n3,4\n"), "t.csv");
  EXPECT_EQ(csv.line(), 1U);
  ASSERT_EQ(csv.next(), CsvReader::Row::good);
  EXPECT_EQ(csv.line(), 3U);
  EXPECT_EQ(csv.text(), "\"1\n1\",2");
  ASSERT_EQ(csv.next(), CsvReader::Row::good);
  EXPECT_EQ(csv.line(), 6U);
}

TEST(CsvReader, GoesOnBehindDefectiveRows) {
  using std::string_literals::operator""s;
  CsvReader csv(source_of("a,b\n1\n1,2,3\n\"x\"y,2\n1,\"open\n5,\0\n7,8\n"s), "t");
  for (const char* defect :
       {"1 cells", "3 cells", "follows the closing quote", "lacks the closing quote", "NUL"}) {
    ASSERT_EQ(csv.next(), CsvReader::Row::defective);
    EXPECT_THAT(csv.defect(), HasSubstr(defect));
  }
  EXPECT_EQ(csv.line(), 6U);
  ASSERT_EQ(csv.next(), CsvReader::Row::good);
  EXPECT_EQ(csv.text(), "7,8");
  EXPECT_EQ(csv.next(), CsvReader::Row::end);
}

TEST(CsvReader, SurvivesAQuoteThatTheEndOfTheFileLeavesOpen) {
  for (const std::size_t piece : {1U, 5U, 1000U}) {
    CsvReader csv(source_of("a,b\n1,\"2", piece), "t");
    ASSERT_EQ(csv.next(), CsvReader::Row::defective);
    EXPECT_THAT(csv.defect(), HasSubstr("lacks the closing quote"));
    EXPECT_EQ(csv.next(), CsvReader::Row::end);
  }
}

TEST(CsvReader, EndsQuotesWithTheLineOnRequest) {
  CsvReader csv(source_of("a,b\n1,\"2\n3,4\n"), "t", CsvReader::Quotes::end_with_line);
  EXPECT_EQ(csv.next(), CsvReader::Row::defective);
  ASSERT_EQ(csv.next(), CsvReader::Row::good);
  EXPECT_EQ(csv.text(), "3,4");
}

TEST(CsvReader, RejectsWhatIsNoTable) {
  const auto complaint = [](const std::string& text) {
    try {
      CsvReader csv(source_of(text), "t.csv");
    } catch (const DataError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_THAT(complaint(""), HasSubstr("t.csv:1: the file is empty"));
  EXPECT_THAT(complaint("# only\n\n"), HasSubstr("empty"));
  EXPECT_THAT(complaint(std::string("\xFF\xFE"
                                    "a\0,\0",
                                    6)),
              HasSubstr("UTF-16"));
  EXPECT_THAT(complaint(std::string("\x7F"
                                    "ELF\0\1\2",
                                    7)),
              HasSubstr("t.csv:1: not UTF-8"));
  EXPECT_THAT(complaint("caf\xE9,b\n"), HasSubstr("not UTF-8"));
  EXPECT_THAT(complaint("a,b,a\n"), HasSubstr("column 'a': occurs twice"));
  EXPECT_THAT(complaint("a,,b\n"), HasSubstr("column 2 lacks a name"));
  EXPECT_THAT(complaint("a,\"b\n"), HasSubstr("lacks the closing quote"));
}

TEST(CsvReader, RefusesEndlessLines) {
  CsvReader csv(source_of("a,b\n1,2\n" + std::string(3U << 20U, 'x')), "t.csv");
  ASSERT_EQ(csv.next(), CsvReader::Row::good);
  EXPECT_THROW(static_cast<void>(csv.next()), DataError);
  // The limit also holds if the buffer has grown to the size of the row.
  CsvReader grown(source_of("a,b\n1," + std::string(900U << 10U, '2') + "\n3," +
                            std::string(1200U << 10U, '4') + "\n5,6\n"),
                  "t.csv");
  ASSERT_NE(grown.next(), CsvReader::Row::end);
  EXPECT_THROW(static_cast<void>(grown.next()), DataError);
}

TEST(CsvCell, IsReadBackAsItWas) {
  const std::string text = "a \"quoted\", two\nlines";
  CsvReader csv(source_of("h\n" + csv_cell(text) + "\n"), "t");
  ASSERT_EQ(csv.next(), CsvReader::Row::good);
  EXPECT_EQ(csv.cells()[0], text);
  EXPECT_EQ(csv_cell("plain"), "plain");
}

TEST(IsUtf8, KnowsGoodFromBad) {
  EXPECT_TRUE(is_utf8("plain ascii that is longer than eight bytes"));
  EXPECT_TRUE(is_utf8("\xC3\xA9 \xE2\x82\xAC \xF0\x9F\x98\x80"));
  for (const char* bad :
       {"\xE9", "\xC0\xAF", "\xED\xA0\x80", "\xF5\x80\x80\x80", "12345678\xFF", "\xE2\x82"}) {
    EXPECT_FALSE(is_utf8(bad));
  }
}

}  // namespace
}  // namespace axiscal
