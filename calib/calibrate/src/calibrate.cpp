// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/calibrate.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <utility>

#include <Eigen/LU>

#include "axiscal/calib/bias_fit.hpp"
#include "axiscal/calib/calibrate_run.hpp"
#include "axiscal/calib/calibrated_coefficients.hpp"
#include "axiscal/calib/calibration_warning.hpp"
#include "axiscal/calib/confirmation_fit.hpp"
#include "axiscal/calib/culprit.hpp"
#include "axiscal/calib/estimate_by_method.hpp"
#include "axiscal/calib/estimation.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/face_lengths.hpp"
#include "axiscal/calib/field_size.hpp"
#include "axiscal/calib/generalized_fit.hpp"
#include "axiscal/calib/lack_of_fit.hpp"
#include "axiscal/calib/levelness_test.hpp"
#include "axiscal/calib/magnitude.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/calib/mount_turns.hpp"
#include "axiscal/calib/orientation_quality.hpp"
#include "axiscal/calib/parameter_names.hpp"
#include "axiscal/calib/polar_fit.hpp"
#include "axiscal/calib/reading_source.hpp"
#include "axiscal/calib/saturated_axes.hpp"
#include "axiscal/calib/settings.hpp"
#include "axiscal/calib/state_of_run.hpp"
#include "axiscal/calib/temperature_fit.hpp"
#include "axiscal/calib/transfer.hpp"
#include "axiscal/calib/uncertainty_sources.hpp"
#include "axiscal/calib/variance_model.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/version.hpp"
#include "axiscal/field/settings.hpp"
#include "method_choice.hpp"
#include "remarks.hpp"
#include "run_checks.hpp"
#include "run_residuals.hpp"
#include "stated_attitudes.hpp"
#include "temperature_choice.hpp"
#include "warnings.hpp"

namespace axiscal {
namespace {

// The field as fitted, part by part, and what its parts make together at level 1.
void set_fitted(const TableField& fitted, FieldDescription& field) {
  if (!fitted.has_vectors()) {
    field.in_table.reset();  // the readings bring theirs
    return;
  }
  for (std::size_t p = 0; p < field.parts.size(); ++p) {
    field.parts[p].in_table = fitted.vector(p);
    if (field.parts[p].free_length) {
      field.parts[p].magnitude = fitted.vector(p).norm();
    }
  }
  field.in_table = fitted.mean();
  if (!field.parts.empty()) {
    field.magnitude = field.in_table->norm();
  }
}

Eigen::Matrix3d noise_of(const Observations& observations) {
  if (!observations.response_sd || observations.response.cols() != 3 ||
      !(observations.response_sd->array() > 0.0).all()) {
    return Eigen::Matrix3d::Identity();
  }
  return observations.response_sd->cwiseAbs2().colwise().mean().asDiagonal();
}

void put_temperature(const Estimate& estimate,
                     const ReadingSource& source,
                     std::vector<TemperatureOrderTrial> trials,
                     Calibration& calibration) {
  if (!trials.empty()) {
    std::string text;
    for (const TemperatureOrderTrial& trial : trials) {
      text += formatted("{}{} AICc {}", text.empty() ? "order " : ", order ", trial.order,
                        number_text(trial.aicc, 4));
    }
    calibration.findings.notes.push_back(
        {NoteCode::temperature,
         formatted("temperature order {} was chosen: {}", estimate.temperature_bias.cols(), text)});
  }
  if (estimate.temperature_bias.cols() == 0) {
    return;
  }
  TemperatureResponse& temperature = calibration.sensor.temperature.emplace();
  temperature.spans = source.temperature_spans();
  temperature.bias = estimate.temperature_bias;
  temperature.scale = estimate.temperature_scale;
  temperature.bias_se = temperature.bias;
  temperature.scale_se = temperature.scale;
  temperature.trials = std::move(trials);
}

// The known-art form fitted to the same readings in the field as fitted.
void compare_polar_fit(const ReadingSet& set, const TableField& field, Calibration& calibration) {
  if (calibration.sensor.temperature || !calibration.sensor.also.empty() || set.leaves_out() ||
      (!field.has_vectors() && !set.rotation_sensor_from_table.empty())) {
    throw SetupError(
        "the polar fit goes with plain readings of one field, without temperature terms",
        {settings::polar_fit});
  }
  const Eigen::Matrix<double, Eigen::Dynamic, 3> met = field_design(set, field).middleCols<3>(1);
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const int axis = main_axis(calibration.sensor.instrument, calibration.sensor.response, k);
    calibration.fit.polar_fit.push_back(
        fit_polar_form(met, set.response.col(k), axis, calibration.sensor.instrument.convention));
  }
}

// The readings of the fit alone; nothing where those are all.
std::optional<Observations> without_left_out(const Experiment& experiment,
                                             const Observations& observations) {
  const auto is_out = [&](const Reading& reading) {
    const std::vector<int>& out = experiment.leave_out;
    return reading.confirm || std::find(out.begin(), out.end(), reading.run) != out.end();
  };
  const std::vector<Reading>& all = observations.readings;
  if (std::none_of(all.begin(), all.end(), is_out)) {
    return std::nullopt;
  }
  Observations used;
  std::remove_copy_if(all.begin(), all.end(), std::back_inserter(used.readings), is_out);
  used.has_fence = observations.has_fence;
  return used;
}

// The lengths of the fields that readings bring, those of no field left out.
struct MetFields {
  double least = 0.0;
  double largest = 0.0;

