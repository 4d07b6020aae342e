// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "axiscal/acquisition/journal.hpp"
#include "axiscal/acquisition/live_session.hpp"
#include "axiscal/acquisition/stillness.hpp"
#include "axiscal/calib/experiment.hpp"

namespace axiscal {

/// The inputs of a session without a cube.
struct FreeSetup {
  Experiment experiment;  ///< of one instrument of three axes; method magnitude
  StillnessOptions stillness;
  /// Readings are the means of rests found on the way, as an accelerometer needs; else samples as
  /// they come.
  bool by_rests = false;
  double dwell_s = 1.0;            ///< of a rest
  double wanted_u_deg = 0.5;       ///< FreeView::u_deg that is enough
  std::size_t most_points = 5000;  ///< of which no more are kept
  bool unattended = false;         ///< ends by itself when it is enough
};

/// Calibrates by turning the instrument in the hand: readings fill the sphere of directions, the
/// fit to a constant magnitude is made again and again, and the largest gap is asked for next.
///
/// The readings are in the journal within a second; it can be resumed.
class FreeSession final : public LiveSession {
 public:
  /// @param journal  must outlive it.
  /// @throws SetupError  for an instrument that has not three axes, or several instruments.
  FreeSession(FreeSetup setup, Journal& journal);
  ~FreeSession() override;

  void set_channels(const std::vector<Channel>& channels,
                    std::optional<double> time_at_zero) override;
  void restore(const std::vector<std::string>& lines, const std::string& path) override;
  void add(double time_s, std::span<const double> values) override;
  void idle(double seconds) override;
  void set_source_alarms(const std::vector<SessionAlarm>& alarms) override;
  /// Takes finish, go_on, undo (the last rest), pause and quit.
  void command(const SessionCommand& command) override;
  void no_more_samples() override;
  [[nodiscard]] bool is_over() const override;
  [[nodiscard]] bool has_quit() const override;
  [[nodiscard]] const SessionView& view() override;
  [[nodiscard]] std::vector<SessionEvent> take_events() override;
  [[nodiscard]] Observations observations() const override;
  [[nodiscard]] const std::vector<Calibration>& calibrations() const override;

 private:
  class Engine;
  std::unique_ptr<Engine> engine_;
};

}  // namespace axiscal
