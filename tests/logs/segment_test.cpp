// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/segment.hpp"

#include <cmath>

#include <gmock/gmock.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/logs/simulate_log.hpp"
#include "axiscal/logs/static_detector.hpp"
#include "matchers.hpp"
#include "program.hpp"

namespace axiscal {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

ImuSimulation plain_imu() {
  return {.accelerometer = {.bias = Eigen::Vector3d(0.02, -0.01, 0.03),
                            .sensitivity = Eigen::Matrix3d::Identity()},
          .accelerometer_sd = 1e-3};
}

RecordedLog cube_log(const ImuSimulation& simulation = plain_imu()) {
  return simulate_imu_log(simulation, attitudes_of(make_run_sheet(standard_design(12), 1, 1)));
}

SegmentOptions by_accelerometer() {
  return {.columns = {"ax", "ay", "az"}};
}

Segmentation segmented(const RecordedLog& log, const SegmentOptions& options = by_accelerometer()) {
  LogFile file(log.name, log.columns, log.samples);
  return segment(file, options);
}

// Mean, sd, effective number of samples and drift of a stretch, by their definitions.
struct Direct {
  double mean, sd, effective, drift;
};

Direct direct(const std::vector<double>& x, std::size_t first, std::size_t end) {
  const auto n = static_cast<double>(end - first);
  Direct result{};
  for (std::size_t i = first; i < end; ++i) {
    result.mean += x[i] / n;
  }
  double squares = 0.0;
  double slope = 0.0;
  for (std::size_t i = first; i < end; ++i) {
    squares += std::pow(x[i] - result.mean, 2);
    slope += (static_cast<double>(i - first) - 0.5 * (n - 1.0)) * (x[i] - result.mean) /
             (n * (n * n - 1.0) / 12.0);
  }
  const auto about_drift = [&](std::size_t i) {
    return x[i] - result.mean - slope * (static_cast<double>(i - first) - 0.5 * (n - 1.0));
  };
  double noise = 0.0;
  double products = 0.0;
  for (std::size_t i = first; i < end; ++i) {
    noise += std::pow(about_drift(i), 2);
    products += i + 1 < end ? about_drift(i) * about_drift(i + 1) : 0.0;
  }
  const double r = products / noise;
  result.sd = std::sqrt(squares / (n - 1.0));
  result.effective = std::clamp(n * (1.0 - r) / (1.0 + r), 1.0, n);
  result.drift = slope * (n - 1.0);
  return result;
}

TEST(Segment, FindsTheRestsOfACube) {
  const RecordedLog log = cube_log();
  const Segmentation rests = segmented(log);
  ASSERT_EQ(rests.intervals.size(), 12U);
  EXPECT_NEAR(rests.rate_hz, 100.0, 1e-9);
  EXPECT_THAT(rests.columns, ElementsAre("ax", "ay", "az"));
  EXPECT_THAT(rests.warnings, IsEmpty());
  for (std::size_t i = 0; i < 12; ++i) {
    const StaticInterval& rest = rests.intervals[i];
    // The rests have 300 samples every 449 samples. Half a window and the trim are removed at both
    // ends.
    EXPECT_GE(rest.first, 449 * i + (i == 0 ? 0U : 10U));
    EXPECT_LE(rest.end, 449 * i + 300);
    EXPECT_GE(rest.samples(), 170U);
    EXPECT_THAT(rests.marks[i], IsEmpty());
    for (Eigen::Index c = 0; c < 3; ++c) {
      const Direct expected =
          direct(log.samples[static_cast<std::size_t>(c) + 1], rest.first, rest.end);
      EXPECT_NEAR(rest.mean(c), expected.mean, 1e-12);
      EXPECT_NEAR(rest.sd(c), expected.sd, 1e-9);
      EXPECT_NEAR(rest.effective_samples(c) / expected.effective, 1.0, 0.03);
      EXPECT_NEAR(rest.drift(c), expected.drift, 1e-9);
    }
    EXPECT_DOUBLE_EQ(rest.start_s, log.samples[0][rest.first]);
    EXPECT_DOUBLE_EQ(rest.end_s, log.samples[0][rest.end - 1]);
  }
}

// The sums do not depend on the size of the blocks.
TEST(StaticDetector, DoesNotDependOnTheBlocks) {
  const RecordedLog log = cube_log();
  const std::size_t n = log.samples[0].size();
  std::vector<std::vector<IntervalSet>> all;
  for (const std::size_t block : {std::size_t{100000}, std::size_t{1000}, std::size_t{37}}) {
    StaticDetector detector({.detection = {0, 1, 2}}, 3);
    for (std::size_t i = 0; i < n; i += block) {
      const std::size_t count = std::min(block, n - i);
      LogBlock part;
      for (std::size_t c = 1; c < 4; ++c) {
        part.emplace_back(log.samples[c].begin() + static_cast<std::ptrdiff_t>(i),
                          log.samples[c].begin() + static_cast<std::ptrdiff_t>(i + count));
      }
      detector.add(std::span(log.samples[0]).subspan(i, count), part, std::vector<char>(count, 0));
    }
    all.push_back(detector.finish());
  }
  for (std::size_t variant = 1; variant < all.size(); ++variant) {
    // Levels that first occur later begin later. The levels of the rests and of the motion are
    // always there.
    const std::size_t chosen = most_persistent(all[0]);
    const std::size_t other = most_persistent(all[variant]);
    ASSERT_EQ(all[0][chosen].threshold, all[variant][other].threshold);
    const auto& a = all[0][chosen].intervals;
    const auto& b = all[variant][other].intervals;
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      EXPECT_EQ(a[i].first, b[i].first);
      EXPECT_EQ(a[i].end, b[i].end);
      EXPECT_MATRIX_NEAR(a[i].mean, b[i].mean, 1e-13);
      EXPECT_MATRIX_NEAR(a[i].sd, b[i].sd, 1e-9);
      EXPECT_MATRIX_NEAR(a[i].effective_samples, b[i].effective_samples, 1e-3);
    }
  }
}

