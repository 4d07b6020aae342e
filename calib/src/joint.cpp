// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include <Eigen/QR>
#include <Eigen/SVD>

#include "axis_regression.hpp"
#include "axiscal/calib/least_squares.hpp"
#include "axiscal/calib/robust.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/positioner/design.hpp"
#include "design_advice.hpp"
#include "estimation.hpp"
#include "opposite_pairs.hpp"

namespace axiscal {
namespace {

using Tangents = Eigen::Matrix<double, 3, 2>;

// The two directions of the field are as good as open when what they change beyond b and S is
// smaller than this part of what they change at all.
constexpr double confounded_below = 1e-9;

// One axis at a given direction of the field: b and S fitted, the direction's effect projected.
struct AxisState {
  std::shared_ptr<const LeastSquaresDesign> design;
  Eigen::VectorXd root_weights;
  Eigen::Vector4d estimate;             // b, S
  Eigen::VectorXd residuals;            // weighted
  Eigen::MatrixXd tangents;             // n x 2, weighted: change of the fit per radian
  Eigen::MatrixXd projected;            // the same without what b and S can take up
  Eigen::Matrix<double, 4, 2> take_up;  // change of b and S that takes up a tangent
};

struct State {
  Eigen::Vector3d field_in_table;
  Tangents tangents;
  Eigen::MatrixXd X;  // n x 4, not weighted
  std::vector<AxisState> axes;
};

class JointFit {
 public:
  JointFit(const ReadingSet& set, const Eigen::MatrixXd& weights) : set_(set), weights_(weights) {}

  [[nodiscard]] State at(const Eigen::Vector3d& field_in_table) const;

  // Gauss-Newton in the two tangents, b and S projected out.
  [[nodiscard]] State converged(const Eigen::Vector3d& field_in_table,
                                const Eigen::VectorXd& sigma) const;

  // All tangents below each other, each axis in units of its sigma.
  [[nodiscard]] Eigen::MatrixXd stacked(const State& state,
                                        const Eigen::VectorXd& sigma,
                                        Eigen::MatrixXd AxisState::*part) const;

 private:
  [[nodiscard]] static double cost(const State& state, const Eigen::VectorXd& sigma);

  const ReadingSet& set_;
  const Eigen::MatrixXd& weights_;
};

State JointFit::at(const Eigen::Vector3d& field_in_table) const {
  State state{.field_in_table = field_in_table,
              .tangents = tangents_of(field_in_table),
              .X = field_design(set_, field_in_table),
              .axes = {}};
  const double F = field_in_table.norm();
  const Eigen::MatrixXd along_first = field_design(set_, F * state.tangents.col(0));
  const Eigen::MatrixXd along_second = field_design(set_, F * state.tangents.col(1));
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    AxisState axis;
    // Axes of the same weights share one factorisation.
    const bool shared = k > 0 && weights_.col(k) == weights_.col(k - 1);
    axis.design = shared ? state.axes.back().design
                         : std::make_shared<const LeastSquaresDesign>(
                               state.X, weights_.col(k),
                               parameter_names({set_.axes[static_cast<std::size_t>(k)]}));
    axis.root_weights = weights_.col(k).cwiseSqrt();
    axis.estimate = axis.design->estimate(set_.response.col(k));
    axis.residuals = axis.root_weights.cwiseProduct(set_.response.col(k) - state.X * axis.estimate);
    Eigen::MatrixXd change(set_.size(), 2);
    change.col(0) = along_first.rightCols<3>() * axis.estimate.tail<3>();
    change.col(1) = along_second.rightCols<3>() * axis.estimate.tail<3>();
    for (Eigen::Index j = 0; j < 2; ++j) {
      axis.take_up.col(j) = axis.design->estimate(change.col(j));
    }
    axis.tangents = axis.root_weights.asDiagonal() * change;
    axis.projected = axis.root_weights.asDiagonal() * (change - state.X * axis.take_up);
    state.axes.push_back(std::move(axis));
  }
  return state;
}

double JointFit::cost(const State& state, const Eigen::VectorXd& sigma) {
  double sum = 0.0;
  for (std::size_t k = 0; k < state.axes.size(); ++k) {
    const double s = sigma(static_cast<Eigen::Index>(k));
    sum += state.axes[k].residuals.squaredNorm() / (s * s);
  }
  return sum;
}

Eigen::MatrixXd JointFit::stacked(const State& state,
                                  const Eigen::VectorXd& sigma,
                                  Eigen::MatrixXd AxisState::*part) const {
  Eigen::MatrixXd all(set_.size() * set_.axis_count(), 2);
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    all.middleRows(k * set_.size(), set_.size()) =
        state.axes[static_cast<std::size_t>(k)].*part / sigma(k);
  }
  return all;
}

