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

/// @return seconds since the first call, by a monotonic clock.
[[nodiscard]] double session_seconds();

/// Assigns times to samples: from the source's column of times, by counting at a stated rate, or
/// from the arrival times.
///
/// If counted times deviate from the arrival times, they are corrected slowly. They deviate because
/// two clocks never agree exactly, and because a connection may be interrupted.
///
/// Times of a column are shifted so that the first sample has the time of its arrival. If the
/// source's clock jumps, the jump is removed from the sample times.
class SampleClock {
 public:
  /// @param address  an address with the options time (name of the column of times) or rate [Hz].
  explicit SampleClock(const SourceAddress& address);

  /// @return the names of the address options that this class reads.
  [[nodiscard]] static const std::vector<std::string>& options();

  /// @param channels  the channels of the source.
  /// @throws DomainError  if a stated column of times is not one of the channels.
  void set_channels(const std::vector<Channel>& channels);

  /// Checks that the unit of a recording's times gives a plausible sample rate.
  /// @param path   the recording's file name, for messages.
  /// @param block  the first samples of the recording, one column for each channel.
  /// @throws DataError  if the times do not have the unit that the column's name states.
  void check_unit(const std::string& path, const std::vector<std::vector<double>>& block) const;

  /// Appends a sample with its time, unless it repeats the last sample and its time.
  /// @param arrival_s  session_seconds() when the sample arrived; 0 for recorded samples.
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
  double offset_ = 0.0;    // session time minus the source's time
  double last_own_ = 0.0;  // the source's time of the last sample
  double last_s_ = 0.0;
  double last_arrival_ = 0.0;
  double step_s_ = 0.0;  // last time step of the source that was not a jump
  double pace_ = 1.0;    // length of a counted step relative to 1 / rate_hz_
  double known_pace_ = 1.0;
  double pace_from_s_ = 0.0;
  // Smallest and largest lag of the samples since pace_from_s_ (see counted()).
  double least_lag_s_ = std::numeric_limits<double>::infinity();
  double most_lag_s_ = -std::numeric_limits<double>::infinity();
  std::vector<double> last_values_;
};

}  // namespace axiscal
