// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "axiscal/acquisition/session.hpp"
#include "axiscal/acquisition/source.hpp"

namespace axiscal {

/// Several sources as one: the channels of all, at the times of the first.
///
/// Each live source is read by a thread of its own, so that none waits for another or for the disk;
/// in between stands a queue of limited length. What the other sources say at the time of a sample
/// of the first is interpolated between their neighbouring samples.
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

  /// @return what is wrong with the sources right now: unplugged, no samples among the bytes, wrong
  ///         rate, clock set, lines that are none.
  [[nodiscard]] std::vector<SessionAlarm> alarms() const;

  /// @return whether no source will deliver more.
  [[nodiscard]] bool has_ended() const;

  /// @return whether samples come in their own time; else they wait for the reader.
  [[nodiscard]] bool is_live() const;

  /// @return when the session's second 0 was: [s since 1970, UTC] by this machine's clock, or by a
  ///         recording's own; nothing where it has none, and before the channels are known.
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
