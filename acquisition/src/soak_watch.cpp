// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/soak_watch.hpp"

#include <utility>
#include <vector>

namespace axiscal {

void SoakWatch::add(double time_s, const SensorTemperature& temperature) {
  sum_ += temperature.mean();
  sum_of_axes_.resize(temperature.of_axes().size());
  for (std::size_t k = 0; k < sum_of_axes_.size(); ++k) {
    sum_of_axes_[k] += temperature.of_axes()[k];
  }
  ++count_;
  last_ = temperature.mean();
  constexpr double spacing_s = 1.0;
  if (!time_s_.empty() && time_s - time_s_.back() < spacing_s) {
    return;
  }
  is_news_ = true;
  time_s_.push_back(time_s);
  temperature_.push_back(temperature.mean());
  while (time_s_.front() < time_s - 2.0 * window_s_) {
    time_s_.pop_front();
    temperature_.pop_front();
  }
}

void SoakWatch::begin_mean() {
  sum_ = 0.0;
  sum_of_axes_.clear();
  count_ = 0;
}

std::optional<SensorTemperature> SoakWatch::mean() const {
  if (count_ == 0) {
    return std::nullopt;
  }
  if (sum_of_axes_.empty()) {
    return sum_ / static_cast<double>(count_);
  }
  std::vector<double> means = sum_of_axes_;
  for (double& mean : means) {
    mean /= static_cast<double>(count_);
  }
  return SensorTemperature(std::move(means));
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
