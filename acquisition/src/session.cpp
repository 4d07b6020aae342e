// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/session.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include <Eigen/Geometry>

#include "axis_columns.hpp"
#include "axis_intake.hpp"
#include "axiscal/acquisition/pose_model.hpp"
#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/moving_field.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/median.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/field/field_kind.hpp"
#include "dwell_sums.hpp"
#include "expected_response.hpp"
#include "raw_samples.hpp"
#include "reading_list.hpp"
#include "session_end.hpp"
#include "session_words.hpp"
#include "soak_watch.hpp"

namespace axiscal {
namespace {

constexpr double settle_parts = 0.4;       // of the window, left out after it became still
constexpr double first_floor_age_s = 3.0;  // before a first reading the noise floor must stand
constexpr double laying_anew_s = 1.0;      // of motion; less is a bump
constexpr double store_again_s = 0.5;
constexpr double telling_drift = 5.0;  // standard errors
constexpr int most_drift_restarts = 5;
constexpr double stuck_s = 0.8;
constexpr double silent_s = 0.8;
constexpr int most_retake_rounds = 2;

}  // namespace

class Session::Engine {
 public:
  Engine(SessionSetup setup, Journal& journal)
      : setup_(std::move(setup)),
        journal_(journal),
        field_(make_field_description(setup_.experiment)),
        nominal_(expected_sensitivity(setup_.experiment, field_)),
        m_(setup_.experiment.instrument.axis_count()),
        list_(setup_.sheet),
        stillness_(static_cast<std::size_t>(m_), setup_.stillness),
        model_(pose_model_setup()),
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
    if (field_moves(setup_.experiment)) {
      static_cast<void>(turn_of_field(setup_.experiment, 0.0, 0.0));  // whether it can be told
      if (!is_utc(time_at_zero_.value_or(0.0))) {
        throw DomainError(
            "the sun's place needs times in UTC, and the recording's are of its own: state "
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
    if (!field_moves(setup_.experiment)) {  // else with the first sample
      learn_from_readings();
    }
    if (!list_.readings().empty()) {
      event("resumed", std::to_string(list_.readings().size()) + " readings are there, " +
                           std::to_string(list_.left()) + " to go");
    }
  }

  void add(double time_s, std::span<const double> values) {
    const double gap = time_s - now_s_;
    const bool is_first = samples_++ == 0;
    now_s_ = time_s;
    if (is_first && field_moves(setup_.experiment)) {
      find_moving_field();
    }
    set_alarm("silent", "");
    if (setup_.keep_raw && raw_.add(shown_time(time_s), values)) {
      flush_raw();
    }
    take_temperature(values);
    const bool is_good = axes_.take(values);
    set_alarm("saturated", axes_.saturated_text());
    set_alarm("not_a_number", axes_.missing_text());
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
      set_alarm("silent", "no samples for " + number_text(std::floor(10.0 * seconds) / 10.0) +
                              " s: is the instrument still on?");
    }
    if (phase_ == SessionPhase::storing) {
      store();
    }
  }

  void set_source_alarms(const std::vector<SessionAlarm>& alarms) { source_alarms_ = alarms; }

  void no_more_samples() { samples_ended_ = true; }

  void command(const SessionCommand& command) {
    const bool is_way_out = command.action == SessionAction::quit;
    if (is_over()) {
      return;
    }
    if (phase_ == SessionPhase::storing && !is_way_out) {
      event("refused", "a reading is not stored yet: make room on the disk");
      return;
    }
    if (phase_ == SessionPhase::paused && command.action != SessionAction::go_on && !is_way_out) {
      event("refused", "paused: go on first");
      return;
    }
    switch (command.action) {
      case SessionAction::capture:
        capture_now();
        break;
      case SessionAction::accept:
        if (phase_ == SessionPhase::question) {
          insisted_.insert(pending_->run);
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
        event("paused", "paused; nothing is taken");
        break;
      case SessionAction::go_on:
        if (phase_ == SessionPhase::paused) {
          phase_ = before_pause_;
          interrupt("");
          event("resumed", "going on");
        } else if (phase_ == SessionPhase::soaking) {
          soaked_ = true;
        }
        break;
      case SessionAction::finish:
        finish();
        break;
      case SessionAction::toggle_automatic:
        view_.automatic = !view_.automatic;
        event("automatic", view_.automatic ? "readings are taken by themselves"
                                           : "readings are taken on command");
        break;
      case SessionAction::quit:
        quit_ = true;
        flush_raw();
        phase_ = SessionPhase::over;
        event("quit", "stopped; go on with --resume " + journal_.path());
        break;
    }
  }

  [[nodiscard]] bool is_over() const { return phase_ == SessionPhase::over; }
  [[nodiscard]] bool has_quit() const { return quit_; }
  [[nodiscard]] const ReadingList& list() const { return list_; }
  [[nodiscard]] const std::optional<Calibration>& calibration() const { return calibration_; }
  [[nodiscard]] std::vector<SessionEvent> take_events() { return std::exchange(events_, {}); }

  const SessionView& view() {
    view_.phase = phase_;
    view_.steps = list_.steps();
    view_.done = list_.readings().size();
    view_.left = list_.left();
    show_the_way();
    view_.stillness = stillness_.is_ready() ? stillness_.ratio() / stillness_.factor() : 0.0;
    view_.rate_hz = stillness_.rate_hz();
    view_.dwell_s = dwell_needed();
    view_.progress = phase_ == SessionPhase::dwelling
                         ? std::clamp(dwell_.seconds() / view_.dwell_s, 0.0, 1.0)
                     : phase_ == SessionPhase::ready || phase_ == SessionPhase::question ? 1.0
                                                                                         : 0.0;
    const Eigen::VectorXd mean = stillness_.mean();
    view_.reading.assign(mean.data(), mean.data() + mean.size());
    view_.temperature = soak_.temperature();
    view_.alarms = source_alarms_;
    view_.alarms.insert(view_.alarms.end(), alarms_.begin(), alarms_.end());
    view_.remaining_s.reset();
    if (!point_seconds_.empty()) {
      view_.remaining_s = upper_median(point_seconds_) * static_cast<double>(view_.left);
    }
    view_.looks_like = phase_ == SessionPhase::question && judgement_->looks_like_another
                           ? std::optional(judgement_->best)
                           : std::nullopt;
    say_what_to_do(view_, {.judgement = judgement_ ? &*judgement_ : nullptr,
                           .soak_remaining_s = soak_.state().remaining_s,
                           .has_temperature = temperature_column_.has_value(),
                           .has_quit = quit_});
    return view_;
  }

  Observations observations() const {
    Observations result;
    const std::vector<CapturedReading>& readings = list_.readings();
    const auto n = static_cast<Eigen::Index>(readings.size());
    result.response = Eigen::MatrixXd(n, m_);
    result.samples = Eigen::VectorXd(n);
    result.response_sd = Eigen::MatrixXd(n, m_);
    for (Eigen::Index i = 0; i < n; ++i) {
      const CapturedReading& reading = readings[static_cast<std::size_t>(i)];
      result.readings.push_back({.run = reading.run,
                                 .block = reading.row.block,
                                 .point = reading.row.entry.point,
                                 .level = reading.row.entry.level,
                                 .temperature = reading.temperature,
                                 .time_s = 0.5 * (reading.start_s + reading.end_s),
                                 .field_in_sensor = {}});
      result.response.row(i) = reading.mean.transpose();
      result.response_sd->row(i) = reading.sd.transpose();
      (*result.samples)(i) = static_cast<double>(reading.samples);
      result.has_level = result.has_level || reading.row.entry.level != 1.0;
      result.has_block = result.has_block || reading.row.block != readings.front().row.block;
    }
    return result;
  }

 private:
  [[nodiscard]] PoseModelSetup pose_model_setup() const {
    const Experiment& experiment = setup_.experiment;
    return {.instrument = experiment.instrument,
            .field = field_,
            .positioner = experiment.positioner,
            .rotation_sensor_from_positioner = experiment.rotation_sensor_from_positioner,
            .direction_sd_rad = expected_direction_sd(experiment, field_),
            .nominal_sensitivity = nominal_,
            .placement_sd_rad = setup_.placement_sd_rad};
  }

  // The model knows the sun as it stood at the first reading, or stands when the first sample
  // comes.
  void find_moving_field() {
    field_at_s_ = list_.readings().empty() ? shown_time(now_s_) : list_.readings().front().start_s;
    field_ = make_field_description(setup_.experiment, field_at_s_);
    model_ = PoseModel(pose_model_setup());
    learn_from_readings();
  }

  // How far the field may have turned by itself since the last reading [rad].
  [[nodiscard]] double field_angle_since_last() const {
    if (!field_moves(setup_.experiment) || list_.readings().empty()) {
      return 0.0;
    }
    const Eigen::Matrix3d turn =
        turn_of_field(setup_.experiment, list_.readings().back().start_s, shown_time(now_s_));
    return Eigen::AngleAxisd(turn).angle();
  }

  // As it is kept: in UTC, or by the recording's clock.
  [[nodiscard]] double shown_time(double time_s) const {
    return time_at_zero_.value_or(0.0) + time_s;
  }

  // A view is made many times a second, the way to the next pose searched once.
  void show_the_way() {
    const std::optional<RunSheetRow> wanted = wanted_ ? std::optional(wanted_row()) : std::nullopt;
    const auto point_of = [](const std::optional<RunSheetRow>& row) {
      return row ? std::optional(row->entry.point) : std::nullopt;
    };
    if (point_of(wanted) != point_of(view_.wanted) || present_ != view_.present) {
      view_.turns.clear();
      if (wanted && present_) {
        view_.turns = fewest_turns(*present_, wanted->entry.point);
      }
    }
    view_.wanted = wanted;
    view_.present = present_;
  }

  [[nodiscard]] const RunSheetRow& wanted_row() const { return list_.steps()[*wanted_].row; }

  void event(const std::string& kind,
             const std::string& text,
             std::optional<int> run = {},
             std::optional<DesignPoint> point = {}) {
    events_.push_back({.kind = kind, .text = text, .time_s = now_s_, .run = run, .point = point});
  }

  // An empty text ends an alarm.
  void set_alarm(const std::string& code, const std::string& text) {
    const auto found = std::find_if(alarms_.begin(), alarms_.end(),
                                    [&](const SessionAlarm& one) { return one.code == code; });
    if (text.empty()) {
      if (found != alarms_.end()) {
        event("alarm_over", code + ": over");
        alarms_.erase(found);
      }
    } else if (found == alarms_.end()) {
      alarms_.push_back({.code = code, .text = text});
      event("alarm", text);
    } else {
      found->text = text;
    }
  }

  // ---- samples

  void flush_raw() {
    if (raw_.is_empty()) {
      return;
    }
    const std::string why = raw_.flush(journal_);
    if (phase_ != SessionPhase::storing) {
      set_alarm("disk", why);
    }
  }

  void take_temperature(std::span<const double> values) {
    if (!temperature_column_ || !std::isfinite(values[*temperature_column_])) {
      return;
    }
    soak_.add(now_s_, values[*temperature_column_]);
    temperature_sum_ += values[*temperature_column_];
    ++temperature_count_;
  }

  void look_for_defects() {
    const Eigen::VectorXd& floor = stillness_.floor();
    std::vector<std::string> stuck;
    for (std::size_t k = 0; k < static_cast<std::size_t>(m_); ++k) {
      const Stillness::Unchanged same = stillness_.unchanged(k);
      // Noise below the converter's step shows no change for long, and is well.
      if (scattered_.size() > 0 && scattered_[static_cast<Eigen::Index>(k)] &&
          floor(static_cast<Eigen::Index>(k)) > stillness_.step()(static_cast<Eigen::Index>(k)) &&
          same.seconds >= stuck_s && same.samples >= fewest_samples_of_dwell) {
        stuck.push_back(setup_.experiment.instrument.axes[k]);
      }
    }
    set_alarm("stuck", stuck.empty() ? ""
                                     : joined(stuck) +
                                           ": the same value to the last digit for a while; is "
                                           "it stuck, or its converter?");
    is_stuck_ = !stuck.empty();
    look_at_unit();
  }

  // A still reading of all three axes has the field's length, in the unit that it should have.
  void look_at_unit() {
    if (!axes_.unit_text().empty()) {
      set_alarm("unit", axes_.unit_text());
      return;
    }
    if (!nominal_ || m_ != 3 || !stillness_.is_still() || setup_.experiment.instrument.one_sided) {
      return;
    }
    const double ratio =
        stillness_.mean().norm() / (std::abs(*nominal_) * field_.magnitude * level());
    set_alarm("unit", unit_mistake_text(ratio));
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
        event("interrupted", why + ": the reading begins anew");
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
      event("soak", "soak at " + number_text(*planned), {}, wanted_row().entry.point);
    }
    asked_s_ = now_s_;
    event("ask", "next: " + wanted_row().entry.point.name(), {}, wanted_row().entry.point);
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
        if (moved_ && stillness_.is_still() && !axes_.is_saturated() && !is_stuck_) {
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
    temperature_sum_ = 0.0;
    temperature_count_ = 0;
    event("still", "still: taking the reading", {}, wanted_row().entry.point);
  }

  void dwell() {
    if (!stillness_.is_still() || axes_.is_saturated() || is_stuck_) {
      event("knock", axes_.is_saturated() || is_stuck_ ? "the reading is broken off"
                                                       : "a knock: the reading begins anew");
      dwell_.clear();
      phase_ = SessionPhase::laying;
      moved_ = true;
      return;
    }
    dwell_.add(now_s_, axes_.values());
    if (dwell_.seconds() < dwell_needed() - time_rounding_s ||
        dwell_.samples() < fewest_samples_of_dwell) {
      return;
    }
    const bool may_drift = field_moves(setup_.experiment);  // with the sun
    if (!may_drift && dwell_.drift() > telling_drift && drift_restarts_ < most_drift_restarts) {
      ++drift_restarts_;
      event("drift", drift_restarts_ < most_drift_restarts
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
      event("as_before", "it lies as at the last reading: lay it as asked for", {},
            wanted_row().entry.point);
      return;
    }
    if (view_.automatic) {
      complete();
    } else {
      if (phase_ != SessionPhase::ready) {
        event("ready", "ready: take it");
      }
      phase_ = SessionPhase::ready;
    }
  }

  void capture_now() {
    if (phase_ == SessionPhase::soaking) {
      soaked_ = true;
    } else if (phase_ == SessionPhase::question) {
      // Asked for twice, or before the doubt was seen: that is no answer.
      event("refused", "answer first: accept it, or lay it anew");
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
    const double limit = 3.0 * setup_.placement_sd_rad * response_scale() +
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
    if (field_moves(setup_.experiment)) {
      return false;  // another mean may be the sun's doing
    }
    constexpr double clearly = 10.0;
    return ((stillness_.mean() - *last_mean_).array().abs() >
            clearly * stillness_.floor().array() +
                10.0 * setup_.placement_sd_rad * response_scale())
        .any();
  }

  // What the field does to a reading [unit]; 0 where nothing tells.
  double response_scale() const {
    if (nominal_) {
      return std::abs(*nominal_) * field_.magnitude;
    }
    return fit_ ? fit_->response.sensitivity.norm() / std::sqrt(static_cast<double>(m_)) *
                      field_.magnitude
                : 0.0;
  }

  double dwell_needed() const {
    if (setup_.dwell_s) {
      return *setup_.dwell_s;
    }
    const double wanted = setup_.reading_u * response_scale();
    const double rate = stillness_.rate_hz();
    constexpr double otherwise_s = 3.0;
    if (!(wanted > 0.0) || !(rate > 0.0)) {
      return std::clamp(otherwise_s, setup_.shortest_dwell_s, setup_.longest_dwell_s);
    }
    const double samples = std::pow(stillness_.floor().maxCoeff() / wanted, 2.0);
    return std::clamp(samples / rate, setup_.shortest_dwell_s, setup_.longest_dwell_s);
  }

  Eigen::VectorXd u_of(const Eigen::VectorXd& sd, std::size_t samples) const {
    return (sd.cwiseMax(stillness_.floor()) / std::sqrt(static_cast<double>(samples)))
        .cwiseMax(std::numeric_limits<double>::min());
  }

  PlacedReading placed(const CapturedReading& reading) const {
    return {.entry = reading.row.entry,
            .mean = reading.mean,
            .u = u_of(reading.sd, reading.samples),
            .field_turn = turn_of_field(setup_.experiment, field_at_s_, reading.start_s)};
  }

  std::vector<PlacedReading> placed(std::optional<int> without = {}) const {
    std::vector<PlacedReading> result;
    for (const CapturedReading& reading : list_.readings()) {
      if (reading.run != without && !suspects_.contains(reading.run)) {
        result.push_back(placed(reading));
      }
    }
    return result;
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
                            .temperature = {}};
    if (temperature_count_ > 0) {
      reading.temperature = temperature_sum_ / static_cast<double>(temperature_count_);
    }
    pending_ = reading;
    judgement_ = model_.judge(placed(), placed(reading));
    if (judgement_ && (judgement_->looks_like_another || judgement_->fits_none)) {
      // Laid anew and the same again: then the doubt is about a reading before.
      if (questioned_ == judgement_->best) {
        insisted_.insert(reading.run);
        store();
        return;
      }
      questioned_ = judgement_->best;
      phase_ = SessionPhase::question;
      moving_from_s_ = now_s_;
      event("question", question_text(*judgement_, reading.row.entry.point), {},
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
      event("refused", judgement_->best.name() + " is done already: lay it right, or accept it");
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
        event("not_stored", run_text(pending_->run) + " is not stored yet: " + why);
      }
      phase_ = SessionPhase::storing;
      set_alarm("disk", why +
                            ": make room; the reading is kept and tried again, and those "
                            "before it are safe");
      return;
    }
    set_alarm("disk", "");
    list_.apply(entry);
    const CapturedReading taken = *pending_;
    phase_ = SessionPhase::laying;
    point_seconds_.push_back(now_s_ - asked_s_);
    remember(taken);
    event("captured",
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
    scattered_ = scattered_.size() == 0 ? (taken.sd.array() > 0.0).eval()
                                        : (scattered_ || (taken.sd.array() > 0.0)).eval();
  }

  // A change of the list that is no reading; without room on the disk nothing changes.
  bool change(const Json& entry,
              const std::string& kind,
              const std::string& text,
              std::optional<int> run = {}) {
    const std::string why = journal_.append(entry.dump());
    set_alarm("disk", why);
    if (!why.empty()) {
      return false;
    }
    list_.apply(entry);
    event(kind, text, run);
    return true;
  }

  // A copy of the runs: the view's own list of suspects changes on the way.
  void retake(std::vector<int> runs, const std::string& why) {
    bool some = false;
    for (const int run : runs) {
      const CapturedReading* const reading = list_.find(run);
      if (reading == nullptr) {
        event("refused", "there is no run " + std::to_string(run));
        continue;
      }
      const DesignPoint point = reading->row.entry.point;
      some = change(ReadingList::dropped(run, why), why,
                    run_text(run) + " is dropped; its point is asked for again", run) ||
             some;
      suspects_.erase(run);
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
    fit_ = model_.fit(placed());
    view_.slope.reset();
    view_.forecast_deg.reset();
    if (fit_ && list_.readings().size() > 1 && field_kind(field_.kind).vertical) {
      view_.slope = fit_->field_in_table.head<2>() / field_.magnitude;
      view_.slope_u = fit_->slope_u;
    }
    find_suspects();
    view_.suspects.assign(suspects_.begin(), suspects_.end());
    forecast_end();
  }

  // A reading that looks like another pose now that more is known; one at a time.
  void find_suspects() {
    constexpr std::size_t enough = 5;
    if (list_.readings().size() < enough) {
      return;
    }
    std::optional<PoseJudgement> worst;
    int worst_run = 0;
    for (const CapturedReading& reading : list_.readings()) {
      if (suspects_.contains(reading.run) || insisted_.contains(reading.run)) {
        continue;
      }
      const std::optional<PoseJudgement> judgement =
          model_.judge(placed(reading.run), placed(reading));
      if (judgement && judgement->looks_like_another &&
          (!worst || judgement->log_ratio > worst->log_ratio)) {
        worst = judgement;
        worst_run = reading.run;
      }
    }
    if (worst) {
      suspects_.insert(worst_run);
      fit_ = model_.fit(placed());
      event("suspect",
            run_text(worst_run) + " looks like " + worst->best.name() +
                " by what came after it: take it again",
            worst_run, worst->best);
    }
  }

  void forecast_end() {
    if (!fit_ || m_ < 3 || !field_kind(field_.kind).vertical) {
      return;
    }
    double variance = 0.0;
    for (const CapturedReading& reading : list_.readings()) {
      variance += u_of(reading.sd, reading.samples).squaredNorm() / static_cast<double>(m_);
    }
    variance /= static_cast<double>(list_.readings().size());
    Calibration nominal;
    nominal.instrument = setup_.experiment.instrument;
    nominal.field = field_;
    nominal.response = fit_->response;
    view_.forecast_deg = expected_angle_u_deg(
        setup_.experiment, list_.steps(), nominal,
        std::hypot(std::sqrt(variance), setup_.placement_sd_rad * response_scale()));
  }

  // ---- temperature

  void soak() {
    const std::optional<double>& planned = wanted_row().temperature;
    soaked_ = soaked_ || (temperature_column_ && soak_.look() && is_nearest_level(*planned));
    if (soaked_) {
      soaked_at_ = planned;
      phase_ = SessionPhase::laying;
      event("soaked", "soaked: lay the cube", {}, wanted_row().entry.point);
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
      event("refused", "there is no reading yet; quit stops the session");
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
      event("finished", "no point was taken");
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
    const SessionReview result = review_of(calibration_, why_none, list_.readings(), suspects_);
    view_.result = result.lines;
    view_.suspects = result.again;
    event("review", joined(view_.result, "; "));
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
  FieldDescription field_;
  double field_at_s_ = 0.0;  // of a field that moves [s since 1970, UTC]
  std::optional<double> nominal_;
  Eigen::Index m_;
  ReadingList list_;
  Stillness stillness_;
  PoseModel model_;
  DwellSums dwell_;

  AxisIntake axes_;
  RawSamples raw_;
  bool is_stuck_ = false;
  Eigen::Array<bool, Eigen::Dynamic, 1> scattered_;  // axes whose readings did; empty before one
  std::size_t samples_ = 0;
  double now_s_ = 0.0;

  SessionPhase phase_ = SessionPhase::waiting;
  SessionPhase before_pause_ = SessionPhase::waiting;
  std::optional<std::size_t> wanted_;  // step
  std::optional<DesignPoint> present_;
  std::optional<Eigen::VectorXd> last_mean_;  // of the reading that was taken last
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
  double temperature_sum_ = 0.0;  // of the reading that is being taken
  std::size_t temperature_count_ = 0;
  SoakWatch soak_;
  bool soaked_ = false;
  std::optional<double> soaked_at_;

  std::optional<PoseModelFit> fit_;
  std::optional<DesignPoint> questioned_;  // what this point was said to look like
  std::set<int> insisted_;                 // runs that a person says are right
  std::set<int> suspects_;
  int retake_rounds_ = 0;
  std::optional<Calibration> calibration_;

  std::vector<SessionAlarm> alarms_;
  std::vector<SessionAlarm> source_alarms_;
  std::vector<SessionEvent> events_;
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
