// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/logs/log_file.hpp"

namespace axiscal {

/// A time at which the instrument stood still.
struct StaticInterval {
  std::size_t first = 0;  ///< sample, counted from 0
  std::size_t end = 0;    ///< one past the last
  double start_s = 0.0;
  double end_s = 0.0;    ///< time of the last sample
  Eigen::VectorXd mean;  ///< one for every column
  Eigen::VectorXd sd;    ///< standard deviations of the samples
  /// The effective number of independent samples, n (1 - r) / (1 + r), with r the correlation of
  /// neighbours about the drift; 1 .. n, for every column.
  Eigen::VectorXd effective_samples;
  Eigen::VectorXd drift;  ///< slope times length, by least squares [unit of the column]
  double loudest = 1.0;   ///< largest sliding variance over the mean one
  double motion = 0.0;    ///< mean sliding variance, joined over the columns of detection

  [[nodiscard]] std::size_t samples() const { return end - first; }
};

/// The intervals that one threshold gives.
struct IntervalSet {
  double threshold = 0.0;  ///< rest is where the joined variance is below it [unit^2]
  std::vector<StaticInterval> intervals;
};

struct DetectorOptions {
  std::vector<std::size_t> detection;  ///< columns whose variance tells rest from motion
  std::size_t window = 101;            ///< samples of the sliding variance, odd
  std::size_t trim = 10;               ///< samples left out at both ends of an interval
  std::size_t shortest = 100;          ///< samples an interval must have then
  std::optional<double> threshold;     ///< this one only [unit^2]
};

/// Finds static intervals in a stream of samples, in constant memory, for many thresholds at once.
///
/// The joined variance of a sample is the root of the sum of squared variances over a window about
/// it (Tedaldi et al. 2014). Thresholds are powers of sqrt(2) from the quietest to the loudest
/// sample: the variance is formed once, and sums within a block serve all thresholds.
///
/// @par Source
/// D. Tedaldi, A. Pretto, E. Menegatti, ICRA 2014; T. F. Chan, G. H. Golub, R. J. LeVeque, The
/// American Statistician 37 (1983), for joining sums about different references.
class StaticDetector {
 public:
  /// @throws DomainError  for a window of less than 3 samples or no column of detection.
  StaticDetector(const DetectorOptions& options, std::size_t columns);
  ~StaticDetector();
  StaticDetector(StaticDetector&&) noexcept;
  StaticDetector& operator=(StaticDetector&&) noexcept;

  /// @param time_s   of each sample.
  /// @param samples  all columns; finite.
  /// @param broken   for each sample whether no interval may hold it: missing numbers, a gap before
  ///                 it, saturation.
  void add(std::span<const double> time_s, const LogBlock& samples, std::span<const char> broken);

  /// Ends the stream.
  /// @return one set for each threshold, ascending; the last, of an infinite threshold, parts at
  ///         broken samples only.
  [[nodiscard]] std::vector<IntervalSet> finish();

 private:
  class Stream;
  std::unique_ptr<Stream> stream_;
};

/// Chooses a threshold by persistence: where the number of intervals stays the same within 5 % over
/// a factor of 8 of the threshold, the lowest such range; else the widest range there is. Noise
/// parts rests, motion joins them; in between the number does not depend on the threshold.
///
/// @return three steps above the lower end of the range; ranges of two intervals or more are
///         preferred to ranges of one. If the variance stays within a factor of 16, the log does
///         not contain motion, and the last threshold is returned.
[[nodiscard]] std::size_t most_persistent(const std::vector<IntervalSet>& sets);

/// Joins neighbours that are one attitude, separated by a knock: the gap between them is short and
/// their means agree within five standard errors or `tolerance`.
///
/// @param columns    that are compared.
/// @param longest_gap_s  between the end of one and the start of the next.
/// @param tolerance  of the means [unit].
/// @return the number of joined rests.
std::size_t join_split_rests(std::vector<StaticInterval>& intervals,
                             const std::vector<std::size_t>& columns,
                             double longest_gap_s,
                             double tolerance);

}  // namespace axiscal
