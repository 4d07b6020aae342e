// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "axiscal/acquisition/session.hpp"
#include "axiscal/acquisition/source.hpp"

namespace axiscal {

/// Several sources as one: the channels of all sources, at the times of the first.
///
/// Each live source has a thread of its own, so that sources do not wait for each other or for the
/// disk. A queue of limited length connects it to the session. The channels of the other sources
/// are interpolated to the times of the first.
class SampleFeed {
 public:
  /// @param sources  one or more; the first sets the pace.
  explicit SampleFeed(std::vector<std::unique_ptr<Source>> sources);
  ~SampleFeed();
  SampleFeed(const SampleFeed&) = delete;
  SampleFeed& operator=(const SampleFeed&) = delete;

  /// Waits for samples, at most so long, and appends them.
  /// @throws DomainError  if a channel comes from two sources.
  /// @throws Error        what a source throws.
  void read(SampleBatch& batch, std::chrono::milliseconds patience);

  /// @return the channels of all sources; empty until all are known.
  [[nodiscard]] const std::vector<Channel>& channels() const;

  /// @return the current problems of the sources: unplugged, bytes without samples, wrong rate,
  ///         clock set, invalid lines.
  [[nodiscard]] std::vector<SessionAlarm> alarms() const;

  /// @return whether no source will deliver more.
  [[nodiscard]] bool has_ended() const;

  /// @return whether samples come in their own time; else they wait for the reader.
  [[nodiscard]] bool is_live() const;

  /// @return the time of the session's second 0: [s since 1970, UTC] by this machine's clock, or by
  ///         the clock of a recording; nullopt if the recording lacks a clock, and before the
  ///         channels are known.
  [[nodiscard]] std::optional<double> time_at_zero() const;

  /// @return for how long nothing has come from the first source [s]; 0 where it is not live.
  [[nodiscard]] double silence_s() const;

  /// Samples that came in all, and those that are none, of all sources.
  struct Counts {
    std::size_t samples = 0;
    std::size_t defects = 0;
    std::size_t duplicates = 0;
  };
  [[nodiscard]] Counts counts() const;

  /// As Source::request(), of all sources.
  void request(const DesignEntry* entry, bool warned);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace axiscal
