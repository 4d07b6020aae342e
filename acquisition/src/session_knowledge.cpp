// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/session_knowledge.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include <Eigen/Geometry>

#include "acquisition/src/expected_response.hpp"
#include "acquisition/src/session_end.hpp"
#include "axiscal/acquisition/assembly_session.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/field/field_kind.hpp"

namespace axiscal {

SessionKnowledge::SessionKnowledge(const SessionSetup& setup, const Stillness& stillness)
    : setup_(setup),
      stillness_(stillness),
      field_(make_field_description(setup.experiment)),
      nominal_(expected_sensitivity(setup.experiment, field_.unit)),
      model_(pose_model_setup()) {}

PoseModelSetup SessionKnowledge::pose_model_setup() const {
  const Experiment& experiment = setup_.experiment;
  return {.instrument = experiment.instrument,
          .nominal_axes = nominal_axes(experiment),
          .field = field_,
          .positioner = experiment.positioner,
          .rotation_sensor_from_positioner = experiment.rotation_sensor_from_positioner,
          .direction_sd_rad = expected_direction_sd(experiment, field_),
          .nominal_sensitivity = nominal_,
          .placement_sd_rad = setup_.placement_sd_rad};
}

bool SessionKnowledge::field_moves() const {
  return axiscal::field_moves(setup_.experiment);
}

void SessionKnowledge::find_field_at(double time_s) {
  field_at_s_ = time_s;
  field_ = make_field_description(setup_.experiment, field_at_s_);
  model_ = PoseModel(pose_model_setup());
}

double SessionKnowledge::field_angle(double from_s, double to_s) const {
  if (!field_moves()) {
    return 0.0;
  }
  const Eigen::Matrix3d change = change_of_field(setup_.experiment, from_s, to_s);
  const Eigen::Matrix3d turn = change / std::cbrt(change.determinant());
  return Eigen::AngleAxisd(turn).angle();
}

double SessionKnowledge::response_scale() const {
  if (nominal_) {
    return std::abs(*nominal_) * field_.magnitude;
  }
  const auto m = static_cast<double>(setup_.experiment.instrument.axis_count());
  return fits_.empty()
             ? 0.0
             : fits_.front().response.sensitivity.norm() / std::sqrt(m) * field_.magnitude;
}

double SessionKnowledge::dwell_needed() const {
  if (setup_.dwell_s) {
    return *setup_.dwell_s;
  }
  const double wanted = setup_.reading_u * response_scale();
  const double rate = stillness_.rate_hz();
  constexpr double otherwise_s = 3.0;
  if (!(wanted > 0.0) || !(rate > 0.0)) {
    return std::clamp(otherwise_s, setup_.shortest_dwell_s, setup_.longest_dwell_s);
  }
  const double samples = std::pow(stillness_.floor().maxCoeff() / wanted, 2.0);
  return std::clamp(samples / rate, setup_.shortest_dwell_s, setup_.longest_dwell_s);
}

std::optional<std::string> SessionKnowledge::unit_text(double level) const {
  const Instrument& instrument = setup_.experiment.instrument;
  if (!nominal_ || instrument.axis_count() != 3 || !stillness_.is_still() || instrument.one_sided) {
    return std::nullopt;
  }
  return unit_mistake_text(stillness_.mean().norm() /
                           (std::abs(*nominal_) * field_.magnitude * level));
}

Eigen::VectorXd SessionKnowledge::u_of(const CapturedReading& reading) const {
  return (reading.sd.cwiseMax(stillness_.floor()) / std::sqrt(static_cast<double>(reading.samples)))
      .cwiseMax(std::numeric_limits<double>::min());
}

PlacedReading SessionKnowledge::placed(const CapturedReading& reading) const {
  return {.entry = reading.row.entry,
          .mean = reading.mean,
          .u = u_of(reading),
          .field_turn = change_of_field(setup_.experiment, field_at_s_, reading.start_s)};
}

// Returns the latest 36 readings, which are three blocks of 12. Earlier readings are left out,
// because the instrument may have drifted since, and because fits to many readings take too long.
std::vector<CapturedReading> SessionKnowledge::latest(
    const std::vector<CapturedReading>& readings) {
  constexpr std::size_t most = 36;
  if (readings.size() <= most) {
    return readings;
  }
  std::vector<double> starts;
  for (const CapturedReading& reading : readings) {
    starts.push_back(reading.start_s);
  }
  const auto first = starts.end() - static_cast<std::ptrdiff_t>(most);
  std::nth_element(starts.begin(), first, starts.end());
  std::vector<CapturedReading> result;
  std::copy_if(readings.begin(), readings.end(), std::back_inserter(result),
               [&](const CapturedReading& reading) { return reading.start_s >= *first; });
  return result;
}

std::vector<PlacedReading> SessionKnowledge::placed(const std::vector<CapturedReading>& readings,
                                                    std::optional<int> without) const {
  std::vector<PlacedReading> result;
  for (const CapturedReading& reading : readings) {
    if (reading.run != without && !suspects_.contains(reading.run)) {
      result.push_back(placed(reading));
    }
  }
  return result;
}

bool SessionKnowledge::is_distinguishable_from(const CapturedReading& reading,
                                               const DesignEntry& entry,
                                               double now_s) const {
  constexpr double clearly = 0.5;  // smallest result of least_contrast() for distinct readings
  const PlacedReading other = {
      .entry = entry,
      .mean = {},
      .u = {},
      .field_turn = change_of_field(setup_.experiment, field_at_s_, now_s)};
  return model_.least_contrast(placed(reading), other, fits_) > clearly;
}

std::optional<PoseJudgement> SessionKnowledge::judge(const std::vector<CapturedReading>& readings,
                                                     const CapturedReading& reading) const {
  return model_.judge(placed(latest(readings)), placed(reading));
}

std::optional<SessionKnowledge::Suspect> SessionKnowledge::learn(
    const std::vector<CapturedReading>& all) {
  const std::vector<CapturedReading> readings = latest(all);
  fits_ = model_.fits(placed(readings));
  constexpr std::size_t enough = 5;
  if (readings.size() < enough) {
    return std::nullopt;
  }
  std::optional<PoseJudgement> worst;  // each call reports only the worst reading
  int worst_run = 0;
  for (const CapturedReading& reading : readings) {
    if (suspects_.contains(reading.run) || insisted_.contains(reading.run)) {
      continue;
    }
    const std::optional<PoseJudgement> judgement =
        model_.judge(placed(readings, reading.run), placed(reading));
    if (judgement && judgement->looks_like_another &&
        (!worst || judgement->log_ratio > worst->log_ratio)) {
      worst = judgement;
      worst_run = reading.run;
    }
  }
  if (!worst) {
    return std::nullopt;
  }
  suspects_.insert(worst_run);
  fits_ = model_.fits(placed(readings));
  return Suspect{.run = worst_run, .looks_like = worst->best};
}

std::optional<double> SessionKnowledge::expected_u_deg(
    const std::vector<CapturedReading>& readings, const std::vector<SessionStep>& steps) const {
  const auto m = static_cast<double>(setup_.experiment.instrument.axis_count());
  if (fits_.empty() || m < 3.0 || !field_kind(field_.kind).vertical) {
    return std::nullopt;
  }
  double variance = 0.0;
  for (const CapturedReading& reading : readings) {
    variance += u_of(reading).squaredNorm() / m;
  }
  variance /= static_cast<double>(readings.size());
  SensorModel nominal;
  nominal.instrument = setup_.experiment.instrument;
  nominal.field = field_;
  nominal.response = fits_.front().response;
  return expected_angle_u_deg(
      setup_.experiment, steps, nominal,
      std::hypot(std::sqrt(variance), setup_.placement_sd_rad * response_scale()));
}

void SessionKnowledge::show(const std::vector<CapturedReading>& readings,
                            const std::vector<SessionStep>& steps,
                            SessionView& view) const {
  view.suspects.assign(suspects_.begin(), suspects_.end());
  view.slope.reset();
  if (!fits_.empty() && readings.size() > 1 && field_kind(field_.kind).vertical) {
    view.slope = fits_.front().field_in_table.head<2>() / field_.magnitude;
    view.slope_u = fits_.front().slope_u;
  }
  view.forecast_deg = expected_u_deg(readings, steps);
}

}  // namespace axiscal
