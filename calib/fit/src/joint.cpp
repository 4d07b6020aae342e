// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/SVD>

#include "axis_regression.hpp"
#include "axiscal/calib/design_advice.hpp"
#include "axiscal/calib/estimation.hpp"
#include "axiscal/calib/joint_fit.hpp"
#include "axiscal/calib/least_squares.hpp"
#include "axiscal/calib/parameter_names.hpp"
#include "axiscal/calib/robust.hpp"
#include "axiscal/calib/scaled_qr.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/positioner/design.hpp"
#include "opposite_pairs.hpp"

namespace axiscal {
namespace {

struct Solution {
  JointState state;
  Eigen::VectorXd sigma;
  DirectionShares shares;
  bool weights_are_estimated = false;
};

// One scatter for all axes; 1 where there is nothing to estimate it from.
double pooled_scatter(const ReadingSet& set, const JointState& state, double dof) {
  if (!(dof > 0.5)) {
    return 1.0;
  }
  double rss = 0.0;
  for (const JointAxis& axis : state.axes) {
    rss += axis.residuals.squaredNorm();
  }
  return std::max(std::sqrt(rss / dof), set.rounding());
}

// The axes' noise is not known: it is what fits the residuals best, directions and noise in turn.
Solution solve(const ReadingSet& set,
               const JointFit& fit,
               const std::vector<Eigen::Vector3d>& start) {
  Eigen::VectorXd sigma = Eigen::VectorXd::Ones(set.axis_count());
  JointState state = fit.converged(fit.at(start), sigma);
  const DirectionShares unscaled = fit.shares(state, sigma);
  sigma.setConstant(pooled_scatter(set, state, unscaled.degrees_of_freedom.sum()));
  const DirectionShares shares = fit.shares(state, sigma);
  const Solution equal{.state = std::move(state), .sigma = sigma, .shares = shares};
  // With so little to go by an axis could get all the weight just for fitting by chance.
  constexpr double fewest_degrees_of_freedom = 1.0;
  if (shares.degrees_of_freedom.minCoeff() < fewest_degrees_of_freedom) {
    return equal;
  }
  Solution solution = equal;
  solution.weights_are_estimated = true;
  Eigen::VectorXd smallest(set.axis_count());
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    smallest(k) = set.rounding(k);
  }
  constexpr int most_rounds = 100;
  for (int round = 0; round < most_rounds; ++round) {
    const Reweighting next = fit.reweighted(solution.state, solution.sigma, smallest);
    if (!(next.degrees_of_freedom.minCoeff() >= fewest_degrees_of_freedom)) {
      return equal;
    }
    const double change = (next.sigma.array() / solution.sigma.array()).log().abs().maxCoeff();
    solution.sigma = next.sigma;
    // The directions go all their way before the noise is asked again: one step only, of readings
    // that hardly determine them, could go round in circles.
    solution.state = fit.converged(std::move(solution.state), solution.sigma);
    if (change < 1e-10) {
      solution.shares = fit.shares(solution.state, solution.sigma);
      return solution;
    }
  }
  return equal;  // which is right too, if less sharp
}

// What each column of the Jacobian is of.
std::vector<std::string> names_with_directions(const ReadingSet& set, const JointState& state) {
  std::vector<std::string> names = parameter_names(set.axes, set.also_kinds, set.temperature.order);
  for (std::size_t s = 0; s < state.fields.size(); ++s) {
    const std::string whose = set.field.name_of(s);
    names.insert(names.end(), 2, "direction of " + whose);
    if (state.tangents[s].cols() > 2) {
      names.push_back("magnitude of " + whose);
    }
  }
  return names;
}

// What a reading at another point, of the first levelness, would add to the Jacobian.
Eigen::MatrixXd jacobian_rows(const ReadingSet& set,
                              const Solution& solution,
                              const DesignPoint& point,
                              double level) {
  ReadingSet one = set;
  one.readings = {Reading{.block = set.field.blocks().front(), .point = point, .level = level}};
  one.rotation_sensor_from_table = {set.orientation(point)};
  one.temperature.d = Eigen::VectorXd::Zero(1);  // at the reference
  const JointState& state = solution.state;
  const Eigen::Index m = set.axis_count();
  const Eigen::Index p = set.column_count();
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(m, p * m + state.direction_count());
  for (Eigen::Index k = 0; k < m; ++k) {
    const Eigen::Matrix3d& R = one.rotation_sensor_from_table.front();
    const Eigen::Vector3d S = state.axes[static_cast<std::size_t>(k)].estimate.segment<3>(1);
    rows.block(k, p * k, 1, p) = one.with_temperature(
        Eigen::RowVectorXd(one.design_row(R, one.field_in_table(0, state.fields))), 0, k);
    for (std::size_t s = 0; s < state.fields.size(); ++s) {
      rows.block(k, p * m + state.first_direction(s), 1, state.tangents[s].cols()) =
          S.transpose() * R * one.field_change(0, state.fields, s) *
          (state.fields[s].norm() * state.tangents[s]);
    }
    rows.row(k) /= solution.sigma(k);
  }
  return rows;
}

void require_direction(const ReadingSet& set, const JointFit& fit, const Solution& solution) {
  const Eigen::MatrixXd J = fit.jacobian(solution.state, solution.sigma);
  const Eigen::Index parameters = J.cols();
  std::vector<Eigen::Index> open;
  if (J.rows() >= parameters) {
    open = confounded_columns(J, JointFit::confounded_below, 1e-6);
    if (open.empty()) {
      return;
    }
  } else {
    open = undetermined_columns(J);
  }
  std::vector<std::string> names = names_of_open(open, names_with_directions(set, solution.state));
  const std::string points = points_to_add(
      J,
      [&](const DesignPoint& point, double level) {
        return jacobian_rows(set, solution, point, level);
      },
      set.field.is_sum());
  const std::string list = joined(names);
  throw RankDeficientError(
      "the readings do not determine " + list + (names.size() > 1 ? " together; " : "; ") +
          (points.empty()
               ? set.also_in_table.empty()
                     ? "take each face turned round as well, or use --method known if the "
                       "table is level"
                     : "use --method known with the field's direction: the site and "
                       "--fence-azimuth, or --field-table"
               : "add readings at " + points + ", or use --method known if the table is level"),
      std::move(names));
}

// Covariance of the field's direction; that weights are estimated costs some of it (method.md,
// section 4).
void describe_direction(const ReadingSet& set, const Solution& solution, Estimate& estimate) {
  const Eigen::VectorXd& nu = solution.shares.degrees_of_freedom;
  if (!(nu.minCoeff() > 0.0)) {
    estimate.direction_se_rad = not_a_number;
    return;
  }
  const Eigen::ArrayXd information = estimate.response.sensitivity.rowwise().squaredNorm().array() /
                                     solution.sigma.array().square();
  const Eigen::ArrayXd p = information / information.sum();
  const double factor =
      solution.weights_are_estimated ? 1.0 + 4.0 * (p * (1.0 - p) / nu.array()).sum() : 1.0;
  const Eigen::MatrixXd C = factor * solution.shares.covariance;
  const JointState& state = solution.state;
  // The sum of the parts, or the mean of the blocks.
  double largest = 0.0;
  for (const Eigen::Vector3d& field : state.fields) {
    largest = std::max(largest, field.norm());
  }
  Eigen::Matrix<double, 3, Eigen::Dynamic> T(3, state.direction_count());
  for (std::size_t s = 0; s < state.fields.size(); ++s) {
    const Eigen::Index first = state.first_direction(s);
    T.middleCols(first, state.tangents[s].cols()) =
        set.field.change_of_mean(state.fields, s) * (state.fields[s].norm() * state.tangents[s]);
    const Eigen::Matrix2d own = C.block<2, 2>(first, first);
    // A small part, as the Earth's rotation beside a turntable's, may point where it likes.
    const double weight = set.field.is_sum() ? state.fields[s].norm() / largest : 1.0;
    estimate.direction_se_rad =
        std::max(estimate.direction_se_rad,
                 weight * std::sqrt(Eigen::JacobiSVD<Eigen::Matrix2d>(own).singularValues()(0)));
  }
  estimate.field_covariance = T * C * T.transpose();
  estimate.field_degrees_of_freedom =
      solution.weights_are_estimated ? 1.0 / (p.square() / nu.array()).sum() : nu.sum();
}

// Leverages, standard errors and covariance at the solution, by the given weights.
Estimate describe(const ReadingSet& set,
                  const JointFit& fit,
                  const Solution& solution,
                  const Eigen::MatrixXd& robust_weights) {
  const Eigen::Index m = set.axis_count();
  const JointState& state = solution.state;
  const Eigen::MatrixXd& C = solution.shares.covariance;
  Estimate estimate;
  RegressionRows rows = rows_of_readings(set);
  estimate.statistics = blank_statistics(set, rows);
  FitStatistics& statistics = estimate.statistics;
  statistics.degrees_of_freedom = solution.shares.degrees_of_freedom;
  statistics.residual_sd = Eigen::VectorXd::Constant(m, not_a_number);
  statistics.condition_number = condition_of(fit.jacobian(state, solution.sigma));
  estimate.fields = state.fields;
  const Eigen::Index p = set.column_count();
  for (Eigen::Index k = 0; k < m; ++k) {
    const JointAxis& axis = state.axes[static_cast<std::size_t>(k)];
    const double nu = statistics.degrees_of_freedom(k);
    const double s = solution.sigma(k);
    if (nu > 0.0) {
      statistics.residual_sd(k) = set.robust ? s : std::sqrt(axis.residuals.squaredNorm() / nu);
    }
    put_coefficients(set, k, axis.estimate, estimate);
    statistics.r_squared(k) =
        r_squared_about_mean(set.response.col(k), set.weights.col(k), axis.residuals);

    const double s2 = statistics.residual_sd(k) * statistics.residual_sd(k);
    const Eigen::MatrixXd own = axis.design->unscaled_covariance() +
                                axis.take_up * (C / (s * s)) * axis.take_up.transpose();
    for (Eigen::Index l = 0; l < m; ++l) {
      const JointAxis& other = state.axes[static_cast<std::size_t>(l)];
      statistics.covariance.block(p * k, p * l, p, p) =
          axis.take_up * C * other.take_up.transpose();
    }
    statistics.covariance.block(p * k, p * k, p, p) += s2 * axis.design->unscaled_covariance();
    statistics.variance_inflation.row(k) =
        variance_inflation(axis.X, set.weights.col(k), own).segment<3>(1);

    const Eigen::VectorXd leverage =
        axis.design->leverage() +
        (axis.projected * C).cwiseProduct(axis.projected).rowwise().sum() / (s * s);
    const double parameters = static_cast<double>(axis.design->observations()) - nu;
    put_diagnostics(statistics, k, leverage,
                    set.robust ? scale_residuals(axis.residuals, leverage, s, parameters)
                               : diagnose_residuals(axis.residuals, leverage, nu, parameters),
                    set.robust ? robust_weights.col(k) : Eigen::VectorXd());
    statistics.lack_of_fit.push_back(
        test_lack_of_fit(rows.group, set.weights.col(k), axis.residuals, nu, set.rounding(k)));
  }
  describe_direction(set, solution, estimate);
  return estimate;
}

// Bisquare weights for all axes, and the axes' robust standard deviations.
struct RobustRound {
  Eigen::MatrixXd weights;
  Eigen::VectorXd sigma;
};

RobustRound robust_round(const ReadingSet& set,
                         const JointState& state,
                         const Eigen::MatrixXd& leverage,
                         const Eigen::VectorXd& degrees_of_freedom) {
  RobustRound round{.weights = Eigen::MatrixXd(set.size(), set.axis_count()),
                    .sigma = Eigen::VectorXd(set.axis_count())};
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const JointAxis& axis = state.axes[static_cast<std::size_t>(k)];
    const Eigen::VectorXd residuals =
        set.weights.col(k).cwiseSqrt().cwiseProduct(set.response.col(k) - axis.X * axis.estimate);
    const BisquareWeights bisquare = bisquare_weights(
        residuals, leverage.col(k),
        static_cast<double>(axis.design->observations()) - degrees_of_freedom(k), set.rounding(k));
    round.weights.col(k) = bisquare.weights;
    round.sigma(k) =
        std::max(bisquare.scale * std::sqrt(bisquare.variance_factor), set.rounding(k));
  }
  return round;
}

