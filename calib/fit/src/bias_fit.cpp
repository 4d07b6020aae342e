// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/bias_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/least_squares.hpp"
#include "axiscal/calib/settings.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/field/field_kind.hpp"
#include "calib/fit/src/long_recording.hpp"
#include "calib/fit/src/sweep_legs.hpp"
#include "calib/fit/temperature_fit.hpp"
#include "calib/record/calibration_warning.hpp"
#include "calib/record/parameter_names.hpp"
#include "calib/regression/factor.hpp"
#include "calib/regression/jackknife.hpp"
#include "calib/regression/serial_correlation.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// The contents of the constant term of the bias polynomial.
enum class Constant {
  bias,         // only the bias; the response to the field is subtracted, or is 0
  from_record,  // bias and response to the field; the bias is taken from the record experiment.from
  as_read,      // bias and response to the field; no record is given
};

Eigen::MatrixXd powers(const Eigen::VectorXd& d, int order) {
  Eigen::MatrixXd X(d.size(), order + 1);
  X.col(0).setOnes();
  for (int j = 1; j <= order; ++j) {
    X.col(j) = X.col(j - 1).cwiseProduct(d);
  }
  return X;
}

LeastSquaresFit fit_polynomial(const ReadingSet& set,
                               const Eigen::VectorXd& response,
                               Eigen::Index axis,
                               int order) {
  std::vector<std::string> names = {set.axes[static_cast<std::size_t>(axis)] + ".bias"};
  for (int j = 1; j <= order; ++j) {
    names.push_back(names.front() + power_suffix(j));
  }
  return LeastSquaresDesign(powers(set.temperature.d.col(axis), order), set.weights.col(axis),
                            names)
      .fit(response);
}

std::vector<TemperatureOrderTrial> try_orders(const ReadingSet& set) {
  constexpr int highest_order = 5;
  std::vector<TemperatureOrderTrial> trials;
  for (int order = 0; order <= std::min(highest_order, temperature_count(set) - 1); ++order) {
    TemperatureOrderTrial trial{.order = order, .lack_of_fit_p_value = not_a_number};
    for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
      const LeastSquaresFit fit = fit_polynomial(set, set.response.col(k), k, order);
      trial.aicc += axis_aicc(std::max(fit.residual_sd, set.rounding(k)), fit.degrees_of_freedom,
                              order + 1.0);
    }
    if (std::isinf(trial.aicc)) {
      break;
    }
    trials.push_back(trial);
  }
  return trials;
}

std::optional<double> nominal_sensitivity(const Experiment& experiment,
                                          const Calibration& calibration) {
  return expected_sensitivity(experiment, calibration.sensor.field.unit);
}

void put_sensitivity(const Experiment& experiment, Calibration& calibration) {
  const Instrument& instrument = experiment.instrument;
  calibration.sensor.response.bias = Eigen::VectorXd::Zero(instrument.axis_count());
  if (experiment.from) {
    calibration.sensor.response.sensitivity = experiment.from->sensor.response.sensitivity;
    calibration.sensor.rotation_sensor_from_assembly =
        experiment.from->sensor.rotation_sensor_from_assembly;
    return;
  }
  // The nominal sensitivity is the stated one. If none is stated and the readings are in a unit of
  // the field, it is the factor between the two units; otherwise it is 1.
  const double nominal = nominal_sensitivity(experiment, calibration).value_or(1.0);
  calibration.sensor.response.sensitivity = SensitivityMatrix::Zero(instrument.axis_count(), 3);
  for (Eigen::Index k = 0; k < instrument.axis_count(); ++k) {
    const int component = nominal_axis(instrument, k).value_or(static_cast<int>(k % 3));
    calibration.sensor.response.sensitivity(k, component) = nominal;
  }
  calibration.findings.notes.push_back(
      {NoteCode::pose,
       formatted("the sensitivity was not fitted; its nominal value ({}) is used. To use a "
                 "measured sensitivity, give a calibration record",
                 number_text(nominal, 6))});
}

bool has_pose(const ReadingSet& set) {
  return std::all_of(set.readings.begin(), set.readings.end(), [](const Reading& reading) {
    return reading.point || reading.field_in_sensor;
  });
}

