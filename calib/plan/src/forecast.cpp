// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/forecast.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>

#include "axiscal/calib/assembly.hpp"
#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/calib/settings.hpp"
#include "axiscal/calib/simulate.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "calib/fit/design_advice.hpp"
#include "calib/fit/estimation.hpp"
#include "calib/fit/fit.hpp"
#include "calib/fit/input_quantities.hpp"
#include "calib/plan/src/world_effects.hpp"
#include "calib/regression/factor.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// The linear map from the readings of one replicate to the coefficients. The readings are in the
// order of the rows of a Fit.
struct LinearMap {
  Eigen::MatrixXd coefficients_from_readings;  // 4m x n m
  // Design matrix of a fit to all readings. It has n m rows, one for each axis of each reading. The
  // columns for b and S come first.
  Eigen::MatrixXd columns;
  // Number of equations of each axis in one replicate, m entries. If r replicates are fitted, axis
  // k has r * degrees_of_freedom(k) - parameters degrees of freedom.
  Eigen::VectorXd degrees_of_freedom;
  // Number of parameters per axis, for all replicates together.
  double parameters = 4.0;
};

std::vector<RunSheetRow> sheet_of(const std::vector<DesignEntry>& design) {
  std::vector<RunSheetRow> sheet;
  for (const DesignEntry& entry : design) {
    sheet.push_back({.run = static_cast<int>(sheet.size()) + 1, .entry = entry});
  }
  return sheet;
}

// Returns the field in the frame `table`, for the expected slope of the table.
Eigen::Vector3d field_in_table(const ForecastSetup& setup) {
  return rotation_sloping_from_level(setup.slope) *
         setup.nominal.field.in_table.value_or(
             Eigen::Vector3d(0.0, 0.0, setup.nominal.field.magnitude));
}

ReadingSet reading_set(const ForecastSetup& setup) {
  ReadingSet set;
  set.axes = setup.nominal.instrument.axes;
  set.orientation = [&setup](const DesignPoint& point) -> Eigen::Matrix3d {
    return setup.mount.rotation_sensor_from_positioner *
           setup.positioner.rotation_table_from_positioner(point).transpose();
  };
  const Observations observations =
      simulate(setup.nominal, sheet_of(setup.design),
               {.slope = setup.slope,
                .positioner = setup.positioner,
                .rotation_sensor_from_positioner = setup.mount.rotation_sensor_from_positioner});
  set.readings = observations.readings;
  // The forecast treats one-sided axes like two-sided ones, so the readings follow the linear
  // response even for light from behind.
  set.response.resize(observations.size(), observations.response.cols());
  set.weights = Eigen::MatrixXd::Ones(set.size(), set.axis_count());
  const Eigen::Vector3d in_table = field_in_table(setup);
  for (std::size_t i = 0; i < set.readings.size(); ++i) {
    const Reading& reading = set.readings[i];
    const Eigen::Matrix3d rotation = set.orientation(*reading.point);
    set.rotation_sensor_from_table.push_back(rotation);
    const Eigen::VectorXd met =
        setup.nominal.response.sensitivity * (rotation * (reading.level.of_all() * in_table));
    set.response.row(static_cast<Eigen::Index>(i)) =
        (setup.nominal.response.bias + met).transpose();
  }
  return set;
}

// Checks that the design determines the coefficients.
// @throws RefusedError, RankDeficientError  if it does not; the message names the points to add.
void check_design(const ForecastSetup& setup, const ReadingSet& set, const TableField& field) {
  const RowsForPoint row_for = rows_of_points(set, field);
  if (!method_kind(setup.method).averages_pairs) {
    require_determined(set, field_design(set, field), row_for);
    return;
  }
  const PairedDesign paired = paired_design(set, field_in_table(setup));
  if (paired.design.rows() == 0) {
    throw RefusedError(
        "method 'paired': no point has its opposite (same rest face, opposite fence face); use the "
        "method 'joint'",
        {settings::method});
  }
  require_determined(set, paired.design, row_for, true);
}

