// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/simulated_source.hpp"

#include <algorithm>
#include <cmath>
#include <thread>

#include "acquisition/src/sample_clock.hpp"
#include "axiscal/acquisition/assembly_session.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/field/settings.hpp"
#include "axiscal/positioner/positioner.hpp"

namespace axiscal {
namespace {

constexpr double reaction_s = 0.8;
constexpr double move_s = 2.0;
constexpr double handling_sd = 0.05;  // sd of the acceleration while the instrument is moved [g]
constexpr double knock_g = 0.02;
// If no reading is taken for this time, the simulated person places the cube again.
constexpr double impatience_s = 300.0;
constexpr std::size_t samples_a_read = 50;

constexpr double turn_s = 1.4;  // duration of a turn in the hand
constexpr double hold_s = 2.6;

Eigen::Vector3d normal_vector(RandomStream& random, double sd) {
  const double x = random.normal();
  const double y = random.normal();
  return sd * Eigen::Vector3d(x, y, random.normal());
}

}  // namespace

SimulatedSource::SimulatedSource(std::string name, const SimulationSetup& setup)
    : name_(std::move(name)),
      setup_(setup),
      random_(setup.seed),
      person_(setup.seed, 1),
      sensitivity_(setup.sensitivity) {
  const std::string unit = setup.sensitivity == 1.0 ? "g" : "V";
  channels_ = {{"time", "s"}, {"x", unit}, {"y", unit}, {"z", unit}};
  if (setup.temperature) {
    channels_.push_back({"temperature", "degC"});
  }
  draw_instrument(setup.sensitivity, Eigen::Matrix3d::Identity());
  field_.kind = "gravity";
  field_.unit = "g";
  field_.in_table = {setup.slope.x(), setup.slope.y(), std::sqrt(1.0 - setup.slope.squaredNorm())};
  in_table_ = TableField(field_.as_parts()).as_stated();
  to_ = Eigen::Quaterniond(Positioner().rotation_table_from_positioner(lies_));
  from_ = to_;
}

void SimulatedSource::draw_instrument(double sensitivity, const SensitivityMatrix& nominal) {
  constexpr double bias_sd = 0.02;  // standard deviation, relative to the effect of the field
  constexpr double misalignment_sd = 0.01;
  const Eigen::Index m = nominal.rows();
  truth_.bias.resize(m);
  truth_.sensitivity = SensitivityMatrix::Zero(m, 3);
  for (Eigen::Index k = 0; k < m; ++k) {
    truth_.bias(k) = sensitivity * field_.magnitude * bias_sd * random_.normal();
  }
  for (Eigen::Index k = 0; k < m; ++k) {
    const bool is_known = !nominal.row(k).isZero(0.0);
    const Eigen::Vector3d axis =
        is_known ? Eigen::Vector3d(nominal.row(k)) : Eigen::Vector3d(Eigen::Vector3d::Unit(k % 3));
    truth_.sensitivity.row(k) =
        sensitivity * (axis + normal_vector(random_, misalignment_sd)).transpose();
  }
}

void SimulatedSource::play(const Experiment& experiment) {
  if (field_moves(experiment)) {
    throw SetupError("a simulation does not know the time of day and therefore cannot simulate " +
                         experiment.field.moving_part()->of->moving_name(),
                     {settings::field});
  }
  const Instrument& instrument = experiment.instrument;
  field_ = make_field_description(experiment);
  random_ = RandomStream(setup_.seed);
  sensitivity_ = setup_.sensitivity != 1.0
                     ? setup_.sensitivity
                     : expected_sensitivity(experiment, field_.unit).value_or(1.0);
  one_sided_ = instrument.one_sided;
  channels_ = {{"time", "s"}};
  for (const std::string& axis : instrument.axes) {
    channels_.push_back({axis, instrument.unit});
  }
  if (setup_.temperature) {
    channels_.push_back({"temperature", "degC"});
  }
  draw_instrument(sensitivity_, nominal_axes(experiment));
  const bool along_normal = field_kind(field_.kind).along_normal;
  if (along_normal && field_.parts.empty()) {
    const Eigen::Vector2d& slope = setup_.slope;
    field_.in_table = field_.magnitude *
                      Eigen::Vector3d(slope.x(), slope.y(), std::sqrt(1.0 - slope.squaredNorm()));
  } else if (!field_.in_table) {
    RandomStream anywhere(setup_.seed, 2);
    field_.in_table = field_.magnitude * normal_vector(anywhere, 1.0).normalized();
  }
  in_table_ = TableField(field_.as_parts()).as_stated();
}

void SimulatedSource::request(const DesignEntry* entry, bool warned) {
  if (entry == nullptr) {
    acts_at_s_ = -1.0;
    return;
  }
  lays_right_ = warned;
  if (warned && !mistakes_.empty() && mistakes_.back().wanted == entry->point) {
    mistakes_.back().was_warned = true;
  }
  wanted_ = *entry;
  acts_at_s_ = time_s_ + reaction_s;
}

void SimulatedSource::start_moving(const DesignPoint& point) {
  moves_from_s_ = time_s_;
  moves_until_s_ = time_s_ + move_s;
  from_ = to_;
  const Eigen::Vector3d turn = normal_vector(random_, setup_.placement_sd_rad);
  const double angle = turn.norm();
  const Eigen::Quaterniond jitter(angle > 0.0 ? Eigen::AngleAxisd(angle, turn / angle)
                                              : Eigen::AngleAxisd(0.0, Eigen::Vector3d::UnitX()));
  to_ = jitter * Eigen::Quaterniond(Positioner().rotation_table_from_positioner(point));
  lies_ = point;
  knock_at_s_ = person_.uniform() < setup_.knock_rate ? moves_until_s_ + 1.5 : -1.0;
}

void SimulatedSource::set_free_motion(bool by_rests) {
  roams_by_rests_ = by_rests;
}

// Turns the instrument to random directions. If readings are taken at rest, holds the instrument
// still between turns.
void SimulatedSource::turn_freely() {
  if (time_s_ < moves_until_s_ + (*roams_by_rests_ ? hold_s : 0.0)) {
    return;
  }
  const auto normal = [this] { return random_.normal(); };
  const double w = normal();
  const double x = normal();
  const double y = normal();
  from_ = to_;
  to_ = Eigen::Quaterniond(w, x, y, normal()).normalized();
  moves_from_s_ = time_s_;
  moves_until_s_ = time_s_ + turn_s;
}

void SimulatedSource::sample(SampleBatch& batch) {
  if (roams_by_rests_) {
    turn_freely();
  }
  if (acts_at_s_ >= 0.0 && time_s_ >= acts_at_s_) {
    acts_at_s_ = time_s_ + impatience_s;
    DesignPoint point = wanted_->point;
    const bool sets_level = level_ != wanted_->level;
    level_ = wanted_->level;
    if (!lays_right_ && person_.uniform() < setup_.error_rate) {
      const std::vector<DesignEntry> all = standard_design(24);
      do {
        point = all[person_.index(all.size())].point;
      } while (point == wanted_->point);
      mistakes_.push_back({.wanted = wanted_->point, .laid = point});
    }
    lays_right_ = true;  // the second attempt is always right
    if (!sets_level || !(point == lies_)) {
      start_moving(point);  // if only the level changes, the cube is not moved
    }
  }
  Eigen::Quaterniond rotation_table_from_positioner = to_;
  Eigen::Vector3d shaking = Eigen::Vector3d::Zero();
  if (time_s_ < moves_until_s_) {
    const double part = (time_s_ - moves_from_s_) / (moves_until_s_ - moves_from_s_);
    rotation_table_from_positioner = from_.slerp(part, to_);
    // The hand accelerates the instrument. A magnetometer, which is turned without being held
    // still, is not affected.
    shaking = normal_vector(random_, roams_by_rests_ && !*roams_by_rests_ ? 0.0 : handling_sd);
  } else if (knock_at_s_ >= 0.0 && time_s_ >= knock_at_s_) {
    shaking = normal_vector(random_, knock_g);
    if (time_s_ > knock_at_s_ + 0.1) {
      knock_at_s_ = -1.0;
    }
  }
  const Eigen::Vector3d field = rotation_table_from_positioner.conjugate() * in_table_.at(level_) +
                                field_.magnitude * shaking;
  Eigen::VectorXd seen = truth_.sensitivity * field;
  if (one_sided_) {
    seen = seen.cwiseMax(0.0);
  }
  batch.time_s.push_back(time_s_);
  batch.values.push_back(time_s_);
  for (Eigen::Index k = 0; k < seen.size(); ++k) {
    batch.values.push_back(truth_.bias(k) + seen(k) +
                           sensitivity_ * field_.magnitude * setup_.noise_sd * random_.normal());
  }
  if (setup_.temperature) {
    batch.values.push_back(*setup_.temperature + 0.01 * random_.normal());
  }
  time_s_ += 1.0 / setup_.rate_hz;
}

SourceReport SimulatedSource::read(SampleBatch& batch, std::chrono::milliseconds patience) {
  std::size_t count = samples_a_read;
  if (is_live()) {
    started_s_ = started_s_ < 0.0 ? session_seconds() : started_s_;
    const double due_s = (session_seconds() - started_s_) * setup_.speed - time_s_;
    if (due_s <= 0.0) {
      std::this_thread::sleep_for(std::min(patience, std::chrono::milliseconds(10)));
      return {};
    }
    // Limits the number of samples in one call, for example after the machine was suspended.
    constexpr double most_at_once = 65536.0;
    count = static_cast<std::size_t>(std::min(due_s * setup_.rate_hz, most_at_once)) + 1;
  }
  for (std::size_t i = 0; i < count; ++i) {
    sample(batch);
  }
  return {.state = LinkState::open, .message = "", .bytes = count};
}

}  // namespace axiscal
