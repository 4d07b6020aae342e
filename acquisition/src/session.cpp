// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/session.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "axis_columns.hpp"
#include "axis_intake.hpp"
#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/moving_field.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/median.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "dwell_sums.hpp"
#include "raw_samples.hpp"
#include "reading_list.hpp"
#include "session_end.hpp"
#include "session_knowledge.hpp"
#include "session_news.hpp"
#include "session_view.hpp"
#include "session_words.hpp"
#include "soak_watch.hpp"
#include "stuck_watch.hpp"

namespace axiscal {
namespace {

constexpr double settle_parts = 0.4;  // this part of the window is left out after it became still
constexpr double first_floor_age_s = 3.0;  // before a first reading the noise floor must stand
constexpr double laying_anew_s = 1.0;      // motion that lasts less is a bump
constexpr double store_again_s = 0.5;
constexpr double telling_drift = 5.0;  // standard errors
constexpr int most_drift_restarts = 5;
constexpr double silent_s = 0.8;
constexpr int most_retake_rounds = 2;

}  // namespace

class Session::Engine {
 public:
  Engine(SessionSetup setup, Journal& journal)
      : setup_(std::move(setup)),
        journal_(journal),
        m_(setup_.experiment.instrument.axis_count()),
        list_(setup_.sheet),
        stillness_(static_cast<std::size_t>(m_), setup_.stillness),
        knowledge_(setup_, stillness_),
        stuck_(setup_.experiment.instrument.axes, stillness_),
        dwell_(m_),
        axes_(setup_.experiment.instrument),
        soak_(setup_.soak_window_s, setup_.soak_tolerance) {
    if (setup_.sheet.empty()) {
      throw DomainError("Session: the sheet has no points");
    }
    view_.automatic = setup_.automatic;
  }

  void set_channels(const std::vector<Channel>& channels, std::optional<double> time_at_zero) {
    axes_.set_channels(channels);
    raw_.set_channels(channels);
    temperature_column_ = find_channel(channels, setup_.temperature_channel);
    time_at_zero_ = time_at_zero;
    if (knowledge_.field_moves()) {
      static_cast<void>(turn_of_field(setup_.experiment, 0.0, 0.0));  // whether it can be told
      if (!is_utc(time_at_zero_.value_or(0.0))) {
        throw DomainError(moving_field_name(setup_.experiment) +
                          " needs times in UTC, and the recording's are of its own: state "
                          "time=COLUMN with seconds since 1970");
      }
    }
    next_point();
  }

  void restore(const std::vector<std::string>& lines, const std::string& path) {
    for (std::size_t i = 1; i < lines.size(); ++i) {
      try {
        list_.apply(parse_json(lines[i], path));
      } catch (const DataError& error) {
        throw DataError(path, i + 1, error.what());
      }
    }
    if (!list_.readings().empty()) {
      remember(list_.readings().back());
    }
    if (!knowledge_.field_moves()) {  // else with the first sample
      learn_from_readings();
    }
    if (!list_.readings().empty()) {
      news_.tell("resumed", std::to_string(list_.readings().size()) + " readings are there, " +
                                std::to_string(list_.left()) + " to go");
    }
  }

  void add(double time_s, std::span<const double> values) {
    const double gap = time_s - now_s_;
    const bool is_first = samples_++ == 0;
    now_s_ = time_s;
    news_.set_time(time_s);
    if (is_first && knowledge_.field_moves()) {
      find_moving_field();
    }
    news_.set_alarm("silent", "");
    if (setup_.keep_raw && raw_.add(shown_time(time_s), values)) {
      flush_raw();
    }
    take_temperature(values);
    const bool is_good = axes_.take(values);
    news_.set_alarm("saturated", axes_.saturated_text());
    news_.set_alarm("not_a_number", axes_.missing_text());
    if (!is_good) {
      interrupt("a sample without numbers");
      return;
    }
    const double period = stillness_.rate_hz() > 0.0 ? 1.0 / stillness_.rate_hz() : 0.0;
    if (!is_first && gap > std::max(5.0 * period, setup_.stillness.window_s)) {
      interrupt("no samples for " + number_text(gap, 2) + " s");
      stillness_.restart();
    }
    stillness_.add(time_s, {axes_.values().data(), static_cast<std::size_t>(m_)});
    look_for_defects();
    if (phase_ == SessionPhase::waiting) {
      next_point();
    }
    go_on();
  }