LinearMap linear_map(const ForecastSetup& setup, const Fit& run) {
  const ReadingSet& set = run.set();
  const Eigen::Index m = set.axis_count();
  const std::vector<Eigen::Index> open = undetermined_columns(run.columns());
  LinearMap map;
  if (method_kind(setup.method).averages_pairs) {
    const PairedDesign paired = paired_design(set, field_in_table(setup));
    const Eigen::VectorXd root = paired.weights.cwiseSqrt();
    const Eigen::MatrixXd from_readings =
        pseudo_inverse(root.asDiagonal() * paired.design) * root.asDiagonal() * paired.averaging;
    map.coefficients_from_readings = Eigen::MatrixXd::Zero(4 * m, set.size() * m);
    for (Eigen::Index k = 0; k < m; ++k) {
      map.coefficients_from_readings(Eigen::seqN(4 * k, 4), run.rows_of_axis(k)) = from_readings;
    }
    map.degrees_of_freedom =
        Eigen::VectorXd::Constant(m, static_cast<double>(paired.design.rows()));
    // generalized_map() fits all readings instead of their averages, so it needs these columns.
    if (open.empty()) {
      map.columns = run.columns();
    }
    return map;
  }
  if (!open.empty()) {
    std::vector<std::string> names = undetermined_column_names(open, run.names());
    const std::string list = joined(names);
    throw RankDeficientError(formatted("the design does not determine {} together; add the points "
                                       "with the opposite fence faces, or use the method 'known'",
                                       list),
                             std::move(names), {settings::method});
  }
  map.degrees_of_freedom = Eigen::VectorXd::Constant(m, static_cast<double>(set.size()));
  map.columns = run.columns();
  map.coefficients_from_readings = pseudo_inverse(map.columns).topRows(4 * m);
  map.parameters = static_cast<double>(map.columns.cols()) / static_cast<double>(m);
  return map;
}

// The effect of shared errors on n readings of m axes. The matrix has n m rows, one for each axis
// of each reading. Each column is the change of the readings if one of the independent errors has
// the size of its standard deviation.
using SharedErrors = Eigen::MatrixXd;

// Returns the effect of each uncertain input on the readings. The keys are the names of the inputs.
std::map<std::string, SharedErrors> errors_of_inputs(const ForecastSetup& setup,
                                                     const Fit& run,
                                                     const TableField& field) {
  Experiment experiment;
  experiment.positioner = setup.positioner.with_normal_u(setup.normal_u_rad);
  experiment.rotation_sensor_from_positioner = setup.mount.rotation_sensor_from_positioner;
  experiment.stated.slope_u = setup.level_u_rad;
  std::vector<InputQuantity> inputs =
      input_quantities(experiment, run.set(), method_kind(setup.method).directions_known, field);
  if (setup.mount.repeatability_rad > 0.0) {
    inputs.push_back(mount_quantity(setup.mount.repeatability_rad, run.set()));
  }
  std::map<std::string, SharedErrors> errors;
  for (const InputQuantity& input : inputs) {
    errors[input.name] = input_error_jacobian({input}, run, field);
  }
  return errors;
}

