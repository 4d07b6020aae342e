// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/choices.hpp"

#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "axiscal/calib/face_names.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/calib/sensor_temperature.hpp"
#include "axiscal/core/error.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// ---- names of choices ----

template <typename Choice>
struct NamedChoice {
  Choice choice;
  std::string name;
};

// Each name is parsed to its choice and printed again. No other text is a choice.
template <typename Choice, typename NameOf, typename Parse>
void expect_names(const std::vector<NamedChoice<Choice>>& all, NameOf name_of, Parse parse) {
  std::set<std::string> names;
  for (const auto& [choice, name] : all) {
    EXPECT_EQ(name_of(choice), name);
    ASSERT_TRUE(parse(name)) << name;
    EXPECT_EQ(*parse(name), choice) << name;
    names.insert(name);
    std::string upper = name;
    upper.front() = static_cast<char>(upper.front() - 'a' + 'A');
    for (const std::string& other :
         {upper, name + " ", " " + name, name.substr(0, name.size() - 1), name + "s"}) {
      EXPECT_FALSE(parse(other)) << '\'' << other << '\'';
    }
  }
  EXPECT_EQ(names.size(), all.size());
  EXPECT_FALSE(parse(""));
}

TEST(ChoiceNames, OfMethodsAreReadAsTheyAreWritten) {
  expect_names<Method>({{Method::paired, "paired"},
                        {Method::joint, "joint"},
                        {Method::known, "known"},
                        {Method::magnitude, "magnitude"},
                        {Method::bias, "bias"},
                        {Method::turns, "turns"},
                        {Method::faces, "faces"}},
                       method_name, parse_method);
  EXPECT_EQ(method_name(std::nullopt), "");
}

TEST(ChoiceNames, OfStatusWeightingAndScopeAreReadAsTheyAreWritten) {
  expect_names<CalibrationStatus>({{CalibrationStatus::ok, "ok"},
                                   {CalibrationStatus::warning, "warning"},
                                   {CalibrationStatus::refused, "refused"}},
                                  status_name, parse_status);
  expect_names<Weighting>(
      {{Weighting::none, "none"}, {Weighting::samples, "samples"}, {Weighting::sd, "sd"}},
      weighting_name, parse_weighting);
  expect_names<LevelBy>({{LevelBy::run, "run"}, {LevelBy::block, "block"}}, level_by_name,
                        parse_level_by);
}

TEST(ChoiceNames, OfDriftSeatsAndShapeAreReadAsTheyAreWritten) {
  expect_names<DriftSetup>(
      {{DriftSetup::automatic, "auto"}, {DriftSetup::none, "none"}, {DriftSetup::linear, "linear"}},
      drift_name, parse_drift);
  expect_names<SeatSetup>(
      {{SeatSetup::automatic, "auto"}, {SeatSetup::fit, "fit"}, {SeatSetup::none, "none"}},
      seats_name, parse_seats);
  expect_names<MagnitudeShape>(
      {{MagnitudeShape::symmetric, "symmetric"}, {MagnitudeShape::triangular, "triangular"}},
      shape_name, parse_shape);
  EXPECT_EQ(shape_name(std::nullopt), "");
}

// Method turns needs a log, so an experiment cannot choose it.
TEST(ChosenMethods, AreAllButTurns) {
  for (const Method method : {Method::paired, Method::joint, Method::known, Method::magnitude,
                              Method::bias, Method::faces}) {
    EXPECT_EQ(parse_chosen_method(method_name(method)), method);
  }
  EXPECT_TRUE(parse_method("turns"));
  EXPECT_FALSE(parse_chosen_method("turns"));
  EXPECT_FALSE(parse_chosen_method("best"));
  EXPECT_FALSE(parse_chosen_method(""));
}

