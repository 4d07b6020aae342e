// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <vector>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/least_squares.hpp"
#include "calib/fit/src/causes/causes.hpp"
#include "calib/fit/temperature_fit.hpp"
#include "calib/record/parameter_names.hpp"
#include "calib/regression/factor.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr double same_above = 0.25;  // p-value above which the noise of the readings explains the
                                     // scatter of the soaks
constexpr double told_below = 0.01;  // a note is added if the p-value of all axes is smaller

// The powers of the mean temperatures of the soaks (a soak contains the readings at one temperature
// level), and an orthonormal basis of the directions perpendicular to these powers.
struct Soaks {
  Eigen::MatrixXd powers;   // L x (order + 1), for L soaks
  Eigen::MatrixXd across;   // L x q, orthonormal
  Eigen::MatrixXd of_unit;  // covariance of polynomial coefficients for deviations of variance 1
};

Soaks soaks_of(const ReadingSet& set) {
  const TemperatureTerms& terms = set.temperature;
  const auto count = static_cast<Eigen::Index>(temperature_count(set));
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(count);
  Eigen::VectorXd readings = Eigen::VectorXd::Zero(count);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const Eigen::Index soak = terms.soak[static_cast<std::size_t>(i)];
    mean(soak) += terms.d.row(i).mean();
    readings(soak) += 1.0;
  }
  mean = mean.cwiseQuotient(readings);
  Soaks soaks;
  soaks.powers = Eigen::MatrixXd::Ones(count, terms.order + 1);
  for (int j = 1; j <= terms.order; ++j) {
    soaks.powers.col(j) = soaks.powers.col(j - 1).cwiseProduct(mean);
  }
  soaks.across = orthogonal_complement(soaks.powers);
  soaks.of_unit = Factor(soaks.powers).covariance();
  return soaks;
}

// The deviations of the soaks' biases or scales from their polynomial in the temperature.
struct OffCurve {
  double mean_square = 0.0;  // mean square of a soak's deviation
  double variance = 0.0;     // variance of the deviations without the readings' noise
  double p_value = 1.0;      // probability of such deviations by chance
};

OffCurve off_curve(const Eigen::VectorXd& off, const Eigen::MatrixXd& covariance, double nu) {
  const auto q = static_cast<double>(off.size());
  const double f = off.dot(solve_symmetric(covariance, off).col(0)) / q;
  return {.mean_square = off.squaredNorm() / q,
          .variance = std::max(off.squaredNorm() - covariance.trace(), 0.0) / q,
          .p_value = f_upper_p(std::max(f, 1e-300), q, nu)};
}

// The significant scatter of the soaks, for one axis.
struct SoaksOfAxis {
  Eigen::Index axis = 0;
  OffCurve bias;
  OffCurve scale;  // deviations of the temperature scale, relative to the sensitivity
};