State JointFit::converged(const Eigen::Vector3d& field_in_table,
                          const Eigen::VectorXd& sigma) const {
  const double F = field_in_table.norm();
  State state = at(field_in_table);
  double current = cost(state, sigma);
  for (int round = 0; round < 50; ++round) {
    const Eigen::MatrixXd J = stacked(state, sigma, &AxisState::projected);
    Eigen::VectorXd r(J.rows());
    for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
      r.segment(k * set_.size(), set_.size()) =
          state.axes[static_cast<std::size_t>(k)].residuals / sigma(k);
    }
    // A direction that b and S take up stays where it is.
    Eigen::JacobiSVD<Eigen::MatrixXd> svd(J, Eigen::ComputeThinU | Eigen::ComputeThinV);
    const double whole = stacked(state, sigma, &AxisState::tangents).norm();
    if (!(svd.singularValues()(0) > confounded_below * whole)) {
      break;
    }
    svd.setThreshold(confounded_below * whole / svd.singularValues()(0));
    Eigen::Vector2d step = svd.solve(r);
    constexpr double longest_step_rad = 0.5;
    step *= std::min(1.0, longest_step_rad / std::max(step.norm(), 1e-300));
    bool better = false;
    for (int halving = 0; halving < 30 && !better; ++halving) {
      const Eigen::Vector3d direction =
          (state.field_in_table / F + state.tangents * step).normalized();
      State next = at(F * direction);
      const double next_cost = cost(next, sigma);
      // Near the minimum the cost's own rounding must not stop the last steps.
      better = next_cost <= (1.0 + 1e-12) * current;
      if (better) {
        state = std::move(next);
        current = next_cost;
      } else {
        step *= 0.5;
      }
    }
    if (!better || step.norm() < 1e-14) {
      break;
    }
  }
  return state;
}

// Where [1, vec R_i] has rank 10, M_k = S_k^T f^T follows linearly, and f is the first right
// singular vector of all of them below each other.
std::optional<Eigen::Vector3d> linear_start(const ReadingSet& set, const Eigen::MatrixXd& weights) {
  if (set.size() < 10) {
    return std::nullopt;
  }
  Eigen::MatrixXd Z(set.size(), 10);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Eigen::Matrix3d R = set.readings[at].level * set.rotation_sensor_from_table[at];
    Z(i, 0) = 1.0;
    Z.row(i).tail<9>() = R.reshaped().transpose();
  }
  if (!undetermined_columns(Z).empty()) {
    return std::nullopt;
  }
  Eigen::MatrixXd M(3 * set.axis_count(), 3);
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const Eigen::VectorXd estimate =
        LeastSquaresDesign(Z, weights.col(k)).estimate(set.response.col(k));
    M.middleRows<3>(3 * k) = estimate.tail<9>().reshaped(3, 3);
  }
  return Eigen::JacobiSVD<Eigen::MatrixXd>(M, Eigen::ComputeThinV).matrixV().col(0);
}

// Readings less 4, less the axis's share in the two directions.
struct Shares {
  Eigen::Matrix2d direction_covariance;  // of the tangents [rad^2]
  Eigen::VectorXd degrees_of_freedom;
};

Shares shares_of(const ReadingSet& set,
                 const JointFit& fit,
                 const State& state,
                 const Eigen::VectorXd& sigma) {
  const Eigen::MatrixXd T = fit.stacked(state, sigma, &AxisState::projected);
  const Eigen::MatrixXd whole = fit.stacked(state, sigma, &AxisState::tangents);
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(T, Eigen::ComputeThinU | Eigen::ComputeThinV);
  Shares shares;
  shares.degrees_of_freedom.resize(set.axis_count());
  Eigen::Vector2d inverse = Eigen::Vector2d::Zero();
  for (Eigen::Index j = 0; j < 2; ++j) {
    const double s = svd.singularValues()(j);
    inverse(j) = s > confounded_below * whole.norm() ? 1.0 / s : 0.0;
  }
  const Eigen::Matrix2d root = svd.matrixV() * inverse.asDiagonal();
  shares.direction_covariance = root * root.transpose();
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const Eigen::MatrixXd part = T.middleRows(k * set.size(), set.size()) * root;
    shares.degrees_of_freedom(k) =
        static_cast<double>(state.axes[static_cast<std::size_t>(k)].design->observations()) - 4.0 -
        part.squaredNorm();
  }
  return shares;
}

Eigen::VectorXd scatter(const ReadingSet& set,
                        const State& state,
                        const Eigen::VectorXd& degrees_of_freedom) {
  Eigen::VectorXd sigma(set.axis_count());
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const double rss = state.axes[static_cast<std::size_t>(k)].residuals.squaredNorm();
    sigma(k) = std::max(std::sqrt(rss / degrees_of_freedom(k)), set.rounding(k));
  }
  return sigma;
}

