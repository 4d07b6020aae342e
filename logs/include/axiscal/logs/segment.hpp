// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "axiscal/instruments/instrument.hpp"
#include "axiscal/logs/log_file.hpp"
#include "axiscal/logs/seats.hpp"
#include "axiscal/logs/static_detector.hpp"
#include "axiscal/logs/time_column.hpp"

namespace axiscal {

/// The options for cutting a log into rests.
struct SegmentOptions {
  std::vector<std::string> columns;  ///< names of the columns whose variance shows motion
  /// Columns whose means distinguish attitudes, usually those of an accelerometer; if empty,
  /// `columns` are used.
  std::vector<std::string> attitude;
  std::string time;               ///< column of times; if empty, find_time_column() is used
  std::optional<double> rate_hz;  ///< samples per second; used instead of a column of times
  double window_s = 0.5;          ///< length of the window in which the variance is computed [s]
  double shortest_s = 1.0;        ///< shortest duration of a rest after trimming [s]
  double trim_s = 0.1;            ///< time removed at each end of a rest, plus half a window [s]
  /// A sample is at rest if its joined variance (see StaticDetector) is below this threshold, which
  /// is in the square of the readings' unit. If it is nullopt, the threshold is chosen
  /// automatically.
  std::optional<double> threshold;
  std::optional<ReadingRange> range;  ///< a sample of `columns` at or beyond a limit is saturated
  bool join = true;                   ///< true: if a knock splits a rest, use only the longer part
  /// Ranges of samples that no rest may contain, ascending. Each is a pair: the index of the first
  /// sample, and one past the index of the last.
  std::vector<std::pair<std::size_t, std::size_t>> left_out;
  /// Indices of the samples at which the second and each later recording begins, ascending.
  std::vector<std::size_t> begins;
};

/// The rests of a log.
struct Segmentation {
  std::vector<std::string> columns;    ///< names of the log's columns, without the times
  std::vector<std::size_t> detection;  ///< indices of the columns used to detect motion
  std::vector<StaticInterval> intervals;
  std::vector<std::vector<std::string>> marks;  ///< per rest: "drift", "knock", "stuck", "restless"
  /// The threshold that was used; see SegmentOptions::threshold.
  double threshold = 0.0;
  /// The thresholds that were tried, in ascending order, each with the number of rests it gives.
  std::vector<std::pair<double, std::size_t>> tried;
  double rate_hz = 0.0;
  std::size_t samples = 0;
  std::size_t broken_samples = 0;  ///< invalid samples; each one ends the period at rest before it
  std::vector<std::string> notes;  ///< notes that require no action
  std::vector<std::string> warnings;  ///< problems of the log
};

/// A function that chooses a threshold. It receives one set of intervals for each threshold, and
/// returns the index of the chosen set. Default: most_persistent().
/// @param so_far  contains the columns, the rate and the number of samples, but no intervals yet.
using ThresholdChoice =
    std::function<std::size_t(const std::vector<IntervalSet>& sets, const Segmentation& so_far)>;

/// Finds the rests of a log. The memory used does not depend on the length of the log.
///
/// A rest ends if the time decreases, if there is a gap, or if a number in `columns` is missing or
/// saturated. Warnings state how often each of these cases occurs. A gap is a time step that is
/// longer than five times the mean step and longer than a quarter of the window. If a number in
/// another column is missing, it is replaced by the number before it.
///
/// @throws DataError     if a column is missing, if the log has neither times nor a rate, if the
///                       times never increase, or if settle_time_unit() throws it.
/// @throws RefusedError  if no rest is found.
[[nodiscard]] Segmentation segment(LogFile& log,
                                   const SegmentOptions& options,
                                   const ThresholdChoice& choose = {});

/// @return the rests as a table of observations in CSV (formats.md, Observations). Its columns are
///         run, start, end, samples, the means, the standard deviation AXIS_sd of each column in
///         `detection`, effective_samples and marks. `labels` add the columns rest and fence, and
///         `sheet` adds run, block and levels of the run sheet. If there are labels, rests without
///         a label are left out.
[[nodiscard]] std::string segmentation_csv(const Segmentation& segmentation,
                                           const SeatLabels* labels = nullptr,
                                           const std::vector<RunSheetRow>& sheet = {});

/// @return the standard uncertainty of each number that means_of() returns. It is computed from the
///         noise within the rest as sd / sqrt(effective samples).
[[nodiscard]] Eigen::MatrixXd mean_uncertainties_of(const Segmentation& segmentation,
                                                    const std::vector<std::string>& columns);

/// @return the means of `columns` over the rests, with a row for each rest and a column for each
///         name.
[[nodiscard]] Eigen::MatrixXd means_of(const Segmentation& segmentation,
                                       const std::vector<std::string>& columns);

}  // namespace axiscal