  // Lengths within 5 % are one size: rounding and small errors of the angles change them so much.
  [[nodiscard]] bool vary() const {
    constexpr double alike = 1.05;
    return largest > alike * least;
  }
};

MetFields fields_met_by(const Observations& observations) {
  MetFields met;
  for (const Reading& reading : observations.readings) {
    const double length = reading.field_in_sensor ? reading.field_in_sensor->norm() : 0.0;
    if (length > 0.0) {
      met.least = met.least == 0.0 ? length : std::min(met.least, length);
      met.largest = std::max(met.largest, length);
    }
  }
  met.largest = met.largest == 0.0 ? 1.0 : met.largest;  // of none at all the fit says so
  met.least = met.least == 0.0 ? met.largest : met.least;
  return met;
}

// How much of a record is made.
enum class RecordPart : std::uint8_t { all, coefficients };

// Takes one run on its way to a record, step by step.
class RunFit {
 public:
  RunFit(const Experiment& experiment, const Observations& observations, RecordPart part)
      : experiment_(experiment),
        observations_(observations),
        remarks_(part == RecordPart::all),
        without_left_out_(without_left_out(experiment, observations)),
        method_(choose_method(experiment, used())),
        kind_(method_kind(method_)),
        weighting_(experiment.weighting.value_or(observations.samples ? Weighting::samples
                                                                      : Weighting::none)),
        by_field_(kind_.directions_known && brings_field(observations)),
        source_(checked(experiment, used(), method_), observations, weighting_, by_field_) {
    check_method(experiment, observations, used(), method_, by_field_);
    const std::optional<MetFields> met =
        by_field_ ? std::optional(fields_met_by(used())) : std::nullopt;
    parts_ = resolve_field(experiment, source_.mean_time_s(),
                           met ? std::optional(met->largest) : std::nullopt);
    if (met && met->vary() && parts_.size() == 1) {
      field_varies_ = true;
      parts_.front().magnitude_u *= met->largest / parts_.front().magnitude;
      parts_.front().magnitude = met->largest;
      calibration_.findings.notes.push_back(
          {NoteCode::field,
           formatted(
               "the fields of the readings are from {} to {}{} long; full response is that at "
               "the largest",
               number_text(met->least, 4), number_text(met->largest, 4),
               parts_.front().unit == "1" ? "" : " " + parts_.front().unit)});
    }
    check_unit(experiment.instrument, parts_.front());
    if (field_moves(experiment) && !by_field_ && !parts_.front().in_table) {
      throw RefusedError(
          experiment.field.moving_part()->of->moving_name() +
              " needs the time of the readings: a column 'time' (ISO 8601, UTC), or a "
              "date with a time of day",
          {settings::date});
    }
  }

