// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/calibrate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include <Eigen/LU>
#include <Eigen/QR>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/version.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "bias_fit.hpp"
#include "culprit.hpp"
#include "estimate_by_method.hpp"
#include "estimation.hpp"
#include "generalized_fit.hpp"
#include "magnitude.hpp"
#include "reading_source.hpp"
#include "resolved_field.hpp"
#include "temperature_fit.hpp"
#include "uncertainty_sources.hpp"
#include "warnings.hpp"

namespace axiscal {
namespace {

bool brings_field(const Observations& observations) {
  return !observations.readings.empty() &&
         std::all_of(observations.readings.begin(), observations.readings.end(),
                     [](const Reading& reading) { return reading.field_in_sensor.has_value(); });
}

void check_temperature(const Experiment& experiment,
                       const std::vector<Reading>& readings,
                       Method method) {
  const TemperatureSetup& setup = experiment.temperature;
  if (setup.order == 0 && !setup.automatic && method != Method::bias) {
    return;
  }
  if (setup.order < 0 || (setup.order > 2 && method != Method::bias)) {
    throw SetupError("temperature order " + std::to_string(setup.order) +
                     ": must be 0, 1 or 2; method bias takes any");
  }
  for (const Reading& reading : readings) {
    if (!reading.temperature) {
      throw RefusedError("temperature terms need the column 'temperature'; run " +
                         std::to_string(reading.run) + " has none");
    }
  }
}

bool has_labels(const Observations& observations) {
  return !observations.readings.empty() &&
         std::all_of(observations.readings.begin(), observations.readings.end(),
                     [](const Reading& reading) { return reading.point.has_value(); });
}

// The runs whose opposite was not taken.
// @param soak  number of the soak level of each reading; empty: all of one.
std::vector<int> runs_without_opposite(const Observations& observations,
                                       const std::vector<int>& soak) {
  using Key = std::tuple<int, double, int, DesignPoint>;
  std::set<Key> there;
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    const Reading& reading = observations.readings[i];
    there.emplace(reading.block, reading.level, soak.empty() ? 0 : soak[i], *reading.point);
  }
  std::vector<int> runs;
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    const Reading& reading = observations.readings[i];
    if (!there.contains({reading.block, reading.level, soak.empty() ? 0 : soak[i],
                         reading.point->turned_round()})) {
      runs.push_back(reading.run);
    }
  }
  return runs;
}

// Why readings of a field along the normal cannot be paired; empty where they can.
std::string why_not_paired(const Experiment& experiment, const Observations& observations) {
  std::vector<int> soak;
  if (experiment.temperature.order > 0 || experiment.temperature.automatic) {
    std::vector<double> temperatures;
    for (const Reading& reading : observations.readings) {
      temperatures.push_back(reading.temperature.value_or(0.0));
    }
    soak = soak_levels(temperatures);
    if (soak.empty()) {
      return "opposite readings were not taken at one temperature";
    }
  }
  const std::vector<int> runs = runs_without_opposite(observations, soak);
  return runs.empty()
             ? ""
             : name_of_runs(runs) + (runs.size() == 1 ? " has" : " have") +
                   " no opposite reading (the same rest face, the fence face turned by 180 "
                   "degrees)";
}

bool lies_along_normal(const Experiment& experiment) {
  const FieldSetup& field = experiment.field;
  if (!field.others.empty() || field.sun || experiment.instrument.one_sided) {
    return false;
  }
  if (field.in_table) {
    return field.in_table->x() == 0.0 && field.in_table->y() == 0.0;
  }
  return !field.custom && (field.kind == "gravity" || field.kind == "induced_rotation");
}

// A field that no one can set, without another that can.
bool is_local(const FieldSetup& field) {
  return field.others.empty() && !field.custom &&
         (field.kind == "gravity" || field.kind == "geomagnetic" || field.kind == "earth_rotation");
}

void check_range(const Instrument& instrument) {
  if (instrument.range && !(instrument.range->low < instrument.range->high)) {
    throw SetupError("--range: LO must be less than HI");
  }
}