  void idle(double seconds) {
    const double period = stillness_.rate_hz() > 0.0 ? 1.0 / stillness_.rate_hz() : 0.0;
    if (samples_ > 0 && seconds > std::max(silent_s, 5.0 * period) &&
        phase_ != SessionPhase::review && phase_ != SessionPhase::over) {
      news_.set_alarm("silent", "no samples for " + number_text(std::floor(10.0 * seconds) / 10.0) +
                                    " s: is the instrument still on?");
    }
    if (phase_ == SessionPhase::storing) {
      store();
    }
  }

  void set_source_alarms(const std::vector<SessionAlarm>& alarms) {
    news_.set_source_alarms(alarms);
  }

  void no_more_samples() { samples_ended_ = true; }

  void command(const SessionCommand& command) {
    const bool is_way_out = command.action == SessionAction::quit;
    if (is_over()) {
      return;
    }
    if (phase_ == SessionPhase::storing && !is_way_out) {
      news_.tell("refused", "a reading is not stored yet: make room on the disk");
      return;
    }
    if (phase_ == SessionPhase::paused && command.action != SessionAction::go_on && !is_way_out) {
      news_.tell("refused", "paused: go on first");
      return;
    }
    switch (command.action) {
      case SessionAction::capture:
        capture_now();
        break;
      case SessionAction::accept:
        if (phase_ == SessionPhase::question) {
          knowledge_.insist(pending_->run);
          store();
        }
        break;
      case SessionAction::as_seen:
        take_as_seen();
        break;
      case SessionAction::retake:
        retake({command.run.value_or(list_.next_run() - 1)}, "retake");
        break;
      case SessionAction::retake_suggested:
        retake(view_.suspects, "retake");
        break;
      case SessionAction::undo:
        if (!list_.readings().empty()) {
          retake({list_.readings().back().run}, "undo");
        }
        break;
      case SessionAction::skip:
        if (wanted_ &&
            change(ReadingList::skipped(*wanted_), "skipped", wanted_row().entry.point.name())) {
          moved_ = true;
          next_point();
        }
        break;
      case SessionAction::replicate:
        if (change(ReadingList::replicate(), "replicate", "the whole design once more")) {
          next_point();
        }
        break;
      case SessionAction::pause:
        before_pause_ = std::exchange(phase_, SessionPhase::paused);
        news_.tell("paused", "paused; nothing is taken");
        break;
      case SessionAction::go_on:
        if (phase_ == SessionPhase::paused) {
          phase_ = before_pause_;
          interrupt("");
          news_.tell("resumed", "going on");
        } else if (phase_ == SessionPhase::soaking) {
          soaked_ = true;
        }
        break;
      case SessionAction::finish:
        finish();
        break;
      case SessionAction::toggle_automatic:
        view_.automatic = !view_.automatic;
        news_.tell("automatic", view_.automatic ? "readings are taken by themselves"
                                                : "readings are taken on command");
        break;
      case SessionAction::quit:
        quit_ = true;
        flush_raw();
        phase_ = SessionPhase::over;
        news_.tell("quit", "stopped; " + journal_.path() + " can be resumed");
        break;
    }
  }

  [[nodiscard]] bool is_over() const { return phase_ == SessionPhase::over; }
  [[nodiscard]] bool has_quit() const { return quit_; }
  [[nodiscard]] const ReadingList& list() const { return list_; }
  [[nodiscard]] const std::optional<Calibration>& calibration() const { return calibration_; }
  [[nodiscard]] std::vector<SessionEvent> take_events() { return news_.take_events(); }

  const SessionView& view() {
    view_.alarms = news_.alarms();
    refresh({.phase = phase_,
             .list = list_,
             .wanted = wanted_ ? &wanted_row() : nullptr,
             .present = present_,
             .stillness = stillness_,
             .soak = soak_,
             .has_temperature = temperature_column_.has_value(),
             .dwell_s = knowledge_.dwell_needed(),
             .dwelt_s = dwell_.seconds(),
             .median_point_s = point_seconds_.empty() ? std::nullopt
                                                      : std::optional(upper_median(point_seconds_)),
             .judgement = judgement_ ? &*judgement_ : nullptr,
             .has_quit = quit_},
            view_);
    return view_;
  }

  [[nodiscard]] Observations observations() const { return list_.observations(m_); }