Eigen::MatrixXd leverage_of(const Estimate& estimate) {
  const std::vector<RegressionRow>& rows = estimate.statistics.rows;
  Eigen::MatrixXd leverage(static_cast<Eigen::Index>(rows.size()), estimate.response.bias.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    leverage.row(static_cast<Eigen::Index>(i)) = rows[i].leverage;
  }
  return leverage;
}

// Without a degree of freedom to spare for each axis there is neither an uncertainty nor a check,
// and the direction may be anything that noise makes of it.
void require_degrees_of_freedom(const ReadingSet& set, const Solution& solution) {
  std::vector<std::string> axes;
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    if (solution.shares.degrees_of_freedom(k) < 0.5) {
      axes.push_back(set.axes[static_cast<std::size_t>(k)]);
    }
  }
  if (axes.empty()) {
    return;
  }
  std::vector<std::string> points;
  for (const DesignEntry& entry : standard_design(12)) {
    const bool taken = std::any_of(set.readings.begin(), set.readings.end(),
                                   [&](const Reading& r) { return r.point == entry.point; });
    if (!taken && points.size() < 4) {
      points.push_back(entry.point.name());
    }
  }
  std::vector<std::string> names = parameter_names(axes, set.also_kinds, set.temperature.order);
  const std::string list = joined(names);
  throw RankDeficientError("so few readings do not determine " + list +
                               " together with the field's direction, with anything left to check "
                               "them by; add readings" +
                               (points.empty() ? "" : " at " + joined(points, "; ")) +
                               ", or use --method known if the table is level",
                           std::move(names));
}

