// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "axiscal/acquisition/source.hpp"
#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations.hpp"

namespace axiscal {

struct SessionAlarm;
struct SessionCommand;
struct SessionEvent;
struct SessionView;

/// The interface of a live calibration. It receives samples and commands, and provides a view and
/// events. It does not depend on the source of the samples or on the user interface.
class LiveSession {
 public:
  LiveSession() = default;
  virtual ~LiveSession() = default;
  LiveSession(const LiveSession&) = delete;
  LiveSession& operator=(const LiveSession&) = delete;

  /// @param channels  the channels of the samples that add() will receive.
  /// @param time_at_zero  the result of SampleFeed::time_at_zero().
  /// @throws DomainError  if no channel exists for an axis (the message lists the channels), or if
  ///                      the field changes with time, as sunlight does, and the times are not UTC.
  /// @throws SetupError   if the change of the field with time cannot be computed.
  virtual void set_channels(const std::vector<Channel>& channels,
                            std::optional<double> time_at_zero) = 0;

  /// Restores the session from the lines of a journal. Must be called before the first sample.
  /// @param lines  all lines of the journal; the first one, the header, is skipped.
  /// @param path   the journal's file name, for messages.
  /// @throws DataError  for an invalid line; the message begins with `PATH:LINE:`.
  virtual void restore(const std::vector<std::string>& lines, const std::string& path) = 0;

  /// @param time_s  time of the sample; must not decrease.
  /// @param values  one value for each channel.
  /// @throws RefusedError  if the field is sunlight, and the sun is below the horizon at the time
  ///                       of the first sample.
  virtual void add(double time_s, std::span<const double> values) = 0;

  /// Reports that no sample has arrived for `seconds`. The session tries again to store readings
  /// that could not be stored.
  virtual void idle(double seconds) = 0;

  /// Replaces the current alarms of the sources by `alarms`.
  virtual void set_source_alarms(const std::vector<SessionAlarm>& alarms) = 0;

  virtual void command(const SessionCommand& command) = 0;

  /// Reports that the samples have ended. Readings cannot be retaken after this call.
  virtual void end_of_samples() = 0;

  /// @return true after the session was finished or stopped.
  [[nodiscard]] virtual bool is_over() const = 0;
  [[nodiscard]] virtual bool has_quit() const = 0;

  [[nodiscard]] virtual const SessionView& view() = 0;
  [[nodiscard]] virtual std::vector<SessionEvent> take_events() = 0;

  /// @return the readings so far, in the order taken.
  [[nodiscard]] virtual Observations observations() const = 0;

  /// @return the final calibrations, one for each instrument; empty before the end, or if the
  ///         calibration failed. After a failure, view() contains the error.
  [[nodiscard]] virtual const std::vector<Calibration>& calibrations() const = 0;
};

}  // namespace axiscal
