// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/sample_feed.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/logs/segment.hpp"
#include "sample_clock.hpp"

namespace axiscal {
namespace {

constexpr std::size_t most_values_waiting = 1U << 20U;  // 8 MiB a source
constexpr double shown_for_s = 3.0;                     // a defect that is over
constexpr double rate_window_s = 0.9;
constexpr double rate_tolerance = 0.05;
constexpr double no_sample_s = 1.0;
constexpr double longest_wait_s = 1.0;   // for another source's next sample
constexpr double longest_hold_s = 10.0;  // its last sample counts for so long

// One source with what it has delivered and said.
class Reader {
 public:
  explicit Reader(std::unique_ptr<Source> source) : source_(std::move(source)) {
    if (source_->is_live()) {
      thread_ = std::thread([this] { run(); });
    }
  }

  ~Reader() {
    stop_ = true;
    room_.notify_all();
    if (thread_.joinable()) {
      thread_.join();
    }
  }

  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  [[nodiscard]] bool is_live() const { return source_->is_live(); }
  [[nodiscard]] bool is_recorded() const { return source_->is_recorded(); }
  [[nodiscard]] const std::string& name() const { return source_->name(); }

  // Moves what has come into a batch; of a source that is not live it reads the next.
  void take(SampleBatch& batch, std::chrono::milliseconds patience) {
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

  [[nodiscard]] std::vector<Channel> channels() const {
    const std::lock_guard lock(mutex_);
    return channels_;
  }

  [[nodiscard]] bool has_ended() const {
    const std::lock_guard lock(mutex_);
    return ended_ && waiting_.time_s.empty();
  }

  [[nodiscard]] std::optional<double> time_at_zero() const {
    const std::lock_guard lock(mutex_);
    return time_at_zero_;
  }

  [[nodiscard]] double silence_s() const {
    const std::lock_guard lock(mutex_);
    return is_live() && counts_.samples > 0 ? session_seconds() - last_sample_s_ : 0.0;
  }

  [[nodiscard]] SampleFeed::Counts counts() const {
    const std::lock_guard lock(mutex_);
    return counts_;
  }

  void request(const DesignEntry* entry, bool warned) {
    const std::lock_guard lock(mutex_);
    request_ = entry == nullptr ? std::nullopt : std::optional(*entry);
    request_warned_ = warned;
    request_new_ = true;
    if (!is_live()) {
      pass_request();
    }
  }

  void add_alarms(std::vector<SessionAlarm>& alarms) const {
    const std::lock_guard lock(mutex_);
    const double now = session_seconds();
    if (state_ == LinkState::waiting || state_ == LinkState::lost) {
      alarms.push_back({.code = "unplugged",
                        .text = message_.empty() ? source_->name() + ": nothing is connected"
                                                 : message_ + "; it is tried again"});
    } else if (ended_) {
      alarms.push_back({.code = "ended", .text = source_->name() + ": " + message_});
    } else if (!message_.empty()) {
      alarms.push_back({.code = "source", .text = message_});
    }
    if (is_live() && state_ == LinkState::open && bytes_since_sample_ > 0 &&
        now - last_sample_s_ > no_sample_s && now - opened_s_ > no_sample_s) {
      alarms.push_back({.code = "format",
                        .text = source_->name() +
                                ": bytes come, but no sample is among them: are baud, format and "
                                "names right?"});
    }
    if (defects_at_s_ > 0.0 && now - defects_at_s_ < shown_for_s) {
      alarms.push_back({.code = "garbage",
                        .text = source_->name() + ": " + std::to_string(counts_.defects) +
                                " lines or frames so far were no samples, and are left out"});
    }
    if (stepped_at_s_ > 0.0 && now - stepped_at_s_ < shown_for_s) {
      alarms.push_back(
          {.code = "clock",
           .text = source_->name() + ": its clock was set; the times go on without the jump"});
    }
    const double stated = source_->stated_rate_hz();
    if (is_live() && stated > 0.0 && rate_hz_ > 0.0 &&
        std::abs(rate_hz_ / stated - 1.0) > rate_tolerance && state_ == LinkState::open) {
      alarms.push_back({.code = "rate",
                        .text = source_->name() + ": " + number_text(rate_hz_, 3) +
                                " samples a second come, not " + number_text(stated) +
                                " as stated"});
    }
  }

 private:
  void run() {
    constexpr std::chrono::milliseconds patience{50};
    SampleBatch batch;
    while (!stop_) {
      batch.clear();
      {
        const std::lock_guard lock(mutex_);
        pass_request();
      }
      SourceReport report;
      try {
        report = source_->read(batch, patience);
      } catch (...) {
        const std::lock_guard lock(mutex_);
        failure_ = std::current_exception();
        ended_ = true;
        arrived_.notify_all();
        return;
      }
      std::unique_lock lock(mutex_);
      note(report, batch.size());
      // A reader that is late stops the source, never the memory.
      room_.wait(lock, [this] { return stop_ || waiting_.values.size() < most_values_waiting; });
      waiting_.append(batch);
      arrived_.notify_all();
      if (report.state == LinkState::ended) {
        return;
      }
    }
  }

  void pass_request() {
    if (std::exchange(request_new_, false)) {
      source_->request(request_ ? &*request_ : nullptr, request_warned_);
    }
  }

  void note(const SourceReport& report, std::size_t samples) {
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

  std::unique_ptr<Source> source_;
  mutable std::mutex mutex_;
  std::condition_variable arrived_;
  std::condition_variable room_;
  std::atomic<bool> stop_ = false;
  SampleBatch waiting_;
  std::vector<Channel> channels_;
  LinkState state_ = LinkState::waiting;
  std::string message_;
  bool ended_ = false;
  std::exception_ptr failure_;
  SampleFeed::Counts counts_;
  std::optional<double> time_at_zero_;
  double opened_s_ = 0.0;
  double last_sample_s_ = 0.0;
  std::size_t bytes_since_sample_ = 0;
  double defects_at_s_ = 0.0;
  double stepped_at_s_ = 0.0;
  double rate_from_s_ = 0.0;
  std::size_t rate_samples_ = 0;
  double rate_hz_ = 0.0;
  std::optional<DesignEntry> request_;
  bool request_warned_ = false;
  bool request_new_ = false;
  std::thread thread_;
};

// A sample that waits for those of the other sources.
struct Pending {
  double time_s;
  double taken_at_s;  // session_seconds()
  std::vector<double> values;
};

// The samples of another source that may still be needed.
struct Neighbours {
  std::vector<std::size_t> taken;  // its channels that are not among the others already
  std::deque<std::pair<double, std::vector<double>>> samples;
  bool is_apart = false;  // none of them was near the last sample of the first source
};

}  // namespace

class SampleFeed::Impl {
 public:
  explicit Impl(std::vector<std::unique_ptr<Source>> sources) {
    if (sources.empty()) {
      throw DomainError("SampleFeed: no source");
    }
    for (std::unique_ptr<Source>& source : sources) {
      readers_.push_back(std::make_unique<Reader>(std::move(source)));
    }
    others_.resize(readers_.size());
  }