  [[nodiscard]] Method method() const { return method_; }

  // Whether what is said of the run is wanted beside its coefficients.
  [[nodiscard]] bool remarks() const { return remarks_; }

  [[nodiscard]] Calibration result() { return std::move(calibration_); }

  // What is known before anything is fitted.
  void describe() {
    calibration_.provenance.created = timestamp_now();
    calibration_.provenance.software = software_name();
    calibration_.sensor.instrument = experiment_.instrument;
    calibration_.sensor.field = describe_field(experiment_.table, parts_);
    calibration_.fit.method = method_;
    calibration_.fit.weights = weighting_;
    calibration_.fit.robust = experiment_.robust;
    calibration_.provenance.positioner = experiment_.positioner.id();
    calibration_.provenance.slot = experiment_.slot;
    calibration_.fit.level_by_block = experiment_.level_by == LevelBy::block;
    calibration_.fit.left_out = experiment_.leave_out;
    note_choice_of_method(used(), method_, calibration_);
    note_weights(experiment_, used(), calibration_);
    if (kind_.directions_known && !by_field_) {
      check_known_magnitude(calibration_.sensor.field);
    }
  }

  void fit_biases() {
    fit_bias(experiment_, observations_, source_, calibration_);
    calibration_.fit.uncertainty = make_budget(experiment_, {}, calibration_, {}, {});
  }

  void choose_temperature_order() {
    const TemperatureSetup& setup = experiment_.temperature;
    if (setup.automatic) {
      trials_ = try_orders(method_, source_, parts_, by_field_);
      source_.set_temperature(chosen_order(trials_), setup.reference);
    } else if (setup.order > 0) {
      source_.set_temperature(setup.order, setup.reference);
    }
  }

  // Whether temperature terms that nobody asked for are there beyond doubt.
  [[nodiscard]] bool needs_temperature_terms() const { return clearly_needed(trials_); }

  void take_as_looked_at() { looked_at_temperature_ = true; }

  void fit() {
    if (kind_.by_magnitude) {
      fit_without_labels();
    } else {
      source_.set_effects({.blocks = true, .drift = experiment_.drift == DriftSetup::linear});
      fit_by_labels();
    }
  }

  void search_for_mistakes() {
    searched_ = experiment_.search_for_mistakes && !kind_.by_magnitude &&
                can_be_searched(fitted_, estimate_);
    look_for_culprit();
    const bool drifts =
        mistakes_.culprit && mistakes_.culprit->correction.code == WarningCode::drift;
    if (drifts && experiment_.drift == DriftSetup::automatic && !fitted_.effects.has_drift) {
      source_.set_effects({.blocks = true, .drift = true});
      fit_by_labels();
      estimate_.notes.push_back({NoteCode::drift, note_of_drift()});
      look_for_culprit();
    }
  }

  // How blocks differ is not in the intervals of readings from a block of their own.
  void note_unknown_blocks() {
    const auto known = [&](const Reading& kept) {
      return std::any_of(fitted_.readings.begin(), fitted_.readings.end(),
                         [&](const Reading& reading) { return reading.block == kept.block; });
    };
    if (!std::all_of(kept_out_.readings.begin(), kept_out_.readings.end(), known)) {
      calibration_.findings.notes.push_back(
          {NoteCode::conditions,
           "readings to be confirmed are of a block that the fit does not know: how biases change "
           "from block to block is not in their intervals"});
    }
  }