Estimate robust_estimate(const ReadingSet& set, const JointFit& given, const Solution& plain) {
  if (plain.shares.degrees_of_freedom.minCoeff() < 2.0) {
    throw RefusedError(
        "robust regression needs at least two readings more than coefficients; add readings or "
        "leave --robust out");
  }
  const Eigen::MatrixXd leverage =
      leverage_of(describe(set, given, plain, Eigen::MatrixXd::Ones(set.size(), set.axis_count())));
  JointState state = plain.state;
  Eigen::VectorXd sigma = plain.sigma;
  const Eigen::MatrixXd robust = reweight_until_still(
      set.size(), set.axis_count(),
      [&] {
        RobustRound next = robust_round(set, state, leverage, plain.shares.degrees_of_freedom);
        sigma = next.sigma;
        return std::move(next.weights);
      },
      [&](const Eigen::MatrixXd& robust_weights) {
        const Eigen::MatrixXd weights = set.weights.cwiseProduct(robust_weights);
        const JointFit reweighted(set, weights);
        state = reweighted.converged(reweighted.at(state.fields), sigma);
      });
  // Covariance by the given weights and the robust scatter; estimate and residuals are the robust.
  Solution solution{.state = given.at(state.fields), .sigma = sigma, .shares = {}};
  solution.shares = given.shares(solution.state, sigma);
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    JointAxis& axis = solution.state.axes[static_cast<std::size_t>(k)];
    axis.estimate = state.axes[static_cast<std::size_t>(k)].estimate;
    axis.residuals = axis.root_weights.cwiseProduct(set.response.col(k) - axis.X * axis.estimate);
  }
  return describe(set, given, solution, robust);
}