struct Solution {
  State state;
  Eigen::VectorXd sigma;
  Shares shares;
  bool weights_are_estimated = false;
};

// One scatter for all axes; 1 where there is nothing to estimate it from.
double pooled_scatter(const ReadingSet& set, const State& state, double dof) {
  if (!(dof > 0.5)) {
    return 1.0;
  }
  double rss = 0.0;
  for (const AxisState& axis : state.axes) {
    rss += axis.residuals.squaredNorm();
  }
  return std::max(std::sqrt(rss / dof), set.rounding());
}

// The axes' noise is not known: weights are iterated from equal ones.
Solution solve(const ReadingSet& set, const JointFit& fit, const Eigen::Vector3d& start) {
  Eigen::VectorXd sigma = Eigen::VectorXd::Ones(set.axis_count());
  State state = fit.converged(start, sigma);
  const Shares unscaled = shares_of(set, fit, state, sigma);
  sigma.setConstant(pooled_scatter(set, state, unscaled.degrees_of_freedom.sum()));
  const Shares shares = shares_of(set, fit, state, sigma);
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
    solution.state = fit.converged(solution.state.field_in_table, solution.sigma);
    solution.shares = shares_of(set, fit, solution.state, solution.sigma);
    if (change < 1e-12) {
      break;
    }
  }
  return solution;
}

// The whole Jacobian: 4 columns for each axis, then the two tangents; each axis in its sigma.
Eigen::MatrixXd whole_jacobian(const ReadingSet& set,
                               const State& state,
                               const Eigen::VectorXd& sigma) {
  const Eigen::Index n = set.size();
  const Eigen::Index m = set.axis_count();
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(n * m, 4 * m + 2);
  for (Eigen::Index k = 0; k < m; ++k) {
    const AxisState& axis = state.axes[static_cast<std::size_t>(k)];
    J.block(n * k, 4 * k, n, 4) = axis.root_weights.asDiagonal() * state.X / sigma(k);
    J.block(n * k, 4 * m, n, 2) = axis.tangents / sigma(k);
  }
  return J;
}

double condition_of(const Eigen::MatrixXd& J) {
  const Eigen::MatrixXd scaled = J * J.colwise().norm().cwiseInverse().asDiagonal();
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(scaled);
  const Eigen::MatrixXd R =
      qr.matrixQR().topRows(J.cols()).triangularView<Eigen::Upper>().toDenseMatrix();
  const Eigen::VectorXd singular = Eigen::JacobiSVD<Eigen::MatrixXd>(R).singularValues();
  return singular(0) / singular(singular.size() - 1);
}

