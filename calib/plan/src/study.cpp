// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/study.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/experiment_json.hpp"
#include "axiscal/calib/reading_uncertainty.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/parallel.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/earth_rotation_field.hpp"
#include "axiscal/field/field_kind.hpp"
#include "calib/calibrate/fitted_record.hpp"
#include "calib/plan/src/study_blocks.hpp"
#include "calib/regression/factor.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"

namespace axiscal {
namespace {

// Returns the seed of a trial. The seeds of different trials are independent (splitmix64).
std::uint64_t seed_of_trial(std::uint64_t seed, std::int64_t trial) {
  std::uint64_t z = seed * 0x9E3779B97F4A7C15ULL +
                    (static_cast<std::uint64_t>(trial) + 1) * 0xD1B54A32D192ED03ULL;
  z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31U);
}

// Returns the standard deviation of each run's additional slope, for x and y each [rad].
double slope_sd_of(const StudySetup& setup) {
  return setup.simulation.world.stated ? std::hypot(setup.slope_sd, setup.experiment.stated.slope_u)
                                       : setup.slope_sd;
}

class Trial {
 public:
  Trial(const StudySetup& setup, const Eigen::MatrixXd& normal_root, std::uint64_t seed)
      : setup_(setup),
        truth_(setup.truth),
        random_(seed, 7),
        sheet_random_(seed),
        simulation_(setup.simulation) {
    simulation_.seed = seed;
    noise_random_ = stream_of_noise(simulation_);
    if (!setup.recording) {
      RandomStream::seed_several({&random_, &sheet_random_, &noise_random_});
    }
    if (setup.noise_sd.size() > 0) {
      simulation_.noise_sds = setup.noise_sd;
    }
    simulation_.slope += slope_sd_of(setup) * random_.normals<2>();
    if (setup.drawing) {
      simulation_.positioner =
          random_positioner(*setup.drawing, setup.surface, setup.tolerances, random_);
    } else if (normal_root.size() > 0) {
      simulation_.positioner = with_errors(setup.experiment.positioner, normal_root);
    } else {
      simulation_.positioner = setup.experiment.positioner;
    }
    simulation_.rotation_sensor_from_positioner = setup.experiment.rotation_sensor_from_positioner;
    if (setup.simulation.world.stated && truth_.field.in_table) {
      draw_field(setup.experiment);
    }
  }

  [[nodiscard]] Calibration calibrated() {
    if (setup_.recording && setup_.recording->kind == RecordingKind::turns) {
      return calibrated_by_turns();
    }
    SimulatedRun run = setup_.recording ? simulate_recording(truth_, *setup_.recording, simulation_)
                                        : simulate_run(truth_, sheet(), simulation_, noise_random_);
    bias_of_run_ = std::move(run.bias_of_run);
    return setup_.alarms ? calibrate(setup_.experiment, run.observations)
                         : fitted_record(setup_.experiment, run.observations);
  }

  // Returns the best possible result of a calibration of the run: the truth with the run's mean
  // bias.
  [[nodiscard]] SensorModel truth() const {
    SensorModel truth = setup_.truth;
    truth.response.bias += bias_of_run_;
    const bool free = setup_.recording && setup_.recording->kind == RecordingKind::free;
    return free ? rotated_to_shape(std::move(truth), setup_.experiment.fit.shape) : truth;
  }

  // Simulates one reading in a random attitude and adds the errors of its field components and
  // angles to `sums`, together with their stated uncertainties.
  void add_angles(const Calibration& calibration, std::vector<StudySums>& sums, std::size_t from) {
    constexpr double highest = 0.984807753012208;  // sin 80 degrees
    const double sine = highest * (2.0 * random_.uniform() - 1.0);
    const double roll = std::numbers::pi * (2.0 * random_.uniform() - 1.0);
    const Eigen::Vector3d field = field_of_attitude(setup_.truth, std::asin(sine), roll);
    Eigen::VectorXd v = response_at(setup_.truth, field, reference());
    for (Eigen::Index k = 0; k < v.size(); ++k) {
      const double sd =
          setup_.noise_sd.size() > 0 ? setup_.noise_sd(k) : setup_.simulation.noise_sd;
      v(k) += sd * random_.normal();
    }
    const Reducer reducer(calibration, {}, Force::yes);
    const ReducedReading reduced = reducer.reduce({v.data(), static_cast<std::size_t>(v.size())},
                                                  {.temperature = reference()});
    const AttitudeBudget budget =
        attitude_budget(calibration, {}, {}, reduced.field_in_sensor, reference());
    const double F = setup_.truth.field.magnitude;
    const std::array<double, 5> errors = {
        reduced.field_in_sensor.x() - field.x(), reduced.field_in_sensor.y() - field.y(),
        reduced.field_in_sensor.z() - field.z(),
        std::asin(std::clamp(reduced.field_in_sensor.x() / F, -1.0, 1.0)) * deg_per_rad -
            std::asin(sine) * deg_per_rad,
        std::remainder(std::atan2(reduced.field_in_sensor.y(), reduced.field_in_sensor.z()) -
                           std::atan2(field.y(), field.z()),
                       2.0 * std::numbers::pi) *
            deg_per_rad};
    for (const AttitudeQuantity& quantity : budget.quantities) {
      const auto at = std::find(angle_names.begin(), angle_names.end(), quantity.name);
      if (at != angle_names.end()) {
        const auto j = static_cast<std::size_t>(at - angle_names.begin());
        add(sums[from + j], errors[j], quantity.uncertainty.u, quantity.uncertainty.expanded);
      }
    }
  }