Constant what_constant_is(const Experiment& experiment,
                          const ReadingSet& set,
                          Calibration& calibration) {
  if (has_pose(set) && (experiment.from || nominal_sensitivity(experiment, calibration))) {
    return Constant::bias;
  }
  if (field_kind(calibration.sensor.field.kind).rotation) {
    calibration.findings.notes.push_back({NoteCode::pose,
                                          "the readings were taken at rest, so these biases "
                                          "include the Earth's rotation (up to 15 deg/h)"});
    return Constant::bias;
  }
  if (experiment.from) {
    calibration.findings.notes.push_back(
        {NoteCode::pose,
         "the pose of the instrument in the field is unknown, so the biases at the reference "
         "temperature are those of the given record; only their change with temperature is from "
         "this run"});
    return Constant::from_record;
  }
  add_warning(
      calibration,
      {.code = WarningCode::field_in_bias,
       .runs = {},
       .message =
           "the biases include the response to the field (gravity for an accelerometer) in the "
           "pose of the run. To remove this response, give a record with the sensitivity, and "
           "either the columns 'rest' and 'fence' or the columns 'pitch_deg' and 'roll_deg'"});
  return Constant::as_read;
}

// Returns the field at each reading in the sensor's frame; n x 3.
Eigen::MatrixX3d fields_met(const ReadingSet& set, const Calibration& calibration) {
  Eigen::MatrixX3d fields(set.size(), 3);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const Reading& reading = set.readings[static_cast<std::size_t>(i)];
    fields.row(i) =
        reading.field_in_sensor
            ? *reading.field_in_sensor
            : Eigen::Vector3d(reading.level.of_all() *
                              (set.met_of_field(static_cast<std::size_t>(i)) *
                               calibration.sensor.field.in_table.value_or(
                                   calibration.sensor.field.magnitude * Eigen::Vector3d::UnitZ())));
  }
  return fields;
}

// Increases the variances of the biases, because the response to the field was computed with the
// record's uncertain sensitivities and subtracted from the readings.
// @param mean_field  mean of the field over the readings, in the sensor's frame.
void add_uncertainty_of_field(const Eigen::Vector3d& mean_field, FitStatistics& statistics) {
  const Eigen::Index m = statistics.bias_se.size();
  const Eigen::Index p = statistics.covariance.rows() / m;
  for (Eigen::Index k = 0; k < m; ++k) {
    const Eigen::Matrix3d C = statistics.covariance.block<3, 3>(p * k + 1, p * k + 1);
    statistics.covariance(p * k, p * k) += mean_field.dot(C * mean_field);
    statistics.covariance.block<3, 1>(p * k + 1, p * k) = -C * mean_field;
    statistics.covariance.block<1, 3>(p * k, p * k + 1) = -(C * mean_field).transpose();
  }
}

// Copies the covariance of the record's sensitivities, as far as the record contains it.
void put_covariance_of(const Calibration& from,
                       const std::vector<std::string>& names,
                       Eigen::MatrixXd& covariance) {
  if (!from.fit.statistics) {
    return;
  }
  const std::vector<std::string>& theirs = from.fit.statistics->parameter_names;
  for (std::size_t i = 0; i < names.size(); ++i) {
    for (std::size_t j = 0; j < names.size(); ++j) {
      const auto a = std::find(theirs.begin(), theirs.end(), names[i]);
      const auto b = std::find(theirs.begin(), theirs.end(), names[j]);
      const bool sensitivities = names[i].find(".sensitivity.") != std::string::npos &&
                                 names[j].find(".sensitivity.") != std::string::npos;
      if (sensitivities && a != theirs.end() && b != theirs.end()) {
        covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
            from.fit.statistics->covariance(a - theirs.begin(), b - theirs.begin());
      }
    }
  }
}

// Copies the degrees of freedom of the sensitivities' intervals from the record.
void put_freedom_of(const Calibration& from, FitStatistics& statistics) {
  if (!from.fit.statistics || from.fit.statistics->interval_dof.size() == 0) {
    return;
  }
  for (std::size_t i = 0; i < statistics.parameter_names.size(); ++i) {
    const std::string& name = statistics.parameter_names[i];
    const auto at = from.fit.statistics->position_of(name);
    if (at && name.find(".sensitivity.") != std::string::npos) {
      statistics.interval_dof(static_cast<Eigen::Index>(i)) =
          from.fit.statistics->interval_dof(*at);
    }
  }
}

