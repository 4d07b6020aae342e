// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/generalized_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "calib/fit/fit.hpp"
#include "calib/fit/input_quantities.hpp"
#include "calib/fit/layings.hpp"
#include "calib/fit/rounding_scatter.hpp"
#include "calib/fit/src/curvature.hpp"
#include "calib/record/parameter_names.hpp"
#include "calib/regression/variance_components.hpp"
#include "core/formatted.hpp"

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

class GeneralizedFit {
 public:
  // @param layings  means over consecutive readings at one design point.
  // @param run      these means with their solution.
  // All references must outlive this object.
  GeneralizedFit(const MeanReadings& layings,
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
    const ScatterComponent* const found = find_component(start.statistics, "seats");
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

  // Returns true if the variance of the cube's rotation at its seats could exceed the final limit
  // of 1.6 standard errors. This first check uses a fit without the rotation, in which the standard
  // error is smaller.
  [[nodiscard]] bool may_see_seats() {
    constexpr double clearly_less = 0.5;
    const Eigen::Index m = set_.axis_count();
    Eigen::VectorXd without = variances_;
    without(m) = 0.0;
    return component_score(problem(about_field()), without, m).value_or(clearly_less) >=
           clearly_less;
  }

  // Estimates the variances, the coefficients and the field in rounds until they converge.
  // @param seats_at_least  lower limit for the degrees of freedom of the variance of the cube's
  //                        rotation at its seats; 0: no limit. The search ends at the first round
  //                        below the limit, because later rounds hardly change this number.
  // @return false if the readings do not determine the fit, or if the degrees of freedom are below
  //         seats_at_least.
  bool solve(double seats_at_least = 0.0) {
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

  // Returns true if the readings of a laying share an error besides the cube's rotation. The noise
  // of the means, which this fit found without the scatter of the readings about them, is then
  // clearly larger than this scatter.
  [[nodiscard]] bool exceeds_scatter_within(const MeanReadings& layings) const {
    FisherSum axes;
    for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
      const double within = layings.squares(k) / layings.degrees_of_freedom(k);
      axes.add(
          f_upper_p(variances_(k) / within, degrees_of_freedom(k), layings.degrees_of_freedom(k)));
    }
    constexpr double clearly_larger = 0.02;
    return axes.p_value() < clearly_larger;
  }

  // Tests for curvature of the axes by adding the columns f_k^2 to the fit. f_k is the initial
  // field along axis k.
  [[nodiscard]] std::optional<CurvatureTest> curvature() {
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

  // Returns the standard deviation [rad], about each axis, of the cube's rotation between
  // placements. It is 0 if the rotation is not fitted or not found.
  [[nodiscard]] double seat_sd() const {
    return seats_ ? std::sqrt(variances_(set_.axis_count())) : 0.0;
  }

  // Returns true if the variance of the cube's rotation at its seats has more than the given
  // degrees of freedom. A variance theta with the standard error u has 2 (theta / u)^2 degrees of
  // freedom.
  [[nodiscard]] bool sees_seats(double degrees_of_freedom) const {
    return seat_sd() > 0.0 &&
           fit_->component_degrees_of_freedom(set_.axis_count()) > degrees_of_freedom;
  }

  void put(Estimate& estimate) const {
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

  // Adds the error that the readings of a laying share, besides the cube's rotation, as a component
  // of the scatter. put() was called before.
  void put_errors_of(const MeanReadings& layings, Estimate& estimate) const {
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
        statistics.covariance - find_component(statistics, "seats")->covariance;
    statistics.components.push_back(
        {.name = "layings",
         .sd = std::move(sd),
         .unit = {},
         .covariance = share.asDiagonal() * of_noise * share.asDiagonal(),
         .degrees_of_freedom = freedom});
    estimate.notes.push_back({NoteCode::correlation, note_of_layings});
  }

  // Predicts the effect of the inputs' errors on the readings of a set; n x m.
  // @param inputs  the uncertain inputs for the readings of `set`.
  [[nodiscard]] Eigen::MatrixXd shared_parts(const ReadingSet& set,
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

  // Returns the contribution of each input to the coefficients' covariance.
  [[nodiscard]] std::vector<Eigen::MatrixXd> shares() const {
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

 private:
  [[nodiscard]] Fit about_field() {
    return {run_, field_, Eigen::VectorXd::Ones(set_.axis_count())};
  }

  void take_coefficients(const Eigen::VectorXd& solution) {
    const Eigen::Index p = set_.column_count();
    const Eigen::Index m = set_.axis_count();
    coefficients_ = solution.head(p * m).reshaped(p, m);
  }

  [[nodiscard]] std::optional<CurvatureFit> fit_problem(const VarianceProblem& problem,
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

  [[nodiscard]] IndependentCurvature bent_axes(const Fit& run) const {
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

  [[nodiscard]] double degrees_of_freedom(Eigen::Index axis) const {
    return fit_->information(axis, axis) * variances_(axis) * variances_(axis);
  }

  // Returns for each reading the squared field along an axis, times the square root of the weight.
  [[nodiscard]] Eigen::VectorXd squares_of(const Fit& run, Eigen::Index k) const {
    const Eigen::VectorXd met = run.field_met(k) * run.sensitivity(k).normalized().transpose();
    return set_.weights.col(k).cwiseSqrt().cwiseProduct(met.cwiseAbs2());
  }

  // Returns the columns f_k^2, one for each axis; (n m) x m.
  [[nodiscard]] Eigen::MatrixXd with_squares(const Fit& run) const {
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(run.row_count(), run.axes());
    for (Eigen::Index k = 0; k < run.axes(); ++k) {
      columns(run.rows_of_axis(k), k) = squares_of(run, k);
    }
    return columns;
  }

  [[nodiscard]] Eigen::Index errors() const {
    return std::accumulate(
        inputs_.begin(), inputs_.end(), Eigen::Index{0},
        [](Eigen::Index sum, const InputQuantity& one) { return sum + one.parts; });
  }

  // Returns the starting variances of a round. If the seats' variance is 0, it starts above 0, so
  // that it can increase.
  [[nodiscard]] Eigen::VectorXd start() const {
    Eigen::VectorXd from = variances_;
    const Eigen::Index m = set_.axis_count();
    if (seats_ && !(from(m) > 0.0)) {
      from(m) =
          1e-4 * from.head(m).mean() /
          std::pow(coefficients_.middleRows<3>(1).colwise().norm().mean() * field_.magnitude(), 2);
    }
    return from;
  }

  [[nodiscard]] VarianceProblem problem(const Fit& run) const {
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
        const Eigen::Matrix3d by_turn =
            set_.rotation_sensor_from_table[static_cast<std::size_t>(i)] *
            cross_matrix(set_.field_in_table(i, field_));
        for (Eigen::Index k = 0; k < m; ++k) {
          turns.row(run.row_of(i, k)) = run.change_with_field(i, k) * by_turn;
        }
      }
    }
    return problem;
  }

  const ReadingSet& set_;
  const MeanReadings& layings_;
  const SolvedReadings& run_;
  const std::vector<InputQuantity>& inputs_;
  bool seats_;
  TableField field_;
  // the noise variances of the m axes, then the variance of the seats if it is fitted
  Eigen::VectorXd variances_;
  Eigen::VectorXd smallest_;
  Eigen::MatrixXd coefficients_;  // p x m
  std::optional<VarianceFit> fit_;
};

// The smallest number of layings whose means alone separate rotations of the cube from noise. Fewer
// layings are enough if the scatter of their readings shows the noise.
constexpr Eigen::Index fewest_layings = 24;

// Returns true if the fit includes random rotations of the cube at its seats.
bool looks_for_seats(const Experiment& experiment,
                     const ReadingSet& set,
                     const MeanReadings& layings,
                     const Estimate& estimate) {
  constexpr Eigen::Index fewest_repeated = 12;
  constexpr double enough_within = 12.0;
  constexpr Eigen::Index most = 2000;  // nobody places a cube more often in one calibration
  if (experiment.fit.seats == SeatSetup::none || experiment.fit.robust ||
      !estimate.field.has_vectors() || set.axis_count() < 2 || set.field.is_sum()) {
    return false;
  }
  // If the readings are coarsely rounded, rotations at the seats cannot be distinguished from
  // rounding errors.
  return experiment.fit.seats == SeatSetup::fit ||
         (layings.set().size() >= (layings.degrees_of_freedom.minCoeff() >= enough_within
                                       ? fewest_repeated
                                       : fewest_layings) &&
          layings.set().size() <= most &&
          !is_coarsely_rounded(set, experiment.stated.resolution, estimate.statistics.residual_sd));
}

// Returns the layings without the scatter of their readings, if the readings of a laying share an
// error besides the cube's rotation: only the means are then independent. Returns nullopt if they
// share no such error.
std::optional<MeanReadings> means_alone(const MeanReadings& layings,
                                        const SolvedReadings& run,
                                        const std::vector<InputQuantity>& inputs,
                                        const Estimate& estimate) {
  constexpr double fewest_within = 6.0;
  if (layings.degrees_of_freedom.minCoeff() < fewest_within ||
      !(layings.squares.minCoeff() > 0.0)) {
    return std::nullopt;
  }
  MeanReadings alone = layings;
  alone.forget_scatter();
  GeneralizedFit fit(alone, run, inputs, true, estimate);
  return fit.solve() && fit.exceeds_scatter_within(layings) ? std::optional(std::move(alone))
                                                            : std::nullopt;
}

// Returns true if shared errors can be estimated. This requires that the design points determine
// the fields, that all axes are in the same field, and that the readings determine all
// coefficients.
bool can_weigh(const ReadingSet& set, const Estimate& estimate) {
  return estimate.field.has_vectors() && !set.rotation_sensor_from_table.empty() &&
         set.visible.empty() && set.seen.cols() == 0;
}

}  // namespace

std::optional<CurvatureTest> test_curvature(const Experiment& experiment,
                                            const SolvedReadings& run,
                                            Method method,
                                            const Estimate& estimate) {
  const ReadingSet& set = run.set();
  const FitStatistics& statistics = estimate.statistics;
  if (!can_weigh(set, estimate) || experiment.fit.robust ||
      !(statistics.residual_sd.array() > 0.0).all()) {
    return std::nullopt;
  }
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    if (statistics.residual_sd(k) <= 2.0 * set.rounding(k)) {
      return std::nullopt;  // rounding errors can look like curvature
    }
  }
  // If all readings of a pose share an error, only the means of the poses are independent.
  const bool has_poses = find_component(statistics, "poses") != nullptr;
  MeanReadings means = has_poses ? average_poses(set, estimate) : average_layings(set, estimate);
  if (find_component(statistics, "layings") != nullptr) {
    means.forget_scatter();  // only the means are independent
  }
  const bool known = method_kind(method).directions_known;
  const std::vector<InputQuantity> inputs =
      input_quantities(experiment, means.set(), known, estimate.field);
  const bool seats = !has_poses && find_component(statistics, "seats") != nullptr;
  SolvedReadings of_means(means.set(), known);
  return GeneralizedFit(means, means.own ? of_means : run, inputs, seats, estimate).curvature();
}

std::optional<ReadingSet> without_shared_errors(const Experiment& experiment,
                                                const ReadingSet& set,
                                                Method method,
                                                const Estimate& estimate,
                                                const ReadingSet& of) {
  if (!can_weigh(set, estimate) || experiment.fit.robust) {
    return std::nullopt;
  }
  const bool known = method_kind(method).directions_known;
  const std::vector<InputQuantity> own = input_quantities(experiment, of, known, estimate.field);
  if (own.empty()) {
    return std::nullopt;
  }
  const MeanReadings layings = average_layings(set, estimate);
  const std::vector<InputQuantity> inputs =
      input_quantities(experiment, layings.set(), known, estimate.field);
  SolvedReadings of_layings(layings.set(), known);
  GeneralizedFit fit(layings, of_layings, inputs, false, estimate);
  if (!fit.solve()) {
    return std::nullopt;
  }
  ReadingSet without = of;
  without.response -= fit.shared_parts(of, own);
  return without;
}

std::vector<UncertaintySource> weigh_shared_errors(const Experiment& experiment,
                                                   const SolvedReadings& run,
                                                   Method method,
                                                   Estimate& estimate) {
  const ReadingSet& set = run.set();
  const bool known = method_kind(method).directions_known;
  if (!can_weigh(set, estimate)) {
    return {};
  }
  const MeanReadings layings = average_layings(set, estimate);
  const std::vector<InputQuantity> inputs =
      input_quantities(experiment, layings.set(), known, estimate.field);
  const bool has_normals = !inputs.empty() && inputs.front().name == "positioner";
  if (experiment.fit.robust) {
    if (has_normals) {
      estimate.notes.push_back({NoteCode::face_normals,
                                "robust regression ignores the uncertainty of the cube's face "
                                "normals, so the stated uncertainties do not include it"});
    }
    return {};
  }
  SolvedReadings of_layings(layings.set(), known);
  for (const bool seats : {true, false}) {
    const bool shared =
        seats ? looks_for_seats(experiment, set, layings, estimate) : !inputs.empty();
    if (!shared) {
      continue;
    }
    const SolvedReadings& means = layings.own ? of_layings : run;
    const std::optional<MeanReadings> alone =
        seats ? means_alone(layings, means, inputs, estimate) : std::nullopt;
    GeneralizedFit fit(alone ? *alone : layings, means, inputs, seats, estimate);
    if (alone && layings.set().size() < fewest_layings) {
      continue;
    }
    const bool may_be_nothing = seats && experiment.fit.seats != SeatSetup::fit;
    // The seats' variance must be more than 1.6 times its standard error, which corresponds to 5
    // degrees of freedom. A smaller variance may be chance, and would reduce the estimate of the
    // noise.
    constexpr double enough = 5.0;
    constexpr double nearly_enough = 0.9 * enough;
    if ((may_be_nothing && !fit.may_see_seats()) ||
        !fit.solve(may_be_nothing ? nearly_enough : 0.0) || (seats && !fit.sees_seats(enough))) {
      continue;
    }
    fit.put(estimate);
    if (alone) {
      fit.put_errors_of(layings, estimate);
    }
    // Seats are mentioned in a note only if their variance is 2.9 times its standard error or more,
    // which corresponds to 17 degrees of freedom. The intervals include smaller variances without a
    // note.
    constexpr double clear = 17.0;
    if (seats && (!may_be_nothing || fit.sees_seats(clear))) {
      estimate.notes.push_back(
          {NoteCode::seats,
           formatted("the cube's orientation varies by {} rad about each axis (standard deviation) "
                     "each time the cube is laid down; the coefficients and their uncertainty "
                     "include this variation",
                     number_text(fit.seat_sd(), 2))});
    }
    return sources_of(inputs, fit.shares());
  }
  if (has_normals) {
    estimate.notes.push_back(
        {NoteCode::face_normals,
         "the readings do not separate the errors of the cube's face normals from noise, so the "
         "stated uncertainties do not include the uncertainty of the face normals"});
  }
  return {};
}

}  // namespace axiscal