  // The estimate with its uncertainty becomes the record's.
  void take_over() {
    if (remarks_) {
      estimate_.saturated = saturated_axes(fitted_, estimate_,
                                           {.magnitude = calibration_.sensor.field.magnitude,
                                            .stated_step = experiment_.stated.resolution,
                                            .one_sided = experiment_.instrument.one_sided});
    }
    const bool is_transfer = fitted_.seen.cols() > 0;
    StateOfRun& fitted_state = *state_;
    std::optional<StateOfRun> judged_state;
    if (judged_) {
      judged_state.emplace(*judged_, kind_.directions_known);
    }
    StateOfRun& alone = judged_state ? *judged_state : fitted_state;
    ScatterSearch search(experiment_, fitted_state, alone, method_);
    if (!kind_.by_magnitude) {
      const bool tests = remarks_ && !is_transfer;
      if (tests) {
        test_levelness(alone, estimate_);
        test_lack_of_fit_of_inputs(experiment_, fitted_, method_, estimate_);
      }
      search.mounts = source_.mount_turns();
      search.mounts_expected = mounts_expected_;
      count_scatter(search, estimate_);
      search.forget_run();
      if (tests) {
        estimate_.curvature = test_curvature(experiment_, fitted_state, method_, estimate_);
      }
      CalibrationConditions& conditions = calibration_.fit.conditions;
      conditions.blocks = static_cast<int>(std::max<std::size_t>(fitted_.effects.blocks.size(), 1));
      conditions.mounts =
          search.mounts_known ? static_cast<int>(search.mounts.size()) : conditions.mounts;
      conditions.earlier = estimate_.earlier;
      conditions.intermediate =
          conditions.blocks > 1 || conditions.mounts > 1 || conditions.earlier > 0;
      conditions.block_mean_square = estimate_.block_mean_square;
      conditions.block_degrees_of_freedom = estimate_.block_degrees_of_freedom;
      conditions.sensitivity_mean_square = estimate_.sensitivity_mean_square;
      conditions.sensitivity_degrees_of_freedom = estimate_.sensitivity_degrees_of_freedom;
    } else if (estimate_.sessions > 0) {
      calibration_.fit.conditions.blocks = estimate_.sessions;
      calibration_.fit.conditions.intermediate = true;
    } else if (experiment_.process) {
      estimate_.notes.push_back(
          {NoteCode::conditions,
           "earlier calibrations say nothing of a recording without blocks by method magnitude"});
    }
    if (kind_.by_length &&
        !fit_face_lengths(fitted_, calibration_.sensor.field.magnitude, estimate_)) {
      if (experiment_.method) {
        throw RefusedError(
            "method faces needs readings on all six faces, axes along them, and no terms beside "
            "bias and sensitivity; take the method known on a level table",
            {settings::method});
      }
      calibration_.fit.method = Method::known;
      note_choice_of_method(used(), Method::known, calibration_);
    }
    calibration_.sensor.response = std::move(estimate_.response);
    calibration_.fit.statistics = std::move(estimate_.statistics);
    put_temperature(estimate_, source_, std::move(trials_), calibration_);
    for (std::size_t a = 0; a < estimate_.also.size(); ++a) {
      const FieldDescription& also = source_.also()[a];
      calibration_.sensor.also.push_back({.kind = also.kind,
                                          .unit = also.unit,
                                          .in_table = *also.in_table,
                                          .sensitivity = estimate_.also[a],
                                          .sensitivity_se = estimate_.also[a]});
    }
    set_fitted(estimate_.field, calibration_.sensor.field);
    calibration_.sensor.field.in_table_covariance = estimate_.field_covariance;
    calibration_.sensor.field.in_table_degrees_of_freedom = estimate_.field_degrees_of_freedom;
    calibration_.fit.levelness = std::move(estimate_.levelness);
    std::vector<LackOfFit>& tests = calibration_.fit.statistics->lack_of_fit;
    if (std::none_of(tests.begin(), tests.end(),
                     [](const LackOfFit& test) { return test.pure_error_dof > 0.0; })) {
      tests.clear();
    }
    add_intervals(calibration_);
    calibration_.fit.uncertainty =
        make_budget(experiment_, fitted_, calibration_, estimate_.field, std::move(search.weighed));
    if (is_transfer) {
      forget_unseen(fitted_.seen, calibration_);
    }
  }

