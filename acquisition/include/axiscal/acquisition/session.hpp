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
  Experiment experiment;           ///< of several instruments in one cube: see assembled()
  std::vector<RunSheetRow> sheet;  ///< the points in the order in which they are asked for
  StillnessOptions stillness;
  /// How long each reading is taken [s]; nothing: as long as the noise asks for, see reading_u.
  std::optional<double> dwell_s;
  /// Target for the standard uncertainty of a reading from noise, relative to the effect of the
  /// field.
  double reading_u = 5e-5;
  double shortest_dwell_s = 1.0;
  double longest_dwell_s = 20.0;
  bool automatic = true;  ///< readings are taken when it is still; else on command
  /// Nobody answers: at the end what looks wrong is asked for again, twice at most.
  bool unattended = false;
  bool keep_raw = false;  ///< raw samples go to the journal too
  /// Channel of the temperature, or of each axis's sensor. If there is none of that name,
  /// AXIS_temperature of all axes.
  std::vector<std::string> temperature_channels = {"temperature"};
  double soak_window_s = 300.0;    ///< length of the window, as in soak_state()
  double soak_tolerance = 0.1;     ///< largest change of the output in that time
  double placement_sd_rad = 3e-5;  ///< repeatability of a seat
};

/// The commands of a session.
enum class SessionAction {
  capture,           ///< take the reading now (where it is not automatic, or it drifts)
  accept,            ///< it lies as asked for, whatever it looks like
  as_seen,           ///< take it for the point that it looks like
  retake,            ///< a run anew
  retake_suggested,  ///< those that look wrong at the end
  undo,              ///< drop the last reading and ask for its point again
  skip,              ///< go on without this point
  replicate,         ///< the whole design once more
  pause,
  go_on,
  finish,  ///< finish with the readings so far; at the end: accept the result
  toggle_automatic,
  quit,  ///< stop; the journal can be resumed
};

/// @return "capture", "accept", "as-seen", "retake", ...
[[nodiscard]] std::string_view action_name(SessionAction action);
[[nodiscard]] std::optional<SessionAction> parse_action(std::string_view name);

struct SessionCommand {
  SessionAction action = SessionAction::capture;
  std::optional<int> run;  ///< which reading `retake` is about
};

enum class SessionPhase {
  waiting,   ///< for the first sample
  soaking,   ///< for the temperature
  laying,    ///< the cube is being laid, or still to be
  settling,  ///< it is still; is it quiet enough for a first reading?
  dwelling,  ///< the reading is being taken
  ready,     ///< it may be taken on command
  question,  ///< it looks like another point
  storing,   ///< a reading cannot be stored yet
  paused,
  review,  ///< all points are done: is it good so?
  over,
};

/// @return "waiting", "soaking", ...
[[nodiscard]] std::string_view phase_name(SessionPhase phase);

/// Something that is wrong right now.
struct SessionAlarm {
  std::string code;  ///< "unplugged", "silent", "saturated", "stuck", "rate", "unit", "disk", ...
  std::string text;  ///< the problem and the remedy
};

/// Something that happened.
struct SessionEvent {
  std::string kind;  ///< "ask", "captured", "question", "knock", "drift", "alarm", ...
  std::string text;
  double time_s = 0.0;
  std::optional<int> run;
  std::optional<DesignPoint> point;
};

/// A reading that was taken.
struct CapturedReading {
  int run = 1;  ///< in the order taken
  std::size_t step = 0;
  RunSheetRow row;  ///< the point, level and block that it is of
  Eigen::VectorXd mean;
  Eigen::VectorXd sd;
  std::size_t samples = 0;
  double start_s = 0.0;  ///< since 1970, UTC; of a recording by its own clock
  double end_s = 0.0;
  std::optional<SensorTemperature> temperature;
};

/// A point to be done.
struct SessionStep {
  RunSheetRow row;
  bool skipped = false;
  std::optional<int> run;  ///< its reading
};

/// The view of the session for display; updated with every sample.
struct SessionView {
  SessionPhase phase = SessionPhase::waiting;
  std::string headline;  ///< the current instruction, one sentence
  std::string detail;    ///< how, or why
  std::optional<RunSheetRow> wanted;
  std::optional<DesignPoint> present;     ///< pose of the cube, as far as it is known
  std::optional<DesignPoint> looks_like;  ///< in a question
  bool lies_as_before = false;            ///< it was touched, but lies as at the last reading
  std::vector<CubeTurn> turns;            ///< from the present pose to the wanted one
  double stillness = 0.0;                 ///< scatter over what counts as still; at most 1 is still
  double progress = 0.0;                  ///< completed part of the dwell time, 0 .. 1
  double dwell_s = 0.0;
  double rate_hz = 0.0;
  bool automatic = true;
  std::vector<double> reading;  ///< mean of the last moments, of each axis
  std::optional<double> temperature;
  std::vector<SessionStep> steps;
  std::size_t done = 0;
  std::size_t left = 0;
  std::optional<double> remaining_s;
  std::optional<Eigen::Vector2d> slope;  ///< the table's, as the readings so far have it [rad]
  Eigen::Vector2d slope_u = Eigen::Vector2d::Zero();
  std::optional<double> forecast_deg;  ///< largest standard uncertainty of a direction at the end
  std::vector<SessionAlarm> alarms;
  std::vector<int> suspects;                ///< runs that later readings contradict
  std::vector<std::string> result;          ///< at the end: verdict and warnings
  std::vector<SessionOutcome> outcomes;     ///< at the end: coefficients, one for each instrument
  std::optional<FreeView> free;             ///< of a session without a cube: the sphere so far
  std::optional<FieldLevel> present_level;  ///< of the field at the last reading
};

/// The engine of a guided calibration: samples and commands go in, a view and events come out. It
/// knows neither where samples come from nor who looks.
///
/// For each point of the sheet it waits until the cube was moved and is still again, takes the
/// reading for the dwell time, restarts on knocks and drift, holds it against what each of the 24
/// poses should read (PoseModel), stores it in the journal, and only then says "captured". At the
/// end it calibrates and says what to take again.
///
/// The same samples and commands give the same readings.
class Session final : public LiveSession {
 public:
  /// @param setup    the sheet must not be empty.
  /// @param journal  must outlive it.
  /// @throws SetupError  as make_field_description().
  Session(SessionSetup setup, Journal& journal);
  ~Session() override;

  void set_channels(const std::vector<Channel>& channels,
                    std::optional<double> time_at_zero = {}) override;
  void restore(const std::vector<std::string>& lines, const std::string& path) override;
  void add(double time_s, std::span<const double> values) override;
  void idle(double seconds) override;
  void set_source_alarms(const std::vector<SessionAlarm>& alarms) override;
  void command(const SessionCommand& command) override;
  void no_more_samples() override;
  [[nodiscard]] bool is_over() const override;
  [[nodiscard]] bool has_quit() const override;
  [[nodiscard]] const SessionView& view() override;
  [[nodiscard]] std::vector<SessionEvent> take_events() override;

  /// @return the readings so far, in the order taken; with samples, AXIS_sd, times, temperatures.
  [[nodiscard]] Observations observations() const override;
  [[nodiscard]] const std::vector<CapturedReading>& readings() const;
  [[nodiscard]] const std::vector<Calibration>& calibrations() const override;

 private:
  class Engine;
  std::unique_ptr<Engine> engine_;
};

}  // namespace axiscal
