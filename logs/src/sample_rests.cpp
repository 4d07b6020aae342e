// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/sample_rests.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "axiscal/core/error.hpp"
#include "axiscal/core/median.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/logs/log_file.hpp"
#include "axiscal/logs/seats.hpp"
#include "axiscal/logs/segment.hpp"
#include "logs/src/unsettled_rests.hpp"

namespace axiscal {
namespace {

constexpr std::size_t fewest_samples = 30;

// @return the index of the first sample of each block, except the first block.
std::vector<std::size_t> begins_of(const Observations& samples) {
  std::vector<std::size_t> begins;
  for (std::size_t i = 1; i < samples.readings.size(); ++i) {
    if (samples.readings[i].block != samples.readings[i - 1].block) {
      begins.push_back(i);
    }
  }
  return begins;
}

// @return the number of samples per second; nullopt if the time increases at fewer than half of the
//         samples.
std::optional<double> rate_of(const Observations& samples) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < samples.readings.size(); ++i) {
    const std::optional<double>& before = samples.readings[i - 1].time_s;
    const std::optional<double>& now = samples.readings[i].time_s;
    if (before && now && *now > *before) {
      steps.push_back(*now - *before);
    }
  }
  if (2 * steps.size() < samples.readings.size()) {
    return std::nullopt;
  }
  return 1.0 / upper_median(std::move(steps));
}

// @return the number of samples in the detector's window, which is odd. The window is half a
//         second, or a hundredth of all samples if their rate is not known. It has at most a third
//         of the mean number of samples of a block.
std::size_t window_of(const Observations& samples,
                      const std::vector<std::size_t>& begins,
                      const std::optional<double>& rate_hz) {
  constexpr std::size_t least = 5;
  constexpr std::size_t most = 101;
  constexpr std::size_t most_without_times = 25;
  const std::size_t n = samples.readings.size();
  std::size_t window =
      rate_hz ? std::clamp(static_cast<std::size_t>(std::lround(std::min(0.5 * *rate_hz, 1e6))),
                           least, most)
              : std::clamp(n / 100, least, most_without_times);
  window = std::min(window, std::max(least, n / (begins.size() + 1) / 3));
  return window | 1U;
}

std::size_t middle_of(const StaticInterval& rest) {
  return (rest.first + rest.end) / 2;
}

// Leaves out intervals with slow motion, which are not rests. Their samples have a standard
// deviation of more than 2.5 % of the largest range of a column.
void leave_slow_motion_out(const Observations& samples, Segmentation& found) {
  const Eigen::VectorXd range =
      samples.response.colwise().maxCoeff() - samples.response.colwise().minCoeff();
  const double largest = 0.05 * 0.5 * range.maxCoeff();
  std::erase_if(found.intervals,
                [&](const StaticInterval& rest) { return !(rest.sd.maxCoeff() <= largest); });
}

std::vector<const std::vector<double>*> columns_of(const LogBlock& samples) {
  std::vector<const std::vector<double>*> columns;
  for (const std::vector<double>& column : samples) {
    columns.push_back(&column);
  }
  return columns;
}

Observations readings_of(const Observations& samples, const std::vector<StaticInterval>& rests) {
  Observations readings;
  const auto n = static_cast<Eigen::Index>(rests.size());
  const Eigen::Index m = samples.response.cols();
  readings.response.resize(n, m);
  readings.response_sd = Eigen::MatrixXd(n, m);
  readings.samples = Eigen::VectorXd(n);
  readings.has_block = samples.has_block;
  for (Eigen::Index i = 0; i < n; ++i) {
    const StaticInterval& rest = rests[static_cast<std::size_t>(i)];
    Reading reading = samples.readings[middle_of(rest)];
    reading.run = static_cast<int>(i) + 1;
    readings.readings.push_back(std::move(reading));
    readings.response.row(i) = rest.mean.head(m).transpose();
    readings.response_sd->row(i) = rest.sd.head(m).cwiseMax(1e-300).transpose();
    (*readings.samples)(i) = static_cast<double>(rest.samples());
  }
  return readings;
}

}  // namespace

