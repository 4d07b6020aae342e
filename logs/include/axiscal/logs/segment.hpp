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
  std::vector<std::string> columns;  ///< columns whose variance shows motion
  /// Columns whose means distinguish attitudes, usually those of an accelerometer; if empty,
  /// `columns` are used.
  std::vector<std::string> attitude;
  std::string time;               ///< column of times; if empty, find_time_column() is used
  std::optional<double> rate_hz;  ///< samples per second; replaces a column of times
  double window_s = 0.5;          ///< length of the sliding variance's window
  double shortest_s = 1.0;        ///< shortest length of a rest after trimming
  double trim_s = 0.1;            ///< time left out at both ends of a rest, besides half a window
  /// The joined variance below which a sample is at rest [unit^2], see StaticDetector; nullopt: it
  /// is chosen automatically.
  std::optional<double> threshold;
  std::optional<ReadingRange> range;  ///< a sample of `columns` at or beyond a limit is saturated
  bool join = true;                   ///< true: use only the longer part of a rest split by a knock
  /// Samples that no rest may contain, as pairs of first and end; ascending.
  std::vector<std::pair<std::size_t, std::size_t>> left_out;
  std::vector<std::size_t> begins;  ///< samples at which another recording begins; ascending
};

/// The rests of a log.
struct Segmentation {
  std::vector<std::string> columns;    ///< names of the columns of the means, without the times
  std::vector<std::size_t> detection;  ///< positions in `columns` of those whose variance was used
  std::vector<StaticInterval> intervals;
  std::vector<std::vector<std::string>> marks;  ///< "drift", "knock", "stuck", "restless"
  double threshold = 0.0;  ///< a sample is at rest if its joined variance is below it [unit^2]
  /// The thresholds that were tried, each with its number of rests, ascending.
  std::vector<std::pair<double, std::size_t>> tried;
  double rate_hz = 0.0;
  std::size_t samples = 0;
  std::size_t broken_samples = 0;     ///< number of samples that no rest may contain, see segment()
  std::vector<std::string> notes;     ///< notes that do not need action
  std::vector<std::string> warnings;  ///< problems of the log
};

/// Chooses one of the sets of intervals, of which there is one for each threshold, and returns its
/// position. Default: most_persistent().
/// @param so_far  contains the columns, the rate and the number of samples, but no intervals yet.
using ThresholdChoice =
    std::function<std::size_t(const std::vector<IntervalSet>& sets, const Segmentation& so_far)>;

/// Finds the rests of a log, in constant memory, whatever its length.
///
/// A rest ends if the time decreases, if there is a gap, or if a number in `columns` is missing or
/// saturated. Warnings state how often each of these occurs. A gap is a time step that is longer
/// than five times the mean step and longer than a quarter of the window. If a number in another
/// column is missing, it is replaced by the number before it.
///
/// @throws DataError     if a column is missing, the log has neither times nor a rate, or the times
///                       never increase, or for the reasons of settle_time_unit().
/// @throws RefusedError  if no rest is found.
[[nodiscard]] Segmentation segment(LogFile& log,
                                   const SegmentOptions& options,
                                   const ThresholdChoice& choose = {});

/// @return the rests as a table of observations in CSV (formats.md, Observations): run, start, end,
///         samples, means, AXIS_sd of the columns of detection, effective_samples, marks. Labels
///         add rest and fence, and a sheet adds its run, block and levels. With labels, rests
///         without a label are left out.
[[nodiscard]] std::string segmentation_csv(const Segmentation& segmentation,
                                           const SeatLabels* labels = nullptr,
                                           const std::vector<RunSheetRow>& sheet = {});

/// @return the standard uncertainty of each mean of means_of(), from the noise within the rest,
///         sd / sqrt(effective samples).
[[nodiscard]] Eigen::MatrixXd mean_uncertainties_of(const Segmentation& segmentation,
                                                    const std::vector<std::string>& columns);

/// @return the means of `columns`: a row for each rest, a column for each name.
[[nodiscard]] Eigen::MatrixXd means_of(const Segmentation& segmentation,
                                       const std::vector<std::string>& columns);

}  // namespace axiscal
