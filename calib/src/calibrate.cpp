// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/calibrate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include <Eigen/QR>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/version.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "estimation.hpp"
#include "warnings.hpp"

namespace axiscal {
namespace {

bool brings_field(const Observations& observations) {
  return !observations.readings.empty() &&
         std::all_of(observations.readings.begin(), observations.readings.end(),
                     [](const Reading& reading) { return reading.field_in_sensor.has_value(); });
}

bool has_labels(const Observations& observations) {
  return !observations.readings.empty() &&
         std::all_of(observations.readings.begin(), observations.readings.end(),
                     [](const Reading& reading) { return reading.point.has_value(); });
}

bool every_reading_has_its_opposite(const Observations& observations) {
  using Key = std::tuple<int, double, DesignPoint>;
  std::set<Key> there;
  for (const Reading& reading : observations.readings) {
    there.emplace(reading.block, reading.level, *reading.point);
  }
  return std::all_of(there.begin(), there.end(), [&](const Key& key) {
    const auto& [block, level, point] = key;
    return there.contains({block, level, point.turned_round()});
  });
}

bool lies_along_normal(const FieldSetup& field) {
  if (field.in_table) {
    return field.in_table->x() == 0.0 && field.in_table->y() == 0.0;
  }
  return field.kind == "gravity" && !field.custom;
}

void check(const Experiment& experiment, const Observations& observations) {
  const Instrument& instrument = experiment.instrument;
  if (instrument.kind.empty()) {
    throw SetupError(
        "the kind of instrument is not stated; give --instrument accelerometer, "
        "inclinometer or generic");
  }
  static_cast<void>(find_instrument_kind(instrument.kind));
  try {
    check_axes(instrument);
  } catch (const DomainError& error) {
    throw SetupError(error.what());
  }
  if (observations.response.rows() != observations.size() ||
      observations.response.cols() != instrument.axis_count() ||
      !observations.response.allFinite()) {
    throw DomainError(
        "calibrate: the responses must be finite, a row for each reading and a "
        "column for each axis");
  }
  const bool bad_samples =
      observations.samples && (observations.samples->size() != observations.size() ||
                               !(observations.samples->array() > 0.0).all());
  const bool bad_sd = observations.response_sd &&
                      (observations.response_sd->rows() != observations.response.rows() ||
                       observations.response_sd->cols() != observations.response.cols());
  if (bad_samples || bad_sd) {
    throw DomainError(
        "calibrate: samples must be positive, one for each reading, and standard deviations as "
        "many as responses");
  }
  // Beyond this squares overflow; no instrument reads such numbers.
  constexpr double largest = 1e150;
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    const Reading& reading = observations.readings[i];
    if (!(observations.response.row(static_cast<Eigen::Index>(i)).cwiseAbs().maxCoeff() <
          largest) ||
        (reading.field_in_sensor && !(reading.field_in_sensor->cwiseAbs().maxCoeff() < largest))) {
      throw RefusedError("run " + std::to_string(reading.run) +
                         ": a value of 1e150 or more is no reading; correct it or leave it out");
    }
  }
  for (const Reading& reading : observations.readings) {
    const Reading& first = observations.readings.front();
    if (reading.point.has_value() != first.point.has_value() ||
        reading.field_in_sensor.has_value() != first.field_in_sensor.has_value() ||
        (!reading.point && !reading.field_in_sensor)) {
      throw DomainError("calibrate: every reading needs its design point, or every one its field");
    }
    if (reading.level != 1.0 && experiment.field.kind == "gravity") {
      throw RefusedError("run " + std::to_string(reading.run) + ": level " +
                         number_text(reading.level) +
                         ", but gravity cannot be set; its level is always 1");
    }
  }
  if (!is_rotation(experiment.rotation_sensor_from_positioner)) {
    throw DomainError("calibrate: rotation_sensor_from_positioner is no rotation");
  }
}

// Rows of the readings that are used.
std::vector<std::size_t> used_rows(const Experiment& experiment, const Observations& observations) {
  const std::vector<int>& leave_out = experiment.leave_out;
  for (const int run : leave_out) {
    const bool there = std::any_of(observations.readings.begin(), observations.readings.end(),
                                   [run](const Reading& reading) { return reading.run == run; });
    if (!there) {
      throw SetupError("--leave-out: there is no run " + std::to_string(run));
    }
  }
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    if (std::find(leave_out.begin(), leave_out.end(), observations.readings[i].run) ==
        leave_out.end()) {
      rows.push_back(i);
    }
  }
  if (rows.empty()) {
    throw RefusedError("no readings are left to calibrate with");
  }
  return rows;
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
    if (!(observations.response_sd->array() > 0.0).all()) {
      throw RefusedError("weights sd: a standard deviation in a column AXIS_sd is not positive");
    }
    return observations.response_sd->cwiseAbs2().cwiseInverse();
  }
  return Eigen::MatrixXd::Ones(n, m);
}

