// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "acquisition/src/source_address.hpp"
#include "axiscal/acquisition/source.hpp"
#include "axiscal/logs/time_column.hpp"

namespace axiscal {

/// @return seconds since this program started, by a clock that nobody sets.
[[nodiscard]] double session_seconds();

/// Gives samples their times: by the source's own column of times, by counting at a stated rate, or
/// as they arrive.
///
/// Counting follows the arrivals where it strays from them for long: no two clocks are the same,
/// and a cable may have been out.
///
/// The source's clock starts at the first sample and may jump (set by a person or the network,
/// restarted). A jump is removed.
class SampleClock {
 public:
  /// Options: time (a column), rate (samples a second).
  explicit SampleClock(const SourceAddress& address);

  /// The options that it takes.
  [[nodiscard]] static const std::vector<std::string>& options();

  /// @param channels  of the source, when they are known.
  /// @throws DomainError  if a stated column of times is not among them.
  void set_channels(const std::vector<Channel>& channels);

  /// Holds a recording's times against the rate that their unit gives.
  /// @param path   of the recording.
  /// @param block  its first samples, a column for each channel.
  /// @throws DataError  where they are in another unit than the column's name says.
  void check_unit(const std::string& path, const std::vector<std::vector<double>>& block) const;

  /// Appends a sample with its time, unless it is the last one again.
  /// @param arrival_s  session_seconds() of the arrival; 0 for recorded samples.
  void append(std::span<const double> values,
              double arrival_s,
              SampleBatch& batch,
              SourceReport& report);

  [[nodiscard]] double rate_hz() const { return rate_hz_; }

  /// @return true if the source gives times, by a column or a rate.
  [[nodiscard]] bool keeps_time() const { return rate_hz_ > 0.0 || column_.has_value(); }

 private:
  [[nodiscard]] double counted(double arrival_s);
  void restart_pace(double arrival_s);

  SourceAddress address_;
  double rate_hz_ = 0.0;
  std::optional<TimeColumn> column_;
  bool started_ = false;
  double offset_ = 0.0;    // session time less the source's
  double last_own_ = 0.0;  // the source's time of the last sample
  double last_s_ = 0.0;
  double last_arrival_ = 0.0;
  double step_s_ = 0.0;  // the last step that was none
  double pace_ = 1.0;    // how long a step is, in parts of the stated one
  double known_pace_ = 1.0;
  double pace_from_s_ = 0.0;
  double least_lag_s_ = std::numeric_limits<double>::infinity();  // since then
  double most_lag_s_ = -std::numeric_limits<double>::infinity();
  std::vector<double> last_values_;
};

}  // namespace axiscal
