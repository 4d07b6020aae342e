// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/reading_source.hpp"

#include <algorithm>
#include <limits>
#include <set>

#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/settings.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns the standard deviations from which the weights are computed. A few equal samples have the
// standard deviation 0, which is not credible. It is replaced by the median of the axis's positive
// standard deviations.
Eigen::MatrixXd positive_sd(Eigen::MatrixXd sd) {
  if (!(sd.array() >= 0.0).all()) {
    throw RefusedError("weights 'sd': a standard deviation in a column AXIS_sd is negative");
  }
  for (Eigen::Index k = 0; k < sd.cols(); ++k) {
    std::vector<double> positive;
    std::copy_if(sd.col(k).begin(), sd.col(k).end(), std::back_inserter(positive),
                 [](double one) { return one > 0.0; });
    if (positive.empty()) {
      throw RefusedError("weights 'sd': all standard deviations of an axis are 0");
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
      throw RefusedError("weights 'samples': the readings lack the column 'samples'");
    }
    return observations.samples->replicate(1, m);
  }
  if (weighting == Weighting::sd) {
    if (!observations.response_sd) {
      throw RefusedError("weights 'sd': each axis needs a column AXIS_sd");
    }
    return positive_sd(*observations.response_sd).cwiseAbs2().cwiseInverse();
  }
  return Eigen::MatrixXd::Ones(n, m);
}

// Returns the second fields (option --also), such as gravity for a gyroscope. Throws if the
// direction of one of them in the table's frame is not known.
std::vector<FieldDescription> second_fields(const Experiment& experiment) {
  std::vector<FieldDescription> fields;
  for (const FieldSetup& also : experiment.also) {
    fields.push_back(
        resolve_part(also, experiment.table, {.reading_unit = experiment.instrument.unit}));
    if (!fields.back().in_table) {
      throw SetupError(
          formatted("second field ('also') {}: its direction in the table's frame is unknown; give "
                    "the site and the fence's azimuth, or the field's vector in this frame "
                    "('in_table')",
                    also.kind()));
    }
  }
  return fields;
}

// Returns for each of the n observations and m axes whether the reading is within the range.
AxisMask readings_in_range(const Experiment& experiment, const Observations& observations) {
  AxisMask in_range = AxisMask::Constant(observations.size(), observations.response.cols(), true);
  if (observations.saturated) {
    in_range = !*observations.saturated;
  }
  const Instrument& instrument = experiment.instrument;
  for (Eigen::Index k = 0; instrument.range && k < in_range.cols(); ++k) {
    const std::string& axis = instrument.axes[static_cast<std::size_t>(k)];
    const bool is_difference =
        std::any_of(instrument.differences.begin(), instrument.differences.end(),
                    [&](const DifferentialAxis& difference) { return difference.axis == axis; });
    if (!is_difference) {  // the reader has already checked differences
      in_range.col(k) = in_range.col(k) &&
                        observations.response.col(k).array() > instrument.range->low &&
                        observations.response.col(k).array() < instrument.range->high;
    }
  }
  return in_range;
}

void require_runs_to_leave_out(const Experiment& experiment, const Observations& observations) {
  for (const int run : experiment.leave_out) {
    const bool there = std::any_of(observations.readings.begin(), observations.readings.end(),
                                   [run](const Reading& reading) { return reading.run == run; });
    if (!there) {
      throw SetupError(formatted("run {} cannot be left out: it does not exist", run),
                       {settings::leave_out});
    }
  }
}

// Returns the mean time of the readings, for a field that changes with time. Returns nullopt if a
// reading has no time.
std::optional<double> mean_time_of(const Experiment& experiment,
                                   const Observations& observations,
                                   const std::vector<std::size_t>& rows) {
  double sum = 0.0;
  for (const std::size_t row : rows) {
    const Reading& reading = observations.readings[row];
    if (!reading.time_s) {
      return std::nullopt;  // without times, the experiment's date applies to all readings
    }
    if (experiment.field.moving_part()->of->needs_utc() && !is_utc(*reading.time_s)) {
      throw RefusedError(
          formatted("run {}: {} requires the column 'time' in UTC (ISO 8601, or seconds since "
                    "1970), not in seconds since the start of the recording",
                    reading.run, experiment.field.moving_part()->of->moving_name()));
    }
    sum += *reading.time_s / static_cast<double>(rows.size());
  }
  static_cast<void>(change_of_field(experiment, sum, sum));  // throws if the change cannot be
                                                             // computed
  return sum;
}

}  // namespace

ReadingSource::ReadingSource(const Experiment& experiment,
                             const Observations& observations,
                             Weighting weighting,
                             bool by_field)
    : experiment_(&experiment),
      observations_(&observations),
      by_field_(by_field),
      selection_(std::make_shared<const Selection>(selected(weighting))) {}

