// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/uncertainty.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/field/field_kind.hpp"
#include "calib/record/linear_propagation.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns the indices of the parameters of an axis.
std::vector<Eigen::Index> places_of_axis(const FitStatistics& statistics, const std::string& axis) {
  std::vector<Eigen::Index> places;
  for (std::size_t i = 0; i < statistics.parameter_names.size(); ++i) {
    const std::string& name = statistics.parameter_names[i];
    if (name.size() > axis.size() && name.starts_with(axis) && name[axis.size()] == '.') {
      places.push_back(static_cast<Eigen::Index>(i));
    }
  }
  return places;
}

// Returns the variance of a linear function of the parameters. Most entries of the gradient are 0.
// @param places  indices of the parameters that contribute to the variance.
double variance(const Eigen::RowVectorXd& gradient,
                const Eigen::MatrixXd& covariance,
                const std::vector<Eigen::Index>& places) {
  double sum = 0.0;
  for (const Eigen::Index j : places) {
    if (gradient(j) == 0.0) {
      continue;
    }
    double of_column = 0.0;
    for (const Eigen::Index i : places) {
      of_column += gradient(i) * covariance(i, j);
    }
    sum += of_column * gradient(j);
  }
  return sum;
}

// Returns the indices of the parameters with a nonzero gradient.
std::vector<Eigen::Index> places_that_count(const Eigen::RowVectorXd& gradient) {
  std::vector<Eigen::Index> places;
  places.reserve(static_cast<std::size_t>((gradient.array() != 0.0).count()));
  for (Eigen::Index i = 0; i < gradient.size(); ++i) {
    if (gradient(i) != 0.0) {
      places.push_back(i);
    }
  }
  return places;
}

// Returns true if the budget has a source whose name starts with `beginning`.
bool has_source(const Calibration& calibration, std::string_view beginning) {
  return calibration.fit.uncertainty && std::any_of(calibration.fit.uncertainty->sources.begin(),
                                                    calibration.fit.uncertainty->sources.end(),
                                                    [&](const UncertaintySource& source) {
                                                      return source.name.starts_with(beginning);
                                                    });
}

constexpr double as_good_as_infinite = 1e6;

// A variance, and its degrees of freedom by Welch and Satterthwaite's formula. `by_welch` is true
// if each share has enough degrees of freedom for this formula.
struct EffectiveFreedom {
  double variance = 0.0;
  double degrees_of_freedom = std::numeric_limits<double>::infinity();
  bool by_welch = true;
};

EffectiveFreedom effective_freedom(const VarianceShares& shares) {
  constexpr double fewest_for_welch = 5.0;
  EffectiveFreedom result;
  double sum = 0.0;
  result.variance = shares.others;
  for (const auto* const all : {&shares.axes, &shares.components}) {
    for (const VarianceShare& share : *all) {
      if (share.variance != 0.0) {
        result.variance += share.variance;
        sum += share.variance * share.variance / share.degrees_of_freedom;
        result.by_welch = result.by_welch && share.degrees_of_freedom >= fewest_for_welch;
      }
    }
  }
  result.variance = std::max(result.variance, 0.0);
  if (sum != 0.0) {
    result.degrees_of_freedom = sum > 0.0 ? result.variance * result.variance / sum : not_a_number;
  }
  return result;
}

// Returns the expanded uncertainty from the shares of a variance; see combine().
// @param factor  function that takes degrees of freedom and returns Student's t.
template <typename Factor>
double half_width(const VarianceShares& shares, const EffectiveFreedom& freedom, Factor factor) {
  const auto t = [&](double nu) { return factor(std::min(nu, as_good_as_infinite)); };
  if (freedom.by_welch || !(freedom.variance > 0.0)) {
    return t(freedom.degrees_of_freedom) * std::sqrt(freedom.variance);
  }
  double squares = shares.others * std::pow(t(as_good_as_infinite), 2);
  for (const auto* const all : {&shares.axes, &shares.components}) {
    for (const VarianceShare& share : *all) {
      squares += share.variance * std::pow(t(share.degrees_of_freedom), 2);
    }
  }
  return std::sqrt(std::max(squares, 0.0));
}