  static void add(StudySums& sums, double error, double u, double expanded) {
    sums.trials += 1.0;
    sums.error += error;
    sums.error_squared += error * error;
    sums.u_squared += u * u;
    sums.covered += std::abs(error) <= expanded ? 1.0 : 0.0;
  }

  static constexpr std::array<std::string_view, 5> angle_names = {"field_x", "field_y", "field_z",
                                                                  "pitch_deg", "roll_deg"};

 private:
  [[nodiscard]] std::optional<double> reference() const {
    return setup_.truth.temperature ? std::optional(setup_.truth.temperature->reference().mean())
                                    : std::nullopt;
  }

  // Adds random errors to the true field, according to the stated uncertainties of its direction
  // and magnitude.
  void draw_field(const Experiment& experiment) {
    Eigen::Vector3d& field = *truth_.field.in_table;
    field *= 1.0 + experiment.field.magnitude_u / truth_.field.magnitude * random_.normal();
    const Eigen::Vector2d turn = experiment.stated.direction_u_rad * random_.normals<2>();
    field = rotation_by(tangents_of(field) * turn) * field;
  }

  [[nodiscard]] std::vector<RunSheetRow> sheet() {
    return make_run_sheet(setup_.design, setup_.replicates, sheet_random_, setup_.temperatures);
  }

  [[nodiscard]] Calibration calibrated_by_turns() {
    const std::optional<Site>& site = setup_.experiment.table.site;
    // The heading of the table is random. Without a site, the Earth's axis has a random direction.
    const double heading = 2.0 * std::numbers::pi * random_.uniform();
    const double up =
        site ? std::sin(site->latitude_deg * rad_per_deg) : 2.0 * random_.uniform() - 1.0;
    const double across = std::sqrt(1.0 - up * up);
    const Eigen::Vector3d earth =
        earth_rate_rad_per_s *
        Eigen::Vector3d(across * std::cos(heading), across * std::sin(heading), up);
    const std::vector<RunSheetRow> rows = sheet();
    SimulatedTurns turns = simulate_turns(truth_, rows, *setup_.recording, earth, simulation_);
    bias_of_run_ = std::move(turns.bias_of_run);
    return calibrate_turns(turns, rows, truth_.instrument, setup_.experiment.positioner,
                           setup_.experiment.rotation_sensor_from_positioner, site);
  }

  [[nodiscard]] Positioner with_errors(const Positioner& positioner, const Eigen::MatrixXd& root) {
    Eigen::VectorXd z(18);
    for (double& value : z) {
      value = random_.normal();
    }
    const Eigen::VectorXd errors = root * z;
    FaceNormals normals = positioner.normals();
    for (std::size_t face = 0; face < normals.size(); ++face) {
      normals[face] =
          (normals[face] + errors.segment<3>(3 * static_cast<Eigen::Index>(face))).normalized();
    }
    return Positioner(normals);
  }

