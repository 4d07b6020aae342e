// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "acquisition/src/reading_list.hpp"
#include "acquisition/src/soak_watch.hpp"
#include "axiscal/acquisition/pose_model.hpp"
#include "axiscal/acquisition/session.hpp"
#include "axiscal/acquisition/stillness.hpp"

namespace axiscal {

/// The inputs of a session's view.
struct SessionState {
  SessionPhase phase;
  const ReadingList& list;
  const RunSheetRow* wanted;  ///< the requested point; null without a request
  std::optional<DesignPoint> present;
  const Stillness& stillness;
  const SoakWatch& soak;
  bool has_temperature;
  double dwell_s;                        ///< required duration of the reading
  double dwelt_s;                        ///< duration of the current reading so far
  std::optional<double> median_point_s;  ///< median time per point so far [s]
  const PoseJudgement* judgement;
  bool has_quit;
};

/// Sets the parts of a view that follow from the state. SessionKnowledge::show() sets other parts.
void refresh(const SessionState& state, SessionView& view);

}  // namespace axiscal
