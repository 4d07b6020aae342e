// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/imu.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/LU>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/companion.hpp"
#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/least_squares.hpp"
#include "axiscal/calib/magnitude_fit.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/positioner/positioner.hpp"

namespace axiscal {
namespace {

void require_three(const std::vector<std::string>& columns) {
  if (columns.size() != 3) {
    throw DomainError("calibrate_imu: each instrument needs three columns");
  }
}

// Means of some columns as readings of an instrument.
Observations readings_of(const Segmentation& rests, const std::vector<std::string>& columns) {
  Observations observations;
  const auto n = static_cast<Eigen::Index>(rests.intervals.size());
  observations.response = means_of(rests, columns);
  observations.samples = Eigen::VectorXd(n);
  observations.response_sd = Eigen::MatrixXd(n, 3);
  std::array<Eigen::Index, 3> at{};
  std::transform(columns.begin(), columns.end(), at.begin(), [&](const std::string& name) {
    return static_cast<Eigen::Index>(find_column(rests.columns, name).value());
  });
  const std::optional<std::size_t> temperature = find_column(rests.columns, "temperature");
  for (Eigen::Index i = 0; i < n; ++i) {
    const StaticInterval& interval = rests.intervals[static_cast<std::size_t>(i)];
    Reading& reading = observations.readings.emplace_back();
    reading.run = static_cast<int>(i) + 1;
    reading.time_s = 0.5 * (interval.start_s + interval.end_s);
    if (temperature) {
      reading.temperature = interval.mean(static_cast<Eigen::Index>(*temperature));
    }
    (*observations.samples)(i) = static_cast<double>(interval.samples());
    observations.response_sd->row(i) = interval.sd(at).cwiseMax(1e-300).transpose();
  }
  return observations;
}

// Rests with their labels; those that have none are left out.
Observations labelled(const Observations& all,
                      const SeatLabels& labels,
                      const std::vector<RunSheetRow>& sheet) {
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < labels.points.size(); ++i) {
    if (labels.points[i]) {
      rows.push_back(i);
    }
  }
  Observations chosen = select_rows(all, rows);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    Reading& reading = chosen.readings[r];
    reading.point = labels.points[rows[r]];
    if (!labels.rows.empty() && labels.rows[rows[r]]) {
      const RunSheetRow& row = sheet[*labels.rows[rows[r]]];
      reading.run = row.run;
      reading.block = row.block;
      chosen.has_block = true;
    }
  }
  return chosen;
}

// The fields at the rests that a calibration says, n x 3.
Eigen::MatrixX3d fields_by(const LinearResponse& response, const Eigen::MatrixX3d& means) {
  const Eigen::Matrix3d inverse = Eigen::Matrix3d(response.sensitivity).inverse();
  return (means.rowwise() - response.bias.transpose()) * inverse.transpose();
}

// Middle of the directions: a magnetometer's bias as far as extremes show it.
Eigen::MatrixX3d centred(const Eigen::MatrixX3d& means) {
  const Eigen::RowVector3d middle = 0.5 * (means.colwise().maxCoeff() + means.colwise().minCoeff());
  return means.rowwise() - middle;
}