// Tests for each axis whether the soaks need their own biases and scales in addition to the
// polynomials (a test of nested models). If they do, the scatter of the L soaks about the
// polynomials becomes a component "soaks" of the covariance with L - order - 1 degrees of freedom
// (method.md, section 6).
void add_soak_scatter(const ReadingSet& set, Estimate& estimate) {
  const TemperatureTerms& terms = set.temperature;
  if (terms.order == 0 || terms.soak.empty() || set.robust || set.also_kinds.size() > 0 ||
      static_cast<Eigen::Index>(estimate.statistics.lack_of_fit.size()) != set.axis_count()) {
    return;
  }
  if (temperature_count(set) < terms.order + 2) {
    estimate.notes.push_back(
        {NoteCode::temperature,
         formatted("The polynomial passes through all {} temperature levels, so the intervals do "
                   "not include the scatter of the levels. Take readings at one more temperature",
                   temperature_count(set))});
    return;
  }
  const Soaks soaks = soaks_of(set);
  const Eigen::Index q = soaks.across.cols();
  const Eigen::Index p = set.column_count();
  const Eigen::Index m = set.axis_count();
  const Eigen::Index base = set.base_column_count();
  FitStatistics& statistics = estimate.statistics;
  std::vector<SoaksOfAxis> found;
  double least_p = 1.0;
  const Eigen::MatrixXd design = field_design(set, estimate.field);
  const Eigen::Index own = set.coefficient_count();
  Eigen::MatrixXd of_readings = statistics.covariance_of_readings();
  const Eigen::MatrixXd of_components = statistics.covariance - of_readings;
  for (Eigen::Index k = 0; k < m; ++k) {
    Eigen::MatrixXd columns(set.size(), p + 2 * q);
    columns.leftCols(p) = set.all_columns(design, k);
    const Eigen::RowVector3d S = estimate.response.sensitivity.row(k);
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      const auto across = soaks.across.row(terms.soak[static_cast<std::size_t>(i)]);
      columns.row(i).segment(p, q) = across;
      columns.row(i).tail(q) = S.dot(design.row(i).segment<3>(1)) * across;
    }
    const Eigen::VectorXd weights = set.weights.col(k);
    const auto readings = static_cast<double>((weights.array() > 0.0).count());
    const double nu = readings - static_cast<double>(columns.cols());
    if (!(nu >= 1.0) || !Factor(weights.cwiseSqrt().asDiagonal() * columns).has_full_rank()) {
      continue;
    }
    const LeastSquaresFit all = LeastSquaresDesign(columns, weights).fit(set.response.col(k));
    const LeastSquaresFit curves =
        LeastSquaresDesign(columns.leftCols(p), weights).fit(set.response.col(k));
    const double s2 = all.residual_sd * all.residual_sd;
    if (!(all.residual_sd > 2.0 * set.rounding(k))) {
      continue;
    }
    const double drop = curves.residual_sd * curves.residual_sd * curves.degrees_of_freedom -
                        s2 * all.degrees_of_freedom;
    const auto more = static_cast<double>(2 * q);
    const double f = std::max(drop, 0.0) / more / s2;
    LackOfFit& test = statistics.lack_of_fit[static_cast<std::size_t>(k)];
    if (!(test.pure_error_dof > 0.0)) {
      test = {.pure_error_sd = all.residual_sd,
              .pure_error_dof = nu,
              .lack_of_fit_dof = more,
              .f = f,
              .p_value = f_upper_p(std::max(f, 1e-300), more, nu)};
    }
    const OffCurve bias =
        off_curve(all.estimate.segment(p, q), all.covariance.block(p, p, q, q), nu);
    const OffCurve scale =
        off_curve(all.estimate.tail(q), all.covariance.bottomRightCorner(q, q), nu);
    const bool scatters = bias.p_value <= same_above || scale.p_value <= same_above;
    if (!scatters || !(bias.variance + scale.variance > 0.0)) {
      continue;
    }
    least_p = std::min({least_p, bias.p_value, scale.p_value});
    found.push_back({.axis = k,
                     .bias = bias.p_value <= same_above ? bias : OffCurve{},
                     .scale = scale.p_value <= same_above ? scale : OffCurve{}});
    // The scatter of the readings is now that of the fit with a bias and a scale for each soak.
    const double factor = s2 / std::pow(statistics.residual_sd(k), 2);
    statistics.residual_sd(k) = all.residual_sd;
    statistics.degrees_of_freedom(k) = nu;
    of_readings.middleRows(own * k, own) *= std::sqrt(factor);
    of_readings.middleCols(own * k, own) *= std::sqrt(factor);
  }
  if (found.empty()) {
    return;
  }
  statistics.covariance = of_readings + of_components;
  fill_intervals(statistics);
  put_intervals(statistics);
  // The component contains the part of each coefficient's variance that the scatter of the soaks
  // causes. The mean square of the soaks gives a second interval for each coefficient. If this
  // interval is longer, it replaces the one from the readings.
  ScatterComponent component{.name = "soaks",
                             .sd = Eigen::VectorXd::Zero(m),
                             .unit = {},
                             .covariance = Eigen::MatrixXd::Zero(statistics.covariance.rows(),
                                                                 statistics.covariance.cols()),
                             .degrees_of_freedom = static_cast<double>(q)};
  const double t = student_t_factor(0.95, component.degrees_of_freedom);
  const Eigen::Index orders = terms.order;
  for (const SoaksOfAxis& one : found) {
    Eigen::MatrixXd to_bias = Eigen::MatrixXd::Zero(own, orders + 1);
    Eigen::MatrixXd to_scale = to_bias;
    to_bias(0, 0) = 1.0;
    to_scale.block<3, 1>(1, 0) = estimate.response.sensitivity.row(one.axis).transpose();
    for (Eigen::Index j = 0; j < orders; ++j) {
      to_bias(base + j, 1 + j) = 1.0;
      to_scale(base + orders + j, 1 + j) = 1.0;
    }
    const Eigen::MatrixXd of_bias = to_bias * soaks.of_unit * to_bias.transpose();
    const Eigen::MatrixXd of_scale = to_scale * soaks.of_unit * to_scale.transpose();
    const Eigen::Index first = own * one.axis;
    component.sd(one.axis) = std::sqrt(one.bias.variance);
    component.covariance.block(first, first, own, own) =
        one.bias.variance * of_bias + one.scale.variance * of_scale;
    const Eigen::VectorXd whole =
        (one.bias.mean_square * of_bias.diagonal() + one.scale.mean_square * of_scale.diagonal());
    for (Eigen::Index j = 0; j < own; ++j) {
      statistics.interval_95(first + j) =
          std::max(statistics.interval_95(first + j), t * std::sqrt(whole(j)));
    }
  }
  statistics.covariance += component.covariance;
  for (Eigen::Index i = 0; i < statistics.covariance.rows(); ++i) {
    statistics.interval_dof(i) =
        freedom_of_factor(statistics.interval_95(i) / std::sqrt(statistics.covariance(i, i)), 0.95);
  }
  statistics.components.push_back(std::move(component));
  if (least_p * 2.0 * static_cast<double>(m) < told_below) {
    estimate.notes.push_back(
        {NoteCode::temperature,
         "The means of the temperature levels deviate from the polynomial by more than the noise "
         "of the readings explains. The intervals include this scatter of the levels"});
  }
}

CountedEstimate counted_soaks(const ScatterAnalysisInput& run, CountedEstimate so_far) {
  if (!run.is_transfer()) {
    add_soak_scatter(run.fitted.set(), so_far.estimate);
  }
  return so_far;
}

}  // namespace

Cause soaks_cause() {
  return {.name = "soaks", .counted = counted_soaks};
}

}  // namespace axiscal