// Returns the covariance of the coefficients from the simulated errors in setup.world. The readings
// are in random order, so any two of them are assumed to have the mean correlation of the run.
// @param L  the linear map from the readings of one replicate to the coefficients.
Eigen::MatrixXd covariance_in_world(const ForecastSetup& setup,
                                    const Eigen::MatrixXd& L,
                                    double replicates) {
  const World& world = setup.world;
  const ReadingSet set = reading_set(setup);
  const Eigen::Index n = set.size();
  const Eigen::Index m = set.axis_count();
  const SensitivityMatrix& S = setup.nominal.response.sensitivity;
  const Eigen::Vector3d in_table = field_in_table(setup);
  // Each matrix has the effect of one kind of error on all readings. `sizes` is for errors of the
  // field's magnitude, and `seats` for rotations of the cube. Both have separate columns for each
  // reading.
  Eigen::MatrixXd sizes = Eigen::MatrixXd::Zero(n * m, n);
  Eigen::MatrixXd seats = Eigen::MatrixXd::Zero(n * m, 3 * n);
  Eigen::MatrixXd gains = Eigen::MatrixXd::Zero(n * m, m);
  Eigen::MatrixXd biases = Eigen::MatrixXd::Zero(n * m, m);
  Eigen::MatrixXd mounts = Eigen::MatrixXd::Zero(n * m, 3);
  Eigen::VectorXd at_ends = Eigen::VectorXd::Zero(n * m);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Eigen::Vector3d field = set.readings[at].level.of_all() * in_table;
    const Eigen::Matrix3d& R = set.rotation_sensor_from_table[at];
    const Eigen::VectorXd along = parts_along(setup.nominal, R * field);
    for (Eigen::Index k = 0; k < m; ++k) {
      const Eigen::Index row = m * i + k;
      const double response = S.row(k).dot(R * field);
      sizes(row, i) = response;
      gains(row, k) = response;
      biases(row, k) = 1.0;
      seats.block<1, 3>(row, 3 * i) = -S.row(k) * R * cross_matrix(field);
      mounts.row(row) = -S.row(k) * cross_matrix(Eigen::Vector3d(R * field));
      at_ends(row) = along(k) * along(k);
    }
  }
  const double readings = replicates * static_cast<double>(n);
  // Returns the mean correlation of any two readings of a run, computed from the correlation of
  // consecutive readings.
  const auto mean_correlation = [&](double neighbours) {
    constexpr int longest = 10000;
    double sum = 0.0;
    double power = 1.0;
    for (int lag = 1; lag < longest && lag < readings; ++lag) {
      power *= neighbours;
      sum += (readings - lag) * power;
    }
    return 2.0 * sum / (readings * (readings - 1.0));
  };
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(L.rows(), L.rows());
  const auto add = [&](double sd, const Eigen::MatrixXd& changes, double times) {
    if (sd > 0.0) {
      const Eigen::MatrixXd part = sd * (L * changes);
      sum += part * part.transpose() / times;
    }
  };
  const auto add_alike = [&](double sd, double neighbours, const Eigen::MatrixXd& one_by_one,
                             const Eigen::MatrixXd& together) {
    const double alike = mean_correlation(neighbours);
    add(sd * std::sqrt(std::max(1.0 - alike, 0.0)), one_by_one, replicates);
    add(sd * std::sqrt(std::max(alike, 0.0)), together, 1.0);
  };
  const double of_mean = std::sqrt(static_cast<double>(setup.samples));
  constexpr double wander_of_neighbours = 0.9;  // correlation of consecutive readings
  add(world.block_sd, biases, replicates);
  add(world.gain, gains, replicates);
  add(std::hypot(world.mount_rad, world.remount_rad), mounts, replicates);
  add(world.seat_rad, seats, replicates);
  add(world.jitter, sizes, replicates);
  add_alike(world.wander, wander_of_neighbours, sizes, sizes.rowwise().sum());
  if (world.ends > 1.0) {
    add(setup.noise_sd / of_mean * std::sqrt(world.ends * world.ends - 1.0),
        at_ends.cwiseSqrt().asDiagonal(), replicates);
  }
  if (world.ar != 0.0) {
    // The forecast already includes the noise as white noise, so only its correlation is added.
    add(setup.noise_sd / of_mean * std::sqrt(std::max(mean_correlation(world.ar), 0.0)), biases,
        1.0);
  }
  const Eigen::MatrixXd each = Eigen::MatrixXd::Identity(n * m, n * m);
  constexpr double of_rounding = 0.288675134594813;  // 1 / sqrt(12)
  add(std::hypot(world.ar_white, world.round * of_rounding), each, replicates);
  add(world.periodic / std::sqrt(2.0), each, replicates);
  add(world.walk_sd * std::sqrt(readings / 6.0), each, replicates);
  return sum;
}

Eigen::MatrixXd part_of_world(const ForecastSetup& setup,
                              const Eigen::MatrixXd& L,
                              double replicates) {
  return setup.world.is_white() ? Eigen::MatrixXd(Eigen::MatrixXd::Zero(L.rows(), L.rows()))
                                : covariance_in_world(setup, L, replicates);
}

// Returns the covariance of the coefficients that is caused by errors that readings share.
Eigen::MatrixXd part_of(const SharedErrors& errors, const Eigen::MatrixXd& map) {
  if (errors.size() == 0) {
    return Eigen::MatrixXd::Zero(map.rows(), map.rows());
  }
  const Eigen::MatrixXd changes = map * errors;
  return changes * changes.transpose();
}

// Returns the linear map of generalised least squares, which calibrate() uses if the cube's normals
// are uncertain.
// @param variance  variance of the mean reading at each point.
Eigen::MatrixXd generalized_map(const LinearMap& map,
                                const SharedErrors& positioner,
                                const SharedErrors& level,
                                double variance) {
  Eigen::MatrixXd V = positioner * positioner.transpose();
  if (level.size() > 0) {
    V += level * level.transpose();
  }
  constexpr double rounding = 1e-12;
  V.diagonal().array() += std::max(variance, rounding * V.diagonal().maxCoeff());
  const Whitening whitening(V);
  const Eigen::MatrixXd W = whitening.times(map.columns);
  const Eigen::MatrixXd from_whitened =
      pseudo_inverse(W).topRows(map.coefficients_from_readings.rows());
  return whitening.transposed_times(from_whitened.transpose()).transpose();
}