void check(const Experiment& experiment, const Observations& observations) {
  const Instrument& instrument = experiment.instrument;
  if (instrument.kind.empty()) {
    throw SetupError(
        "the kind of instrument is not stated; give --instrument accelerometer, magnetometer, ...");
  }
  static_cast<void>(find_instrument_kind(instrument.kind));
  check_range(instrument);
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
  if (experiment.noise_ratio.size() > 0 &&
      (experiment.noise_ratio.size() != instrument.axis_count() ||
       !(experiment.noise_ratio.array() > 0.0).all())) {
    throw SetupError("the noise ratio must have a positive number for each axis");
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
        (!reading.point && !reading.field_in_sensor &&
         experiment.method.value_or(Method::magnitude) < Method::magnitude)) {
      throw DomainError("calibrate: every reading needs its design point, or every one its field");
    }
    if (reading.level != 1.0 && is_local(experiment.field)) {
      throw RefusedError("run " + std::to_string(reading.run) + ": level " +
                         number_text(reading.level) + ", but " +
                         (experiment.field.kind == "gravity" ? "gravity" : "a local field") +
                         " cannot be set; its level is always 1");
    }
  }
  if (!is_rotation(experiment.rotation_sensor_from_positioner)) {
    throw DomainError("calibrate: rotation_sensor_from_positioner is no rotation");
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

// What the fit says that a reading should be; without labels only its direction is its own.
Eigen::VectorXd fitted_response(const Calibration& calibration,
                                const ReadingSource& source,
                                const Reading& reading,
                                const Eigen::Vector3d& field) {
  Eigen::VectorXd response = response_at(calibration, field, reading.temperature);
  for (const AlsoResponse& also : calibration.also) {
    response += also.sensitivity * (source.rotation(reading) * also.in_table);
  }
  return response;
}

// Residuals of all readings, left out or not, in the order of the file.
std::vector<ReadingResidual> residuals_of(const Observations& observations,
                                          const ReadingSource& source,
                                          const std::vector<Eigen::Vector3d>& fields,
                                          const Positioner& positioner,
                                          const Calibration& calibration,
                                          const AxisMask& used) {
  const LinearResponse& response = calibration.response;
  const bool by_magnitude = fields.empty() && !source.by_field();
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> inverse(response.sensitivity);
  const bool has_magnitude = inverse.rank() == 3;
  std::vector<ReadingResidual> residuals;
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    const Reading& reading = observations.readings[i];
    const auto row = static_cast<Eigen::Index>(i);
    ReadingResidual residual{.run = reading.run, .point = reading.point};
    residual.used = used.row(row).any();
    residual.response = Eigen::VectorXd::Constant(response.bias.size(), not_a_number);
    residual.magnitude = not_a_number;
    if (!residual.used && reading.point && !positioner.seat(*reading.point).defect.empty()) {
      // Left out as the cube cannot lie so: there is no field to hold the reading against.
      residuals.push_back(std::move(residual));
      continue;
    }
    const Eigen::VectorXd v = observations.response.row(row);
    const bool complete = source.in_range().row(row).all() && calibration.also.empty();
    const Eigen::Vector3d measured =
        has_magnitude
            ? Eigen::Vector3d(inverse.solve(
                  reading_at_reference(calibration, v, reading.temperature) - response.bias))
            : Eigen::Vector3d::Zero();
    const Eigen::Vector3d field =
        by_magnitude ? Eigen::Vector3d(calibration.field.magnitude * measured.normalized())
                     : source.field_in_sensor(reading, calibration.field, fields);
    const Eigen::VectorXd left = v - fitted_response(calibration, source, reading, field);
    for (Eigen::Index k = 0; k < left.size(); ++k) {
      // What an axis does not see, or cannot read, leaves nothing; a reading that was left out
      // does.
      const bool holds = source.in_range()(row, k) && (!residual.used || used(row, k));
      residual.response(k) = holds ? left(k) : not_a_number;
    }
    if (has_magnitude && complete && !calibration.instrument.one_sided) {
      residual.magnitude = measured.norm() - field.norm();
    }
    if (observations.has_level) {
      residual.level = reading.level;
    }
    if (observations.has_block) {
      residual.block = reading.block;
    }
    residual.temperature = reading.temperature;
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

Eigen::Matrix3d noise_of(const Observations& observations) {
  if (!observations.response_sd || observations.response.cols() != 3 ||
      !(observations.response_sd->array() > 0.0).all()) {
    return Eigen::Matrix3d::Identity();
  }
  return observations.response_sd->cwiseAbs2().colwise().mean().asDiagonal();
}

void check_method(const Experiment& experiment,
                  const Observations& observations,
                  Method method,
                  bool by_field) {
  const std::string name(method_name(method));
  if (!by_field && method != Method::magnitude && method != Method::bias &&
      !has_labels(observations)) {
    throw RefusedError("method " + name +
                       ": the readings have no design points; give columns 'rest' and 'fence', or "
                       "use --method known with fx,fy,fz, or magnitude");
  }
  const bool has_one_slope = method == Method::known || method == Method::magnitude;
  if (has_one_slope && experiment.level_by == LevelBy::block) {
    throw SetupError("method " + name +
                     " estimates no levelness; level by block goes with paired and joint");
  }
  if (!experiment.field.others.empty() &&
      (method == Method::paired || method == Method::magnitude ||
       experiment.level_by == LevelBy::block)) {
    throw SetupError(
        "a field of several parts goes with the methods joint and known, and one "
        "levelness for the run");
  }
  for (std::size_t i = 1; i < experiment.also.size(); ++i) {
    if (experiment.also[i].kind == experiment.also.front().kind) {
      throw SetupError("also " + experiment.also[i].kind + ": is there twice");
    }
  }
  if (!experiment.also.empty() && (by_field || method == Method::magnitude)) {
    throw SetupError(
        "a second field (also) needs design points and the methods paired, joint or "
        "known");
  }
  if (experiment.instrument.one_sided &&
      (method == Method::paired || method == Method::magnitude)) {
    throw SetupError("method " + name +
                     ": one-sided axes see a field from one side only; use joint or known");
  }
  if (method == Method::magnitude &&
      (experiment.temperature.order > 0 || experiment.temperature.automatic)) {
    throw SetupError(
        "method magnitude fits no temperature terms; give design points, or calibrate each "
        "temperature by itself");
  }
}

void check_levels(const Observations& observations, Method method) {
  for (const Reading& reading : observations.readings) {
    if (method == Method::magnitude && reading.level != 1.0) {
      throw RefusedError("run " + std::to_string(reading.run) + ": level " +
                         number_text(reading.level) +
                         ", but method magnitude takes the field's magnitude as the same in all "
                         "readings");
    }
  }
}

void check_known_magnitude(const FieldDescription& field) {
  if (field.in_table && field.parts.empty() &&
      !(std::abs(field.in_table->norm() / field.magnitude - 1.0) <= 1e-6)) {
    throw SetupError("method known: the field in the table has the length " +
                     number_text(field.in_table->norm()) + ", but its magnitude is given as " +
                     number_text(field.magnitude) + "; give one of them");
  }
}

// The parts as fitted, and what they make together at level 1.
void put_fields(FieldDescription& field, const std::vector<Eigen::Vector3d>& fields) {
  if (field.parts.empty()) {
    field.in_table = mean_field(fields);
    return;
  }
  if (fields.empty()) {
    field.in_table.reset();  // the readings bring theirs
    return;
  }
  for (std::size_t p = 0; p < fields.size(); ++p) {
    field.parts[p].in_table = fields[p];
    if (field.parts[p].free_length) {
      field.parts[p].magnitude = fields[p].norm();
    }
  }
  field.in_table = field.at_level(1.0);
  field.magnitude = field.in_table->norm();
}

// The fits of all orders that the temperatures allow.
std::vector<TemperatureOrderTrial> try_orders(Method method,
                                              ReadingSource& source,
                                              const std::vector<ResolvedPart>& parts,
                                              bool by_field) {
  constexpr int highest_order = 2;
  std::vector<TemperatureOrderTrial> trials;
  for (int order = 0; order <= highest_order; ++order) {
    source.set_temperature(order, std::nullopt);
    const ReadingSet set = source.set(parts, {});
    if (order > 0 && temperature_count(set) <= order) {
      break;
    }
    try {
      trials.push_back(trial_of(set, estimate_by(method, set, parts, by_field)));
    } catch (const RefusedError&) {
      if (order == 0) {
        throw;
      }
      break;  // the readings do not determine so many terms
    }
  }
  return trials;
}

void put_temperature(const Estimate& estimate,
                     const ReadingSource& source,
                     std::vector<TemperatureOrderTrial> trials,
                     Calibration& calibration) {
  if (!trials.empty()) {
    std::string text;
    for (const TemperatureOrderTrial& trial : trials) {
      text += (text.empty() ? "order " : ", order ") + std::to_string(trial.order) + " AICc " +
              number_text(trial.aicc, 4);
    }
    calibration.notes.push_back("temperature order " +
                                std::to_string(estimate.temperature_bias.cols()) +
                                " was chosen: " + text);
  }
  if (estimate.temperature_bias.cols() == 0) {
    return;
  }
  TemperatureResponse& temperature = calibration.temperature.emplace();
  temperature = source.temperature_range();
  temperature.bias = estimate.temperature_bias;
  temperature.scale = estimate.temperature_scale;
  temperature.bias_se = temperature.bias;
  temperature.scale_se = temperature.scale;
  temperature.trials = std::move(trials);
}

// @param one_sided  whose lowest value is the dark, which repeats as it likes.
std::vector<SaturatedAxis> find_saturated(const ReadingSet& set, bool one_sided) {
  std::vector<SaturatedAxis> found;
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    std::map<double, std::vector<int>> runs_at;
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      if (set.weights(i, k) > 0.0) {
        runs_at[set.response(i, k)].push_back(set.readings[static_cast<std::size_t>(i)].run);
      }
    }
    // Readings of few digits, or without noise, repeat everywhere.
    constexpr std::size_t suspicious = 3;
    const auto is_end = [&](double value) {
      return value == runs_at.rbegin()->first || (!one_sided && value == runs_at.begin()->first);
    };
    std::size_t alone = 0;
    std::size_t extremes = 0;
    for (const auto& [value, runs] : runs_at) {
      const bool at_end = is_end(value);
      alone += runs.size() == 1 ? 1U : 0U;
      extremes += at_end && runs.size() >= suspicious ? runs.size() : 0;
    }
    if (extremes == 0 || alone < 3 || 2 * alone < static_cast<std::size_t>(set.size()) - extremes) {
      continue;
    }
    for (const auto& [value, runs] : runs_at) {
      const bool at_end = is_end(value);
      if (at_end && runs.size() >= suspicious) {
        found.push_back({.axis = k, .value = value, .runs = runs});
      }
    }
  }
  return found;
}

