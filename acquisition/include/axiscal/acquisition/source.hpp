// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "axiscal/positioner/design.hpp"

namespace axiscal {

struct Experiment;

/// One quantity that a source delivers.
struct Channel {
  std::string name;
  std::string unit;  ///< as stated by the source; empty if unknown
};

/// Samples of all channels of a source, in the order in which they were taken.
struct SampleBatch {
  std::vector<double> time_s;  ///< n, not decreasing, from the start of the session [s]
  std::vector<double> values;  ///< n x channels, sample by sample; NaN where a sample lacks one

  [[nodiscard]] std::size_t size() const { return time_s.size(); }
  [[nodiscard]] std::span<const double> row(std::size_t i) const {
    const std::size_t width = time_s.empty() ? 0 : values.size() / time_s.size();
    return {values.data() + i * width, width};
  }
  /// @param sample_time_s  not before that of the last one [s].
  /// @param sample         a value for each channel.
  void add(double sample_time_s, std::span<const double> sample);
  /// @param later  of the same channels.
  void append(const SampleBatch& later);
  void clear() {
    time_s.clear();
    values.clear();
  }
};

/// The connection of a source.
enum class LinkState {
  waiting,  ///< not yet connected
  open,
  lost,   ///< was connected; being tried again
  ended,  ///< no more samples will come
};

/// The report of a source after a read.
struct SourceReport {
  LinkState state = LinkState::open;
  std::string message;         ///< the problem and the remedy; empty without a problem
  std::size_t defects = 0;     ///< since the last report: invalid lines or frames
  std::size_t duplicates = 0;  ///< since the last report: samples that came twice, left out
  bool clock_stepped = false;  ///< the source's own clock jumped; times go on without the jump
  std::size_t bytes = 0;       ///< since the last report: bytes received, valid or not
  /// The time of second 0 of the samples, reported once: for live samples in UTC [s since 1970],
  /// for a recording by its own clock; nullopt without a clock.
  std::optional<double> time_at_zero;
};

/// Where samples come from: an instrument, a data system, a file. Users add their own.
///
/// read() is called from one thread; it may be another than the session's.
class Source {
 public:
  Source() = default;
  virtual ~Source() = default;
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  /// @return the channels; empty until they are known, then constant.
  [[nodiscard]] virtual const std::vector<Channel>& channels() const = 0;

  /// @return a name for messages: the address as given.
  [[nodiscard]] virtual const std::string& name() const = 0;

  /// Waits for samples, at most so long, and appends what is there to a batch. A lost connection
  /// is tried again by itself.
  virtual SourceReport read(SampleBatch& batch, std::chrono::milliseconds patience) = 0;

  /// @return false where the source waits for its reader: a file, a simulation as fast as can be.
  [[nodiscard]] virtual bool is_live() const { return true; }

  /// @return true for recorded samples, at any speed of replay.
  [[nodiscard]] virtual bool is_recorded() const { return false; }

  /// @return samples a second that the source should deliver; 0 where it is not stated.
  [[nodiscard]] virtual double stated_rate_hz() const { return 0.0; }

  /// The current instruction to the person. Only a simulated person uses it.
  ///
  /// @param entry   the requested pose; null without a request.
  /// @param warned  whether the person was just told that the cube lies wrong, or to lift it.
  virtual void request(const DesignEntry* entry, bool warned);

  /// From now on the person turns the instrument in the hand, holding it still now and then where
  /// readings are rests; only a simulated person needs to know.
  virtual void roam(bool by_rests);

  /// The calibrated instrument. Only a simulated instrument uses it, before channels() is called.
  /// @throws SetupError  for a field that cannot be simulated.
  virtual void play(const Experiment& experiment);
};

}  // namespace axiscal
