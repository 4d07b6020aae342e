// SPDX-License-Identifier: Apache-2.0
#include "soak_watch.hpp"

#include <utility>
#include <vector>

namespace axiscal {

void SoakWatch::add(double time_s, double temperature) {
  sum_ += temperature;
  ++count_;
  last_ = temperature;
  constexpr double spacing_s = 1.0;
  if (!time_s_.empty() && time_s - time_s_.back() < spacing_s) {
    return;
  }
  is_news_ = true;
  time_s_.push_back(time_s);
  temperature_.push_back(temperature);
  while (time_s_.front() < time_s - 2.0 * window_s_) {
    time_s_.pop_front();
    temperature_.pop_front();
  }
}

void SoakWatch::begin_mean() {
  sum_ = 0.0;
  count_ = 0;
}

std::optional<double> SoakWatch::mean() const {
  return count_ > 0 ? std::optional(sum_ / static_cast<double>(count_)) : std::nullopt;
}

bool SoakWatch::look() {
  if (std::exchange(is_news_, false)) {
    state_ = {};
    if (time_s_.size() > 2 && time_s_.back() - time_s_.front() >= window_s_) {
      const std::vector<double> times(time_s_.begin(), time_s_.end());
      const std::vector<double> temperatures(temperature_.begin(), temperature_.end());
      state_ = soak_state(times, temperatures, window_s_, tolerance_);
    }
  }
  return state_.steady;
}

}  // namespace axiscal
