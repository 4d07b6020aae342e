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
  std::vector<std::string> columns;  ///< whose variance tells rest from motion
  /// Whose means tell one attitude from another, an accelerometer's; default: `columns`.
  std::vector<std::string> attitude;
  std::string time;               ///< column of times; empty: as find_time_column()
  std::optional<double> rate_hz;  ///< instead of a column of times
  double window_s = 0.5;          ///< length of the sliding variance's window
  double shortest_s = 1.0;        ///< shortest length of a rest after trimming
  double trim_s = 0.1;            ///< left out at both ends, besides half a window
  std::optional<double>
      threshold;  ///< rest is where the joined variance is below it [unit^2]; default: chosen
  std::optional<ReadingRange> range;  ///< samples of `columns` at or beyond it are saturated
  bool join = true;                   ///< whether rests that a knock split are joined
  /// Samples that no rest may hold, as first and end; ascending.
  std::vector<std::pair<std::size_t, std::size_t>> left_out;
  std::vector<std::size_t> begins;  ///< samples at which another recording begins; ascending
};

/// The rests of a log.
struct Segmentation {
  std::vector<std::string> columns;    ///< names of the columns of means, without the time
  std::vector<std::size_t> detection;  ///< which of them told rest from motion
  std::vector<StaticInterval> intervals;
  std::vector<std::vector<std::string>> marks;  ///< "drift", "knock", "stuck", "restless"
  double threshold = 0.0;                       ///< rest is where the joined variance is below it
  /// Thresholds that were tried, with how many rests each gave, ascending.
  std::vector<std::pair<double, std::size_t>> tried;
  double rate_hz = 0.0;
  std::size_t samples = 0;
  std::size_t broken_samples = 0;     ///< missing numbers, saturated, at gaps
  std::vector<std::string> notes;     ///< notes that do not need action
  std::vector<std::string> warnings;  ///< problems of the log
};

/// Which of the thresholds' sets is taken; default: most_persistent().
/// @param so_far  columns, rate and number of samples are there, no intervals yet.
using ThresholdChoice =
    std::function<std::size_t(const std::vector<IntervalSet>& sets, const Segmentation& so_far)>;

/// Finds the rests of a log, in constant memory, whatever its length.
///
/// Times that decrease and gaps (more than five times the mean step and a quarter of the window)
/// part rests, as missing numbers and saturated samples of `columns` do; the warnings count them.
/// In other columns a missing number counts as the one before it.
///
/// @throws DataError     for a missing column or a log that has neither times nor a rate; for times
///                       that never increase, or as settle_time_unit().
/// @throws RefusedError  if no rest is found; the message gives the noise of the quietest second.
[[nodiscard]] Segmentation segment(LogFile& log,
                                   const SegmentOptions& options,
                                   const ThresholdChoice& choose = {});

/// The rests as a table of observations (formats.md, Observations): run, start, end, samples,
/// means, AXIS_sd of the columns of detection, effective_samples, marks; with labels rest, fence,
/// and from a sheet its run, block, level and temperature. Rests without a label are left out.
[[nodiscard]] std::string segmentation_csv(const Segmentation& segmentation,
                                           const SeatLabels* labels = nullptr,
                                           const std::vector<RunSheetRow>& sheet = {});

/// @return the standard uncertainties of the means of some columns over the rests, by the noise
///         within each rest, n x columns.
[[nodiscard]] Eigen::MatrixXd mean_uncertainties_of(const Segmentation& segmentation,
                                                    const std::vector<std::string>& columns);

/// @return the means of three columns over the rests, n x 3.
[[nodiscard]] Eigen::MatrixXd means_of(const Segmentation& segmentation,
                                       const std::vector<std::string>& columns);

}  // namespace axiscal