std::vector<std::size_t> all_rests(const Segmentation& rests) {
  std::vector<std::size_t> all(rests.intervals.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

// The gyroscope's samples between rests. The log must outlive it.
class TurnSource {
 public:
  TurnSource(const RecordedLog& log, const ImuOptions& options, double rate_hz)
      : rate_hz_(rate_hz) {
    const auto finite = [](double v) { return std::isfinite(v); };
    owned_.reserve(options.gyroscope.size());
    for (const std::string& name : options.gyroscope) {
      const std::vector<double>& x = log.samples[need_column(log.name, log.columns, name)];
      if (std::all_of(x.begin(), x.end(), finite)) {
        gyroscope_.emplace_back(x);
      } else {
        gyroscope_.emplace_back(owned_.emplace_back(filled(x)));
      }
    }
    make_times(log, options.segment);
  }

  // The turns from rest to rest; those with missing samples are left out.
  // @param between  which of the rests to go between, in their order.
  std::vector<GyroscopeTurn> turns(const Segmentation& rests,
                                   const std::vector<std::size_t>& between,
                                   const Eigen::MatrixX3d& ups) {
    std::vector<GyroscopeTurn> turns;
    ends.clear();
    left_out = 0;
    for (std::size_t i = 0; i + 1 < between.size(); ++i) {
      const StaticInterval& a = rests.intervals[between[i]];
      const StaticInterval& b = rests.intervals[between[i + 1]];
      const std::size_t first = a.end - 1;
      const std::size_t count = b.first - first + 1;
      if (!is_whole(first, count)) {
        ++left_out;
        continue;
      }
      GyroscopeTurn& turn = turns.emplace_back();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        turn.readings[axis] = gyroscope_[axis].subspan(first, count);
      }
      turn.time_s = time_s_.subspan(first, count);
      turn.up_before = ups.row(static_cast<Eigen::Index>(between[i])).transpose();
      turn.up_after = ups.row(static_cast<Eigen::Index>(between[i + 1])).transpose();
      ends.emplace_back(between[i], between[i + 1]);
    }
    return turns;
  }

  // Of the last call: rests before and after each turn, and how many turns were left out.
  std::vector<std::pair<std::size_t, std::size_t>> ends;
  std::size_t left_out = 0;

 private:
  // A few missing samples in a row, a tenth of a second, are bridged by a line.
  [[nodiscard]] std::vector<double> filled(std::vector<double> x) const {
    const auto longest = static_cast<std::size_t>(0.1 * rate_hz_) + 1;
    for (std::size_t i = 1; i < x.size(); ++i) {
      if (std::isfinite(x[i])) {
        continue;
      }
      std::size_t end = i;
      while (end < x.size() && !std::isfinite(x[end])) {
        ++end;
      }
      if (end < x.size() && end - i <= longest && std::isfinite(x[i - 1])) {
        const double step = (x[end] - x[i - 1]) / static_cast<double>(end - i + 1);
        for (std::size_t k = i; k < end; ++k) {
          x[k] = x[k - 1] + step;
        }
      }
      i = end;
    }
    return x;
  }

  void make_times(const RecordedLog& log, const SegmentOptions& options) {
    const std::optional<TimeColumn> column =
        options.rate_hz ? std::nullopt : find_time_column(log.name, log.columns, options.time);
    const double seconds =
        column ? settle_time_unit(log.name, *column, log.samples[column->position]).seconds : 1.0;
    if (column && seconds == 1.0) {
      time_s_ = log.samples[column->position];
      return;
    }
    owned_times_.resize(log.samples.front().size());
    for (std::size_t i = 0; i < owned_times_.size(); ++i) {
      owned_times_[i] =
          column ? log.samples[column->position][i] * seconds : static_cast<double>(i) / rate_hz_;
    }
    time_s_ = owned_times_;
  }

  [[nodiscard]] bool is_whole(std::size_t first, std::size_t count) const {
    const double longest_step = std::max(5.0 / rate_hz_, 0.1);
    for (std::size_t i = first; i < first + count; ++i) {
      for (const std::span<const double> axis : gyroscope_) {
        if (!std::isfinite(axis[i])) {
          return false;
        }
      }
      const double step = i > first ? time_s_[i] - time_s_[i - 1] : 0.0;
      if (!(step >= 0.0 && step <= longest_step)) {
        return false;
      }
    }
    return true;
  }

  double rate_hz_;
  std::vector<std::span<const double>> gyroscope_;  // the log's columns, where nothing is missing
  std::span<const double> time_s_;
  std::vector<std::vector<double>> owned_;
  std::vector<double> owned_times_;
};

// What the rests say of the gyroscope: bias, and its change with gravity.
struct RestFit {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  Eigen::Matrix3d bias_covariance = Eigen::Matrix3d::Zero();
  Eigen::Vector3d sd = Eigen::Vector3d::Zero();  // standard deviation of a rest's mean
  std::optional<Eigen::Matrix3d> g_sensitivity, g_sensitivity_se;
  Eigen::Vector3d p_value = Eigen::Vector3d::Ones();  // that an axis has none
};

RestFit fit_rests(const Eigen::MatrixX3d& means, const Eigen::MatrixX3d& ups) {
  RestFit fit;
  const auto n = static_cast<double>(means.rows());
  fit.bias = means.colwise().mean().transpose();
  for (int k = 0; k < 3; ++k) {
    const double rss = (means.col(k).array() - fit.bias(k)).square().sum();
    fit.sd(k) = n > 1.0 ? std::sqrt(rss / (n - 1.0)) : 0.0;
    fit.bias_covariance(k, k) = fit.sd(k) * fit.sd(k) / n;
  }
  if (means.rows() < 8) {
    return fit;
  }
  Eigen::MatrixXd X(means.rows(), 4);
  X << Eigen::VectorXd::Ones(means.rows()), ups;
  if (!undetermined_columns(X).empty()) {
    return fit;
  }
  const LeastSquaresDesign design(X);
  fit.g_sensitivity.emplace();
  fit.g_sensitivity_se.emplace();
  for (int k = 0; k < 3; ++k) {
    const LeastSquaresFit axis = design.fit(means.col(k));
    fit.g_sensitivity->row(k) = axis.estimate.tail<3>().transpose();
    fit.g_sensitivity_se->row(k) = axis.covariance.diagonal().tail<3>().cwiseSqrt().transpose();
    const double explained = fit.sd(k) * fit.sd(k) * (n - 1.0) - axis.residuals.squaredNorm();
    fit.p_value(k) = f_upper_p(
        std::max(0.0, explained) / 3.0 / (axis.residual_sd * axis.residual_sd), 3.0, n - 4.0);
  }
  return fit;
}

// How well the rests of one threshold serve: the scatter of the fit by the root of its degrees of
// freedom, as it goes into standard errors. Of gravity's magnitude; with a gyroscope, of the
// attitudes after the turns, which feel what moves in a rest much sooner.
double scatter_of(const Segmentation& rests,
                  const ImuOptions& options,
                  TurnSource& source,
                  TurnFitOptions& turn_options) {
  const Eigen::MatrixX3d means = means_of(rests, options.accelerometer);
  const MagnitudeFit fit = fit_magnitude(means, 1.0, options.experiment.shape);
  if (options.gyroscope.empty()) {
    return fit.residual_sd / std::sqrt(fit.degrees_of_freedom);
  }
  const Eigen::MatrixX3d ups = fields_by(fit.response, means);
  const RestFit still = fit_rests(means_of(rests, options.gyroscope), ups);
  const TurnFit turns = fit_turns(source.turns(rests, all_rests(rests), ups), still.bias,
                                  still.bias_covariance, turn_options);
  turn_options.start = turns.inverse;  // the next one starts there
  return turns.residual_sd_rad / std::sqrt(turns.degrees_of_freedom);
}

// The threshold whose rests serve best, of those that have not many fewer rests than the persistent
// one.
std::size_t best_by_scatter(const RecordedLog& log,
                            const ImuOptions& options,
                            const std::vector<IntervalSet>& sets,
                            Segmentation rests) {
  const std::size_t persistent = most_persistent(sets);
  const double usual = static_cast<double>(sets[persistent].intervals.size());
  std::vector<std::size_t> candidates;
  for (std::size_t s = 0; s + 1 < sets.size(); ++s) {
    const auto n = static_cast<double>(sets[s].intervals.size());
    if (n >= 12.0 && n >= 0.75 * usual && n <= 1.25 * usual) {
      candidates.push_back(s);
    }
  }
  constexpr std::size_t most = 6;  // neighbours hardly differ
  const std::size_t step = 1 + candidates.size() / most;
  TurnSource source(log, options, rests.rate_hz);
  TurnFitOptions turn_options = options.turns;
  turn_options.tolerance = 1e-4;
  const auto scatter_at = [&](std::size_t set) {
    rests.intervals = sets[set].intervals;
    try {
      return scatter_of(rests, options, source, turn_options);
    } catch (const RefusedError&) {
      return std::numeric_limits<double>::infinity();  // these rests do not determine the fit
    }
  };
  // Another than the persistent one must be clearly better: small differences are chance.
  constexpr double clearly = 0.8;
  std::size_t best = persistent;
  double least = clearly * scatter_at(persistent);
  for (std::size_t c = 0; c < candidates.size(); c += step) {
    const double scatter = scatter_at(candidates[c]);
    if (scatter < least) {
      least = scatter;
      best = candidates[c];
    }
  }
  return best;
}

// The first rest's label, where its fence face is stated.
std::optional<DesignPoint> first_point(const ImuOptions& options,
                                       const std::vector<std::optional<Face>>& faces) {
  if (!options.first || faces.empty() || !faces.front() ||
      axis_of(*options.first) == axis_of(*faces.front())) {
    return std::nullopt;
  }
  return DesignPoint(*faces.front(), *options.first);
}

class ImuCalibrator {
 public:
  ImuCalibrator(const RecordedLog& log, const ImuOptions& options) : log_(log), options_(options) {
    for (const std::vector<std::string>* columns :
         {&options.accelerometer, &options.gyroscope, &options.magnetometer}) {
      if (columns == &options.accelerometer || !columns->empty()) {
        require_three(*columns);
        for (const std::string& column : *columns) {
          static_cast<void>(need_column(log.name, log.columns, column));
        }
      }
    }
  }

  ImuCalibration run() {
    find_rests();
    if (options_.seats != Seats::unknown) {
      label();
    }
    calibrate_accelerometer();
    if (!options_.gyroscope.empty()) {
      calibrate_gyroscope();
    }
    if (!options_.magnetometer.empty()) {
      calibrate_magnetometer();
    }
    result_.notes.insert(result_.notes.end(), log_.notes.begin(), log_.notes.end());
    result_.notes.insert(result_.notes.end(), result_.rests.notes.begin(),
                         result_.rests.notes.end());
    warn(result_.accelerometer);
    for (std::optional<Calibration>* one : {&result_.gyroscope, &result_.magnetometer}) {
      if (*one) {
        warn(**one);
      }
    }
    return std::move(result_);
  }

 private:
  // What is to be looked at in the log is so in each record of it.
  void warn(Calibration& record) const {
    const auto add = [&](WarningCode code, const std::vector<std::string>& messages) {
      for (const std::string& message : messages) {
        record.warnings.push_back({.code = code, .message = message});
        record.status = std::max(record.status, CalibrationStatus::warning);
      }
    };
    add(WarningCode::log, result_.rests.warnings);
    if (result_.seats) {
      add(WarningCode::seat, result_.seats->messages);
    }
  }

  void find_rests() {
    SegmentOptions segment_options = options_.segment;
    if (segment_options.columns.empty()) {
      // Turning by hand shows in rates before it shows in gravity.
      segment_options.columns =
          options_.gyroscope.empty() ? options_.accelerometer : options_.gyroscope;
    }
    segment_options.attitude = options_.accelerometer;
    LogFile file(log_.name, log_.columns, log_.samples);
    result_.rests =
        segment(file, segment_options,
                [&](const std::vector<IntervalSet>& sets, const Segmentation& so_far) {
                  return options_.seats != Seats::unknown  // six directions fit any magnitude
                             ? most_persistent(sets)
                             : best_by_scatter(log_, options_, sets, so_far);
                });
    accelerations_ = means_of(result_.rests, options_.accelerometer);
  }

  void label() {
    if (options_.seats == Seats::sheet) {
      result_.seats = label_by_sheet(resting_faces(accelerations_), options_.sheet);
      check_fences(log_, result_.rests, options_, *result_.seats);
    } else {
      result_.seats = recognise_seats(log_, result_.rests, options_, result_.notes);
    }
  }

  [[nodiscard]] Observations observations_of(const std::vector<std::string>& columns) const {
    const Observations all = readings_of(result_.rests, columns);
    return result_.seats ? labelled(all, *result_.seats, options_.sheet) : all;
  }

  void calibrate_accelerometer() {
    Experiment experiment = options_.experiment;
    if (experiment.instrument.kind.empty()) {
      experiment.instrument.kind = "accelerometer";
    }
    experiment.instrument.axes = options_.accelerometer;
    if (experiment.field.kind.empty()) {
      experiment.field.kind = "gravity";
    }
    // Of a hand-turned board the model errs more than the mean of a second.
    experiment.weighting = experiment.weighting.value_or(Weighting::none);
    result_.accelerometer = calibrate(experiment, observations_of(options_.accelerometer));
    result_.accelerometer.slot = "accelerometer";
  }

  void calibrate_gyroscope() {
    const Eigen::MatrixX3d ups =
        fields_by(result_.accelerometer.response, accelerations_).rowwise().normalized();
    const RestFit rests = fit_rests(means_of(result_.rests, options_.gyroscope), ups);
    std::vector<std::size_t> between;
    for (const std::size_t rest : all_rests(result_.rests)) {
      if (!result_.seats || result_.seats->points[rest]) {
        between.push_back(rest);
      }
    }
    TurnSource source(log_, options_, result_.rests.rate_hz);
    std::vector<GyroscopeTurn> turns = source.turns(result_.rests, between, ups);
    if (result_.seats) {
      const Positioner& cube = options_.experiment.positioner;
      const auto sensor_from_table = [&](std::size_t rest) {
        return Eigen::Matrix3d(
            options_.experiment.rotation_sensor_from_positioner *
            cube.rotation_table_from_positioner(*result_.seats->points[rest]).transpose());
      };
      for (std::size_t t = 0; t < turns.size(); ++t) {
        turns[t].rotation_before_from_after = sensor_from_table(source.ends[t].first) *
                                              sensor_from_table(source.ends[t].second).transpose();
      }
    }
    result_.turns = fit_turns(turns, rests.bias, rests.bias_covariance, options_.turns);
    Calibration record = turn_calibration(*result_.turns,
                                          {.kind = "gyroscope",
                                           .serial = options_.experiment.instrument.serial,
                                           .axes = options_.gyroscope,
                                           .unit = options_.gyroscope_unit},
                                          rests.sd);
    record.slot = "gyroscope";
    if (source.left_out > 0) {
      record.notes.push_back(std::to_string(source.left_out) +
                             " turns with missing samples are left out");
    }
    result_.g_sensitivity = rests.g_sensitivity;
    result_.g_sensitivity_se = rests.g_sensitivity_se;
    if (rests.g_sensitivity && rests.p_value.minCoeff() < 1e-3) {
      record.notes.push_back("the rests' means change with gravity: g-sensitivity of up to " +
                             number_text(rests.g_sensitivity->cwiseAbs().maxCoeff(), 3) + " " +
                             unit_per(record.instrument.unit, "g") + " (standard error " +
                             number_text(rests.g_sensitivity_se->maxCoeff(), 2) + ")");
    }
    result_.gyroscope = std::move(record);
  }

  void calibrate_magnetometer() {
    Experiment experiment = options_.experiment;
    experiment.instrument.kind = "magnetometer";
    experiment.instrument.axes = options_.magnetometer;
    experiment.instrument.unit = options_.magnetometer_unit;
    experiment.instrument.range.reset();
    experiment.field = options_.magnetic_field;
    bool relative = false;
    if (!experiment.field.magnitude && !experiment.field.site && !experiment.field.in_table) {
      experiment.field.kind = "custom";
      experiment.field.magnitude = 1.0;
      relative = true;
    } else if (experiment.field.kind.empty()) {
      experiment.field.kind = "geomagnetic";
    }
    experiment.weighting = experiment.weighting.value_or(Weighting::none);
    experiment.method.reset();
    experiment.shape = MagnitudeShape::symmetric;  // its frame becomes the accelerometer's anyway
    const Observations observations = observations_of(options_.magnetometer);
    Calibration record = calibrate(experiment, observations);
    record.slot = "magnetometer";
    if (relative) {
      record.notes.emplace_back(
          "neither the local field's magnitude nor the site was stated: "
          "fields are in units of it");
    }
    if (!result_.seats) {
      align_with_companion(record, observations, result_.accelerometer,
                           observations_of(options_.accelerometer), "accelerometer");
    }
    result_.magnetometer = std::move(record);
  }

  const RecordedLog& log_;
  const ImuOptions& options_;
  ImuCalibration result_;
  Eigen::MatrixX3d accelerations_;  // means of the rests
};

}  // namespace