void give_each_block_its_level(ReadingSet& set) {
  std::map<int, std::size_t> position;
  for (const Reading& reading : set.readings) {
    position.emplace(reading.block, 0);
  }
  set.level_blocks.clear();
  for (auto& [block, at] : position) {
    at = set.level_blocks.size();
    set.level_blocks.push_back(block);
  }
  for (const Reading& reading : set.readings) {
    set.levels.push_back(position.at(reading.block));
  }
}

ReadingSet make_reading_set(const Experiment& experiment,
                            const Observations& observations,
                            const std::vector<std::size_t>& rows,
                            Weighting weighting,
                            Method method) {
  const Eigen::MatrixXd weights = weights_of(observations, weighting);
  const auto n = static_cast<Eigen::Index>(rows.size());
  ReadingSet set;
  set.axes = experiment.instrument.axes;
  set.robust = experiment.robust;
  set.response.resize(n, observations.response.cols());
  set.weights.resize(n, observations.response.cols());
  set.orientation = [&experiment](const DesignPoint& point) -> Eigen::Matrix3d {
    return experiment.rotation_sensor_from_positioner *
           experiment.positioner.rotation_table_from_positioner(point).transpose();
  };
  const bool by_field = method == Method::known && brings_field(observations);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto from = static_cast<Eigen::Index>(rows[i]);
    const auto to = static_cast<Eigen::Index>(i);
    set.readings.push_back(observations.readings[rows[i]]);
    set.response.row(to) = observations.response.row(from);
    set.weights.row(to) = weights.row(from);
    if (!by_field) {
      set.rotation_sensor_from_table.push_back(set.orientation(*set.readings.back().point));
    }
  }
  for (Eigen::Index k = 0; k < set.weights.cols(); ++k) {
    set.weights.col(k) /= set.weights.col(k).mean();
  }
  if (experiment.level_by == LevelBy::block) {
    give_each_block_its_level(set);
  }
  return set;
}

void add_intervals(Calibration& calibration) {
  FitStatistics& statistics = *calibration.statistics;
  const Eigen::Index m = calibration.response.bias.size();
  statistics.parameter_names = parameter_names(calibration.instrument.axes);
  statistics.bias_se.resize(m);
  statistics.sensitivity_se.resize(m, 3);
  statistics.coverage_factor.resize(m);
  for (Eigen::Index k = 0; k < m; ++k) {
    const Eigen::Vector4d se = statistics.covariance.diagonal().segment<4>(4 * k).cwiseSqrt();
    statistics.bias_se(k) = se(0);
    statistics.sensitivity_se.row(k) = se.tail<3>();
    statistics.coverage_factor(k) = student_t_factor(0.95, statistics.degrees_of_freedom(k));
  }
}

// The field in the table of the whole run: the mean direction where each block has its own.
std::optional<Eigen::Vector3d> mean_field(const std::vector<Eigen::Vector3d>& fields) {
  if (fields.size() <= 1) {
    return fields.empty() ? std::nullopt : std::optional(fields.front());
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& field : fields) {
    sum += field;
  }
  return fields.front().norm() * sum.normalized();
}