// The threshold follows from the data, for any size of noise and motion and any unit.
TEST(Segment, ChoosesItsThresholdFromTheData) {
  for (const double scale : {1e-6, 1.0, 16384.0}) {
    for (const double sd : {1e-4, 5e-3}) {
      ImuSimulation simulation = plain_imu();
      simulation.accelerometer.bias *= scale;
      simulation.accelerometer.sensitivity *= scale;
      simulation.accelerometer_sd = sd * scale;
      EXPECT_EQ(segmented(cube_log(simulation)).intervals.size(), 12U) << scale << " " << sd;
    }
  }
}

TEST(Segment, TakesARateOrAColumnOfTimesInAnyUnit) {
  RecordedLog log = cube_log();
  const std::vector<double> seconds = log.samples[0];
  log.columns[0] = "timestamp_ms";
  for (double& t : log.samples[0]) {
    t = 5e5 + 1000.0 * t;
  }
  const Segmentation rests = segmented(log);
  EXPECT_NEAR(rests.rate_hz, 100.0, 1e-6);
  EXPECT_NEAR(rests.intervals[1].start_s, 500.0 + seconds[rests.intervals[1].first], 1e-9);
  SegmentOptions options = by_accelerometer();
  options.rate_hz = 50.0;
  EXPECT_NEAR(segmented(log, options).rate_hz, 50.0, 1e-12);
  EXPECT_THAT(segmented(log, options).columns, ElementsAre("ax", "ay", "az"));
  log.columns[0] = "stamp";
  EXPECT_THAT(test::complaint_of<DataError>([&] { segmented(log); }),
              HasSubstr("; name the column of times, or give the rate"));
  std::fill(log.samples[0].begin(), log.samples[0].end(), 3.0);
  options = by_accelerometer();
  options.time = "stamp";
  EXPECT_THAT(test::complaint_of<DataError>([&] { segmented(log, options); }),
              HasSubstr("the times never increase"));
}

TEST(Segment, MarksDriftAndJoinsWhatAKnockSplit) {
  RecordedLog log = cube_log();
  for (std::size_t i = 0; i < 300; ++i) {  // rest 3 drifts by 10 sigma
    log.samples[1][2 * 449 + i] += 1e-2 * static_cast<double>(i) / 300.0;
  }
  log.samples[2][5 * 449 + 150] += 0.3;  // a knock in the middle of rest 6
  SegmentOptions options = by_accelerometer();
  options.window_s = 0.3;
  options.shortest_s = 0.5;
  const Segmentation rests = segmented(log, options);
  ASSERT_EQ(rests.intervals.size(), 12U);
  EXPECT_THAT(rests.marks[2], ElementsAre("drift"));
  EXPECT_THAT(rests.warnings, Contains(HasSubstr("rest 3: a drift")));
  EXPECT_THAT(rests.notes, Contains(HasSubstr("1 rest was split by a knock")));
  options.join = false;
  EXPECT_EQ(segmented(log, options).intervals.size(), 13U);
}