// Returns the order of the polynomial. If the order is automatic, it is chosen by trials, which are
// stored in `temperature`. Otherwise it is the stated order. Throws RankDeficientError if the
// readings are at too few temperatures.
int settled_order(const Experiment& experiment,
                  const ReadingSet& set,
                  TemperatureResponse& temperature) {
  int order = experiment.fit.temperature.order;
  if (experiment.fit.temperature.automatic) {
    temperature.trials = try_orders(set);
    order = temperature.trials.empty() ? 0 : chosen_order(temperature.trials);
  }
  if (temperature_count(set) <= order) {
    throw RankDeficientError(
        formatted("readings at {} temperatures do not determine a polynomial of order {}; take a "
                  "lower order, or readings at more temperatures",
                  temperature_count(set), order),
        {formatted("{}.bias{}", set.axes.front(), power_suffix(order))},
        {settings::temperature_order});
  }
  return order;
}

// Returns statistics whose values are NaN until the axes are fitted.
FitStatistics unknown_statistics(Eigen::Index readings, Eigen::Index m) {
  FitStatistics statistics;
  statistics.observations = static_cast<int>(readings);
  for (Eigen::VectorXd* const of_axes :
       {&statistics.degrees_of_freedom, &statistics.residual_sd, &statistics.r_squared,
        &statistics.bias_se, &statistics.coverage_factor}) {
    of_axes->setConstant(m, not_a_number);
  }
  statistics.sensitivity_se.setConstant(m, 3, not_a_number);
  statistics.variance_inflation.setConstant(m, 3, not_a_number);
  return statistics;
}

// The uncertainty of an axis's polynomial for a sweep of the temperature. The first part is the
// scatter of ten fits, each without one tenth of the readings (jackknife). The second part is the
// difference between the two branches: the readings at rising and at falling temperature.
struct SweepScatter {
  Eigen::VectorXd u;         // standard uncertainties of the order + 1 coefficients, by jackknife
  double independent = 0.0;  // equivalent number of independent readings
  // Covariance of the coefficients for a bias that may lie anywhere between the branches; 0 if the
  // branches agree.
  Eigen::MatrixXd branches;
  double half_difference = 0.0;  // half of the largest difference between the branches [unit]
};

// Computes the uncertainty of the polynomial `fit` of one axis.
// @param ways  1 for each reading at rising temperature, -1 for each reading at falling
//              temperature; empty if the sweep has only one direction.
SweepScatter scatter_of_sweep(const ReadingSet& set,
                              Eigen::Index axis,
                              int order,
                              const LeastSquaresFit& fit,
                              const Eigen::VectorXd& response,
                              const Eigen::VectorXd& ways) {
  const Eigen::MatrixXd P = powers(set.temperature.d.col(axis), order);
  const Eigen::Index q = P.cols();
  const Eigen::VectorXd root = set.weights.col(axis).cwiseSqrt();
  SweepScatter scatter{.branches = Eigen::MatrixXd::Zero(q, q)};
  Eigen::MatrixXd X = P;
  Eigen::VectorXd left = fit.residuals;
  Eigen::MatrixXd both(P.rows(), ways.size() > 0 ? 2 * q : 0);
  if (ways.size() > 0) {
    both << P, ways.asDiagonal() * P;
  }
  // A branch with few temperatures does not determine its own polynomial.
  if (ways.size() > 0 && Factor(root.asDiagonal() * both).has_full_rank()) {
    const LeastSquaresFit branched = LeastSquaresDesign(both, set.weights.col(axis)).fit(response);
    const double n = branched.degrees_of_freedom;
    const double rss = n * branched.residual_sd * branched.residual_sd;
    const double more = fit.degrees_of_freedom * fit.residual_sd * fit.residual_sd - rss;
    // Consecutive readings are correlated, so the number of independent readings is smaller.
    const double alike = correlation_length(root.cwiseProduct(branched.residuals));
    const double independent = std::max(n / alike, 1.0);
    const double F = std::max(more, 0.0) / static_cast<double>(q) / (rss / n) / alike;
    constexpr double by_chance = 0.005;
    if (f_upper_p(std::max(F, 1e-300), static_cast<double>(q), independent) < by_chance) {
      const Eigen::VectorXd h = branched.estimate.tail(q);
      const Eigen::VectorXd off = branched.estimate.head(q) - fit.estimate;
      scatter.branches = h * h.transpose() / 3.0 + off * off.transpose();
      scatter.half_difference = (P * h).cwiseAbs().maxCoeff();
      X = both;
      left = branched.residuals;
    }
  }
  scatter.independent = static_cast<double>(X.rows()) / correlation_length(root.cwiseProduct(left));
  scatter.u = jackknife_uncertainty(block_jackknife_changes({.residuals = -root.cwiseProduct(left),
                                                             .jacobian = root.asDiagonal() * X}))
                  .head(q);
  // If one tenth of the readings contains a whole branch, the fits without this tenth cannot
  // determine the branch. The jackknife is then repeated with one polynomial for both branches.
  if (!scatter.u.allFinite()) {
    scatter.u = jackknife_uncertainty(block_jackknife_changes(
        {.residuals = -root.cwiseProduct(fit.residuals), .jacobian = root.asDiagonal() * P}));
  }
  return scatter;
}