// The directions that follow linearly, their sign open. A levelness with too few readings of its
// own starts from that of all readings. Empty where they do not follow.
std::vector<Eigen::Vector3d> linear_start(const ReadingSet& set,
                                          const std::vector<FieldStart>& starts) {
  if (set.field.turns()) {
    return {};  // then its parts are not linear in the level
  }
  std::vector<Eigen::Index> all(static_cast<std::size_t>(set.size()));
  std::iota(all.begin(), all.end(), 0);
  const Eigen::VectorXd common = linear_directions(set, all);
  if (common.size() == 0) {
    return {};
  }
  std::vector<Eigen::Vector3d> fields;
  if (set.field.is_sum()) {
    // The parts whose magnitude is known say how long the others are.
    double scale = 0.0;
    for (std::size_t p = 0; p < starts.size() && scale == 0.0; ++p) {
      if (!set.field.parts()[p].free_length) {
        scale = starts[p].value.norm() / common.segment<3>(3 * static_cast<Eigen::Index>(p)).norm();
      }
    }
    for (std::size_t p = 0; p < starts.size(); ++p) {
      const Eigen::Vector3d part = common.segment<3>(3 * static_cast<Eigen::Index>(p));
      fields.emplace_back(set.field.parts()[p].free_length
                              ? scale * part
                              : starts[p].value.norm() * part.normalized());
    }
    return fields;
  }
  const double F = starts.front().value.norm();
  fields.assign(set.field.blocks().size(), F * common);
  for (std::size_t s = 0; fields.size() > 1 && s < fields.size(); ++s) {
    std::vector<Eigen::Index> rows;
    std::copy_if(all.begin(), all.end(), std::back_inserter(rows),
                 [&](Eigen::Index i) { return set.tilt_of(static_cast<std::size_t>(i)) == s; });
    const Eigen::VectorXd own = linear_directions(set, rows);
    if (own.size() > 0) {
      fields[s] = std::copysign(F, own.dot(common)) * own;
    }
  }
  return fields;
}