 private:
  // The model knows the sun as it stood at the first reading, or stands when the first sample
  // comes.
  void find_moving_field() {
    knowledge_.find_field_at(list_.readings().empty() ? shown_time(now_s_)
                                                      : list_.readings().front().start_s);
    learn_from_readings();
  }

  // How far the field may have turned by itself since the last reading [rad].
  [[nodiscard]] double field_angle_since_last() const {
    return list_.readings().empty()
               ? 0.0
               : knowledge_.field_angle(list_.readings().back().start_s, shown_time(now_s_));
  }

  // As it is kept: in UTC, or by the recording's clock.
  [[nodiscard]] double shown_time(double time_s) const {
    return time_at_zero_.value_or(0.0) + time_s;
  }

  [[nodiscard]] const RunSheetRow& wanted_row() const { return list_.steps()[*wanted_].row; }

  // ---- samples

  void flush_raw() {
    if (raw_.is_empty()) {
      return;
    }
    const std::string why = raw_.flush(journal_);
    if (phase_ != SessionPhase::storing) {
      news_.set_alarm("disk", why);
    }
  }

  void take_temperature(std::span<const double> values) {
    if (!temperature_column_ || !std::isfinite(values[*temperature_column_])) {
      return;
    }
    soak_.add(now_s_, values[*temperature_column_]);
  }

  void look_for_defects() {
    stuck_.look();
    news_.set_alarm("stuck", stuck_.text());
    // A still reading of all three axes has the field's length, in the unit that it should have.
    const std::optional<std::string> unit =
        axes_.unit_text().empty() ? knowledge_.unit_text(level()) : axes_.unit_text();
    if (unit) {
      news_.set_alarm("unit", *unit);
    }
  }

  [[nodiscard]] double level() const {
    const double stated = wanted_ ? std::abs(wanted_row().entry.level) : 1.0;
    return stated > 0.0 ? stated : 1.0;
  }

  // What is being taken is broken off.
  void interrupt(const std::string& why) {
    if (phase_ == SessionPhase::dwelling || phase_ == SessionPhase::settling ||
        phase_ == SessionPhase::ready) {
      phase_ = SessionPhase::laying;
      moved_ = true;
      if (!why.empty()) {
        news_.tell("interrupted", why + ": the reading begins anew");
      }
    }
    dwell_.clear();
  }

  // ---- the way of a point

  void next_point() {
    if (phase_ == SessionPhase::over || phase_ == SessionPhase::paused) {
      return;
    }
    wanted_ = list_.next();
    pending_.reset();
    questioned_.reset();
    view_.lies_as_before = false;
    said_as_before_ = false;
    dwell_.clear();
    drift_restarts_ = 0;
    if (!wanted_ || list_.is_finished()) {
      review();
      return;
    }
    calibration_.reset();
    if (samples_ == 0) {
      phase_ = SessionPhase::waiting;
      return;
    }
    phase_ = SessionPhase::laying;
    const std::optional<double>& planned = wanted_row().temperature;
    if (planned && planned != soaked_at_) {
      phase_ = SessionPhase::soaking;
      soaked_ = false;
      news_.tell("soak", "soak at " + number_text(*planned), {}, wanted_row().entry.point);
    }
    asked_s_ = now_s_;
    news_.tell("ask", "next: " + wanted_row().entry.point.name(), {}, wanted_row().entry.point);
  }

  void go_on() {
    switch (phase_) {
      case SessionPhase::soaking:
        soak();
        break;
      case SessionPhase::laying:
        if (!moved_) {
          moved_ = has_moved();
          view_.lies_as_before = view_.lies_as_before && !moved_;
        }
        if (moved_ && stillness_.is_still() && !axes_.is_saturated() && !stuck_.is_stuck()) {
          phase_ = SessionPhase::settling;
          settled_s_ = now_s_ + settle_parts * setup_.stillness.window_s - time_rounding_s;
        }
        break;
      case SessionPhase::settling:
        if (!stillness_.is_still()) {
          phase_ = SessionPhase::laying;
        } else if (now_s_ >= settled_s_ &&
                   (!list_.readings().empty() ||
                    stillness_.floor_age_s() >= first_floor_age_s - time_rounding_s)) {
          begin_dwell();
        }
        break;
      case SessionPhase::dwelling:
      case SessionPhase::ready:
        dwell();
        break;
      case SessionPhase::question:
        look_for_laying_anew();
        break;
      case SessionPhase::storing:
        if (now_s_ - tried_to_store_s_ > store_again_s) {
          store();
        }
        break;
      default:
        break;
    }
  }