// Uncertain inputs are weighed in the fit, as their errors show in its residuals too.
std::vector<UncertaintySource> weigh_inputs(const Experiment& experiment,
                                            const ReadingSet& set,
                                            Method method,
                                            Estimate& estimate) {
  const bool known = method == Method::known;
  const std::vector<UncertainInput> inputs =
      uncertain_inputs(experiment, set, known, estimate.fields);
  if (inputs.empty()) {
    return {};
  }
  const bool has_normals = inputs.front().name == "positioner";
  if (experiment.robust) {
    if (has_normals) {
      estimate.notes.emplace_back(
          "robust regression does not weigh the uncertainty of the cube's face normals; the stated "
          "uncertainties lack it");
    }
    return {};
  }
  ReadingSet used = set;
  for (const std::size_t i : estimate.unpaired) {
    used.weights.row(static_cast<Eigen::Index>(i)).setZero();
  }
  std::optional<std::vector<Eigen::MatrixXd>> shares =
      fit_with_uncertain_inputs(used, inputs, known, estimate);
  if (!shares) {
    if (has_normals) {
      estimate.notes.emplace_back(
          "the readings do not tell the errors of the cube's faces from noise; the stated "
          "uncertainties lack that of its face normals");
    }
    return {};
  }
  std::vector<UncertaintySource> sources;
  for (std::size_t s = 0; s < inputs.size(); ++s) {
    sources.push_back({.name = inputs[s].name,
                       .type = "B",
                       .distribution = "normal",
                       .input_u = inputs[s].u,
                       .input_unit = inputs[s].unit,
                       .degrees_of_freedom = std::numeric_limits<double>::infinity(),
                       .covariance = std::move((*shares)[s])});
  }
  return sources;
}

