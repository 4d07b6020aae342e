// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/imu.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <set>

#include <Eigen/LU>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/companion.hpp"
#include "axiscal/calib/magnitude_fit.hpp"
#include "axiscal/calib/settings.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/median.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/custom_field.hpp"
#include "axiscal/field/geomagnetic_field.hpp"
#include "axiscal/logs/sample_rests.hpp"
#include "axiscal/positioner/positioner.hpp"
#include "calib/regression/factor.hpp"
#include "core/formatted.hpp"
#include "logs/src/rest_turns.hpp"
#include "logs/src/unsettled_rests.hpp"

namespace axiscal {
namespace {

void require_three(const std::vector<std::string>& columns) {
  if (columns.size() != 3) {
    throw DomainError("calibrate_imu: each instrument needs three columns");
  }
}

// @return one reading for each period of rest: the means of three columns over that period.
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

// @return the readings at the rests that have a label. Each reading contains its label.
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

// @return the field at each rest, n x 3. It is computed by applying a calibration to the means.
Eigen::MatrixX3d fields_by(const LinearResponse& response, const Eigen::MatrixX3d& means) {
  const Eigen::Matrix3d inverse = Eigen::Matrix3d(response.sensitivity).inverse();
  return (means.rowwise() - response.bias.transpose()) * inverse.transpose();
}

// @return the means minus the midpoint between the largest and the smallest mean of each axis. The
//         midpoint is an estimate of the bias of a magnetometer.
Eigen::MatrixX3d centred(const Eigen::MatrixX3d& means) {
  const Eigen::RowVector3d middle = 0.5 * (means.colwise().maxCoeff() + means.colwise().minCoeff());
  return means.rowwise() - middle;
}

std::vector<std::size_t> all_rests(const Segmentation& rests) {
  std::vector<std::size_t> all(rests.intervals.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

// @return the error of biases and sensitivities divided by the noise of the means at the rests. It
//         is large if there are few attitudes, or if they do not cover all directions.
// @param ups  upward vertical at each rest, in the sensor's frame, n x 3.
double spread_of(const Eigen::MatrixX3d& ups) {
  Eigen::MatrixXd J(ups.rows(), 9);
  J << ups, ups.cwiseAbs2(), ups.col(0).cwiseProduct(ups.col(1)),
      ups.col(1).cwiseProduct(ups.col(2)), ups.col(2).cwiseProduct(ups.col(0));
  const PositiveFactor factor(J.transpose() * J);
  constexpr double open_below = 1e-9;
  return factor.is_determined(open_below) ? std::sqrt(factor.inverse().trace())
                                          : std::numeric_limits<double>::infinity();
}

// The quality of the rests that are detected with one threshold. The expected error of the
// coefficients is scatter times spread. The spread is the result of spread_of(). With a gyroscope,
// the scatter is the standard deviation of the attitude errors after the rotations between rests,
// because motion during a rest affects these errors most. Without a gyroscope, the scatter is the
// standard deviation of the calibrated magnitudes of gravity.
struct RestQuality {
  double scatter = std::numeric_limits<double>::infinity();
  double spread = 1.0;
  std::optional<Eigen::Matrix3d> inverse;  // inverse of the gyroscope's fitted sensitivity

  [[nodiscard]] double error() const { return scatter * spread; }
};

RestQuality quality_of(const Segmentation& rests,
                       const ImuOptions& options,
                       RestTurns& source,
                       TurnFitOptions& turn_options) {
  const Eigen::MatrixX3d means = means_of(rests, options.accelerometer);
  const MagnitudeFit fit = fit_magnitude(means, 1.0, options.experiment.fit.shape);
  const Eigen::MatrixX3d ups = fields_by(fit.response, means);
  const double spread = spread_of(ups.rowwise().normalized());
  if (options.gyroscope.empty()) {
    return {.scatter = fit.residual_sd, .spread = spread, .inverse = {}};
  }
  const RestFit still = fit_rests(means_of(rests, options.gyroscope), ups);
  const TurnFit turns = fit_turns(source.turns(rests, all_rests(rests), ups), still, turn_options);
  turn_options.start = turns.inverse;  // initial value for the next threshold
  return {.scatter = turns.residual_sd_rad, .spread = spread, .inverse = turns.inverse};
}

// Finds the detection threshold that gives the smallest expected error of the coefficients. A
// threshold is tried only if its number of rests differs by at most 25 % from the number at the
// threshold of most_persistent().
//
// @param notes    receives a note if fewer rests are used than most_persistent() would use.
// @param inverse  receives the inverse of the gyroscope's sensitivity, fitted to the turns.
// @return the index of the threshold in `sets`.
std::size_t best_by_scatter(const RecordedLog& log,
                            const ImuOptions& options,
                            const std::vector<IntervalSet>& sets,
                            Segmentation rests,
                            std::vector<std::string>& notes,
                            std::optional<Eigen::Matrix3d>& inverse) {
  const std::size_t persistent = most_persistent(sets);
  const double usual = static_cast<double>(sets[persistent].intervals.size());
  std::vector<std::size_t> candidates;
  for (std::size_t s = 0; s + 1 < sets.size(); ++s) {
    const auto n = static_cast<double>(sets[s].intervals.size());
    if (n >= 12.0 && n >= 0.75 * usual && n <= 1.25 * usual) {
      candidates.push_back(s);
    }
  }
  constexpr std::size_t most = 6;  // thresholds to try; neighbouring thresholds give similar rests
  const std::size_t step = 1 + candidates.size() / most;
  RestTurns source(log, options, rests.rate_hz);
  TurnFitOptions turn_options = options.turns;
  turn_options.tolerance = 1e-4;
  turn_options.whole_budget = false;
  const auto quality_at = [&](std::size_t set) {
    rests.intervals = sets[set].intervals;
    try {
      return quality_of(rests, options, source, turn_options);
    } catch (const RefusedError&) {
      return RestQuality();  // infinite error: these rests do not determine the fit
    }
  };
  // The threshold of most_persistent() is replaced only if another one is clearly better, because
  // small differences are due to chance.
  constexpr double clearly = 0.8;
  std::size_t best = persistent;
  const RestQuality all = quality_at(persistent);
  RestQuality least = all;
  for (std::size_t c = 0; c < candidates.size(); c += step) {
    const RestQuality quality = quality_at(candidates[c]);
    if (quality.error() < std::min(least.error(), clearly * all.error())) {
      least = quality;
      best = candidates[c];
    }
  }
  inverse = least.inverse;
  const std::size_t kept = sets[best].intervals.size();
  if (kept < sets[persistent].intervals.size()) {
    notes.push_back(formatted(
        "{} of {} rests are left out, because the coefficients are better without them: the {} "
        "scatter by {}{} without these rests, and by {} with all rests",
        sets[persistent].intervals.size() - kept, sets[persistent].intervals.size(),
        options.gyroscope.empty() ? "magnitudes of gravity"
                                  : "errors of the attitudes that the "
                                    "gyroscope predicts",
        number_text(least.scatter * (options.gyroscope.empty() ? 1.0 : deg_per_rad), 2),
        options.gyroscope.empty() ? " g" : " degrees",
        std::isfinite(all.scatter)
            ? number_text(all.scatter * (options.gyroscope.empty() ? 1.0 : deg_per_rad), 2)
            : std::string("an unknown amount, because the fit fails")));
  }
  return best;
}

// @return the label of the first rest if its fence face is stated; otherwise nullopt.
std::optional<DesignPoint> first_point(const ImuOptions& options,
                                       const std::vector<std::optional<Face>>& faces) {
  if (!options.first || faces.empty() || !faces.front() ||
      axis_of(*options.first) == axis_of(*faces.front())) {
    return std::nullopt;
  }
  return DesignPoint(*faces.front(), *options.first);
}

// Thrown if the gyroscope cannot be calibrated. The other instruments may still be calibrated.
class GyroscopeRefused : public RefusedError {
 public:
  using RefusedError::RefusedError;
};

// Finds the sections of a log, of at least `fewest` rows, in which all given columns are constant.
// @return for each section, the index of its first row and one past the index of its last row.
std::vector<std::pair<std::size_t, std::size_t>> frozen_spans(const RecordedLog& log,
                                                              const std::vector<std::string>& names,
                                                              std::size_t fewest) {
  std::vector<const std::vector<double>*> columns;
  for (const std::string& name : names) {
    const std::optional<std::size_t> column = find_column(log.columns, name);
    if (column) {
      columns.push_back(&log.samples[*column]);
    }
  }
  std::vector<std::pair<std::size_t, std::size_t>> spans;
  const std::size_t n = columns.empty() ? 0 : columns.front()->size();
  std::size_t first = 0;
  for (std::size_t i = 1; i <= n; ++i) {
    const bool same = i < n && std::all_of(columns.begin(), columns.end(), [&](const auto* column) {
                        return (*column)[i] == (*column)[i - 1];
                      });
    if (!same) {
      if (i - first >= fewest) {
        spans.emplace_back(first, i);
      }
      first = i;
    }
  }
  return spans;
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
    try {
      calibrate_accelerometer();
    } catch (const RefusedError& error) {
      if (options_.magnetometer.empty()) {
        throw;
      }
      result_.accelerometer_failed = true;
      result_.failed.push_back({.slot = "accelerometer", .message = error.what()});
    }
    if (!options_.gyroscope.empty() && result_.accelerometer_failed) {
      result_.failed.push_back(
          {.slot = "gyroscope",
           .message = "the fit of the gyroscope requires the attitudes from the accelerometer, but "
                      "the calibration of the accelerometer was refused"});
    } else if (!options_.gyroscope.empty()) {
      try {
        calibrate_gyroscope();
      } catch (const RefusedError& error) {
        throw GyroscopeRefused(error.what());
      }
    }
    if (!options_.magnetometer.empty()) {
      try {
        calibrate_magnetometer();
      } catch (const RefusedError& error) {
        // If the magnetometer cannot be calibrated, the results for the other sensors are still
        // valid.
        result_.rests.warnings.push_back(
            formatted("the magnetometer is left out: {}", error.what()));
        result_.failed.push_back({.slot = "magnetometer", .message = error.what()});
      }
    }
    if (result_.accelerometer_failed && !result_.magnetometer) {
      throw RefusedError(result_.failed.front().message);
    }
    result_.notes.insert(result_.notes.end(), log_.notes.begin(), log_.notes.end());
    result_.notes.insert(result_.notes.end(), result_.rests.notes.begin(),
                         result_.rests.notes.end());
    if (!result_.accelerometer_failed) {
      warn(result_.accelerometer);
    }
    for (std::optional<Calibration>* one : {&result_.gyroscope, &result_.magnetometer}) {
      if (*one) {
        warn(**one);
      }
    }
    return std::move(result_);
  }

 private:
  // Adds the warnings and notes about the log and about the poses of the instrument to a record.
  void warn(Calibration& record) const {
    const auto add = [&](WarningCode code, const std::vector<std::string>& messages) {
      for (const std::string& message : messages) {
        record.findings.warnings.push_back({.code = code, .message = message});
        record.findings.status = std::max(record.findings.status, CalibrationStatus::warning);
      }
    };
    add(WarningCode::log, result_.rests.warnings);
    for (const std::string& note : settling_notes_) {
      record.findings.notes.push_back({NoteCode::input, note});
    }
    if (result_.seats) {
      add(WarningCode::seat, result_.seats->messages);
    }
  }

  void find_rests() {
    SegmentOptions segment_options = options_.segment;
    if (segment_options.columns.empty()) {
      // A turn by hand changes the readings of the gyroscope earlier than those of the
      // accelerometer.
      segment_options.columns =
          options_.gyroscope.empty() ? options_.accelerometer : options_.gyroscope;
    }
    segment_options.attitude = options_.accelerometer;
    const auto choose = [&](const std::vector<IntervalSet>& sets, const Segmentation& so_far) {
      return options_.seats != Seats::unknown  // six faces are too few for best_by_scatter()
                 ? most_persistent(sets)
                 : best_by_scatter(log_, options_, sets, so_far, result_.notes, gyroscope_inverse_);
    };
    const auto rests_by = [&](const SegmentOptions& options) {
      LogFile file(log_.name, log_.columns, log_.samples);
      return segment(file, options, choose);
    };
    result_.rests = rests_by(segment_options);
    leave_frozen_out(segment_options, rests_by);
    find_settled_rests(segment_options);
    accelerations_ = means_of(settled(), options_.accelerometer);
  }

  // @return true if the noise (standard deviation) of at least one axis at rest is more than 0.7
  //         times the resolution of its readings. The readings of such a sensor are constant only
  //         in a sleep mode.
  [[nodiscard]] bool scatters_by_steps(const Segmentation& rests) const {
    for (const std::vector<std::string>* names : {&options_.accelerometer, &options_.gyroscope}) {
      for (const std::string& name : *names) {
        const std::optional<std::size_t> column = find_column(log_.columns, name);
        const std::optional<std::size_t> of_rests = find_column(rests.columns, name);
        if (!column || !of_rests) {
          continue;
        }
        double step = std::numeric_limits<double>::infinity();
        const std::vector<double>& values = log_.samples[*column];
        for (std::size_t i = 1; i < values.size(); ++i) {
          const double change = std::abs(values[i] - values[i - 1]);
          step = change > 0.0 ? std::min(step, change) : step;
        }
        std::vector<double> sds;
        for (const StaticInterval& interval : rests.intervals) {
          sds.push_back(interval.sd(static_cast<Eigen::Index>(*of_rests)));
        }
        constexpr double about_a_step = 0.7;
        if (!sds.empty() && upper_median(sds) > about_a_step * step) {
          return true;
        }
      }
    }
    return false;
  }

  // Leaves out the samples during which a sensor is in a sleep mode, in which it repeats one value
  // even if it moves. If the noise of a sensor is below its resolution, the samples are kept,
  // because such a sensor also repeats one value at rest.
  // @param options  receives the ranges of these samples.
  void leave_frozen_out(SegmentOptions& options,
                        const std::function<Segmentation(const SegmentOptions&)>& rests_by) {
    SegmentOptions awake = options;
    const auto fewest = static_cast<std::size_t>(std::max(30.0, result_.rests.rate_hz));
    for (const std::vector<std::string>* columns : {&options_.accelerometer, &options_.gyroscope}) {
      const auto spans = frozen_spans(log_, *columns, fewest);
      awake.left_out.insert(awake.left_out.end(), spans.begin(), spans.end());
    }
    if (awake.left_out.empty()) {
      return;
    }
    std::sort(awake.left_out.begin(), awake.left_out.end());
    std::size_t samples = 0;
    for (const auto& [first, end] : awake.left_out) {
      samples += end - first;
    }
    const std::size_t before = result_.rests.intervals.size();
    std::vector<std::string> notes = result_.notes;
    try {
      Segmentation rests = rests_by(awake);
      constexpr std::size_t fewest_rests = 6;
      if (rests.intervals.size() >= fewest_rests && 3 * rests.intervals.size() >= before &&
          scatters_by_steps(rests)) {
        result_.rests = std::move(rests);
        options = awake;
        result_.notes.push_back(formatted(
            "{} samples ({} %) are left out, because one value is repeated for a second or longer, "
            "as by a sensor in a sleep mode",
            samples,
            number_text(
                100.0 * static_cast<double>(samples) / static_cast<double>(result_.rests.samples),
                2)));
        return;
      }
    } catch (const RefusedError&) {
      // Without these samples no rests are found, so the samples are kept.
    }
    result_.notes = std::move(notes);
  }

  // Finds the settled part of each rest. Accelerometer and magnetometer are calibrated from these
  // parts. The gyroscope is calibrated from the whole rests, because the turns end where they
  // begin.
  // @param options  the options with which the rests were found.
  void find_settled_rests(const SegmentOptions& options) {
    std::vector<const std::vector<double>*> columns;
    for (const std::string& name : options_.accelerometer) {
      columns.push_back(&log_.samples[find_column(log_.columns, name).value()]);
    }
    const UnsettledRests unsettled = find_unsettled_rests(result_.rests.intervals, columns);
    if (unsettled.spans.empty()) {
      return;
    }
    LogFile file(log_.name, log_.columns, log_.samples);
    settled_ = settled_rests(file, options, result_.rests, unsettled);
    std::vector<std::string>& told =
        settled_ && unsettled.settles ? settling_notes_ : result_.rests.warnings;
    told.push_back(sentence_about(unsettled, settled_.has_value()));
  }

  [[nodiscard]] const Segmentation& settled() const { return settled_ ? *settled_ : result_.rests; }

  void label() {
    if (options_.seats == Seats::sheet) {
      result_.seats = label_by_sheet(resting_faces(accelerations_), options_.sheet);
      check_fences(log_, result_.rests, options_, *result_.seats);
    } else {
      result_.seats = recognise_seats(log_, result_.rests, options_, result_.notes);
    }
  }

  [[nodiscard]] Observations observations_of(const std::vector<std::string>& columns) const {
    const Observations all = readings_of(settled(), columns);
    return result_.seats ? labelled(all, *result_.seats, options_.sheet) : all;
  }

  // Sets the fields from the faces if the instrument lay only on its six faces. These are too few
  // attitudes for the method `magnitude`, but the face on the table is known for each rest.
  void take_six_faces(Experiment& experiment, Observations& observations) {
    std::vector<std::optional<Face>> faces;
    try {
      faces = faces_by_gravity(observations);
    } catch (const RefusedError&) {
      faces.clear();  // some faces are missing
    }
    const std::set<std::optional<Face>> all(faces.begin(), faces.end());
    const bool are_faces = all.size() == all_faces.size() && !all.contains(std::nullopt);
    constexpr Eigen::Index enough = 10;  // rests that are enough for the method `magnitude`
    if (!are_faces && observations.size() >= enough) {
      return;
    }
    if (!are_faces) {
      throw RefusedError(formatted(
          "the log contains {} rest{} of {} s or more, but a calibration needs rests in many "
          "attitudes: lay the instrument on each of its six faces, or better in twelve or more "
          "orientations, for some seconds each, and record a new log",
          observations.size(), observations.size() == 1 ? "" : "s",
          number_text(options_.segment.shortest_s, 2)));
    }
    assume_level_table(make_field_description(experiment).magnitude, faces, observations);
    result_.notes.emplace_back(
        "the instrument lay on its six faces, which were recognised by gravity");
  }

  void calibrate_accelerometer() {
    if (options_.known_accelerometer) {
      result_.accelerometer = *options_.known_accelerometer;
      result_.accelerometer_was_known = true;
      result_.notes.emplace_back("the given record of the accelerometer is used unchanged");
      return;
    }
    Experiment experiment = options_.experiment;
    if (experiment.instrument.kind.empty()) {
      experiment.instrument.kind = "accelerometer";
    }
    experiment.instrument.axes = options_.accelerometer;
    set_default_field(experiment);
    // All rests get the same weight. If a board is rotated by hand, the errors of the model are
    // larger than the noise of a mean over one second.
    experiment.fit.weighting = experiment.fit.weighting.value_or(Weighting::none);
    Observations observations = observations_of(options_.accelerometer);
    if (!result_.seats && !experiment.fit.method) {
      take_six_faces(experiment, observations);
    }
    result_.accelerometer = calibrate(experiment, observations);
    result_.accelerometer.provenance.slot = "accelerometer";
  }

  void calibrate_gyroscope() {
    const Eigen::MatrixX3d ups =
        fields_by(result_.accelerometer.sensor.response, accelerations_).rowwise().normalized();
    const RestFit rests = fit_rests(means_of(result_.rests, options_.gyroscope), ups,
                                    mean_uncertainties_of(result_.rests, options_.gyroscope));
    std::vector<std::size_t> between;
    for (const std::size_t rest : all_rests(result_.rests)) {
      if (!result_.seats || result_.seats->points[rest]) {
        between.push_back(rest);
      }
    }
    RestTurns source(log_, options_, result_.rests.rate_hz);
    std::vector<GyroscopeTurn> turns = source.turns(result_.rests, between, ups);
    const Eigen::MatrixX3d& means = accelerations_;
    for (std::size_t t = 0; t < turns.size(); ++t) {
      const auto [before, after] = source.ends[t];
      between_directions(result_.accelerometer, means.row(static_cast<Eigen::Index>(before)),
                         means.row(static_cast<Eigen::Index>(after)), turns[t]);
      if (result_.seats) {
        set_turn_between_seats(
            options_.experiment.positioner, options_.experiment.rotation_sensor_from_positioner,
            *result_.seats->points[before], *result_.seats->points[after], turns[t]);
      }
    }
    TurnFitOptions turn_options = options_.turns;
    // gyroscope_inverse_ refers to the frame of an accelerometer that was fitted to this log. If a
    // calibration of the accelerometer was given, that accelerometer's frame may differ.
    if (gyroscope_inverse_ && !options_.known_accelerometer && !turn_options.start) {
      turn_options.start = gyroscope_inverse_;
    }
    set_earth_rotation(options_.experiment.table.site, turns, turn_options);
    result_.turns = fit_turns(turns, rests, turn_options);
    Calibration record = turn_calibration(*result_.turns,
                                          {.kind = "gyroscope",
                                           .serial = options_.experiment.instrument.serial,
                                           .axes = options_.gyroscope,
                                           .unit = options_.gyroscope_unit},
                                          rests.sd);
    record.provenance.slot = "gyroscope";
    if (source.left_out > 0) {
      record.findings.notes.push_back(
          {NoteCode::turns,
           formatted("{} turns with missing samples are left out", source.left_out)});
    }
    if (!rests.remark.empty()) {
      record.findings.notes.push_back({NoteCode::correlation, rests.remark});
    }
    result_.g_sensitivity = rests.g_sensitivity;
    result_.g_sensitivity_se = rests.g_sensitivity_se;
    if (rests.g_sensitivity && rests.p_value.minCoeff() < 1e-3) {
      record.findings.notes.push_back(
          {NoteCode::turns, formatted("the mean readings at rest depend on the direction of "
                                      "gravity: g-sensitivity of up to {} {} (standard error {})",
                                      number_text(rests.g_sensitivity->cwiseAbs().maxCoeff(), 3),
                                      unit_per(record.sensor.instrument.unit, "g"),
                                      number_text(rests.g_sensitivity_se->maxCoeff(), 2))});
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
    // A site without a longitude is enough for gravity, but not for the magnetic field.
    const bool has_site = experiment.table.site && experiment.table.has_longitude;
    if (!experiment.field.magnitude && !has_site && !experiment.field.in_table) {
      experiment.field = CustomField();
    } else if (!experiment.field.is_stated()) {
      experiment.field.of = std::make_shared<const GeomagneticField>();
    }
    experiment.fit.weighting = experiment.fit.weighting.value_or(Weighting::none);
    experiment.fit.method.reset();
    // align_with_companion() later aligns the frame with that of the accelerometer.
    experiment.fit.shape = MagnitudeShape::symmetric;
    const Observations observations = observations_of(options_.magnetometer);
    Calibration record = calibrate(experiment, observations);
    record.provenance.slot = "magnetometer";
    if (!result_.seats && !result_.accelerometer_failed) {
      align_with_companion(record, observations, result_.accelerometer,
                           observations_of(options_.accelerometer), "accelerometer");
    }
    result_.magnetometer = std::move(record);
  }

  const RecordedLog& log_;
  const ImuOptions& options_;
  ImuCalibration result_;
  // Inverse of the gyroscope's sensitivity, from best_by_scatter().
  std::optional<Eigen::Matrix3d> gyroscope_inverse_;
  std::optional<Segmentation> settled_;  // nullopt: the whole rests are used
  std::vector<std::string> settling_notes_;
  Eigen::MatrixX3d accelerations_;  // accelerometer's means at settled()
};

}  // namespace

std::vector<Calibration> ImuCalibration::records() const {
  std::vector<Calibration> all;
  if (!accelerometer_was_known && !accelerometer_failed) {
    all.push_back(accelerometer);
  }
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
  const Eigen::MatrixX3d ups = approximate_up_directions(means);
  const std::string open_start =
      options.first
          ? ""
          : "; the fence face of the first rest is assumed as in the standard design, so the "
            "direction of the table's slope is unknown (give the fence face of the first rest)";
  if (!options.gyroscope.empty()) {
    RestTurns source(log, options, rests.rate_hz);
    const std::vector<GyroscopeTurn> turns = source.turns(rests, all_rests(rests), ups);
    if (source.left_out == 0) {
      const RestFit still = fit_rests(means_of(rests, options.gyroscope), ups);
      // The gyroscope is needed, because gravity does not determine rotations about the vertical.
      // Approximate rotations are enough for label_by_turns(), which compares them with the design
      // points.
      TurnFitOptions turn_options = options.turns;
      turn_options.rotations_only = true;
      const TurnFit fit = fit_turns(turns, still, turn_options);
      notes.push_back("the fence faces are recognised by the gyroscope" + open_start);
      return label_by_turns(faces, integrated_rotations(turns, fit), first_point(options, faces));
    }
    if (options.magnetometer.empty()) {
      throw RefusedError(formatted("the gyroscope lacks samples in {} of the turns, so it cannot "
                                   "show the fence faces; give the run sheet",
                                   source.left_out),
                         {settings::run_sheet});
    }
  }
  if (!options.magnetometer.empty()) {
    notes.push_back("the fence faces are recognised by the magnetometer" + open_start);
    return label_by_heading(faces, ups, centred(means_of(rests, options.magnetometer)),
                            first_point(options, faces));
  }
  notes.emplace_back(
      "the log contains neither a gyroscope nor a magnetometer to recognise the fence faces; they "
      "are assumed in the order of the standard design, so the computed slope of the table is "
      "meaningless");
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
    return;  // the fence faces cannot be recognised
  }
  for (std::size_t i = 0; i < labels.points.size(); ++i) {
    if (labels.points[i] && seen.points[i] && labels.points[i]->rest() == seen.points[i]->rest() &&
        labels.points[i]->fence() != seen.points[i]->fence()) {
      labels.messages.push_back(formatted(
          "rest {}: the sheet states {}, but the {} shows face {} at the fence; was the cube "
          "turned as planned?",
          i + 1, labels.points[i]->name(), options.gyroscope.empty() ? "magnetometer" : "gyroscope",
          face_name(seen.points[i]->fence())));
    }
  }
}

ImuCalibration calibrate_imu(const RecordedLog& log, const ImuOptions& options) {
  try {
    return ImuCalibrator(log, options).run();
  } catch (const GyroscopeRefused& refused) {
    ImuOptions without = options;  // rests are then detected in the accelerometer's columns
    without.gyroscope.clear();
    ImuCalibration imu = ImuCalibrator(log, without).run();
    imu.failed.insert(imu.failed.begin(), {.slot = "gyroscope", .message = refused.what()});
    return imu;
  }
}

}  // namespace axiscal
