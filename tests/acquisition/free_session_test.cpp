// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/free_session.hpp"

#include <gtest/gtest.h>

#include "axiscal/acquisition/session.hpp"
#include "axiscal/acquisition/session_header.hpp"
#include "axiscal/acquisition/session_json.hpp"
#include "axiscal/acquisition/simulated_source.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/calib/run.hpp"
#include "axiscal/core/error.hpp"
#include "guided.hpp"
#include "matchers.hpp"

namespace axiscal::test {
namespace {

using testing::HasSubstr;

// A simulated instrument that is turned by hand: a magnetometer in uT, or the accelerometer of
// guided_setup().
struct InTheHand {
  FreeSetup setup;
  SimulatedSource source;

  explicit InTheHand(bool magnetic, std::uint64_t seed = 1, double noise = 3e-3)
      : source("sim:", {.seed = seed, .noise_sd = noise, .rate_hz = 50.0}) {
    setup.experiment = guided_setup().experiment;
    setup.by_rests = !magnetic;
    if (magnetic) {
      setup.experiment.instrument = {.kind = "magnetometer", .unit = "uT"};
      setup.experiment.field = {};
      setup.experiment.field.of = make_field("geomagnetic");
      setup.experiment.field.magnitude = 48.0;
      setup.experiment.field.unit = "uT";
    }
    source.play(setup.experiment);
    source.set_free_motion(setup.by_rests);
  }

  // Adds the samples of the next `seconds` seconds to the session.
  void go_on(FreeSession& session, double seconds) {
    SampleBatch batch;
    while (batch.size() < static_cast<std::size_t>(50.0 * seconds)) {
      source.read(batch, {});
    }
    if (!begun_) {
      session.set_channels(source.channels(), 0.0);
      begun_ = true;
    }
    for (std::size_t i = 0; i < batch.size() && !session.is_over(); ++i) {
      session.add(batch.time_s[i], batch.row(i));
    }
  }