// Where to start from: what follows linearly, else what is given, else directions all around.
std::vector<std::vector<Eigen::Vector3d>> start_fields(const ReadingSet& set,
                                                       const std::vector<FieldStart>& starts) {
  if (std::vector<Eigen::Vector3d> linear = linear_start(set, starts); !linear.empty()) {
    return {std::move(linear)};
  }
  std::vector<std::vector<Eigen::Vector3d>> all(1);
  for (const FieldStart& start : starts) {
    const int directions = set.field.is_sum() ? 8 : 26;  // all combinations of the parts are tried
    const std::vector<Eigen::Vector3d> choices =
        start.has_direction ? std::vector<Eigen::Vector3d>{start.value.normalized()}
                            : directions_on_sphere(directions);
    std::vector<std::vector<Eigen::Vector3d>> longer;
    for (const std::vector<Eigen::Vector3d>& begun : all) {
      for (const Eigen::Vector3d& direction : choices) {
        longer.push_back(begun);
        longer.back().emplace_back(start.value.norm() * direction);
      }
    }
    all = std::move(longer);
  }
  if (!set.field.is_sum()) {
    for (std::vector<Eigen::Vector3d>& fields : all) {
      fields.resize(set.field.blocks().size(), fields.front());
    }
  }
  return all;
}

// -2 ln of the likelihood, but for a constant.
double misfit(const ReadingSet& set, const JointState& state) {
  double sum = 0.0;
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const JointAxis& axis = state.axes[static_cast<std::size_t>(k)];
    const double least = std::pow(set.rounding(k), 2) * static_cast<double>(set.size());
    sum += static_cast<double>(axis.design->observations()) *
           std::log(std::max(axis.residuals.squaredNorm(), least));
  }
  return sum;
}

// Angle between two solutions' fields, (S, f) and (-S, -f) being one; parts count as their size.
double angle_between(const JointState& a, const JointState& b) {
  double along = 0.0;
  double all = 0.0;
  for (std::size_t s = 0; s < a.fields.size(); ++s) {
    const double size = b.fields[s].norm();
    along += size * a.fields[s].normalized().dot(b.fields[s].normalized());
    all += size;
  }
  return std::acos(std::min(1.0, std::abs(along) / all));
}

struct BestSolution {
  Solution solution;
  std::string ambiguity;
};

std::string direction_text(const Eigen::Vector3d& direction) {
  const auto rounded = [](double value) { return number_text(value, 2); };
  return rounded(direction.x()) + ", " + rounded(direction.y()) + ", " + rounded(direction.z());
}

// In words where else the field may point: the part that differs most.
std::string another_direction(const ReadingSet& set,
                              const JointState& other,
                              const JointState& best) {
  std::size_t part = 0;
  double least = 2.0;
  for (std::size_t s = 0; s < best.fields.size(); ++s) {
    const double along = std::abs(other.fields[s].normalized().dot(best.fields[s].normalized()));
    if (along < least) {
      least = along;
      part = s;
    }
  }
  return "another direction of " + set.field.name_of(part) + ", " +
         direction_text(other.fields[part].normalized()) +
         " in the table, fits the readings as well";
}