  // After a question: a bump is no new pose.
  void look_for_laying_anew() {
    if (!stillness_.is_ready() || stillness_.is_still()) {
      moving_from_s_ = now_s_;
    } else if (now_s_ - moving_from_s_ > laying_anew_s) {
      pending_.reset();
      phase_ = SessionPhase::laying;
      moved_ = true;
    }
  }

  void begin_dwell() {
    phase_ = SessionPhase::dwelling;
    dwell_.clear();
    soak_.begin_mean();
    news_.tell("still", "still: taking the reading", {}, wanted_row().entry.point);
  }

  void dwell() {
    if (!stillness_.is_still() || axes_.is_saturated() || stuck_.is_stuck()) {
      news_.tell("knock", axes_.is_saturated() || stuck_.is_stuck()
                              ? "the reading is broken off"
                              : "a knock: the reading begins anew");
      dwell_.clear();
      phase_ = SessionPhase::laying;
      moved_ = true;
      return;
    }
    dwell_.add(now_s_, axes_.values());
    if (dwell_.seconds() < knowledge_.dwell_needed() - time_rounding_s ||
        dwell_.samples() < fewest_samples_of_dwell) {
      return;
    }
    const bool may_drift = knowledge_.field_moves();  // with the sun
    if (!may_drift && dwell_.drift() > telling_drift && drift_restarts_ < most_drift_restarts) {
      ++drift_restarts_;
      news_.tell("drift", drift_restarts_ < most_drift_restarts
                              ? "it drifts: the reading begins anew"
                              : "it still drifts: the next reading is taken as it is");
      begin_dwell();
      return;
    }
    if (lies_as_before()) {
      phase_ = SessionPhase::laying;
      moved_ = false;
      view_.lies_as_before = true;
      said_as_before_ = true;  // laid so again, it is meant so
      news_.tell("as_before", "it lies as at the last reading: lay it as asked for", {},
                 wanted_row().entry.point);
      return;
    }
    if (view_.automatic) {
      complete();
    } else {
      if (phase_ != SessionPhase::ready) {
        news_.tell("ready", "ready: take it");
      }
      phase_ = SessionPhase::ready;
    }
  }

  void capture_now() {
    if (phase_ == SessionPhase::soaking) {
      soaked_ = true;
    } else if (phase_ == SessionPhase::question) {
      // Asked for twice, or before the doubt was seen: that is no answer.
      news_.tell("refused", "answer first: accept it, or lay it anew");
    } else if ((phase_ == SessionPhase::dwelling || phase_ == SessionPhase::ready) &&
               dwell_.samples() >= fewest_samples_of_dwell) {
      complete();
    } else if (phase_ == SessionPhase::laying && stillness_.is_still()) {
      moved_ = true;  // the person says that it lies as it should
    }
  }

  // It was touched, and lies as it did at the last reading, though another face is wanted below.
  bool lies_as_before() const {
    if (said_as_before_ || !last_mean_ || last_point_->rest() == wanted_row().entry.point.rest()) {
      return false;
    }
    const Eigen::VectorXd difference = dwell_.mean() - *last_mean_;
    const double limit = 3.0 * setup_.placement_sd_rad * knowledge_.response_scale() +
                         field_angle_since_last() * last_mean_->norm();
    return (difference.array().abs() <= stillness_.floor().array() * stillness_.factor() + limit)
        .all();
  }

  bool has_moved() const {
    if (!last_mean_) {
      return true;
    }
    if (!stillness_.is_still()) {
      return stillness_.is_ready();
    }
    if (knowledge_.field_moves()) {
      return false;  // another mean may be the sun's doing
    }
    constexpr double clearly = 10.0;
    return ((stillness_.mean() - *last_mean_).array().abs() >
            clearly * stillness_.floor().array() +
                10.0 * setup_.placement_sd_rad * knowledge_.response_scale())
        .any();
  }

