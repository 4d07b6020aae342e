// SPDX-License-Identifier: Apache-2.0
#include <chrono>

#include "axiscal/acquisition/health_watch.hpp"
#include "axiscal/core/error.hpp"

namespace axiscal {
namespace {

// Limits the waiting time. The time is measured by the clock for live sources, and by the sample
// times for a recording.
class Patience {
 public:
  Patience(const SampleFeed& feed, double limit_s) : feed_(feed), limit_s_(limit_s) {}

  void see(double time_s) {
    first_s_ = has_begun_ ? first_s_ : time_s;
    has_begun_ = true;
    last_s_ = time_s;
  }

  [[nodiscard]] bool is_over() const {
    const std::chrono::duration<double> waited = std::chrono::steady_clock::now() - started_;
    return (feed_.is_live() ? waited.count() : last_s_ - first_s_) > limit_s_;
  }

  [[nodiscard]] double last_s() const { return last_s_; }

 private:
  const SampleFeed& feed_;
  double limit_s_;
  std::chrono::steady_clock::time_point started_ = std::chrono::steady_clock::now();
  bool has_begun_ = false;
  double first_s_ = 0.0;
  double last_s_ = 0.0;
};

}  // namespace

const HealthView& run_health_watch(HealthWatch& watch, SampleFeed& feed, const HealthRun& run) {
  SampleBatch batch;
  Patience patience(feed, run.patience_s);
  bool has_channels = false;
  double shown_s = -1.0;
  std::string alarm;
  while (watch.view().readings < run.readings) {
    batch.clear();
    constexpr std::chrono::milliseconds wait{50};
    feed.read(batch, wait);
    if (!has_channels && !feed.channels().empty()) {
      watch.set_channels(feed.channels());
      has_channels = true;
    }
    for (std::size_t i = 0; i < batch.size() && has_channels; ++i) {
      watch.add(batch.time_s[i], batch.row(i));
      patience.see(batch.time_s[i]);
      if (watch.view().readings >= run.readings) {
        break;
      }
    }
    const std::vector<SessionAlarm> alarms = feed.alarms();
    const std::string first_alarm = alarms.empty() ? "" : alarms.front().text;
    if (run.warn && first_alarm != alarm && !first_alarm.empty()) {
      run.warn(first_alarm);
    }
    alarm = first_alarm;
    if (run.show && patience.last_s() - shown_s >= 1.0 && has_channels) {
      shown_s = patience.last_s();
      run.show(watch.view());
    }
    if (feed.has_ended() || patience.is_over()) {
      break;
    }
  }
  const HealthView& view = watch.view();
  if (!view.check) {
    throw RefusedError(has_channels ? "the instrument was never at rest long enough for a reading"
                                    : "no sample arrived" + (alarm.empty() ? "" : ": " + alarm));
  }
  return view;
}

}  // namespace axiscal
