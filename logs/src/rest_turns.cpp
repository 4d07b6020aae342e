// SPDX-License-Identifier: Apache-2.0
#include "logs/src/rest_turns.hpp"

#include <algorithm>
#include <cmath>

namespace axiscal {

RestTurns::RestTurns(const RecordedLog& log, const ImuOptions& options, double rate_hz)
    : rate_hz_(rate_hz), begins_(options.segment.begins) {
  const auto finite = [](double v) { return std::isfinite(v); };
  owned_.reserve(options.gyroscope.size());
  for (const std::string& name : options.gyroscope) {
    const std::vector<double>& x = log.samples[need_column(log.name, log.columns, name)];
    if (std::all_of(x.begin(), x.end(), finite)) {
      gyroscope_.emplace_back(x);
    } else {
      gyroscope_.emplace_back(owned_.emplace_back(filled(x)));
    }
  }
  make_times(log, options.segment);
}

std::vector<GyroscopeTurn> RestTurns::turns(const Segmentation& rests,
                                            const std::vector<std::size_t>& between,
                                            const Eigen::MatrixX3d& ups) {
  std::vector<GyroscopeTurn> turns;
  ends.clear();
  left_out = 0;
  for (std::size_t i = 0; i + 1 < between.size(); ++i) {
    const StaticInterval& a = rests.intervals[between[i]];
    const StaticInterval& b = rests.intervals[between[i + 1]];
    const std::size_t first = a.end - 1;
    const std::size_t count = b.first - first + 1;
    const bool spans_recordings =
        std::any_of(begins_.begin(), begins_.end(),
                    [&](std::size_t begin) { return begin > first && begin < first + count; });
    if (spans_recordings) {
      continue;  // the turn from one recording to the next was not recorded
    }
    if (!is_whole(first, count)) {
      ++left_out;
      continue;
    }
    GyroscopeTurn& turn = turns.emplace_back();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      turn.readings[axis] = gyroscope_[axis].subspan(first, count);
    }
    turn.time_s = time_s_.subspan(first, count);
    turn.up_before = ups.row(static_cast<Eigen::Index>(between[i])).transpose();
    turn.up_after = ups.row(static_cast<Eigen::Index>(between[i + 1])).transpose();
    turn.follows = !ends.empty() && ends.back().second == between[i];
    ends.emplace_back(between[i], between[i + 1]);
  }
  return turns;
}

std::vector<double> RestTurns::filled(std::vector<double> x) const {
  const auto longest = static_cast<std::size_t>(0.1 * rate_hz_) + 1;
  for (std::size_t i = 1; i < x.size(); ++i) {
    if (std::isfinite(x[i])) {
      continue;
    }
    std::size_t end = i;
    while (end < x.size() && !std::isfinite(x[end])) {
      ++end;
    }
    if (end < x.size() && end - i <= longest && std::isfinite(x[i - 1])) {
      const double step = (x[end] - x[i - 1]) / static_cast<double>(end - i + 1);
      for (std::size_t k = i; k < end; ++k) {
        x[k] = x[k - 1] + step;
      }
    }
    i = end;
  }
  return x;
}

void RestTurns::make_times(const RecordedLog& log, const SegmentOptions& options) {
  const std::optional<TimeColumn> column =
      options.rate_hz ? std::nullopt : find_time_column(log.name, log.columns, options.time);
  const double seconds =
      column ? settle_time_unit(log.name, *column, log.samples[column->position]).seconds : 1.0;
  if (column && seconds == 1.0) {
    time_s_ = log.samples[column->position];
    return;
  }
  owned_times_.resize(log.samples.front().size());
  for (std::size_t i = 0; i < owned_times_.size(); ++i) {
    owned_times_[i] =
        column ? log.samples[column->position][i] * seconds : static_cast<double>(i) / rate_hz_;
  }
  time_s_ = owned_times_;
}

bool RestTurns::is_whole(std::size_t first, std::size_t count) const {
  const double longest_step = std::max(5.0 / rate_hz_, 0.1);
  for (std::size_t i = first; i < first + count; ++i) {
    for (const std::span<const double> axis : gyroscope_) {
      if (!std::isfinite(axis[i])) {
        return false;
      }
    }
    const double step = i > first ? time_s_[i] - time_s_[i - 1] : 0.0;
    if (!(step >= 0.0 && step <= longest_step)) {
      return false;
    }
  }
  return true;
}

}  // namespace axiscal
