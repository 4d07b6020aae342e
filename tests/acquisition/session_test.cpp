// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/session.hpp"

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <functional>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "acquisition/src/soak_watch.hpp"
#include "allocations.hpp"
#include "axiscal/acquisition/sample_feed.hpp"
#include "axiscal/acquisition/session_json.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/light_field.hpp"
#include "axiscal/field/sun.hpp"
#include "guided.hpp"
#include "matchers.hpp"

namespace axiscal::test {
namespace {

std::size_t count(const GuidedResult& result, const std::string& kind) {
  return static_cast<std::size_t>(
      std::count_if(result.events.begin(), result.events.end(),
                    [&](const SessionEvent& event) { return event.kind == kind; }));
}

SimulationSetup simulation_of(std::uint64_t seed) {
  SimulationSetup simulation;
  simulation.seed = seed;
  simulation.rate_hz = 50.0;
  return simulation;
}

// Largest error of the sensitivity in units of its standard uncertainty, which includes the scatter
// of the readings and of the seat.
double largest_error(const GuidedResult& result) {
  const Eigen::MatrixXd off =
      result.calibrations.front().sensor.response.sensitivity - result.truth.sensitivity;
  const Eigen::MatrixXd u =
      (result.calibrations.front().fit.statistics->sensitivity_se.array().square() +
       2e-5 * 2e-5 / 4.0)
          .sqrt();
  return (off.array().abs() / u.array()).maxCoeff();
}

// The number of allocations measures the cost of a reading independently of the load of the
// machine.
TEST(SessionGrowth, ACaptureCostsTheSameHoweverManyThereAre) {
  if (under_address_sanitizer) {
    GTEST_SKIP() << "the sanitizer counts allocations of its own";
  }
  const ScratchFolder folder;
  const auto cost_of_a_capture = [&](int replicates) {
    const SessionSetup setup = guided_setup(1, replicates);
    const std::size_t before = allocation_count();
    static_cast<void>(
        run_guided(setup, simulation_of(1), folder.path(std::to_string(replicates) + ".journal")));
    return static_cast<double>(allocation_count() - before) /
           static_cast<double>(setup.sheet.size());
  };
  const double of_48 = cost_of_a_capture(4);
  const double of_192 = cost_of_a_capture(16);
  EXPECT_LT(of_192, 1.6 * of_48);
}

TEST(Session, TakesTwelvePointsAndCalibrates) {
  const ScratchFolder folder;
  const GuidedResult result =
      run_guided(guided_setup(), simulation_of(1), folder.path("a.journal"));
  ASSERT_FALSE(result.calibrations.empty());
  EXPECT_EQ(result.calibrations.front().findings.status, CalibrationStatus::ok);
  EXPECT_EQ(result.observations.size(), 12);
  EXPECT_EQ(count(result, "captured"), 12U);
  EXPECT_EQ(count(result, "question"), 0U);
  EXPECT_LT(largest_error(result), 5.0);
  EXPECT_NEAR(result.calibrations.front().fit.levelness->mean_x, 0.003, 5e-5);
  EXPECT_EQ(result.observations.samples->size(), 12);
}

// The session asks no question if the poses cannot be told apart. The simulated person makes no
// mistake, so every question would be false.
TEST(Session, AsksNothingWhereNothingCanBeTold) {
  const ScratchFolder folder;
  struct Case {
    std::string name;
    int sessions;
    std::function<void(SessionSetup&)> set;
  };
  const auto levels = [](SessionSetup& setup) {
    setup.experiment.instrument = {.kind = "gyroscope", .unit = "deg/s"};
    setup.experiment.field = {};
    setup.experiment.field.of = make_field("induced_rotation");
    setup.experiment.field.magnitude = 100.0;
    std::vector<DesignEntry> design;
    for (const DesignEntry& entry : standard_design(12)) {
      for (const double level : {-1.0, 0.0, 1.0}) {
        design.push_back({.point = entry.point, .level = level});
      }
    }
    setup.sheet = make_run_sheet(design, 1, setup.sheet.size());
  };
  const std::vector<Case> cases = {
      {"one axis in volts", 8,
       [](SessionSetup& setup) {
         setup.experiment.instrument = {.kind = "accelerometer", .axes = {"z"}, .unit = "V"};
       }},
      {"one axis in g", 4,
       [](SessionSetup& setup) {
         setup.experiment.instrument = {.kind = "accelerometer", .axes = {"z"}, .unit = "g"};
       }},
      {"a compass that knows |F| alone", 8,
       [](SessionSetup& setup) {
         setup.experiment.instrument = {.kind = "magnetometer", .unit = "uT"};
         setup.experiment.field.of = make_field("geomagnetic");
         setup.experiment.field.unit = "uT";
         setup.experiment.field.magnitude = 48.0;
       }},
      {"a turntable", 3, levels}};
  for (const Case& one : cases) {
    for (int s = 1; s <= one.sessions; ++s) {
      SessionSetup setup = guided_setup(static_cast<std::uint64_t>(s));
      one.set(setup);
      const std::string path = folder.path("d.journal");
      const GuidedResult result =
          run_guided(setup, simulation_of(static_cast<std::uint64_t>(s)), path);
      std::filesystem::remove(path);
      EXPECT_EQ(count(result, "question"), 0U) << one.name << ", seed " << s;
      EXPECT_EQ(count(result, "as_before"), 0U) << one.name << ", seed " << s;
      // A reading that the final calibration doubts is taken again.
      EXPECT_EQ(count(result, "captured"), setup.sheet.size() + count(result, "retake"))
          << one.name << ", seed " << s;
    }
  }
}

// Checks a part of the table in docs/acquire.md (axiscal_guided_rates). The seeds are fixed, so the
// numbers are reproducible.
TEST(Session, TellsAnErringPersonBeforeTheReadingIsAccepted) {
  const ScratchFolder folder;
  struct Case {
    double slope;
    int sessions;
    double least_told;
  };
  for (const Case& one : {Case{5e-3, 400, 0.94}, Case{2e-4, 100, 0.88}}) {
    std::size_t mistakes = 0;
    std::size_t told = 0;
    for (int s = 1; s <= one.sessions; ++s) {
      SimulationSetup simulation = simulation_of(static_cast<std::uint64_t>(s));
      simulation.error_rate = 0.1;
      simulation.slope = one.slope * Eigen::Vector2d(0.8, -0.6);
      const std::string path = folder.path("s.journal");
      const GuidedResult result = run_guided(guided_setup(simulation.seed), simulation, path);
      std::filesystem::remove(path);
      mistakes += result.mistakes.size();
      for (const SimulatedMistake& mistake : result.mistakes) {
        told += mistake.was_warned ? 1U : 0U;
      }
      // The final calibration found all mistakes that were not reported at once, so the record is
      // correct.
      ASSERT_FALSE(result.calibrations.empty()) << s;
      if (one.slope > 1e-3) {
        EXPECT_LT(largest_error(result), 5.0) << "session " << s;
      }
    }
    EXPECT_GT(mistakes, 100U);
    EXPECT_GE(static_cast<double>(told) / static_cast<double>(mistakes), one.least_told)
        << "slope " << one.slope;
  }
}

TEST(Session, DoubtsNoRightPose) {
  const ScratchFolder folder;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const std::string path = folder.path("s.journal");
    const GuidedResult result = run_guided(guided_setup(seed), simulation_of(seed), path);
    std::filesystem::remove(path);
    EXPECT_EQ(count(result, "question") + count(result, "as_before"), 0U) << seed;
  }
}

TEST(Session, AKnockBeginsTheReadingAnew) {
  const ScratchFolder folder;
  SimulationSetup simulation = simulation_of(2);
  simulation.knock_rate = 1.0;
  SessionSetup setup = guided_setup();
  setup.dwell_s = 2.0;
  const GuidedResult result = run_guided(setup, simulation, folder.path("a.journal"));
  EXPECT_GE(count(result, "knock"), 6U);
  EXPECT_EQ(result.observations.size(), 12);
  EXPECT_LT(largest_error(result), 5.0);
}

// A session with an accelerometer in g whose samples the test supplies at 100 Hz.
class Hand {
 public:
  explicit Hand(SessionSetup setup = guided_setup(), std::optional<double> time_at_zero = {})
      : journal_(Journal::create(folder_.path("hand.journal"))),
        session_((setup.unattended = false, std::move(setup)), journal_) {
    session_.set_channels({{"x", ""}, {"y", ""}, {"z", ""}, {"temperature", ""}}, time_at_zero);
  }

