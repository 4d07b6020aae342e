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

/// The engine of a live calibration, whatever it asks of the person: samples and commands go in, a
/// view and events come out. It knows neither where samples come from nor who looks.
class LiveSession {
 public:
  LiveSession() = default;
  virtual ~LiveSession() = default;
  LiveSession(const LiveSession&) = delete;
  LiveSession& operator=(const LiveSession&) = delete;

  /// @param channels  of the samples that will come.
  /// @param time_at_zero  when second 0 of their times was, as SampleFeed::time_at_zero().
  /// @throws DomainError  if an axis is not among them; the message lists what there is. Or if the
  ///                      field moves and the times are not in UTC.
  /// @throws SetupError   if how it moves in the table cannot be told.
  virtual void set_channels(const std::vector<Channel>& channels,
                            std::optional<double> time_at_zero) = 0;

  /// Takes up what a journal holds, before the first sample.
  /// @param lines  of the journal, behind its first one.
  /// @param path   for messages.
  /// @throws DataError  `PATH:LINE:` for a line that is none of ours.
  virtual void restore(const std::vector<std::string>& lines, const std::string& path) = 0;

  /// @param time_s  not decreasing.
  /// @param values  one for each channel.
  /// @throws RefusedError  if the field is the sun's, and it is below the horizon at the first one.
  virtual void add(double time_s, std::span<const double> values) = 0;

  /// Tells that nothing has come for so long, and tries again what could not be stored.
  virtual void idle(double seconds) = 0;

  /// All current problems of the sources; they replace the earlier ones.
  virtual void set_source_alarms(const std::vector<SessionAlarm>& alarms) = 0;

  virtual void command(const SessionCommand& command) = 0;

  /// The samples have ended: readings cannot be taken again.
  virtual void no_more_samples() = 0;

  /// All points were asked for, or the person left.
  [[nodiscard]] virtual bool is_over() const = 0;
  [[nodiscard]] virtual bool has_quit() const = 0;

  [[nodiscard]] virtual const SessionView& view() = 0;
  [[nodiscard]] virtual std::vector<SessionEvent> take_events() = 0;

  /// @return the readings so far, in the order taken.
  [[nodiscard]] virtual Observations observations() const = 0;

  /// @return the calibration at the end, of several instruments one each; none where it was refused
  ///         with an error, see view().
  [[nodiscard]] virtual const std::vector<Calibration>& calibrations() const = 0;
};

}  // namespace axiscal
