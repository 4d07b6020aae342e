// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/reading_source.hpp"

#include <algorithm>
#include <limits>
#include <set>

#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/settings.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"

namespace axiscal {
namespace {

// Standard deviations to weigh by. A few samples that are all alike have 0, which says no more than
// that they are few: the axis's middle one stands for it.
Eigen::MatrixXd positive_sd(Eigen::MatrixXd sd) {
  if (!(sd.array() >= 0.0).all()) {
    throw RefusedError("weights sd: a standard deviation in a column AXIS_sd is negative");
  }
  for (Eigen::Index k = 0; k < sd.cols(); ++k) {
    std::vector<double> positive;
    std::copy_if(sd.col(k).begin(), sd.col(k).end(), std::back_inserter(positive),
                 [](double one) { return one > 0.0; });
    if (positive.empty()) {
      throw RefusedError("weights sd: all standard deviations of an axis are 0");
    }
    const auto middle = positive.begin() + static_cast<std::ptrdiff_t>(positive.size() / 2);
    std::nth_element(positive.begin(), middle, positive.end());
    sd.col(k) = (sd.col(k).array() > 0.0).select(sd.col(k), *middle).eval();
  }
  return sd;
}

Eigen::MatrixXd weights_of(const Observations& observations, Weighting weighting) {
  const Eigen::Index n = observations.size();
  const Eigen::Index m = observations.response.cols();
  if (weighting == Weighting::samples) {
    if (!observations.samples) {
      throw RefusedError("weights samples: the readings have no column 'samples'");
    }
    return observations.samples->replicate(1, m);
  }
  if (weighting == Weighting::sd) {
    if (!observations.response_sd) {
      throw RefusedError("weights sd: each axis needs a column AXIS_sd");
    }
    return positive_sd(*observations.response_sd).cwiseAbs2().cwiseInverse();
  }
  return Eigen::MatrixXd::Ones(n, m);
}

}  // namespace

ReadingSource::ReadingSource(const Experiment& experiment,
                             const Observations& observations,
                             Weighting weighting,
                             bool by_field)
    : experiment_(experiment),
      observations_(observations),
      by_field_(by_field),
      weights_(weights_of(observations, weighting)) {
  find_range();
  find_rows();
  find_mean_time();
  find_also();
  if (experiment.level_by == LevelBy::block) {
    std::set<int> blocks;
    for (const std::size_t row : rows_) {
      blocks.insert(observations.readings[row].block);
    }
    blocks_.assign(blocks.begin(), blocks.end());
  }
}

void ReadingSource::find_also() {
  for (const FieldSetup& also : experiment_.also) {
    also_.push_back(
        resolve_part(also, experiment_.table, {.reading_unit = experiment_.instrument.unit}));
    if (!also_.back().in_table) {
      throw SetupError(
          formatted("also {}: where it points in the table must be known; give the site and the "
                    "fence's azimuth, or its in_table",
                    also_.back().kind));
    }
  }
}

void ReadingSource::find_rows() {
  const std::vector<int>& leave_out = experiment_.leave_out;
  for (const int run : leave_out) {
    const bool there = std::any_of(observations_.readings.begin(), observations_.readings.end(),
                                   [run](const Reading& reading) { return reading.run == run; });
    if (!there) {
      throw SetupError(formatted("there is no run {} to leave out", run), {settings::leave_out});
    }
  }
  for (std::size_t i = 0; i < observations_.readings.size(); ++i) {
    const Reading& reading = observations_.readings[i];
    if (std::find(leave_out.begin(), leave_out.end(), reading.run) == leave_out.end()) {
      (reading.confirm ? rows_kept_out_ : rows_).push_back(i);
    }
  }
  if (rows_.empty()) {
    throw RefusedError(rows_kept_out_.empty()
                           ? "no readings are left to calibrate with"
                           : "all readings are kept out of the fit (confirm): none is left for it");
  }
}

void ReadingSource::find_range() {
  in_range_ = AxisMask::Constant(observations_.size(), observations_.response.cols(), true);
  if (observations_.saturated) {
    in_range_ = !*observations_.saturated;
  }
  const Instrument& instrument = experiment_.instrument;
  for (Eigen::Index k = 0; instrument.range && k < in_range_.cols(); ++k) {
    const std::string& axis = instrument.axes[static_cast<std::size_t>(k)];
    const bool is_difference =
        std::any_of(instrument.differences.begin(), instrument.differences.end(),
                    [&](const DifferentialAxis& difference) { return difference.axis == axis; });
    if (!is_difference) {  // whose columns were looked at when they were read
      in_range_.col(k) = in_range_.col(k) &&
                         observations_.response.col(k).array() > instrument.range->low &&
                         observations_.response.col(k).array() < instrument.range->high;
    }
  }
}

void ReadingSource::find_mean_time() {
  if (!field_moves(experiment_) || by_field_) {
    return;
  }
  double sum = 0.0;
  for (const std::size_t row : rows_) {
    const Reading& reading = observations_.readings[row];
    if (!reading.time_s) {
      return;  // the date of the experiment, if it has a time, counts for all
    }
    if (experiment_.field.moving_part()->of->needs_utc() && !is_utc(*reading.time_s)) {
      throw RefusedError(
          formatted("run {}: {} needs the column 'time' as UTC (ISO 8601, or seconds since 1970), "
                    "not as seconds of the recording",
                    reading.run, experiment_.field.moving_part()->of->moving_name()));
    }
    sum += *reading.time_s / static_cast<double>(rows_.size());
  }
  static_cast<void>(change_of_field(experiment_, sum, sum));  // whether it can be told
  mean_time_s_ = sum;
}

void ReadingSource::keep_complete_rows() {
  std::vector<std::size_t> kept;
  std::copy_if(rows_.begin(), rows_.end(), std::back_inserter(kept), [&](std::size_t row) {
    return in_range_.row(static_cast<Eigen::Index>(row)).all();
  });
  rows_ = std::move(kept);
  if (rows_.empty()) {
    throw RefusedError("every reading is out of the instrument's range on some axis");
  }
}

void ReadingSource::turn_mounts(const std::map<int, Eigen::Matrix3d>& turns) {
  if (turns.empty()) {
    mount_turns_.clear();
  }
  for (const auto& [mount, turn] : turns) {
    const auto found = mount_turns_.find(mount);
    mount_turns_[mount] =
        found != mount_turns_.end() ? Eigen::Matrix3d(turn * found->second) : turn;
  }
}

Eigen::Matrix3d ReadingSource::rotation(const Reading& reading) const {
  Eigen::Matrix3d R =
      experiment_.rotation_sensor_from_positioner *
      experiment_.positioner.rotation_table_from_positioner(*reading.point).transpose();
  const auto turn = mount_turns_.find(reading.mount);
  if (turn != mount_turns_.end()) {
    R = turn->second * R;
  }
  return R;
}

Eigen::Matrix3d ReadingSource::field_then(const Reading& reading) const {
  return mean_time_s_
             ? change_of_field(experiment_, *mean_time_s_, reading.time_s.value_or(*mean_time_s_))
             : Eigen::Matrix3d::Identity();
}

void ReadingSource::set_temperature(int order, std::optional<double> reference) {
  temperature_order_ = order;
  const bool own = std::any_of(rows_.begin(), rows_.end(), [&](std::size_t row) {
    return observations_.readings[row].temperature->has_own();
  });
  spans_.clear();
  for (Eigen::Index k = 0; k < (own ? observations_.response.cols() : 1); ++k) {
    TemperatureSpan span{.low = std::numeric_limits<double>::infinity(),
                         .high = -std::numeric_limits<double>::infinity()};
    double sum = 0.0;
    for (const std::size_t row : rows_) {
      const double t = observations_.readings[row].temperature->of(k);
      sum += t;
      span.low = std::min(span.low, t);
      span.high = std::max(span.high, t);
    }
    span.reference = reference.value_or(sum / static_cast<double>(rows_.size()));
    spans_.push_back(span);
  }
}

bool ReadingSource::set_effects(EffectSetup effects) {
  effects.blocks = effects.blocks && temperature_order_ == 0;
  const bool changes = effects != effects_;
  effects_ = effects;
  return changes;
}

// Readings, responses and how the instrument lay in them; the weights are those of the
// observations.
void ReadingSource::put_readings(const std::vector<std::size_t>& rows, ReadingSet& set) const {
  const auto n = static_cast<Eigen::Index>(rows.size());
  set.response.resize(n, observations_.response.cols());
  set.weights.resize(n, observations_.response.cols());
  set.readings.reserve(rows.size());
  set.rotation_sensor_from_table.reserve(by_field_ ? 0 : rows.size());
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::size_t row = rows[static_cast<std::size_t>(i)];
    const auto from = static_cast<Eigen::Index>(row);
    const Reading& reading = observations_.readings[row];
    set.readings.push_back(reading);
    if (!set.field.is_sum()) {  // its one part's level is that of all
      set.readings.back().level = reading.level.of(set.field.parts().front().level_name());
    }
    set.response.row(i) = observations_.response.row(from);
    for (Eigen::Index k = 0; k < set.weights.cols(); ++k) {
      set.weights(i, k) = in_range_(from, k) ? weights_(from, k) : 0.0;
    }
    if (!by_field_ && reading.point) {
      set.rotation_sensor_from_table.push_back(rotation(reading));
      if (mean_time_s_) {
        set.field_then.push_back(field_then(reading));
      }
    }
  }
}

