// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "axiscal/acquisition/session.hpp"
#include "axiscal/acquisition/session_face.hpp"
#include "axiscal/acquisition/simulated_source.hpp"
#include "program.hpp"

namespace axiscal::test {

/// A session of an accelerometer in g with the standard twelve points.
[[nodiscard]] SessionSetup guided_setup(std::uint64_t seed = 1, int replicates = 1);

/// Stores all events, and returns the commands of `next`.
class RecordingFace final : public SessionFace {
 public:
  void show(const SessionView& view, const std::vector<SessionEvent>& events) override;
  std::vector<SessionCommand> commands() override;

  [[nodiscard]] std::size_t count(const std::string& kind) const;

  std::vector<SessionEvent> events;
  std::vector<SessionCommand> next;
  std::vector<std::string> alarms;  ///< codes that were shown
};

/// The results of a session with a simulated person.
struct GuidedResult {
  LinearResponse truth;
  std::vector<SimulatedMistake> mistakes;
  Observations observations;
  std::vector<Calibration> calibrations;
  std::vector<SessionEvent> events;
  std::vector<std::string> alarms;
};

/// Runs a whole session unattended.
[[nodiscard]] GuidedResult run_guided(SessionSetup setup,
                                      const SimulationSetup& simulation,
                                      const std::string& journal);

}  // namespace axiscal::test
