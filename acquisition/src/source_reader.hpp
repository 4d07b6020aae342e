// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "axiscal/acquisition/sample_feed.hpp"

namespace axiscal {

/// One source with its samples and reports. A live source is read in its own thread.
class SourceReader {
 public:
  explicit SourceReader(std::unique_ptr<Source> source);
  ~SourceReader();
  SourceReader(const SourceReader&) = delete;
  SourceReader& operator=(const SourceReader&) = delete;

  [[nodiscard]] bool is_live() const { return source_->is_live(); }
  [[nodiscard]] bool is_recorded() const { return source_->is_recorded(); }
  [[nodiscard]] const std::string& name() const { return source_->name(); }

  /// Moves what has come into a batch; of a source that is not live it reads the next.
  /// @throws the exception of the source, after all earlier samples are taken.
  void take(SampleBatch& batch, std::chrono::milliseconds patience);

  [[nodiscard]] std::vector<Channel> channels() const;
  [[nodiscard]] bool has_ended() const;  ///< and all of it is taken
  [[nodiscard]] std::optional<double> time_at_zero() const;
  [[nodiscard]] double silence_s() const;  ///< since its last sample; 0 of one that is not live
  [[nodiscard]] SampleFeed::Counts counts() const;

  /// As Source::request(), in the source's own thread.
  void request(const DesignEntry* entry, bool warned);

  /// Appends what is wrong with it now, or was a moment ago.
  void add_alarms(std::vector<SessionAlarm>& alarms) const;

 private:
  void run();
  void read_until_the_end();
  void pass_request();
  void note(const SourceReport& report, std::size_t samples);

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

}  // namespace axiscal