TEST(MethodKinds, OfARecordWithoutAMethodClaimNothing) {
  const MethodKind& none = method_kind(std::optional<Method>());
  EXPECT_TRUE(none.name.empty());
  EXPECT_FALSE(none.by_pose || none.by_magnitude || none.by_turns || none.averages_pairs ||
               none.directions_known);
  for (const Method method : {Method::paired, Method::joint, Method::known, Method::magnitude,
                              Method::bias, Method::turns, Method::faces}) {
    const MethodKind& kind = method_kind(method);
    EXPECT_EQ(kind.method, method);
    EXPECT_FALSE(kind.words.empty()) << kind.name;
    EXPECT_EQ(kind.fits_sensitivity, method != Method::bias) << kind.name;
    // A method uses poses, the magnitude or turns, and not more than one of them.
    EXPECT_LE(int{kind.by_pose} + int{kind.by_magnitude} + int{kind.by_turns}, 1) << kind.name;
    EXPECT_TRUE(kind.by_pose || !kind.averages_pairs) << kind.name;
  }
}

TEST(MethodKinds, TakeNoNameTwiceAndNoEmptyName) {
  EXPECT_THAT(test::complaint_of<DomainError>(
                  [] { static_cast<void>(add_method_kind({.name = "joint"})); }),
              HasSubstr("'joint'"));
  EXPECT_THROW(static_cast<void>(add_method_kind({.name = ""})), DomainError);
}

// ---- names of faces ----

TEST(ParseFaceNames, TakesBlanksAndLettersOfEitherCase) {
  const FaceNames names = parse_face_names("  Level = -Z ,\tNOSE UP=x-, on its left side = +y");
  ASSERT_EQ(names.size(), 3U);
  EXPECT_EQ(names.at("level"), Face::minus_z);
  EXPECT_EQ(names.at("nose up"), Face::minus_x);
  EXPECT_EQ(names.at("on its left side"), Face::plus_y);
}

TEST(ParseFaceNames, TakesTheLastSignOfEquality) {
  const FaceNames names = parse_face_names("tilt=0=-Z");
  ASSERT_EQ(names.size(), 1U);
  EXPECT_EQ(names.at("tilt=0"), Face::minus_z);
}

TEST(ParseFaceNames, MayStateNone) {
  EXPECT_THAT(parse_face_names(""), IsEmpty());
  EXPECT_EQ(parse_face_names("up=-Z,").size(), 1U);
}

TEST(ParseFaceNames, MayHaveSeveralWordsForOneFace) {
  const FaceNames names = parse_face_names("up=-Z,level=-Z,flat=-Z");
  for (const char* word : {"up", "level", "flat"}) {
    EXPECT_EQ(find_face(names, word), Face::minus_z) << word;
  }
}

TEST(ParseFaceNames, SaysWhichItemIsWrong) {
  const auto complaint = [](const std::string& text) {
    return test::complaint_of<DomainError>([&] { static_cast<void>(parse_face_names(text)); });
  };
  EXPECT_THAT(complaint("up=-Z,down"), HasSubstr("'down' must be WORD=FACE"));
  EXPECT_THAT(complaint("up=-Q"), HasSubstr("'up=-Q' must be WORD=FACE"));
  EXPECT_THAT(complaint("up="), HasSubstr("'up='"));
  EXPECT_THAT(complaint("=-Z"), HasSubstr("'=-Z'"));
  EXPECT_THAT(complaint(" \t=-Z"), HasSubstr("must be WORD=FACE"));
  EXPECT_THAT(complaint(",up=-Z"), HasSubstr("'' must be WORD=FACE"));
  EXPECT_THAT(complaint("up=-Z,Up =+Z"), HasSubstr("the word 'up' occurs twice"));
}

TEST(FindFace, TakesStandardNamesWithoutAnyWords) {
  for (const Face face : all_faces) {
    const std::string name(face_name(face));
    EXPECT_EQ(find_face({}, name), face);
    EXPECT_EQ(find_face({}, std::string{name[1], name[0]}), face);
  }
  EXPECT_FALSE(find_face({}, "up"));
  EXPECT_FALSE(find_face({}, ""));
}