void note_field_uncertainty(Calibration& calibration) {
  const FieldDescription& field = calibration.field;
  if (!(field.magnitude_u > 0.0)) {
    return;
  }
  const std::string percent = number_text(100.0 * field.magnitude_u / field.magnitude, 3);
  const std::string share =
      field.parts.empty() ? ": " + percent + " % of every sensitivity at once" : "";
  calibration.notes.push_back(
      "the field's magnitude is uncertain by " + number_text(field.magnitude_u) + " " + field.unit +
      " (one standard deviation" + (field.model.empty() ? "" : ", model " + field.model) + ")" +
      share + "; the expanded uncertainties hold it, the standard errors of the fit do not");
}

// The known-art form fitted to the same readings in the field as fitted.
void compare_polar_fit(const ReadingSet& set,
                       const std::vector<Eigen::Vector3d>& fields,
                       Calibration& calibration) {
  if (calibration.temperature || !calibration.also.empty() || set.leaves_out() ||
      (fields.empty() && !set.rotation_sensor_from_table.empty())) {
    throw SetupError(
        "--polar-fit: goes with plain readings of one field, without temperature terms");
  }
  Eigen::Matrix<double, Eigen::Dynamic, 3> met(set.size(), 3);
  if (fields.empty()) {
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      met.row(i) = set.readings[static_cast<std::size_t>(i)].field_in_sensor->transpose();
    }
  } else {
    met = field_design(set, fields).middleCols<3>(1);
  }
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const int axis = main_axis(calibration.instrument, calibration.response, k);
    calibration.polar_fit.push_back(
        fit_polar_form(met, set.response.col(k), axis, calibration.instrument.convention));
  }
}

