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

/// Reads one source and stores its samples and reports. A live source is read in its own thread.
class SourceReader {
 public:
  explicit SourceReader(std::unique_ptr<Source> source);
  ~SourceReader();
  SourceReader(const SourceReader&) = delete;
  SourceReader& operator=(const SourceReader&) = delete;

  [[nodiscard]] bool is_live() const { return source_->is_live(); }
  [[nodiscard]] bool is_recorded() const { return source_->is_recorded(); }
  [[nodiscard]] const std::string& name() const { return source_->name(); }

  /// Moves the waiting samples of a live source to `batch`, or reads the next samples of another
  /// source.
  /// @throws Error  the error that the source threw, after all earlier samples were taken.
  void take(SampleBatch& batch, std::chrono::milliseconds patience);

  [[nodiscard]] std::vector<Channel> channels() const;
  /// @return true after the source has ended and all its samples were taken.
  [[nodiscard]] bool has_ended() const;
  [[nodiscard]] std::optional<double> time_at_zero() const;
  /// @return the time since the last sample; 0 if the source is not live.
  [[nodiscard]] double silence_s() const;
  [[nodiscard]] SampleFeed::Counts counts() const;

  /// Calls Source::request() in the thread that reads the source.
  void request(const DesignEntry* entry, bool warned);

  /// Appends the current and the recent problems of the source.
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
