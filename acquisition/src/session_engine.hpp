// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "acquisition/src/axis_intake.hpp"
#include "acquisition/src/dwell_sums.hpp"
#include "acquisition/src/raw_samples.hpp"
#include "acquisition/src/reading_list.hpp"
#include "acquisition/src/session_event_log.hpp"
#include "acquisition/src/session_knowledge.hpp"
#include "acquisition/src/soak_watch.hpp"
#include "acquisition/src/stuck_watch.hpp"
#include "axiscal/acquisition/session.hpp"

namespace axiscal {

/// The phases of a session and the transitions between them. Other classes estimate the poses
/// (SessionKnowledge), keep the readings (ReadingList) and collect the events (SessionEventLog).
class Session::Engine {
 public:
  Engine(SessionSetup setup, Journal& journal);

  void set_channels(const std::vector<Channel>& channels, std::optional<double> time_at_zero);
  void restore(const std::vector<std::string>& lines, const std::string& path);
  void add(double time_s, std::span<const double> values);
  void idle(double seconds);
  void set_source_alarms(const std::vector<SessionAlarm>& alarms);
  void end_of_samples() { samples_ended_ = true; }
  void command(const SessionCommand& command);

  [[nodiscard]] bool is_over() const { return phase_ == SessionPhase::over; }
  [[nodiscard]] bool has_quit() const { return quit_; }
  [[nodiscard]] const ReadingList& list() const { return list_; }
  [[nodiscard]] const std::vector<Calibration>& calibrations() const { return calibrations_; }
  [[nodiscard]] std::vector<SessionEvent> take_events() { return news_.take_events(); }
  const SessionView& view();
  [[nodiscard]] Observations observations() const { return list_.observations(m_); }

 private:
  // ---- samples: session_engine.cpp

  void flush_raw();
  void take_temperature(std::span<const double> values);
  void look_for_defects();
  [[nodiscard]] double level() const;
  // Converts a sample time to the stored time: UTC, or the recording's clock.
  [[nodiscard]] double shown_time(double time_s) const;
  // Aborts the current reading.
  void interrupt(const std::string& why);

  // ---- evaluation of the readings so far: session_engine.cpp

  // Records the pose, the temperature and the scatter of the last reading.
  void remember(const CapturedReading& taken);
  void update_pose_model();
  // Computes a moving field at the time of the first reading, or at the time of the first sample if
  // there is no reading yet.
  void find_moving_field();
  // Returns the angle by which a moving field has turned since the last reading [rad].
  [[nodiscard]] double field_angle_since_last() const;

  // ---- the steps of a reading: session_points.cpp

  [[nodiscard]] const RunSheetRow& wanted_row() const { return list_.steps()[*wanted_].row; }
  void next_point();
  void go_on();
  void soak();
  [[nodiscard]] bool is_nearest_level(double planned) const;
  // In phase question, detects that the person places the cube again. A short bump does not count.
  void detect_repositioning();
  void begin_dwell();
  void dwell();
  // True if the reading equals the last one, although their two points require different readings.
  [[nodiscard]] bool lies_as_before() const;
  // True if the cube was moved since the last reading.
  [[nodiscard]] bool has_moved() const;
  // Completes the reading and checks its pose.
  void complete();
  // Writes the reading to the journal, and only then reports it as captured.
  void store();

  // ---- commands and the end: session_commands.cpp

  void capture_now();
  void accept_recognised_pose();
  // `runs` is a copy, because the function changes the suspects in view_.
  void retake(std::vector<int> runs, const std::string& why);
  // Writes an entry other than a reading to the journal, and applies it to the list.
  // @return false if the journal cannot be written; the list then stays unchanged.
  bool change(const Json& entry,
              const std::string& kind,
              const std::string& text,
              std::optional<int> run = {});
  void finish();
  void review();

  SessionSetup setup_;
  Journal& journal_;
  std::optional<double> time_at_zero_;
  Eigen::Index m_;
  ReadingList list_;
  Stillness stillness_;
  SessionKnowledge knowledge_;
  StuckWatch stuck_;
  DwellSums dwell_;

  AxisIntake axes_;
  RawSamples raw_;
  std::size_t samples_ = 0;
  double now_s_ = 0.0;

  SessionPhase phase_ = SessionPhase::waiting;
  SessionPhase before_pause_ = SessionPhase::waiting;
  std::optional<std::size_t> wanted_;  // index of the requested step
  std::optional<DesignPoint> present_;
  std::optional<CapturedReading> last_;  // last reading; it may have been dropped
  bool said_as_before_ = false;
  bool moved_ = true;
  double moving_from_s_ = 0.0;  // in phase question: start of the current motion
  double tried_to_store_s_ = 0.0;
  bool samples_ended_ = false;
  double settled_s_ = 0.0;
  double asked_s_ = 0.0;
  int drift_restarts_ = 0;
  std::optional<CapturedReading> pending_;
  std::optional<PoseJudgement> judgement_;
  std::vector<double> point_seconds_;
  bool quit_ = false;

  // Indices of the temperature channels: none, one, or one for each axis.
  std::vector<std::size_t> temperature_columns_;
  SoakWatch soak_;
  bool soaked_ = false;
  std::optional<double> soaked_at_;

  std::optional<DesignPoint> questioned_;  // pose that the last question suggested
  int retake_rounds_ = 0;
  std::vector<Calibration> calibrations_;

  SessionEventLog news_;
  SessionView view_;
};

}  // namespace axiscal
