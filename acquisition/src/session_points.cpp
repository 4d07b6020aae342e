// SPDX-License-Identifier: Apache-2.0
// The part of Session::Engine that takes a reading: request of the point, placement of the cube,
// settling, averaging, check of the pose, and storage.
#include <algorithm>
#include <cmath>

#include "acquisition/src/session_engine.hpp"
#include "acquisition/src/session_words.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr double settle_parts = 0.4;  // wait after the cube is still, as a fraction of window_s
constexpr double first_floor_age_s = 3.0;  // required Stillness::floor_age_s() at the first reading
// Shortest motion that counts as placing the cube again [s]. A shorter one is a bump.
constexpr double laying_anew_s = 1.0;
constexpr double store_again_s = 0.5;
constexpr double telling_drift = 5.0;  // limit of DwellSums::drift() [standard errors]
constexpr int most_drift_restarts = 5;

}  // namespace

void Session::Engine::next_point() {
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
  calibrations_.clear();
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

void Session::Engine::go_on() {
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
      detect_repositioning();
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

void Session::Engine::soak() {
  const std::optional<double>& planned = wanted_row().temperature;
  soaked_ =
      soaked_ || (!temperature_columns_.empty() && soak_.look() && is_nearest_level(*planned));
  if (soaked_) {
    soaked_at_ = planned;
    phase_ = SessionPhase::laying;
    news_.tell("soaked", "the temperature is reached: lay the cube as requested", {},
               wanted_row().entry.point);
  }
}

bool Session::Engine::is_nearest_level(double planned) const {
  const double now = soak_.temperature().value();
  return std::none_of(list_.steps().begin(), list_.steps().end(), [&](const SessionStep& step) {
    return step.row.temperature && std::abs(*step.row.temperature - now) < std::abs(planned - now);
  });
}

void Session::Engine::detect_repositioning() {
  if (!stillness_.is_ready() || stillness_.is_still()) {
    moving_from_s_ = now_s_;
  } else if (now_s_ - moving_from_s_ > laying_anew_s) {
    pending_.reset();
    phase_ = SessionPhase::laying;
    moved_ = true;
  }
}

void Session::Engine::begin_dwell() {
  phase_ = SessionPhase::dwelling;
  dwell_.clear();
  soak_.begin_mean();
  news_.tell("still", "the cube is still: the reading is being taken", {},
             wanted_row().entry.point);
}

void Session::Engine::dwell() {
  if (!stillness_.is_still() || axes_.is_saturated() || stuck_.is_stuck()) {
    news_.tell("knock", axes_.is_saturated() || stuck_.is_stuck()
                            ? "the reading was aborted"
                            : "the cube was knocked: the reading starts again");
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
  const bool may_drift = knowledge_.field_moves();  // a moving field makes the reading drift
  if (!may_drift && dwell_.drift() > telling_drift && drift_restarts_ < most_drift_restarts) {
    ++drift_restarts_;
    news_.tell("drift",
               drift_restarts_ < most_drift_restarts
                   ? "the value drifts: the reading starts again"
                   : "the value drifts again: the next reading is taken even if the value drifts");
    begin_dwell();
    return;
  }
  if (lies_as_before()) {
    phase_ = SessionPhase::laying;
    moved_ = false;
    view_.lies_as_before = true;
    said_as_before_ = true;  // the next reading is taken even if it equals the last one
    news_.tell("as_before", "the cube lies as it did at the last reading: lay it as requested", {},
               wanted_row().entry.point);
    return;
  }
  if (view_.automatic) {
    complete();
  } else {
    if (phase_ != SessionPhase::ready) {
      news_.tell("ready", "ready: take the reading");
    }
    phase_ = SessionPhase::ready;
  }
}

bool Session::Engine::lies_as_before() const {
  if (said_as_before_ || !last_ ||
      !knowledge_.is_distinguishable_from(*last_, wanted_row().entry, shown_time(now_s_))) {
    return false;
  }
  const Eigen::VectorXd difference = dwell_.mean() - last_->mean;
  const double limit = 3.0 * setup_.placement_sd_rad * knowledge_.response_scale() +
                       field_angle_since_last() * last_->mean.norm();
  return (difference.array().abs() <= stillness_.floor().array() * stillness_.factor() + limit)
      .all();
}

bool Session::Engine::has_moved() const {
  if (!last_) {
    return true;
  }
  if (!stillness_.is_still()) {
    return stillness_.is_ready();
  }
  if (knowledge_.field_moves()) {
    return false;  // the motion of the field changes the mean too
  }
  constexpr double clearly = 10.0;
  return ((stillness_.mean() - last_->mean).array().abs() >
          clearly * stillness_.floor().array() +
              10.0 * setup_.placement_sd_rad * knowledge_.response_scale())
      .any();
}

void Session::Engine::complete() {
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
    // The cube was placed again with the same result, so an earlier reading is probably wrong.
    if (questioned_ == judgement_->best) {
      knowledge_.accept_run(reading.run);
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

void Session::Engine::store() {
  tried_to_store_s_ = now_s_;
  flush_raw();
  const Json entry = ReadingList::captured(*pending_);
  const std::string why = journal_.append(entry.dump());
  if (!why.empty()) {
    if (phase_ != SessionPhase::storing) {
      news_.tell("not_stored", formatted("{} is not stored yet: {}", run_text(pending_->run), why));
    }
    phase_ = SessionPhase::storing;
    news_.set_alarm("disk", why +
                                ": free some space on the disk; this reading is then stored (the "
                                "earlier readings are already stored)");
    return;
  }
  news_.set_alarm("disk", "");
  list_.apply(entry);
  const CapturedReading taken = *pending_;
  phase_ = SessionPhase::laying;
  point_seconds_.push_back(now_s_ - asked_s_);
  remember(taken);
  news_.tell("captured",
             formatted("{}: {}, {} samples", run_text(taken.run), taken.row.entry.point.name(),
                       taken.samples),
             taken.run, taken.row.entry.point);
  update_pose_model();
  next_point();
}

}  // namespace axiscal
