// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/file_source.hpp"

#include <algorithm>
#include <thread>
#include <utility>

#include "acquisition/src/sample_clock.hpp"
#include "axiscal/logs/log_file.hpp"

namespace axiscal {
namespace {

constexpr std::size_t most_samples_at_once = 512;

// Replays a recording, as fast as it can be read or at a multiple of its original speed.
class FileSource final : public Source {
 public:
  explicit FileSource(const SourceAddress& address)
      : name_(address.text),
        log_(address.place, LogFormat{.names = address.names("names"), .columns = {}}),
        clock_(address),
        speed_(address.text_or("speed", "max") == "max"
                   ? 0.0
                   : address.number_or("speed", 1.0, 1e-3, 1e6)) {
    for (const std::string& column : log_.columns()) {
      channels_.push_back(channel_of(column));
    }
    clock_.set_channels(channels_);
    if (!clock_.keeps_time()) {
      address.fail("the recording lacks a column of times: give rate=HZ or time=COLUMN");
    }
  }

  [[nodiscard]] const std::vector<Channel>& channels() const override { return channels_; }
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] bool is_live() const override { return speed_ > 0.0; }
  [[nodiscard]] bool is_recorded() const override { return true; }
  [[nodiscard]] double stated_rate_hz() const override { return clock_.rate_hz(); }

  SourceReport read(SampleBatch& batch, std::chrono::milliseconds patience) override {
    if (next_ == ready_.size()) {
      next_ = 0;
      ready_.clear();
      report_ = {};
      const std::size_t count = log_.read(block_, most_samples_at_once);
      if (!begun_ && count > 1) {
        begun_ = true;
        clock_.check_unit(name_, block_);
      }
      for (std::size_t i = 0; i < count; ++i) {
        row_.clear();
        for (const std::vector<double>& column : block_) {
          row_.push_back(column[i]);
        }
        clock_.append(row_, 0.0, ready_, report_);
      }
      if (count == 0) {
        return {.state = LinkState::ended, .message = "the recording ended"};
      }
    }
    SourceReport report = std::exchange(report_, {});
    const double due = started_ < 0.0 ? 0.0 : (session_seconds() - started_) * speed_;
    started_ = started_ < 0.0 ? session_seconds() : started_;
    if (is_live() && next_ < ready_.size() && ready_.time_s[next_] > due) {
      std::this_thread::sleep_for(std::min(
          patience, std::chrono::milliseconds(
                        static_cast<int>(1000.0 * (ready_.time_s[next_] - due) / speed_ + 1.0))));
    }
    const double now = is_live() ? (session_seconds() - started_) * speed_ : 0.0;
    while (next_ < ready_.size() && (!is_live() || ready_.time_s[next_] <= now)) {
      batch.add(ready_.time_s[next_], ready_.row(next_));
      ++next_;
      ++report.bytes;
    }
    return report;
  }

 private:
  std::string name_;
  LogFile log_;
  SampleClock clock_;
  double speed_;  // replay speed relative to the original speed; 0: unlimited
  std::vector<Channel> channels_;
  LogBlock block_;
  std::vector<double> row_;
  SampleBatch ready_;
  SourceReport report_;
  std::size_t next_ = 0;
  double started_ = -1.0;
  bool begun_ = false;
};

}  // namespace

std::unique_ptr<Source> open_file_source(const SourceAddress& address) {
  return std::make_unique<FileSource>(address);
}

}  // namespace axiscal
