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
  double window_s = 0.5;  ///< length of the sliding variance's window
  /// Standard deviation of one sample at rest, m entries [unit]; empty: learned from the quietest
  /// windows.
  Eigen::VectorXd noise_sd;
  double factor = 4.0;  ///< still is where no axis scatters more than this times its noise
};

/// Tells live whether an instrument stands still: the scatter within a sliding window against the
/// instrument's own noise floor.
///
/// The floor is stated, or it is the level of the quietest window so far, and after the first rest
/// the level of that rest. The memory is constant at any rate.
class Stillness {
 public:
  /// @param axes     m.
  /// @param options  window, noise, and the threshold for stillness.
  /// @throws DomainError  if the window or factor is not positive, or noise_sd has not m entries.
  explicit Stillness(std::size_t axes, const StillnessOptions& options = {});

  /// @param time_s  not decreasing.
  /// @param values  m, finite.
  void add(double time_s, std::span<const double> values);

  /// Clears the window: the next samples do not continue the earlier ones (a gap, a lost cable).
  void restart();

  /// A rest showed this scatter: the floor from now on.
  /// @param sd  of its samples, m entries.
  void learn(const Eigen::VectorXd& sd);

  /// @return whether there is a whole window, so that ratio() means something.
  [[nodiscard]] bool is_ready() const;

  /// @return the largest scatter of an axis within the window over its noise floor; infinite until
  ///         is_ready().
  [[nodiscard]] double ratio() const;

  [[nodiscard]] bool is_still() const { return is_ready() && ratio() <= options_.factor; }
  [[nodiscard]] double factor() const { return options_.factor; }

  /// @return the mean of the window, m entries [unit].
  [[nodiscard]] Eigen::VectorXd mean() const;

  /// @return the noise floor, m entries [unit]; 0 until something is known.
  [[nodiscard]] const Eigen::VectorXd& floor() const { return floor_; }

  /// @return the smallest observed change of a value, m entries [unit]: an upper limit of the
  ///         converter's step; infinite until a value changes.
  [[nodiscard]] const Eigen::VectorXd& step() const { return step_; }

  /// @return for how long the floor has not fallen by half; the first rest should not be taken
  ///         while it still falls [s].
  [[nodiscard]] double floor_age_s() const { return last_s_ - floor_fell_s_; }

  /// @return for how long an axis has shown the very same value, and how many samples.
  struct Unchanged {
    double seconds = 0.0;
    std::size_t samples = 0;
  };
  [[nodiscard]] Unchanged unchanged(std::size_t axis) const;

  /// @return samples a second within the window; 0 until is_ready().
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
  std::size_t stride_ =
      1;  // every so many samples one goes into the window, so that it stays small
  std::size_t skipped_ = 0;
  std::size_t since_sums_ = 0;
  Eigen::VectorXd reference_;  // reference value of the sums
  Eigen::VectorXd sum_;
  Eigen::VectorXd sum_of_squares_;
  Eigen::VectorXd sd_;  // scatter within the window, once it is whole
  Eigen::VectorXd floor_;
  Eigen::VectorXd step_;  // smallest change of a value that was seen
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