void require_direction(const ReadingSet& set, const Solution& solution) {
  const Eigen::MatrixXd J = whole_jacobian(set, solution.state, solution.sigma);
  const Eigen::Index parameters = J.cols();
  std::vector<Eigen::Index> open;
  if (J.rows() >= parameters) {
    const Eigen::MatrixXd scaled = J * J.colwise().norm().cwiseInverse().asDiagonal();
    Eigen::JacobiSVD<Eigen::MatrixXd> svd(scaled, Eigen::ComputeFullV);
    for (Eigen::Index j = 0; j < parameters; ++j) {
      double share = 0.0;
      for (Eigen::Index s = 0; s < parameters; ++s) {
        if (svd.singularValues()(s) < confounded_below * svd.singularValues()(0)) {
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
  std::vector<std::string> all = parameter_names(set.axes);
  all.insert(all.end(), {"direction of the field", "direction of the field"});
  std::vector<std::string> names;
  for (const Eigen::Index j : open) {
    const std::string& name = all[static_cast<std::size_t>(j)];
    if (names.empty() || names.back() != name) {
      names.push_back(name);
    }
  }
  const std::string points = points_to_add(J, [&](const DesignPoint& point) {
    const Eigen::Matrix3d R = set.orientation(point);
    const Eigen::Index m = set.axis_count();
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(m, 4 * m + 2);
    for (Eigen::Index k = 0; k < m; ++k) {
      const Eigen::Vector3d S = solution.state.axes[static_cast<std::size_t>(k)].estimate.tail<3>();
      const double F = solution.state.field_in_table.norm();
      rows(k, 4 * k) = 1.0 / solution.sigma(k);
      rows.block<1, 3>(k, 4 * k + 1) =
          (R * solution.state.field_in_table).transpose() / solution.sigma(k);
      rows.block<1, 2>(k, 4 * m) =
          F * S.transpose() * R * solution.state.tangents / solution.sigma(k);
    }
    return rows;
  });
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
  const Eigen::Matrix2d C = factor * solution.shares.direction_covariance;
  const Eigen::Matrix<double, 3, 2> T =
      solution.state.field_in_table.norm() * solution.state.tangents;
  estimate.field_covariance = T * C * T.transpose();
  estimate.field_degrees_of_freedom =
      solution.weights_are_estimated ? 1.0 / (p.square() / nu.array()).sum() : nu.sum();
  estimate.direction_se_rad = std::sqrt(Eigen::JacobiSVD<Eigen::Matrix2d>(C).singularValues()(0));
}

// Leverages, standard errors and covariance at the solution, by the given weights.
Estimate describe(const ReadingSet& set,
                  const Solution& solution,
                  const Eigen::MatrixXd& robust_weights) {
  const Eigen::Index m = set.axis_count();
  const State& state = solution.state;
  const Eigen::Matrix2d& C = solution.shares.direction_covariance;
  Estimate estimate;
  RegressionRows rows = rows_of_readings(set);
  estimate.statistics = blank_statistics(set, rows);
  FitStatistics& statistics = estimate.statistics;
  statistics.degrees_of_freedom = solution.shares.degrees_of_freedom;
  statistics.residual_sd = Eigen::VectorXd::Constant(m, std::numeric_limits<double>::quiet_NaN());
  statistics.condition_number = condition_of(whole_jacobian(set, state, solution.sigma));
  estimate.response.bias.resize(m);
  estimate.response.sensitivity.resize(m, 3);
  estimate.field_in_table = state.field_in_table;
  for (Eigen::Index k = 0; k < m; ++k) {
    const AxisState& axis = state.axes[static_cast<std::size_t>(k)];
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
      const AxisState& other = state.axes[static_cast<std::size_t>(l)];
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
                         const State& state,
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

Estimate robust_estimate(const ReadingSet& set, const Solution& plain) {
  if (plain.shares.degrees_of_freedom.minCoeff() < 2.0) {
    throw RefusedError(
        "robust regression needs at least two readings more than coefficients; add readings or "
        "leave --robust out");
  }
  const Eigen::MatrixXd leverage =
      leverage_of(describe(set, plain, Eigen::MatrixXd::Ones(set.size(), set.axis_count())));
  Eigen::MatrixXd robust = Eigen::MatrixXd::Ones(set.size(), set.axis_count());
  State state = plain.state;
  Eigen::VectorXd sigma = plain.sigma;
  for (int round = 0; round < 100; ++round) {
    const RobustRound next = robust_round(set, state, leverage, plain.shares.degrees_of_freedom);
    const double change = (next.weights - robust).cwiseAbs().maxCoeff();
    robust = next.weights;
    sigma = next.sigma;
    const Eigen::MatrixXd weights = set.weights.cwiseProduct(robust);
    state = JointFit(set, weights).converged(state.field_in_table, sigma);
    if (change < 1e-9) {
      break;
    }
  }
  // Covariance by the given weights and the robust scatter; estimate and residuals are the robust.
  const JointFit given(set, set.weights);
  Solution solution{.state = given.at(state.field_in_table), .sigma = sigma, .shares = {}};
  solution.shares = shares_of(set, given, solution.state, sigma);
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    AxisState& axis = solution.state.axes[static_cast<std::size_t>(k)];
    axis.estimate = state.axes[static_cast<std::size_t>(k)].estimate;
    axis.residuals = axis.root_weights.cwiseProduct(set.response.col(k) - state.X * axis.estimate);
  }
  return describe(set, solution, robust);
}

}  // namespace

Estimate estimate_joint(const ReadingSet& set, const Eigen::Vector3d& start_in_table) {
  const double F = start_in_table.norm();
  require_determined(set, field_design(set, start_in_table), [&](const DesignPoint& point) {
    Eigen::RowVector4d row;
    row << 1.0, (set.orientation(point) * start_in_table).transpose();
    return row;
  });
  require_response(set);
  Eigen::Vector3d start = start_in_table;
  if (const std::optional<Eigen::Vector3d> direction = linear_start(set, set.weights)) {
    // (S, f) and (-S, -f) fit alike: the given direction decides.
    start = std::copysign(F, direction->dot(start_in_table)) * *direction;
  }
  const JointFit fit(set, set.weights);
  Solution solution = solve(set, fit, start);
  if (solution.state.field_in_table.dot(start_in_table) < 0.0) {
    solution.state = fit.at(-solution.state.field_in_table);
    solution.shares = shares_of(set, fit, solution.state, solution.sigma);
  }
  require_direction(set, solution);
  require_degrees_of_freedom(set, solution);
  Estimate estimate =
      set.robust ? robust_estimate(set, solution) : describe(set, solution, Eigen::MatrixXd());

  estimate.levelness =
      estimate_levelness(set, find_opposite_pairs(set).pairs, estimate.response.sensitivity, F);
  return estimate;
}

}  // namespace axiscal
