// SPDX-License-Identifier: Apache-2.0
// The part of Session::Engine that processes samples and makes the view.
#include "acquisition/src/session_engine.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "acquisition/src/axis_columns.hpp"
#include "acquisition/src/session_view.hpp"
#include "acquisition/src/session_words.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/median.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"

namespace axiscal {

Session::Engine::Engine(SessionSetup setup, Journal& journal)
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

void Session::Engine::set_channels(const std::vector<Channel>& channels,
                                   std::optional<double> time_at_zero) {
  axes_.set_channels(channels);
  raw_.set_channels(channels);
  temperature_columns_ =
      find_temperatures(setup_.experiment.instrument, channels, setup_.temperature_channels);
  time_at_zero_ = time_at_zero;
  if (knowledge_.field_moves()) {
    // Throws an error if the motion of the field cannot be computed.
    static_cast<void>(change_of_field(setup_.experiment, 0.0, 0.0));
    if (!is_utc(time_at_zero_.value_or(0.0))) {
      throw DomainError(setup_.experiment.field.moving_part()->of->moving_name() +
                        " needs times in UTC, but the recording has its own clock: give "
                        "time=COLUMN, with seconds since 1970");
    }
  }
  next_point();
}

void Session::Engine::restore(const std::vector<std::string>& lines, const std::string& path) {
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
  if (!knowledge_.field_moves()) {  // for a moving field, this is done at the first sample
    update_pose_model();
  }
  if (!list_.readings().empty()) {
    news_.tell("resumed",
               formatted("{} readings restored, {} to go", list_.readings().size(), list_.left()));
  }
}

void Session::Engine::add(double time_s, std::span<const double> values) {
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
    interrupt("a value of a sample is missing");
    return;
  }
  const double period = stillness_.rate_hz() > 0.0 ? 1.0 / stillness_.rate_hz() : 0.0;
  if (!is_first && gap > std::max(5.0 * period, setup_.stillness.window_s)) {
    interrupt(formatted("no samples for {} s", number_text(gap, 2)));
    stillness_.restart();
  }
  stillness_.add(time_s, {axes_.values().data(), static_cast<std::size_t>(m_)});
  look_for_defects();
  if (phase_ == SessionPhase::waiting) {
    next_point();
  }
  go_on();
}

void Session::Engine::idle(double seconds) {
  if (samples_ > 0 && phase_ != SessionPhase::review && phase_ != SessionPhase::over) {
    news_.set_silence(seconds, stillness_.rate_hz());
  }
  if (phase_ == SessionPhase::storing) {
    store();
  }
}

void Session::Engine::set_source_alarms(const std::vector<SessionAlarm>& alarms) {
  news_.set_source_alarms(alarms);
}

const SessionView& Session::Engine::view() {
  view_.alarms = news_.alarms();
  view_.present_level = last_ ? std::optional(last_->row.entry.level) : std::nullopt;
  refresh({.phase = phase_,
           .list = list_,
           .wanted = wanted_ ? &wanted_row() : nullptr,
           .present = present_,
           .stillness = stillness_,
           .soak = soak_,
           .has_temperature = !temperature_columns_.empty(),
           .dwell_s = knowledge_.dwell_needed(),
           .dwelt_s = dwell_.seconds(),
           .median_point_s =
               point_seconds_.empty() ? std::nullopt : std::optional(upper_median(point_seconds_)),
           .judgement = judgement_ ? &*judgement_ : nullptr,
           .has_quit = quit_},
          view_);
  return view_;
}

void Session::Engine::find_moving_field() {
  knowledge_.find_field_at(list_.readings().empty() ? shown_time(now_s_)
                                                    : list_.readings().front().start_s);
  update_pose_model();
}

void Session::Engine::update_pose_model() {
  if (const auto suspect = knowledge_.learn(list_.readings())) {
    news_.tell("suspect",
               formatted("compared with the later readings, {} was probably taken at {}: take this "
                         "reading again",
                         run_text(suspect->run), suspect->looks_like.name()),
               suspect->run, suspect->looks_like);
  }
  knowledge_.show(list_.readings(), list_.steps(), view_);
}

double Session::Engine::field_angle_since_last() const {
  return list_.readings().empty()
             ? 0.0
             : knowledge_.field_angle(list_.readings().back().start_s, shown_time(now_s_));
}

double Session::Engine::shown_time(double time_s) const {
  return time_at_zero_.value_or(0.0) + time_s;
}

void Session::Engine::flush_raw() {
  if (raw_.is_empty()) {
    return;
  }
  const std::string why = raw_.flush(journal_);
  if (phase_ != SessionPhase::storing) {
    news_.set_alarm("disk", why);
  }
}

void Session::Engine::take_temperature(std::span<const double> values) {
  if (const std::optional<SensorTemperature> now = temperature_in(values, temperature_columns_)) {
    soak_.add(now_s_, *now);
  }
}

void Session::Engine::look_for_defects() {
  stuck_.look();
  news_.set_alarm("stuck", stuck_.text());
  // The magnitude of a reading of three axes at rest shows whether the unit is as stated.
  const std::optional<std::string> unit =
      axes_.unit_text().empty() ? knowledge_.unit_text(level()) : axes_.unit_text();
  if (unit) {
    news_.set_alarm("unit", *unit);
  }
}

double Session::Engine::level() const {
  const double stated = wanted_ ? std::abs(wanted_row().entry.level.of_all()) : 1.0;
  return stated > 0.0 ? stated : 1.0;
}

void Session::Engine::interrupt(const std::string& why) {
  if (phase_ == SessionPhase::dwelling || phase_ == SessionPhase::settling ||
      phase_ == SessionPhase::ready) {
    phase_ = SessionPhase::laying;
    moved_ = true;
    if (!why.empty()) {
      news_.tell("interrupted", why + ": the reading starts again");
    }
  }
  dwell_.clear();
}

void Session::Engine::remember(const CapturedReading& taken) {
  present_ = taken.row.entry.point;
  last_ = taken;
  moved_ = false;
  soaked_at_ = taken.row.temperature ? taken.row.temperature : soaked_at_;
  stillness_.learn(taken.sd);
  stuck_.learn(taken.sd);
}

}  // namespace axiscal