TEST(Segment, BreaksAtMissingNumbersGapsAndSaturation) {
  RecordedLog log = cube_log();
  log.samples[3][150] = not_a_number;  // in rest 1
  for (std::size_t i = 449 + 150; i < log.samples[0].size(); ++i) {
    log.samples[0][i] += 2.0;  // a gap in rest 2
  }
  log.samples[0][2 * 449 + 150] = log.samples[0][2 * 449 + 140];  // back in time, in rest 3
  log.samples[1][3 * 449 + 150] = 16.0;                           // saturated, in rest 4
  SegmentOptions options = by_accelerometer();
  options.range = ReadingRange{.low = -16.0, .high = 16.0};
  options.window_s = 0.3;
  options.join = false;
  options.threshold = 1e-4;
  const Segmentation rests = segmented(log, options);
  EXPECT_EQ(rests.intervals.size(), 16U);
  EXPECT_THAT(rests.warnings, Contains(HasSubstr("1 sample has a cell that is not a number")));
  EXPECT_THAT(rests.warnings, Contains(HasSubstr("1 gap in the times")));
  EXPECT_THAT(rests.warnings, Contains(HasSubstr("1 time stamp is earlier than the one before")));
  EXPECT_THAT(rests.warnings, Contains(HasSubstr("1 sample is at or beyond the range")));
  EXPECT_EQ(rests.broken_samples, 4U);
  for (const StaticInterval& rest : rests.intervals) {
    EXPECT_TRUE(rest.mean.allFinite() && rest.sd.allFinite());
  }
}

// Empty cells of a slower sensor, columns of words and bursts of samples do not matter.
TEST(Segment, TakesLogsAsTheyCome) {
  RecordedLog log = cube_log();
  log.columns.insert(log.columns.end(), {"m", "words"});
  log.samples.emplace_back(log.samples[0].size(), not_a_number);
  log.samples.emplace_back(log.samples[0].size(), not_a_number);
  for (std::size_t i = 0; i < log.samples[0].size(); ++i) {
    if (i % 4 == 0) {
      log.samples[4][i] = 7.0;
    }
    log.samples[0][i] = 0.05 * static_cast<double>(i / 5) + 1e-4 * static_cast<double>(i % 5);
  }
  const Segmentation rests = segmented(log);
  ASSERT_EQ(rests.intervals.size(), 12U);
  EXPECT_NEAR(rests.rate_hz, 100.0, 0.5);
  EXPECT_EQ(rests.intervals[3].mean(3), 7.0);
  EXPECT_TRUE(std::isnan(rests.intervals[3].mean(4)));
  EXPECT_THAT(rests.notes, Contains(HasSubstr("column 'words' contains no numbers")));
}

TEST(Segment, IsNotMisledByAGlitch) {
  RecordedLog log = cube_log();
  log.samples[2][449 * 4 + 400] = 32767.0;  // in a turn
  EXPECT_EQ(segmented(log).intervals.size(), 12U);
}

TEST(Segment, SaysThatSlowMotionIsNoRest) {
  RecordedLog log{.name = "moving", .columns = {"t", "ax", "ay", "az"}, .samples = LogBlock(4)};
  RandomStream random(1);
  for (int i = 0; i < 3000; ++i) {
    const double t = 0.01 * i;
    log.samples[0].push_back(t);
    log.samples[1].push_back(std::sin(t) + 1e-3 * random.normal());
    log.samples[2].push_back(std::cos(t) + 1e-3 * random.normal());
    log.samples[3].push_back(1e-3 * random.normal());
  }
  EXPECT_THAT(segmented(log).warnings, Contains(HasSubstr("was the instrument at rest?")));
}

