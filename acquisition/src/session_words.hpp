// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/acquisition/pose_model.hpp"
#include "axiscal/acquisition/session.hpp"

namespace axiscal {

/// The inputs of set_next_step_text() that a view does not contain.
struct MessageContext {
  const PoseJudgement* judgement = nullptr;  ///< the model's judgement of the doubtful reading
  double soak_remaining_s = 0.0;             ///< time until temperature is steady [s]; 0: unknown
  bool has_temperature = false;
  bool has_quit = false;
};

/// @return the name of a run for messages, for example "run 7".
[[nodiscard]] std::string run_text(int run);

/// @return the question to the person about a doubtful reading.
/// @param stated  the requested point.
[[nodiscard]] std::string question_text(const PoseJudgement& judgement, const DesignPoint& stated);

/// Sets a view's headline and detail: the instruction and its reason.
void set_next_step_text(SessionView& view, const MessageContext& besides);

}  // namespace axiscal
