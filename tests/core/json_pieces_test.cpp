// SPDX-License-Identifier: Apache-2.0
#include "core/json_pieces.hpp"

#include <array>
#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axiscal {
namespace {

using ::testing::ElementsAre;
using ::testing::Optional;

constexpr std::array<std::string_view, 3> members = {"/x", "/fit/rows", "/fit/text"};

TEST(JsonPieces, AreFoundByTheirPointers) {
  EXPECT_THAT(
      json_pieces(
          R"( {"rows": [1, {"x": "]"}], "fit": {"n": 2, "text": "a\"}", "rows" :[[1], {}]}, "x": 7 } )",
          members),
      Optional(ElementsAre("7", "[[1], {}]", R"("a\"}")")));
  EXPECT_THAT(json_pieces(R"({"rows": 1, "of": {"fit": {"rows": 2}, "x": 3}})", members),
              Optional(ElementsAre("", "", "")));
  EXPECT_THAT(json_pieces(R"({"a": ["\\", "\\\"]", "\"\\"], "x": "\\"})", members),
              Optional(ElementsAre(R"("\\")", "", "")));
  EXPECT_THAT(json_pieces("{ }\n", members), Optional(ElementsAre("", "", "")));
}

TEST(JsonPieces, AreNotFoundInWhatIsNotWhole) {
  for (const std::string_view text : {R"({"rows": [1, 2)",
                                      R"({"rows": [1] "x": 1})",
                                      R"({"x" 1})",
                                      R"({"rows": [1],})",
                                      "[1]",
                                      "",
                                      "{",
                                      R"({"x": "ab)",
                                      R"({"x": 1}})",
                                      R"({"x": 1,)",
                                      R"({"fit": {"text": 1)",
                                      R"({"x": 1, "x": 2})",
                                      R"({"x": })",
                                      R"({"fit": {"text": 1}, "fit": {"text": 1}})",
                                      R"({"\u0078": 1})",
                                      R"({"fit/text": 1})",
                                      R"({"fit": [4]})",
                                      R"({"fit": null})",
                                      R"({"fit": {"text": 1}, "fit": {}})",
                                      R"({"fit": {}, "fit": {"text": 1}})"}) {
    EXPECT_FALSE(json_pieces(text, members)) << text;
  }
}

TEST(JsonPieces, AreReadAsWhatTheyAre) {
  EXPECT_EQ(matrix_of_piece("[[1, -2.5e-3],\n [0, 4]]", 2, 2),
            (Eigen::Matrix2d() << 1.0, -2.5e-3, 0.0, 4.0).finished());
  EXPECT_TRUE(std::isnan((*matrix_of_piece("[[null]]", 1, 1))(0, 0)));
  EXPECT_EQ(vector_of_piece("[ 1 ,2]", 2), Eigen::Vector2d(1.0, 2.0));
  EXPECT_EQ(vector_of_piece("[]", 0), Eigen::VectorXd(0));
  EXPECT_EQ(vector_of_piece("[0.5e2, 0]", 2), Eigen::Vector2d(50.0, 0.0));
  EXPECT_FALSE(std::signbit((*vector_of_piece("[-0]", 1))(0)));  // an integer, as by the parser
  EXPECT_TRUE(std::signbit((*vector_of_piece("[-0.0]", 1))(0)));
  EXPECT_THAT(texts_of_piece(R"(["x", "a b"])"), Optional(ElementsAre("x", "a b")));
  EXPECT_THAT(list_of_piece(R"([{"a": [1]}, 2 ])"), Optional(ElementsAre(R"({"a": [1]})", "2")));
  EXPECT_EQ(text_of_piece(R"("QA-113")"), "QA-113");
}

TEST(JsonPieces, AreLeftToTheParserElse) {
  for (const std::string_view piece :
       {"[[1, 2]]", "[[1, 2], [3]]", "[[1, 2, 3], [4, 5, 6]]", "[[1, 2], [3, 4], [5, 6]]",
        "[[1, 2], [3, inf]]", "[[1, 2], [3, 1e999]]", "[[1, 2], [3, \"4\"]]", "[[1, 2], [3, .4]]",
        "[[1, 2], [3, 04]]", "[[1, 2], [3, -00]]", "[[1, 2], [3, 4.]]", "[[1, 2], [3, 4.e1]]",
        "[[1, 2], [3, 4e]]", "[1, 2]", "[[1, 2], [3, 4]", "[[1, 2], [3, 4]] 5", "null", ""}) {
    EXPECT_FALSE(matrix_of_piece(piece, 2, 2)) << piece;
  }
  constexpr Eigen::Index huge = 1'000'000'000;  // too large to allocate
  EXPECT_FALSE(matrix_of_piece("[[1, 2], [3, 4]]", huge, huge));
  EXPECT_FALSE(vector_of_piece("[1, 2]", huge));
  EXPECT_FALSE(vector_of_piece("[1, 2]", 1));
  EXPECT_FALSE(vector_of_piece("[1]", 2));
  EXPECT_FALSE(texts_of_piece(R"(["x", 1])"));
  for (const std::string_view piece : {R"("a\n")", "\"\xC2\xB0\"", R"("a" )", "1", "\"a"}) {
    EXPECT_FALSE(text_of_piece(piece)) << piece;
  }
}

TEST(JsonPieces, SayHowDeepTheyAre) {
  EXPECT_EQ(depth_of_json("1"), 0U);
  EXPECT_EQ(depth_of_json(R"( {"a": ["[[[", [1]], "b": {}} )"), 3U);
  EXPECT_EQ(depth_of_json(R"([["\"[[[]"]])"), 2U);
  EXPECT_EQ(depth_of_json(std::string(100000, '[')), 100000U);
}

}  // namespace
}  // namespace axiscal