TEST(Segment, RefusesALogWithoutRest) {
  RandomStream random(1);
  RecordedLog log{.name = "shaken", .columns = {"t", "ax", "ay", "az"}, .samples = LogBlock(4)};
  for (int i = 0; i < 500; ++i) {
    log.samples[0].push_back(0.01 * i);
    for (std::size_t c = 1; c < 4; ++c) {
      log.samples[c].push_back(i % 40 == 0 ? not_a_number : random.normal());
    }
  }
  EXPECT_THAT(test::complaint_of<RefusedError>([&] { segmented(log); }),
              HasSubstr("no rest of 1 s or more was found in 500 samples (5 s)"));
}

// From a certain length on a log is read in a separate thread.
TEST(Segment, SaysWhatIsWrongFarBehindTheStart) {
  const test::ScratchFolder folder;
  std::string text = "ax,ay,az\n";
  constexpr int rows = 70000;
  for (int i = 0; i < rows; ++i) {
    text += i % 3 == 0 ? "0.1,0.2,1\n" : "0.1001,0.2,1.0001\n";
  }
  SegmentOptions options = by_accelerometer();
  options.rate_hz = 100.0;
  const auto segment_file = [&](const std::string& content) {
    LogFile file(folder.write("log.csv", content));
    return segment(file, options);
  };
  const Segmentation good = segment_file(text);
  EXPECT_EQ(good.samples, static_cast<std::size_t>(rows));
  ASSERT_EQ(good.intervals.size(), 1U);
  EXPECT_EQ(good.intervals.front().samples(), static_cast<std::size_t>(rows));
  EXPECT_THAT(test::complaint_of<DataError>(
                  [&] { static_cast<void>(segment_file(text + std::string(2U << 20U, '1'))); }),
              HasSubstr("log.csv:70002:"));
}

TEST(Segment, OfOneRestIsOneRest) {
  ImuSimulation simulation = plain_imu();
  simulation.rest_s = 20.0;
  const RecordedLog log = simulate_imu_log(simulation, {Eigen::Matrix3d::Identity()});
  const Segmentation rests = segmented(log);
  ASSERT_EQ(rests.intervals.size(), 1U);
  EXPECT_GT(rests.intervals[0].samples(), 1900U);
}

// A channel that never changes, as of an unplugged converter, is a rest. Its mark reports this.
TEST(Segment, MarksWhatIsStuck) {
  RecordedLog log = cube_log();
  for (std::size_t i = 0; i < 300; ++i) {
    log.samples[1][4 * 449 + i] = log.samples[1][4 * 449];
  }
  const Segmentation rests = segmented(log);
  ASSERT_EQ(rests.intervals.size(), 12U);
  EXPECT_THAT(rests.marks[4], ElementsAre("stuck"));
}

// Correlated samples count less. After a first-order low-pass filter with the coefficient r the
// factor is (1 - r) / (1 + r).
TEST(Segment, CountsEffectiveSamples) {
  RandomStream random(5);
  RecordedLog log{.name = "slow", .columns = {"t", "x"}, .samples = LogBlock(2)};
  constexpr double r = 0.8;
  double x = 0.0;
  for (int i = 0; i < 40000; ++i) {
    x = r * x + std::sqrt(1.0 - r * r) * random.normal();
    log.samples[0].push_back(0.01 * i);
    log.samples[1].push_back(x);
  }
  SegmentOptions options{.columns = {"x"}, .threshold = 1e9};
  const Segmentation rests = segmented(log, options);
  EXPECT_NEAR(rests.intervals.at(0).effective_samples(0) / 40000.0, (1.0 - r) / (1.0 + r), 0.01);
}

TEST(SegmentationCsv, HasWhatObservationsNeed) {
  const Segmentation rests = segmented(cube_log());
  const std::string text = segmentation_csv(rests);
  EXPECT_THAT(
      text, testing::StartsWith(
                "run,start,end,samples,ax,ay,az,ax_sd,ay_sd,az_sd,effective_samples,marks\n1,0,"));
  const std::vector<RunSheetRow> sheet = make_run_sheet(standard_design(12), 1, 1);
  const SeatLabels labels =
      label_by_sheet(resting_faces(means_of(rests, {"ax", "ay", "az"})), sheet);
  EXPECT_THAT(labels.messages, IsEmpty());
  const std::string labelled = segmentation_csv(rests, &labels, sheet);
  EXPECT_THAT(labelled, testing::StartsWith("run,block,rest,fence,start,end,samples,"));
  EXPECT_EQ(std::count(labelled.begin(), labelled.end(), '\n'), 13);
}

}  // namespace
}  // namespace axiscal
