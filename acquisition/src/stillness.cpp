// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/stillness.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "acquisition/src/dwell_sums.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"

namespace axiscal {
namespace {

constexpr std::size_t fewest_samples_at_rest = 8;
constexpr std::size_t most_samples_at_rest = 1024;

}  // namespace

Stillness::Stillness(std::size_t axes, const StillnessOptions& options)
    : options_(options),
      axes_(static_cast<Eigen::Index>(axes)),
      floor_(Eigen::VectorXd::Zero(axes_)),
      step_(Eigen::VectorXd::Constant(axes_, std::numeric_limits<double>::infinity())),
      value_(axes, not_a_number),
      same_since_s_(axes, 0.0),
      same_samples_(axes, 0) {
  if (!(options.window_s > 0.0) || !(options.factor > 0.0)) {
    throw DomainError("Stillness: window and factor must be positive");
  }
  if (options.noise_sd.size() != 0) {
    if (options.noise_sd.size() != axes_ || !(options.noise_sd.array() > 0.0).all()) {
      throw DomainError("Stillness: noise_sd must contain a positive number for each axis");
    }
    floor_ = options.noise_sd;
    floor_known_ = true;
  }
  restart();
}

void Stillness::restart() {
  window_.clear();
  stride_ = 1;
  skipped_ = 0;
  since_sums_ = 0;
  rate_samples_ = 0;
  sum_ = Eigen::VectorXd::Zero(axes_);
  sum_of_squares_ = Eigen::VectorXd::Zero(axes_);
  std::fill(value_.begin(), value_.end(), not_a_number);
}

void Stillness::add(double time_s, std::span<const double> values) {
  if (rate_samples_++ == 0) {
    rate_from_s_ = time_s;
  } else if (time_s - rate_from_s_ >= options_.window_s - time_rounding_s && rate_samples_ > 2) {
    rate_hz_ = static_cast<double>(rate_samples_ - 1) / (time_s - rate_from_s_);
    rate_from_s_ = time_s;
    rate_samples_ = 1;
  }
  last_s_ = time_s;
  for (std::size_t k = 0; k < value_.size(); ++k) {
    if (values[k] == value_[k]) {
      ++same_samples_[k];
      continue;
    }
    const auto axis = static_cast<Eigen::Index>(k);
    if (std::isfinite(value_[k])) {
      step_(axis) = std::min(step_(axis), std::abs(values[k] - value_[k]));
    }
    value_[k] = values[k];
    same_since_s_[k] = time_s;
    same_samples_[k] = 1;
  }
  if (++skipped_ < stride_) {
    return;
  }
  skipped_ = 0;
  Sample sample{.time_s = time_s,
                .values = Eigen::Map<const Eigen::VectorXd>(values.data(), axes_)};
  bool anew = window_.empty() || ++since_sums_ >= std::max(window_.size(), fewest_samples_at_rest);
  window_.push_back(std::move(sample));
  while (window_.size() > fewest_samples_at_rest &&
         window_.front().time_s < time_s - options_.window_s - time_rounding_s) {
    const Eigen::VectorXd gone = window_.front().values - reference_;
    sum_ -= gone;
    sum_of_squares_ -= gone.cwiseAbs2();
    window_.pop_front();
  }
  if (window_.size() > most_samples_at_rest) {  // keeps every second sample
    std::deque<Sample> half;
    for (std::size_t i = 0; i < window_.size(); i += 2) {
      half.push_back(std::move(window_[i]));
    }
    window_ = std::move(half);
    stride_ *= 2;
    anew = true;
  }
  if (anew) {
    since_sums_ = 0;
    reference_ = window_.back().values;
    sum_.setZero();
    sum_of_squares_.setZero();
    for (const Sample& one : window_) {
      const Eigen::VectorXd difference = one.values - reference_;
      sum_ += difference;
      sum_of_squares_ += difference.cwiseAbs2();
    }
  } else {
    const Eigen::VectorXd difference = window_.back().values - reference_;
    sum_ += difference;
    sum_of_squares_ += difference.cwiseAbs2();
  }
  if (is_ready()) {
    sd_ = window_sd();
    update_floor();
  }
}

bool Stillness::is_ready() const {
  return window_.size() >= fewest_samples_at_rest &&
         window_.back().time_s - window_.front().time_s >=
             0.8 * options_.window_s - time_rounding_s;
}

Eigen::VectorXd Stillness::window_sd() const {
  const auto count = static_cast<double>(window_.size());
  return ((sum_of_squares_ - sum_.cwiseAbs2() / count) / (count - 1.0)).cwiseMax(0.0).cwiseSqrt();
}

void Stillness::update_floor() {
  if (floor_known_) {
    return;
  }
  Eigen::VectorXd sd = sd_;
  for (Eigen::Index k = 0; k < axes_; ++k) {
    // Rounding to the step of the A/D converter alone causes a standard deviation of
    // step / sqrt(12), so the noise floor is not set below it.
    if (std::isfinite(step_(k))) {
      sd(k) = std::max(sd(k), step_(k) / std::sqrt(12.0));
    }
    if (sd(k) > 0.0 && (floor_(k) == 0.0 || sd(k) < floor_(k))) {
      if (floor_(k) == 0.0 || sd(k) < 0.5 * floor_(k)) {
        floor_fell_s_ = last_s_;
      }
      floor_(k) = sd(k);
    }
  }
}

void Stillness::learn(const Eigen::VectorXd& sd) {
  for (Eigen::Index k = 0; k < axes_; ++k) {
    const double least = std::isfinite(step_(k)) ? step_(k) / std::sqrt(12.0) : 0.0;
    const double shown = std::max(sd(k), least);
    if (shown > 0.0 && (options_.noise_sd.size() == 0)) {
      // A noisier reading raises the floor by at most 50 %.
      floor_(k) = floor_(k) > 0.0 ? std::min(shown, 1.5 * floor_(k)) : shown;
    }
  }
  floor_known_ = true;
}

double Stillness::ratio() const {
  if (!is_ready()) {
    return std::numeric_limits<double>::infinity();
  }
  double largest = 0.0;
  for (Eigen::Index k = 0; k < axes_; ++k) {
    if (sd_(k) > 0.0) {
      largest = std::max(
          largest, floor_(k) > 0.0 ? sd_(k) / floor_(k) : std::numeric_limits<double>::infinity());
    }
  }
  return largest;
}

Eigen::VectorXd Stillness::mean() const {
  if (window_.empty()) {
    return Eigen::VectorXd::Zero(axes_);
  }
  return reference_ + sum_ / static_cast<double>(window_.size());
}

Stillness::Unchanged Stillness::unchanged(std::size_t axis) const {
  return {.seconds = last_s_ - same_since_s_[axis], .samples = same_samples_[axis]};
}

double Stillness::rate_hz() const {
  return rate_hz_;
}

}  // namespace axiscal