// Includes two errors of a long sweep in the uncertainty: consecutive readings are correlated, and
// the biases at rising temperature differ from those at falling temperature.
// @param places  indices of the polynomial's coefficients among the parameters of an axis.
void add_sweep_scatter(const ReadingSet& set,
                       const std::vector<Eigen::Index>& places,
                       const Eigen::MatrixXd& responses,
                       const std::vector<LeastSquaresFit>& fits,
                       Calibration& calibration) {
  FitStatistics& statistics = *calibration.fit.statistics;
  const Eigen::Index m = set.axis_count();
  const Eigen::Index p = statistics.covariance.rows() / m;
  const Eigen::VectorXd mean = set.temperature.d.rowwise().mean();
  Eigen::VectorXd ways = sweep_directions(mean);
  if (!is_bidirectional(mean, ways)) {
    ways.resize(0);
  }
  ScatterComponent branches{.name = "hysteresis",
                            .sd = Eigen::VectorXd::Zero(m),
                            .unit = {},
                            .covariance = Eigen::MatrixXd::Zero(p * m, p * m),
                            .degrees_of_freedom = jackknife_parts - 1};
  Eigen::VectorXd u = statistics.covariance.diagonal().cwiseSqrt();
  double independent = std::numeric_limits<double>::infinity();
  std::string differing;
  for (Eigen::Index k = 0; k < m; ++k) {
    const SweepScatter scatter =
        scatter_of_sweep(set, k, static_cast<int>(places.size()) - 1,
                         fits[static_cast<std::size_t>(k)], responses.col(k), ways);
    std::vector<Eigen::Index> at = places;
    for (Eigen::Index& place : at) {
      place += p * k;
    }
    u(at) = scatter.u;
    branches.covariance(at, at) = scatter.branches;
    branches.sd(k) = scatter.half_difference;
    independent = std::min(independent, scatter.independent);
    if (scatter.half_difference > 0.0) {
      differing +=
          formatted("{}{} {}", differing.empty() ? "" : ", ", set.axes[static_cast<std::size_t>(k)],
                    number_text(2.0 * scatter.half_difference, 2));
    }
  }
  add_long_correlation(u, statistics, calibration.findings.notes);
  for (std::string& remark : remarks_on_length(independent)) {
    calibration.findings.notes.push_back({NoteCode::correlation, std::move(remark)});
  }
  if (!differing.empty()) {
    add_component(std::move(branches), statistics);
    calibration.findings.notes.push_back(
        {NoteCode::hysteresis,
         formatted("hysteresis: the biases at rising and at falling temperature differ by up to {} "
                   "{}; the uncertainty includes this difference. Sweep more slowly, and return to "
                   "the first temperature to separate hysteresis from drift",
                   differing, calibration.sensor.instrument.unit)});
  } else if (ways.size() == 0 && places.size() > 1) {
    calibration.findings.notes.push_back(
        {NoteCode::hysteresis,
         "the temperature was swept in one direction only, so the hysteresis of the biases is "
         "unknown"});
  }
}

