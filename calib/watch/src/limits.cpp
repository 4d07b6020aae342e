// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/limits.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "axiscal/calib/drift_check.hpp"
#include "axiscal/calib/intrinsic.hpp"
#include "axiscal/calib/parameter_names.hpp"
#include "axiscal/calib/reading_uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/json_document.hpp"
#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"

namespace axiscal {
namespace {

struct Measured {
  std::string name;
  double value = 0.0;
  double u = not_a_number;
  double expanded = 0.0;
};

// What the calibration's own uncertainty leaves of the pitch, expanded, in the worst attitude.
double pitch_uncertainty_deg(const Calibration& calibration) {
  ReadingNoise silent;
  silent.sd = Eigen::VectorXd::Zero(calibration.instrument.axis_count());
  ReductionOptions options;
  options.inclination.pitch_formula = PitchFormula::arctangent;
  double worst = 0.0;
  for (const Eigen::Vector3d& u : directions_on_sphere(100)) {
    const AttitudeBudget budget =
        attitude_budget(calibration, options, silent, calibration.field.magnitude * u);
    for (const AttitudeQuantity& quantity : budget.quantities) {
      if (quantity.name == "pitch_deg") {
        worst = std::max(worst, quantity.uncertainty.expanded);
      }
    }
  }
  return worst;
}

std::vector<Measured> measured_of(const Calibration& calibration, const DriftCheck* check) {
  std::vector<Measured> all;
  const std::vector<ParameterUncertainty> parameters = parameter_uncertainties(calibration);
  for (const ParameterUncertainty& one : parameters) {
    all.push_back({.name = one.name,
                   .value = one.value,
                   .u = one.uncertainty.u,
                   .expanded = one.uncertainty.expanded});
  }
  if (parameters.empty()) {
    for (const std::string& name : parameter_names(calibration.instrument.axes)) {
      all.push_back({.name = name, .value = parameter_value(calibration, name)});
    }
  }
  const IntrinsicParameters intrinsic = intrinsic_parameters(calibration);
  for (std::size_t i = 0; i < intrinsic.names.size(); ++i) {
    if (intrinsic.names[i].ends_with(".bias")) {
      continue;  // is there already
    }
    Measured one{.name = intrinsic.names[i],
                 .value = intrinsic.values(static_cast<Eigen::Index>(i))};
    if (!intrinsic.uncertainty.empty()) {
      one.u = intrinsic.uncertainty[i].u;
      one.expanded = intrinsic.uncertainty[i].expanded;
    }
    all.push_back(std::move(one));
  }
  if (calibration.statistics) {
    const FitStatistics& statistics = *calibration.statistics;
    for (Eigen::Index k = 0; k < statistics.residual_sd.size(); ++k) {
      const double s = statistics.residual_sd(k);
      // A scatter is known to about 1 / sqrt(2 nu) of itself.
      const double u = s / std::sqrt(2.0 * statistics.degrees_of_freedom(k));
      all.push_back(
          {.name = calibration.instrument.axes[static_cast<std::size_t>(k)] + ".residual_sd",
           .value = s,
           .u = u,
           .expanded = 2.0 * u});
    }
  }
  if (calibration.levelness) {
    const Levelness& level = *calibration.levelness;
    all.push_back({.name = "levelness.x",
                   .value = level.mean_x,
                   .u = level.standard_error_x,
                   .expanded = 2.0 * level.standard_error_x});
    all.push_back({.name = "levelness.y",
                   .value = level.mean_y,
                   .u = level.standard_error_y,
                   .expanded = 2.0 * level.standard_error_y});
  }
  if (check != nullptr) {
    all.push_back({.name = "pitch_error_deg",
                   .value = check->pitch_error_deg,
                   .u = check->pitch_error_u_deg,
                   .expanded = 2.0 * check->pitch_error_u_deg});
    all.push_back({.name = "drift_p_value", .value = check->p_value});
  } else if (find_instrument_kind(calibration.instrument.kind).has_axis_elevation &&
             calibration.instrument.axis_count() >= 3 && calibration.statistics &&
             parameter_covariance(calibration).allFinite()) {
    all.push_back({.name = "pitch_error_deg", .value = pitch_uncertainty_deg(calibration)});
  }
  return all;
}

}  // namespace

Limits parse_limits(std::string_view text, const std::string& path) {
  const JsonValue json = parse_json(text, path);
  json.require_format("axiscal-limits");
  json.allow_keys(std::array<std::string_view, 4>{"format", "version", "rule", "limits"});
  Limits limits;
  limits.rule = json.text_or("rule", "simple");
  if (limits.rule != "simple" && limits.rule != "guarded") {
    json.at("rule").fail("must be simple or guarded");
  }
  for (const JsonValue& one : json.at("limits").elements()) {
    one.allow_keys(std::array<std::string_view, 3>{"parameter", "low", "high"});
    Limit limit{.parameter = one.at("parameter").text()};
    if (const auto low = one.find("low")) {
      limit.low = low->number();
    }
    if (const auto high = one.find("high")) {
      limit.high = high->number();
    }
    if (!limit.low && !limit.high) {
      one.fail("needs 'low' or 'high'");
    }
    if (limit.low && limit.high && !(*limit.low <= *limit.high)) {
      one.fail("'low' must not be above 'high'");
    }
    limits.limits.push_back(std::move(limit));
  }
  if (limits.limits.empty()) {
    json.at("limits").fail("must have one limit or more");
  }
  return limits;
}

Limits read_limits(const std::string& path) {
  return parse_limits(read_whole_file(path), path);
}

Verdict evaluate(const Limits& limits, const Calibration& calibration, const DriftCheck* check) {
  const std::vector<Measured> all = measured_of(calibration, check);
  Verdict verdict{.rule = limits.rule};
  for (const Limit& limit : limits.limits) {
    const auto found = std::find_if(
        all.begin(), all.end(), [&](const Measured& one) { return one.name == limit.parameter; });
    if (found == all.end()) {
      std::vector<std::string_view> names;
      for (const Measured& one : all) {
        names.push_back(one.name);
      }
      throw DomainError(formatted("limit '{}': the record has no such parameter{}; it has {}",
                                  limit.parameter, did_you_mean(limit.parameter, names),
                                  joined(std::vector<std::string>(names.begin(), names.end()))));
    }
    LimitVerdict one{.parameter = limit.parameter,
                     .value = found->value,
                     .u = found->u,
                     .low = limit.low,
                     .high = limit.high};
    if (limits.rule == "guarded") {
      one.guard_band = std::isnan(found->expanded) ? 0.0 : found->expanded;
    }
    one.passed = !std::isnan(one.value) &&
                 !(limit.low && one.value < *limit.low + one.guard_band) &&
                 !(limit.high && one.value > *limit.high - one.guard_band);
    verdict.passed = verdict.passed && one.passed;
    verdict.limits.push_back(std::move(one));
  }
  return verdict;
}

std::string reason_of(const Verdict& verdict) {
  std::string text;
  for (const LimitVerdict& one : verdict.limits) {
    if (one.passed) {
      continue;
    }
    text +=
        formatted("{}{} = {}", text.empty() ? "" : "; ", one.parameter, number_text(one.value, 6));
    const bool below = one.low && one.value < *one.low + one.guard_band;
    const double limit = below ? *one.low : *one.high;
    text += (below ? " is below " : " is above ") + number_text(limit, 6);
    if (one.guard_band > 0.0) {
      text += below ? " plus" : " less";
      text += " the guard band " + number_text(one.guard_band, 2);
    }
  }
  return text;
}

}  // namespace axiscal
