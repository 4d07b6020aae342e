// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/limits.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/drift_check.hpp"
#include "axiscal/calib/intrinsic.hpp"
#include "axiscal/calib/reading_uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"
#include "calib/record/parameter_names.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"

namespace axiscal {
namespace {

struct Measured {
  std::string name;
  double value = 0.0;
  double u = not_a_number;
  double expanded = 0.0;
  // Degrees of freedom of `u`; if is_scatter is true, degrees of freedom of `value`.
  double degrees_of_freedom = not_a_number;
  bool is_scatter = false;
};

constexpr double as_good_as_infinite = 1e6;

// Returns the probability that the true value of a quantity is at most `limit`.
double probability_below(const Measured& one, double limit) {
  const double nu = std::min(one.degrees_of_freedom, as_good_as_infinite);
  if (one.is_scatter) {
    // The true variance is nu s^2 / chi^2, where chi^2 has nu degrees of freedom.
    return limit > 0.0 ? chi_squared_upper_p(nu * std::pow(one.value / limit, 2), nu) : 0.0;
  }
  const double t = (limit - one.value) / one.u;
  const double beyond = 0.5 * student_t_two_sided_p(t, nu);
  return t > 0.0 ? 1.0 - beyond : beyond;
}

double conformity_of(const Measured& one, const Limit& limit) {
  if (!(one.u > 0.0) || !(one.degrees_of_freedom > 0.0)) {
    return not_a_number;
  }
  return (limit.high ? probability_below(one, *limit.high) : 1.0) -
         (limit.low ? probability_below(one, *limit.low) : 0.0);
}

// Returns the distance from a scatter s to its upper 95 % bound, s sqrt(nu / chi^2(nu; 0.05)).
double scatter_guard_band(double s, double nu) {
  constexpr double risk = 0.05;
  return s * (std::sqrt(nu / chi_squared_quantile(risk, nu)) - 1.0);
}

// Returns the largest expanded uncertainty of the pitch over all attitudes, from the calibration.
double pitch_uncertainty_deg(const Calibration& calibration) {
  ReadingNoise silent;
  silent.sd = Eigen::VectorXd::Zero(calibration.sensor.instrument.axis_count());
  ReductionOptions options;
  options.inclination.pitch_formula = PitchFormula::arctangent;
  double worst = 0.0;
  for (const Eigen::Vector3d& u : directions_on_sphere(100)) {
    const AttitudeBudget budget =
        attitude_budget(calibration, options, silent, calibration.sensor.field.magnitude * u);
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
                   .expanded = one.uncertainty.expanded,
                   .degrees_of_freedom = one.uncertainty.degrees_of_freedom});
  }
  if (parameters.empty()) {
    for (const std::string& name : parameter_names(calibration.sensor.instrument.axes)) {
      all.push_back({.name = name, .value = parameter_value(calibration.sensor, name)});
    }
  }
  const IntrinsicParameters intrinsic = intrinsic_parameters(calibration);
  for (std::size_t i = 0; i < intrinsic.names.size(); ++i) {
    if (intrinsic.names[i].ends_with(".bias")) {
      continue;  // biases are in the list already
    }
    Measured one{.name = intrinsic.names[i],
                 .value = intrinsic.values(static_cast<Eigen::Index>(i))};
    if (!intrinsic.uncertainty.empty()) {
      one.u = intrinsic.uncertainty[i].u;
      one.expanded = intrinsic.uncertainty[i].expanded;
      one.degrees_of_freedom = intrinsic.uncertainty[i].degrees_of_freedom;
    }
    all.push_back(std::move(one));
  }
  if (calibration.fit.statistics) {
    const FitStatistics& statistics = *calibration.fit.statistics;
    for (Eigen::Index k = 0; k < statistics.residual_sd.size(); ++k) {
      const double s = statistics.residual_sd(k);
      const double nu = statistics.degrees_of_freedom(k);
      // The relative standard uncertainty of a scatter is about 1 / sqrt(2 nu).
      all.push_back(
          {.name = calibration.sensor.instrument.axes[static_cast<std::size_t>(k)] + ".residual_sd",
           .value = s,
           .u = s / std::sqrt(2.0 * nu),
           .expanded = scatter_guard_band(s, nu),
           .degrees_of_freedom = nu,
           .is_scatter = true});
    }
  }
  if (calibration.fit.statistics) {
    std::set<DesignPoint> points;
    for (const ReadingResidual& residual : calibration.fit.residuals) {
      if (residual.used && residual.point) {
        points.insert(*residual.point);
      }
    }
    const auto count = [&](const char* name, double value) {
      all.push_back({.name = name, .value = value, .u = 0.0, .expanded = 0.0});
    };
    count("readings", calibration.fit.statistics->observations);
    count("design_points", static_cast<double>(points.size()));
  }
  if (calibration.fit.levelness) {
    const Levelness& level = *calibration.fit.levelness;
    all.push_back({.name = "levelness.x",
                   .value = level.mean_x,
                   .u = level.standard_error_x,
                   .expanded = 2.0 * level.standard_error_x,
                   .degrees_of_freedom = level.degrees_of_freedom});
    all.push_back({.name = "levelness.y",
                   .value = level.mean_y,
                   .u = level.standard_error_y,
                   .expanded = 2.0 * level.standard_error_y,
                   .degrees_of_freedom = level.degrees_of_freedom});
  }
  if (check != nullptr) {
    all.push_back({.name = "pitch_error_deg",
                   .value = check->pitch_error_deg,
                   .u = check->pitch_error_u_deg,
                   .expanded = check->pitch_error_expanded_deg});
    all.push_back({.name = "drift_p_value", .value = check->p_value});
  } else if (find_instrument_kind(calibration.sensor.instrument.kind).has_axis_elevation &&
             calibration.sensor.instrument.axis_count() >= 3 && calibration.fit.statistics &&
             parameter_covariance(calibration).allFinite()) {
    all.push_back({.name = "pitch_error_deg", .value = pitch_uncertainty_deg(calibration)});
  }
  return all;
}

}  // namespace