// Widens the intervals if consecutive readings of a sweep are correlated. The jackknife, which
// leaves out one tenth of the sweep at a time, does not show this correlation, because a sweep is
// only one cycle of the temperature. The uncertainties are therefore also computed from models of
// correlated noise, and the larger ones are used.
void add_noise_of_order(const ReadingSet& set,
                        const std::vector<Eigen::Index>& places,
                        const Eigen::MatrixXd& responses,
                        const std::vector<LeastSquaresFit>& fits,
                        Calibration& calibration) {
  OrderedReadings ordered{
      .responses = responses,
      .places = Eigen::VectorXd::LinSpaced(set.size(), 0.0, static_cast<double>(set.size() - 1)),
      .blocks = {}};
  const int order = static_cast<int>(places.size()) - 1;
  constexpr Eigen::Index fewest_left = 4;
  // The branches of hysteresis would look like correlated noise.
  const bool has_branches = calibration.fit.statistics->find_component("hysteresis") != nullptr;
  if (has_branches || set.has_excluded_readings() || set.robust ||
      set.size() < order + 1 + fewest_left) {
    return;
  }
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    ordered.designs.push_back(powers(set.temperature.d.col(k), order));
  }
  const double score = lag_one_score(ordered);
  if (!(score > alike_above)) {
    return;
  }
  FitStatistics& statistics = *calibration.fit.statistics;
  const Eigen::Index p = statistics.covariance.rows() / set.axis_count();
  Eigen::VectorXd u = Eigen::VectorXd::Zero(statistics.covariance.rows());
  double correlation = 0.0;
  double freedom = 0.0;
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const CorrelatedFit fit =
        fit_with_correlated_noise(ordered.designs[static_cast<std::size_t>(k)], responses.col(k),
                                  Eigen::VectorXd::Ones(set.size()) * Eigen::RowVector3d::UnitX());
    // The estimate is not changed. Its difference from the estimate with correlated noise is added
    // to the uncertainty.
    const Eigen::VectorXd off = fit.estimate - fits[static_cast<std::size_t>(k)].estimate;
    for (std::size_t j = 0; j < places.size(); ++j) {
      const auto at = static_cast<Eigen::Index>(j);
      u(p * k + places[j]) = std::hypot(std::sqrt(fit.covariance(at, at)), off(at));
    }
    correlation = std::max(correlation, fit.correlation);
    freedom = fit.degrees_of_freedom;
  }
  add_correlation(u, freedom, statistics);
  if (score > told_alike_above) {
    calibration.findings.notes.push_back(
        {NoteCode::correlation,
         formatted("Consecutive readings are correlated (coefficient about {}). The intervals "
                   "include this correlation",
                   number_text(correlation, 1))});
  }
}

// Sets the standard errors of the biases and their polynomials from the covariance.
void put_standard_errors(const std::vector<Eigen::Index>& places, Calibration& calibration) {
  FitStatistics& statistics = *calibration.fit.statistics;
  const Eigen::VectorXd se = statistics.covariance.diagonal().cwiseSqrt();
  const Eigen::Index m = statistics.bias_se.size();
  for (Eigen::Index k = 0; k < m; ++k) {
    const Eigen::VectorXd own = se.segment(k * se.size() / m, se.size() / m)(places);
    statistics.bias_se(k) = own(0);
    calibration.sensor.temperature->bias_se.row(k) = own.tail(own.size() - 1).transpose();
  }
}

// Stores the residuals of all readings. Readings that the fit does not use get NaN.
// @param left  residuals of the readings in `source`, n x m.
void put_residuals(const Observations& observations,
                   const ReadingSource& source,
                   const Eigen::MatrixXd& left,
                   Calibration& calibration) {
  for (const Reading& reading : observations.readings) {
    ReadingResidual residual{.run = reading.run, .point = reading.point};
    residual.temperature = reading.temperature;
    residual.response = Eigen::VectorXd::Constant(left.cols(), not_a_number);
    residual.magnitude = not_a_number;
    residual.used = false;
    calibration.fit.residuals.push_back(std::move(residual));
  }
  for (Eigen::Index i = 0; i < left.rows(); ++i) {
    ReadingResidual& residual =
        calibration.fit.residuals[source.rows()[static_cast<std::size_t>(i)]];
    residual.used = true;
    residual.response = left.row(i);
  }
}

}  // namespace