  // What the readings say that were kept out of the fit, and the field's size of those in it.
  void hold_against_others() {
    if (kept_out_.size() > 0) {
      if (kind_.by_magnitude || seen_.size() > 0 || fitted_.seen.cols() > 0 || experiment_.robust ||
          experiment_.level_by == LevelBy::block) {
        throw RefusedError(
            "readings to be confirmed (confirm) go with design points or known fields, axes that "
            "see them all, one levelness, and no robust regression");
      }
      note_unknown_blocks();
      calibration_.findings.confirmation = confirmed(judged_ ? *judged_ : fitted_, kept_out_,
                                                     estimate_.field, kind_.directions_known);
    }
    if (!kind_.by_length) {
      calibration_.fit.field_size =
          check_field_size(experiment_, *state_, method_, estimate_.field, calibration_);
    }
    state_.reset();
  }

  void look_at_residuals() {
    calibration_.fit.residuals = residuals_of(observations_, source_, estimate_.field,
                                              experiment_.positioner, calibration_, used_by_axes());
    if (kind_.by_magnitude && calibration_.sensor.instrument.axis_count() == 3) {
      calibration_.fit.orientations =
          orientation_quality(fields_of_readings(calibration_.sensor.response, weighed_readings()),
                              calibration_.sensor.field.magnitude);
    }
  }

  void remark() {
    add_notes(calibration_, observations_, experiment_.positioner);
    if (experiment_.compare_polar_fit) {
      compare_polar_fit(fitted_, estimate_.field, calibration_);
    }
    calibration_.findings.notes.insert(calibration_.findings.notes.end(), estimate_.notes.begin(),
                                       estimate_.notes.end());
    if (!mistakes_.remark.empty()) {
      calibration_.findings.notes.push_back({NoteCode::tails, mistakes_.remark});
    }
    estimate_.field_varies = field_varies_;
    calibration_.findings.warnings =
        find_warnings(calibration_, estimate_, unpaired_runs(), searched_, mistakes_.culprit);
    if (!field_varies_) {
      remark_on_magnitude(experiment_, calibration_);
    }
    say_what_length_means(experiment_, calibration_);
    warn_of_other_sensitivity(experiment_, calibration_);
    if (!looked_at_temperature_) {
      warn_of_ignored_temperature(experiment_, fitted_, estimate_.field, calibration_);
    }
  }

  // Refuses a record of biases if the field is impossible.
  void judge_magnitude() {
    remark_on_magnitude(experiment_, calibration_);
    const std::vector<CalibrationWarning>& warnings = calibration_.findings.warnings;
    const bool refused =
        std::any_of(warnings.begin(), warnings.end(), [](const CalibrationWarning& warning) {
          return warning.code == WarningCode::impossible_field;
        });
    calibration_.findings.status = refused            ? CalibrationStatus::refused
                                   : warnings.empty() ? CalibrationStatus::ok
                                                      : CalibrationStatus::warning;
  }

  void judge() {
    if (mistakes_.culprit) {
      calibration_.findings.suggestion = mistakes_.culprit->correction;
    }
    // What a mistake does to the coefficients, in parts of the full response.
    constexpr double largest_effect = 0.005;
    const std::vector<CalibrationWarning>& warnings = calibration_.findings.warnings;
    const bool refused =
        (mistakes_.culprit && mistakes_.culprit->effect > largest_effect) ||
        std::any_of(warnings.begin(), warnings.end(), [](const CalibrationWarning& warning) {
          return warning_kind(warning.code).refuses;
        });
    calibration_.findings.status = refused            ? CalibrationStatus::refused
                                   : warnings.empty() ? CalibrationStatus::ok
                                                      : CalibrationStatus::warning;
  }

 private:
  // The readings of the fit.
  [[nodiscard]] const Observations& used() const {
    return without_left_out_ ? *without_left_out_ : observations_;
  }

  // What must be so before the readings are looked at by axis and weight.
  static const Experiment& checked(const Experiment& experiment,
                                   const Observations& used,
                                   Method method) {
    check_temperature(experiment, used.readings, method);
    return experiment;
  }