std::optional<SampleRests> rests_of_samples(const Observations& samples) {
  const std::size_t n = samples.readings.size();
  const auto m = static_cast<std::size_t>(samples.response.cols());
  const bool are_readings =
      samples.samples || samples.response_sd || samples.has_level ||
      std::any_of(samples.readings.begin(), samples.readings.end(), [](const Reading& reading) {
        return reading.point || reading.field_in_sensor || reading.attitude || reading.confirm;
      });
  if (n < fewest_samples || are_readings) {
    return std::nullopt;
  }
  std::vector<std::string> columns;
  LogBlock block;
  for (std::size_t c = 0; c < m; ++c) {
    columns.push_back("c" + std::to_string(c + 1));
    const auto column = samples.response.col(static_cast<Eigen::Index>(c));
    block.emplace_back(column.begin(), column.end());
  }
  SegmentOptions options;
  options.columns = columns;
  options.begins = begins_of(samples);
  const std::optional<double> rate_hz = rate_of(samples);
  const std::size_t window = window_of(samples, options.begins, rate_hz);
  // With a rate of 1 Hz, all lengths in the options are numbers of samples.
  options.rate_hz = 1.0;
  options.window_s = static_cast<double>(window);
  options.trim_s = 0.0;
  options.shortest_s = std::max(4.0, static_cast<double>(window) / 2.0);
  Segmentation found;
  try {
    LogFile log("the readings", columns, block);
    found = segment(log, options);
  } catch (const Error&) {
    return std::nullopt;  // no rest
  }
  const Segmentation all = found;
  leave_slow_motion_out(samples, found);
  SampleRests rests;
  const UnsettledRests unsettled = find_unsettled_rests(found.intervals, columns_of(block));
  if (!unsettled.spans.empty()) {
    LogFile log("the readings", columns, block);
    std::optional<Segmentation> settled = settled_rests(log, options, all, unsettled);
    if (settled) {
      found = *std::move(settled);
      leave_slow_motion_out(samples, found);
    }
    rests.unsettled = sentence_about(unsettled, settled.has_value());
  }
  for (const StaticInterval& rest : found.intervals) {
    rests.rows.push_back(middle_of(rest));
    rests.samples += rest.samples();
  }
  constexpr double least_share = 0.3;
  if (found.intervals.empty() || 3 * found.intervals.size() > rests.samples ||
      static_cast<double>(rests.samples) < least_share * static_cast<double>(n)) {
    return std::nullopt;
  }
  rests.readings = readings_of(samples, found.intervals);
  rests.one_each_block = rests.readings.readings.size() == options.begins.size() + 1 &&
                         begins_of(rests.readings).size() == options.begins.size() &&
                         !options.begins.empty();
  if (rests.one_each_block) {
    for (Reading& reading : rests.readings.readings) {
      reading.block = 1;
    }
    rests.readings.has_block = false;
  }
  return rests;
}

std::vector<std::optional<Face>> faces_by_gravity(const Observations& readings) {
  const Eigen::MatrixX3d means = readings.response;
  const Eigen::MatrixX3d ups = approximate_up_directions(means).rowwise().normalized();
  const double apart = std::cos(10.0 * rad_per_deg);
  std::vector<Eigen::Index> places;
  for (Eigen::Index i = 0; i < ups.rows(); ++i) {
    if (std::none_of(places.begin(), places.end(),
                     [&](Eigen::Index place) { return ups.row(place).dot(ups.row(i)) > apart; })) {
      places.push_back(i);
    }
  }
  constexpr std::size_t most_places = 8;
  return places.size() > most_places ? std::vector<std::optional<Face>>() : resting_faces(means);
}

}  // namespace axiscal
