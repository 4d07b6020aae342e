// SPDX-License-Identifier: Apache-2.0
#include "core/json_document.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "axiscal/core/error.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

TEST(JsonText, QuotesWhatNeedsIt) {
  Json json = {
      {"a \"b\"", "tab\t, \xC2\xB0, \x7F, \\"}, {"plain", -12}, {"large", 18446744073709551615U}};
  EXPECT_EQ(json_text(json),
            "{\n  \"a \\\"b\\\"\": \"tab\\t, \xC2\xB0, \x7F, \\\\\",\n"
            "  \"plain\": -12,\n  \"large\": 18446744073709551615\n}\n");
}

// The pieces that `take` receives are the text that finish() returns without `take`.
TEST(JsonWriter, PassesItsTextOnInPieces) {
  const auto write = [](JsonWriter& writer) {
    writer.begin_object();
    for (int i = 0; i < 3000; ++i) {
      writer.key("member " + std::to_string(i));
      writer.numbers(Eigen::Vector3d(0.1, i, std::nan("")));
    }
    writer.key("empty");
    writer.begin_list();
    writer.end_list();
    writer.end_object();
    return writer.finish();
  };
  for (const JsonLayout layout : {JsonLayout::lines, JsonLayout::one_line}) {
    JsonWriter whole(layout);
    const std::string text = write(whole);
    EXPECT_EQ(Json::parse(text).size(), 3001U);
    std::string pieces;
    int count = 0;
    JsonWriter passing(layout, [&](std::string_view piece) {
      pieces += piece;
      ++count;
    });
    EXPECT_EQ(write(passing), "");
    EXPECT_EQ(pieces, text);
    EXPECT_GT(count, 1);
  }
}

TEST(JsonWriter, WritesEveryKindOfValue) {
  JsonWriter writer(JsonLayout::one_line);
  writer.begin_list();
  writer.number(0.1);
  writer.number(std::numeric_limits<double>::infinity());
  writer.integer(-3);
  writer.flag(true);
  writer.text("a \"b\"");
  writer.integers({1, 2});
  writer.texts({"x", "y"});
  writer.matrix(Eigen::Matrix2d::Identity());
  writer.value(Json{{"k", {1, Json::object()}}, {"n", nullptr}});
  writer.end_list();
  EXPECT_EQ(writer.finish(),
            R"([0.1,null,-3,true,"a \"b\"",[1,2],["x","y"],[[1,0],[0,1]],{"k":[1,{}],"n":null}])");
}

TEST(JsonColumns, ComeBackAsRows) {
  JsonColumns columns;
  columns.begin_row();
  columns.put_number("a", 1.5);
  columns.put_text("word", "x \"y\"\n");
  columns.begin_row();
  columns.put_numbers("list", Eigen::Vector2d(0.1, std::nan("")));
  columns.put_number("a", std::numeric_limits<double>::infinity());
  columns.begin_row();
  columns.put_value("object", Json{{"k", {1, 2}}});
  columns.put_text("word", "z");
  columns.put_integer("count", -3);
  JsonWriter writer;
  writer.begin_object();
  writer.key("table");
  columns.write_to(writer);
  writer.end_object();
  const std::string text = writer.finish();
  EXPECT_EQ(text, R"({
  "table": {
    "a": [1.5, null, null],
    "word": ["x \"y\"\n", null, "z"],
    "list": [
      null,
      [0.1, null],
      null
    ],
    "object": [
      null,
      null,
      {"k":[1,2]}
    ],
    "count": [null, null, -3]
  }
}
)");
  std::vector<std::string> found;
  parse_json(text, "f").at("table").for_each_row([&](const JsonValue& row) {
    EXPECT_TRUE(row.is_object());
    found.push_back(row.text_or("word", "-") + (row.find("a") ? "a" : "") +
                    (row.find("list") ? "l" : "") + (row.find("object") ? "o" : ""));
  });
  EXPECT_EQ(found, (std::vector<std::string>{"x \"y\"\na", "-l", "zo"}));
}

TEST(JsonValue, SaysWhereItIs) {
  const JsonValue json =
      parse_json(R"({"a": [{"b~/": [1, "x"]}], "t": {"n": [1, "y"]}})", "f.json");
  const auto complaint = [](const auto& call) { return test::complaint_of<DataError>(call); };
  const JsonValue first = json.at("a").elements()[0];
  EXPECT_EQ(complaint([&] { static_cast<void>(first.at("b~/").vector()); }),
            "f.json: /a/0/b~0~1/1: must be a number");
  EXPECT_EQ(complaint([&] { static_cast<void>(first.at("c")); }), "f.json: /a/0/c: is missing");
  EXPECT_EQ(complaint([&] { static_cast<void>(json.number()); }), "f.json: /: must be a number");
  const auto take = [](const JsonValue& row) { static_cast<void>(row.at("n").number()); };
  EXPECT_EQ(complaint([&] { json.at("t").for_each_row(take); }),
            "f.json: /t/n/1: must be a number");
}

// Values are copied recursively, so deep nesting must not exhaust the stack.
TEST(JsonValue, IsNotNestedWithoutEnd) {
  const auto nested = [](std::size_t depth) {
    return R"({"a": )" + std::string(depth, '[') + std::string(depth, ']') + R"(, "b": 1})";
  };
  EXPECT_EQ(parse_json(nested(999), "f.json").at("b").number(), 1.0);
  EXPECT_EQ(test::complaint_of<DataError>(
                [&] { static_cast<void>(parse_json(nested(200000), "f.json")); }),
            "f.json: is nested more than 1000 levels deep");
  EXPECT_FALSE(json_or_discarded(nested(999)).is_discarded());
  EXPECT_TRUE(json_or_discarded(nested(200000)).is_discarded());
  EXPECT_TRUE(json_or_discarded("{").is_discarded());
}

}  // namespace
}  // namespace axiscal
