// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/session_json.hpp"

#include <cmath>

#include "axiscal/core/number_text.hpp"
#include "core/json_document.hpp"
#include "field/field_json.hpp"

namespace axiscal {
namespace {

Json point_json(const std::optional<DesignPoint>& point) {
  if (!point) {
    return nullptr;
  }
  return {{"rest", face_name(point->rest())}, {"fence", face_name(point->fence())}};
}

Json number_json(const std::optional<double>& number) {
  return number && std::isfinite(*number) ? Json(*number) : Json(nullptr);
}

Json step_json(const SessionStep& step) {
  return {{"rest", face_name(step.row.entry.point.rest())},
          {"fence", face_name(step.row.entry.point.fence())},
          {"block", step.row.block},
          {"level", level_json(step.row.entry.level)},
          {"temperature", number_json(step.row.temperature)},
          {"run", step.run ? Json(*step.run) : Json(nullptr)},
          {"skipped", step.skipped}};
}

Json vector_json(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

// Returns a FreeView as JSON without its points, which are sent separately.
Json free_json(const FreeView& free) {
  Json json = {{"count", free.points.size()},
               {"now", vector_json(free.now)},
               {"centre", vector_json(free.centre)},
               {"to_sphere", Json::array()},
               {"fitted", free.is_fitted},
               {"coverage", free.coverage},
               {"largest_gap_rad", free.largest_gap_rad},
               {"gap", vector_json(free.gap)},
               {"fit_error", number_json(free.fit_error)},
               {"u_deg", number_json(free.u_deg)},
               {"wanted_deg", free.wanted_deg},
               {"enough", free.is_enough},
               {"numbers", Json::array()}};
  for (Eigen::Index i = 0; i < 3; ++i) {
    json["to_sphere"].push_back(vector_json(free.to_sphere.row(i).transpose()));
  }
  for (const auto& [name, value] : free.numbers) {
    json["numbers"].push_back({name, value});
  }
  return json;
}

}  // namespace

std::string view_json(const SessionView& view) {
  Json json = {{"phase", phase_name(view.phase)},
               {"headline", view.headline},
               {"detail", view.detail},
               {"wanted", view.wanted ? point_json(view.wanted->entry.point) : Json(nullptr)},
               {"present", point_json(view.present)},
               {"looks_like", point_json(view.looks_like)},
               {"lies_as_before", view.lies_as_before},
               {"turns", Json::array()},
               {"stillness", number_json(view.stillness)},
               {"progress", view.progress},
               {"dwell", view.dwell_s},
               {"rate", view.rate_hz},
               {"automatic", view.automatic},
               {"reading", view.reading},
               {"temperature", number_json(view.temperature)},
               {"steps", Json::array()},
               {"done", view.done},
               {"left", view.left},
               {"remaining", number_json(view.remaining_s)},
               {"slope", nullptr},
               {"forecast_deg", number_json(view.forecast_deg)},
               {"alarms", Json::array()},
               {"suspects", view.suspects},
               {"actions", Json::array()},
               {"result", view.result},
               {"outcomes", Json::array()}};
  for (const SessionOutcome& outcome : view.outcomes) {
    json["outcomes"].push_back({{"slot", outcome.slot},
                                {"status", outcome.status},
                                {"verdict", outcome.verdict},
                                {"head", outcome.head},
                                {"rows", outcome.rows}});
  }
  if (view.free) {
    json["free"] = free_json(*view.free);
  }
  for (const CubeTurn turn : view.turns) {
    json["turns"].push_back(turn_words(turn));
  }
  for (const SessionStep& step : view.steps) {
    json["steps"].push_back(step_json(step));
  }
  if (view.slope) {
    json["slope"] = {{"x", view.slope->x()},
                     {"y", view.slope->y()},
                     {"u_x", view.slope_u.x()},
                     {"u_y", view.slope_u.y()}};
  }
  for (const SessionAlarm& alarm : view.alarms) {
    json["alarms"].push_back({{"code", alarm.code}, {"text", alarm.text}});
  }
  for (const SessionAction action : possible_actions(view)) {
    json["actions"].push_back(action_name(action));
  }
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string event_json(const SessionEvent& event) {
  Json json = {{"event", event.kind}, {"text", event.text}, {"time", event.time_s}};
  if (event.run) {
    json["run"] = *event.run;
  }
  if (event.point) {
    json["rest"] = face_name(event.point->rest());
    json["fence"] = face_name(event.point->fence());
  }
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::optional<SessionCommand> parse_command(std::string_view text) {
  text = trimmed(text);
  const std::size_t blank = text.find(' ');
  const std::optional<SessionAction> action = parse_action(text.substr(0, blank));
  if (!action) {
    return {};
  }
  SessionCommand command{.action = *action, .run = {}};
  if (blank != std::string_view::npos) {
    command.run = parse_integer(trimmed(text.substr(blank)));
    if (!command.run || *action != SessionAction::retake) {
      return {};
    }
  }
  return command;
}

namespace {

std::vector<SessionAction> free_actions(const SessionView& view) {
  using Action = SessionAction;
  switch (view.phase) {
    case SessionPhase::over:
      return {};
    case SessionPhase::paused:
      return {Action::go_on, Action::quit};
    case SessionPhase::review:
      return view.outcomes.empty() ? std::vector{Action::go_on, Action::quit}
                                   : std::vector{Action::finish, Action::go_on, Action::quit};
    default:
      break;
  }
  std::vector<Action> actions;
  if (view.free->is_enough) {
    actions.push_back(Action::finish);
  }
  if (view.free->takes_rests && !view.free->points.empty()) {
    actions.push_back(Action::undo);
  }
  actions.push_back(Action::pause);
  if (!view.free->is_enough) {
    actions.push_back(Action::finish);
  }
  actions.push_back(Action::quit);
  return actions;
}

}  // namespace

std::vector<SessionAction> possible_actions(const SessionView& view) {
  using Action = SessionAction;
  if (view.free) {
    return free_actions(view);
  }
  switch (view.phase) {
    case SessionPhase::over:
      return {};
    case SessionPhase::paused:
      return {Action::go_on, Action::quit};
    case SessionPhase::question:
      return view.looks_like
                 ? std::vector{Action::accept, Action::as_seen, Action::skip, Action::pause,
                               Action::quit}
                 : std::vector{Action::accept, Action::skip, Action::pause, Action::quit};
    case SessionPhase::review:
      return view.suspects.empty() ? std::vector{Action::finish, Action::replicate, Action::undo,
                                                 Action::retake, Action::quit}
                                   : std::vector{Action::retake_suggested, Action::finish,
                                                 Action::replicate,        Action::undo,
                                                 Action::retake,           Action::quit};
    case SessionPhase::soaking:
      return {Action::go_on, Action::skip, Action::pause, Action::finish, Action::quit};
    default:
      break;
  }
  std::vector<Action> actions;
  if (view.phase == SessionPhase::ready || view.phase == SessionPhase::dwelling ||
      !view.automatic) {
    actions.push_back(Action::capture);
  }
  if (view.done > 0) {
    actions.push_back(Action::undo);
    actions.push_back(Action::retake);
  }
  for (const Action action : {Action::skip, Action::pause, Action::toggle_automatic,
                              Action::replicate, Action::finish, Action::quit}) {
    actions.push_back(action);
  }
  return actions;
}

}  // namespace axiscal
