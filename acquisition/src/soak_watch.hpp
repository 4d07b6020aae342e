// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "axiscal/calib/temperature.hpp"

namespace axiscal {

/// Detects whether the temperature in a session is steady.
class SoakWatch {
 public:
  SoakWatch(double window_s, double tolerance) : window_s_(window_s), tolerance_(tolerance) {}

  /// @param temperature  finite temperatures of the sensors; their number is constant.
  void add(double time_s, const SensorTemperature& temperature);

  /// Restarts the mean that mean() returns.
  void begin_mean();

  /// @return the mean since begin_mean(); nullopt without samples.
  [[nodiscard]] std::optional<SensorTemperature> mean() const;

  /// @return the last temperature (the mean of several sensors); nullopt before the first add().
  [[nodiscard]] std::optional<double> temperature() const { return last_; }

  /// Updates the state if new temperatures have arrived.
  /// @return true if the temperature is steady over the window, according to soak_state().
  bool look();

  /// @return the state at the last look().
  [[nodiscard]] const SoakState& state() const { return state_; }

 private:
  double window_s_;
  double tolerance_;
  std::optional<double> last_;
  std::deque<double> time_s_;  // times of the entries of temperature_; at most one entry per second
  std::deque<double> temperature_;
  double sum_ = 0.0;
  std::vector<double> sum_of_axes_;  // empty unless each axis has its own sensor
  std::size_t count_ = 0;
  bool is_news_ = false;
  SoakState state_;
};

}  // namespace axiscal
