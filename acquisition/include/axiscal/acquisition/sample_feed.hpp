// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "axiscal/acquisition/session.hpp"
#include "axiscal/acquisition/source.hpp"

namespace axiscal {

/// Merges several sources: it delivers the channels of all sources at the sample times of the first
/// source.
///
/// Each live source has its own thread, so that sources do not wait for each other or for the disk.
/// A queue of limited length passes the samples to the session. The channels of the other sources
/// are interpolated to the sample times of the first source.
class SampleFeed {
 public:
  /// @param sources  one or more; the first one determines the sample times.
  explicit SampleFeed(std::vector<std::unique_ptr<Source>> sources);
  ~SampleFeed();
  SampleFeed(const SampleFeed&) = delete;
  SampleFeed& operator=(const SampleFeed&) = delete;

  /// Waits for samples, at most for `patience`, and appends them to `batch`.
  /// @throws DomainError  if two sources have a channel of the same name.
  /// @throws Error        any error that a source throws.
  void read(SampleBatch& batch, std::chrono::milliseconds patience);

  /// @return the channels of all sources; empty until all are known.
  [[nodiscard]] const std::vector<Channel>& channels() const;

  /// @return the current problems of the sources: an unplugged device, bytes without samples, a
  ///         wrong sample rate, a clock that was changed, or invalid lines.
  [[nodiscard]] std::vector<SessionAlarm> alarms() const;

  /// @return true if no more samples will come.
  [[nodiscard]] bool has_ended() const;

  /// @return true if the samples of the first source arrive in real time; false if that source
  ///         waits for its reader, as a file does.
  [[nodiscard]] bool is_live() const;

  /// @return the clock time that corresponds to the sample time 0. For live samples it is UTC [s
  ///         since 1970]; for a recording it is a time of the recording's clock. nullopt before the
  ///         channels are known, or if the recording lacks a clock.
  [[nodiscard]] std::optional<double> time_at_zero() const;

  /// @return the time since the last sample of the first source [s]; 0 if the first source is not
  ///         live.
  [[nodiscard]] double silence_s() const;

  /// Numbers of samples, of invalid lines or frames, and of repeated samples, over all sources.
  struct Counts {
    std::size_t samples = 0;
    std::size_t defects = 0;
    std::size_t duplicates = 0;
  };
  [[nodiscard]] Counts counts() const;

  /// Calls Source::request() of each source.
  void request(const DesignEntry* entry, bool warned);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace axiscal