TEST(FindFace, PrefersTheUsersWords) {
  const FaceNames names = parse_face_names("+x=-Z,up=+Y");
  EXPECT_EQ(find_face(names, "+X"), Face::minus_z);
  EXPECT_EQ(find_face(names, " UP\t"), Face::plus_y);
  EXPECT_EQ(find_face(names, "-X"), Face::minus_x);  // standard names still work
  EXPECT_FALSE(find_face(names, "upper"));
}

// ---- faces in words ----

// Expects the face in the words, and a direction if the words state one.
void expect_words(const std::string& words, Face face, std::optional<bool> is_up) {
  const std::optional<FaceInWords> found = face_in_words(words);
  ASSERT_TRUE(found) << words;
  EXPECT_EQ(found->face, face) << words;
  EXPECT_EQ(found->is_up, is_up) << words;
}

TEST(FaceInWordsText, TakesEachAxisWithADirectionInAnyOrder) {
  for (int axis = 0; axis < 3; ++axis) {
    const std::string letter(1, "xyz"[axis]);
    for (const bool up : {true, false}) {
      const std::string word = up ? "up" : "down";
      const Face face = face_of(axis, true);
      for (const std::string& words :
           {letter + " " + word, letter + "_" + word, letter + "-" + word, letter + word,
            word + letter, word + " " + letter, letter + " axis " + word,
            "face " + letter + ", facing " + word, "g " + letter + " is " + word}) {
        expect_words(words, face, up);
      }
      expect_words("-" + letter + " " + word, opposite(face), up);
      expect_words("+" + letter + "_" + word, face, up);
    }
  }
}

TEST(FaceInWordsText, TakesSignsAsMarksAndAsWords) {
  for (const Face face : all_faces) {
    const std::string letter(1, "xyz"[axis_of(face)]);
    const bool positive = is_positive(face);
    for (const std::string& sign :
         positive ? std::vector<std::string>{"p", "pos", "positive", "plus", "positivo", "positiv"}
                  : std::vector<std::string>{"n", "m", "neg", "negative", "minus", "negativo",
                                             "negativ"}) {
      for (const std::string& words : {sign + letter, letter + sign, sign + " " + letter,
                                       letter + "_" + sign, "acc " + letter + " " + sign}) {
        expect_words(words, face, std::nullopt);
      }
    }
    const std::string mark = positive ? "+" : "-";
    expect_words(mark + letter, face, std::nullopt);
    expect_words(letter + mark, face, std::nullopt);
    expect_words("face " + mark + letter, face, std::nullopt);
  }
}

TEST(FaceInWordsText, KnowsDirectionsOfSeveralLanguages) {
  for (const char* up : {"up", "upward", "upwards", "top", "sky", "arriba", "oben", "haut", "su"}) {
    expect_words(std::string("Y ") + up, Face::plus_y, true);
  }
  for (const char* down :
       {"down", "downwards", "dn", "bottom", "ground", "abajo", "unten", "bas"}) {
    expect_words(std::string("Y ") + down, Face::plus_y, false);
  }
  expect_words("Achse Z oben", Face::plus_z, true);
  expect_words("eje x hacia abajo", Face::plus_x, false);
  expect_words("FACE Z ARRIBA", Face::plus_z, true);
}

// Case and outer blanks do not matter.
TEST(FaceInWordsText, DoesNotDependOnCaseOrOuterBlanks) {
  for (const std::string words : {"x up", "-z down", "negy", "z+"}) {
    std::string upper = words;
    for (char& c : upper) {
      c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    }
    const std::optional<FaceInWords> plain = face_in_words(words);
    const std::optional<FaceInWords> changed = face_in_words(" \t" + upper + "  ");
    ASSERT_TRUE(plain && changed) << words;
    EXPECT_EQ(changed->face, plain->face) << words;
    EXPECT_EQ(changed->is_up, plain->is_up) << words;
  }
}

