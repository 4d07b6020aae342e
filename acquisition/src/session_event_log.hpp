// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axiscal/acquisition/session.hpp"

namespace axiscal {

/// The events of a session, and the current problems.
class SessionEventLog {
 public:
  /// From now on it is this time.
  void set_time(double now_s) { now_s_ = now_s; }

  void tell(const std::string& kind,
            const std::string& text,
            std::optional<int> run = {},
            std::optional<DesignPoint> point = {});

  /// An alarm begins or changes; an empty text ends it.
  void set_alarm(const std::string& code, const std::string& text);

  /// Nothing has come for this long, of a source whose samples come this often (Hz, 0: unknown).
  void set_silence(double seconds, double rate_hz);

  /// All current problems of the sources.
  void set_source_alarms(const std::vector<SessionAlarm>& alarms) { source_alarms_ = alarms; }

  /// @return all alarms, the sources' first.
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
