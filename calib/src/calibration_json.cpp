// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/calibration_json.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/json_document.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "axiscal/instruments/polar_form.hpp"

namespace axiscal {
namespace {

// ---- writing ----

void put_point(Json& to, const std::optional<DesignPoint>& point) {
  if (point) {
    to["rest"] = face_name(point->rest());
    to["fence"] = face_name(point->fence());
  }
}

Json json_xy(double x, double y) {
  return {{"x", x}, {"y", y}};
}

Json json_of(const Instrument& instrument) {
  Json json = {{"kind", instrument.kind},
               {"serial", instrument.serial},
               {"axes", instrument.axes},
               {"unit", instrument.unit}};
  if (instrument.convention == AxisConvention::forward_right_down) {
    json["convention"] = "frd";
  }
  for (const DifferentialAxis& difference : instrument.differences) {
    json["differences"][difference.axis] = {difference.plus, difference.minus};
  }
  if (instrument.range) {
    json["range"] = {instrument.range->low, instrument.range->high};
  }
  if (instrument.one_sided) {
    json["one_sided"] = true;
  }
  return json;
}

Json json_of(const FieldDescription& field) {
  Json json = {{"kind", field.kind}, {"unit", field.unit}, {"magnitude", field.magnitude}};
  json["in_table"] = field.in_table ? json_from(*field.in_table) : Json();
  if (field.in_table_covariance) {
    json["in_table_covariance"] = json_from_matrix(*field.in_table_covariance);
    json["in_table_degrees_of_freedom"] = field.in_table_degrees_of_freedom;
  }
  if (field.magnitude_u > 0.0) {
    json["magnitude_u"] = field.magnitude_u;
  }
  if (!field.model.empty()) {
    json["model"] = field.model;
  }
  if (field.local_gravity) {
    json["local_gravity_m_s2"] = *field.local_gravity;
  }
  for (const FieldPartDescription& part : field.parts) {
    json["parts"].push_back({{"kind", part.kind},
                             {"magnitude", part.magnitude},
                             {"in_table", json_from(part.in_table)},
                             {"set_by_level", part.set_by_level},
                             {"turning", part.turning}});
  }
  if (field.site) {
    json["site"] = {{"latitude_deg", field.site->latitude_deg},
                    {"longitude_deg", field.site->longitude_deg},
                    {"height_m", field.site->height_m}};
  }
  if (!field.date.empty()) {
    json["date"] = field.date;
  }
  return json;
}

Json json_of(const std::vector<AlsoResponse>& all) {
  Json json = Json::object();
  for (const AlsoResponse& also : all) {
    json[also.kind] = {{"unit", also.unit},
                       {"in_table", json_from(also.in_table)},
                       {"sensitivity", json_from_matrix(also.sensitivity)},
                       {"standard_error", json_from_matrix(also.sensitivity_se)}};
  }
  return json;
}

Json json_of(const OrientationQuality& quality) {
  return {{"fit_error", quality.fit_error},
          {"magnitude_spread", quality.magnitude_spread},
          {"coverage", quality.coverage},
          {"largest_gap_rad", quality.largest_gap_rad},
          {"gap", json_from(quality.gap)}};
}

Json json_of(const CompanionAlignment& companion) {
  const Alignment& alignment = companion.alignment;
  return {{"record", companion.record},
          {"rotation_companion_from_sensor",
           json_from_matrix(alignment.rotation_companion_from_sensor)},
          {"standard_error_rad", json_from(alignment.standard_error_rad)},
          {"angle_rad", alignment.angle_rad},
          {"angle_standard_error_rad", alignment.angle_se_rad},
          {"residual_sd", alignment.residual_sd}};
}

// What users of this kind of instrument call it.
Json quantities_json(const Calibration& calibration) {
  Json list = Json::array();
  for (const Quantity& quantity : quantities_of(calibration)) {
    Json json = {{"name", quantity.name}};
    if (!quantity.of.empty()) {
      json["of"] = quantity.of;
    }
    json["values"] = quantity.values;
    json["standard_uncertainty"] = json_from(Eigen::Map<const Eigen::VectorXd>(
        quantity.u.data(), static_cast<Eigen::Index>(quantity.u.size())));
    json["unit"] = quantity.unit;
    list.push_back(std::move(json));
  }
  return list;
}

Json json_of(const Instrument& instrument, const LinearResponse& response) {
  Json polar = Json::array();
  for (Eigen::Index k = 0; k < response.bias.size(); ++k) {
    const int axis = main_axis(instrument, response, k);
    const PolarForm form = polar_from_sensitivity(response.sensitivity.row(k).transpose(), axis,
                                                  instrument.convention);
    polar.push_back({{"axis", instrument.axes[static_cast<std::size_t>(k)]},
                     {"nominal", std::string(1, "xyz"[axis])},
                     {"bias", response.bias(k)},
                     {"sensitivity", form.sensitivity},
                     {"coning_angle_rad", form.coning_angle_rad},
                     {"azimuth_rad", form.azimuth_rad}});
  }
  return {{"bias", json_from(response.bias)},
          {"sensitivity", json_from_matrix(response.sensitivity)},
          {"polar", polar}};
}

Json json_of(const TemperatureResponse& temperature) {
  Json json = {{"reference", temperature.reference},
               {"range", {temperature.low, temperature.high}},
               {"bias", json_from_matrix(temperature.bias)},
               {"scale", json_from_matrix(temperature.scale)}};
  if (temperature.bias_se.rows() == temperature.bias.rows()) {  // else nobody knows them
    json["standard_error"] = {{"bias", json_from_matrix(temperature.bias_se)},
                              {"scale", json_from_matrix(temperature.scale_se)}};
  }
  for (const TemperatureOrderTrial& trial : temperature.trials) {
    json["orders"].push_back({{"order", trial.order},
                              {"aicc", trial.aicc},
                              {"lack_of_fit_p_value", trial.lack_of_fit_p_value}});
  }
  return json;
}

Json json_of(const RegressionRow& row) {
  Json json = {{"runs", row.runs}};
  put_point(json, row.point);
  json["block"] = row.block;
  json["leverage"] = json_from(row.leverage);
  json["studentized"] = json_from(row.studentized);
  json["cooks_distance"] = json_from(row.cooks_distance);
  if (row.robust_weight.size() > 0) {
    json["robust_weight"] = json_from(row.robust_weight);
  }
  return json;
}

Json json_of(const FitStatistics& statistics) {
  const Eigen::VectorXd& t = statistics.coverage_factor;
  Json json = {{"observations", statistics.observations},
               {"degrees_of_freedom", json_from(statistics.degrees_of_freedom)},
               {"residual_sd", json_from(statistics.residual_sd)},
               {"r_squared", json_from(statistics.r_squared)}};
  json["standard_error"] = {{"bias", json_from(statistics.bias_se)},
                            {"sensitivity", json_from_matrix(statistics.sensitivity_se)}};
  json["coverage_factor_95"] = json_from(t);
  json["interval_95"] = {
      {"bias", json_from(t.cwiseProduct(statistics.bias_se))},
      {"sensitivity", json_from_matrix(t.asDiagonal() * statistics.sensitivity_se)}};
  json["parameter_names"] = statistics.parameter_names;
  json["covariance"] = json_from_matrix(statistics.covariance);
  json["condition_number"] = statistics.condition_number;
  json["variance_inflation"] = json_from_matrix(statistics.variance_inflation);
  if (!statistics.lack_of_fit.empty()) {
    Json tests = Json::array();
    for (const LackOfFit& test : statistics.lack_of_fit) {
      tests.push_back({{"pure_error_sd", test.pure_error_sd},
                       {"pure_error_dof", test.pure_error_dof},
                       {"lack_of_fit_dof", test.lack_of_fit_dof},
                       {"f", test.f},
                       {"p_value", test.p_value}});
    }
    json["lack_of_fit"] = tests;
  }
  if (!statistics.observations_per_axis.empty()) {
    json["observations_per_axis"] = statistics.observations_per_axis;
  }
  json["rows"] = Json::array();
  for (const RegressionRow& row : statistics.rows) {
    json["rows"].push_back(json_of(row));
  }
  return json;
}

// A number of degrees of freedom that is infinite is null in JSON, as one that does not exist.
Json json_of(const CombinedUncertainty& uncertainty) {
  return {{"u", uncertainty.u},
          {"degrees_of_freedom", uncertainty.degrees_of_freedom},
          {"coverage_factor_95", uncertainty.coverage_factor},
          {"expanded_95", uncertainty.expanded}};
}

Json budget_json(const Calibration& calibration) {
  Json json = {{"sources", Json::array()}};
  const UncertaintyBudget& budget = *calibration.uncertainty;
  if (budget.resolution > 0.0) {
    json["resolution"] = budget.resolution;
  }
  if (budget.temperature_u > 0.0) {
    json["temperature_u"] = budget.temperature_u;
  }
  for (const UncertaintySource& source : budget.sources) {
    Json one = {{"name", source.name},
                {"type", source.type},
                {"distribution", source.distribution},
                {"input_u", source.input_u}};
    if (!source.input_unit.empty()) {
      one["input_unit"] = source.input_unit;
    }
    one["degrees_of_freedom"] = source.degrees_of_freedom;
    if (source.type == "B") {  // the fit's is in the statistics
      one["covariance"] = json_from_matrix(source.covariance);
    }
    json["sources"].push_back(std::move(one));
  }
  json["parameters"] = Json::array();
  for (const ParameterUncertainty& parameter : parameter_uncertainties(calibration)) {
    Json one = {{"parameter", parameter.name}, {"value", parameter.value}};
    one.update(json_of(parameter.uncertainty));
    json["parameters"].push_back(std::move(one));
  }
  return json;
}

Json json_of(const LevelnessEstimate& estimate, bool with_values) {
  Json json;
  put_point(json, estimate.point);
  json["block"] = estimate.block;
  if (with_values) {
    json["x"] = estimate.x;
    json["y"] = estimate.y;
  }
  return json;
}

Json json_of(const Levelness& levelness) {
  Json json = {{"estimates", Json::array()}};
  for (const LevelnessEstimate& estimate : levelness.estimates) {
    json["estimates"].push_back(json_of(estimate, true));
  }
  json["mean"] = json_xy(levelness.mean_x, levelness.mean_y);
  json["sd"] = json_xy(levelness.sd_x, levelness.sd_y);
  json["standard_error"] = json_xy(levelness.standard_error_x, levelness.standard_error_y);
  json["degrees_of_freedom"] = levelness.degrees_of_freedom;
  json["consistent"] = levelness.consistent;
  json["p_value"] = levelness.p_value;
  json["block_p_value"] = levelness.block_p_value;
  if (levelness.suspect) {
    json["suspect"] = json_of(*levelness.suspect, false);
  }
  if (!levelness.blocks.empty()) {
    json["blocks"] = Json::array();
    for (const BlockLevelness& block : levelness.blocks) {
      json["blocks"].push_back(
          {{"block", block.block},
           {"x", block.x},
           {"y", block.y},
           {"standard_error", json_xy(block.standard_error_x, block.standard_error_y)}});
    }
  }
  if (levelness.combined) {
    const CombinedLevelness& combined = *levelness.combined;
    json["combined"] = {
        {"slots", combined.slots},
        {"x", combined.x},
        {"y", combined.y},
        {"standard_error", json_xy(combined.standard_error_x, combined.standard_error_y)},
        {"consistent", combined.consistent},
        {"p_value", combined.p_value},
        {"suspect", combined.suspect}};
  }
  return json;
}

Json json_of(const ReadingResidual& residual) {
  Json json = {{"run", residual.run}};
  put_point(json, residual.point);
  if (residual.level) {
    json["level"] = *residual.level;
  }
  if (residual.block) {
    json["block"] = *residual.block;
  }
  if (residual.temperature) {
    json["temperature"] = *residual.temperature;
  }
  json["response"] = json_from(residual.response);
  json["magnitude"] = residual.magnitude;
  if (!residual.used) {
    json["used"] = false;
  }
  return json;
}

Json json_of(const Verdict& verdict) {
  Json json = {{"passed", verdict.passed}, {"rule", verdict.rule}, {"limits", Json::array()}};
  for (const LimitVerdict& one : verdict.limits) {
    Json limit = {{"parameter", one.parameter}, {"value", one.value}, {"u", one.u}};
    if (one.low) {
      limit["low"] = *one.low;
    }
    if (one.high) {
      limit["high"] = *one.high;
    }
    limit["guard_band"] = one.guard_band;
    limit["passed"] = one.passed;
    json["limits"].push_back(std::move(limit));
  }
  return json;
}

}  // namespace

std::string verdict_json(const Verdict& verdict) {
  return json_text(json_of(verdict));
}

namespace {

// A correction that was made; the file holds what was corrected, not how.
Json json_of(const Correction& correction) {
  return {{"code", correction.code}, {"runs", correction.runs}, {"message", correction.message}};
}

Json json_of(const CalibrationWarning& warning) {
  Json json = {{"code", warning.code}};
  if (warning.runs.size() == 1) {
    json["run"] = warning.runs.front();
  } else if (!warning.runs.empty()) {
    json["runs"] = warning.runs;
  }
  json["message"] = warning.message;
  return json;
}

// ---- reading ----

double number_or_nan(const JsonValue& object, std::string_view key) {
  const std::optional<JsonValue> value = object.find(key);
  return value ? value->number() : not_a_number;
}

Eigen::VectorXd vector_or_nan(const JsonValue& object, std::string_view key, Eigen::Index size) {
  const std::optional<JsonValue> value = object.find(key);
  return value ? value->vector_or_nan(size) : Eigen::VectorXd::Constant(size, not_a_number);
}

Eigen::MatrixXd matrix_or_nan(const JsonValue& object,
                              std::string_view key,
                              Eigen::Index rows,
                              Eigen::Index columns) {
  const std::optional<JsonValue> value = object.find(key);
  return value ? value->matrix_or_nan(rows, columns)
               : Eigen::MatrixXd::Constant(rows, columns, not_a_number);
}

std::vector<int> integers(const JsonValue& list) {
  std::vector<int> values;
  for (const JsonValue& element : list.elements()) {
    values.push_back(element.integer());
  }
  return values;
}

std::optional<DesignPoint> point_of(const JsonValue& object) {
  const std::optional<JsonValue> rest = object.find("rest");
  const std::optional<JsonValue> fence = object.find("fence");
  if (!rest || !fence) {
    return std::nullopt;
  }
  const std::optional<Face> rest_face = parse_face(rest->text());
  const std::optional<Face> fence_face = parse_face(fence->text());
  if (!rest_face || !fence_face || axis_of(*rest_face) == axis_of(*fence_face)) {
    object.fail("rest and fence must be faces (+X -X +Y -Y +Z -Z) on two axes");
  }
  return DesignPoint(*rest_face, *fence_face);
}

Instrument instrument_of(const JsonValue& json) {
  Instrument instrument;
  const JsonValue kind = json.at("kind");
  instrument.kind = kind.text();
  kind.check([&] { static_cast<void>(find_instrument_kind(instrument.kind)); });
  instrument.serial = json.text_or("serial");
  instrument.axes = json.at("axes").texts();
  json.at("axes").check([&] { check_axes(instrument); });
  instrument.unit = json.at("unit").text();
  if (const auto convention = json.find("convention")) {
    convention->check([&] { instrument.convention = parse_convention(convention->text()); });
  }
  if (const auto differences = json.find("differences")) {
    for (const std::string& axis : differences->keys()) {
      const std::vector<std::string> columns = differences->at(axis).texts();
      if (columns.size() != 2) {
        differences->at(axis).fail("must be two columns: [plus, minus]");
      }
      instrument.differences.push_back({.axis = axis, .plus = columns[0], .minus = columns[1]});
    }
  }
  if (const auto range = json.find("range")) {
    const Eigen::VectorXd ends = range->vector(2);
    instrument.range = ReadingRange{.low = ends(0), .high = ends(1)};
  }
  if (const auto one_sided = json.find("one_sided")) {
    instrument.one_sided = one_sided->boolean();
  }
  return instrument;
}

FieldDescription field_of(const JsonValue& json) {
  FieldDescription field{.kind = json.at("kind").text(),
                         .unit = json.at("unit").text(),
                         .magnitude = json.at("magnitude").number()};
  if (!(field.magnitude > 0.0)) {
    json.at("magnitude").fail("must be positive");
  }
  if (field.kind == "gravity" && field.unit != "g" && field.unit != "m/s^2") {
    json.at("unit").fail("gravity is in g or m/s^2");
  }
  if (const auto in_table = json.find("in_table")) {
    field.in_table = in_table->vector(3);
    if (!(field.in_table->norm() > 0.0)) {
      in_table->fail("must not be zero");
    }
  }
  if (const auto covariance = json.find("in_table_covariance")) {
    field.in_table_covariance = covariance->matrix_or_nan(3, 3);
    field.in_table_degrees_of_freedom = number_or_nan(json, "in_table_degrees_of_freedom");
  }
  if (const auto site = json.find("site")) {
    field.site = Site{.latitude_deg = site->at("latitude_deg").number(),
                      .longitude_deg = site->at("longitude_deg").number(),
                      .height_m = site->at("height_m").number()};
  }
  field.date = json.text_or("date");
  if (const auto u = json.find("magnitude_u")) {
    field.magnitude_u = u->number();
  }
  field.model = json.text_or("model");
  if (const auto gravity = json.find("local_gravity_m_s2")) {
    field.local_gravity = gravity->number();
  }
  if (const auto parts = json.find("parts")) {
    for (const JsonValue& part : parts->elements()) {
      FieldPartDescription description;
      description.kind = part.at("kind").text();
      description.magnitude = part.at("magnitude").number();
      description.in_table = part.at("in_table").vector(3);
      description.set_by_level = part.at("set_by_level").boolean();
      description.turning = part.at("turning").boolean();
      field.parts.push_back(std::move(description));
    }
  }
  return field;
}

LinearResponse response_of(const JsonValue& json, Eigen::Index m) {
  return {.bias = json.at("bias").vector(m), .sensitivity = json.at("sensitivity").matrix(m, 3)};
}

TemperatureResponse temperature_of(const JsonValue& json, Eigen::Index m) {
  TemperatureResponse temperature;
  temperature.reference = json.at("reference").number();
  const Eigen::VectorXd range = json.at("range").vector(2);
  temperature.low = range(0);
  temperature.high = range(1);
  const JsonValue bias = json.at("bias");
  const std::vector<JsonValue> rows = bias.elements();
  const auto order = rows.empty() ? 0 : static_cast<Eigen::Index>(rows.front().elements().size());
  temperature.bias = bias.matrix(m, order);
  temperature.scale = json.at("scale").matrix(m, order);
  temperature.bias_se.setConstant(m, order, not_a_number);
  temperature.scale_se = temperature.bias_se;
  if (const auto errors = json.find("standard_error")) {
    temperature.bias_se = matrix_or_nan(*errors, "bias", m, order);
    temperature.scale_se = matrix_or_nan(*errors, "scale", m, order);
  }
  if (const auto orders = json.find("orders")) {
    for (const JsonValue& trial : orders->elements()) {
      temperature.trials.push_back(
          {.order = trial.at("order").integer(),
           .aicc = number_or_nan(trial, "aicc"),
           .lack_of_fit_p_value = number_or_nan(trial, "lack_of_fit_p_value")});
    }
  }
  return temperature;
}

std::vector<AlsoResponse> also_of(const JsonValue& coefficients, Eigen::Index m) {
  std::vector<AlsoResponse> all;
  if (const auto json = coefficients.find("also")) {
    for (const std::string& kind : json->keys()) {
      const JsonValue one = json->at(kind);
      AlsoResponse also;
      also.kind = kind;
      also.unit = one.at("unit").text();
      if (const auto in_table = one.find("in_table")) {
        also.in_table = in_table->vector(3);
      }
      also.sensitivity = one.at("sensitivity").matrix(m, 3);
      also.sensitivity_se = matrix_or_nan(one, "standard_error", m, 3);
      all.push_back(std::move(also));
    }
  }
  return all;
}

OrientationQuality orientations_of(const JsonValue& json) {
  OrientationQuality quality;
  quality.fit_error = number_or_nan(json, "fit_error");
  quality.magnitude_spread = number_or_nan(json, "magnitude_spread");
  quality.coverage = number_or_nan(json, "coverage");
  quality.largest_gap_rad = number_or_nan(json, "largest_gap_rad");
  if (const auto gap = json.find("gap")) {
    quality.gap = gap->vector(3);
  }
  return quality;
}

CompanionAlignment alignment_of(const JsonValue& json) {
  CompanionAlignment companion;
  companion.record = json.text_or("record");
  Alignment& alignment = companion.alignment;
  alignment.rotation_companion_from_sensor = json.at("rotation_companion_from_sensor").matrix(3, 3);
  alignment.standard_error_rad = vector_or_nan(json, "standard_error_rad", 3);
  alignment.angle_rad = number_or_nan(json, "angle_rad");
  alignment.angle_se_rad = number_or_nan(json, "angle_standard_error_rad");
  alignment.residual_sd = number_or_nan(json, "residual_sd");
  return companion;
}

RegressionRow row_of(const JsonValue& json, Eigen::Index m) {
  RegressionRow row;
  if (const auto runs = json.find("runs")) {
    row.runs = integers(*runs);
  }
  row.point = point_of(json);
  if (const auto block = json.find("block")) {
    row.block = block->integer();
  }
  row.leverage = vector_or_nan(json, "leverage", m);
  row.studentized = vector_or_nan(json, "studentized", m);
  row.cooks_distance = vector_or_nan(json, "cooks_distance", m);
  if (json.find("robust_weight")) {
    row.robust_weight = vector_or_nan(json, "robust_weight", m);
  }
  return row;
}

FitStatistics statistics_of(const JsonValue& json, Eigen::Index m) {
  FitStatistics statistics;
  if (const auto observations = json.find("observations")) {
    statistics.observations = observations->integer();
  }
  statistics.degrees_of_freedom = vector_or_nan(json, "degrees_of_freedom", m);
  statistics.residual_sd = vector_or_nan(json, "residual_sd", m);
  statistics.r_squared = vector_or_nan(json, "r_squared", m);
  statistics.bias_se = Eigen::VectorXd::Constant(m, not_a_number);
  statistics.sensitivity_se = Eigen::MatrixXd::Constant(m, 3, not_a_number);
  if (const auto errors = json.find("standard_error")) {
    statistics.bias_se = vector_or_nan(*errors, "bias", m);
    statistics.sensitivity_se = matrix_or_nan(*errors, "sensitivity", m, 3);
  }
  statistics.coverage_factor = vector_or_nan(json, "coverage_factor_95", m);
  if (const auto names = json.find("parameter_names")) {
    statistics.parameter_names = names->texts();
  }
  // Without names nobody knows what the covariance is of.
  const auto parameters = static_cast<Eigen::Index>(statistics.parameter_names.size());
  statistics.covariance.resize(0, 0);
  if (parameters > 0) {
    statistics.covariance = matrix_or_nan(json, "covariance", parameters, parameters);
  }
  statistics.condition_number = number_or_nan(json, "condition_number");
  statistics.variance_inflation = matrix_or_nan(json, "variance_inflation", m, 3);
  if (const auto tests = json.find("lack_of_fit")) {
    for (const JsonValue& test : tests->elements()) {
      statistics.lack_of_fit.push_back({.pure_error_sd = number_or_nan(test, "pure_error_sd"),
                                        .pure_error_dof = number_or_nan(test, "pure_error_dof"),
                                        .lack_of_fit_dof = number_or_nan(test, "lack_of_fit_dof"),
                                        .f = number_or_nan(test, "f"),
                                        .p_value = number_or_nan(test, "p_value")});
    }
  }
  if (const auto counts = json.find("observations_per_axis")) {
    statistics.observations_per_axis = integers(*counts);
  }
  if (const auto rows = json.find("rows")) {
    for (const JsonValue& row : rows->elements()) {
      statistics.rows.push_back(row_of(row, m));
    }
  }
  return statistics;
}

UncertaintyBudget budget_of(const JsonValue& json, const FitStatistics& statistics) {
  UncertaintyBudget budget;
  const Eigen::Index parameters = statistics.covariance.rows();
  if (const auto resolution = json.find("resolution")) {
    budget.resolution = resolution->number();
  }
  if (const auto u = json.find("temperature_u")) {
    budget.temperature_u = u->number();
  }
  for (const JsonValue& one : json.at("sources").elements()) {
    UncertaintySource source;
    source.name = one.at("name").text();
    source.type = one.at("type").text();
    source.distribution = one.text_or("distribution");
    source.input_u = number_or_nan(one, "input_u");
    source.input_unit = one.text_or("input_unit");
    const bool from_scatter = source.type == "A";
    source.degrees_of_freedom =
        from_scatter ? not_a_number : std::numeric_limits<double>::infinity();
    if (!from_scatter) {
      source.covariance = one.at("covariance").matrix(parameters, parameters);
    }
    budget.sources.push_back(std::move(source));
  }
  return budget;
}

LevelnessEstimate levelness_estimate_of(const JsonValue& json) {
  const std::optional<DesignPoint> point = point_of(json);
  if (!point) {
    json.fail("needs 'rest' and 'fence'");
  }
  LevelnessEstimate estimate{
      .point = *point, .x = number_or_nan(json, "x"), .y = number_or_nan(json, "y")};
  if (const auto block = json.find("block")) {
    estimate.block = block->integer();
  }
  return estimate;
}

Eigen::Vector2d xy_of(const JsonValue& json, std::string_view key) {
  const std::optional<JsonValue> pair = json.find(key);
  return pair ? Eigen::Vector2d(number_or_nan(*pair, "x"), number_or_nan(*pair, "y"))
              : Eigen::Vector2d::Constant(not_a_number);
}

Levelness levelness_of(const JsonValue& json) {
  Levelness levelness;
  if (const auto estimates = json.find("estimates")) {
    for (const JsonValue& estimate : estimates->elements()) {
      levelness.estimates.push_back(levelness_estimate_of(estimate));
    }
  }
  const Eigen::Vector2d mean = xy_of(json, "mean");
  const Eigen::Vector2d sd = xy_of(json, "sd");
  const Eigen::Vector2d error = xy_of(json, "standard_error");
  levelness.mean_x = mean.x();
  levelness.mean_y = mean.y();
  levelness.sd_x = sd.x();
  levelness.sd_y = sd.y();
  levelness.standard_error_x = error.x();
  levelness.standard_error_y = error.y();
  levelness.degrees_of_freedom = number_or_nan(json, "degrees_of_freedom");
  levelness.p_value = number_or_nan(json, "p_value");
  levelness.block_p_value = number_or_nan(json, "block_p_value");
  if (const auto consistent = json.find("consistent")) {
    levelness.consistent = consistent->boolean();
  }
  if (const auto suspect = json.find("suspect")) {
    levelness.suspect = levelness_estimate_of(*suspect);
  }
  if (const auto blocks = json.find("blocks")) {
    for (const JsonValue& block : blocks->elements()) {
      const Eigen::Vector2d own = xy_of(block, "standard_error");
      levelness.blocks.push_back({.block = block.at("block").integer(),
                                  .x = number_or_nan(block, "x"),
                                  .y = number_or_nan(block, "y"),
                                  .standard_error_x = own.x(),
                                  .standard_error_y = own.y()});
    }
  }
  if (const auto combined = json.find("combined")) {
    const Eigen::Vector2d own = xy_of(*combined, "standard_error");
    levelness.combined = CombinedLevelness{.slots = combined->at("slots").texts(),
                                           .x = number_or_nan(*combined, "x"),
                                           .y = number_or_nan(*combined, "y"),
                                           .standard_error_x = own.x(),
                                           .standard_error_y = own.y(),
                                           .p_value = number_or_nan(*combined, "p_value"),
                                           .consistent = combined->at("consistent").boolean(),
                                           .suspect = combined->text_or("suspect")};
  }
  return levelness;
}

ReadingResidual residual_of(const JsonValue& json, Eigen::Index m) {
  ReadingResidual residual;
  if (const auto run = json.find("run")) {
    residual.run = run->integer();
  }
  residual.point = point_of(json);
  if (const auto level = json.find("level")) {
    residual.level = level->number();
  }
  if (const auto block = json.find("block")) {
    residual.block = block->integer();
  }
  if (const auto temperature = json.find("temperature")) {
    residual.temperature = temperature->number();
  }
  residual.response = vector_or_nan(json, "response", m);
  residual.magnitude = number_or_nan(json, "magnitude");
  if (const auto used = json.find("used")) {
    residual.used = used->boolean();
  }
  return residual;
}

Verdict verdict_of(const JsonValue& json) {
  Verdict verdict{.passed = json.at("passed").boolean(), .rule = json.text_or("rule")};
  if (const auto limits = json.find("limits")) {
    for (const JsonValue& one : limits->elements()) {
      LimitVerdict limit{.parameter = one.text_or("parameter"),
                         .value = number_or_nan(one, "value"),
                         .u = number_or_nan(one, "u"),
                         .guard_band = number_or_nan(one, "guard_band")};
      if (const auto low = one.find("low")) {
        limit.low = low->number();
      }
      if (const auto high = one.find("high")) {
        limit.high = high->number();
      }
      limit.passed = one.at("passed").boolean();
      verdict.limits.push_back(std::move(limit));
    }
  }
  return verdict;
}

CalibrationWarning warning_of(const JsonValue& json) {
  CalibrationWarning warning{
      .code = json.text_or("code"), .runs = {}, .message = json.text_or("message")};
  if (const auto run = json.find("run")) {
    warning.runs = {run->integer()};
  } else if (const auto runs = json.find("runs")) {
    warning.runs = integers(*runs);
  }
  return warning;
}

}  // namespace

namespace {

std::string text_of_record(const Calibration& calibration) {
  Json json = {{"format", "axiscal-calibration"},
               {"version", 1},
               {"created", calibration.created},
               {"software", calibration.software},
               {"status", calibration.status}};
  json["inputs"] = Json::array();
  for (const InputFileDigest& input : calibration.inputs) {
    json["inputs"].push_back({{"path", input.path}, {"sha256", input.sha256}});
  }
  json["instrument"] = json_of(calibration.instrument);
  json["field"] = json_of(calibration.field);
  json["method"] = calibration.method;
  if (!calibration.shape.empty()) {
    json["shape"] = calibration.shape;
  }
  json["weights"] = calibration.weights;
  if (calibration.robust) {
    json["robust"] = "bisquare";
  }
  if (!calibration.positioner.empty()) {
    json["positioner"] = calibration.positioner;
  }
  if (!calibration.slot.empty()) {
    json["slot"] = calibration.slot;
  }
  if (calibration.level_by_block) {
    json["level_by"] = "block";
  }
  if (!calibration.left_out.empty()) {
    json["leave_out"] = calibration.left_out;
  }
  json["coefficients"] = json_of(calibration.instrument, calibration.response);
  if (calibration.temperature) {
    json["coefficients"]["temperature"] = json_of(*calibration.temperature);
  }
  if (!calibration.also.empty()) {
    json["coefficients"]["also"] = json_of(calibration.also);
  }
  for (std::size_t k = 0; k < calibration.polar_fit.size(); ++k) {
    const PolarFit& fit = calibration.polar_fit[k];
    json["polar_fit"].push_back({{"axis", calibration.instrument.axes[k]},
                                 {"bias", fit.bias},
                                 {"sensitivity", fit.form.sensitivity},
                                 {"coning_angle_rad", fit.form.coning_angle_rad},
                                 {"azimuth_rad", fit.form.azimuth_rad},
                                 {"residual_sd", fit.residual_sd},
                                 {"rounds", fit.rounds},
                                 {"converged", fit.converged}});
  }
  if (Json quantities = quantities_json(calibration); !quantities.empty()) {
    json["quantities"] = std::move(quantities);
  }
  if (calibration.statistics) {
    json["statistics"] = json_of(*calibration.statistics);
  }
  if (calibration.uncertainty) {
    json["uncertainty"] = budget_json(calibration);
  }
  if (calibration.orientations) {
    json["orientations"] = json_of(*calibration.orientations);
  }
  if (!calibration.turn_errors_rad.empty()) {
    Json turns = Json::array();
    for (const Eigen::Vector3d& error : calibration.turn_errors_rad) {
      turns.push_back(json_from(error));
    }
    json["turn_errors_rad"] = turns;
  }
  if (calibration.alignment) {
    json["alignment"] = json_of(*calibration.alignment);
  }
  if (calibration.levelness) {
    json["levelness"] = json_of(*calibration.levelness);
  }
  if (calibration.verdict) {
    json["verdict"] = json_of(*calibration.verdict);
  }
  for (const Correction& correction : calibration.corrections) {
    json["corrections"].push_back(json_of(correction));
  }
  json["residuals"] = Json::array();
  for (const ReadingResidual& residual : calibration.residuals) {
    json["residuals"].push_back(json_of(residual));
  }
  json["warnings"] = Json::array();
  for (const CalibrationWarning& warning : calibration.warnings) {
    json["warnings"].push_back(json_of(warning));
  }
  json["notes"] = calibration.notes;
  return json_text(json);
}

}  // namespace

std::string calibration_json(const Calibration& calibration) {
  std::string text = text_of_record(calibration);
  // Nothing is stored that could not be read again.
  constexpr std::string_view name = "the record";
  try {
    static_cast<void>(parse_calibration(text, std::string(name)));
  } catch (const DataError& error) {
    throw DomainError(std::string("it would make a record that cannot be read back: ") +
                      (error.what() + name.size() + 2));
  }
  return text;
}

Calibration parse_calibration(std::string_view text, const std::string& path) {
  const JsonValue json = parse_json(text, path);
  json.require_format("axiscal-calibration");
  Calibration calibration;
  calibration.created = json.text_or("created");
  calibration.software = json.text_or("software");
  calibration.status = json.text_or("status", "ok");
  if (const auto inputs = json.find("inputs")) {
    for (const JsonValue& input : inputs->elements()) {
      calibration.inputs.push_back(
          {.path = input.text_or("path"), .sha256 = input.text_or("sha256")});
    }
  }
  calibration.instrument = instrument_of(json.at("instrument"));
  calibration.field = field_of(json.at("field"));
  calibration.method = json.text_or("method");
  calibration.weights = json.text_or("weights", "none");
  calibration.robust = json.find("robust").has_value();
  calibration.positioner = json.text_or("positioner");
  calibration.slot = json.text_or("slot");
  calibration.level_by_block = json.text_or("level_by") == "block";
  if (const auto left_out = json.find("leave_out")) {
    calibration.left_out = integers(*left_out);
  }
  const Eigen::Index m = calibration.instrument.axis_count();
  calibration.response = response_of(json.at("coefficients"), m);
  if (const auto temperature = json.at("coefficients").find("temperature")) {
    calibration.temperature = temperature_of(*temperature, m);
  }
  calibration.also = also_of(json.at("coefficients"), m);
  if (const auto fits = json.find("polar_fit")) {
    for (const JsonValue& one : fits->elements()) {
      PolarFit fit{.bias = one.at("bias").number()};
      fit.form = {.sensitivity = one.at("sensitivity").number(),
                  .coning_angle_rad = one.at("coning_angle_rad").number(),
                  .azimuth_rad = one.at("azimuth_rad").number()};
      fit.residual_sd = number_or_nan(one, "residual_sd");
      fit.rounds = one.at("rounds").integer();
      fit.converged = one.at("converged").boolean();
      calibration.polar_fit.push_back(fit);
    }
  }
  calibration.shape = json.text_or("shape");
  if (const auto orientations = json.find("orientations")) {
    calibration.orientations = orientations_of(*orientations);
  }
  if (const auto turns = json.find("turn_errors_rad")) {
    for (const JsonValue& turn : turns->elements()) {
      calibration.turn_errors_rad.emplace_back(turn.vector(3));
    }
  }
  if (const auto alignment = json.find("alignment")) {
    calibration.alignment = alignment_of(*alignment);
  }
  if (const auto statistics = json.find("statistics")) {
    calibration.statistics = statistics_of(*statistics, m);
    if (const auto budget = json.find("uncertainty")) {
      calibration.uncertainty = budget_of(*budget, *calibration.statistics);
    }
  }
  if (const auto levelness = json.find("levelness")) {
    calibration.levelness = levelness_of(*levelness);
  }
  if (const auto verdict = json.find("verdict")) {
    calibration.verdict = verdict_of(*verdict);
  }
  if (const auto corrections = json.find("corrections")) {
    for (const JsonValue& one : corrections->elements()) {
      Correction correction;
      correction.code = one.text_or("code");
      correction.message = one.text_or("message");
      correction.runs = integers(one.at("runs"));
      calibration.corrections.push_back(std::move(correction));
    }
  }
  if (const auto residuals = json.find("residuals")) {
    for (const JsonValue& residual : residuals->elements()) {
      calibration.residuals.push_back(residual_of(residual, m));
    }
  }
  if (const auto warnings = json.find("warnings")) {
    for (const JsonValue& warning : warnings->elements()) {
      calibration.warnings.push_back(warning_of(warning));
    }
  }
  if (const auto notes = json.find("notes")) {
    calibration.notes = notes->texts();
  }
  return calibration;
}

Calibration read_calibration(const std::string& path) {
  return parse_calibration(read_whole_file(path), path);
}

}  // namespace axiscal