std::vector<Calibration> ImuCalibration::records() const {
  std::vector<Calibration> all = {accelerometer};
  for (const std::optional<Calibration>* one : {&gyroscope, &magnetometer}) {
    if (*one) {
      all.push_back(**one);
    }
  }
  return all;
}

SeatLabels recognise_seats(const RecordedLog& log,
                           const Segmentation& rests,
                           const ImuOptions& options,
                           std::vector<std::string>& notes) {
  const Eigen::MatrixX3d means = means_of(rests, options.accelerometer);
  const std::vector<std::optional<Face>> faces = resting_faces(means);
  const Eigen::MatrixX3d ups = rough_ups(means);
  const std::string open_start =
      options.first
          ? ""
          : "; the first one is taken as the standard design's, so that the slope's x and y "
            "are known up to a turn of the whole table (state its fence face)";
  if (!options.gyroscope.empty()) {
    TurnSource source(log, options, rests.rate_hz);
    const std::vector<GyroscopeTurn> turns = source.turns(rests, all_rests(rests), ups);
    if (source.left_out == 0) {
      const RestFit still = fit_rests(means_of(rests, options.gyroscope), ups);
      const TurnFit fit = fit_turns(turns, still.bias, still.bias_covariance, options.turns);
      notes.push_back("fence faces recognised by the gyroscope" + open_start);
      return label_by_turns(faces, integrated_rotations(turns, fit), first_point(options, faces));
    }
    if (options.magnetometer.empty()) {
      throw RefusedError(
          "the gyroscope lacks samples in " + std::to_string(source.left_out) +
              " of the turns, so that it does not tell the fence faces; give the run sheet",
          {Setting::run_sheet});
    }
  }
  if (!options.magnetometer.empty()) {
    notes.push_back("fence faces recognised by the magnetometer" + open_start);
    return label_by_heading(faces, ups, centred(means_of(rests, options.magnetometer)),
                            first_point(options, faces));
  }
  notes.emplace_back(
      "nothing in the log tells the fence faces: they are taken in turn, as in the standard "
      "design; "
      "then the slope of the table means nothing");
  return label_by_order(faces);
}