bool is_limit_parameter(std::string_view name, const std::vector<std::string>& axes) {
  constexpr std::array<std::string_view, 6> of_all = {"readings",        "design_points",
                                                      "levelness.x",     "levelness.y",
                                                      "pitch_error_deg", "drift_p_value"};
  if (std::find(of_all.begin(), of_all.end(), name) != of_all.end()) {
    return true;
  }
  const bool is_angle = name.starts_with("angle.");
  return std::any_of(axes.begin(), axes.end(), [&](const std::string& axis) {
    return is_angle || name == axis + ".residual_sd" || name == axis + ".sensitivity" ||
           name.starts_with(axis + ".bias") || name.starts_with(axis + ".sensitivity.") ||
           name.starts_with(axis + ".scale.");
  });
}

Limits parse_limits(std::string_view text, const std::string& path) {
  const JsonValue json = parse_json(text, path);
  json.require_format("axiscal-limits");
  json.allow_keys(
      std::array<std::string_view, 5>{"format", "version", "rule", "conditions", "limits"});
  Limits limits{.path = path};
  limits.rule = json.text_or("rule", "simple");
  if (limits.rule != "simple" && limits.rule != "guarded") {
    json.at("rule").fail("must be 'simple' or 'guarded'");
  }
  const std::string conditions = json.text_or("conditions", "repeatability");
  limits.intermediate = conditions == "intermediate";
  if (!limits.intermediate && conditions != "repeatability") {
    json.at("conditions").fail("must be 'repeatability' or 'intermediate'");
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
      one.fail("a limit requires 'low' or 'high'");
    }
    if (limit.low && limit.high && !(*limit.low <= *limit.high)) {
      one.fail("'low' must not be above 'high'");
    }
    limits.limits.push_back(std::move(limit));
  }
  if (limits.limits.empty()) {
    json.at("limits").fail("must contain at least one limit");
  }
  return limits;
}

Limits read_limits(const std::string& path) {
  return parse_limits(read_whole_file(path), path);
}

Verdict evaluate(const Limits& limits, const Calibration& calibration, const DriftCheck* check) {
  const std::vector<Measured> all = measured_of(calibration, check);
  Verdict verdict{.rule = limits.rule, .not_counted = not_counted(calibration)};
  for (const Limit& limit : limits.limits) {
    const auto found = std::find_if(
        all.begin(), all.end(), [&](const Measured& one) { return one.name == limit.parameter; });
    if (found == all.end()) {
      std::vector<std::string_view> names;
      for (const Measured& one : all) {
        names.push_back(one.name);
      }
      throw DomainError(formatted(
          "limit '{}': the record has no such parameter{}", limit.parameter,
          did_you_mean(limit.parameter, names,
                       "it has " + joined(std::vector<std::string>(names.begin(), names.end())))));
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
    one.conformity = conformity_of(*found, limit);
    const bool by_one_block = limit.parameter.ends_with(".bias") && calibration.fit.statistics &&
                              calibration.fit.conditions.blocks < 2 &&
                              calibration.fit.conditions.earlier == 0;
    if (by_one_block && limits.rule == "guarded") {
      one.note =
          "the bias is from one block of readings: the guard band includes the scatter within the "
          "block, but not the change from day to day";
      one.passed = one.passed && !limits.intermediate;
    }
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
    if (!below && !(one.high && one.value > *one.high - one.guard_band)) {
      text += std::isnan(one.value) ? " is not known"
                                    : " is from only one block, but the limits require "
                                      "intermediate conditions: take two blocks or more";
      continue;
    }
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
