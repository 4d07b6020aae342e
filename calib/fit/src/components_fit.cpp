// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/src/components_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/rotation.hpp"
#include "calib/record/parameter_names.hpp"

namespace axiscal {
namespace {

// Returns the starting value of each axis's standard deviation. It is that of the fit's residuals.
// If they are 0, it is 1e-9 of the axis's response to the field.
Eigen::VectorXd first_scatter(const Estimate& estimate) {
  Eigen::VectorXd sigma = estimate.statistics.residual_sd;
  for (Eigen::Index k = 0; k < sigma.size(); ++k) {
    if (!(sigma(k) > 0.0)) {
      sigma(k) = 1e-9 * estimate.response.sensitivity.row(k).norm() * estimate.field.magnitude();
    }
  }
  return sigma;
}

}  // namespace

ComponentsFit::ComponentsFit(const MeanReadings& layings,
                             const SolvedReadings& run,
                             const std::vector<InputQuantity>& inputs,
                             bool seats,
                             const Estimate& start)
    : set_(layings.set()),
      layings_(layings),
      run_(run),
      inputs_(inputs),
      seats_(seats),
      field_(start.field) {
  const Eigen::Index m = set_.axis_count();
  variances_.resize(m + (seats ? 1 : 0));
  variances_.head(m) = first_scatter(start).cwiseAbs2();
  const ScatterComponent* const found = start.statistics.find_component("seats");
  if (found != nullptr && seats) {
    variances_(m) = found->sd(0) * found->sd(0);
  } else if (seats) {
    // The starting value is the variance of a rotation that causes half the variance of the
    // noise in the readings.
    const Eigen::ArrayXd turn =
        start.response.sensitivity.rowwise().norm().array() * field_.magnitude();
    variances_(m) = 0.5 * (variances_.head(m).array() / turn.square()).mean();
  }
  smallest_ = Eigen::VectorXd::Zero(variances_.size());
  for (Eigen::Index k = 0; k < m; ++k) {
    smallest_(k) = std::pow(set_.rounding(k), 2);
  }
}

bool ComponentsFit::may_see_seats() {
  constexpr double clearly_less = 0.5;
  const Eigen::Index m = set_.axis_count();
  Eigen::VectorXd without = variances_;
  without(m) = 0.0;
  return component_score(problem(about_field()), without, m).value_or(clearly_less) >= clearly_less;
}

bool ComponentsFit::solve(double seats_at_least) {
  const Eigen::Index m = set_.axis_count();
  constexpr int most_rounds = 30;
  constexpr double still = 1e-9;
  // The first rounds need only approximate variances, because the next round changes them.
  double still_in_round = 1e-3;
  for (int round = 0; round < most_rounds; ++round) {
    const Fit run = about_field();
    fit_ = fit_variance_components(problem(run), start(), still_in_round);
    if (!fit_) {
      return false;
    }
    const Eigen::VectorXd before = variances_;
    variances_ = fit_->theta;
    if (seats_at_least > 0.0 && !sees_seats(seats_at_least)) {
      return false;
    }
    const Eigen::VectorXd solution = run.unknowns() + fit_->estimate.head(run.column_count());
    take_coefficients(solution);
    const Eigen::VectorXd step = solution.tail(run.shared());
    if (run.shared() > 0) {
      field_ = field_.moved(field_.tangents(), step);
    }
    const double change =
        ((variances_ - before).array() / before.array().max(smallest_.array() + 1e-300))
            .abs()
            .maxCoeff();
    if (still_in_round <= still && change < still && step.lpNorm<Eigen::Infinity>() < still) {
      break;
    }
    still_in_round = std::max(1e-3 * still_in_round, still);
  }
  for (Eigen::Index k = 0; k < m; ++k) {
    if (!(degrees_of_freedom(k) > 0.5)) {
      return false;
    }
  }
  return true;
}

bool ComponentsFit::exceeds_scatter_within(const MeanReadings& layings) const {
  FisherSum axes;
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    const double within = layings.squares(k) / layings.degrees_of_freedom(k);
    axes.add(
        f_upper_p(variances_(k) / within, degrees_of_freedom(k), layings.degrees_of_freedom(k)));
  }
  constexpr double clearly_larger = 0.02;
  return axes.p_value() < clearly_larger;
}

std::optional<CurvatureTest> ComponentsFit::curvature() {
  const Fit run = about_field();
  CurvatureFTest test(layings_, !run_.known_field(), run.column_count(), variances_);
  const double F = field_.magnitude();
  if (!seats_) {
    const IndependentCurvature axes = bent_axes(run);
    return test.by([&](bool bent) { return axes.fit(test.variances(), bent); }, F);
  }
  VarianceProblem straight = problem(run);
  VarianceProblem bent = straight;
  bent.W.resize(straight.W.rows(), straight.W.cols() + run.axes());
  bent.W << with_squares(run), straight.W;
  return test.by([&](bool with) { return fit_problem(with ? bent : straight, test.variances()); },
                 F);
}