  // The readings of the fit, without those that robust regression gives no weight.
  [[nodiscard]] Eigen::MatrixXd weighed_readings() const {
    const Eigen::MatrixXd& robust = calibration_.fit.statistics->robust_weight;
    if (robust.rows() != fitted_.response.rows()) {
      return fitted_.response;
    }
    std::vector<Eigen::Index> kept;
    for (Eigen::Index i = 0; i < robust.rows(); ++i) {
      if (robust.row(i).maxCoeff() > 0.0) {
        kept.push_back(i);
      }
    }
    return fitted_.response(kept, Eigen::all);
  }

  // With the effects of the run where the readings tell them from the coefficients.
  void fit_by_labels() {
    try {
      fit_once();
    } catch (const RefusedError&) {
      if (!source_.set_effects({})) {
        throw;
      }
      fit_once();
    }
    fit_mounts();
  }

  void look_for_culprit() {
    judged_ = without_shared_errors(experiment_, fitted_, method_, estimate_, fitted_);
    kept_out_ = source_.kept_out(fitted_);
    if (judged_ && kept_out_.size() > 0) {
      kept_out_ = *without_shared_errors(experiment_, fitted_, method_, estimate_, kept_out_);
    }
    mistakes_ = {};
    if (searched_) {
      mistakes_ =
          find_culprit(fitted_, estimate_, kind_.directions_known, judged_ ? &*judged_ : nullptr);
    }
  }

  // How the instrument sits in each mount, fitted beside all else by turns with it.
  void fit_mounts() {
    if (experiment_.robust || seen_.size() > 0 || fitted_.seen.cols() > 0 ||
        fitted_.temperature.order > 0) {
      return;
    }
    constexpr int most_rounds = 8;
    constexpr double still_rad = 1e-9;  // only the weights of the axes changed
    for (int round = 0; round < most_rounds; ++round) {
      const std::optional<MountTurns> mounts =
          fitted_mounts(fitted_, estimate_, kind_.directions_known);
      if (!mounts) {
        return;
      }
      double largest = 0.0;
      for (const auto& [mount, turn] : mounts->turns) {
        largest = std::max(largest, (turn - Eigen::Matrix3d::Identity()).norm());
      }
      source_.turn_mounts(mounts->turns);
      mounts_expected_ = mounts->expected;
      fit_once();
      if (largest < still_rad) {
        return;
      }
    }
  }

  void fit_once() {
    if (experiment_.instrument.one_sided) {
      estimate_ = estimate_one_sided(method_, source_, parts_, seen_);
      fitted_ = source_.set(parts_, seen_);
    } else {
      fitted_ = source_.set(parts_, {});
      estimate_ = estimate_by(method_, fitted_, by_field_);
    }
    complete_fitted();
  }

  // What the drift that was found came to; it is the last of the effects.
  [[nodiscard]] std::string note_of_drift() const {
    std::string changes;
    for (Eigen::Index k = 0; k < estimate_.effects.cols() && fitted_.effects.has_drift; ++k) {
      changes += formatted("{}{} {}", changes.empty() ? "" : ", ",
                           experiment_.instrument.axes[static_cast<std::size_t>(k)],
                           number_text(estimate_.effects(estimate_.effects.rows() - 1, k), 2));
    }
    return formatted(
        "the biases drift over the run, by {} {}; a linear drift is a term of the fit, "
        "and the biases are those of the middle of the run: let the instrument warm up",
        changes, experiment_.instrument.unit);
  }

  // What the estimate says of the readings that were fitted.
  void complete_fitted() {
    fitted_.seen = estimate_.seen;
    fitted_.visible = estimate_.visible;
    if (fitted_.temperature.order > 0) {
      fitted_.temperature.scale = estimate_.temperature_scale;
      fitted_.temperature.along = estimate_.response.sensitivity;
    }
    state_.emplace(fitted_, kind_.directions_known, std::move(estimate_.state));
  }

