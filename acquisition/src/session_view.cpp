// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/session_view.hpp"

#include <algorithm>

#include "acquisition/src/session_words.hpp"

namespace axiscal {
namespace {

// Sets the turns that bring the cube to the requested pose. They are computed only if the present
// or the requested pose has changed, because a view is made many times a second.
void show_the_way(const SessionState& state, SessionView& view) {
  const std::optional<RunSheetRow> wanted =
      state.wanted != nullptr ? std::optional(*state.wanted) : std::nullopt;
  const auto point_of = [](const std::optional<RunSheetRow>& row) {
    return row ? std::optional(row->entry.point) : std::nullopt;
  };
  if (point_of(wanted) != point_of(view.wanted) || state.present != view.present) {
    view.turns.clear();
    if (wanted && state.present) {
      view.turns = fewest_turns(*state.present, wanted->entry.point);
    }
  }
  view.wanted = wanted;
  view.present = state.present;
}

double progress_of(const SessionState& state) {
  switch (state.phase) {
    case SessionPhase::dwelling:
      return std::clamp(state.dwelt_s / state.dwell_s, 0.0, 1.0);
    case SessionPhase::ready:
    case SessionPhase::question:
      return 1.0;
    default:
      return 0.0;
  }
}

}  // namespace

void refresh(const SessionState& state, SessionView& view) {
  view.phase = state.phase;
  view.steps = state.list.steps();
  view.done = state.list.readings().size();
  view.left = state.list.left();
  show_the_way(state, view);
  const Stillness& stillness = state.stillness;
  view.stillness = stillness.is_ready() ? stillness.ratio() / stillness.factor() : 0.0;
  view.rate_hz = stillness.rate_hz();
  view.dwell_s = state.dwell_s;
  view.progress = progress_of(state);
  const Eigen::VectorXd mean = stillness.mean();
  view.reading.assign(mean.data(), mean.data() + mean.size());
  view.temperature = state.soak.temperature();
  view.remaining_s.reset();
  if (state.median_point_s) {
    view.remaining_s = *state.median_point_s * static_cast<double>(view.left);
  }
  const bool doubts = state.phase == SessionPhase::question && state.judgement != nullptr &&
                      state.judgement->looks_like_another;
  view.looks_like = doubts ? std::optional(state.judgement->best) : std::nullopt;
  set_next_step_text(view, {.judgement = state.judgement,
                            .soak_remaining_s = state.soak.state().remaining_s,
                            .has_temperature = state.has_temperature,
                            .has_quit = state.has_quit});
}

}  // namespace axiscal