double ComponentsFit::seat_sd() const {
  return seats_ ? std::sqrt(variances_(set_.axis_count())) : 0.0;
}

bool ComponentsFit::sees_seats(double degrees_of_freedom) const {
  return seat_sd() > 0.0 &&
         fit_->component_degrees_of_freedom(set_.axis_count()) > degrees_of_freedom;
}

void ComponentsFit::put(Estimate& estimate) const {
  const Eigen::Index m = set_.axis_count();
  FitStatistics& statistics = estimate.statistics;
  estimate.field = field_;
  statistics.residual_sd = variances_.head(m).cwiseSqrt();
  for (Eigen::Index k = 0; k < m; ++k) {
    statistics.degrees_of_freedom(k) = degrees_of_freedom(k);
    set_coefficients(set_, k, coefficients_.col(k), estimate);
  }
  const std::vector<Eigen::Index> places = set_.coefficient_column_indices();
  statistics.covariance = fit_->scatter()(places, places);
  if (!seats_) {
    return;
  }
  const Eigen::MatrixXd of_seats =
      variances_(m) * fit_->unit_shares[static_cast<std::size_t>(m)](places, places);
  statistics.components.push_back({.name = "seats",
                                   .sd = Eigen::VectorXd::Constant(1, seat_sd()),
                                   .unit = "rad",
                                   .covariance = of_seats,
                                   .degrees_of_freedom = fit_->component_degrees_of_freedom(m)});
  statistics.interval_dof.resize(statistics.covariance.rows());
  for (std::size_t i = 0; i < places.size(); ++i) {
    statistics.interval_dof(static_cast<Eigen::Index>(i)) = fit_->degrees_of_freedom(places[i]);
  }
  put_intervals(statistics);
}

void ComponentsFit::put_errors_of(const MeanReadings& layings, Estimate& estimate) const {
  const Eigen::Index m = set_.axis_count();
  FitStatistics& statistics = estimate.statistics;
  Eigen::VectorXd sd(m);
  Eigen::VectorXd share(statistics.covariance.rows());  // roots of the shares of the variances
  double freedom = std::numeric_limits<double>::infinity();
  for (Eigen::Index k = 0; k < m; ++k) {
    const double within = layings.squares(k) / layings.degrees_of_freedom(k);
    const double excess = std::max(variances_(k) - within, 0.0);
    sd(k) = std::sqrt(excess / set_.weights.col(k).mean());
    const Eigen::Index p = share.size() / m;
    share.segment(p * k, p).setConstant(std::sqrt(excess / variances_(k)));
    freedom = std::min(freedom, degrees_of_freedom(k));
  }
  const Eigen::MatrixXd of_noise =
      statistics.covariance - statistics.find_component("seats")->covariance;
  statistics.components.push_back({.name = "layings",
                                   .sd = std::move(sd),
                                   .unit = {},
                                   .covariance = share.asDiagonal() * of_noise * share.asDiagonal(),
                                   .degrees_of_freedom = freedom});
  estimate.notes.push_back({NoteCode::correlation, note_of_layings});
}

Eigen::MatrixXd ComponentsFit::shared_parts(const ReadingSet& set,
                                            const std::vector<InputQuantity>& inputs) const {
  const Eigen::Index m = set.axis_count();
  Eigen::MatrixXd parts = Eigen::MatrixXd::Zero(set.size(), m);
  const Eigen::VectorXd predicted = fit_->estimate.tail(errors());
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    Eigen::Vector3d field = Eigen::Vector3d::Zero();
    Eigen::Index first = 0;
    for (const InputQuantity& input : inputs) {
      field += input.change(i, 0, field_) * predicted.segment(first, input.parts);
      first += input.parts;
    }
    for (Eigen::Index k = 0; k < m; ++k) {
      parts(i, k) = set.scale(i, k) * coefficients_.col(k).segment<3>(1).dot(field);
    }
  }
  return parts;
}

std::vector<Eigen::MatrixXd> ComponentsFit::shares() const {
  std::vector<Eigen::MatrixXd> all;
  const Eigen::MatrixXd to_all = fit_->covariance(set_.coefficient_column_indices(), Eigen::all);
  Eigen::Index first = fit_->covariance.cols() - errors();
  for (const InputQuantity& input : inputs_) {
    const Eigen::MatrixXd to_input = to_all.middleCols(first, input.parts);
    all.emplace_back(to_input * to_input.transpose());
    first += input.parts;
  }
  return all;
}

Fit ComponentsFit::about_field() {
  return {run_, field_, Eigen::VectorXd::Ones(set_.axis_count())};
}