BestSolution best_solution(const ReadingSet& set,
                           const JointFit& fit,
                           const std::vector<std::vector<Eigen::Vector3d>>& starts) {
  if (starts.size() == 1) {
    return {.solution = solve(set, fit, starts.front()), .ambiguity = ""};
  }
  // A few rounds from each start; then to the end from the best, and from what is as good
  // elsewhere.
  constexpr int few_rounds = 12;
  constexpr double another_rad = 0.05;
  constexpr double as_likely = 6.0;  // likelihoods within a factor of 20
  const Eigen::VectorXd equal = Eigen::VectorXd::Ones(set.axis_count());
  std::vector<JointState> found;
  for (const std::vector<Eigen::Vector3d>& start : starts) {
    found.push_back(fit.converged(fit.at(start), equal, few_rounds));
  }
  const auto less = [&](const JointState& a, const JointState& b) {
    return misfit(set, a) < misfit(set, b);
  };
  const auto best = std::min_element(found.begin(), found.end(), less);
  BestSolution result{.solution = solve(set, fit, best->fields), .ambiguity = ""};
  for (const JointState& other : found) {
    if (angle_between(other, *best) < another_rad ||
        misfit(set, other) > misfit(set, *best) + as_likely) {
      continue;
    }
    Solution rival = solve(set, fit, other.fields);
    if (angle_between(rival.state, result.solution.state) < another_rad ||
        misfit(set, rival.state) > misfit(set, result.solution.state) + as_likely) {
      continue;
    }
    if (misfit(set, rival.state) < misfit(set, result.solution.state)) {
      std::swap(rival, result.solution);
    }
    result.ambiguity = another_direction(set, rival.state, result.solution.state);
    break;
  }
  return result;
}

// (S, f) and (-S, -f) fit alike: a given direction decides, else the sign expected of S.
// @return whether the fields are to be reversed; nothing where neither tells.
std::optional<bool> is_reversed(const ReadingSet& set,
                                const JointState& state,
                                const std::vector<FieldStart>& starts) {
  double given = 0.0;
  for (std::size_t s = 0; s < starts.size(); ++s) {
    given += state.fields[s].normalized().dot(starts[s].sign_by);
  }
  if (given != 0.0) {
    return given < 0.0;
  }
  double expected = 0.0;
  for (std::size_t k = 0; k < set.nominal.size(); ++k) {
    if (set.nominal[k]) {
      const Eigen::Vector3d S = state.axes[k].estimate.segment<3>(1);
      expected += S(*set.nominal[k]) / S.norm();
    }
  }
  constexpr double clear = 0.5;
  if (std::abs(expected) > clear) {
    return expected < 0.0;
  }
  return std::nullopt;
}

JointState reversed(const JointFit& fit, const JointState& state) {
  std::vector<Eigen::Vector3d> fields = state.fields;
  for (Eigen::Vector3d& field : fields) {
    field *= -1.0;
  }
  return fit.at(fields);
}

}  // namespace

Estimate estimate_joint(const ReadingSet& set, const std::vector<FieldStart>& starts) {
  std::vector<std::vector<Eigen::Vector3d>> all_starts = start_fields(set, starts);
  if (set.leaves_out() && all_starts.size() == 1) {
    // A lamp that is given on the cube's very diagonal leaves one-sided axes open only just: where
    // it really is may be enough, and the condition number will say how much.
    constexpr double a_little_rad = 0.01;
    std::vector<Eigen::Vector3d> beside = all_starts.front();
    for (Eigen::Vector3d& field : beside) {
      field = rotation_by(a_little_rad * tangents_of(field).col(0)) * field;
    }
    if (open_parameters(set, field_design(set, beside)).names.empty()) {
      all_starts.front() = std::move(beside);
    }
  }
  require_determined(set, field_design(set, all_starts.front()),
                     rows_of_points(set, all_starts.front()));
  require_response(set);
  const JointFit fit(set, set.weights);
  BestSolution best = best_solution(set, fit, all_starts);
  Solution& solution = best.solution;
  const std::optional<bool> turn = is_reversed(set, solution.state, starts);
  if (turn.value_or(false)) {
    solution.state = reversed(fit, solution.state);
    solution.shares = fit.shares(solution.state, solution.sigma);
  } else if (!turn) {
    best.ambiguity =
        "the field and all sensitivities may as well have the opposite sign, as nothing says where "
        "the field points";
  }
  require_direction(set, fit, solution);
  require_degrees_of_freedom(set, solution);
  Estimate estimate = set.robust ? robust_estimate(set, fit, solution)
                                 : describe(set, fit, solution, Eigen::MatrixXd());
  estimate.ambiguity = std::move(best.ambiguity);
  if (!set.field.is_sum() && !set.leaves_out()) {
    estimate.levelness =
        levelness_of(set, find_opposite_pairs(set).pairs, estimate, starts.front().value.norm());
  }
  return estimate;
}

}  // namespace axiscal
