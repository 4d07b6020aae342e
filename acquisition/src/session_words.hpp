// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/acquisition/pose_model.hpp"
#include "axiscal/acquisition/session.hpp"

namespace axiscal {

/// What a view does not hold and its words need.
struct SaidBesides {
  const PoseJudgement* judgement = nullptr;  ///< what the model makes of the reading in question
  double soak_remaining_s = 0.0;             ///< until the temperature is steady; 0: not known
  bool has_temperature = false;
  bool has_quit = false;
};

/// @return "run 7".
[[nodiscard]] std::string run_text(int run);

/// @return why a reading is in question.
/// @param stated  the point that was asked for.
[[nodiscard]] std::string question_text(const PoseJudgement& judgement, const DesignPoint& stated);

/// Sets a view's headline and detail: what to do now, and how or why.
void say_what_to_do(SessionView& view, const SaidBesides& besides);

}  // namespace axiscal