  const StudySetup& setup_;
  SensorModel truth_;  // the truth with the random field errors from draw_field()
  RandomStream random_;
  RandomStream sheet_random_;  // draws the order of the readings
  RandomStream noise_random_{0};
  SimulationOptions simulation_;
  Eigen::VectorXd bias_of_run_;
};

// Converts the truth's temperature polynomials to the reference temperature of a calibration.
SensorModel truth_about(SensorModel truth, const Calibration& calibration) {
  if (!truth.temperature || !calibration.sensor.temperature) {
    return truth;
  }
  TemperatureResponse& terms = *truth.temperature;
  const SensorTemperature at = calibration.sensor.temperature->reference();
  const Eigen::Index order = terms.bias.cols();
  for (Eigen::Index k = 0; k < truth.response.bias.size(); ++k) {
    const double t0 = at.of(k);
    const double h = t0 - terms.span_of(k).reference;
    const double shift = terms.bias_shift(k, t0);
    const double scale = terms.scale_at(k, t0);
    truth.response.bias(k) += shift;
    truth.response.sensitivity.row(k) *= scale;
    if (order >= 1) {
      const double b2 = order > 1 ? terms.bias(k, 1) : 0.0;
      const double c2 = order > 1 ? terms.scale(k, 1) : 0.0;
      terms.bias(k, 0) += 2.0 * b2 * h;
      terms.scale(k, 0) = (terms.scale(k, 0) + 2.0 * c2 * h) / scale;
      if (order > 1) {
        terms.scale(k, 1) = c2 / scale;
      }
    }
  }
  terms.spans.resize(calibration.sensor.temperature->spans.size(), terms.spans.front());
  for (std::size_t k = 0; k < terms.spans.size(); ++k) {
    terms.spans[k].reference = calibration.sensor.temperature->spans[k].reference;
  }
  // Temperature terms that are fitted but that the truth lacks are 0 in the truth.
  const Eigen::Index fitted = calibration.sensor.temperature->bias.cols();
  if (fitted > order) {
    for (Eigen::MatrixXd* const all : {&terms.bias, &terms.scale}) {
      all->conservativeResize(Eigen::NoChange, fitted);
      all->rightCols(fitted - order).setZero();
    }
  }
  return truth;
}

// A digest that identifies a study (FNV-1a of its description).
std::string digest_of(const StudySetup& setup) {
  Experiment described = setup.experiment;
  Calibration record;
  record.sensor = setup.truth;
  std::string text = calibration_json(record);
  // User-defined fields are described only by the names of their kinds.
  if (!can_be_stated(described)) {
    described.also.insert(described.also.begin(), std::exchange(described.field, FieldSetup()));
    for (const FieldSetup& field : std::exchange(described.also, {})) {
      for (const FieldSetup* const part : field.parts()) {
        text += formatted("{} ", part->kind());
      }
    }
  }
  text += experiment_json(described);
  const auto put = [&](double value) { text += number_text(value) + " "; };
  for (const double sd : setup.noise_sd) {
    put(sd);
  }
  for (const double t : setup.temperatures) {
    put(t);
  }
  for (const DesignEntry& entry : setup.design) {
    text += entry.point.name();
    text += entry.level.text();
  }
  const Tolerances& made = setup.tolerances;
  for (const double value :
       {static_cast<double>(setup.replicates), setup.simulation.noise_sd,
        setup.simulation.slope.x(), setup.simulation.slope.y(), setup.simulation.resolution,
        setup.simulation.temperature_sd, setup.regression_only ? 1.0 : 0.0, setup.slope_sd,
        made.foot_height_m, made.ball_radius_m, made.squareness_rad, made.fence_rad,
        setup.random_normals ? 1.0 : 0.0}) {
    put(value);
  }
  if (setup.recording) {
    text += "recording ";
    put(static_cast<double>(setup.recording->kind));
    put(static_cast<double>(setup.recording->samples));
    put(setup.recording->rate_hz);
  }
  text += world_text(setup.simulation.world) + (setup.alarms ? " alarms " : "");
  std::uint64_t hash = 14695981039346656037ULL;
  for (const char c : text) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  }
  std::string digits;
  for (int i = 0; i < 16; ++i) {
    digits += "0123456789abcdef"[hash >> 60U];
    hash <<= 4U;
  }
  return digits;
}

bool gives_angles(const StudySetup& setup) {
  return setup.angles && !setup.recording && setup.truth.instrument.axis_count() >= 3 &&
         !setup.truth.instrument.one_sided && setup.truth.also.empty() &&
         find_instrument_kind(setup.truth.instrument.kind).has_axis_elevation;
}

// Returns a matrix square root of the covariance of the positioner's normals; empty if errors of
// the normals are not simulated.
Eigen::MatrixXd root_of_normals(const StudySetup& setup) {
  const auto& covariance = setup.experiment.positioner.description().normal_covariance;
  if (!setup.random_normals && !(setup.simulation.world.stated && covariance)) {
    return {};
  }
  if (!covariance) {
    throw DomainError(
        "run_study: the positioner does not contain the covariance of its face "
        "normals");
  }
  return covariance_root(*covariance);
}