// Residuals of all readings, left out or not, in the order of the file.
std::vector<ReadingResidual> residuals_of(const Observations& observations,
                                          const ReadingSet& set,
                                          const std::vector<Eigen::Vector3d>& fields,
                                          const Positioner& positioner,
                                          const Calibration& calibration,
                                          const std::vector<bool>& used) {
  const LinearResponse& response = calibration.response;
  const bool by_field = set.rotation_sensor_from_table.empty();
  std::map<int, Eigen::Vector3d> field_of_block;
  for (std::size_t s = 0; s < fields.size() && fields.size() > 1; ++s) {
    field_of_block[set.level_blocks[s]] = fields[s];
  }
  const auto field_in_table = [&](const Reading& reading) -> const Eigen::Vector3d& {
    const auto found = field_of_block.find(reading.block);
    return found == field_of_block.end() ? *calibration.field.in_table : found->second;
  };
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> inverse(response.sensitivity);
  const bool has_magnitude = inverse.rank() == 3;
  std::vector<ReadingResidual> residuals;
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    const Reading& reading = observations.readings[i];
    if (!used[i] && reading.point && !positioner.seat(*reading.point).defect.empty()) {
      // Left out as the cube cannot lie so: there is no field to hold the reading against.
      residuals.push_back({.run = reading.run,
                           .point = reading.point,
                           .response = Eigen::VectorXd::Constant(
                               response.bias.size(), std::numeric_limits<double>::quiet_NaN()),
                           .magnitude = std::numeric_limits<double>::quiet_NaN(),
                           .used = false});
      continue;
    }
    const Eigen::Vector3d field =
        by_field ? *reading.field_in_sensor
                 : reading.level * (set.orientation(*reading.point) * field_in_table(reading));
    const Eigen::VectorXd v = observations.response.row(static_cast<Eigen::Index>(i));
    ReadingResidual residual{.run = reading.run, .point = reading.point};
    residual.response = v - response.at(field);
    residual.magnitude = std::numeric_limits<double>::quiet_NaN();
    if (has_magnitude) {
      const Eigen::Vector3d measured = inverse.solve(v - response.bias);
      residual.magnitude = measured.norm() - field.norm();
    }
    if (observations.has_level) {
      residual.level = reading.level;
    }
    if (observations.has_block) {
      residual.block = reading.block;
    }
    residual.temperature = reading.temperature;
    residual.used = used[i];
    residuals.push_back(std::move(residual));
  }
  return residuals;
}

void add_notes(Calibration& calibration,
               const Observations& observations,
               const Positioner& positioner) {
  const auto m = calibration.response.bias.size();
  if (m < 3) {
    calibration.notes.emplace_back(
        "with fewer than three axes readings give the field along each axis and that axis's angle, "
        "not all three components");
  }
  for (const RegressionRow& row : calibration.statistics->rows) {
    for (Eigen::Index k = 0; k < row.robust_weight.size(); ++k) {
      if (row.robust_weight(k) == 0.0) {
        calibration.notes.push_back(name_of_runs(row.runs) + ": given no weight for axis " +
                                    calibration.instrument.axes[static_cast<std::size_t>(k)] +
                                    " by the robust regression");
      }
    }
  }
  std::set<DesignPoint> points;
  for (const Reading& reading : observations.readings) {
    if (reading.point) {
      points.insert(*reading.point);
    }
  }
  for (std::string& remark : rocking_remarks(positioner, points)) {
    calibration.notes.push_back(std::move(remark));
  }
  std::set<int> runs;
  for (const Reading& reading : observations.readings) {
    runs.insert(reading.run);
  }
  if (runs.size() < observations.readings.size()) {
    calibration.notes.emplace_back(
        "some readings have the same run number; messages cannot tell "
        "them apart");
  }
}

}  // namespace

Method choose_method(const Experiment& experiment, const Observations& observations) {
  if (experiment.method) {
    return *experiment.method;
  }
  if (!brings_field(observations) && !has_labels(observations)) {
    throw DomainError("choose_method: the readings have neither design points nor fields");
  }
  if (brings_field(observations)) {
    return Method::known;
  }
  return lies_along_normal(experiment.field) && every_reading_has_its_opposite(observations)
             ? Method::paired
             : Method::joint;
}

