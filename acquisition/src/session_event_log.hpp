// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axiscal/acquisition/session.hpp"

namespace axiscal {

/// The events of a session and its current alarms.
class SessionEventLog {
 public:
  /// Sets the time of the events that follow.
  void set_time(double now_s) { now_s_ = now_s; }

  void tell(const std::string& kind,
            const std::string& text,
            std::optional<int> run = {},
            std::optional<DesignPoint> point = {});

  /// Begins or changes an alarm. An empty text ends it.
  void set_alarm(const std::string& code, const std::string& text);

  /// Sets the alarm "silent" if no sample has arrived for too long.
  /// @param seconds  time since the last sample.
  /// @param rate_hz  sample rate of the source; 0 if unknown.
  void set_silence(double seconds, double rate_hz);

  /// Replaces the alarms of the sources.
  void set_source_alarms(const std::vector<SessionAlarm>& alarms) { source_alarms_ = alarms; }

  /// @return all alarms; those of the sources are first.
  [[nodiscard]] std::vector<SessionAlarm> alarms() const;

  /// @return the events since the last call.
  [[nodiscard]] std::vector<SessionEvent> take_events();

 private:
  double now_s_ = 0.0;
  std::vector<SessionAlarm> alarms_;
  std::vector<SessionAlarm> source_alarms_;
  std::vector<SessionEvent> events_;
};

}  // namespace axiscal