  void feed(double seconds, const Eigen::Vector3d& value, double sd = 1e-4) {
    for (int i = 0; i < static_cast<int>(100.0 * seconds); ++i) {
      time_s_ += 0.01;
      const std::array<double, 4> row = {value.x() + sd * random_.normal(),
                                         value.y() + sd * random_.normal(),
                                         value.z() + sd * random_.normal(), temperature};
      session_.add(time_s_, row);
    }
    for (SessionEvent& event : session_.take_events()) {
      events.push_back(std::move(event));
    }
  }

  // Lays the cube in the pose that the session asks for, and leaves it there for `seconds`.
  void lay(double seconds = 6.0) {
    const std::optional<RunSheetRow> wanted = session_.view().wanted;
    ASSERT_TRUE(wanted);
    feed(1.0, Eigen::Vector3d::Zero(), 0.1);
    feed(seconds, reading_at(wanted->entry.point));
  }

  static Eigen::Vector3d reading_at(const DesignPoint& point) {
    return Positioner().rotation_table_from_positioner(point).transpose() *
           Eigen::Vector3d(0.003, 0.001, 1.0);
  }

  void let_pass(double seconds) { time_s_ += seconds; }
  [[nodiscard]] double time_s() const { return time_s_; }

  [[nodiscard]] bool has_alarm(const std::string& code) {
    const std::vector<SessionAlarm>& alarms = session_.view().alarms;
    return std::any_of(alarms.begin(), alarms.end(),
                       [&](const SessionAlarm& alarm) { return alarm.code == code; });
  }

