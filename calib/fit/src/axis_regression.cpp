// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/src/axis_regression.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/robust.hpp"
#include "axiscal/calib/settings.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/instruments/settings.hpp"
#include "calib/fit/layings.hpp"
#include "calib/fit/src/groups.hpp"
#include "calib/regression/reweighting.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Fits one axis robustly: repeats the fit with bisquare weights until the weights converge, then
// computes the covariance of the estimate.
void make_robust(AxisRegression& axis,
                 const LeastSquaresDesign& plain,
                 const Eigen::MatrixXd& design,
                 const Eigen::VectorXd& response,
                 const DesignNames& names,
                 double rounding) {
  const auto p = static_cast<double>(design.cols());
  require_robust_freedom(axis.fit.degrees_of_freedom);
  const Eigen::VectorXd root = axis.weights.cwiseSqrt();
  BisquareWeights bisquare;
  axis.robust_weights = reweight_until_converged(
      response.size(), 1,
      [&] {
        bisquare =
            bisquare_weights(root.cwiseProduct(axis.fit.residuals), plain.leverage(), p, rounding);
        return bisquare.weights;
      },
      [&](const Eigen::MatrixXd& robust) {
        axis.fit = LeastSquaresDesign(
                       FactoredDesign(design, axis.weights.cwiseProduct(robust), names), design)
                       .fit(response);
      });
  axis.fit.degrees_of_freedom = static_cast<double>(plain.observations()) - p;
  axis.fit.residual_sd = bisquare.scale * std::sqrt(bisquare.variance_factor);
  axis.fit.covariance = axis.fit.residual_sd * axis.fit.residual_sd * plain.unscaled_covariance();
  axis.fit.leverage = plain.leverage();
  // Readings with robust weight 0 need diagnostics too, so all residuals are divided by the robust
  // standard deviation.
  const Eigen::VectorXd weighted = root.cwiseProduct(axis.fit.residuals);
  ResidualDiagnostics diagnostics =
      scale_residuals(weighted, plain.leverage(), axis.fit.residual_sd, p);
  axis.fit.studentized = std::move(diagnostics.studentized);
  axis.fit.cooks_distance = std::move(diagnostics.cooks_distance);
  axis.fit.r_squared = r_squared_about_mean(response, axis.weights, weighted);
}

}  // namespace

double r_squared_about_mean(const Eigen::VectorXd& response,
                            const Eigen::VectorXd& weights,
                            const Eigen::VectorXd& weighted_residuals) {
  const double mean = weights.dot(response) / weights.sum();
  const double total = (weights.array() * (response.array() - mean).square()).sum();
  return 1.0 - weighted_residuals.squaredNorm() / total;
}

std::vector<AxisRegression> regress(const AxesAlike& axes) {
  const LeastSquaresDesign design(axes.factored, axes.design);
  const Eigen::VectorXd inflation =
      variance_inflation(axes.design, axes.weights, design.unscaled_covariance());
  const double condition_number = design.condition_number();
  std::vector<AxisRegression> all;
  all.reserve(static_cast<std::size_t>(axes.responses.cols()));
  for (Eigen::Index column = 0; column < axes.responses.cols(); ++column) {
    AxisRegression& axis =
        all.emplace_back(AxisRegression{.fit = design.fit(axes.responses.col(column)),
                                        .variance_inflation = inflation,
                                        .condition_number = condition_number,
                                        .weights = axes.weights,
                                        .robust_weights = {}});
    if (axes.set.robust) {
      const Eigen::Index k = axes.first + column;
      make_robust(
          axis, design, axes.design, axes.responses.col(column), [&] { return axes.names(k); },
          axes.set.rounding(k));
    }
  }
  return all;
}

void require_robust_freedom(double degrees_of_freedom) {
  constexpr double fewest = 6.0;
  if (!(degrees_of_freedom >= fewest)) {
    throw RefusedError(
        formatted("robust regression cannot detect a wrong reading with {} degrees of freedom; at "
                  "least {} are required: add readings, use the method 'joint' instead of "
                  "'paired', or fit without robust weights",
                  number_text(degrees_of_freedom, 2), number_text(fewest)),
        {settings::method});
  }
}

namespace {

// Sums over the readings of one group, for example the consecutive readings in one pose.
struct ReadingSums {
  double weight = 0.0;
  double residual = 0.0;  // sum of weight times residual
  double first = 0.0;     // residual of the first reading, not weighted
  int count = 0;
};

std::vector<ReadingSums> sums_by_number(const std::vector<int>& numbers,
                                        const Eigen::VectorXd& weights,
                                        const Eigen::VectorXd& weighted_residuals) {
  std::vector<ReadingSums> all(
      numbers.empty()
          ? 0
          : static_cast<std::size_t>(1 + *std::max_element(numbers.begin(), numbers.end())));
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    if (weights(row) == 0.0) {
      continue;
    }
    ReadingSums& sums = all[static_cast<std::size_t>(numbers[i])];
    const double root = std::sqrt(weights(row));
    sums.first = sums.count == 0 ? weighted_residuals(row) / root : sums.first;
    sums.weight += weights(row);
    sums.residual += root * weighted_residuals(row);
    ++sums.count;
  }
  return all;
}

