// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "axiscal/calib/temperature.hpp"

namespace axiscal {

/// Watches the temperature of a session: is it steady?
class SoakWatch {
 public:
  SoakWatch(double window_s, double tolerance) : window_s_(window_s), tolerance_(tolerance) {}

  /// @param temperature  finite, of as many sensors each time.
  void add(double time_s, const SensorTemperature& temperature);

  /// From now on mean() is of what comes.
  void begin_mean();

  /// @return the mean since begin_mean(); nothing where nothing came.
  [[nodiscard]] std::optional<SensorTemperature> mean() const;

  /// @return the last one, of several sensors their mean, where there is any.
  [[nodiscard]] std::optional<double> temperature() const { return last_; }

  /// Looks again where something new has come since.
  /// @return whether it is steady over the window, as soak_state().
  bool look();

  /// @return what was seen then.
  [[nodiscard]] const SoakState& state() const { return state_; }

 private:
  double window_s_;
  double tolerance_;
  std::optional<double> last_;
  std::deque<double> time_s_;  // one a second
  std::deque<double> temperature_;
  double sum_ = 0.0;
  std::vector<double> sum_of_axes_;  // where each axis has a sensor of its own
  std::size_t count_ = 0;
  bool is_news_ = false;
  SoakState state_;
};

}  // namespace axiscal
