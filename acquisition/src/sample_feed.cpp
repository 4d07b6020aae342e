// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/sample_feed.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>

#include "acquisition/src/sample_clock.hpp"
#include "acquisition/src/source_reader.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/logs/segment.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr double longest_wait_s = 1.0;   // longest wait for the next sample of another live source
constexpr double longest_hold_s = 10.0;  // largest time over which a sample is extrapolated

// A sample of the first source that waits for samples of the other sources.
struct Pending {
  double time_s;
  double taken_at_s;  // session_seconds() when it was received
  std::vector<double> values;
};

// The samples of another source that may still be needed.
struct Neighbours {
  std::vector<std::size_t> taken;  // indices of the source's channels, except a column of times
  std::deque<std::pair<double, std::vector<double>>> samples;
  bool is_apart = false;  // true if no sample is near the last sample of the first source
};

}  // namespace

class SampleFeed::Impl {
 public:
  explicit Impl(std::vector<std::unique_ptr<Source>> sources) {
    if (sources.empty()) {
      throw DomainError("SampleFeed: at least one source is needed");
    }
    for (std::unique_ptr<Source>& source : sources) {
      readers_.push_back(std::make_unique<SourceReader>(std::move(source)));
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

  // True after all samples of the first source were delivered.
  [[nodiscard]] bool has_ended() const {
    return readers_.front()->has_ended() && (pending_.empty() || channels_.empty());
  }

  void add_alarms(std::vector<SessionAlarm>& alarms) const {
    for (std::size_t s = 0; s < readers_.size(); ++s) {
      readers_[s]->add_alarms(alarms);
      if (others_[s].is_apart) {
        alarms.push_back(
            {.code = "apart",
             .text = formatted(
                 "{}: no sample is within {} s of the last sample of {}; do the clocks agree?",
                 readers_[s]->name(), number_text(longest_hold_s), readers_.front()->name())});
      }
    }
  }

  std::vector<std::unique_ptr<SourceReader>> readers_;
  std::vector<Channel> channels_;

 private:
  static constexpr std::size_t most_pending = 1U << 16U;

  void take_first(std::chrono::milliseconds patience) {
    SourceReader& reader = *readers_.front();
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

  // Takes the new samples of a live source, or the samples of a recording up to the time of the
  // last waiting sample.
  void take_other(std::size_t s) {
    SourceReader& reader = *readers_[s];
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

  // Returns the time to add to the sample times of another source [s]. If this source and the first
  // one are recordings with the same kind of clock, the result aligns them by this clock. Otherwise
  // it is 0.
  [[nodiscard]] double later_by(const SourceReader& other) const {
    const SourceReader& first = *readers_.front();
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
          continue;  // only the first source's times are used
        }
        if (std::any_of(all.begin(), all.end(),
                        [&](const Channel& one) { return one.name == own[c].name; })) {
          throw DomainError(
              formatted("two sources have a channel '{}': rename one of the channels with names=",
                        own[c].name));
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

  // True if another source may still deliver a sample that is needed for the interpolation. The
  // wait for a live source is limited.
  [[nodiscard]] bool may_still_come(std::size_t s, const Pending& sample) const {
    const SourceReader& reader = *readers_[s];
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
  for (const std::unique_ptr<SourceReader>& reader : impl_->readers_) {
    const Counts one = reader->counts();
    sum.samples += one.samples;
    sum.defects += one.defects;
    sum.duplicates += one.duplicates;
  }
  return sum;
}

void SampleFeed::request(const DesignEntry* entry, bool warned) {
  for (const std::unique_ptr<SourceReader>& reader : impl_->readers_) {
    reader->request(entry, warned);
  }
}

}  // namespace axiscal