  // The dwell is over: does it look as it should?
  void complete() {
    CapturedReading reading{.run = list_.next_run(),
                            .step = *wanted_,
                            .row = wanted_row(),
                            .mean = dwell_.mean(),
                            .sd = dwell_.sd(),
                            .samples = dwell_.samples(),
                            .start_s = shown_time(dwell_.start_s()),
                            .end_s = shown_time(dwell_.end_s()),
                            .temperature = soak_.mean()};
    pending_ = reading;
    judgement_ = knowledge_.judge(list_.readings(), reading);
    if (judgement_ && (judgement_->looks_like_another || judgement_->fits_none)) {
      // Laid anew and the same again: then the doubt is about a reading before.
      if (questioned_ == judgement_->best) {
        knowledge_.insist(reading.run);
        store();
        return;
      }
      questioned_ = judgement_->best;
      phase_ = SessionPhase::question;
      moving_from_s_ = now_s_;
      news_.tell("question", question_text(*judgement_, reading.row.entry.point), {},
                 judgement_->looks_like_another ? std::optional(judgement_->best) : std::nullopt);
      present_ = judgement_->looks_like_another ? std::optional(judgement_->best) : std::nullopt;
      return;
    }
    store();
  }

  void take_as_seen() {
    if (phase_ != SessionPhase::question || !judgement_ || !judgement_->looks_like_another) {
      return;
    }
    const std::optional<std::size_t> step = list_.waiting_for(judgement_->best, *wanted_);
    if (!step) {
      news_.tell("refused",
                 judgement_->best.name() + " is done already: lay it right, or accept it");
      return;
    }
    pending_->step = *step;
    pending_->row = list_.steps()[*step].row;
    store();
  }

  // First to the disk, then to the eye.
  void store() {
    tried_to_store_s_ = now_s_;
    flush_raw();
    const Json entry = ReadingList::captured(*pending_);
    const std::string why = journal_.append(entry.dump());
    if (!why.empty()) {
      if (phase_ != SessionPhase::storing) {
        news_.tell("not_stored", run_text(pending_->run) + " is not stored yet: " + why);
      }
      phase_ = SessionPhase::storing;
      news_.set_alarm("disk", why +
                                  ": make room; the reading is kept and tried again, and those "
                                  "before it are safe");
      return;
    }
    news_.set_alarm("disk", "");
    list_.apply(entry);
    const CapturedReading taken = *pending_;
    phase_ = SessionPhase::laying;
    point_seconds_.push_back(now_s_ - asked_s_);
    remember(taken);
    news_.tell("captured",
               run_text(taken.run) + ": " + taken.row.entry.point.name() + ", " +
                   std::to_string(taken.samples) + " samples",
               taken.run, taken.row.entry.point);
    learn_from_readings();
    next_point();
  }

  // The cube lies as at this reading until it is moved.
  void remember(const CapturedReading& taken) {
    present_ = taken.row.entry.point;
    last_mean_ = taken.mean;
    last_point_ = taken.row.entry.point;
    moved_ = false;
    soaked_at_ = taken.row.temperature ? taken.row.temperature : soaked_at_;
    stillness_.learn(taken.sd);
    stuck_.learn(taken.sd);
  }

  // A change of the list that is no reading; without room on the disk nothing changes.
  bool change(const Json& entry,
              const std::string& kind,
              const std::string& text,
              std::optional<int> run = {}) {
    const std::string why = journal_.append(entry.dump());
    news_.set_alarm("disk", why);
    if (!why.empty()) {
      return false;
    }
    list_.apply(entry);
    news_.tell(kind, text, run);
    return true;
  }

  // A copy of the runs: the view's own list of suspects changes on the way.
  void retake(std::vector<int> runs, const std::string& why) {
    bool some = false;
    for (const int run : runs) {
      const CapturedReading* const reading = list_.find(run);
      if (reading == nullptr) {
        news_.tell("refused", "there is no run " + std::to_string(run));
        continue;
      }
      const DesignPoint point = reading->row.entry.point;
      some = change(ReadingList::dropped(run, why), why,
                    run_text(run) + " is dropped; its point is asked for again", run) ||
             some;
      knowledge_.forget(run);
      if (present_ == point && why == "undo") {
        moved_ = false;
      }
    }
    if (some) {
      phase_ = SessionPhase::laying;
      learn_from_readings();
      next_point();
    }
  }

  // ---- what the readings so far say