// The weighted sum of the squared mean residuals of groups, and the number of groups.
struct SquaresOfMeans {
  double squares = 0.0;
  double count = 0.0;
};

SquaresOfMeans squares_of_means(const std::vector<ReadingSums>& all) {
  SquaresOfMeans means;
  for (const ReadingSums& sums : all) {
    means.squares += sums.weight > 0.0 ? sums.residual * sums.residual / sums.weight : 0.0;
    means.count += sums.count > 0 ? 1.0 : 0.0;
  }
  return means;
}

}  // namespace

LackOfFit test_lack_of_fit(const RegressionRows& rows,
                           const Eigen::VectorXd& given_weights,
                           const Eigen::VectorXd& all_residuals,
                           double degrees_of_freedom,
                           double rounding,
                           Eigen::Index effects,
                           const Eigen::VectorXd& robust_weights) {
  Eigen::VectorXd weights = given_weights;
  Eigen::VectorXd weighted_residuals = all_residuals;
  for (Eigen::Index i = 0; i < robust_weights.size(); ++i) {
    if (robust_weights(i) == 0.0 && weights(i) > 0.0) {
      weights(i) = 0.0;
      weighted_residuals(i) = 0.0;
      degrees_of_freedom -= 1.0;
    }
  }
  const std::vector<ReadingSums> groups = sums_by_number(rows.group, weights, weighted_residuals);
  bool scatters = false;
  for (std::size_t i = 0; i < rows.group.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double first = groups[static_cast<std::size_t>(rows.group[i])].first;
    scatters = scatters ||
               (weights(row) > 0.0 &&
                std::abs(weighted_residuals(row) / std::sqrt(weights(row)) - first) > rounding);
  }
  const auto readings = static_cast<double>((weights.array() > 0.0).count());
  const SquaresOfMeans of_groups = squares_of_means(groups);
  const SquaresOfMeans of_layings =
      rows.laying.empty()
          ? SquaresOfMeans{.squares = weighted_residuals.squaredNorm(), .count = readings}
          : squares_of_means(sums_by_number(rows.laying, weights, weighted_residuals));
  const double between = of_groups.squares;
  const auto taken = static_cast<double>(effects);
  const double pure_error_dof = of_layings.count - of_groups.count - taken;
  const double lack_of_fit_dof = degrees_of_freedom - (readings - of_groups.count - taken);
  LackOfFit result{.pure_error_sd = not_a_number,
                   .pure_error_dof = pure_error_dof,
                   .lack_of_fit_dof = lack_of_fit_dof,
                   .f = not_a_number,
                   .p_value = not_a_number};
  if (!(pure_error_dof > 0.0)) {
    return result;
  }
  // If the readings within each group are equal, the pure error is 0.
  const double pure_error =
      scatters ? std::max(of_layings.squares - between, 0.0) / pure_error_dof : 0.0;
  result.pure_error_sd = std::sqrt(pure_error);
  if (!(lack_of_fit_dof > 0.0)) {
    return result;
  }
  result.f = (between / lack_of_fit_dof) / pure_error;
  const bool only_rounding = between / lack_of_fit_dof < rounding * rounding;
  result.p_value = only_rounding ? 1.0 : f_upper_p(result.f, lack_of_fit_dof, pure_error_dof);
  return result;
}

FitStatistics blank_statistics(const ReadingSet& set, RegressionRows& rows) {
  const Eigen::Index m = set.axis_count();
  FitStatistics statistics;
  statistics.observations = static_cast<int>(set.size());
  statistics.degrees_of_freedom.resize(m);
  statistics.residual_sd.resize(m);
  statistics.r_squared.resize(m);
  statistics.variance_inflation.resize(m, 3);
  const Eigen::Index p = set.coefficient_count();
  statistics.covariance = Eigen::MatrixXd::Zero(p * m, p * m);
  for (Eigen::Index k = 0; k < m && set.has_excluded_readings(); ++k) {
    statistics.observations_per_axis.push_back(
        static_cast<int>((set.weights.col(k).array() > 0.0).count()));
  }
  statistics.lack_of_fit.reserve(static_cast<std::size_t>(m));
  statistics.rows = std::move(rows.rows);
  const auto r = static_cast<Eigen::Index>(statistics.rows.size());
  statistics.leverage.resize(r, m);
  statistics.studentized.resize(r, m);
  statistics.cooks_distance.resize(r, m);
  if (set.robust) {
    statistics.robust_weight.resize(r, m);
  }
  return statistics;
}