void ComponentsFit::take_coefficients(const Eigen::VectorXd& solution) {
  const Eigen::Index p = set_.column_count();
  const Eigen::Index m = set_.axis_count();
  coefficients_ = solution.head(p * m).reshaped(p, m);
}

std::optional<CurvatureFit> ComponentsFit::fit_problem(const VarianceProblem& problem,
                                                       const Eigen::VectorXd& variances) const {
  const Eigen::Index m = set_.axis_count();
  const std::optional<WeightedFit> fit = fit_at_variances(problem, variances);
  if (!fit) {
    return std::nullopt;
  }
  CurvatureFit bend{.estimate = fit->estimate.head(m),
                    .squares = fit->squares,
                    .squares_of_axis = Eigen::VectorXd::Zero(m)};
  const Eigen::VectorXd left = problem.y - problem.W * fit->estimate;
  for (Eigen::Index row = 0; row < left.size(); ++row) {
    bend.squares_of_axis(row % m) += left(row) * left(row);
  }
  return bend;
}

IndependentCurvature ComponentsFit::bent_axes(const Fit& run) const {
  const Eigen::MatrixXd of_errors = input_error_jacobian(inputs_, run, field_);
  IndependentCurvature axes(errors());
  for (Eigen::Index k = 0; k < run.axes(); ++k) {
    const auto rows = run.rows_of_axis(k);
    Eigen::MatrixXd columns(run.readings(), run.shared() + errors() + 1);
    columns << run.shared_columns_of_axis(k), of_errors(rows, Eigen::all), squares_of(run, k);
    axes.add(run.orthogonal_to_own_columns(k, columns), Eigen::VectorXd(run.residuals()(rows)),
             columns.colwise().squaredNorm().transpose());
  }
  return axes;
}

double ComponentsFit::degrees_of_freedom(Eigen::Index axis) const {
  return fit_->information(axis, axis) * variances_(axis) * variances_(axis);
}

Eigen::VectorXd ComponentsFit::squares_of(const Fit& run, Eigen::Index k) const {
  const Eigen::VectorXd met = run.field_met(k) * run.sensitivity(k).normalized().transpose();
  return set_.weights.col(k).cwiseSqrt().cwiseProduct(met.cwiseAbs2());
}

Eigen::MatrixXd ComponentsFit::with_squares(const Fit& run) const {
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(run.row_count(), run.axes());
  for (Eigen::Index k = 0; k < run.axes(); ++k) {
    columns(run.rows_of_axis(k), k) = squares_of(run, k);
  }
  return columns;
}

Eigen::Index ComponentsFit::errors() const {
  return std::accumulate(
      inputs_.begin(), inputs_.end(), Eigen::Index{0},
      [](Eigen::Index sum, const InputQuantity& one) { return sum + one.parts; });
}

Eigen::VectorXd ComponentsFit::start() const {
  Eigen::VectorXd from = variances_;
  const Eigen::Index m = set_.axis_count();
  if (seats_ && !(from(m) > 0.0)) {
    from(m) =
        1e-4 * from.head(m).mean() /
        std::pow(coefficients_.middleRows<3>(1).colwise().norm().mean() * field_.magnitude(), 2);
  }
  return from;
}

VarianceProblem ComponentsFit::problem(const Fit& run) const {
  const Eigen::Index m = run.axes();
  const Eigen::Index fitted = run.column_count();
  VarianceProblem problem{.rows = m,
                          .W = Eigen::MatrixXd(run.row_count(), fitted + errors()),
                          .y = run.residuals(),
                          .prior = errors(),
                          .pure_squares = Eigen::VectorXd::Zero(variances_.size()),
                          .pure_degrees_of_freedom = Eigen::VectorXd::Zero(variances_.size()),
                          .smallest = smallest_};
  problem.W << run.columns(), input_error_jacobian(inputs_, run, field_);
  problem.pure_squares.head(m) = layings_.squares;
  problem.pure_degrees_of_freedom.head(m) = layings_.degrees_of_freedom;
  for (Eigen::Index k = 0; k < m; ++k) {
    Eigen::MatrixXd& own = problem.roots.emplace_back(Eigen::MatrixXd::Zero(run.row_count(), 1));
    own(run.rows_of_axis(k), 0) = (set_.weights.col(k).array() > 0.0).cast<double>();
  }
  if (seats_) {
    Eigen::MatrixXd& turns = problem.roots.emplace_back(run.row_count(), 3);
    for (Eigen::Index i = 0; i < run.readings(); ++i) {
      const Eigen::Matrix3d by_turn = set_.rotation_sensor_from_table[static_cast<std::size_t>(i)] *
                                      cross_matrix(set_.field_in_table(i, field_));
      for (Eigen::Index k = 0; k < m; ++k) {
        turns.row(run.row_of(i, k)) = run.change_with_field(i, k) * by_turn;
      }
    }
  }
  return problem;
}
}  // namespace axiscal