TEST(FaceInWordsText, NamesNoFaceIfWordsAreMissingDoubledOrUnknown) {
  for (const char* words :
       {"", "   ", "up", "x", "+", "axis", "x y up", "x up down", "x up up", "pos neg x", "+x-",
        "nose up", "x sideways", "x1 up", "up 2", "xx up", "w up", "xyz", "\xE2\x88\x92x"}) {
    EXPECT_FALSE(face_in_words(words)) << '\'' << words << '\'';
  }
}

// ---- outputs of temperature sensors ----

TEST(SensorTemperatures, OfOneSensorCountForAllAxes) {
  const SensorTemperature t = 21.5;
  EXPECT_FALSE(t.has_own());
  EXPECT_EQ(t.mean(), 21.5);
  EXPECT_THAT(t.of_axes(), IsEmpty());
  for (const Eigen::Index axis : {0, 2, 7}) {
    EXPECT_EQ(t.of(axis), 21.5);
  }
  EXPECT_EQ(t.of_some(1, 2), t);
  EXPECT_EQ(SensorTemperature(), SensorTemperature(0.0));
}

TEST(SensorTemperatures, OfEachAxisHaveAMean) {
  const SensorTemperature t(std::vector<double>{20.0, 22.0, 27.0});
  EXPECT_TRUE(t.has_own());
  EXPECT_EQ(t.of(0), 20.0);
  EXPECT_EQ(t.of(2), 27.0);
  EXPECT_EQ(t.mean(), 23.0);
  EXPECT_THAT(t.of_axes(), ElementsAre(20.0, 22.0, 27.0));
}

TEST(SensorTemperatures, OfNoAxisAreRefused) {
  EXPECT_THAT(test::complaint_of<DomainError>(
                  [] { static_cast<void>(SensorTemperature(std::vector<double>())); }),
              HasSubstr("at least one output"));
}

TEST(SensorTemperatures, AreOneNumberIfAPartHasTheSame) {
  const SensorTemperature t(std::vector<double>{20.0, 20.0, 25.0, 26.0, 26.0});
  EXPECT_EQ(t.of_some(0, 2), SensorTemperature(20.0));
  EXPECT_FALSE(t.of_some(3, 2).has_own());
  EXPECT_EQ(t.of_some(3, 2).mean(), 26.0);
  EXPECT_THAT(t.of_some(1, 3).of_axes(), ElementsAre(20.0, 25.0, 26.0));
  EXPECT_EQ(t.of_some(2, 1), SensorTemperature(25.0));
  EXPECT_EQ(t.of_some(0, 5), t);
}

TEST(SensorTemperatures, ChangeAllTogether) {
  const SensorTemperature own(std::vector<double>{-4.0, 8.0});
  const SensorTemperature warmer = own.changed_by(1.5);
  EXPECT_THAT(warmer.of_axes(), ElementsAre(-2.5, 9.5));
  EXPECT_EQ(warmer.mean(), own.mean() + 1.5);
  EXPECT_EQ(warmer.changed_by(-1.5), own);
  EXPECT_THAT(own.of_axes(), ElementsAre(-4.0, 8.0)) << "the first stays as it was";
  EXPECT_EQ(SensorTemperature(3.0).changed_by(-5.0), SensorTemperature(-2.0));
}

TEST(SensorTemperatures, OfEachAxisDifferFromOneForAll) {
  const SensorTemperature own(std::vector<double>{20.0, 20.0});
  EXPECT_EQ(own.mean(), 20.0);
  EXPECT_FALSE(own == SensorTemperature(20.0));
  EXPECT_FALSE(own == SensorTemperature(std::vector<double>{19.0, 21.0}));
  SensorTemperature copy = own;
  EXPECT_EQ(copy, own);
  copy = copy.changed_by(1.0);
  EXPECT_FALSE(copy == own);
  EXPECT_EQ(own.of(1), 20.0);
}

}  // namespace
}  // namespace axiscal