  void fit_without_labels() {
    source_.keep_complete_rows();
    fitted_ = source_.set(parts_, {});
    for (const Eigen::Matrix3d& change : fitted_.field_then) {
      constexpr double same = 1e-9;
      if (std::abs(std::cbrt(change.determinant()) - 1.0) > same) {
        throw RefusedError(
            "method magnitude takes the field's magnitude as the same in all readings, but this "
            "field changes its length while they are taken; give design points");
      }
    }
    const double F = calibration_.sensor.field.magnitude;
    const bool is_stated = experiment_.field.magnitude || experiment_.field.kind() == "custom";
    if (fitted_.axis_count() == 2 && !is_stated) {
      throw SetupError(
          "two axes that were turned in a plane meet the part of the field in it alone, and a site "
          "tells the whole: state the length in the plane as the field's magnitude",
          {settings::field_magnitude});
    }
    if (fitted_.axis_count() == 2) {
      estimate_ = estimate_ellipse(fitted_, F);
      estimate_.seen = Eigen::Matrix3d::Identity().leftCols(2);
    } else {
      estimate_ = estimate_sessions(fitted_, F, experiment_.shape, noise_of(observations_),
                                    experiment_.squares);
    }
    calibration_.fit.shape = experiment_.shape;
    if (!fitted_.rotation_sensor_from_table.empty()) {
      align_by_points(fitted_, F, estimate_);
    }
    complete_fitted();
  }

  // Which readings of the file each axis used.
  [[nodiscard]] AxisMask used_by_axes() const {
    AxisMask used = AxisMask::Constant(observations_.size(), observations_.response.cols(), false);
    for (std::size_t i = 0; i < source_.rows().size(); ++i) {
      const auto row = static_cast<Eigen::Index>(source_.rows()[i]);
      used.row(row) = source_.in_range().row(row);
      if (seen_.size() > 0) {
        used.row(row) = used.row(row) && seen_.row(static_cast<Eigen::Index>(i));
      }
    }
    for (const std::size_t i : estimate_.unpaired) {
      used.row(static_cast<Eigen::Index>(source_.rows()[i])).setConstant(false);
    }
    return used;
  }

  [[nodiscard]] std::vector<int> unpaired_runs() const {
    std::vector<int> runs;
    for (const std::size_t i : estimate_.unpaired) {
      runs.push_back(observations_.readings[source_.rows()[i]].run);
    }
    return runs;
  }