ReadingSource::Selection ReadingSource::selected(Weighting weighting) const {
  Selection selection{.weights = weights_of(*observations_, weighting),
                      .in_range = readings_in_range(*experiment_, *observations_)};
  require_runs_to_leave_out(*experiment_, *observations_);
  const std::vector<int>& leave_out = experiment_->leave_out;
  for (std::size_t i = 0; i < observations_->readings.size(); ++i) {
    const Reading& reading = observations_->readings[i];
    if (std::find(leave_out.begin(), leave_out.end(), reading.run) == leave_out.end()) {
      (reading.confirm ? selection.rows_kept_out : selection.rows).push_back(i);
    }
  }
  if (selection.rows.empty()) {
    throw RefusedError(selection.rows_kept_out.empty()
                           ? "no readings are left for the calibration"
                           : "all readings are confirmation readings ('confirm'), so no readings "
                             "are left for the fit");
  }
  selection.mean_variance =
      selection.weights(selection.rows, Eigen::all).cwiseInverse().colwise().mean();
  if (field_moves(*experiment_) && !by_field_) {
    selection.mean_time_s = mean_time_of(*experiment_, *observations_, selection.rows);
  }
  selection.also = second_fields(*experiment_);
  if (experiment_->fit.level_by == LevelBy::block) {
    std::set<int> blocks;
    for (const std::size_t row : selection.rows) {
      blocks.insert(observations_->readings[row].block);
    }
    selection.blocks.assign(blocks.begin(), blocks.end());
  }
  return selection;
}

ReadingSource ReadingSource::with(ModelChoice choice) const {
  ReadingSource source = *this;
  source.choice_ = std::move(choice);
  source.choice_.effects.blocks =
      source.choice_.effects.blocks && source.choice_.temperature_order == 0;
  source.spans_ = source.spans_of_sensors();
  return source;
}

ReadingSource ReadingSource::with_complete_rows() const {
  Selection complete = *selection_;
  std::erase_if(complete.rows, [&](std::size_t row) {
    return !complete.in_range.row(static_cast<Eigen::Index>(row)).all();
  });
  if (complete.rows.empty()) {
    throw RefusedError("every reading is out of the instrument's range on at least one axis");
  }
  ReadingSource source = *this;
  source.selection_ = std::make_shared<const Selection>(std::move(complete));
  return source;
}

Eigen::Matrix3d ReadingSource::rotation(const Reading& reading) const {
  Eigen::Matrix3d R =
      experiment_->rotation_sensor_from_positioner *
      experiment_->positioner.rotation_table_from_positioner(*reading.point).transpose();
  const auto turn = choice_.mounts.find(reading.mount);
  if (turn != choice_.mounts.end()) {
    R = turn->second * R;
  }
  return R;
}

Eigen::Matrix3d ReadingSource::field_then(const Reading& reading) const {
  return selection_->mean_time_s
             ? change_of_field(*experiment_, *selection_->mean_time_s,
                               reading.time_s.value_or(*selection_->mean_time_s))
             : Eigen::Matrix3d::Identity();
}

std::vector<TemperatureSpan> ReadingSource::spans_of_sensors() const {
  std::vector<TemperatureSpan> spans;
  if (choice_.temperature_order == 0) {
    return spans;
  }
  const bool own = std::any_of(rows().begin(), rows().end(), [&](std::size_t row) {
    return observations_->readings[row].temperature->has_own();
  });
  for (Eigen::Index k = 0; k < (own ? observations_->response.cols() : 1); ++k) {
    TemperatureSpan span{.low = std::numeric_limits<double>::infinity(),
                         .high = -std::numeric_limits<double>::infinity()};
    double sum = 0.0;
    for (const std::size_t row : rows()) {
      const double t = observations_->readings[row].temperature->of(k);
      sum += t;
      span.low = std::min(span.low, t);
      span.high = std::max(span.high, t);
    }
    span.reference =
        choice_.temperature_reference.value_or(sum / static_cast<double>(rows().size()));
    spans.push_back(span);
  }
  return spans;
}

double ReadingSource::weight(Eigen::Index row, Eigen::Index axis) const {
  const double plain = selection_->weights(row, axis);
  if (!(choice_.variance_floor > 0.0)) {
    return plain;
  }
  return 1.0 / variance_of_samples(choice_.variance_floor,
                                   1.0 / (plain * selection_->mean_variance(axis)));
}

// Stores readings, responses, weights and orientations in the set; the weights are not normalised.
void ReadingSource::put_readings(const std::vector<std::size_t>& rows, ReadingSet& set) const {
  const auto n = static_cast<Eigen::Index>(rows.size());
  set.response.resize(n, observations_->response.cols());
  set.weights.resize(n, observations_->response.cols());
  set.readings.reserve(rows.size());
  set.rotation_sensor_from_table.reserve(by_field_ ? 0 : rows.size());
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::size_t row = rows[static_cast<std::size_t>(i)];
    const auto from = static_cast<Eigen::Index>(row);
    const Reading& reading = observations_->readings[row];
    set.readings.push_back(reading);
    if (!set.field.is_sum()) {  // the level of the only part is the level of the field
      set.readings.back().level = reading.level.of(set.field.parts().front().level_name());
    }
    set.response.row(i) = observations_->response.row(from);
    for (Eigen::Index k = 0; k < set.weights.cols(); ++k) {
      set.weights(i, k) = selection_->in_range(from, k) ? weight(from, k) : 0.0;
    }
    if (!by_field_ && reading.point) {
      set.rotation_sensor_from_table.push_back(rotation(reading));
      if (selection_->mean_time_s) {
        set.field_then.push_back(field_then(reading));
      }
    }
  }
}