  void read(SampleBatch& batch, std::chrono::milliseconds patience) {
    if (readers_.size() == 1) {
      readers_.front()->take(batch, patience);
      if (channels_.empty()) {
        channels_ = readers_.front()->channels();
      }
      return;
    }
    take_first(patience);
    for (std::size_t s = 1; s < readers_.size(); ++s) {
      take_other(s);
    }
    if (channels_.empty() && !find_channels()) {
      while (pending_.size() > most_pending) {
        pending_.pop_front();
      }
      return;
    }
    join(batch);
  }

  // With all that waited for another source.
  [[nodiscard]] bool has_ended() const {
    return readers_.front()->has_ended() && (pending_.empty() || channels_.empty());
  }

  void add_alarms(std::vector<SessionAlarm>& alarms) const {
    for (std::size_t s = 0; s < readers_.size(); ++s) {
      readers_[s]->add_alarms(alarms);
      if (others_[s].is_apart) {
        alarms.push_back({.code = "apart",
                          .text = readers_[s]->name() + ": has no sample within " +
                                  number_text(longest_hold_s) + " s of those of " +
                                  readers_.front()->name() + ": are their clocks the same?"});
      }
    }
  }

  std::vector<std::unique_ptr<Reader>> readers_;
  std::vector<Channel> channels_;

 private:
  static constexpr std::size_t most_pending = 1U << 16U;

  void take_first(std::chrono::milliseconds patience) {
    Reader& reader = *readers_.front();
    if (reader.is_live() ? pending_.size() > most_pending : !pending_.empty()) {
      return;
    }
    SampleBatch batch;
    reader.take(batch, patience);
    const double now = session_seconds();
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const std::span<const double> row = batch.row(i);
      pending_.push_back({.time_s = batch.time_s[i],
                          .taken_at_s = now,
                          .values = std::vector<double>(row.begin(), row.end())});
    }
  }

  // What a live source has delivered; a recording up to the last sample that waits for it.
  void take_other(std::size_t s) {
    Reader& reader = *readers_[s];
    if (reader.is_live()) {
      take_batch(s);
      return;
    }
    constexpr int most_batches = 64;
    for (int i = 0; i < most_batches && !reader.has_ended() && is_behind(others_[s]); ++i) {
      take_batch(s);
    }
  }

  [[nodiscard]] bool is_behind(const Neighbours& other) const {
    return other.samples.empty() ||
           (!pending_.empty() && other.samples.back().first < pending_.back().time_s);
  }

  void take_batch(std::size_t s) {
    SampleBatch batch;
    readers_[s]->take(batch, std::chrono::milliseconds(0));
    const double shift_s = later_by(*readers_[s]);
    auto& samples = others_[s].samples;
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const std::span<const double> row = batch.row(i);
      samples.emplace_back(batch.time_s[i] + shift_s, std::vector<double>(row.begin(), row.end()));
    }
    while (samples.size() > most_pending) {
      samples.pop_front();
    }
  }