double expanded_of(const VarianceShares& shares, const EffectiveFreedom& freedom, double coverage) {
  return half_width(shares, freedom, [&](double nu) { return student_t_factor(coverage, nu); });
}

}  // namespace

LinearPropagation::LinearPropagation(const Calibration& calibration)
    : calibration_(calibration), of_readings_(statistics().covariance_of_readings()) {
  for (const std::string& axis : calibration.sensor.instrument.axes) {
    own_.push_back(places_of_axis(statistics(), axis));
  }
}

VarianceShares LinearPropagation::scatter(const Eigen::RowVectorXd& gradient) const {
  return scatter(gradient, places_that_count(gradient));
}

VarianceShares LinearPropagation::scatter(const Eigen::RowVectorXd& gradient,
                                          const std::vector<Eigen::Index>& places) const {
  VarianceShares shares;
  shares.components.reserve(statistics().components.size());
  for (const ScatterComponent& component : statistics().components) {
    shares.components.push_back({.variance = variance(gradient, component.covariance, places),
                                 .degrees_of_freedom = component.degrees_of_freedom});
  }
  double sum = 0.0;
  shares.axes.reserve(own_.size());
  for (std::size_t k = 0; k < own_.size(); ++k) {
    const double share = variance(gradient, of_readings_, own_[k]);
    sum += share;
    shares.axes.push_back(
        {.variance = share,
         .degrees_of_freedom = statistics().degrees_of_freedom(static_cast<Eigen::Index>(k))});
  }
  // In method `joint`, all axes share the error of the fitted field direction, so the sum of the
  // axes' shares differs from the whole variance. All shares are scaled by one factor, so that
  // their sum is the whole variance.
  const double all = variance(gradient, of_readings_, places);
  for (VarianceShare& share : shares.axes) {
    share.variance *= sum > 0.0 ? all / sum : 1.0;
  }
  return shares;
}

VarianceShares LinearPropagation::all(const Eigen::RowVectorXd& gradient,
                                      std::vector<double>& by_source) const {
  const std::vector<Eigen::Index> places = places_that_count(gradient);
  VarianceShares own = scatter(gradient, places);
  // If there are no scatter components, the axes' shares already add up to the variance of the fit.
  const double variance_of_fit =
      own.components.empty()
          ? std::accumulate(own.axes.begin(), own.axes.end(), 0.0,
                            [](double sum, const VarianceShare& s) { return sum + s.variance; })
          : variance(gradient, statistics().covariance, places);
  const double of_fit = std::sqrt(std::max(variance_of_fit, 0.0));
  if (!calibration_.fit.uncertainty) {
    by_source.push_back(of_fit);
    return own;
  }
  for (const UncertaintySource& source : calibration_.fit.uncertainty->sources) {
    if (source.type == "A") {
      by_source.push_back(of_fit);
      continue;
    }
    const double part = variance(gradient, source.covariance, places);
    by_source.push_back(std::sqrt(std::max(part, 0.0)));
    own.others += part;
  }
  return own;
}

VarianceShares& VarianceShares::operator+=(const VarianceShares& more) {
  axes.insert(axes.end(), more.axes.begin(), more.axes.end());
  components.insert(components.end(), more.components.begin(), more.components.end());
  others += more.others;
  return *this;
}

CombinedUncertainty combine(const VarianceShares& shares, double coverage) {
  const EffectiveFreedom freedom = effective_freedom(shares);
  CombinedUncertainty result;
  result.u = std::sqrt(freedom.variance);
  result.expanded = expanded_of(shares, freedom, coverage);
  if (freedom.by_welch || !(result.u > 0.0)) {
    result.degrees_of_freedom = freedom.degrees_of_freedom;
    result.coverage_factor =
        student_t_factor(coverage, std::min(result.degrees_of_freedom, as_good_as_infinite));
  } else {
    result.coverage_factor = result.expanded / result.u;
    result.degrees_of_freedom = freedom_of_factor(result.coverage_factor, coverage);
  }
  return result;
}