void ReadingSource::put_temperature(ReadingSet& set) const {
  if (choice_.temperature_order == 0) {
    return;
  }
  set.temperature.order = choice_.temperature_order;
  set.temperature.d.resize(set.size(), set.axis_count());
  std::vector<double> temperatures;
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const Reading& reading = set.readings[static_cast<std::size_t>(i)];
    if (!reading.temperature) {
      throw RefusedError(formatted(
          "temperature terms need the column 'temperature'; run {} lacks a value", reading.run));
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
  const Instrument& instrument = experiment_->instrument;
  ReadingSet set;
  set.axes = instrument.axes;
  set.robust = experiment_->fit.robust;
  set.has_fence = observations_->has_fence;
  set.noise_ratio = experiment_->fit.noise_ratio;
  set.orientation = [experiment = experiment_](const DesignPoint& point) -> Eigen::Matrix3d {
    return experiment->rotation_sensor_from_positioner *
           experiment->positioner.rotation_table_from_positioner(point).transpose();
  };
  if (!parts.empty()) {  // method bias does not use a field
    set.field = TableField(parts);
  }
  if (!selection_->blocks.empty()) {
    set.field = set.field.tilted_by_block(selection_->blocks);
  }
  for (const FieldDescription& also : selection_->also) {
    set.also_kinds.push_back(also.kind);
    set.also_in_table.push_back(*also.in_table);
  }
  for (Eigen::Index k = 0; k < instrument.axis_count(); ++k) {
    set.nominal.push_back(nominal_axis(instrument, k));
  }
  put_readings(rows(), set);
  if (seen.size() > 0) {
    set.weights = seen.select(set.weights.array(), 0.0);
  }
  for (Eigen::Index k = 0; k < set.weights.cols(); ++k) {
    const auto used = static_cast<double>((set.weights.col(k).array() > 0.0).count());
    if (!(used > 0.0)) {
      throw RefusedError(
          formatted("axis {}: no reading can be used: each is beyond the range of the axis, or the "
                    "field does not reach the axis's front side; check the range and the "
                    "orientations",
                    set.axes[static_cast<std::size_t>(k)]));
    }
    set.weights.col(k) /= set.weights.col(k).sum() / used;
  }
  put_temperature(set);
  set.effects = run_effects(set.readings, set.weights, choice_.effects);
  if (choice_.effects.memory) {
    add_memory(set.readings, set.response, set.effects);
  }
  return set;
}

ReadingSet ReadingSource::kept_out(const ReadingSet& fitted) const {
  if (selection_->rows_kept_out.empty()) {
    return {};
  }
  ReadingSet set = fitted;
  set.readings.clear();
  set.rotation_sensor_from_table.clear();
  set.field_then.clear();
  put_readings(selection_->rows_kept_out, set);
  for (Eigen::Index k = 0; k < set.weights.cols(); ++k) {
    double sum = 0.0;
    double used = 0.0;
    for (std::size_t i = 0; i < rows().size(); ++i) {
      const auto row = static_cast<Eigen::Index>(rows()[i]);
      const bool counts = fitted.weights(static_cast<Eigen::Index>(i), k) > 0.0;
      sum += counts ? weight(row, k) : 0.0;
      used += counts ? 1.0 : 0.0;
    }
    set.weights.col(k) *= used / sum;
  }
  put_temperature(set);
  set.temperature.scale = fitted.temperature.scale;
  set.temperature.along = fitted.temperature.along;
  set.effects.columns = extrapolate_run_effects(fitted.effects, fitted.readings, set.readings);
  set.effects.memory.setZero(fitted.effects.memory.size() > 0 ? set.size() : 0,
                             fitted.effects.memory.cols());
  return set;
}

Eigen::Vector3d ReadingSource::field_in_sensor(const Reading& reading,
                                               const TableField& field) const {
  if (by_field_) {
    return *reading.field_in_sensor;
  }
  if (field.is_sum()) {
    return rotation(reading) * field.at(reading.level);  // no part of a sum varies in time
  }
  // If the fit has no readings of a block, the slope of the table in this block is not known, and
  // the mean field is used.
  const std::vector<int>& blocks = field.blocks();
  const bool has_own = std::binary_search(blocks.begin(), blocks.end(), reading.block);
  const Eigen::Vector3d in_table =
      has_own ? field.vector(field.tilt_of_block(reading.block)) : field.mean();
  return field.factor_of(0, reading.level) * (rotation(reading) * field_then(reading) * in_table);
}

}  // namespace axiscal