  [[nodiscard]] bool happened(const std::string& kind) const {
    return std::any_of(events.begin(), events.end(),
                       [&](const SessionEvent& event) { return event.kind == kind; });
  }

  Session& session() { return session_; }
  [[nodiscard]] std::string journal_path() const { return folder_.path("hand.journal"); }
  void ask(SessionAction action, std::optional<int> run = {}) {
    session_.command({.action = action, .run = run});
    for (SessionEvent& event : session_.take_events()) {
      events.push_back(std::move(event));
    }
  }

  double temperature = 20.0;
  std::vector<SessionEvent> events;

 private:
  ScratchFolder folder_;
  Journal journal_;
  Session session_;
  RandomStream random_{1};
  double time_s_ = 0.0;
};

TEST(Session, WithinASecondItSaysThatItIsSaturatedOrStuckOrInAnotherUnit) {
  SessionSetup setup = guided_setup();
  setup.experiment.instrument.range = ReadingRange{.low = -2.0, .high = 2.0};
  Hand hand(setup);
  hand.lay();
  EXPECT_TRUE(hand.happened("captured"));
  hand.feed(0.2, {0.0, 0.0, 2.5}, 0.0);
  EXPECT_TRUE(hand.has_alarm("saturated"));
  hand.feed(0.1, {0.0, 0.0, 1.0});
  EXPECT_FALSE(hand.has_alarm("saturated"));
  hand.feed(0.95, {0.5, 0.1, 0.8}, 0.0);
  EXPECT_TRUE(hand.has_alarm("stuck"));
  hand.feed(1.0, {0.01, 0.02, 1.0 / 9.80665});
  EXPECT_TRUE(hand.has_alarm("unit"));
  const std::array<double, 4> broken = {0.0, std::nan(""), 1.0, 20.0};
  hand.session().add(1e3, broken);
  EXPECT_TRUE(hand.has_alarm("not_a_number"));
  hand.session().idle(0.95);
  EXPECT_TRUE(hand.has_alarm("silent"));
}

TEST(Session, AUnitThatTheSourceStatesOtherwiseIsSaidAtOnce) {
  const ScratchFolder folder;
  Journal journal = Journal::create(folder.path("a.journal"));
  Session session(guided_setup(), journal);
  session.set_channels({{"x", "V"}, {"y", "g"}, {"z", "g"}});
  session.add(0.0, std::array<double, 3>{0.0, 0.0, 1.0});
  ASSERT_FALSE(session.view().alarms.empty());
  EXPECT_NE(session.view().alarms.front().text.find("has the unit V in the source"),
            std::string::npos);
  EXPECT_THROW(session.set_channels({{"a", ""}}), DomainError);
}

TEST(Session, UndoRetakeSkipReplicateAndFinishEarly) {
  Hand hand;
  for (int i = 0; i < 3; ++i) {
    hand.lay();
  }
  ASSERT_EQ(hand.session().readings().size(), 3U);
  const DesignPoint third = hand.session().readings().back().row.entry.point;
  hand.ask(SessionAction::undo);
  EXPECT_EQ(hand.session().readings().size(), 2U);
  EXPECT_EQ(hand.session().view().wanted->entry.point, third);
  hand.lay();
  EXPECT_EQ(hand.session().readings().back().run, 4) << "runs are in the order taken";
  hand.ask(SessionAction::retake, 1);
  hand.lay();
  EXPECT_EQ(hand.session().readings().back().run, 5);
  EXPECT_EQ(hand.session().readings().back().step, 0U);
  hand.ask(SessionAction::skip);
  EXPECT_EQ(hand.session().view().left, 8U);
  hand.ask(SessionAction::replicate);
  EXPECT_EQ(hand.session().view().left, 20U);
  for (int i = 0; i < 12; ++i) {
    hand.lay();
  }
  hand.ask(SessionAction::finish);
  EXPECT_EQ(hand.session().view().phase, SessionPhase::review);
  hand.ask(SessionAction::finish);
  EXPECT_TRUE(hand.session().is_over());
  EXPECT_FALSE(hand.session().calibrations().empty());
}

TEST(Session, AWrongPoseIsQuestionedAndMayBeTakenForWhatItIs) {
  Hand hand;
  hand.lay();
  hand.lay();
  const RunSheetRow wanted = *hand.session().view().wanted;
  // Another design point that has no reading yet.
  const auto& steps = hand.session().view().steps;
  const auto other = std::find_if(steps.begin() + 3, steps.end(), [&](const SessionStep& step) {
    return !step.run && step.row.entry.point.rest() != wanted.entry.point.rest() &&
           step.row.entry.point.rest() != hand.session().readings().back().row.entry.point.rest();
  });
  const DesignPoint laid = other->row.entry.point;
  hand.feed(1.0, Eigen::Vector3d::Zero(), 0.1);
  hand.feed(3.0, Hand::reading_at(laid));
  ASSERT_EQ(hand.session().view().phase, SessionPhase::question);
  EXPECT_EQ(hand.session().view().looks_like->rest(), laid.rest());
  EXPECT_EQ(hand.session().readings().size(), 2U) << "not accepted yet";
  EXPECT_NE(hand.session().view().headline.find("the reading shows"), std::string::npos);
  hand.ask(SessionAction::capture);
  EXPECT_EQ(hand.session().readings().size(), 2U) << "a second press is no answer";
  hand.ask(SessionAction::accept);
  EXPECT_EQ(hand.session().readings().size(), 3U);
  EXPECT_EQ(hand.session().readings().back().row.entry.point, wanted.entry.point);
}

TEST(Session, ATouchWithoutATurnIsNoNewReading) {
  Hand hand;
  hand.lay();
  const DesignPoint lies = hand.session().readings().back().row.entry.point;
  hand.feed(0.5, Hand::reading_at(lies), 0.05);
  hand.feed(4.0, Hand::reading_at(lies));
  EXPECT_EQ(hand.session().readings().size(), 1U);
  EXPECT_TRUE(hand.happened("as_before"));
}

constexpr Site sunny_site{.latitude_deg = 48.0, .longitude_deg = 11.0};

SessionSetup sun_setup(std::optional<double> fence_azimuth_rad) {
  SessionSetup setup = guided_setup();
  setup.unattended = false;
  setup.experiment.instrument = {.kind = "optical"};
  setup.experiment.field.of = make_field("light");
  setup.experiment.field.of = std::make_shared<const LightField>(LightField::sun());
  setup.experiment.table.site = sunny_site;
  setup.experiment.table.fence_azimuth_rad = fence_azimuth_rad;
  return setup;
}

// The sun moves by 30 degrees in two hours. The session still recognises a wrong pose.
TEST(Session, KnowsWhereTheSunHasGone) {
  constexpr double time_at_zero = 1782028800.0;  // 2026-06-21 08:00 UTC
  Hand hand(sun_setup(40.0 * rad_per_deg), time_at_zero);
  const LinearResponse truth{
      .bias = Eigen::Vector3d(0.1, -0.2, 0.05),
      .sensitivity = Eigen::Matrix3d({{2.0, 0.02, 0.0}, {-0.03, 2.1, 0.01}, {0.0, 0.04, 1.9}})};
  const auto reading_at = [&](const DesignPoint& point) -> Eigen::Vector3d {
    return truth.at(Positioner().rotation_table_from_positioner(point).transpose() *
                    rotation_table_from_enu(40.0 * rad_per_deg) *
                    sun_position(sunny_site, time_at_zero + hand.time_s()).direction_in_enu);
  };
  const auto lay = [&](const DesignPoint& point) {
    hand.feed(1.0, Eigen::Vector3d::Zero(), 0.3);
    for (int i = 0; i < 80; ++i) {
      hand.feed(0.1, reading_at(point));
    }
  };
  for (std::size_t i = 0; i < 12; ++i) {
    const DesignPoint wanted = hand.session().view().wanted->entry.point;
    if (i == 7) {
      lay({opposite(wanted.rest()), wanted.fence()});
      ASSERT_EQ(hand.session().view().phase, SessionPhase::question);
      EXPECT_EQ(hand.session().readings().size(), i);
    }
    lay(wanted);
    ASSERT_EQ(hand.session().readings().size(), i + 1);
    if (i == 3) {
      // The cube rests for five minutes while the sun moves. The session does not take this for
      // another pose.
      for (int second = 0; second < 300; ++second) {
        hand.feed(1.0, reading_at(wanted));
      }
      ASSERT_EQ(hand.session().readings().size(), i + 1);
    }
    hand.let_pass(600.0);
  }
  ASSERT_FALSE(hand.session().calibrations().empty());
  EXPECT_EQ(hand.session().calibrations().front().findings.status, CalibrationStatus::ok);
  EXPECT_MATRIX_NEAR(hand.session().calibrations().front().sensor.response.sensitivity,
                     truth.sensitivity, 1e-3);
  const std::optional<double> last = hand.session().observations().readings.back().time_s;
  EXPECT_NEAR(last.value(), time_at_zero + hand.time_s() - 606.0, 4.0);
}

TEST(Session, TheSunWantsTimesOfTheDay) {
  EXPECT_THROW(Hand(sun_setup({}), 1782028800.0), SetupError) << "the fence's azimuth";
  EXPECT_THROW(Hand(sun_setup(0.0), std::nullopt), DomainError) << "seconds of a recording";
  Hand at_night(sun_setup(0.0), 1782000000.0);
  EXPECT_THROW(at_night.feed(0.1, Eigen::Vector3d::Zero()), RefusedError);
}

// The header line of a journal, with the members that these tests need. The journal of Hand has no
// header.
const std::string journal_head = R"({"entry":"session","format":"axiscal-journal","version":1})";

TEST(Session, ASunSessionIsFinishedAtNight) {
  const std::vector<Channel> channels = {{"x", ""}, {"y", ""}, {"z", ""}};
  Hand hand(sun_setup(0.0), 1782028800.0);
  for (int i = 0; i < 12; ++i) {
    const DesignPoint wanted = hand.session().view().wanted->entry.point;
    hand.feed(1.0, Eigen::Vector3d::Zero(), 0.3);
    hand.feed(8.0, Positioner().rotation_table_from_positioner(wanted).transpose() *
                       Eigen::Vector3d(0.6, 0.0, 0.8));
  }
  ASSERT_EQ(hand.session().view().phase, SessionPhase::review);
  const ScratchFolder folder;
  const std::string path =
      folder.write("sun.journal", journal_head + "\n" + read_file(hand.journal_path()));
  std::vector<std::string> lines;
  Journal journal = Journal::open(path, lines);
  Session resumed(sun_setup(0.0), journal);
  resumed.restore(lines, path);
  resumed.set_channels(channels, 1782075600.0);  // 21:00 UTC
  EXPECT_NO_THROW(resumed.add(0.0, std::vector<double>{0.0, 0.0, 0.0}));
  EXPECT_EQ(resumed.view().phase, SessionPhase::review);
}

// Temperatures before a gap in the record are not used to decide whether the temperature is steady.
TEST(SoakWatch, ForgetsWhatWasBeforeAGap) {
  SoakWatch soak(30.0, 0.1);
  RandomStream random(1);
  for (double t = 0.0; t < 40.0; t += 1.0) {
    soak.add(t, 20.0 + 0.001 * random.normal());
  }
  EXPECT_TRUE(soak.look());
  soak.add(140.0, 33.0);
  EXPECT_FALSE(soak.look());
}

TEST(Session, DriftBeginsTheReadingAnew) {
  Hand hand;
  const DesignPoint point = hand.session().view().steps.front().row.entry.point;
  hand.lay();
  hand.feed(2.0, Eigen::Vector3d::Zero(), 0.1);
  for (int i = 0; i < 40; ++i) {
    hand.feed(0.1, Hand::reading_at(point) + Eigen::Vector3d::Constant(2e-4 * i));
  }
  EXPECT_TRUE(hand.happened("drift"));
}

TEST(Session, OnCommandItWaitsForIt) {
  SessionSetup setup = guided_setup();
  setup.automatic = false;
  Hand hand(setup);
  hand.lay();
  EXPECT_EQ(hand.session().view().phase, SessionPhase::ready);
  EXPECT_TRUE(hand.session().readings().empty());
  hand.ask(SessionAction::capture);
  EXPECT_EQ(hand.session().readings().size(), 1U);
}

TEST(Session, PausedItTakesNothing) {
  Hand hand;
  hand.lay();
  hand.ask(SessionAction::pause);
  hand.feed(1.0, Eigen::Vector3d::Zero(), 0.1);
  hand.feed(5.0, Eigen::Vector3d(0.0, 1.0, 0.0));
  EXPECT_EQ(hand.session().readings().size(), 1U);
  hand.ask(SessionAction::go_on);
  hand.lay();
  EXPECT_EQ(hand.session().readings().size(), 2U);
}

TEST(Session, SoaksBeforeABlockOfAnotherTemperature) {
  SessionSetup setup = guided_setup();
  setup.sheet = make_run_sheet(standard_design(6), 1, 1, {20.0, 40.0});
  setup.soak_window_s = 20.0;
  setup.soak_tolerance = 0.2;
  Hand hand(setup);
  hand.feed(0.1, {0, 0, 1});
  EXPECT_EQ(hand.session().view().phase, SessionPhase::soaking);
  hand.feed(25.0, {0, 0, 1});
  EXPECT_NE(hand.session().view().phase, SessionPhase::soaking);
  for (int i = 0; i < 6; ++i) {
    hand.lay();
  }
  EXPECT_EQ(hand.session().readings().size(), 6U);
  EXPECT_EQ(hand.session().view().phase, SessionPhase::soaking);
  hand.feed(30.0, {0, 0, 1});
  EXPECT_EQ(hand.session().view().phase, SessionPhase::soaking) << "steady, but at 20";
  hand.temperature = 39.5;
  hand.feed(45.0, {0, 0, 1});
  EXPECT_NE(hand.session().view().phase, SessionPhase::soaking);
  hand.lay();
  EXPECT_NEAR(hand.session().readings().back().temperature->mean(), 39.5, 1e-9);
}

TEST(Session, ReadingsThatCannotBeStoredAreKeptUntilTheyCan) {
  Hand hand;
  hand.lay();
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const rlimit full{.rlim_cur = 1, .rlim_max = before.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &full);
  hand.lay();
  const SessionPhase phase = hand.session().view().phase;
  const std::size_t readings = hand.session().readings().size();
  const bool said = hand.has_alarm("disk");
  hand.session().idle(0.1);
  ::setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(phase, SessionPhase::storing);
  EXPECT_EQ(readings, 1U) << "not shown as captured";
  EXPECT_TRUE(said);
  hand.session().idle(0.1);
  EXPECT_EQ(hand.session().readings().size(), 2U);
  EXPECT_FALSE(hand.has_alarm("disk"));
}

TEST(Session, AJournalReadAgainGivesTheSameReadings) {
  const ScratchFolder folder;
  const std::string path = folder.path("a.journal");
  SessionSetup setup = guided_setup();
  std::vector<CapturedReading> before;
  {
    Journal journal = Journal::create(path);
    ASSERT_EQ(journal.append(journal_head), "");
    Session session(setup, journal);
    std::vector<std::unique_ptr<Source>> sources;
    sources.push_back(std::make_unique<SimulatedSource>("sim:", simulation_of(1)));
    SampleFeed feed(std::move(sources));
    run_session(session, feed, {}, true);
    before = session.readings();
  }
  std::vector<std::string> lines;
  Journal journal = Journal::open(path, lines);
  Session session(setup, journal);
  session.restore(lines, path);
  ASSERT_EQ(session.readings().size(), before.size());
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(session.readings()[i].run, before[i].run);
    EXPECT_EQ(session.readings()[i].mean, before[i].mean) << "to the last digit";
  }
  lines.push_back("{\"entry\":\"captured\",\"run\":1}");
  Session other(setup, journal);
  EXPECT_NE(complaint_of<DataError>([&] { other.restore(lines, path); }).find(path + ":15"),
            std::string::npos);
}

TEST(Session, ViewsAndCommandsAsText) {
  EXPECT_EQ(parse_command(" retake 7 ")->run, 7);
  EXPECT_EQ(parse_command("undo")->action, SessionAction::undo);
  EXPECT_FALSE(parse_command("undo 3"));
  EXPECT_FALSE(parse_command("explode"));
  Hand hand;
  hand.lay();
  const nlohmann::json view = nlohmann::json::parse(view_json(hand.session().view()));
  EXPECT_EQ(view["phase"], "laying");
  EXPECT_EQ(view["done"], 1);
  EXPECT_EQ(view["steps"].size(), 12U);
  EXPECT_EQ(view["steps"][0]["run"], 1);
}

}  // namespace
}  // namespace axiscal::test