// The parts of a forecast that do not depend on the number of replicates.
struct ForecastParts {
  LinearMap map;
  SharedErrors positioner, level, mount;
};

ForecastParts parts_of(const ForecastSetup& setup) {
  const ReadingSet set = reading_set(setup);
  const TableField field = set.field.with_all(field_in_table(setup));
  check_design(setup, set, field);
  SolvedReadings state(set, method_kind(setup.method).directions_known);
  const Fit run(state, field, Eigen::VectorXd::Ones(set.axis_count()));
  std::map<std::string, SharedErrors> errors = errors_of_inputs(setup, run, field);
  return {.map = linear_map(setup, run),
          .positioner = std::move(errors["positioner"]),
          .level = std::move(errors["levelness"]),
          .mount = std::move(errors["mount"])};
}

// @param replicates  number of replicates; a double, because replicates_for_angle() tries very
//                    large numbers.
Forecast forecast_of(const ForecastSetup& setup, const ForecastParts& parts, double replicates) {
  const double variance =
      setup.noise_sd * setup.noise_sd / (replicates * static_cast<double>(setup.samples));
  Eigen::MatrixXd L = parts.map.coefficients_from_readings;
  const bool weighed = setup.positioner.description().normal_covariance.has_value() &&
                       parts.positioner.size() > 0 && parts.map.columns.size() > 0;
  if (weighed && variance > 0.0) {
    L = generalized_map(parts.map, parts.positioner, parts.level, variance);
  }
  Forecast result;
  result.noise = variance * L * L.transpose();
  result.positioner = part_of(parts.positioner, L);
  result.level = part_of(parts.level, L);
  result.mount = part_of(parts.mount, L);
  result.world = part_of_world(setup, L, replicates);
  result.degrees_of_freedom =
      replicates * parts.map.degrees_of_freedom.array() - parts.map.parameters;
  result.response = setup.nominal.response;
  result.magnitude = setup.nominal.field.magnitude;
  return result;
}

// Returns the covariance of the field that a calibrated reading gives.
// @param field  the true field, in the instrument's frame.
Eigen::Matrix3d field_covariance(const Forecast& forecast,
                                 const Eigen::MatrixXd& inverse,
                                 const Eigen::MatrixXd& covariance,
                                 const Eigen::Vector3d& field) {
  const Eigen::Index m = forecast.response.bias.size();
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(m, 4 * m);
  for (Eigen::Index k = 0; k < m; ++k) {
    B(k, 4 * k) = 1.0;
    B.block<1, 3>(k, 4 * k + 1) = field.transpose();
  }
  const Eigen::MatrixXd G = inverse * B;
  return G * covariance * G.transpose();
}

Eigen::MatrixXd inverse_of(const Forecast& forecast) {
  const PseudoInverseWithRank inverse = pseudo_inverse_with_rank(forecast.response.sensitivity);
  if (inverse.rank < 3) {
    throw DomainError("forecast: the angles need an instrument with three independent axes");
  }
  return inverse.inverse;
}

// Returns the method that calibrate() would choose for these design points.
Method method_for(const Experiment& experiment, const std::vector<DesignEntry>& design) {
  Observations observations;
  for (const DesignEntry& entry : design) {
    observations.readings.push_back({.point = entry.point, .level = entry.level});
  }
  // With fewer points than this, the direction of the field is not determined, so the forecast
  // assumes that it is known.
  constexpr std::size_t fewest_for_direction = 10;
  const Method method = choose_method(experiment, observations);
  const bool is_open = !experiment.fit.method && method == Method::joint;
  return is_open && design.size() < fewest_for_direction ? Method::known : method;
}

void check_setup(const ForecastSetup& setup) {
  if (!(setup.noise_sd >= 0.0) || !std::isfinite(setup.noise_sd) || setup.replicates < 1 ||
      setup.samples < 1 || !(setup.normal_u_rad >= 0.0) ||
      !(setup.mount.repeatability_rad >= 0.0) || !(setup.level_u_rad >= 0.0)) {
    throw DomainError(
        "forecast: noise and uncertainties must not be negative, and replicates and samples must "
        "be at least 1");
  }
}

}  // namespace