double welch_degrees_of_freedom(const VarianceShares& shares) {
  return effective_freedom(shares).degrees_of_freedom;
}

CoverageFactors::Nodes CoverageFactors::nodes_of(double coverage) {
  if (!(coverage > 0.0 && coverage < 1.0)) {
    throw DomainError("a coverage probability must be between 0 and 1");
  }
  Nodes nodes;
  for (const double nu : {1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0, 30.0,
                          60.0, as_good_as_infinite}) {
    nodes.inverse.push_back(1.0 / nu);
    nodes.log_t.push_back(std::log(student_t_factor(coverage, nu)));
  }
  return nodes;
}

CoverageFactors::CoverageFactors(double coverage) {
  constexpr double usual = 0.95;
  static const auto usual_nodes = std::make_shared<const Nodes>(nodes_of(usual));
  nodes_ = coverage == usual ? usual_nodes : std::make_shared<const Nodes>(nodes_of(coverage));
}

double CoverageFactors::at(double degrees_of_freedom) const {
  if (std::isnan(degrees_of_freedom)) {
    return not_a_number;
  }
  const auto& [inverse, log_t] = *nodes_;
  const double x = std::clamp(1.0 / degrees_of_freedom, inverse.back(), inverse.front());
  const auto after =
      std::find_if(inverse.begin() + 1, inverse.end() - 1, [&](double node) { return node <= x; });
  const auto i = static_cast<std::size_t>(after - inverse.begin());
  const double share = (x - inverse[i]) / (inverse[i - 1] - inverse[i]);
  return std::exp(log_t[i] + share * (log_t[i - 1] - log_t[i]));
}

double CoverageFactors::expanded(const VarianceShares& shares) const {
  return half_width(shares, effective_freedom(shares), [&](double nu) { return at(nu); });
}

VarianceShares scatter_shares(const Calibration& calibration, const Eigen::RowVectorXd& gradient) {
  return LinearPropagation(calibration).scatter(gradient);
}

CombinedUncertainty propagate(const Calibration& calibration,
                              const Eigen::RowVectorXd& gradient,
                              VarianceShares* shares) {
  std::vector<double> by_source;
  VarianceShares inherited = LinearPropagation(calibration).all(gradient, by_source);
  CombinedUncertainty result = combine(inherited);
  result.by_source = std::move(by_source);
  if (shares != nullptr) {
    *shares = std::move(inherited);
  }
  return result;
}

Eigen::MatrixXd parameter_covariance(const Calibration& calibration) {
  if (!calibration.fit.statistics) {
    return {};
  }
  Eigen::MatrixXd sum = calibration.fit.statistics->covariance;
  if (calibration.fit.uncertainty) {
    for (const UncertaintySource& source : calibration.fit.uncertainty->sources) {
      if (source.covariance.size() > 0) {
        sum += source.covariance;
      }
    }
  }
  return sum;
}

bool counts_magnitude(const Calibration& calibration) {
  const bool matters = method_kind(calibration.fit.method).fits_sensitivity &&
                       !method_kind(calibration.fit.method).by_turns;
  return !matters || has_source(calibration, field_magnitude_source) ||
         has_source(calibration, "magnitude of ");
}

namespace {

// Returns the name of the reference for readings in an electrical unit, for example "the voltage
// reference" for mV and mV/V; empty for other units.
std::string reference_of_unit(std::string_view unit) {
  unit = unit.substr(0, unit.find('/'));
  for (const std::string_view prefix : {"n", "u", "\u00b5", "\u03bc", "m", "k", "M"}) {
    if (unit.starts_with(prefix) && unit.size() > prefix.size()) {
      unit.remove_prefix(prefix.size());
      break;
    }
  }
  return unit == "V"                                          ? "the voltage reference"
         : unit == "A"                                        ? "the current reference"
         : unit == "Ohm" || unit == "ohm" || unit == "\u03a9" ? "the resistance reference"
         : unit == "Hz"                                       ? "the frequency reference"
                                                              : "";
}

}  // namespace

