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
  std::string unit;  ///< unit that the source states; empty if unknown
};

/// Samples of all channels of a source, in the order in which they were taken.
struct SampleBatch {
  std::vector<double> time_s;  ///< n times since the start of the session, not decreasing [s]
  std::vector<double> values;  ///< n x channels, sample by sample; NaN for a missing value

  [[nodiscard]] std::size_t size() const { return time_s.size(); }
  [[nodiscard]] std::span<const double> row(std::size_t i) const {
    const std::size_t width = time_s.empty() ? 0 : values.size() / time_s.size();
    return {values.data() + i * width, width};
  }
  /// @param sample_time_s  time of the sample [s]; at least the time of the previous sample.
  /// @param sample         one value for each channel.
  void add(double sample_time_s, std::span<const double> sample);
  /// @param later  a batch of the same channels.
  void append(const SampleBatch& later);
  void clear() {
    time_s.clear();
    values.clear();
  }
};

/// The state of the connection to a source.
enum class LinkState {
  waiting,  ///< not yet connected
  open,
  lost,   ///< was connected; the source is trying to reconnect
  ended,  ///< no more samples will come
};

/// The report of a source after a read.
struct SourceReport {
  LinkState state = LinkState::open;
  std::string message;      ///< the problem and the remedy; empty without a problem
  std::size_t defects = 0;  ///< number of invalid lines or frames since the last report
  /// Number of repeated samples that the source omitted since the last report.
  std::size_t duplicates = 0;
  bool clock_stepped = false;  ///< true: the source's clock jumped; sample times were corrected
  std::size_t bytes = 0;       ///< number of received bytes since the last report
  /// The clock time that corresponds to the sample time 0. For live samples it is UTC [s since
  /// 1970]; for a recording it is a time of the recording's clock. At most one report has a value;
  /// without a clock, no report has one.
  std::optional<double> time_at_zero;
};

/// A source of samples: an instrument, a data system or a file. Users can derive their own classes.
///
/// read() is always called from the same thread, which may differ from the session's thread.
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

  /// Waits for samples, at most for `patience`, and appends them to `batch`. The source reopens a
  /// lost connection by itself.
  virtual SourceReport read(SampleBatch& batch, std::chrono::milliseconds patience) = 0;

  /// @return true if samples arrive in real time; false if the source waits for its reader, as a
  ///         file or a simulation at full speed does.
  [[nodiscard]] virtual bool is_live() const { return true; }

  /// @return true for recorded samples, at any speed of replay.
  [[nodiscard]] virtual bool is_recorded() const { return false; }

  /// @return the stated sample rate; 0 if no rate is stated.
  [[nodiscard]] virtual double stated_rate_hz() const { return 0.0; }

  /// Passes the current instruction to a simulated person. Other sources ignore it.
  ///
  /// @param entry   the requested pose; null without a request.
  /// @param warned  true if the session has just told the person that the cube has a wrong pose, or
  ///                that it was not moved.
  virtual void request(const DesignEntry* entry, bool warned);

  /// Makes a simulated person turn the instrument in the hand. Other sources ignore it.
  /// @param by_rests  true if the person holds the instrument still between turns.
  virtual void set_free_motion(bool by_rests);

  /// Passes the experiment to a simulated instrument, before channels() is called. Other sources
  /// ignore it.
  /// @throws SetupError  for a field that cannot be simulated.
  virtual void play(const Experiment& experiment);
};

}  // namespace axiscal