// What the method was chosen by, where the usual one could not be.
void note_choice_of_method(const Experiment& experiment,
                           const Observations& used,
                           Method method,
                           Calibration& calibration) {
  if (!experiment.method && method == Method::joint && has_labels(used) &&
      lies_along_normal(experiment)) {
    calibration.notes.push_back(
        "method joint instead of paired: " + why_not_paired(experiment, used) +
        "; take what is missing, or state --method joint");
  }
}

// A magnitude that nobody stated comes from the length of a vector that may be a direction only.
void say_what_length_means(const Experiment& experiment, Calibration& calibration) {
  const FieldSetup& field = experiment.field;
  if (!field.in_table || field.magnitude || field.custom || !field.others.empty()) {
    return;
  }
  const double length = field.in_table->norm();
  const bool is_one_g = field.kind == "gravity" && calibration.field.unit == "g";
  const std::string what =
      "the field's magnitude is taken as the length of the vector that was "
      "stated (in_table, --field-table), " +
      number_text(length, 5) + " " + calibration.field.unit;
  if (is_one_g && std::abs(length - 1.0) > 1e-6) {
    calibration.warnings.push_back(
        {.code = "field_length",
         .runs = {},
         .message =
             what + ", and not as 1 g; if it is a direction only, state --field-magnitude 1"});
  } else if (length != 1.0) {
    calibration.notes.push_back(what);
  }
}

// A mistake in the whole run fits as well as no mistake; only what is expected shows it.
void warn_of_other_sensitivity(double nominal, Calibration& calibration) {
  constexpr double far_off = 0.3;
  for (Eigen::Index k = 0; k < calibration.response.bias.size(); ++k) {
    const double ratio = calibration.response.sensitivity.row(k).norm() / std::abs(nominal);
    if (std::abs(ratio - 1.0) <= far_off) {
      continue;
    }
    std::string reason;
    for (const auto& [factor, text] : std::initializer_list<std::pair<double, const char*>>{
             {1e3, "1000"}, {9.80665, "9.80665"}}) {
      for (const double one : {factor, 1.0 / factor}) {
        if (std::abs(ratio / one - 1.0) <= far_off) {
          reason = std::string(": a factor ") + (one > 1.0 ? "" : "1/") + text +
                   ", so the readings or the field are in another unit";
        }
      }
    }
    calibration.warnings.push_back(
        {.code = reason.empty() ? "sensitivity" : "unit_factor",
         .runs = {},
         .message = "axis " + calibration.instrument.axes[static_cast<std::size_t>(k)] +
                    ": its sensitivity is " + number_text(ratio, 3) + " times the nominal one" +
                    reason + "; check unit, range and wiring"});
  }
}

// The run calibrated again with what the suggestion says.
void follow(const Correction& correction, Experiment& experiment, Observations& observations) {
  observations = corrected(std::move(observations), correction);
  experiment.leave_out.insert(experiment.leave_out.end(), correction.leave_out.begin(),
                              correction.leave_out.end());
}

}  // namespace