void put_diagnostics(FitStatistics& statistics,
                     Eigen::Index k,
                     const Eigen::VectorXd& leverage,
                     const ResidualDiagnostics& diagnostics,
                     const Eigen::VectorXd& robust_weights) {
  statistics.leverage.col(k) = leverage;
  // A row that the axis does not use has no diagnostics.
  const auto has_part = leverage.array() > 0.0;
  statistics.studentized.col(k) = has_part.select(diagnostics.studentized, not_a_number);
  statistics.cooks_distance.col(k) = has_part.select(diagnostics.cooks_distance, not_a_number);
  if (robust_weights.size() > 0) {
    statistics.robust_weight.col(k) = robust_weights;
  }
}

void require_response(const ReadingSet& set) {
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const Eigen::ArrayXd response = set.response.col(k);
    const auto used = set.weights.col(k).array() > 0.0;
    const double highest =
        used.select(response, -std::numeric_limits<double>::infinity()).maxCoeff();
    const double lowest = used.select(response, std::numeric_limits<double>::infinity()).minCoeff();
    if (highest - lowest <= set.rounding(k)) {
      throw RefusedError(formatted("axis {} does not respond to the field: all its readings are "
                                   "equal to {}; check its wiring and its column, or leave the "
                                   "axis out",
                                   set.axes[static_cast<std::size_t>(k)], number_text(highest)),
                         {settings::axes});
    }
  }
}

Estimate summarize(const ReadingSet& set,
                   const std::vector<AxisRegression>& axes,
                   RegressionRows rows) {
  const auto m = static_cast<Eigen::Index>(axes.size());
  Estimate estimate;
  estimate.statistics = blank_statistics(set, rows);
  FitStatistics& statistics = estimate.statistics;
  const Eigen::Index p = set.coefficient_count();
  for (Eigen::Index k = 0; k < m; ++k) {
    const AxisRegression& axis = axes[static_cast<std::size_t>(k)];
    const LeastSquaresFit& fit = axis.fit;
    set_coefficients(set, k, fit.estimate, estimate);
    statistics.degrees_of_freedom(k) = fit.degrees_of_freedom;
    statistics.residual_sd(k) = fit.residual_sd;
    statistics.r_squared(k) = fit.r_squared;
    statistics.variance_inflation.row(k) = axis.variance_inflation.segment<3>(1);
    statistics.condition_number = std::max(statistics.condition_number, axis.condition_number);
    statistics.covariance.block(p * k, p * k, p, p) = fit.covariance.topLeftCorner(p, p);
    put_diagnostics(statistics, k, fit.leverage,
                    {.studentized = fit.studentized, .cooks_distance = fit.cooks_distance},
                    axis.robust_weights);
    const Eigen::VectorXd weighted = axis.weights.cwiseSqrt().cwiseProduct(fit.residuals);
    statistics.lack_of_fit.push_back(
        test_lack_of_fit(rows, axis.weights, weighted, fit.degrees_of_freedom, set.rounding(k),
                         set.effects.columns.cols(), axis.robust_weights));
  }
  return estimate;
}

std::vector<int> groups_of_readings(const ReadingSet& set) {
  using Key = std::tuple<std::optional<DesignPoint>, int, std::vector<double>, FieldLevel>;
  const bool continuous = set.temperature.order > 0 && set.temperature.soak.empty();
  const auto key_of = [&](std::size_t i) {
    const Reading& reading = set.readings[i];
    // For method `magnitude`, readings may have neither point nor field; their groups are not used.
    const bool has_field = set.rotation_sensor_from_table.empty() && reading.field_in_sensor;
    // If the temperature changes continuously, no two readings are repeats.
    const int soak = continuous ? static_cast<int>(i) : set.soak_of(i);
    Key key{has_field ? std::nullopt : reading.point, soak, {}, reading.level};
    if (has_field) {
      std::get<2>(key).assign(reading.field_in_sensor->begin(), reading.field_in_sensor->end());
    }
    return key;
  };
  return Groups(set.readings.size(), key_of).numbers();
}

RegressionRows rows_of_readings(const ReadingSet& set) {
  RegressionRows rows{.rows = {}, .group = groups_of_readings(set), .laying = {}};
  const std::vector<std::size_t> firsts = laying_starts(set);
  std::size_t laying = 0;
  for (std::size_t i = 0; i < set.readings.size() && firsts.size() < set.readings.size(); ++i) {
    laying += laying < firsts.size() && firsts[laying] == i ? 1U : 0U;
    rows.laying.push_back(static_cast<int>(laying) - 1);
  }
  rows.rows.reserve(set.readings.size());
  for (const Reading& reading : set.readings) {
    rows.rows.push_back({.runs = {reading.run}, .point = reading.point, .block = reading.block});
  }
  return rows;
}

}  // namespace axiscal
