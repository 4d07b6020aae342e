// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/session_event_log.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {

void SessionEventLog::tell(const std::string& kind,
                           const std::string& text,
                           std::optional<int> run,
                           std::optional<DesignPoint> point) {
  events_.push_back({.kind = kind, .text = text, .time_s = now_s_, .run = run, .point = point});
}

void SessionEventLog::set_alarm(const std::string& code, const std::string& text) {
  const auto found = std::find_if(alarms_.begin(), alarms_.end(),
                                  [&](const SessionAlarm& one) { return one.code == code; });
  if (text.empty()) {
    if (found != alarms_.end()) {
      tell("alarm_over", code + ": the problem is solved");
      alarms_.erase(found);
    }
  } else if (found == alarms_.end()) {
    alarms_.push_back({.code = code, .text = text});
    tell("alarm", text);
  } else {
    found->text = text;
  }
}

void SessionEventLog::set_silence(double seconds, double rate_hz) {
  constexpr double usual_s = 0.8;
  if (seconds > std::max(usual_s, rate_hz > 0.0 ? 5.0 / rate_hz : 0.0)) {
    set_alarm("silent", formatted("no samples for {} s: is the instrument still on?",
                                  number_text(std::floor(10.0 * seconds) / 10.0)));
  }
}

std::vector<SessionAlarm> SessionEventLog::alarms() const {
  std::vector<SessionAlarm> all = source_alarms_;
  all.insert(all.end(), alarms_.begin(), alarms_.end());
  return all;
}

std::vector<SessionEvent> SessionEventLog::take_events() {
  return std::exchange(events_, {});
}

}  // namespace axiscal
