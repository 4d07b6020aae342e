// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include <Eigen/Core>

namespace axiscal {

/// The smallest number of samples in a reading. With fewer samples, their scatter is too uncertain.
inline constexpr std::size_t fewest_samples_of_dwell = 10;

/// Tolerance for comparing times that are sums of many steps [s].
inline constexpr double time_rounding_s = 1e-6;

/// Computes mean, scatter and trend of the samples of one reading. The memory use does not grow
/// with the number of samples.
class DwellSums {
 public:
  explicit DwellSums(Eigen::Index axes);

  void clear();
  void add(double time_s, const Eigen::VectorXd& values);

  [[nodiscard]] std::size_t samples() const { return static_cast<std::size_t>(count_); }
  [[nodiscard]] double start_s() const { return start_s_; }
  [[nodiscard]] double end_s() const { return end_s_; }
  [[nodiscard]] double seconds() const { return samples() == 0 ? 0.0 : end_s_ - start_s_; }
  [[nodiscard]] const Eigen::VectorXd& mean() const { return mean_; }
  [[nodiscard]] Eigen::VectorXd sd() const;

  /// @return the largest trend of an axis during the reading, in standard errors. A trend that
  ///         changes the axis by less than one standard deviation of a sample counts as 0.
  [[nodiscard]] double drift() const;

 private:
  double count_ = 0.0;
  double start_s_ = 0.0;
  double end_s_ = 0.0;
  double mean_time_ = 0.0;
  double time_squares_ = 0.0;
  Eigen::VectorXd mean_;
  Eigen::VectorXd squares_;   // sums of squared deviations from the mean
  Eigen::VectorXd products_;  // sums of products of the deviations in time and value
};

}  // namespace axiscal
