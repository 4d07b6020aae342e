// SPDX-License-Identifier: Apache-2.0
#include "logs/recordings/src/series_log.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"

namespace axiscal {
namespace {

struct Sample {
  double time_s = 0.0;
  std::vector<double> values;
};

bool is_whole(std::span<const double> values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

}  // namespace

// Stores the samples of the series that the table needs, until the rows that use them are complete.
class SeriesLog::Sink final : public SeriesSink {
 public:
  Sink(std::size_t base, const std::vector<MergedColumn>& columns) : base_(base) {
    for (const MergedColumn& column : columns) {
      resize(column.series);
      queues_[column.series].wanted = true;
    }
    resize(base);
    queues_[base].wanted = true;
  }

  void add(const Series&) override {}

  void sample(std::size_t series, double time_s, std::span<const double> values) override {
    if (series >= queues_.size() || !queues_[series].wanted) {
      return;
    }
    Queue& queue = queues_[series];
    if (series != base_) {
      if (!is_whole(values)) {
        return;  // a sample with missing values is ignored
      }
      if (!queue.samples.empty() && time_s <= queue.samples.back().time_s) {
        return;
      }
      const double last = queue.samples.empty() ? not_a_number : queue.samples.back().time_s;
      if (time_s > last) {
        queue.step_s =
            queue.step_s > 0.0 ? std::min(queue.step_s * 1.05, time_s - last) : time_s - last;
      }
    }
    queue.samples.push_back({time_s, {values.begin(), values.end()}});
  }

  struct Queue {
    bool wanted = false;
    std::deque<Sample> samples;
    double step_s = 0.0;  // usual step [s]: the last step, but at most 1.05 x the old usual step
  };

  std::vector<Queue>& queues() { return queues_; }

 private:
  void resize(std::size_t series) { queues_.resize(std::max(queues_.size(), series + 1)); }

  std::size_t base_;
  std::vector<Queue> queues_;
};

SeriesLog::SeriesLog(DecoderPointer decoder, std::size_t base, std::vector<MergedColumn> merged)
    : decoder_(std::move(decoder)),
      sink_(std::make_unique<Sink>(base, merged)),
      base_(base),
      merged_(std::move(merged)) {
  columns.emplace_back("time_s");
  for (const MergedColumn& column : merged_) {
    columns.push_back(column.name);
  }
  selected_.resize(columns.size());
  std::iota(selected_.begin(), selected_.end(), std::size_t{0});
}

SeriesLog::~SeriesLog() = default;

void SeriesLog::select(const std::vector<std::size_t>& selected) {
  selected_ = selected;
}

// Makes the next row of the table.
// @return false if a sample that the row needs has not been read yet.
bool SeriesLog::take_row(std::vector<double>& row) {
  std::vector<Sink::Queue>& queues = sink_->queues();
  std::deque<Sample>& base = queues[base_].samples;
  if (base.empty()) {
    return false;
  }
  const double time_s = base.front().time_s;
  const bool has_times = std::isfinite(time_s);
  for (std::size_t s = 0; s < queues.size(); ++s) {
    Sink::Queue& queue = queues[s];
    if (!queue.wanted || s == base_) {
      continue;
    }
    if (!at_end_ &&
        (queue.samples.empty() || (has_times && queue.samples.back().time_s < time_s))) {
      return false;  // a sample at or after the row's time has not been read yet
    }
    while (has_times && queue.samples.size() > 2 && queue.samples[1].time_s <= time_s) {
      queue.samples.pop_front();
    }
  }
  row[0] = time_s;
  for (std::size_t c = 0; c < merged_.size(); ++c) {
    const MergedColumn& column = merged_[c];
    if (column.series == base_) {
      row[c + 1] = base.front().values[column.place];
      continue;
    }
    const Sink::Queue& queue = queues[column.series];
    row[c + 1] = not_a_number;
    if (queue.samples.empty()) {
      continue;
    }
    if (!has_times) {  // without times, the n-th samples of all series form the n-th row
      row[c + 1] = queue.samples.front().values[column.place];
      continue;
    }
    const auto after = std::find_if(queue.samples.begin(), queue.samples.end(),
                                    [&](const Sample& sample) { return sample.time_s >= time_s; });
    // A sample is used for rows that are at most `longest` usual steps away. Other rows get NaN.
    constexpr double longest = 8.0;
    const double reach = longest * queue.step_s;
    if (after == queue.samples.end()) {
      const Sample& last = queue.samples.back();
      row[c + 1] = time_s - last.time_s <= reach ? last.values[column.place] : not_a_number;
    } else if (after->time_s == time_s || after == queue.samples.begin()) {
      row[c + 1] = after->time_s - time_s <= reach || after->time_s == time_s
                       ? after->values[column.place]
                       : not_a_number;
    } else {
      const Sample& before = *std::prev(after);
      const double step = after->time_s - before.time_s;
      const double part = (time_s - before.time_s) / step;
      row[c + 1] = step <= 2.0 * reach || !(reach > 0.0)
                       ? before.values[column.place] +
                             part * (after->values[column.place] - before.values[column.place])
                       : not_a_number;
    }
  }
  base.pop_front();
  if (has_begun_ || !has_times) {
    has_begun_ = true;
  } else {
    // Sensors start some milliseconds apart. During the first second, rows in which a sensor is
    // missing are therefore left out until the first complete row.
    constexpr double longest_wait_s = 1.0;
    first_s_ = std::isnan(first_s_) ? time_s : first_s_;
    has_begun_ = time_s - first_s_ > longest_wait_s ||
                 std::none_of(row.begin(), row.end(), [](double v) { return std::isnan(v); });
  }
  for (std::size_t s = 0; !has_times && s < queues.size(); ++s) {
    if (queues[s].wanted && s != base_ && !queues[s].samples.empty()) {
      queues[s].samples.pop_front();
    }
  }
  return true;
}

std::size_t SeriesLog::read(LogBlock& block, std::size_t most) {
  block.assign(selected_.size(), {});
  std::vector<double> row(columns.size());
  std::size_t rows = 0;
  while (rows < most) {
    if (take_row(row)) {
      if (!has_begun_) {
        continue;
      }
      for (std::size_t s = 0; s < selected_.size(); ++s) {
        const double value = row[selected_[s]];
        block[s].push_back(value);
        if (!std::isfinite(value)) {
          ++defects.missing_numbers;
        }
      }
      ++rows;
    } else if (at_end_) {
      break;
    } else {
      at_end_ = !decoder_->read(*sink_);
    }
  }
  return rows;
}

}  // namespace axiscal
