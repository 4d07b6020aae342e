// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/calibration_json.hpp"

#include <limits>

#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/instruments/polar_form.hpp"
#include "calib/record/src/setup_members.hpp"
#include "calib/record/src/statistics_members.hpp"
#include "core/json_members.hpp"
#include "field/field_json.hpp"

namespace axiscal {
namespace {

// Each function members() reads or writes the members of a struct, in the order of the file. A
// member that can be computed from other members is written but not read.

void members(JsonMembers& io, OrientationQuality& quality) {
  io.number("fit_error", quality.fit_error);
  io.number("magnitude_spread", quality.magnitude_spread);
  io.number("coverage", quality.coverage);
  io.number("largest_gap_rad", quality.largest_gap_rad);
  if (io.has("gap", true)) {
    io.need_vector("gap", quality.gap, 3);
  }
}

void members(JsonMembers& io, CompanionAlignment& companion) {
  Alignment& alignment = companion.alignment;
  io.value("record", companion.record);
  io.need_matrix("rotation_companion_from_sensor", alignment.rotation_companion_from_sensor, 3, 3);
  io.vector("standard_error_rad", alignment.standard_error_rad, 3);
  io.number("angle_rad", alignment.angle_rad);
  io.number("angle_standard_error_rad", alignment.angle_se_rad);
  io.number("residual_sd", alignment.residual_sd);
}

// Reads or writes the texts of the notes, and a list with the code of each note. Files of earlier
// versions lack the codes.
void notes_members(JsonMembers& io, std::vector<CalibrationNote>& notes) {
  std::vector<std::string> messages;
  std::vector<std::string> codes;
  for (const CalibrationNote& note : notes) {
    messages.push_back(note.message);
    codes.emplace_back(note_name(note.code));
  }
  io.value("notes", messages);
  io.value_if_any("note_codes", codes);
  if (!io.reads()) {
    return;
  }
  notes.clear();
  for (std::size_t i = 0; i < messages.size(); ++i) {
    const auto code = i < codes.size() ? parse_note_code(codes[i]) : std::nullopt;
    notes.push_back({code.value_or(NoteCode::other), std::move(messages[i])});
  }
}

// Writes the coefficients as the quantities that are usual for this kind of instrument.
void put_quantities(JsonMembers& io, const Calibration& calibration) {
  std::vector<KindQuantity> quantities = quantities_of(calibration);
  io.list_if_any("quantities", quantities, [](JsonMembers& one, KindQuantity& quantity) {
    one.put("name", quantity.name);
    one.value_if_any("of", quantity.of);
    one.put("values", quantity.values);
    one.put("standard_uncertainty", quantity.u);
    one.put("unit", quantity.unit);
  });
}

// Writes the polar form of each axis. It follows from the sensitivities and is not read.
void put_polar_form(JsonMembers& io, const Instrument& instrument, const LinearResponse& response) {
  std::vector<std::string> axes = instrument.axes;
  io.list("polar", axes, [&](JsonMembers& one, std::string& name) {
    const Eigen::Index k = &name - axes.data();
    const int axis = main_axis(instrument, response, k);
    const PolarForm form = polar_from_sensitivity(response.sensitivity.row(k).transpose(), axis,
                                                  instrument.convention);
    one.put("axis", name);
    one.put("nominal", std::string(1, "xyz"[axis]));
    one.put("bias", response.bias(k));
    one.put("sensitivity", form.sensitivity);
    one.put("coning_angle_rad", form.coning_angle_rad);
    one.put("azimuth_rad", form.azimuth_rad);
  });
}

void members(JsonMembers& io, TemperatureOrderTrial& trial) {
  io.need("order", trial.order);
  io.number("aicc", trial.aicc);
  io.number("lack_of_fit_p_value", trial.lack_of_fit_p_value);
}

// Reads or writes the reference temperature and the temperature range. They are single values for
// all axes, or lists with an entry for each axis.
void span_members(JsonMembers& io, std::vector<TemperatureSpan>& spans, Eigen::Index m) {
  const bool own = io.reads() ? io.from().at("reference").is_array() : spans.size() > 1;
  if (!own) {
    io.need("reference", spans.front().reference);
    io.need_pair("range", spans.front().low, spans.front().high);
    return;
  }
  if (io.reads()) {
    spans.resize(static_cast<std::size_t>(m));
  }
  Eigen::VectorXd reference(m);
  Eigen::MatrixXd range(m, 2);
  for (Eigen::Index k = 0; k < m; ++k) {
    const TemperatureSpan& span = spans[static_cast<std::size_t>(k)];
    reference(k) = span.reference;
    range.row(k) << span.low, span.high;
  }
  io.need_vector("reference", reference, m);
  io.need_matrix("range", range, m, 2);
  for (Eigen::Index k = 0; k < m; ++k) {
    io.keep(spans[static_cast<std::size_t>(k)],
            TemperatureSpan{.reference = reference(k), .low = range(k, 0), .high = range(k, 1)});
  }
}

void temperature_member(JsonMembers& io, std::optional<SensorTemperature>& temperature) {
  if (!io.reads()) {
    if (temperature) {
      io.put("temperature",
             temperature->has_own() ? Json(temperature->of_axes()) : Json(temperature->mean()));
    }
  } else if (const auto found = io.from().find("temperature")) {
    if (!found->is_array()) {
      temperature = found->number();
      return;
    }
    const Eigen::VectorXd all = found->vector(static_cast<Eigen::Index>(found->elements().size()));
    temperature = SensorTemperature(std::vector<double>(all.begin(), all.end()));
  }
}

void members(JsonMembers& io, TemperatureResponse& temperature, Eigen::Index m) {
  span_members(io, temperature.spans, m);
  Eigen::Index order = temperature.bias.cols();
  if (io.reads()) {
    const std::vector<JsonValue> rows = io.from().at("bias").elements();
    order = rows.empty() ? 0 : static_cast<Eigen::Index>(rows.front().elements().size());
    temperature.bias_se.setConstant(m, order, not_a_number);
    temperature.scale_se = temperature.bias_se;
  }
  io.need_matrix("bias", temperature.bias, m, order);
  io.need_matrix("scale", temperature.scale, m, order);
  const bool has_errors = temperature.bias_se.rows() == temperature.bias.rows();
  io.object("standard_error", has_errors, [&](JsonMembers& errors) {
    errors.matrix("bias", temperature.bias_se, m, order);
    errors.matrix("scale", temperature.scale_se, m, order);
  });
  io.list_if_any("orders", temperature.trials,
                 [](JsonMembers& one, TemperatureOrderTrial& trial) { members(one, trial); });
}

void members(JsonMembers& io, UncertaintySource& source, Eigen::Index parameters) {
  io.need("name", source.name);
  io.need("type", source.type);
  io.value("distribution", source.distribution);
  io.number("input_u", source.input_u);
  io.value_if_any("input_unit", source.input_unit);
  const bool from_scatter = source.type == "A";
  // JSON writes both infinity and NaN as null, so `type` decides between them.
  io.number("degrees_of_freedom", source.degrees_of_freedom);
  if (io.reads()) {
    source.degrees_of_freedom =
        from_scatter ? not_a_number : std::numeric_limits<double>::infinity();
  }
  if (!from_scatter) {  // the covariance of the fit is in the statistics
    io.need_matrix("covariance", source.covariance, parameters, parameters);
  }
}

void budget_members(JsonMembers& io, Calibration& calibration) {
  UncertaintyBudget& budget = *calibration.fit.uncertainty;
  const Eigen::Index parameters = calibration.fit.statistics->covariance.rows();
  if (io.reads()) {
    static_cast<void>(io.from().at("sources"));
  }
  io.list("sources", budget.sources, [parameters](JsonMembers& one, UncertaintySource& source) {
    members(one, source, parameters);
  });
  io.value_if_any("resolution", budget.resolution);
  io.value_if_any("temperature_u", budget.temperature_u);
  if (io.reads()) {
    return;
  }
  std::vector<ParameterUncertainty> all = parameter_uncertainties(calibration);
  io.list("parameters", all, [](JsonMembers& one, ParameterUncertainty& parameter) {
    const CombinedUncertainty& uncertainty = parameter.uncertainty;
    one.put("parameter", parameter.name);
    one.put("value", parameter.value);
    one.put("u", uncertainty.u);
    one.put("degrees_of_freedom", uncertainty.degrees_of_freedom);
    one.put("coverage_factor_95", uncertainty.coverage_factor);
    one.put("expanded_95", uncertainty.expanded);
  });
}

// @param with_values  true: x and y are written too.
void members(JsonMembers& io, LevelnessEstimate& estimate, bool with_values) {
  std::optional<DesignPoint> point = estimate.point;
  if (io.reads()) {
    point.reset();
  }
  point_members(io, point);
  if (!point) {
    io.from().fail("'rest' and 'fence' are required");
  }
  io.keep(estimate.point, *point);
  io.value("block", estimate.block);
  if (with_values || io.reads()) {
    io.number("x", estimate.x);
    io.number("y", estimate.y);
  }
}

void members(JsonMembers& io, BlockLevelness& block) {
  io.need("block", block.block);
  io.number("x", block.x);
  io.number("y", block.y);
  io.xy("standard_error", block.standard_error_x, block.standard_error_y);
}

void members(JsonMembers& io, CombinedLevelness& combined) {
  io.need("slots", combined.slots);
  io.number("x", combined.x);
  io.number("y", combined.y);
  io.xy("standard_error", combined.standard_error_x, combined.standard_error_y);
  io.need("consistent", combined.consistent);
  io.number("p_value", combined.p_value);
  io.value("suspect", combined.suspect);
}

void members(JsonMembers& io, Levelness& levelness) {
  const LevelnessEstimate unread{.point = DesignPoint(Face::minus_z, Face::minus_x)};
  io.list(
      "estimates", levelness.estimates,
      [](JsonMembers& one, LevelnessEstimate& estimate) { members(one, estimate, true); }, unread);
  io.xy("mean", levelness.mean_x, levelness.mean_y);
  io.xy("sd", levelness.sd_x, levelness.sd_y);
  io.xy("standard_error", levelness.standard_error_x, levelness.standard_error_y);
  io.number("degrees_of_freedom", levelness.degrees_of_freedom);
  io.value("consistent", levelness.consistent);
  io.number("p_value", levelness.p_value);
  io.number("block_p_value", levelness.block_p_value);
  io.object_if_any(
      "suspect", levelness.suspect,
      [](JsonMembers& one, LevelnessEstimate& suspect) { members(one, suspect, false); }, unread);
  io.list_if_any("blocks", levelness.blocks,
                 [](JsonMembers& one, BlockLevelness& block) { members(one, block); });
  io.object_if_any("combined", levelness.combined,
                   [](JsonMembers& one, CombinedLevelness& combined) { members(one, combined); });
}

void members(JsonMembers& io, ReadingResidual& residual, Eigen::Index m) {
  io.value("run", residual.run);
  point_members(io, residual.point);
  if (!io.reads() && residual.level) {
    io.put("level", level_json(*residual.level));
  } else if (const auto level = io.reads() ? io.from().find("level") : std::nullopt) {
    residual.level = level_of(*level);
  }
  io.value_if_any("block", residual.block);
  temperature_member(io, residual.temperature);
  io.vector("response", residual.response, m);
  io.number("magnitude", residual.magnitude);
  io.flag_unless("used", residual.used, true);
}

void members(JsonMembers& io, LimitVerdict& limit) {
  io.value("parameter", limit.parameter);
  io.number("value", limit.value);
  io.number("u", limit.u);
  io.value_if_any("low", limit.low);
  io.value_if_any("high", limit.high);
  io.number("guard_band", limit.guard_band);
  io.need("passed", limit.passed);
  io.number("conformity", limit.conformity);
  io.value_if_any("note", limit.note);
}

void members(JsonMembers& io, Verdict& verdict) {
  io.need("passed", verdict.passed);
  io.value("rule", verdict.rule);
  io.list("limits", verdict.limits,
          [](JsonMembers& one, LimitVerdict& limit) { members(one, limit); });
  io.value_if_any("not_counted", verdict.not_counted);
}

// Returns the code of a warning's name. An unknown name, which a later version may have written,
// gives `other`, so the result is never nullopt.
std::optional<WarningCode> parse_warning(std::string_view name) {
  return warning_code_of(name);
}

// Reads or writes a correction that was made. The file does not contain the corrected points,
// values or levels.
void members(JsonMembers& io, Correction& correction) {
  io.choice("code", correction.code, warning_name, parse_warning);
  io.need("runs", correction.runs);
  io.value("message", correction.message);
}

// Reads or writes a suggested correction, with its corrected design points, corrected values and
// readings to leave out.
void suggestion_members(JsonMembers& io, Correction& correction, Eigen::Index m) {
  members(io, correction);
  io.list_if_any(
      "points", correction.points,
      [](JsonMembers& one, std::pair<int, DesignPoint>& taken) {
        one.value("run", taken.first);
        std::optional<DesignPoint> point = taken.second;
        point_members(one, point);
        one.keep(taken.second, point.value_or(taken.second));
      },
      std::pair(0, DesignPoint(Face::minus_z, Face::minus_x)));
  io.list_if_any("responses", correction.responses,
                 [m](JsonMembers& one, std::pair<int, Eigen::VectorXd>& said) {
                   one.value("run", said.first);
                   one.vector("response", said.second, m);
                 });
  io.value_if_any("leave_out", correction.leave_out);
}

// Reads or writes a warning. A warning about one reading has the key `run`; a warning about several
// readings has the key `runs`.
void members(JsonMembers& io, CalibrationWarning& warning) {
  io.choice("code", warning.code, warning_name, parse_warning);
  std::optional<int> run =
      warning.runs.size() == 1 ? std::optional<int>(warning.runs.front()) : std::nullopt;
  io.value_if_any("run", run);
  if (run) {
    io.keep(warning.runs, std::vector{*run});
  } else {
    io.value_if_any("runs", warning.runs);
  }
  io.value("message", warning.message);
}

void members(JsonMembers& io, PolarFit& fit) {
  io.need("bias", fit.bias);
  io.need("sensitivity", fit.form.sensitivity);
  io.need("coning_angle_rad", fit.form.coning_angle_rad);
  io.need("azimuth_rad", fit.form.azimuth_rad);
  io.number("residual_sd", fit.residual_sd);
  io.need("rounds", fit.rounds);
  io.need("converged", fit.converged);
}

// Reads or writes a flag. The file contains `word` if the flag is true, and lacks the key
// otherwise.
void word_members(JsonMembers& io, const char* key, bool& flag, const char* word) {
  std::string text = flag ? word : "";
  io.value_if_any(key, text);
  io.keep(flag, text == word);
}

void coefficient_members(JsonMembers& io, Calibration& calibration) {
  const Eigen::Index m = calibration.sensor.instrument.axis_count();
  io.need_vector("bias", calibration.sensor.response.bias, m);
  io.need_matrix("sensitivity", calibration.sensor.response.sensitivity, m, 3);
  if (!io.reads()) {
    put_polar_form(io, calibration.sensor.instrument, calibration.sensor.response);
  }
  io.object_if_any(
      "temperature", calibration.sensor.temperature,
      [m](JsonMembers& one, TemperatureResponse& temperature) { members(one, temperature, m); });
  io.object("also", !calibration.sensor.also.empty(),
            [&](JsonMembers& one) { also_members(one, calibration.sensor.also, m); });
}

void members(JsonMembers& io, CalibrationConditions& conditions, Eigen::Index m) {
  io.value("blocks", conditions.blocks);
  io.value("mounts", conditions.mounts);
  std::string kind = conditions.intermediate ? "intermediate" : "repeatability";
  io.value("kind", kind);
  io.keep(conditions.intermediate, kind == "intermediate");
  if (io.has("earlier", conditions.earlier > 0)) {
    io.need("earlier", conditions.earlier);
  }
  if (io.has("block_mean_square", conditions.block_mean_square.size() > 0)) {
    io.vector("block_mean_square", conditions.block_mean_square, m);
    io.need("block_degrees_of_freedom", conditions.block_degrees_of_freedom);
  }
  if (io.has("sensitivity_mean_square", conditions.sensitivity_mean_square.size() > 0)) {
    io.matrix("sensitivity_mean_square", conditions.sensitivity_mean_square, m, 3);
    io.need("sensitivity_degrees_of_freedom", conditions.sensitivity_degrees_of_freedom);
  }
}

// Reads or writes the coefficients, the fit and its quality.
void result_members(JsonMembers& io, Calibration& calibration) {
  const Eigen::Index m = calibration.sensor.instrument.axis_count();
  io.need_object("coefficients", [&](JsonMembers& one) { coefficient_members(one, calibration); });
  std::size_t axis = 0;
  io.list_if_any("polar_fit", calibration.fit.polar_fit, [&](JsonMembers& one, PolarFit& fit) {
    if (!one.reads()) {
      one.put("axis", calibration.sensor.instrument.axes[axis++]);
    }
    members(one, fit);
  });
  if (!io.reads()) {
    put_quantities(io, calibration);
  }
  io.object_if_any("statistics", calibration.fit.statistics,
                   [m](JsonMembers& one, FitStatistics& fit) { members(one, fit, m); });
  if (calibration.fit.statistics) {
    if (io.has("uncertainty", false)) {
      calibration.fit.uncertainty.emplace();
    }
    io.object("uncertainty", calibration.fit.uncertainty.has_value(),
              [&](JsonMembers& one) { budget_members(one, calibration); });
  }
  io.object("conditions", calibration.fit.statistics.has_value(), [&](JsonMembers& one) {
    members(one, calibration.fit.conditions, calibration.sensor.response.bias.size());
  });
  io.object_if_any("orientations", calibration.fit.orientations,
                   [](JsonMembers& one, OrientationQuality& quality) { members(one, quality); });
}

void members(JsonMembers& io, SlotAlignment& alignment) {
  io.need("slot", alignment.slot);
  io.need_matrix("rotation_other_from_sensor", alignment.rotation_other_from_sensor, 3, 3);
  io.vector("u_rad", alignment.u_rad, 3);
  io.vector("expanded_95_rad", alignment.expanded_rad, 3);
}

void members(JsonMembers& io, FieldSizeCheck& check) {
  io.need("orientations", check.orientations);
  io.number("relative_sd", check.relative_sd);
  io.number("by_noise", check.by_noise);
  io.number("by_inputs", check.by_inputs);
  io.number("degrees_of_freedom", check.degrees_of_freedom);
  io.number("p_value", check.p_value);
}

// Reads or writes the result of testing the fit with readings that were not fitted. The member
// `readings` is the number of these readings, and `details` contains the result of each reading.
void members(JsonMembers& io, Confirmation& confirmation, Eigen::Index m) {
  if (!io.reads()) {
    io.put("readings", confirmation.readings.size());
  }
  io.number("p_value", confirmation.p_value);
  io.need("passed", confirmation.passed);
  io.list("details", confirmation.readings, [m](JsonMembers& one, ConfirmationReading& reading) {
    one.need("run", reading.run);
    one.vector("error", reading.error, m);
    one.vector("half_width_95", reading.half_width, m);
    one.need("within", reading.within);
  });
}

void mount_member(JsonMembers& io, std::optional<Eigen::Matrix3d>& mount) {
  constexpr const char* key = "rotation_sensor_from_assembly";
  if (io.has(key, mount.has_value())) {
    Eigen::Matrix3d rotation = mount.value_or(Eigen::Matrix3d::Identity());
    io.need_matrix(key, rotation, 3, 3);
    io.check(key, is_rotation(rotation), "must be a rotation");
    io.keep(mount, rotation);
  }
}

void turn_members(JsonMembers& io, std::vector<Eigen::Vector3d>& errors) {
  if (!io.reads()) {
    Json rows = Json::array();
    for (const Eigen::Vector3d& error : errors) {
      rows.push_back(json_from(error));
    }
    if (!rows.empty()) {
      io.put("turn_errors_rad", rows);
    }
  } else if (const auto turns = io.from().find("turn_errors_rad")) {
    for (const JsonValue& turn : turns->elements()) {
      errors.emplace_back(turn.vector(3));
    }
  }
}

// Reads or writes the experiment as a member of the record. The record keeps it as JSON text, and
// its members are not interpreted here.
void experiment_member(JsonMembers& io, std::string& experiment) {
  if (!io.reads()) {
    if (!experiment.empty()) {
      io.put("experiment", Json::parse(experiment));
    }
  } else if (const auto found = io.from().find("experiment")) {
    experiment = found->dump();
  }
}

void members(JsonMembers& io, Calibration& calibration) {
  io.value("created", calibration.provenance.created);
  io.value_if_any("measured", calibration.provenance.measured);
  io.value_if_any("operator", calibration.provenance.operated_by);
  io.value("software", calibration.provenance.software);
  io.choice("status", calibration.findings.status, status_name, parse_status);
  io.list("inputs", calibration.provenance.inputs, [](JsonMembers& one, InputFileDigest& input) {
    one.value("path", input.path);
    one.value("sha256", input.sha256);
    one.flag_unless("log", input.is_log, false);
  });
  experiment_member(io, calibration.provenance.experiment);
  io.need_object("instrument",
                 [&](JsonMembers& one) { members(one, calibration.sensor.instrument); });
  io.need_object("field", [&](JsonMembers& one) { members(one, calibration.sensor.field); });
  io.choice("method", calibration.fit.method, method_name, parse_method);
  io.choice_if_any("shape", calibration.fit.shape, shape_name, parse_shape);
  io.choice("weights", calibration.fit.weights, weighting_name, parse_weighting);
  word_members(io, "robust", calibration.fit.robust, "bisquare");
  io.value_if_any("positioner", calibration.provenance.positioner);
  io.value_if_any("slot", calibration.provenance.slot);
  mount_member(io, calibration.sensor.rotation_sensor_from_assembly);
  io.value_if_any("instance", calibration.provenance.instance);
  io.value_if_any("device", calibration.provenance.device);
  word_members(io, "level_by", calibration.fit.level_by_block, "block");
  io.value_if_any("leave_out", calibration.fit.left_out);
  result_members(io, calibration);
  turn_members(io, calibration.fit.turn_errors_rad);
  io.object_if_any(
      "alignment", calibration.fit.alignment,
      [](JsonMembers& one, CompanionAlignment& companion) { members(one, companion); });
  io.list_if_any("slot_alignments", calibration.fit.slot_alignments,
                 [](JsonMembers& one, SlotAlignment& alignment) { members(one, alignment); });
  io.object_if_any("field_size", calibration.fit.field_size,
                   [](JsonMembers& one, FieldSizeCheck& check) { members(one, check); });
  io.object_if_any("levelness", calibration.fit.levelness,
                   [](JsonMembers& one, Levelness& levelness) { members(one, levelness); });
  io.object_if_any("verdict", calibration.findings.verdict,
                   [](JsonMembers& one, Verdict& verdict) { members(one, verdict); });
  io.list_if_any("corrections", calibration.findings.corrections,
                 [](JsonMembers& one, Correction& correction) { members(one, correction); });
  const Eigen::Index m = calibration.sensor.instrument.axis_count();
  io.object_if_any(
      "suggestion", calibration.findings.suggestion,
      [m](JsonMembers& one, Correction& suggestion) { suggestion_members(one, suggestion, m); });
  io.object_if_any(
      "confirmation", calibration.findings.confirmation,
      [m](JsonMembers& one, Confirmation& confirmation) { members(one, confirmation, m); });
  io.table("residuals", calibration.fit.residuals,
           [m](JsonMembers& one, ReadingResidual& residual) { members(one, residual, m); });
  io.list("warnings", calibration.findings.warnings,
          [](JsonMembers& one, CalibrationWarning& warning) { members(one, warning); });
  notes_members(io, calibration.findings.notes);
}

}  // namespace

std::string verdict_json(const Verdict& verdict) {
  JsonWriter writer;
  writer.begin_object();
  JsonMembers io(writer);
  Verdict written = verdict;
  members(io, written);
  writer.end_object();
  return writer.finish();
}

namespace {

Calibration calibration_from(const JsonValue& json) {
  json.require_format("axiscal-calibration", 2);
  Calibration calibration;
  JsonMembers io(json);
  members(io, calibration);
  return calibration;
}

// @throws DomainError  if the record could not be read again.
std::string write_with(JsonWriter& writer, const Calibration& calibration) {
  // Format version 1 cannot contain a temperature sensor for each axis.
  const bool newer =
      calibration.sensor.temperature && calibration.sensor.temperature->has_own_sensors();
  writer.begin_object();
  JsonMembers io(writer);
  io.put("format", "axiscal-calibration");
  io.put("version", newer ? 2 : 1);
  // members() also reads, so its parameter is not const. Writing does not change the calibration.
  members(io,
          const_cast<Calibration&>(calibration));  // NOLINT(cppcoreguidelines-pro-type-const-cast)
  writer.end_object();
  if (!writer.problem().empty()) {
    throw DomainError("the record cannot be written, because it could not be read again: " +
                      writer.problem());
  }
  return writer.finish();
}

}  // namespace

std::string calibration_json(const Calibration& calibration, JsonLayout layout) {
  JsonWriter writer(layout);
  return write_with(writer, calibration);
}

Calibration parse_calibration(std::string_view text, const std::string& path) {
  return calibration_from(parse_json(text, path));
}

void write(const Calibration& calibration, const std::string& path, Force force) {
  require_unrefused(calibration, force);
  OutputFile file(path);
  if (file.is_direct()) {
    file.write(calibration_json(calibration));
  } else {
    JsonWriter writer(JsonLayout::lines, [&](std::string_view text) { file.write(text); });
    static_cast<void>(write_with(writer, calibration));
  }
  file.commit();
}

Calibration read_calibration(const std::string& path) {
  const std::string text = read_whole_file(path);
  const std::size_t first = text.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = std::string_view(text).substr(0, end);
  // If the first line has several cells and does not begin like JSON, the file is a table.
  if (first != std::string::npos && text[first] != '{' && text[first] != '[' &&
      line.find_first_of(",;\t") != std::string_view::npos &&
      line.find('\0') == std::string_view::npos) {
    throw DataError(path,
                    "this file is a table, not a calibration record (JSON); give the record first, "
                    "then the readings");
  }
  return parse_calibration(text, path);
}

}  // namespace axiscal
