// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/source_reader.hpp"

#include <cmath>
#include <utility>

#include "acquisition/src/sample_clock.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/printable_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr std::size_t most_values_waiting = 1U << 20U;  // limit for each source: 8 MiB of doubles
constexpr double shown_for_s = 3.0;                     // duration of an alarm after a defect
constexpr double rate_window_s = 0.9;
constexpr double rate_tolerance = 0.05;
constexpr double no_sample_s = 1.0;

}  // namespace

SourceReader::SourceReader(std::unique_ptr<Source> source) : source_(std::move(source)) {
  if (source_->is_live()) {
    thread_ = std::thread([this] { run(); });
  }
}

SourceReader::~SourceReader() {
  {
    const std::lock_guard lock(mutex_);  // without the lock, the thread could miss the notification
    stop_ = true;
  }
  room_.notify_all();
  if (thread_.joinable()) {
    thread_.join();
  }
}

void SourceReader::take(SampleBatch& batch, std::chrono::milliseconds patience) {
  if (!is_live()) {
    SampleBatch one;
    const SourceReport report = source_->read(one, patience);
    const std::lock_guard lock(mutex_);
    note(report, one.size());
    batch.append(one);
    return;
  }
  std::unique_lock lock(mutex_);
  if (waiting_.time_s.empty() && patience.count() > 0) {
    arrived_.wait_for(lock, patience, [this] { return !waiting_.time_s.empty() || ended_; });
  }
  batch.append(waiting_);
  waiting_.clear();
  room_.notify_all();
  if (failure_ && batch.size() == 0) {
    std::rethrow_exception(failure_);
  }
}

std::vector<Channel> SourceReader::channels() const {
  const std::lock_guard lock(mutex_);
  return channels_;
}

bool SourceReader::has_ended() const {
  const std::lock_guard lock(mutex_);
  return ended_ && waiting_.time_s.empty();
}

std::optional<double> SourceReader::time_at_zero() const {
  const std::lock_guard lock(mutex_);
  return time_at_zero_;
}

double SourceReader::silence_s() const {
  const std::lock_guard lock(mutex_);
  return is_live() && counts_.samples > 0 ? session_seconds() - last_sample_s_ : 0.0;
}

SampleFeed::Counts SourceReader::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void SourceReader::request(const DesignEntry* entry, bool warned) {
  const std::lock_guard lock(mutex_);
  request_ = entry == nullptr ? std::nullopt : std::optional(*entry);
  request_warned_ = warned;
  request_new_ = true;
  if (!is_live()) {
    pass_request();
  }
}

void SourceReader::add_alarms(std::vector<SessionAlarm>& alarms) const {
  const std::lock_guard lock(mutex_);
  const double now = session_seconds();
  if (state_ == LinkState::waiting || state_ == LinkState::lost) {
    alarms.push_back({.code = "unplugged",
                      .text = message_.empty() ? source_->name() + ": not connected"
                                               : message_ + "; the program tries to connect "
                                                            "again"});
  } else if (ended_) {
    alarms.push_back({.code = "ended", .text = formatted("{}: {}", source_->name(), message_)});
  } else if (!message_.empty()) {
    alarms.push_back({.code = "source", .text = message_});
  }
  if (is_live() && state_ == LinkState::open && bytes_since_sample_ > 0 &&
      now - last_sample_s_ > no_sample_s && now - opened_s_ > no_sample_s) {
    alarms.push_back({.code = "format",
                      .text = source_->name() +
                              ": the received bytes contain no samples: are baud, format and "
                              "names right?"});
  }
  if (defects_at_s_ > 0.0 && now - defects_at_s_ < shown_for_s) {
    alarms.push_back({.code = "garbage",
                      .text = formatted("{}: {} invalid lines or frames so far; they are ignored",
                                        source_->name(), counts_.defects)});
  }
  if (stepped_at_s_ > 0.0 && now - stepped_at_s_ < shown_for_s) {
    alarms.push_back({.code = "clock",
                      .text = source_->name() +
                              ": the times of the source jumped; the jump is removed from the "
                              "times"});
  }
  const double stated = source_->stated_rate_hz();
  if (is_live() && stated > 0.0 && rate_hz_ > 0.0 &&
      std::abs(rate_hz_ / stated - 1.0) > rate_tolerance && state_ == LinkState::open) {
    alarms.push_back(
        {.code = "rate",
         .text = formatted("{}: {} samples per second arrive, but the stated rate is {}",
                           source_->name(), number_text(rate_hz_, 3), number_text(stated))});
  }
}

// Catches all exceptions, because an exception that leaves a thread ends the program.
void SourceReader::run() {
  try {
    read_until_the_end();
  } catch (...) {
    const std::lock_guard lock(mutex_);
    failure_ = std::current_exception();
    ended_ = true;
    arrived_.notify_all();
  }
}

void SourceReader::read_until_the_end() {
  constexpr std::chrono::milliseconds patience{50};
  SampleBatch batch;
  while (!stop_) {
    batch.clear();
    {
      const std::lock_guard lock(mutex_);
      pass_request();
    }
    const SourceReport report = source_->read(batch, patience);
    std::unique_lock lock(mutex_);
    // If the queue is full, the thread waits, so that the memory stays limited. The source's end is
    // reported together with the last batch.
    room_.wait(lock, [this] { return stop_ || waiting_.values.size() < most_values_waiting; });
    note(report, batch.size());
    waiting_.append(batch);
    arrived_.notify_all();
    if (report.state == LinkState::ended) {
      return;
    }
  }
}

void SourceReader::pass_request() {
  if (std::exchange(request_new_, false)) {
    source_->request(request_ ? &*request_ : nullptr, request_warned_);
  }
}

void SourceReader::note(const SourceReport& report, std::size_t samples) {
  const double now = session_seconds();
  if (report.state == LinkState::open && state_ != LinkState::open) {
    opened_s_ = now;
    rate_from_s_ = 0.0;
  }
  state_ = report.state;
  message_ = report.message;
  ended_ = ended_ || report.state == LinkState::ended;
  time_at_zero_ = report.time_at_zero ? report.time_at_zero : time_at_zero_;
  counts_.samples += samples;
  counts_.defects += report.defects;
  counts_.duplicates += report.duplicates;
  defects_at_s_ = report.defects > 0 ? now : defects_at_s_;
  stepped_at_s_ = report.clock_stepped ? now : stepped_at_s_;
  bytes_since_sample_ = samples > 0 ? 0 : bytes_since_sample_ + report.bytes;
  if (samples > 0) {
    last_sample_s_ = now;
    if (channels_.empty()) {
      channels_ = source_->channels();
      for (Channel& channel : channels_) {
        channel.name = printable_name(channel.name);  // removes control characters for terminals
      }
    }
    if (rate_from_s_ == 0.0) {
      rate_from_s_ = now;
      rate_samples_ = 0;
    } else {
      rate_samples_ += samples;
      if (now - rate_from_s_ >= rate_window_s) {
        rate_hz_ = static_cast<double>(rate_samples_) / (now - rate_from_s_);
        rate_from_s_ = now;
        rate_samples_ = 0;
      }
    }
  }
}

}  // namespace axiscal