SensorModel nominal_sensor(const Experiment& experiment, double sensitivity) {
  SensorModel nominal;
  nominal.instrument = experiment.instrument;
  nominal.field = make_field_description(experiment);
  const Eigen::Index m = experiment.instrument.axis_count();
  nominal.response.bias = Eigen::VectorXd::Zero(m);
  nominal.response.sensitivity = SensitivityMatrix::Zero(m, 3);
  for (Eigen::Index k = 0; k < m; ++k) {
    const int component = nominal_axis(experiment.instrument, k).value_or(static_cast<int>(k % 3));
    nominal.response.sensitivity(k, component) = sensitivity;
  }
  return nominal;
}

ForecastSetup forecast_setup(const Experiment& experiment,
                             std::vector<DesignEntry> design,
                             double sensitivity) {
  Experiment level = experiment;
  level.table.slope.setZero();
  ForecastSetup setup;
  setup.nominal = nominal_sensor(level, sensitivity);
  setup.method = method_for(experiment, design);
  setup.design = std::move(design);
  setup.positioner = experiment.positioner;
  setup.slope = experiment.table.slope;
  setup.mount = setup.positioner.mount(experiment.slot).value_or(Mount{});
  setup.mount.rotation_sensor_from_positioner = mount_rotation(setup.positioner, experiment.slot);
  return setup;
}

Forecast forecast(const ForecastSetup& setup) {
  check_setup(setup);
  return forecast_of(setup, parts_of(setup), setup.replicates);
}

AngleUncertainty forecast_angles(const Forecast& forecast,
                                 const Eigen::MatrixXd& covariance,
                                 double pitch_rad,
                                 double roll_rad,
                                 PitchFormula formula) {
  const double F = forecast.magnitude;
  const double cp = std::cos(pitch_rad);
  const double sp = std::sin(pitch_rad);
  const double cr = std::cos(roll_rad);
  const double sr = std::sin(roll_rad);
  const Eigen::Vector3d field = F * Eigen::Vector3d(sp, cp * sr, cp * cr);
  const Eigen::Matrix3d C =
      field_covariance(forecast, inverse_of(forecast), covariance, field) / (F * F);
  const Eigen::Vector3d by_pitch = formula == PitchFormula::arcsine
                                       ? Eigen::Vector3d(1.0 / cp, 0.0, 0.0)
                                       : Eigen::Vector3d(cp, -sp * sr, -sp * cr);
  const Eigen::Vector3d by_roll(0.0, cr / cp, -sr / cp);
  return {.pitch_rad = std::sqrt(by_pitch.dot(C * by_pitch)),
          .roll_rad = std::sqrt(by_roll.dot(C * by_roll))};
}

double largest_angle_uncertainty(const Forecast& forecast, const Eigen::MatrixXd& covariance) {
  // The function is smooth, so 600 directions give its maximum with a relative error of about
  // 0.001.
  constexpr int directions = 600;
  const Eigen::MatrixXd inverse = inverse_of(forecast);
  double largest = 0.0;
  for (const Eigen::Vector3d& u : directions_on_sphere(directions)) {
    const Eigen::Matrix3d C =
        field_covariance(forecast, inverse, covariance, forecast.magnitude * u);
    const Eigen::Matrix<double, 3, 2> T = tangents_of(u);
    const Eigen::Matrix2d tangential = T.transpose() * C * T;
    largest = std::max(largest, symmetric_eigen(tangential).values(1));
  }
  return std::sqrt(largest) / forecast.magnitude;
}

std::optional<double> replicates_for_angle(const ForecastSetup& setup, double wanted_rad) {
  if (!(wanted_rad > 0.0)) {
    throw DomainError("replicates_for_angle: the wanted uncertainty must be positive");
  }
  ForecastSetup one = setup;
  one.replicates = 1;
  check_setup(one);
  const ForecastParts parts = parts_of(one);
  const auto reaches = [&](double replicates) {
    const Forecast tried = forecast_of(one, parts, replicates);
    return largest_angle_uncertainty(tried, tried.covariance()) <= wanted_rad;
  };
  constexpr double most = 1e15;
  if (!reaches(most)) {
    return std::nullopt;
  }
  double low = 0.0;  // this number of replicates is not enough
  double high = 1.0;
  while (!reaches(high)) {
    low = high;
    high *= 2.0;
  }
  while (high - low > 1.0) {
    const double middle = std::floor(0.5 * (low + high));
    (reaches(middle) ? high : low) = middle;
  }
  return high;
}

}  // namespace axiscal