  // Recordings by one clock go together by it; others are taken to have begun together.
  [[nodiscard]] double later_by(const Reader& other) const {
    const Reader& first = *readers_.front();
    const std::optional<double> own = other.time_at_zero();
    const std::optional<double> pace = first.time_at_zero();
    return first.is_recorded() && other.is_recorded() && own && pace &&
                   is_utc(*own) == is_utc(*pace)
               ? *own - *pace
               : 0.0;
  }

  bool find_channels() {
    std::vector<Channel> all = readers_.front()->channels();
    bool known = !all.empty();
    for (std::size_t s = 1; s < readers_.size() && known; ++s) {
      const std::vector<Channel> own = readers_[s]->channels();
      known = !own.empty();
      others_[s].taken.clear();
      for (std::size_t c = 0; c < own.size(); ++c) {
        if (find_time_column("", {own[c].name}, "")) {
          continue;  // the first source has the times
        }
        if (std::any_of(all.begin(), all.end(),
                        [&](const Channel& one) { return one.name == own[c].name; })) {
          throw DomainError("channel '" + own[c].name +
                            "' comes from two sources: name them by names=");
        }
        all.push_back(own[c]);
        others_[s].taken.push_back(c);
      }
    }
    if (known) {
      channels_ = std::move(all);
    }
    return known;
  }

  void join(SampleBatch& batch) {
    for (; !pending_.empty(); pending_.pop_front()) {
      Pending& next = pending_.front();
      for (std::size_t s = 1; s < readers_.size(); ++s) {
        if (may_still_come(s, next)) {
          return;
        }
      }
      for (std::size_t s = 1; s < readers_.size(); ++s) {
        append_at(next.time_s, others_[s], next.values);
        others_[s].is_apart = others_[s].is_apart && readers_[s]->is_recorded();
      }
      batch.add(next.time_s, next.values);
    }
  }

  // Whether another source may still deliver what belongs to a sample; a live one is not waited for
  // for long.
  [[nodiscard]] bool may_still_come(std::size_t s, const Pending& sample) const {
    const Reader& reader = *readers_[s];
    const auto& samples = others_[s].samples;
    if (reader.has_ended() || (!samples.empty() && samples.back().first >= sample.time_s)) {
      return false;
    }
    return !reader.is_live() || samples.empty() ||
           session_seconds() - sample.taken_at_s <= longest_wait_s;
  }

  static void append_at(double time_s, Neighbours& other, std::vector<double>& values) {
    auto& samples = other.samples;
    while (samples.size() > 1 && samples[1].first <= time_s) {
      samples.pop_front();
    }
    const bool is_between = samples.size() > 1 && samples.front().first <= time_s;
    other.is_apart = !is_between && (samples.empty() ||
                                     std::abs(samples.front().first - time_s) >= longest_hold_s);
    for (const std::size_t c : other.taken) {
      double value = not_a_number;
      if (is_between) {
        const auto& [t0, before] = samples[0];
        const auto& [t1, after] = samples[1];
        const double part = t1 > t0 ? (time_s - t0) / (t1 - t0) : 0.0;
        value = before[c] + part * (after[c] - before[c]);
      } else if (!other.is_apart) {
        value = samples.front().second[c];
      }
      values.push_back(value);
    }
  }

  std::vector<Neighbours> others_;
  std::deque<Pending> pending_;
};

SampleFeed::SampleFeed(std::vector<std::unique_ptr<Source>> sources)
    : impl_(std::make_unique<Impl>(std::move(sources))) {}
SampleFeed::~SampleFeed() = default;

void SampleFeed::read(SampleBatch& batch, std::chrono::milliseconds patience) {
  impl_->read(batch, patience);
}

const std::vector<Channel>& SampleFeed::channels() const {
  return impl_->channels_;
}

std::vector<SessionAlarm> SampleFeed::alarms() const {
  std::vector<SessionAlarm> alarms;
  impl_->add_alarms(alarms);
  return alarms;
}

bool SampleFeed::has_ended() const {
  return impl_->has_ended();
}

bool SampleFeed::is_live() const {
  return impl_->readers_.front()->is_live();
}

std::optional<double> SampleFeed::time_at_zero() const {
  return impl_->readers_.front()->time_at_zero();
}

double SampleFeed::silence_s() const {
  return impl_->readers_.front()->silence_s();
}

SampleFeed::Counts SampleFeed::counts() const {
  Counts sum;
  for (const std::unique_ptr<Reader>& reader : impl_->readers_) {
    const Counts one = reader->counts();
    sum.samples += one.samples;
    sum.defects += one.defects;
    sum.duplicates += one.duplicates;
  }
  return sum;
}

void SampleFeed::request(const DesignEntry* entry, bool warned) {
  for (const std::unique_ptr<Reader>& reader : impl_->readers_) {
    reader->request(entry, warned);
  }
}

}  // namespace axiscal