  const Experiment& experiment_;
  const Observations& observations_;
  bool remarks_;
  std::optional<Observations> without_left_out_;  // where some are
  Method method_;
  const MethodKind& kind_;
  Weighting weighting_;
  bool by_field_;              // true if the readings bring their fields
  bool field_varies_ = false;  // these are of different lengths, as on a rate table
  ReadingSource source_;
  std::vector<FieldDescription> parts_;
  std::vector<TemperatureOrderTrial> trials_;
  AxisMask seen_;  // which readings one-sided axes saw
  Estimate estimate_;
  ReadingSet fitted_;
  std::optional<StateOfRun> state_;   // about what was fitted, while it is looked at
  std::optional<ReadingSet> judged_;  // without the errors that readings share, if there are any
  ReadingSet kept_out_;               // the readings to be confirmed, likewise
  double mounts_expected_ = 0.0;      // as of MountStep
  bool searched_ = false;
  bool looked_at_temperature_ = false;  // and found no need of its terms
  MistakeSearch mistakes_;
  Calibration calibration_;
};

// The record of a run whose method and terms are chosen.
Calibration finished(RunFit& run) {
  run.fit();
  run.search_for_mistakes();
  run.take_over();
  if (run.remarks()) {
    run.hold_against_others();
    run.look_at_residuals();
    run.remark();
    run.judge();
  }
  return run.result();
}

Calibration calibrated_once(const Experiment& experiment,
                            const Observations& given,
                            RecordPart part) {
  const bool by_attitudes = takes_attitudes(experiment, given);
  const Observations with_fields =
      by_attitudes ? with_fields_of_attitudes(experiment, given) : Observations();
  const Observations& observations = by_attitudes ? with_fields : given;
  check_run(experiment, observations);
  const bool looks_at_temperature = has_temperatures_enough(experiment, observations);
  if (looks_at_temperature) {
    Experiment with = experiment;
    with.temperature.automatic = true;
    RunFit run(with, observations, part);
    run.describe();
    run.choose_temperature_order();
    if (run.needs_temperature_terms()) {
      return finished(run);
    }
  }
  RunFit run(experiment, observations, part);
  run.describe();
  if (!method_kind(run.method()).fits_sensitivity) {
    if (std::any_of(observations.readings.begin(), observations.readings.end(),
                    [](const Reading& reading) { return reading.confirm; })) {
      throw RefusedError("method bias predicts no readings to be confirmed (confirm)");
    }
    run.fit_biases();
    run.judge_magnitude();
    return run.result();
  }
  run.choose_temperature_order();
  if (looks_at_temperature) {
    run.take_as_looked_at();
  }
  return finished(run);
}

// Says whether robust regression would mend a refusal, and which readings it gives no weight.
void say_what_robust_would(const Experiment& experiment,
                           const Observations& given,
                           Calibration& refused) {
  const Method method = *refused.fit.method;
  if (experiment.robust || experiment.squares || !method_kind(method).fits_sensitivity) {
    return;
  }
  Experiment robust = experiment;
  robust.robust = true;
  robust.search_for_mistakes = false;
  robust.method = method_kind(method).averages_pairs ? Method::joint : method;
  try {
    const Calibration found = calibrated_once(robust, given, RecordPart::all);
    const Eigen::MatrixXd& weights = found.fit.statistics->robust_weight;
    std::vector<int> runs;
    for (Eigen::Index i = 0; i < weights.rows(); ++i) {
      if (weights.row(i).minCoeff() == 0.0) {
        const std::vector<int>& own = found.fit.statistics->rows[static_cast<std::size_t>(i)].runs;
        runs.insert(runs.end(), own.begin(), own.end());
      }
    }
    constexpr std::size_t few = 5;
    if (found.findings.status != CalibrationStatus::refused && !runs.empty() &&
        runs.size() <= few) {
      refused.findings.notes.push_back(
          {NoteCode::weights,
           formatted("robust regression gives {} no weight and fits the other readings",
                     name_of_runs(runs))});
    }
  } catch (const Error&) {  // it would not mend it
    return;
  }
}

Calibration calibrated(const Experiment& experiment, const Observations& given, RecordPart part) {
  Calibration calibration = calibrated_once(experiment, given, part);
  if (part == RecordPart::all && calibration.findings.status == CalibrationStatus::refused) {
    say_what_robust_would(experiment, given, calibration);
  }
  return calibration;
}

}  // namespace

Calibration calibrate(const Experiment& experiment, const Observations& observations) {
  return calibrated(experiment, observations, RecordPart::all);
}

Calibration calibrated_coefficients(const Experiment& experiment,
                                    const Observations& observations) {
  return calibrated(experiment, observations, RecordPart::coefficients);
}

Calibration calibrate(const Experiment& experiment,
                      std::span<const DesignPoint> points,
                      const Eigen::Ref<const Eigen::MatrixXd>& response) {
  return calibrate(experiment, make_run(points, response).observations);
}

Calibration calibrate(const Run& run, Instrument instrument, FieldSetup field, Force force) {
  Experiment experiment;
  experiment.instrument = std::move(instrument);
  experiment.field = std::move(field);
  const bool any_axes = experiment.instrument.axes == Instrument().axes;
  if (any_axes && !run.axes.empty()) {
    experiment.instrument.axes = run.axes;
  }
  if (!run.slots.empty() || has_several_units(run)) {
    throw SetupError(
        "the run is of several instruments: calibrate_run() and split_by_serial() take it apart");
  }
  Calibration calibration = calibrate_run(std::move(experiment), run).front();
  require_unrefused(calibration, force);
  return calibration;
}

}  // namespace axiscal