// The sums over the trials of a block.
struct StudyBlock {
  std::vector<std::string> parameters;
  std::vector<StudySums> sums;
  std::int64_t refused = 0;
  std::map<std::string, std::int64_t> warnings;
};

// Adds a trial to the count of each warning that its calibration has.
void count_warnings(const Calibration& calibration, std::map<std::string, std::int64_t>& counts) {
  std::set<std::string> names;
  for (const CalibrationWarning& warning : calibration.findings.warnings) {
    names.emplace(warning_name(warning.code));
    names.emplace("any");
  }
  for (const std::string& name : names) {
    ++counts[name];
  }
}

// @param is_first  true for the first block of a shard. In this block a refused trial throws an
//                  error, unless an earlier trial gave a calibration.
StudyBlock run_block(const StudySetup& setup,
                     const Eigen::MatrixXd& normal_root,
                     const Study& study,
                     std::int64_t number,
                     bool is_first) {
  const bool angles = gives_angles(setup);
  StudyBlock block;
  const std::int64_t last = std::min(study.trials, (number + 1) * study.block);
  for (std::int64_t t = number * study.block; t < last; ++t) {
    Calibration calibration;
    Trial trial(setup, normal_root, seed_of_trial(study.seed, t));
    try {
      calibration = trial.calibrated();
    } catch (const RefusedError&) {
      if (is_first && block.parameters.empty()) {
        throw;
      }
      ++block.refused;
      continue;
    }
    if (block.parameters.empty()) {
      block.parameters = calibration.fit.statistics->parameter_names;
      if (angles) {
        block.parameters.insert(block.parameters.end(), Trial::angle_names.begin(),
                                Trial::angle_names.end());
      }
      block.sums.resize(block.parameters.size());
    }
    const std::vector<ParameterUncertainty> stated = parameter_uncertainties(calibration);
    const SensorModel truth = truth_about(trial.truth(), calibration);
    if (setup.alarms) {
      count_warnings(calibration, block.warnings);
    }
    for (std::size_t p = 0; p < stated.size() && p < block.sums.size(); ++p) {
      Trial::add(block.sums[p], stated[p].value - parameter_value(truth, stated[p].name),
                 stated[p].uncertainty.u, stated[p].uncertainty.expanded);
    }
    if (angles) {
      trial.add_angles(calibration, block.sums, stated.size());
    }
  }
  return block;
}

}  // namespace

Study run_study(const StudySetup& given,
                std::int64_t trials,
                std::uint64_t seed,
                const Shard& shard,
                const std::function<void(std::int64_t)>& progress) {
  if (trials < 1 || shard.count < 1 || shard.number < 1 || shard.number > shard.count) {
    throw DomainError("run_study: needs at least one trial, and a shard I of N with 1 <= I <= N");
  }
  Study study{.seed = seed, .trials = trials, .setup = digest_of(given)};
  if (given.recording && given.recording->kind == RecordingKind::sweep) {
    throw DomainError(
        "study: a recording of the kind 'sweep' cannot be studied, because its biases include the "
        "response to the field; simulate one sweep and calibrate it");
  }
  if (given.regression_only) {
    run_regression_study(given, shard, progress, study);
    return study;
  }
  StudySetup setup = given;
  // The search for mistakes changes coefficients only if it finds a drift, so it is omitted for
  // white noise.
  setup.experiment.fit.search_for_mistakes = setup.alarms || !setup.simulation.world.is_white();
  const Eigen::MatrixXd normal_root = root_of_normals(setup);
  study.block = 250;
  study.blocks = blocks_of_shard(study, shard);
  std::vector<StudyBlock> blocks(study.blocks.size());
  ProgressReport report(progress);
  const auto run_one = [&](std::size_t i) {
    blocks[i] = run_block(setup, normal_root, study, study.blocks[i], i == 0);
    report.add(std::min(trials, (study.blocks[i] + 1) * study.block) -
               study.blocks[i] * study.block);
  };
  if (!blocks.empty()) {
    run_one(0);
    for_each_in_parallel(blocks.size() - 1, [&](std::size_t i) { run_one(i + 1); });
    study.parameters = blocks.front().parameters;
  }
  for (StudyBlock& block : blocks) {
    study.refused += block.refused;
    add_counts(block.warnings, study.warnings);
    study.sums.push_back(std::move(block.sums));
  }
  return study;
}

}  // namespace axiscal