void ReadingSource::put_temperature(ReadingSet& set) const {
  if (temperature_order_ == 0) {
    return;
  }
  set.temperature.order = temperature_order_;
  set.temperature.d.resize(set.size(), set.axis_count());
  std::vector<double> temperatures;
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const Reading& reading = set.readings[static_cast<std::size_t>(i)];
    if (!reading.temperature) {
      throw RefusedError(formatted(
          "temperature terms need the column 'temperature'; run {} has none", reading.run));
    }
    const SensorTemperature& t = *reading.temperature;
    temperatures.push_back(t.mean());
    for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
      const TemperatureSpan& span = spans_[spans_.size() == 1 ? 0 : static_cast<std::size_t>(k)];
      set.temperature.d(i, k) = t.of(k) - span.reference;
    }
  }
  set.temperature.soak = soak_levels(temperatures);
}

ReadingSet ReadingSource::set(const std::vector<FieldDescription>& parts,
                              const AxisMask& seen) const {
  const Instrument& instrument = experiment_.instrument;
  ReadingSet set;
  set.axes = instrument.axes;
  set.robust = experiment_.robust;
  set.has_fence = observations_.has_fence;
  set.noise_ratio = experiment_.noise_ratio;
  set.orientation = [this](const DesignPoint& point) -> Eigen::Matrix3d {
    return experiment_.rotation_sensor_from_positioner *
           experiment_.positioner.rotation_table_from_positioner(point).transpose();
  };
  if (!parts.empty()) {  // method bias has no field
    set.field = TableField(parts);
  }
  if (!blocks_.empty()) {
    set.field = set.field.tilted_by_block(blocks_);
  }
  for (const FieldDescription& also : also_) {
    set.also_kinds.push_back(also.kind);
    set.also_in_table.push_back(*also.in_table);
  }
  for (Eigen::Index k = 0; k < instrument.axis_count(); ++k) {
    set.nominal.push_back(nominal_axis(instrument, k));
  }
  put_readings(rows_, set);
  if (seen.size() > 0) {
    set.weights = seen.select(set.weights.array(), 0.0);
  }
  for (Eigen::Index k = 0; k < set.weights.cols(); ++k) {
    const auto used = static_cast<double>((set.weights.col(k).array() > 0.0).count());
    if (!(used > 0.0)) {
      throw RefusedError(formatted("axis {}: no reading is within its range and sees the field",
                                   set.axes[static_cast<std::size_t>(k)]));
    }
    set.weights.col(k) /= set.weights.col(k).sum() / used;
  }
  put_temperature(set);
  set.effects = run_effects(set.readings, set.weights, effects_);
  return set;
}