void check_fences(const RecordedLog& log,
                  const Segmentation& rests,
                  const ImuOptions& options,
                  SeatLabels& labels) {
  const auto first = std::find_if(labels.points.begin(), labels.points.end(),
                                  [](const auto& point) { return point.has_value(); });
  if (first != labels.points.begin() ||
      (options.gyroscope.empty() && options.magnetometer.empty())) {
    return;
  }
  ImuOptions own = options;
  own.first = first->value().fence();
  std::vector<std::string> notes;
  SeatLabels seen;
  try {
    seen = recognise_seats(log, rests, own, notes);
  } catch (const RefusedError&) {
    return;  // they do not tell
  }
  for (std::size_t i = 0; i < labels.points.size(); ++i) {
    if (labels.points[i] && seen.points[i] && labels.points[i]->rest() == seen.points[i]->rest() &&
        labels.points[i]->fence() != seen.points[i]->fence()) {
      labels.messages.push_back(
          "rest " + std::to_string(i + 1) + ": the sheet says " + labels.points[i]->name() +
          ", the " + (options.gyroscope.empty() ? "magnetometer" : "gyroscope") + " fence " +
          std::string(face_name(seen.points[i]->fence())) + "; was the cube turned as planned?");
    }
  }
}

ImuCalibration calibrate_imu(const RecordedLog& log, const ImuOptions& options) {
  return ImuCalibrator(log, options).run();
}

}  // namespace axiscal