 private:
  bool begun_ = false;
};

// Largest difference of S S^T from the true one, where S is the sensitivity. S S^T does not depend
// on the frame, which is unknown.
double largest_error_of_shape(const Calibration& calibration, const LinearResponse& truth) {
  const Eigen::Matrix3d found = calibration.sensor.response.sensitivity;
  const Eigen::Matrix3d real = truth.sensitivity;
  return (found * found.transpose() - real * real.transpose()).cwiseAbs().maxCoeff();
}

TEST(FreeSession, FillsTheSphereAndCalibrates) {
  const ScratchFolder folder;
  Journal journal = Journal::create(folder.path("a.journal"));
  InTheHand hand(true);
  FreeSession session(hand.setup, journal);
  hand.go_on(session, 2.0);
  EXPECT_FALSE(session.view().free->is_enough);
  hand.go_on(session, 90.0);
  const SessionView& view = session.view();
  EXPECT_TRUE(view.free->is_enough) << *view.free->u_deg;
  EXPECT_GT(view.free->coverage, 0.9);
  EXPECT_EQ(possible_actions(view).front(), SessionAction::finish);
  EXPECT_THAT(view_json(view), Not(HasSubstr("\"points\"")));
  session.command({.action = SessionAction::finish, .run = {}});
  ASSERT_EQ(session.calibrations().size(), 1U);
  EXPECT_EQ(session.view().outcomes.front().rows.size(), 3U);
  session.command({.action = SessionAction::finish, .run = {}});
  EXPECT_TRUE(session.is_over());
  const Calibration& calibration = session.calibrations().front();
  EXPECT_NE(calibration.findings.status, CalibrationStatus::refused);
  EXPECT_LT(largest_error_of_shape(calibration, hand.source.truth()), 0.01);
  EXPECT_LT((calibration.sensor.response.bias - hand.source.truth().bias).norm(), 0.3);
  // The readings are the same after they are written to CSV and read again.
  const Observations readings = session.observations();
  const std::string path =
      folder.write("a.csv", observations_csv(readings, calibration.sensor.instrument.axes));
  EXPECT_EQ(read_run(path, {.axes = {"x", "y", "z"}}).observations.response, readings.response);
}

// A hand shakes the accelerometer. The session takes only the rests as readings, one for each
// direction.
TEST(FreeSession, TakesRestsOfAnAccelerometer) {
  const ScratchFolder folder;
  Journal journal = Journal::create(folder.path("a.journal"));
  InTheHand hand(false, 2, 1e-4);
  FreeSession session(hand.setup, journal);
  hand.go_on(session, 160.0);
  const std::size_t rests = session.view().free->points.size();
  EXPECT_GE(rests, 25U);
  EXPECT_LE(rests, 40U);  // at most one rest in four seconds
  for (const Eigen::Vector3d& one : session.view().free->points) {
    EXPECT_NEAR(one.norm(), 1.0, 0.06);
  }
  session.command({.action = SessionAction::undo, .run = {}});
  EXPECT_EQ(session.view().free->points.size(), rests - 1);
  EXPECT_EQ(session.view().free->dropped, 1U);
  session.command({.action = SessionAction::finish, .run = {}});
  ASSERT_EQ(session.calibrations().size(), 1U);
  EXPECT_LT(largest_error_of_shape(session.calibrations().front(), hand.source.truth()), 1e-3);
  // The calibration uses the stored readings, so a reading cannot be dropped after the calibration.
  session.command({.action = SessionAction::undo, .run = {}});
  EXPECT_EQ(session.observations().size(), static_cast<Eigen::Index>(rests) - 1);
  EXPECT_EQ(session.calibrations().front().fit.statistics->observations,
            static_cast<int>(rests) - 1);
}

// Each point is in the journal at most one second after it was taken, and a session resumes from
// the journal.
TEST(FreeSession, IsResumed) {
  const ScratchFolder folder;
  const std::string path = folder.path("a.journal");
  InTheHand hand(true, 3);
  std::size_t before = 0;
  {
    Journal journal = Journal::create(path);
    ASSERT_EQ(journal.append(session_header_line({.directory = folder.path(""), .free = true})),
              "");
    FreeSession session(hand.setup, journal);
    hand.go_on(session, 30.0);
    before = session.view().free->points.size();
  }  // the session ends without `finish`
  std::vector<std::string> lines;
  Journal journal = Journal::open(path, lines);
  FreeSession again(hand.setup, journal);
  again.restore(lines, path);
  const std::size_t there = again.view().free->points.size();
  EXPECT_LE(there, before);
  EXPECT_GE(there + 50, before);  // at most the 50 samples of the last second are lost
  lines.emplace_back(R"({"entry":"free_points","rows":[[1,2]]})");
  FreeSession wrong(hand.setup, journal);
  EXPECT_THAT([&] { wrong.restore(lines, path); },
              testing::ThrowsMessage<DataError>(HasSubstr("a time and three values")));
}

// Readings in one plane do not determine a sphere. The session asks for more directions and never
// says that the data are enough.
TEST(FreeSession, IsNotFooledByACircle) {
  const ScratchFolder folder;
  Journal journal = Journal::create(folder.path("a.journal"));
  InTheHand hand(true);
  FreeSession session(hand.setup, journal);
  session.set_channels(hand.source.channels(), 0.0);
  RandomStream random(1);
  for (int i = 0; i < 3000; ++i) {
    const double t = 0.02 * i;
    const double noise = 0.05;
    const std::array values = {t, 48.0 * std::cos(t) + noise * random.normal(),
                               48.0 * std::sin(t) + noise * random.normal(),
                               noise * random.normal()};
    session.add(t, values);
  }
  EXPECT_FALSE(session.view().free->is_enough);
  EXPECT_GT(session.view().free->largest_gap_rad, 1.0);
  EXPECT_THAT(session.view().detail, HasSubstr("more directions"));
  session.command({.action = SessionAction::finish, .run = {}});
  EXPECT_TRUE(session.calibrations().empty() ||
              session.calibrations().front().findings.status != CalibrationStatus::ok);
  session.command({.action = SessionAction::go_on, .run = {}});
  EXPECT_EQ(session.view().phase, SessionPhase::laying);
}

// An unattended session ends if no new readings come, although the wanted uncertainty is not
// reached.
TEST(FreeSession, EndsUnattendedWhereNothingNewComes) {
  const ScratchFolder folder;
  Journal journal = Journal::create(folder.path("a.journal"));
  InTheHand hand(false, 4, 1e-4);
  hand.setup.unattended = true;
  hand.setup.wanted_u_deg = 1e-9;
  FreeSession session(hand.setup, journal);
  for (int i = 0; i < 100 && !session.is_over(); ++i) {
    hand.go_on(session, 100.0);
  }
  EXPECT_TRUE(session.is_over());
  EXPECT_EQ(session.calibrations().size(), 1U);
}

TEST(FreeSession, NeedsThreeAxes) {
  const ScratchFolder folder;
  Journal journal = Journal::create(folder.path("a.journal"));
  InTheHand hand(true);
  hand.setup.experiment.instrument.axes = {"x", "y"};
  EXPECT_THROW(FreeSession(hand.setup, journal), SetupError);
}

}  // namespace
}  // namespace axiscal::test