void fit_bias(const Experiment& experiment,
              const Observations& observations,
              const ReadingSource& unordered,
              Calibration& calibration) {
  if (experiment.from &&
      experiment.from->sensor.response.bias.size() != experiment.instrument.axis_count()) {
    throw SetupError(
        formatted("the record that gives the sensitivity has {} axes, but the readings have {}",
                  experiment.from->sensor.response.bias.size(), experiment.instrument.axis_count()),
        {settings::from_record});
  }
  const bool has_temperature = std::all_of(
      unordered.rows().begin(), unordered.rows().end(),
      [&](std::size_t row) { return observations.readings[row].temperature.has_value(); });
  const ReadingSource source =
      unordered.with({.temperature_order = has_temperature ? 1 : 0,
                      .temperature_reference = experiment.fit.temperature.reference});
  ReadingSet set = source.set({}, {});
  const Eigen::Index m = set.axis_count();
  if (!has_temperature) {
    set.temperature.d.setZero(set.size(), m);
  }
  put_sensitivity(experiment, calibration);
  const Constant constant = what_constant_is(experiment, set, calibration);
  const bool known_pose =
      constant == Constant::bias && has_pose(set) &&
      (experiment.from || nominal_sensitivity(experiment, calibration).has_value());
  const Eigen::MatrixX3d fields =
      known_pose ? fields_met(set, calibration) : Eigen::MatrixX3d::Zero(set.size(), 3).eval();
  const Eigen::MatrixXd all =
      set.response - fields * calibration.sensor.response.sensitivity.transpose();
  set.response = all;

  TemperatureResponse& temperature = calibration.sensor.temperature.emplace();
  if (has_temperature) {
    temperature.spans = source.temperature_spans();
  }
  const int order = has_temperature ? settled_order(experiment, set, temperature) : 0;
  FitStatistics& statistics = calibration.fit.statistics.emplace(unknown_statistics(set.size(), m));
  temperature.bias.resize(m, order);
  temperature.scale.setZero(m, order);
  temperature.bias_se.resize(m, order);
  temperature.scale_se.setConstant(m, order, not_a_number);
  // The parameters of an axis are the bias, three sensitivities (only if a record is given), and
  // the temperature coefficients of the bias.
  const Eigen::Index given = experiment.from ? 3 : 0;
  const Eigen::Index p = 1 + given + order;
  statistics.covariance.setZero(p * m, p * m);
  Eigen::MatrixXd left(set.size(), m);
  std::vector<LeastSquaresFit> fits;
  std::vector<Eigen::Index> places = {0};
  for (int j = 0; j < order; ++j) {
    places.push_back(1 + given + j);
  }
  for (Eigen::Index k = 0; k < m; ++k) {
    const LeastSquaresFit fit = fit_polynomial(set, all.col(k), k, order);
    calibration.sensor.response.bias(k) = constant == Constant::from_record
                                              ? experiment.from->sensor.response.bias(k)
                                              : fit.estimate(0);
    temperature.bias.row(k) = fit.estimate.tail(order).transpose();
    statistics.degrees_of_freedom(k) = fit.degrees_of_freedom;
    statistics.residual_sd(k) = fit.residual_sd;
    statistics.r_squared(k) = fit.r_squared;
    statistics.coverage_factor(k) = student_t_factor(0.95, fit.degrees_of_freedom);
    const std::string& axis = set.axes[static_cast<std::size_t>(k)];
    std::vector<std::string> own = parameter_names({axis});
    own.resize(static_cast<std::size_t>(1 + given));
    for (int j = 1; j <= order; ++j) {
      own.push_back(formatted("{}.bias{}", axis, power_suffix(j)));
    }
    statistics.parameter_names.insert(statistics.parameter_names.end(), own.begin(), own.end());
    std::vector<Eigen::Index> at = places;
    for (Eigen::Index& place : at) {
      place += p * k;
    }
    statistics.covariance(at, at) = fit.covariance;
    left.col(k) = fit.residuals;
    fits.push_back(fit);
  }
  if (is_long_recording(set.size())) {
    add_sweep_scatter(set, places, all, fits, calibration);
  }
  add_noise_of_order(set, places, all, fits, calibration);
  if (experiment.from) {
    put_covariance_of(*experiment.from, statistics.parameter_names, statistics.covariance);
    add_uncertainty_of_field(fields.colwise().mean().transpose(), statistics);
    if (experiment.from->fit.statistics) {
      statistics.sensitivity_se = experiment.from->fit.statistics->sensitivity_se;
    }
  }
  put_standard_errors(places, calibration);
  fill_intervals(statistics);
  if (experiment.from) {
    put_freedom_of(*experiment.from, statistics);
    put_intervals(statistics);
  }
  statistics.condition_number =
      LeastSquaresDesign(powers(set.temperature.d.col(0), order)).condition_number();

  put_residuals(observations, source, left, calibration);
  calibration.sensor.field.in_table.reset();
  if (!has_temperature) {
    calibration.sensor.temperature.reset();
  }
}

}  // namespace axiscal
