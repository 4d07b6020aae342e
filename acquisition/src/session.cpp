// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/session.hpp"

#include <utility>

#include "acquisition/src/session_engine.hpp"

namespace axiscal {

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
void Session::end_of_samples() {
  engine_->end_of_samples();
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
const std::vector<Calibration>& Session::calibrations() const {
  return engine_->calibrations();
}

}  // namespace axiscal