Calibration calibrate(const Experiment& experiment, const Observations& observations) {
  check(experiment, observations);
  const std::vector<std::size_t> rows = used_rows(experiment, observations);
  Observations used;
  for (const std::size_t row : rows) {
    used.readings.push_back(observations.readings[row]);
  }
  const Method method = choose_method(experiment, used);
  const bool by_field = method == Method::known && brings_field(observations);
  if (!by_field && !has_labels(observations)) {
    throw RefusedError("method " + std::string(method_name(method)) +
                       ": the readings have no design points; give columns 'rest' and 'fence', or "
                       "use --method known with fx,fy,fz");
  }
  const Weighting weighting =
      experiment.weighting.value_or(observations.samples ? Weighting::samples : Weighting::none);

  Calibration calibration;
  calibration.created = timestamp_now();
  calibration.software = software_name();
  calibration.instrument = experiment.instrument;
  calibration.field = make_field_description(experiment);
  calibration.method = method_name(method);
  calibration.weights = weighting_name(weighting);
  calibration.robust = experiment.robust;
  calibration.positioner = experiment.positioner.id();
  calibration.slot = experiment.slot;
  calibration.level_by_block = experiment.level_by == LevelBy::block;
  calibration.left_out = experiment.leave_out;
  if (method == Method::known && experiment.level_by == LevelBy::block) {
    throw SetupError(
        "method known takes the field as given and estimates no levelness; level by block goes "
        "with "
        "paired and joint");
  }
  const double stated = calibration.field.magnitude;
  if (!by_field && method == Method::known && calibration.field.in_table &&
      !(std::abs(calibration.field.in_table->norm() / stated - 1.0) <= 1e-6)) {
    throw SetupError("method known: the field in the table has the length " +
                     number_text(calibration.field.in_table->norm()) +
                     ", but its magnitude is given as " + number_text(stated) +
                     "; give one of them");
  }
  if (!by_field && !calibration.field.in_table) {
    throw SetupError("field " + calibration.field.kind +
                     ": give the vector in the table's frame with --field-table X,Y,Z");
  }

  const ReadingSet set = make_reading_set(experiment, observations, rows, weighting, method);
  // The magnitude that was given is F; in_table gives the direction.
  std::optional<Eigen::Vector3d> in_table = calibration.field.in_table;
  if (in_table && method != Method::known) {
    in_table = calibration.field.magnitude * in_table->normalized();
  }
  Estimate estimate = method == Method::paired ? estimate_paired(set, *in_table)
                      : method == Method::joint
                          ? estimate_joint(set, *in_table)
                          : estimate_known(set, by_field ? std::nullopt : in_table);
  calibration.response = std::move(estimate.response);
  calibration.statistics = std::move(estimate.statistics);
  calibration.field.in_table = mean_field(estimate.fields);
  calibration.field.in_table_covariance = estimate.field_covariance;
  calibration.field.in_table_degrees_of_freedom = estimate.field_degrees_of_freedom;
  calibration.levelness = std::move(estimate.levelness);
  std::vector<LackOfFit>& tests = calibration.statistics->lack_of_fit;
  if (std::none_of(tests.begin(), tests.end(),
                   [](const LackOfFit& test) { return test.pure_error_dof > 0.0; })) {
    tests.clear();
  }
  add_intervals(calibration);
  std::vector<bool> in_fit(observations.readings.size(), false);
  for (const std::size_t row : rows) {
    in_fit[row] = true;
  }
  std::vector<int> unpaired_runs;
  for (const std::size_t i : estimate.unpaired) {
    in_fit[rows[i]] = false;
    unpaired_runs.push_back(set.readings[i].run);
  }
  calibration.residuals =
      residuals_of(observations, set, estimate.fields, experiment.positioner, calibration, in_fit);
  add_notes(calibration, observations, experiment.positioner);
  calibration.warnings = find_warnings(calibration, estimate, std::move(unpaired_runs));
  const bool refused =
      std::any_of(calibration.warnings.begin(), calibration.warnings.end(),
                  [](const CalibrationWarning& w) { return w.code == "uncertain_direction"; });
  calibration.status = refused ? "refused" : calibration.warnings.empty() ? "ok" : "warning";
  return calibration;
}

}  // namespace axiscal
