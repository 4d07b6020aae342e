// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/acquisition/free_view.hpp"
#include "axiscal/acquisition/journal.hpp"
#include "axiscal/acquisition/live_session.hpp"
#include "axiscal/acquisition/pose_path.hpp"
#include "axiscal/acquisition/session_outcome.hpp"
#include "axiscal/acquisition/source.hpp"
#include "axiscal/acquisition/stillness.hpp"
#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/positioner/design.hpp"

namespace axiscal {

/// The inputs of a guided session.
struct SessionSetup {
  Experiment experiment;  ///< if the cube has several instruments: the result of assembled()
  std::vector<RunSheetRow> sheet;  ///< design points in the order of the requests
  StillnessOptions stillness;
  /// Duration of each reading [s]. If nullopt, it is computed from the noise and reading_u.
  std::optional<double> dwell_s;
  /// Target for the standard uncertainty of a reading due to noise, relative to the effect of the
  /// field (sensitivity times magnitude).
  double reading_u = 5e-5;
  double shortest_dwell_s = 1.0;
  double longest_dwell_s = 20.0;
  bool automatic = true;  ///< true: readings are taken when the cube is still; false: on command
  /// True if no person answers questions. In the review the session then retakes suspect readings
  /// by itself, at most twice.
  bool unattended = false;
  bool keep_raw = false;  ///< true: the journal also contains the raw samples
  /// Names of the temperature channels: one for all axes, or one for each axis. If a single name is
  /// stated and this channel does not exist, the channels AXIS_temperature of all axes are used.
  std::vector<std::string> temperature_channels = {"temperature"};
  double soak_window_s = 300.0;    ///< window in which the temperature must be steady
  double soak_tolerance = 0.1;     ///< largest change of the temperature in soak_window_s
  double placement_sd_rad = 3e-5;  ///< repeatability of the cube's orientation
};

/// The commands of a session.
enum class SessionAction {
  capture,           ///< take the reading now, even if its duration is not complete
  accept,            ///< store the reading in question under the requested point
  as_seen,           ///< store the reading in question under the point that fits it best
  retake,            ///< drop a reading and ask for its point again
  retake_suggested,  ///< drop all SessionView::suspects and ask for their points again
  undo,              ///< drop the last reading and ask for its point again
  skip,              ///< continue without this point
  replicate,         ///< append all points of the design once more
  pause,
  go_on,
  finish,  ///< end with the readings so far; in the review: accept the result
  toggle_automatic,
  quit,  ///< stop; the journal can be resumed
};

/// @return "capture", "accept", "as-seen", "retake", ...
[[nodiscard]] std::string_view action_name(SessionAction action);
[[nodiscard]] std::optional<SessionAction> parse_action(std::string_view name);

struct SessionCommand {
  SessionAction action = SessionAction::capture;
  std::optional<int> run;  ///< run number for `retake`; nullopt: the last run
};

enum class SessionPhase {
  waiting,   ///< waiting for the first sample
  soaking,   ///< waiting for the planned temperature
  laying,    ///< the person has to place the cube, or is placing it
  settling,  ///< the cube is still; a short wait before the reading begins
  dwelling,  ///< the reading is being taken
  ready,     ///< the reading may be taken on command
  question,  ///< the reading looks like another point, or fits no point
  storing,   ///< a reading cannot be stored yet
  paused,
  review,  ///< all points are done; the person accepts the result or retakes readings
  over,
};

/// @return "waiting", "soaking", ...
[[nodiscard]] std::string_view phase_name(SessionPhase phase);

/// A current problem of the session.
struct SessionAlarm {
  std::string code;  ///< "unplugged", "silent", "saturated", "stuck", "rate", "unit", "disk", ...
  std::string text;  ///< the problem and the remedy
};

/// An event of the session.
struct SessionEvent {
  std::string kind;  ///< "ask", "captured", "question", "knock", "drift", "alarm", ...
  std::string text;
  double time_s = 0.0;
  std::optional<int> run;
  std::optional<DesignPoint> point;
};

/// A reading that was taken.
struct CapturedReading {
  int run = 1;  ///< number of the reading, in the order taken
  std::size_t step = 0;
  RunSheetRow row;  ///< point, level and block of the reading
  Eigen::VectorXd mean;
  Eigen::VectorXd sd;
  std::size_t samples = 0;
  double start_s = 0.0;  ///< start [s since 1970, UTC]; for a recording, by the recording's clock
  double end_s = 0.0;
  std::optional<SensorTemperature> temperature;
};

/// One point of the session.
struct SessionStep {
  RunSheetRow row;
  bool skipped = false;
  std::optional<int> run;  ///< run number of the reading at this point; nullopt if there is none
};

/// The view of the session for display; updated with every sample.
struct SessionView {
  SessionPhase phase = SessionPhase::waiting;
  std::string headline;  ///< the current instruction, one sentence
  std::string detail;    ///< how to follow the instruction, or its reason
  std::optional<RunSheetRow> wanted;
  std::optional<DesignPoint> present;     ///< pose of the cube; nullopt if it is unknown
  std::optional<DesignPoint> looks_like;  ///< in phase question: the pose that fits best
  bool lies_as_before = false;            ///< true: the cube is in the pose of the last reading
  std::vector<CubeTurn> turns;            ///< turns of the cube from the present to the wanted pose
  /// Scatter of the samples divided by its limit. The cube is still if this is at most 1.
  double stillness = 0.0;
  double progress = 0.0;  ///< completed part of the duration, 0 .. 1
  double dwell_s = 0.0;
  double rate_hz = 0.0;
  bool automatic = true;
  std::vector<double> reading;  ///< mean over the stillness window, one value per axis
  std::optional<double> temperature;
  std::vector<SessionStep> steps;
  std::size_t done = 0;
  std::size_t left = 0;
  std::optional<double> remaining_s;
  std::optional<Eigen::Vector2d> slope;  ///< slope of the table from the readings so far [rad]
  Eigen::Vector2d slope_u = Eigen::Vector2d::Zero();
  /// Prediction for the end of the session: standard uncertainty of a measured direction [deg], for
  /// the worst direction.
  std::optional<double> forecast_deg;
  std::vector<SessionAlarm> alarms;
  std::vector<int> suspects;        ///< run numbers of the readings that later readings contradict
  std::vector<std::string> result;  ///< at the end: verdict and warnings
  std::vector<SessionOutcome> outcomes;  ///< at the end: one result for each instrument
  std::optional<FreeView> free;          ///< progress of a FreeSession; nullopt for other sessions
  std::optional<FieldLevel> present_level;  ///< field level at the last reading
};

/// A guided calibration with a cube. It does not depend on the source of the samples or on the user
/// interface.
///
/// For each point of the sheet, the session waits until the cube was moved and is still again. It
/// averages the samples over the duration of a reading. After a knock or a drift, the average is
/// started again. The session compares the reading with the predictions for all 24 poses
/// (PoseModel), stores it in the journal, and only then reports it as captured. At the end it
/// calibrates and suggests readings to retake.
///
/// The same samples and commands give the same readings.
class Session final : public LiveSession {
 public:
  /// @param setup    the sheet must not be empty.
  /// @param journal  must outlive the session.
  /// @throws SetupError  if make_field_description() throws it.
  Session(SessionSetup setup, Journal& journal);
  ~Session() override;

  void set_channels(const std::vector<Channel>& channels,
                    std::optional<double> time_at_zero = {}) override;
  void restore(const std::vector<std::string>& lines, const std::string& path) override;
  void add(double time_s, std::span<const double> values) override;
  void idle(double seconds) override;
  void set_source_alarms(const std::vector<SessionAlarm>& alarms) override;
  void command(const SessionCommand& command) override;
  void end_of_samples() override;
  [[nodiscard]] bool is_over() const override;
  [[nodiscard]] bool has_quit() const override;
  [[nodiscard]] const SessionView& view() override;
  [[nodiscard]] std::vector<SessionEvent> take_events() override;

  /// @return the readings so far in the order taken, with the numbers of samples, the standard
  ///         deviations, the times and the temperatures.
  [[nodiscard]] Observations observations() const override;
  [[nodiscard]] const std::vector<CapturedReading>& readings() const;
  [[nodiscard]] const std::vector<Calibration>& calibrations() const override;

 private:
  class Engine;
  std::unique_ptr<Engine> engine_;
};

}  // namespace axiscal
