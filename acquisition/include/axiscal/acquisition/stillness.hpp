// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"

namespace axiscal {

struct StillnessOptions {
  double window_s = 0.5;  ///< length of the sliding window for the scatter
  /// Standard deviation of one sample at rest, m entries [unit]. If empty, it is learned from the
  /// quietest windows.
  Eigen::VectorXd noise_sd;
  double factor = 4.0;  ///< at rest, the scatter is at most this multiple of the noise floor
};

/// Detects in real time whether an instrument is still. It compares the scatter within a sliding
/// window with the instrument's noise floor.
///
/// The noise floor is StillnessOptions::noise_sd if that option is stated. Otherwise it is the
/// scatter of the quietest window so far, until learn() sets it. The memory use does not depend on
/// the sample rate.
class Stillness {
 public:
  /// @param axes     number of axes, m.
  /// @param options  window, noise, and the threshold for stillness.
  /// @throws DomainError  if the window or factor is not positive, or if noise_sd is not empty and
  ///                      does not have m positive entries.
  explicit Stillness(std::size_t axes, const StillnessOptions& options = {});

  /// @param time_s  time of the sample; must not decrease.
  /// @param values  m finite values.
  void add(double time_s, std::span<const double> values);

  /// Clears the window. Must be called if the samples have a gap.
  void restart();

  /// Sets the noise floor to the scatter of a reading at rest, but to at most 1.5 times the earlier
  /// floor. Has no effect if noise_sd is stated.
  /// @param sd  standard deviation of the samples of the reading, m entries [unit].
  void learn(const Eigen::VectorXd& sd);

  /// @return true if the window is complete, so that ratio() is defined.
  [[nodiscard]] bool is_ready() const;

  /// @return the largest ratio of an axis's scatter within the window to its noise floor; infinite
  ///         until is_ready().
  [[nodiscard]] double ratio() const;

  [[nodiscard]] bool is_still() const { return is_ready() && ratio() <= options_.factor; }
  [[nodiscard]] double factor() const { return options_.factor; }

  /// @return the mean of the window, m entries [unit].
  [[nodiscard]] Eigen::VectorXd mean() const;

  /// @return the noise floor, m entries [unit]; 0 while it is unknown.
  [[nodiscard]] const Eigen::VectorXd& floor() const { return floor_; }

  /// @return the smallest observed change of each axis, m entries [unit]. It is an upper limit of
  ///         the step of the A/D converter. It is infinite until a value changes.
  [[nodiscard]] const Eigen::VectorXd& step() const { return step_; }

  /// @return the time since the noise floor last fell by half [s]. While this time is short, the
  ///         floor is not yet reliable, so a first reading should not be taken.
  [[nodiscard]] double floor_age_s() const { return last_s_ - floor_fell_s_; }

  /// For how long, and for how many samples, the value of an axis has not changed.
  struct Unchanged {
    double seconds = 0.0;
    std::size_t samples = 0;
  };
  [[nodiscard]] Unchanged unchanged(std::size_t axis) const;

  /// @return the sample rate; 0 until the first window has passed.
  [[nodiscard]] double rate_hz() const;

 private:
  void update_floor();
  [[nodiscard]] Eigen::VectorXd window_sd() const;

  struct Sample {
    double time_s;
    Eigen::VectorXd values;
  };

  StillnessOptions options_;
  Eigen::Index axes_;
  std::deque<Sample> window_;
  std::size_t stride_ = 1;  // every stride_-th sample enters the window, to limit its size
  std::size_t skipped_ = 0;
  std::size_t since_sums_ = 0;
  Eigen::VectorXd reference_;  // offset that is subtracted from the values before they are summed
  Eigen::VectorXd sum_;
  Eigen::VectorXd sum_of_squares_;
  Eigen::VectorXd sd_;  // scatter within the window, once the window is complete
  Eigen::VectorXd floor_;
  Eigen::VectorXd step_;  // smallest observed change of a value
  bool floor_known_ = false;
  double floor_fell_s_ = 0.0;
  double last_s_ = 0.0;
  double rate_from_s_ = 0.0;
  std::size_t rate_samples_ = 0;
  double rate_hz_ = 0.0;
  std::vector<double> value_;
  std::vector<double> same_since_s_;
  std::vector<std::size_t> same_samples_;
};

}  // namespace axiscal
