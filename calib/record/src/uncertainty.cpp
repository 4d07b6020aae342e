// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/uncertainty.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"

namespace axiscal {
namespace {

// The positions of an axis's parameters.
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

double variance(const Eigen::RowVectorXd& gradient, const Eigen::MatrixXd& covariance) {
  return gradient.dot(covariance * gradient.transpose());
}

// The part of the fit's variance that is of each axis's scatter.
Eigen::VectorXd fit_shares(const Calibration& calibration,
                           const Eigen::RowVectorXd& gradient,
                           const Eigen::MatrixXd& covariance) {
  const Eigen::Index m = calibration.instrument.axis_count();
  Eigen::VectorXd shares(m);
  for (Eigen::Index k = 0; k < m; ++k) {
    const std::vector<Eigen::Index> own = places_of_axis(
        *calibration.statistics, calibration.instrument.axes[static_cast<std::size_t>(k)]);
    shares(k) = variance(gradient(own), covariance(own, own));
  }
  // `joint`: what the axes share through the field's direction goes with each in proportion.
  const double all = variance(gradient, covariance);
  const double sum = shares.sum();
  return sum > 0.0 ? Eigen::VectorXd(shares * (all / sum)) : shares;
}

}  // namespace

CombinedUncertainty combine(const VarianceShares& shares,
                            const Eigen::VectorXd& degrees_of_freedom) {
  CombinedUncertainty result;
  const double all = shares.by_axis.sum() + shares.others;
  result.u = std::sqrt(std::max(all, 0.0));
  double sum = 0.0;
  for (Eigen::Index k = 0; k < shares.by_axis.size(); ++k) {
    if (shares.by_axis(k) != 0.0) {
      sum += shares.by_axis(k) * shares.by_axis(k) / degrees_of_freedom(k);
    }
  }
  result.degrees_of_freedom = sum > 0.0    ? all * all / sum
                              : sum == 0.0 ? std::numeric_limits<double>::infinity()
                                           : not_a_number;
  constexpr double as_good_as_infinite = 1e6;
  result.coverage_factor =
      student_t_factor(0.95, std::min(result.degrees_of_freedom, as_good_as_infinite));
  result.expanded = result.coverage_factor * result.u;
  return result;
}

CombinedUncertainty propagate(const Calibration& calibration,
                              const Eigen::RowVectorXd& gradient,
                              VarianceShares* shares) {
  const FitStatistics& statistics = *calibration.statistics;
  VarianceShares own{.by_axis = Eigen::VectorXd::Zero(calibration.instrument.axis_count())};
  std::vector<double> by_source;
  if (!calibration.uncertainty) {
    own.by_axis = fit_shares(calibration, gradient, statistics.covariance);
    by_source.push_back(std::sqrt(std::max(own.by_axis.sum(), 0.0)));
  } else {
    for (const UncertaintySource& source : calibration.uncertainty->sources) {
      const bool from_scatter = source.type == "A";
      const Eigen::MatrixXd& covariance = from_scatter ? statistics.covariance : source.covariance;
      const double part = variance(gradient, covariance);
      by_source.push_back(std::sqrt(std::max(part, 0.0)));
      if (from_scatter) {
        own.by_axis += fit_shares(calibration, gradient, covariance);
      } else {
        own.others += part;
      }
    }
  }
  if (shares != nullptr) {
    shares->by_axis =
        shares->by_axis.size() == 0 ? own.by_axis : Eigen::VectorXd(shares->by_axis + own.by_axis);
    shares->others += own.others;
  }
  CombinedUncertainty result = combine(own, statistics.degrees_of_freedom);
  result.by_source = std::move(by_source);
  return result;
}

Eigen::MatrixXd parameter_covariance(const Calibration& calibration) {
  if (!calibration.statistics) {
    return {};
  }
  Eigen::MatrixXd sum = calibration.statistics->covariance;
  if (calibration.uncertainty) {
    for (const UncertaintySource& source : calibration.uncertainty->sources) {
      if (source.covariance.size() > 0) {
        sum += source.covariance;
      }
    }
  }
  return sum;
}

double parameter_value(const Calibration& calibration, const std::string& name) {
  for (std::size_t k = 0; k < calibration.instrument.axes.size(); ++k) {
    const std::string& axis = calibration.instrument.axes[k];
    if (!name.starts_with(axis + ".")) {
      continue;
    }
    const auto row = static_cast<Eigen::Index>(k);
    const std::string what = name.substr(axis.size() + 1);
    if (what == "bias") {
      return calibration.response.bias(row);
    }
    const std::size_t component = std::string("xyz").find(what.back());
    if (what.starts_with("sensitivity.") && what.size() == 13 && component != std::string::npos) {
      return calibration.response.sensitivity(row, static_cast<Eigen::Index>(component));
    }
    for (const AlsoResponse& also : calibration.also) {
      if (what.starts_with(also.kind + ".") && component != std::string::npos) {
        return also.sensitivity(row, static_cast<Eigen::Index>(component));
      }
    }
    if (calibration.temperature && (what.starts_with("bias.d") || what.starts_with("scale.d"))) {
      const std::string digits = what.substr(what.find(".d") + 2);
      const std::optional<int> power = digits.empty() ? std::optional(1) : parse_integer(digits);
      const Eigen::MatrixXd& terms =
          what.front() == 'b' ? calibration.temperature->bias : calibration.temperature->scale;
      if (power && *power >= 1 && *power <= terms.cols()) {
        return terms(row, *power - 1);
      }
    }
  }
  throw DomainError(formatted("'{}' is no parameter of this record", name));
}

std::vector<ParameterUncertainty> parameter_uncertainties(const Calibration& calibration) {
  std::vector<ParameterUncertainty> all;
  if (!calibration.statistics) {
    return all;
  }
  const std::vector<std::string>& names = calibration.statistics->parameter_names;
  if (calibration.statistics->covariance.rows() != static_cast<Eigen::Index>(names.size())) {
    return all;
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    const Eigen::RowVectorXd gradient = Eigen::RowVectorXd::Unit(
        static_cast<Eigen::Index>(names.size()), static_cast<Eigen::Index>(i));
    all.push_back({.name = names[i],
                   .value = parameter_value(calibration, names[i]),
                   .uncertainty = propagate(calibration, gradient)});
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
  const std::string& unit = calibration.instrument.unit;
  const bool is_bias = name.find(".bias") != std::string::npos;
  const std::size_t power = name.rfind(".d");
  if (power != std::string::npos) {
    return formatted("{} per {}", is_bias ? unit : std::string("1"), name.substr(power + 1));
  }
  return is_bias ? unit : unit_per(unit, calibration.field.unit);
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
    advice.text = formatted("no single source halves it: without '{}' it is still {} %",
                            advice.source, number_text(100.0 * std::sqrt((all - own) / all), 2));
    return advice;
  }
  const double factor = own / allowed;  // what the variance is multiplied with
  if (advice.source == "fit") {
    advice.text = formatted(
        "it halves with {} readings instead of {}, or a reading's noise divided by {}",
        number_text(std::ceil(factor * readings)), readings, number_text(std::sqrt(factor), 3));
  } else if (advice.source == "reading") {
    advice.text = formatted("it halves with the mean of {} readings instead of one",
                            number_text(std::ceil(factor)));
  } else {
    advice.text = formatted("it halves when the uncertainty of '{}' is divided by {}",
                            advice.source, number_text(std::sqrt(factor), 3));
  }
  return advice;
}

}  // namespace axiscal