std::vector<std::string> not_counted(const Calibration& calibration) {
  std::vector<std::string> all;
  if (!calibration.fit.statistics) {
    return all;
  }
  const bool on_table =
      method_kind(calibration.fit.method).by_pose &&
      (!calibration.provenance.positioner.empty() || calibration.sensor.field.in_table);
  if (on_table && !has_source(calibration, "positioner")) {
    all.emplace_back("the cube's face normals");
  }
  if (!counts_magnitude(calibration)) {
    all.push_back(field_kind(calibration.sensor.field.kind).vertical
                      ? "local gravity"
                      : "the magnitude of the reference field");
  }
  const std::string reference = reference_of_unit(calibration.sensor.instrument.unit);
  if (!reference.empty() && !has_source(calibration, reference_source)) {
    all.push_back(reference);
  }
  return all;
}

std::string not_counted_sentence(const Calibration& calibration) {
  const std::vector<std::string> missing = not_counted(calibration);
  return missing.empty() ? ""
                         : formatted("Not included in the uncertainties (no value given): {}.",
                                     joined(missing));
}

namespace {

std::string unit_of_parameter(const Calibration& calibration, std::string_view name) {
  const std::string& unit = calibration.sensor.instrument.unit;
  if (name.find(".sensitivity.") != std::string_view::npos) {
    return unit_per(unit, calibration.sensor.field.unit);
  }
  for (const AlsoResponse& also : calibration.sensor.also) {
    if (name.find("." + also.kind + ".") != std::string_view::npos) {
      return unit_per(unit, also.unit);
    }
  }
  return name.find(".scale.") != std::string_view::npos ? "1" : unit;
}

}  // namespace

Quantity Calibration::parameter(const std::string& name) const {
  Quantity quantity{.value = parameter_value(sensor, name),
                    .u = not_a_number,
                    .U = not_a_number,
                    .dof = not_a_number,
                    .unit = unit_of_parameter(*this, name)};
  for (const ParameterUncertainty& one : parameter_uncertainties(*this)) {
    if (one.name == name) {
      quantity.u = one.uncertainty.u;
      quantity.U = one.uncertainty.expanded;
      quantity.dof = one.uncertainty.degrees_of_freedom;
    }
  }
  return quantity;
}

namespace {

CombinedUncertainty uncertainty_of(const LinearPropagation& inheritance,
                                   const FitStatistics& statistics,
                                   Eigen::Index parameter) {
  constexpr double coverage = 0.95;
  std::vector<double> by_source;
  const VarianceShares all =
      inheritance.all(Eigen::RowVectorXd::Unit(statistics.covariance.rows(), parameter), by_source);
  CombinedUncertainty uncertainty;
  if (statistics.interval_95.size() <= parameter) {
    uncertainty = combine(all, coverage);
    uncertainty.by_source = std::move(by_source);
    return uncertainty;
  }
  // interval_95 from the fit is more accurate than an interval that combine() computes from `all`.
  uncertainty.u = std::sqrt(effective_freedom(all).variance);
  uncertainty.by_source = std::move(by_source);
  const double nu = statistics.interval_dof(parameter);
  const double scatter = statistics.interval_95(parameter) / student_t_factor(coverage, nu);
  const VarianceShares shares{
      .axes = {{.variance = scatter * scatter, .degrees_of_freedom = nu}},
      .components = {},
      .others = std::max(
          uncertainty.u * uncertainty.u - statistics.covariance(parameter, parameter), 0.0)};
  uncertainty.expanded = expanded_of(shares, effective_freedom(shares), coverage);
  uncertainty.coverage_factor = uncertainty.expanded / uncertainty.u;
  // If scatter is the only source, the coverage factor is Student's t for the degrees of freedom of
  // the scatter.
  constexpr double rounding = 1e-14;
  const bool is_scatter_alone = scatter > 0.0 && shares.others == 0.0 && nu < as_good_as_infinite &&
                                std::abs(uncertainty.u - scatter) <= rounding * scatter;
  uncertainty.degrees_of_freedom =
      is_scatter_alone ? nu : freedom_of_factor(uncertainty.coverage_factor, coverage);
  return uncertainty;
}

}  // namespace