Calibration calibrate_with_suggestions(Experiment experiment, Observations observations) {
  std::vector<Correction> made;
  Calibration calibration = calibrate(experiment, observations);
  constexpr std::size_t most = 3;  // a run with more mistakes is to be taken again
  while (calibration.suggestion && made.size() < most) {
    const Correction correction = *calibration.suggestion;
    const bool mends = !correction.points.empty() || !correction.responses.empty() ||
                       !correction.levels.empty() || !correction.leave_out.empty();
    if (!mends) {
      break;
    }
    follow(correction, experiment, observations);
    made.push_back(correction);
    calibration = calibrate(experiment, observations);
  }
  for (const Correction& correction : made) {
    calibration.notes.push_back("corrected as suggested: " + correction.message);
  }
  calibration.corrections = std::move(made);
  return calibration;
}

Method choose_method(const Experiment& experiment, const Observations& observations) {
  if (experiment.method) {
    return *experiment.method;
  }
  if (brings_field(observations)) {
    return Method::known;
  }
  if (!has_labels(observations)) {
    return Method::magnitude;
  }
  if (!lies_along_normal(experiment)) {
    return Method::joint;
  }
  return why_not_paired(experiment, observations).empty() ? Method::paired : Method::joint;
}

Calibration calibrate(const Experiment& experiment, const Observations& observations) {
  check(experiment, observations);
  const Weighting weighting =
      experiment.weighting.value_or(observations.samples ? Weighting::samples : Weighting::none);
  Observations used;
  for (const Reading& reading : observations.readings) {
    const std::vector<int>& out = experiment.leave_out;
    if (std::find(out.begin(), out.end(), reading.run) == out.end()) {
      used.readings.push_back(reading);
    }
  }
  const Method method = choose_method(experiment, used);
  const bool by_field = method == Method::known && brings_field(observations);
  check_temperature(experiment, used.readings, method);
  ReadingSource source(experiment, observations, weighting, by_field);
  check_method(experiment, observations, method, by_field);
  check_levels(used, method);
  const std::vector<ResolvedPart> parts = resolve_field(experiment, source.sun_time_s());
  if (experiment.field.sun && !by_field && !parts.front().has_value) {
    throw RefusedError(
        "the sun's place needs the time of the readings: a column 'time' (ISO 8601, UTC), or "
        "--date "
        "with a time of day");
  }

  Calibration calibration;
  calibration.created = timestamp_now();
  calibration.software = software_name();
  calibration.instrument = experiment.instrument;
  calibration.field = describe_field(experiment, parts);
  calibration.method = method_name(method);
  calibration.weights = weighting_name(weighting);
  calibration.robust = experiment.robust;
  calibration.positioner = experiment.positioner.id();
  calibration.slot = experiment.slot;
  calibration.level_by_block = experiment.level_by == LevelBy::block;
  calibration.left_out = experiment.leave_out;
  note_choice_of_method(experiment, used, method, calibration);
  if (method == Method::known && !by_field) {
    check_known_magnitude(calibration.field);
  }

  if (method == Method::bias) {
    fit_bias(experiment, observations, source, calibration);
    calibration.uncertainty = make_budget(experiment, {}, calibration, {}, {});
    return calibration;
  }

  AxisMask seen;
  Estimate estimate;
  std::vector<TemperatureOrderTrial> trials;
  if (experiment.temperature.automatic) {
    trials = try_orders(method, source, parts, by_field);
    source.set_temperature(chosen_order(trials), experiment.temperature.reference);
  } else if (experiment.temperature.order > 0) {
    source.set_temperature(experiment.temperature.order, experiment.temperature.reference);
  }
  if (method == Method::magnitude) {
    source.keep_complete_rows();
    const ReadingSet set = source.set(parts, {});
    estimate = estimate_magnitude(set, calibration.field.magnitude, experiment.shape,
                                  noise_of(observations));
    calibration.shape = shape_name(experiment.shape);
    if (!set.rotation_sensor_from_table.empty()) {
      align_by_points(set, calibration.field.magnitude, estimate);
    }
  } else if (experiment.instrument.one_sided) {
    estimate = estimate_one_sided(method, source, parts, seen);
  } else {
    estimate = estimate_by(method, source.set(parts, {}), parts, by_field);
  }
  ReadingSet fitted = source.set(parts, seen);
  if (fitted.temperature.order > 0) {
    fitted.temperature.scale = estimate.temperature_scale;
    fitted.temperature.along = estimate.response.sensitivity;
  }
  std::optional<Culprit> culprit;
  const bool searched = experiment.search_for_mistakes && method != Method::magnitude &&
                        can_be_searched(fitted, estimate);
  if (searched) {
    culprit = find_culprit(fitted, estimate, method == Method::known);
  }
  std::vector<UncertaintySource> weighed = weigh_inputs(experiment, fitted, method, estimate);
  calibration.response = std::move(estimate.response);
  calibration.statistics = std::move(estimate.statistics);
  put_temperature(estimate, source, std::move(trials), calibration);
  for (std::size_t a = 0; a < estimate.also.size(); ++a) {
    const ResolvedPart& also = source.also()[a];
    calibration.also.push_back({.kind = also.part.kind,
                                .unit = also.unit,
                                .in_table = also.part.in_table,
                                .sensitivity = estimate.also[a],
                                .sensitivity_se = estimate.also[a]});
  }
  put_fields(calibration.field, estimate.fields);
  calibration.field.in_table_covariance = estimate.field_covariance;
  calibration.field.in_table_degrees_of_freedom = estimate.field_degrees_of_freedom;
  calibration.levelness = std::move(estimate.levelness);
  std::vector<LackOfFit>& tests = calibration.statistics->lack_of_fit;
  if (std::none_of(tests.begin(), tests.end(),
                   [](const LackOfFit& test) { return test.pure_error_dof > 0.0; })) {
    tests.clear();
  }
  add_intervals(calibration);
  calibration.uncertainty =
      make_budget(experiment, fitted, calibration, estimate.fields, std::move(weighed));

  AxisMask in_fit = AxisMask::Constant(observations.size(), observations.response.cols(), false);
  for (std::size_t i = 0; i < source.rows().size(); ++i) {
    const auto row = static_cast<Eigen::Index>(source.rows()[i]);
    in_fit.row(row) = source.in_range().row(row);
    if (seen.size() > 0) {
      in_fit.row(row) = in_fit.row(row) && seen.row(static_cast<Eigen::Index>(i));
    }
  }
  std::vector<int> unpaired_runs;
  for (const std::size_t i : estimate.unpaired) {
    const std::size_t row = source.rows()[i];
    in_fit.row(static_cast<Eigen::Index>(row)).setConstant(false);
    unpaired_runs.push_back(observations.readings[row].run);
  }
  calibration.residuals = residuals_of(observations, source, estimate.fields, experiment.positioner,
                                       calibration, in_fit);
  if (method == Method::magnitude) {
    calibration.orientations = orientation_quality(
        fields_of_readings(calibration.response, fitted.response), calibration.field.magnitude);
  }
  add_notes(calibration, observations, experiment.positioner);
  note_field_uncertainty(calibration);
  if (experiment.compare_polar_fit) {
    compare_polar_fit(fitted, estimate.fields, calibration);
  }
  calibration.notes.insert(calibration.notes.end(), estimate.notes.begin(), estimate.notes.end());
  estimate.saturated = find_saturated(fitted, experiment.instrument.one_sided);
  calibration.warnings =
      find_warnings(calibration, estimate, std::move(unpaired_runs), searched, culprit);
  say_what_length_means(experiment, calibration);
  if (experiment.nominal_sensitivity) {
    warn_of_other_sensitivity(*experiment.nominal_sensitivity, calibration);
  }
  if (culprit) {
    calibration.suggestion = culprit->correction;
  }
  // What a mistake does to the coefficients, in parts of the full response.
  constexpr double largest_effect = 0.005;
  const bool spoilt = culprit && culprit->effect > largest_effect;
  const bool refused =
      spoilt || std::any_of(calibration.warnings.begin(), calibration.warnings.end(),
                            [](const CalibrationWarning& w) {
                              return w.code == "uncertain_direction" ||
                                     w.code == "one_sided_unsettled" || w.code == "no_fit" ||
                                     w.code == "uncertain_sensitivity";
                            });
  calibration.status = refused ? "refused" : calibration.warnings.empty() ? "ok" : "warning";
  return calibration;
}

}  // namespace axiscal
