// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/QR>
#include <Eigen/SVD>

#include "axis_regression.hpp"
#include "axiscal/calib/least_squares.hpp"
#include "axiscal/calib/robust.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/positioner/design.hpp"
#include "design_advice.hpp"
#include "estimation.hpp"
#include "joint_fit.hpp"
#include "opposite_pairs.hpp"

namespace axiscal {
namespace {

Eigen::VectorXd scatter(const ReadingSet& set,
                        const JointState& state,
                        const Eigen::VectorXd& degrees_of_freedom) {
  Eigen::VectorXd sigma(set.axis_count());
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const double rss = state.axes[static_cast<std::size_t>(k)].residuals.squaredNorm();
    sigma(k) = std::max(std::sqrt(rss / degrees_of_freedom(k)), set.rounding(k));
  }
  return sigma;
}

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

// The axes' noise is not known: weights are iterated from equal ones.
Solution solve(const ReadingSet& set,
               const JointFit& fit,
               const std::vector<Eigen::Vector3d>& start) {
  Eigen::VectorXd sigma = Eigen::VectorXd::Ones(set.axis_count());
  JointState state = fit.converged(start, sigma);
  const DirectionShares unscaled = fit.shares(state, sigma);
  sigma.setConstant(pooled_scatter(set, state, unscaled.degrees_of_freedom.sum()));
  const DirectionShares shares = fit.shares(state, sigma);
  Solution equal{.state = std::move(state), .sigma = sigma, .shares = shares};
  Solution solution = equal;
  solution.weights_are_estimated = true;
  for (int round = 0; round < 50; ++round) {
    // With so little to go by an axis could get all the weight just for fitting by chance.
    if (solution.shares.degrees_of_freedom.minCoeff() < 1.0) {
      return equal;
    }
    const Eigen::VectorXd next = scatter(set, solution.state, solution.shares.degrees_of_freedom);
    const double change = ((next - solution.sigma).array() / next.array()).abs().maxCoeff();
    solution.sigma = next;
    solution.state = fit.converged(solution.state.fields, solution.sigma);
    solution.shares = fit.shares(solution.state, solution.sigma);
    if (change < 1e-12) {
      break;
    }
  }
  return solution;
}

double condition_of(const Eigen::MatrixXd& J) {
  const Eigen::MatrixXd scaled = J * J.colwise().norm().cwiseInverse().asDiagonal();
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(scaled);
  const Eigen::MatrixXd R =
      qr.matrixQR().topRows(J.cols()).triangularView<Eigen::Upper>().toDenseMatrix();
  const Eigen::VectorXd singular = Eigen::JacobiSVD<Eigen::MatrixXd>(R).singularValues();
  return singular(0) / singular(singular.size() - 1);
}

std::vector<std::string> names_with_directions(const ReadingSet& set) {
  std::vector<std::string> names = parameter_names(set.axes);
  for (const int block : set.level_blocks) {
    const std::string name =
        "direction of the field" +
        (set.level_blocks.size() > 1 ? " in block " + std::to_string(block) : std::string());
    names.insert(names.end(), {name, name});
  }
  return names;
}

// What a reading at another point, of the first levelness, would add to the Jacobian.
Eigen::MatrixXd jacobian_rows(const ReadingSet& set,
                              const Solution& solution,
                              const DesignPoint& point) {
  const Eigen::Matrix3d R = set.orientation(point);
  const Eigen::Vector3d& field = solution.state.fields.front();
  const Eigen::Index m = set.axis_count();
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(m, 4 * m + solution.state.direction_count());
  for (Eigen::Index k = 0; k < m; ++k) {
    const Eigen::Vector3d S = solution.state.axes[static_cast<std::size_t>(k)].estimate.tail<3>();
    rows(k, 4 * k) = 1.0 / solution.sigma(k);
    rows.block<1, 3>(k, 4 * k + 1) = (R * field).transpose() / solution.sigma(k);
    rows.block<1, 2>(k, 4 * m) =
        field.norm() * S.transpose() * R * solution.state.tangents.front() / solution.sigma(k);
  }
  return rows;
}

void require_direction(const ReadingSet& set, const JointFit& fit, const Solution& solution) {
  const Eigen::MatrixXd J = fit.jacobian(solution.state, solution.sigma);
  const Eigen::Index parameters = J.cols();
  std::vector<Eigen::Index> open;
  if (J.rows() >= parameters) {
    const Eigen::MatrixXd scaled = J * J.colwise().norm().cwiseInverse().asDiagonal();
    Eigen::JacobiSVD<Eigen::MatrixXd> svd(scaled, Eigen::ComputeFullV);
    for (Eigen::Index j = 0; j < parameters; ++j) {
      double share = 0.0;
      for (Eigen::Index s = 0; s < parameters; ++s) {
        if (svd.singularValues()(s) < JointFit::confounded_below * svd.singularValues()(0)) {
          share = std::max(share, std::abs(svd.matrixV()(j, s)));
        }
      }
      if (share > 1e-6) {
        open.push_back(j);
      }
    }
    if (open.empty()) {
      return;
    }
  } else {
    open = undetermined_columns(J);
  }
  const std::vector<std::string> all = names_with_directions(set);
  std::vector<std::string> names;
  for (const Eigen::Index j : open) {
    const std::string& name = all[static_cast<std::size_t>(j)];
    if (names.empty() || names.back() != name) {
      names.push_back(name);
    }
  }
  const std::string points = points_to_add(
      J, [&](const DesignPoint& point) { return jacobian_rows(set, solution, point); });
  const std::string list = joined(names);
  throw RankDeficientError(
      "the readings do not determine " + list + " together; " +
          (points.empty() ? "take each face turned round as well" : "add readings at " + points) +
          ", or use --method known if the table is level",
      std::move(names));
}

// Covariance of the field's direction; that weights are estimated costs some of it (METHOD 4).
void describe_direction(const Solution& solution, Estimate& estimate) {
  const Eigen::VectorXd& nu = solution.shares.degrees_of_freedom;
  if (!(nu.minCoeff() > 0.0)) {
    estimate.direction_se_rad = std::numeric_limits<double>::quiet_NaN();
    return;
  }
  const Eigen::ArrayXd information = estimate.response.sensitivity.rowwise().squaredNorm().array() /
                                     solution.sigma.array().square();
  const Eigen::ArrayXd p = information / information.sum();
  const double factor =
      solution.weights_are_estimated ? 1.0 + 4.0 * (p * (1.0 - p) / nu.array()).sum() : 1.0;
  const Eigen::MatrixXd C = factor * solution.shares.covariance;
  const auto levels = static_cast<Eigen::Index>(solution.state.fields.size());
  Eigen::Matrix<double, 3, Eigen::Dynamic> T(3, 2 * levels);
  for (Eigen::Index s = 0; s < levels; ++s) {
    const auto at = static_cast<std::size_t>(s);
    T.middleCols<2>(2 * s) = solution.state.fields[at].norm() * solution.state.tangents[at] /
                             static_cast<double>(levels);
    const Eigen::Matrix2d own = C.block<2, 2>(2 * s, 2 * s);
    estimate.direction_se_rad =
        std::max(estimate.direction_se_rad,
                 std::sqrt(Eigen::JacobiSVD<Eigen::Matrix2d>(own).singularValues()(0)));
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
  statistics.residual_sd = Eigen::VectorXd::Constant(m, std::numeric_limits<double>::quiet_NaN());
  statistics.condition_number = condition_of(fit.jacobian(state, solution.sigma));
  estimate.response.bias.resize(m);
  estimate.response.sensitivity.resize(m, 3);
  estimate.fields = state.fields;
  for (Eigen::Index k = 0; k < m; ++k) {
    const JointAxis& axis = state.axes[static_cast<std::size_t>(k)];
    const double nu = statistics.degrees_of_freedom(k);
    const double s = solution.sigma(k);
    if (nu > 0.0) {
      statistics.residual_sd(k) = set.robust ? s : std::sqrt(axis.residuals.squaredNorm() / nu);
    }
    estimate.response.bias(k) = axis.estimate(0);
    estimate.response.sensitivity.row(k) = axis.estimate.tail<3>();
    statistics.r_squared(k) =
        r_squared_about_mean(set.response.col(k), set.weights.col(k), axis.residuals);

    const double s2 = statistics.residual_sd(k) * statistics.residual_sd(k);
    const Eigen::MatrixXd own = axis.design->unscaled_covariance() +
                                axis.take_up * (C / (s * s)) * axis.take_up.transpose();
    for (Eigen::Index l = 0; l < m; ++l) {
      const JointAxis& other = state.axes[static_cast<std::size_t>(l)];
      statistics.covariance.block<4, 4>(4 * k, 4 * l) =
          axis.take_up * C * other.take_up.transpose();
    }
    statistics.covariance.block<4, 4>(4 * k, 4 * k) += s2 * axis.design->unscaled_covariance();
    statistics.variance_inflation.row(k) =
        variance_inflation(state.X, set.weights.col(k), own).tail<3>();

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
  describe_direction(solution, estimate);
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
    const Eigen::VectorXd residuals = set.weights.col(k).cwiseSqrt().cwiseProduct(
        set.response.col(k) - state.X * state.axes[static_cast<std::size_t>(k)].estimate);
    const BisquareWeights bisquare =
        bisquare_weights(residuals, leverage.col(k),
                         static_cast<double>(set.size()) - degrees_of_freedom(k), set.rounding(k));
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
  std::vector<std::string> names = parameter_names(axes);
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
  Eigen::MatrixXd robust = Eigen::MatrixXd::Ones(set.size(), set.axis_count());
  JointState state = plain.state;
  Eigen::VectorXd sigma = plain.sigma;
  for (int round = 0; round < 100; ++round) {
    const RobustRound next = robust_round(set, state, leverage, plain.shares.degrees_of_freedom);
    const double change = (next.weights - robust).cwiseAbs().maxCoeff();
    robust = next.weights;
    sigma = next.sigma;
    const Eigen::MatrixXd weights = set.weights.cwiseProduct(robust);
    state = JointFit(set, weights).converged(state.fields, sigma);
    if (change < 1e-9) {
      break;
    }
  }
  // Covariance by the given weights and the robust scatter; estimate and residuals are the robust.
  Solution solution{.state = given.at(state.fields), .sigma = sigma, .shares = {}};
  solution.shares = given.shares(solution.state, sigma);
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    JointAxis& axis = solution.state.axes[static_cast<std::size_t>(k)];
    axis.estimate = state.axes[static_cast<std::size_t>(k)].estimate;
    axis.residuals = axis.root_weights.cwiseProduct(set.response.col(k) - state.X * axis.estimate);
  }
  return describe(set, given, solution, robust);
}

// The directions that follow linearly; (S, f) and (-S, -f) fit alike, and the given one decides. A
// levelness with too few readings of its own starts from that of all readings.
std::vector<Eigen::Vector3d> start_fields(const ReadingSet& set, const Eigen::Vector3d& given) {
  const auto directed =
      [&](const std::vector<Eigen::Index>& rows) -> std::optional<Eigen::Vector3d> {
    const std::optional<Eigen::Vector3d> direction = linear_direction(set, rows);
    return direction ? std::optional<Eigen::Vector3d>(
                           std::copysign(given.norm(), direction->dot(given)) * *direction)
                     : std::nullopt;
  };
  std::vector<Eigen::Index> all(static_cast<std::size_t>(set.size()));
  std::iota(all.begin(), all.end(), 0);
  const Eigen::Vector3d common = directed(all).value_or(given);
  std::vector<Eigen::Vector3d> fields(set.level_blocks.size(), common);
  for (std::size_t s = 0; fields.size() > 1 && s < fields.size(); ++s) {
    std::vector<Eigen::Index> rows;
    std::copy_if(all.begin(), all.end(), std::back_inserter(rows),
                 [&](Eigen::Index i) { return set.level_of(i) == s; });
    fields[s] = directed(rows).value_or(common);
  }
  return fields;
}

}  // namespace

Estimate estimate_joint(const ReadingSet& set, const Eigen::Vector3d& start_in_table) {
  const std::vector<Eigen::Vector3d> given(set.level_blocks.size(), start_in_table);
  require_determined(set, field_design(set, given), [&](const DesignPoint& point) {
    Eigen::RowVector4d row;
    row << 1.0, (set.orientation(point) * start_in_table).transpose();
    return row;
  });
  require_response(set);
  const JointFit fit(set, set.weights);
  Solution solution = solve(set, fit, start_fields(set, start_in_table));
  if (solution.state.fields.front().dot(start_in_table) < 0.0) {
    std::vector<Eigen::Vector3d> reversed = solution.state.fields;
    for (Eigen::Vector3d& field : reversed) {
      field *= -1.0;
    }
    solution.state = fit.at(reversed);
    solution.shares = fit.shares(solution.state, solution.sigma);
  }
  require_direction(set, fit, solution);
  require_degrees_of_freedom(set, solution);
  Estimate estimate = set.robust ? robust_estimate(set, fit, solution)
                                 : describe(set, fit, solution, Eigen::MatrixXd());
  estimate.levelness = estimate_levelness(set, find_opposite_pairs(set).pairs,
                                          estimate.response.sensitivity, start_in_table.norm());
  return estimate;
}

}  // namespace axiscal
