// SPDX-License-Identifier: Apache-2.0
#include "sample_clock.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "axiscal/calib/moving_field.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/logs/segment.hpp"

namespace axiscal {
namespace {

// A source's own clock that runs ahead of the arrivals by more than this was set.
constexpr double longest_lead_s = 2.0;

// Counting: how far it may stray from the arrivals, and how it comes back.
constexpr double free_lag_s = 0.25;
constexpr double pace_window_s = 2.0;
constexpr double pull_back_s = 10.0;
constexpr double largest_pull = 0.5;

}  // namespace

double session_seconds() {
  static const auto start = std::chrono::steady_clock::now();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

SampleClock::SampleClock(const SourceAddress& address)
    : address_(address), rate_hz_(address.number_or("rate", 0.0, 1e-3, 1e7)) {
  if (address.find("rate") && address.find("time")) {
    address.fail("rate= or time=, one of them");
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
  if (const auto found = find_time_column(address_.text, names, address_.text_or("time", ""))) {
    column_ = found->position;
    seconds_ = found->seconds;
  }
}

// Samples wait on their way, one after another or many at once; the one that came fastest tells.
double SampleClock::counted(double arrival_s) {
  if (!started_) {
    pace_from_s_ = arrival_s;
    return arrival_s;
  }
  const double time_s = last_s_ + pace_ / rate_hz_;
  if (arrival_s == 0.0) {
    return time_s;  // recorded
  }
  least_lag_s_ = std::min(least_lag_s_, arrival_s - time_s);
  if (arrival_s - pace_from_s_ < pace_window_s) {
    return time_s;
  }
  const double lag_s = std::exchange(least_lag_s_, std::numeric_limits<double>::infinity());
  const double astray_s = lag_s - std::clamp(lag_s, -free_lag_s, free_lag_s);
  pace_ = 1.0 + std::clamp(astray_s / pull_back_s, -largest_pull, largest_pull);
  pace_from_s_ = arrival_s;
  return lag_s > pace_window_s ? arrival_s : time_s;
}

void SampleClock::append(std::span<const double> values,
                         double arrival_s,
                         SampleBatch& batch,
                         SourceReport& report) {
  double time_s = std::max(arrival_s, last_s_);
  if (rate_hz_ > 0.0) {
    time_s = counted(arrival_s);
  } else if (column_) {
    const double own = values[*column_] * seconds_;
    if (!std::isfinite(own)) {
      ++report.defects;
      return;
    }
    if (!started_) {
      // Recordings of one logger go together by their own times.
      const bool keeps_own = arrival_s == 0.0 && !is_utc(own);
      offset_ = keeps_own ? 0.0 : arrival_s - own;
      last_s_ = offset_ + own;
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
      report.utc_at_zero = seconds_now() - session_seconds();
    } else if (column_ && is_utc(last_own_)) {
      report.utc_at_zero = last_own_;
    }
  }
  started_ = true;
  last_s_ = time_s;
  last_arrival_ = arrival_s;
  last_values_.assign(values.begin(), values.end());
  batch.add(time_s, values);
}

}  // namespace axiscal