  void learn_from_readings() {
    if (const auto suspect = knowledge_.learn(list_.readings())) {
      news_.tell("suspect",
                 run_text(suspect->run) + " looks like " + suspect->looks_like.name() +
                     " by what came after it: take it again",
                 suspect->run, suspect->looks_like);
    }
    knowledge_.show(list_.readings(), list_.steps(), view_);
  }

  // ---- temperature

  void soak() {
    const std::optional<double>& planned = wanted_row().temperature;
    soaked_ = soaked_ || (temperature_column_ && soak_.look() && is_nearest_level(*planned));
    if (soaked_) {
      soaked_at_ = planned;
      phase_ = SessionPhase::laying;
      news_.tell("soaked", "soaked: lay the cube", {}, wanted_row().entry.point);
    }
  }

  bool is_nearest_level(double planned) const {
    const double now = soak_.temperature().value();
    return std::none_of(list_.steps().begin(), list_.steps().end(), [&](const SessionStep& step) {
      return step.row.temperature &&
             std::abs(*step.row.temperature - now) < std::abs(planned - now);
    });
  }

  // ---- the end

  void finish() {
    if (phase_ == SessionPhase::review || (list_.is_finished() && !wanted_)) {
      flush_raw();
      if (list_.is_finished() ||
          change(ReadingList::finished(), "finished", "the session is finished")) {
        phase_ = SessionPhase::over;
      }
      return;
    }
    if (list_.readings().empty()) {
      news_.tell("refused", "there is no reading yet; quit stops the session");
      return;
    }
    wanted_.reset();
    pending_.reset();
    review();
  }

  void review() {
    wanted_.reset();
    if (list_.readings().empty()) {
      phase_ = SessionPhase::over;
      news_.tell("finished", "no point was taken");
      return;
    }
    phase_ = SessionPhase::review;
    calibration_.reset();
    std::string why_none;
    try {
      calibration_ = calibrate(setup_.experiment, observations());
    } catch (const Error& error) {
      why_none = error.what();
    }
    const SessionReview result =
        review_of(calibration_, why_none, list_.readings(), knowledge_.suspects());
    view_.result = result.lines;
    view_.suspects = result.again;
    news_.tell("review", joined(view_.result, "; "));
    if (list_.is_finished()) {
      phase_ = SessionPhase::over;
    } else if (setup_.unattended) {
      if (!view_.suspects.empty() && !samples_ended_ && retake_rounds_ < most_retake_rounds) {
        ++retake_rounds_;
        retake(view_.suspects, "retake");
      } else {
        finish();
      }
    }
  }

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
  std::optional<Eigen::VectorXd> last_mean_;  // what the reading taken last said
  std::optional<DesignPoint> last_point_;
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

  std::optional<std::size_t> temperature_column_;
  SoakWatch soak_;
  bool soaked_ = false;
  std::optional<double> soaked_at_;

  std::optional<DesignPoint> questioned_;  // what this point was said to look like
  int retake_rounds_ = 0;
  std::optional<Calibration> calibration_;

  SessionNews news_;
  SessionView view_;
};

Session::Session(SessionSetup setup, Journal& journal)
    : engine_(std::make_unique<Engine>(std::move(setup), journal)) {}
Session::~Session() = default;

void Session::set_channels(const std::vector<Channel>& channels,
                           std::optional<double> time_at_zero) {
  engine_->set_channels(channels, time_at_zero);
}
void Session::restore(const std::vector<std::string>& lines, const std::string& path) {
  engine_->restore(lines, path);
}
void Session::add(double time_s, std::span<const double> values) {
  engine_->add(time_s, values);
}
void Session::idle(double seconds) {
  engine_->idle(seconds);
}
void Session::set_source_alarms(const std::vector<SessionAlarm>& alarms) {
  engine_->set_source_alarms(alarms);
}
void Session::no_more_samples() {
  engine_->no_more_samples();
}
void Session::command(const SessionCommand& command) {
  engine_->command(command);
}
bool Session::is_over() const {
  return engine_->is_over();
}
bool Session::has_quit() const {
  return engine_->has_quit();
}
const SessionView& Session::view() {
  return engine_->view();
}
std::vector<SessionEvent> Session::take_events() {
  return engine_->take_events();
}
Observations Session::observations() const {
  return engine_->observations();
}
const std::vector<CapturedReading>& Session::readings() const {
  return engine_->list().readings();
}
const std::optional<Calibration>& Session::calibration() const {
  return engine_->calibration();
}

}  // namespace axiscal