ReadingSet ReadingSource::kept_out(const ReadingSet& fitted) const {
  if (rows_kept_out_.empty()) {
    return {};
  }
  ReadingSet set = fitted;
  set.readings.clear();
  set.rotation_sensor_from_table.clear();
  set.field_then.clear();
  put_readings(rows_kept_out_, set);
  for (Eigen::Index k = 0; k < set.weights.cols(); ++k) {
    double sum = 0.0;
    double used = 0.0;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(rows_[i]);
      const bool counts = fitted.weights(static_cast<Eigen::Index>(i), k) > 0.0;
      sum += counts ? weights_(row, k) : 0.0;
      used += counts ? 1.0 : 0.0;
    }
    set.weights.col(k) *= used / sum;
  }
  put_temperature(set);
  set.temperature.scale = fitted.temperature.scale;
  set.temperature.along = fitted.temperature.along;
  set.effects.columns = effects_at(fitted.effects, fitted.readings, set.readings);
  return set;
}

Eigen::Vector3d ReadingSource::field_in_sensor(const Reading& reading,
                                               const TableField& field) const {
  if (by_field_) {
    return *reading.field_in_sensor;
  }
  if (field.is_sum()) {
    return rotation(reading) * field.at(reading.level);  // none moves
  }
  // The mean field where a block that was left out has no levelness of its own.
  const std::vector<int>& blocks = field.blocks();
  const bool has_own = std::binary_search(blocks.begin(), blocks.end(), reading.block);
  const Eigen::Vector3d in_table =
      has_own ? field.vector(field.tilt_of_block(reading.block)) : field.mean();
  return field.factor_of(0, reading.level) * (rotation(reading) * field_then(reading) * in_table);
}

}  // namespace axiscal
