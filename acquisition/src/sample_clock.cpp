// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/sample_clock.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/timestamp.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// The source's clock has jumped if the time between two samples, by this clock, exceeds the time
// between their arrivals by more than this limit.
constexpr double longest_lead_s = 2.0;

// Constants for the correction of counted times:
constexpr double free_lag_s = 0.25;    // tolerated deviation from the arrival times
constexpr double pace_window_s = 2.0;  // interval between corrections
constexpr double pull_back_s = 10.0;   // time in which a deviation is removed
constexpr double learn_pace = 0.2;     // share of a correction that becomes permanent
constexpr double largest_pull = 0.5;   // largest relative correction of the counted step
constexpr double least_pace = 0.1;     // smallest counted step relative to 1 / rate

}  // namespace

double session_seconds() {
  static const auto start = std::chrono::steady_clock::now();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

SampleClock::SampleClock(const SourceAddress& address)
    : address_(address), rate_hz_(address.number_or("rate", 0.0, 1e-3, 1e7)) {
  if (address.find("rate") && address.find("time")) {
    address.fail("give rate= or time=, but not both");
  }
}

const std::vector<std::string>& SampleClock::options() {
  static const std::vector<std::string> names = {"rate", "time"};
  return names;
}

void SampleClock::set_channels(const std::vector<Channel>& channels) {
  if (rate_hz_ > 0.0) {
    return;
  }
  std::vector<std::string> names;
  for (const Channel& channel : channels) {
    names.push_back(channel.name);
  }
  column_ = find_time_column(address_.text, names, address_.text_or("time", ""));
}

void SampleClock::check_unit(const std::string& path,
                             const std::vector<std::vector<double>>& block) const {
  if (!column_ || rate_hz_ > 0.0) {
    return;
  }
  const TimeUnit unit = settle_time_unit(path, *column_, block[column_->position]);
  if (unit.seconds != column_->seconds) {
    throw DataError(path,
                    formatted("the sample rate shows that the times of column '{}' are not in "
                              "seconds; give their unit with names=t_us,... (or t_ms, t_ns), or "
                              "give rate=HZ",
                              column_->name));
  }
}

// Returns the time of the next sample by counting, and corrects the length of the counted step. The
// lag of a sample is its arrival time minus its counted time. Samples arrive singly or in bursts,
// so their lags differ. The counted times in a window are too early if even the smallest lag is
// above free_lag_s, and too late if even the largest lag is below -free_lag_s.
double SampleClock::counted(double arrival_s) {
  if (!started_) {
    pace_from_s_ = arrival_s;
    return arrival_s;
  }
  const double time_s = last_s_ + pace_ / rate_hz_;
  if (arrival_s == 0.0) {
    return time_s;  // the sample is from a recording, which lacks arrival times
  }
  const double lag_s = arrival_s - time_s;
  if (lag_s > pace_window_s && arrival_s - last_arrival_ > pace_window_s) {
    pace_ = known_pace_;
    restart_pace(arrival_s);
    return arrival_s;  // counting starts again after an interruption
  }
  least_lag_s_ = std::min(least_lag_s_, lag_s);
  most_lag_s_ = std::max(most_lag_s_, lag_s);
  if (arrival_s - pace_from_s_ >= pace_window_s) {
    const double astray_s =
        std::max(least_lag_s_ - free_lag_s, 0.0) + std::min(most_lag_s_ + free_lag_s, 0.0);
    const double pull = std::clamp(astray_s / pull_back_s, -largest_pull, largest_pull);
    known_pace_ =
        std::clamp(known_pace_ + learn_pace * pull, 1.0 - largest_pull, 1.0 + largest_pull);
    pace_ = std::max(known_pace_ + pull, least_pace);
    restart_pace(arrival_s);
  }
  return time_s;
}

void SampleClock::restart_pace(double arrival_s) {
  pace_from_s_ = arrival_s;
  least_lag_s_ = std::numeric_limits<double>::infinity();
  most_lag_s_ = -std::numeric_limits<double>::infinity();
}

void SampleClock::append(std::span<const double> values,
                         double arrival_s,
                         SampleBatch& batch,
                         SourceReport& report) {
  double time_s = std::max(arrival_s, last_s_);
  if (rate_hz_ > 0.0) {
    time_s = counted(arrival_s);
  } else if (column_) {
    const double own = values[column_->position] * column_->seconds;
    if (!std::isfinite(own)) {
      ++report.defects;
      return;
    }
    if (!started_) {
      offset_ = arrival_s - own;
    } else if (own == last_own_ &&
               std::equal(values.begin(), values.end(), last_values_.begin(), last_values_.end())) {
      ++report.duplicates;
      return;
    }
    const double passed = arrival_s - last_arrival_;
    const double step = own - last_own_;
    if (started_ && (step < 0.0 || (arrival_s > 0.0 && step > passed + longest_lead_s))) {
      report.clock_stepped = true;
      offset_ = last_s_ + step_s_ - own;
    } else if (started_) {
      step_s_ = step;
    }
    last_own_ = own;
    time_s = std::max(offset_ + own, last_s_);
  }
  if (!started_) {
    if (arrival_s > 0.0) {
      report.time_at_zero = seconds_now() - session_seconds();
    } else if (column_) {
      report.time_at_zero = last_own_;
    }
  }
  started_ = true;
  last_s_ = time_s;
  last_arrival_ = arrival_s;
  last_values_.assign(values.begin(), values.end());
  batch.add(time_s, values);
}

}  // namespace axiscal
