// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/noise_json.hpp"

#include <algorithm>
#include <cmath>

#include "axiscal/core/not_a_number.hpp"
#include "core/json_document.hpp"

namespace axiscal {

std::string noise_unit(NoiseKind kind, const std::string& unit) {
  const bool is_plain = unit.find('/') == std::string::npos;
  const std::string whole = is_plain ? unit : "(" + unit + ")";
  switch (kind) {
    case NoiseKind::quantisation:
      return whole + " s";
    case NoiseKind::white:
      return whole + "/sqrt(Hz)";
    case NoiseKind::bias_instability:
      return unit;
    case NoiseKind::random_walk:
      return whole + "/sqrt(s)";
    case NoiseKind::ramp:
      break;
  }
  return whole + "/s";
}

std::string noise_json(const LogNoise& noise) {
  Json json = {{"format", "axiscal-noise"},
               {"version", 1},
               {"rate_hz", noise.rate_hz},
               {"samples", noise.samples > 0 ? Json(noise.samples) : Json()},
               {"confidence", {{"coefficients", 0.95}, {"allan_deviation", 0.683}}},
               {"columns", Json::object()}};
  for (const ColumnNoise& one : noise.columns) {
    Json curve = Json::array();
    for (std::size_t i = 0; i < one.curve.size(); ++i) {
      const AllanPoint& point = one.curve[i];
      Json& json_point = curve.emplace_back(Json{{"tau", point.tau_s},
                                                 {"samples", point.samples},
                                                 {"deviation", point.deviation},
                                                 {"low", point.low},
                                                 {"high", point.high}});
      for (const auto& [which, deviations] : one.others) {
        json_point[name_of(which)] = deviations[i];
      }
    }
    Json coefficients = Json::object();
    for (const NoiseCoefficient& c : one.model.coefficients) {
      coefficients[noise_name(c.kind)] = {
          {"value", c.value},
          {"low", c.low},
          {"high", c.high},
          {"unit", noise_unit(c.kind, one.unit.empty() ? "unit" : one.unit)}};
    }
    json["columns"][one.name] = {{"coefficients", coefficients},
                                 {"fit",
                                  {{"p_value", one.model.p_value},
                                   {"from_tau_s", one.model.from_tau_s},
                                   {"model_error", one.model.model_error},
                                   {"white_by_stretch", one.model.white_by_stretch}}},
                                 {"deviation_at_1_s", deviation_at(one.curve, 1.0)},
                                 {"dwell",
                                  {{"best_s", one.dwell.best_s},
                                   {"deviation", one.dwell.deviation},
                                   {"sensible_s", one.dwell.sensible_s},
                                   {"sensible_deviation", one.dwell.sensible_deviation}}},
                                 {"allan_deviation", curve}};
    Json& column = json["columns"][one.name];
    if (!one.kind.empty()) {
      column["kind"] = one.kind;
    }
    if (!one.unit.empty()) {
      column["unit"] = one.unit;
    }
    if (one.rate_hz > 0.0) {
      column["rate_hz"] = one.rate_hz;
    }
  }
  json["warnings"] = noise.warnings;
  return json_text(json);
}

LogNoise parse_noise(std::string_view text, const std::string& path) {
  const JsonValue json = parse_json(text, path);
  json.require_format("axiscal-noise");
  LogNoise noise{.rate_hz = json.at("rate_hz").number()};
  if (const auto samples = json.find("samples")) {
    noise.samples = samples->count();
  }
  const JsonValue columns = json.at("columns");
  for (const std::string& name : columns.keys()) {
    const JsonValue column = columns.at(name);
    ColumnNoise one{.name = name};
    if (const auto kind = column.find("kind")) {
      one.kind = kind->text();
    }
    if (const auto unit = column.find("unit")) {
      one.unit = unit->text();
    }
    if (const auto rate = column.find("rate_hz")) {
      one.rate_hz = rate->number();
    }
    for (const JsonValue& point : column.at("allan_deviation").elements()) {
      one.curve.push_back({.tau_s = point.at("tau").number(),
                           .samples = point.at("samples").count(),
                           .deviation = point.at("deviation").number(),
                           .low = point.at("low").number(),
                           .high = point.at("high").number()});
      for (const OtherDeviation which : all_other_deviations) {
        const auto value = point.find(name_of(which));
        one.others[which].push_back(value ? value->number() : not_a_number);
      }
    }
    double last = 0.0;
    for (const AllanPoint& point : one.curve) {
      if (!(point.tau_s > last) || !(point.deviation >= 0.0)) {
        column.at("allan_deviation")
            .fail("must contain ascending times tau, and deviations of 0 or more");
      }
      last = point.tau_s;
    }
    if (one.curve.empty()) {
      column.at("allan_deviation").fail("must have at least one point");
    }
    std::erase_if(one.others, [](const auto& other) {
      return std::all_of(other.second.begin(), other.second.end(),
                         [](double deviation) { return std::isnan(deviation); });
    });
    if (const auto fit = column.find("fit")) {
      const auto p = fit->find("p_value");
      one.model.p_value = p ? p->number() : not_a_number;
      one.model.from_tau_s = fit->at("from_tau_s").number();
      one.model.model_error = fit->at("model_error").number();
      if (const auto by_stretch = fit->find("white_by_stretch")) {
        one.model.white_by_stretch = by_stretch->boolean();
      }
    }
    const JsonValue coefficients = column.at("coefficients");
    for (const NoiseKind kind : all_noise_kinds) {
      const JsonValue c = coefficients.at(noise_name(kind));
      one.model.coefficients.push_back({.kind = kind,
                                        .value = c.at("value").number(),
                                        .low = c.at("low").number(),
                                        .high = c.at("high").number()});
    }
    const JsonValue dwell = column.at("dwell");
    one.dwell = {.best_s = dwell.at("best_s").number(),
                 .deviation = dwell.at("deviation").number(),
                 .sensible_s = dwell.at("sensible_s").number(),
                 .sensible_deviation = dwell.at("sensible_deviation").number()};
    noise.columns.push_back(std::move(one));
  }
  if (const auto warnings = json.find("warnings")) {
    noise.warnings = warnings->texts();
  }
  if (noise.columns.empty()) {
    columns.fail("must have one column or more");
  }
  return noise;
}

}  // namespace axiscal
