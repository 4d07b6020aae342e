// SPDX-License-Identifier: Apache-2.0
#include "guided.hpp"

#include <algorithm>

#include "axiscal/acquisition/sample_feed.hpp"

namespace axiscal::test {

SessionSetup guided_setup(std::uint64_t seed, int replicates) {
  SessionSetup setup;
  setup.experiment.instrument = {.kind = "accelerometer", .unit = "g"};
  setup.experiment.field.of = make_field("gravity");
  setup.sheet = make_run_sheet(standard_design(12), replicates, seed);
  setup.unattended = true;
  return setup;
}

void RecordingFace::show(const SessionView& view, const std::vector<SessionEvent>& happened) {
  events.insert(events.end(), happened.begin(), happened.end());
  for (const SessionAlarm& alarm : view.alarms) {
    if (std::find(alarms.begin(), alarms.end(), alarm.code) == alarms.end()) {
      alarms.push_back(alarm.code);
    }
  }
}

std::vector<SessionCommand> RecordingFace::commands() {
  constexpr std::size_t far_too_many = 2000;  // more events than this mean an endless loop
  if (events.size() > far_too_many) {
    next = {{.action = SessionAction::quit, .run = {}}};
  }
  return std::exchange(next, {});
}

std::size_t RecordingFace::count(const std::string& kind) const {
  return static_cast<std::size_t>(std::count_if(
      events.begin(), events.end(), [&](const SessionEvent& event) { return event.kind == kind; }));
}

GuidedResult run_guided(SessionSetup setup,
                        const SimulationSetup& simulation,
                        const std::string& path) {
  Journal journal = Journal::create(path);
  auto source = std::make_unique<SimulatedSource>("sim:", simulation);
  source->play(setup.experiment);
  Session session(std::move(setup), journal);
  SimulatedSource& simulated = *source;
  std::vector<std::unique_ptr<Source>> sources;
  sources.push_back(std::move(source));
  SampleFeed feed(std::move(sources));
  RecordingFace face;
  run_session(session, feed, {&face}, true);
  return {.truth = simulated.truth(),
          .mistakes = simulated.mistakes(),
          .observations = session.observations(),
          .calibrations = session.calibrations(),
          .events = face.events,
          .alarms = face.alarms};
}

}  // namespace axiscal::test
