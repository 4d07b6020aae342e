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
  Experiment experiment;  ///< one instrument with three axes, fitted to a constant magnitude
  StillnessOptions stillness;
  /// True: a reading is the mean of the samples while the instrument is held still, as an
  /// accelerometer needs. False: a reading is one sample.
  bool by_rests = false;
  double dwell_s = 1.0;            ///< duration of a reading at rest
  double wanted_u_deg = 0.5;       ///< target for FreeView::u_deg
  std::size_t most_points = 5000;  ///< largest number of readings that are kept
  bool unattended = false;  ///< true: the session ends by itself when FreeView::is_enough is true
};

/// Calibrates an instrument that a person turns in the hand. The session repeats the fit to a
/// constant magnitude as readings arrive, and asks the person to turn the instrument towards the
/// largest gap between the directions of the readings.
///
/// Readings are written to the journal within a second. The session can be resumed from the
/// journal.
class FreeSession final : public LiveSession {
 public:
  /// @param journal  must outlive the session.
  /// @throws SetupError  if the instrument does not have three axes, or the experiment has several
  ///                     instruments.
  FreeSession(FreeSetup setup, Journal& journal);
  ~FreeSession() override;

  void set_channels(const std::vector<Channel>& channels,
                    std::optional<double> time_at_zero) override;
  void restore(const std::vector<std::string>& lines, const std::string& path) override;
  void add(double time_s, std::span<const double> values) override;
  void idle(double seconds) override;
  void set_source_alarms(const std::vector<SessionAlarm>& alarms) override;
  /// Accepts finish, go_on, undo (drops the last reading at rest), pause and quit. Refuses other
  /// commands.
  void command(const SessionCommand& command) override;
  void end_of_samples() override;
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
