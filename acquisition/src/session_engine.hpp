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

/// The phases of a session and the transitions between them. Knowledge, list, news and view are
/// separate classes.
class Session::Engine {
 public:
  Engine(SessionSetup setup, Journal& journal);

  void set_channels(const std::vector<Channel>& channels, std::optional<double> time_at_zero);
  void restore(const std::vector<std::string>& lines, const std::string& path);
  void add(double time_s, std::span<const double> values);
  void idle(double seconds);
  void set_source_alarms(const std::vector<SessionAlarm>& alarms);
  void no_more_samples() { samples_ended_ = true; }
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
  // As it is kept: in UTC, or by the recording's clock.
  [[nodiscard]] double shown_time(double time_s) const;
  // Aborts the current reading.
  void interrupt(const std::string& why);

  // ---- what the readings so far say: session_engine.cpp

  // The cube lies as at this reading until it is moved.
  void remember(const CapturedReading& taken);
  void update_pose_model();
  // The model knows the sun as it stood at the first reading, or stands when the first sample
  // comes.
  void find_moving_field();
  // Largest rotation of the field since the last reading [rad].
  [[nodiscard]] double field_angle_since_last() const;

  // ---- the way of a point: session_points.cpp

  [[nodiscard]] const RunSheetRow& wanted_row() const { return list_.steps()[*wanted_].row; }
  void next_point();
  void go_on();
  void soak();
  [[nodiscard]] bool is_nearest_level(double planned) const;
  // After a question a bump is not a new pose.
  void detect_repositioning();
  void begin_dwell();
  void dwell();
  // It was touched, and lies as it did at the last reading, though another face is wanted below.
  [[nodiscard]] bool lies_as_before() const;
  // Since the last reading.
  [[nodiscard]] bool has_moved() const;
  // The dwell is over: does it look as it should?
  void complete();
  // First to the disk, then to the eye.
  void store();

  // ---- what the person asks for, and the end: session_commands.cpp

  void capture_now();
  void accept_recognised_pose();
  // A copy of the runs: the view's own list of suspects changes on the way.
  void retake(std::vector<int> runs, const std::string& why);
  // A change of the list other than a reading. If the disk is full, the list does not change.
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
  std::optional<std::size_t> wanted_;  // step
  std::optional<DesignPoint> present_;
  std::optional<CapturedReading> last_;  // the reading taken last, dropped since or not
  bool said_as_before_ = false;
  bool moved_ = true;
  double moving_from_s_ = 0.0;  // in a question
  double tried_to_store_s_ = 0.0;
  bool samples_ended_ = false;
  double settled_s_ = 0.0;
  double asked_s_ = 0.0;
  int drift_restarts_ = 0;
  std::optional<CapturedReading> pending_;
  std::optional<PoseJudgement> judgement_;
  std::vector<double> point_seconds_;
  bool quit_ = false;

  std::vector<std::size_t> temperature_columns_;  // none, one, or one for each axis
  SoakWatch soak_;
  bool soaked_ = false;
  std::optional<double> soaked_at_;

  std::optional<DesignPoint> questioned_;  // the reported resemblance of this point
  int retake_rounds_ = 0;
  std::vector<Calibration> calibrations_;

  SessionEventLog news_;
  SessionView view_;
};

}  // namespace axiscal
