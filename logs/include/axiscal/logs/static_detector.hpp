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

/// An interval in which the instrument was at rest.
struct StaticInterval {
  std::size_t first = 0;  ///< zero-based index of the first sample
  std::size_t end = 0;    ///< one past the index of the last sample
  double start_s = 0.0;   ///< time of the first sample
  double end_s = 0.0;     ///< time of the last sample
  Eigen::VectorXd mean;   ///< mean of each column
  Eigen::VectorXd sd;     ///< standard deviation of the samples of each column
  /// Effective number of independent samples of each column, n (1 - r) / (1 + r), between 1 and n.
  /// Here n is the number of samples, and r is the correlation of neighbouring samples after the
  /// drift is subtracted.
  Eigen::VectorXd effective_samples;
  /// Change of each column over the interval, according to a straight line fitted by least squares
  /// [unit of the column].
  Eigen::VectorXd drift;
  /// Largest joined variance (see StaticDetector) in the interval, divided by the mean joined
  /// variance of the interval.
  double loudest = 1.0;
  double motion = 0.0;  ///< mean joined variance in the interval [square of the samples' unit]

  [[nodiscard]] std::size_t samples() const { return end - first; }
};

/// The intervals that one threshold gives.
struct IntervalSet {
  /// A sample is at rest if its joined variance is below this threshold [square of the samples'
  /// unit].
  double threshold = 0.0;
  std::vector<StaticInterval> intervals;
};

struct DetectorOptions {
  std::vector<std::size_t> detection;  ///< indices of the columns whose variance shows motion
  std::size_t window = 101;            ///< length of the window for the variances [samples]; odd
  std::size_t trim = 10;               ///< number of samples removed at each end of an interval
  std::size_t shortest = 100;          ///< smallest number of samples of a trimmed interval
  /// The only threshold to use [square of the samples' unit]. If nullopt, many are tried.
  std::optional<double> threshold;
};

/// Finds the intervals at rest in a stream of samples, for many thresholds at once. The memory used
/// does not depend on the number of samples.
///
/// The joined variance of a sample is computed from the variances of the columns in a window about
/// the sample. It is the square root of the sum of the squared variances (Tedaldi et al. 2014). The
/// thresholds are powers of sqrt(2) from the smallest joined variance in the log to the largest.
/// The variances and the sums of the samples are computed once for all thresholds.
///
/// @par Source
/// D. Tedaldi, A. Pretto, E. Menegatti, ICRA 2014; T. F. Chan, G. H. Golub, R. J. LeVeque, The
/// American Statistician 37 (1983), for combining sums about different reference values.
class StaticDetector {
 public:
  /// @throws DomainError  if the window has fewer than 3 samples, or DetectorOptions::detection is
  ///                      empty.
  StaticDetector(const DetectorOptions& options, std::size_t columns);
  ~StaticDetector();
  StaticDetector(StaticDetector&&) noexcept;
  StaticDetector& operator=(StaticDetector&&) noexcept;

  /// @param time_s   times of the samples [s].
  /// @param samples  all columns; every number is finite.
  /// @param broken   1 for each sample that no interval may contain, because a number is missing,
  ///                 the sample is saturated, or it follows a gap; otherwise 0.
  void add(std::span<const double> time_s, const LogBlock& samples, std::span<const char> broken);

  /// Ends the stream.
  /// @return one set for each threshold, ascending. The last one has an infinite threshold, so its
  ///         intervals end only at broken samples. If DetectorOptions::threshold is set, there is
  ///         only the set of that threshold.
  [[nodiscard]] std::vector<IntervalSet> finish();

 private:
  class Stream;
  std::unique_ptr<Stream> stream_;
};

/// Chooses a threshold near which the number of intervals hardly depends on the threshold. A low
/// threshold splits rests because of their noise, and a high threshold joins rests across motion.
/// Between these, the number of intervals is constant over a range of thresholds. The function uses
/// the lowest range of at least 6 thresholds in which the number is constant within 5 %. If there
/// is no such range, it uses the widest one.
///
/// @return the index of the chosen set in `sets`: the third threshold above the lower end of the
///         range, or the middle one of a narrow range. A range whose sets contain two or more
///         intervals is preferred to a range whose sets contain one. If the largest variance of the
///         log is at most about 16 times the smallest, the log contains no motion, and the last set
///         is chosen.
[[nodiscard]] std::size_t most_persistent(const std::vector<IntervalSet>& sets);

/// Finds pairs of neighbouring rests that were one rest until a knock split it, and keeps only the
/// longer rest of each pair. In such a pair the gap is at most `longest_gap_s`, and the means agree
/// within `tolerance` or five standard errors.
///
/// @param columns        columns whose means are compared.
/// @param longest_gap_s  longest time from the end of one rest to the start of the next [s].
/// @param tolerance      largest difference of the means [unit].
/// @return the number of rests that were removed.
std::size_t join_split_rests(std::vector<StaticInterval>& intervals,
                             const std::vector<std::size_t>& columns,
                             double longest_gap_s,
                             double tolerance);

}  // namespace axiscal