std::vector<ParameterUncertainty> parameter_uncertainties(const Calibration& calibration) {
  std::vector<ParameterUncertainty> all;
  if (!calibration.fit.statistics) {
    return all;
  }
  const std::vector<std::string>& names = calibration.fit.statistics->parameter_names;
  if (calibration.fit.statistics->covariance.rows() != static_cast<Eigen::Index>(names.size())) {
    return all;
  }
  const LinearPropagation inheritance(calibration);
  all.reserve(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    all.push_back({.name = names[i],
                   .value = parameter_value(calibration.sensor, names[i]),
                   .uncertainty = uncertainty_of(inheritance, *calibration.fit.statistics,
                                                 static_cast<Eigen::Index>(i))});
  }
  return all;
}

bool states_uncertainty(const Calibration& calibration) {
  const std::vector<ParameterUncertainty> all = parameter_uncertainties(calibration);
  return !all.empty() && std::all_of(all.begin(), all.end(), [](const ParameterUncertainty& one) {
    return std::isfinite(one.uncertainty.expanded) && one.uncertainty.expanded > 0.0;
  });
}

std::string parameter_unit(const Calibration& calibration, const std::string& name) {
  const std::string& unit = calibration.sensor.instrument.unit;
  const bool is_bias = name.find(".bias") != std::string::npos;
  const std::size_t power = name.rfind(".d");
  if (power != std::string::npos) {
    return formatted("{} per {}", is_bias ? unit : std::string("1"), name.substr(power + 1));
  }
  return is_bias ? unit : unit_per(unit, calibration.sensor.field.unit);
}

Advice advice_to_halve(const CombinedUncertainty& uncertainty,
                       const std::vector<std::string>& sources,
                       int readings) {
  Advice advice;
  double all = 0.0;
  std::size_t largest = 0;
  for (std::size_t s = 0; s < uncertainty.by_source.size(); ++s) {
    all += uncertainty.by_source[s] * uncertainty.by_source[s];
    if (uncertainty.by_source[s] > uncertainty.by_source[largest]) {
      largest = s;
    }
  }
  if (!(all > 0.0)) {
    return advice;
  }
  const double own = uncertainty.by_source[largest] * uncertainty.by_source[largest];
  advice.source = sources[largest];
  advice.share = own / all;
  const double allowed = 0.25 * all - (all - own);
  if (!(allowed > 0.0)) {
    advice.text = formatted(
        "improving one source cannot halve the uncertainty: without the largest source ('{}'), the "
        "uncertainty is still {} % of its present value",
        advice.source, number_text(100.0 * std::sqrt((all - own) / all), 2));
    return advice;
  }
  const double factor = own / allowed;  // the required reduction of the variance
  if (advice.source == "fit") {
    advice.text = formatted(
        "the uncertainty halves with {} readings instead of {}, or if the noise is divided by {}",
        number_text(std::ceil(factor * readings)), readings, number_text(std::sqrt(factor), 3));
  } else if (advice.source == "reading") {
    advice.text = formatted(
        "the uncertainty halves if one reading is replaced by the mean of {} "
        "readings",
        number_text(std::ceil(factor)));
  } else {
    advice.text = formatted("the uncertainty halves if the uncertainty of '{}' is divided by {}",
                            advice.source, number_text(std::sqrt(factor), 3));
  }
  return advice;
}

}  // namespace axiscal
