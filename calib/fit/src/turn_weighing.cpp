// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/src/turn_weighing.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <Eigen/LU>

#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/field/earth_rotation_field.hpp"
#include "calib/regression/factor.hpp"
#include "calib/regression/variance_components.hpp"

namespace axiscal {
namespace {

constexpr Eigen::Index parameters = 12;
constexpr double as_good_as_infinite = 1e6;  // degrees of freedom that stand for infinity

// Returns a matrix that selects the components of a turn's residual that contain information. If
// the cube's orientations before and after the turn are known, all three components do. Otherwise
// only the two components perpendicular to the vertical do.
Eigen::Matrix3d informative_rows(const GyroscopeTurn& turn) {
  if (turn.rotation_before_from_after) {
    return Eigen::Matrix3d::Identity();
  }
  Eigen::Matrix3d rows = Eigen::Matrix3d::Zero();
  rows.topRows<2>() = tangents_of(turn.up_before).transpose();
  return rows;
}

// Returns the derivative of a turn's residual with respect to a small rotation of R. The rotation
// is stated in the sensor's frame before the turn.
// @param R  R(T) of TurnSystem::rotations.
Eigen::Matrix3d change_with_rotation(const GyroscopeTurn& turn, const Eigen::Matrix3d& R) {
  return turn.rotation_before_from_after ? Eigen::Matrix3d(-Eigen::Matrix3d::Identity())
                                         : cross_matrix(R * turn.up_after.normalized());
}

// Errors that the turns share, scaled to variance 1. They are unknowns of the problem.
struct SharedErrors {
  std::string name;
  double input_u = not_a_number;
  std::string unit;
  Eigen::MatrixXd columns;  // 3 n x q: their effect on the residuals
};

// Computes the effect of errors of the Earth's rotation on the residuals. The heading is unknown.
// If a turn begins in the period of rest in which the previous turn ended, its heading follows from
// the previous turn. Otherwise its heading is a new unknown.
SharedErrors rotation_of_earth(const TurnSystem& system, const TurnFitOptions& options) {
  const auto n = static_cast<Eigen::Index>(system.turns.size());
  const Eigen::Index chains =
      1 + std::count_if(system.turns.begin() + 1, system.turns.end(),
                        [](const GyroscopeTurn& turn) { return !turn.follows; });
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(3 * n, 1 + 2 * chains);
  Eigen::Matrix3d sensor_from_table;  // the last column is the upward vertical
  Eigen::Index chain = -1;
  for (Eigen::Index i = 0; i < n; ++i) {
    const GyroscopeTurn& turn = system.turns[static_cast<std::size_t>(i)];
    if (i == 0 || !turn.follows) {
      const Eigen::Vector3d up =
          turn.up_before.isZero(0.0) ? Eigen::Vector3d::UnitZ() : turn.up_before.normalized();
      sensor_from_table << tangents_of(up), up;
      ++chain;
    }
    const Eigen::Matrix3d& R = system.rotations[static_cast<std::size_t>(i)];
    const double seconds = turn.time_s.back() - turn.time_s.front();
    const Eigen::Matrix3d changes = -seconds * change_with_rotation(turn, R) * sensor_from_table;
    columns.block<3, 1>(3 * i, 0) = options.earth_up_u * changes.col(2);
    columns.block<3, 2>(3 * i, 1 + 2 * chain) = options.earth_across_u * changes.leftCols<2>();
    sensor_from_table = (R.transpose() * sensor_from_table).eval();
  }
  return {.name = "rotation of the Earth",
          .input_u = std::hypot(options.earth_up_u, std::sqrt(2.0) * options.earth_across_u),
          .unit = "rad/s",
          .columns = columns.rightCols(columns.cols() - (options.earth_up_u > 0.0 ? 0 : 1))};
}

// Computes the effect of errors of the attitudes at rest on the residuals. These are errors of the
// measured directions or of the cube's face normals.
SharedErrors errors_at_rests(const TurnSystem& system) {
  const auto n = static_cast<Eigen::Index>(system.turns.size());
  const Eigen::Index parts = system.turns.front().errors_before.cols();
  SharedErrors shared{
      .name = system.turns.front().rotation_before_from_after ? "positioner" : "directions",
      .unit = {},
      .columns = Eigen::MatrixXd::Zero(3 * n, parts)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const GyroscopeTurn& turn = system.turns[static_cast<std::size_t>(i)];
    if (turn.errors_before.cols() != parts || turn.errors_after.cols() != parts) {
      throw DomainError("fit_turns: all turns must have the same number of shared errors");
    }
    shared.columns.middleRows<3>(3 * i) =
        turn.errors_before - system.rotations[static_cast<std::size_t>(i)] * turn.errors_after;
  }
  return shared;
}

// Divides the turns into units of up to 24 consecutive turns. The errors of different units are
// treated as independent, although two units may share one rest.
std::vector<std::pair<Eigen::Index, Eigen::Index>> units_of(std::span<const GyroscopeTurn> turns) {
  constexpr Eigen::Index most = 24;
  std::vector<std::pair<Eigen::Index, Eigen::Index>>
      units;  // index of the first turn, number of turns
  for (std::size_t i = 0; i < turns.size(); ++i) {
    if (units.empty() || !turns[i].follows || units.back().second == most) {
      units.emplace_back(static_cast<Eigen::Index>(i), 0);
    }
    ++units.back().second;
  }
  return units;
}

class TurnWeighing {
 public:
  TurnWeighing(const TurnSystem& system, const RestFit& rests, const TurnFitOptions& options)
      : system_(system), rests_(rests), units_(units_of(system.turns)) {
    for (const auto& [first, count] : units_) {
      rows_ = std::max(rows_, 3 * count);
    }
    if (options.whole_budget) {
      if (system.turns.front().errors_before.cols() > 0) {
        shared_.push_back(errors_at_rests(system));
      }
      if (options.earth_up_u > 0.0 || options.earth_across_u > 0.0) {
        shared_.push_back(rotation_of_earth(system, options));
      }
    }
    put_columns(options.fit_bias);
    put_scatter(options.whole_budget);
  }

  [[nodiscard]] WeighedTurns weighed(double start_sd_rad) {
    const double variance = start_sd_rad * start_sd_rad;
    std::optional<VarianceFit> fit;
    if (problem_.roots.size() > 1) {
      fit = fit_variance_components(problem_, Eigen::Vector2d(variance, 0.25 * variance));
    }
    if (!fit) {
      problem_.roots.resize(1);
      problem_.smallest.conservativeResize(1);
      fit = fit_variance_components(problem_, Eigen::VectorXd::Constant(1, variance));
    }
    if (!fit) {
      throw RefusedError(
          "the turns do not determine the sensitivity of the gyroscope together with its uncertain "
          "bias");
    }
    return result_of(*fit);
  }

 private:
  [[nodiscard]] Eigen::Index first_row(std::size_t unit) const {
    return rows_ * static_cast<Eigen::Index>(unit);
  }

  // Returns the rows of all turns, with only the components that contain information, ordered by
  // units.
  [[nodiscard]] Eigen::MatrixXd by_units(const Eigen::MatrixXd& by_turns) const {
    Eigen::MatrixXd rows =
        Eigen::MatrixXd::Zero(rows_ * static_cast<Eigen::Index>(units_.size()), by_turns.cols());
    for (std::size_t u = 0; u < units_.size(); ++u) {
      for (Eigen::Index t = 0; t < units_[u].second; ++t) {
        const Eigen::Index i = units_[u].first + t;
        rows.middleRows<3>(first_row(u) + 3 * t) =
            informative_rows(system_.turns[static_cast<std::size_t>(i)]) *
            by_turns.middleRows<3>(3 * i);
      }
    }
    return rows;
  }

  // Fills in the columns of the problem. The unknowns are the sensitivities, the biases, and the
  // errors shared by the turns. If the biases are not fitted, their covariance from the rests is a
  // prior.
  void put_columns(bool fit_bias) {
    const bool prior = !fit_bias && rests_.bias_covariance.trace() > 0.0;
    const Eigen::Index free = 9 + (fit_bias ? 3 : 0);
    bias_columns_ = prior ? 3 : 0;
    problem_.prior = bias_columns_;
    for (const SharedErrors& shared : shared_) {
      problem_.prior += shared.columns.cols();
    }
    to_parameters_ = Eigen::MatrixXd::Zero(parameters, free + problem_.prior);
    const Eigen::MatrixXd root =
        prior ? covariance_root(rests_.bias_covariance) : Eigen::MatrixXd::Identity(3, 3);
    for (Eigen::Index k = 0; k < 3; ++k) {
      to_parameters_.block<3, 3>(4 * k + 1, 3 * k).setIdentity();
      if (fit_bias || prior) {
        to_parameters_.block<1, 3>(4 * k, 9) = root.row(k);
      }
    }
    Eigen::MatrixXd columns = system_.jacobian * to_parameters_;
    Eigen::Index at = free + bias_columns_;
    for (const SharedErrors& shared : shared_) {
      columns.middleCols(at, shared.columns.cols()) = shared.columns;
      at += shared.columns.cols();
    }
    problem_.W = by_units(columns);
    problem_.y = -by_units(system_.residuals);
  }

  // Transforms the rows of each unit so that their errors are independent.
  [[nodiscard]] Eigen::MatrixXd apart(Eigen::MatrixXd by_units) const {
    for (std::size_t u = 0; u < units_.size(); ++u) {
      by_units.middleRows(first_row(u), rows_) =
          (to_apart_[u] * by_units.middleRows(first_row(u), rows_)).eval();
    }
    return by_units;
  }

  // Returns the matrix K of a unit: the derivative of its rows with respect to the errors at the
  // rests, three for each rest.
  [[nodiscard]] Eigen::MatrixXd errors_at_rests_of(
      const std::pair<Eigen::Index, Eigen::Index>& unit) const {
    const auto& [first, count] = unit;
    Eigen::MatrixXd at_rests = Eigen::MatrixXd::Zero(rows_, rows_ + 3);
    for (Eigen::Index t = 0; t < count; ++t) {
      const auto i = static_cast<std::size_t>(first + t);
      const Eigen::Matrix3d rows = informative_rows(system_.turns[i]);
      at_rests.block<3, 3>(3 * t, 3 * t) = rows;
      at_rests.block<3, 3>(3 * t, 3 * (t + 1)) = -rows * system_.rotations[i];
    }
    return at_rests;
  }

  // Makes the errors of all rows independent. The errors of a unit have two parts. The turns' own
  // errors have a covariance proportional to D D^T. The errors at the rests between the turns have
  // a covariance proportional to K K^T. In the basis of the eigenvectors of D^-1 K K^T D^-1, both
  // covariances are diagonal for any values of the two variances. Each row can then be treated
  // separately. If the rests have no errors, a division by D is sufficient.
  void put_scatter(bool by_rests) {
    const Eigen::Index informative = (problem_.W.rowwise().squaredNorm().array() > 0.0).count();
    constexpr Eigen::Index fewest = 18;  // degrees of freedom needed to separate two variances
    by_rests = by_rests && informative - (to_parameters_.cols() - problem_.prior) >= fewest;
    problem_.rows = 1;
    problem_.roots.assign(by_rests ? 2 : 1, Eigen::MatrixXd::Zero(problem_.y.size(), 1));
    for (std::size_t u = 0; u < units_.size(); ++u) {
      std::vector<Eigen::Index> said;                          // rows that contain information
      Eigen::VectorXd per_own = Eigen::VectorXd::Zero(rows_);  // diagonal of D^-1
      for (Eigen::Index t = 0; t < units_[u].second; ++t) {
        const auto i = static_cast<std::size_t>(units_[u].first + t);
        const Eigen::Vector3d says = informative_rows(system_.turns[i]).rowwise().norm();
        for (Eigen::Index k = 0; k < 3; ++k) {
          if (says(k) > 0.0) {
            per_own(3 * t + k) = 1.0 / says(k);
            said.push_back(3 * t + k);
          }
        }
      }
      const auto count = static_cast<Eigen::Index>(said.size());
      Eigen::MatrixXd& to_apart = to_apart_.emplace_back(Eigen::MatrixXd::Zero(rows_, rows_));
      problem_.roots[0].middleRows(first_row(u), count).setOnes();
      if (!by_rests) {
        for (Eigen::Index row = 0; row < count; ++row) {
          const Eigen::Index from = said[static_cast<std::size_t>(row)];
          to_apart(row, from) = per_own(from);
        }
        continue;
      }
      const Eigen::MatrixXd relative =
          (per_own.asDiagonal() * errors_at_rests_of(units_[u]))(said, Eigen::all);
      const SymmetricEigen eigen = symmetric_eigen(relative * relative.transpose());
      to_apart.topRows(count)(Eigen::all, said) = eigen.vectors.transpose();
      to_apart *= per_own.asDiagonal();
      problem_.roots[1].middleRows(first_row(u), count) = eigen.values.cwiseMax(0.0).cwiseSqrt();
    }
    problem_.W = apart(std::move(problem_.W));
    const Eigen::VectorXd y = problem_.y;
    problem_.y = apart(y);
    // The variance of the turns' own errors stays above 0, so that the covariance of the rows has
    // an inverse.
    const double mean_square =
        y.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(informative, 1));
    problem_.smallest = Eigen::VectorXd::Zero(by_rests ? 2 : 1);
    problem_.smallest(0) = 1e-6 * mean_square;
  }

  // Returns the contribution of unknowns with a prior to the covariance of the parameters.
  [[nodiscard]] Eigen::MatrixXd share_of_prior(const VarianceFit& fit,
                                               Eigen::Index at,
                                               Eigen::Index columns) const {
    const Eigen::MatrixXd half = to_parameters_ * fit.covariance.middleCols(at, columns);
    return half * half.transpose();
  }

  [[nodiscard]] Eigen::MatrixXd of_parameters(const Eigen::MatrixXd& of_unknowns) const {
    return to_parameters_ * of_unknowns * to_parameters_.transpose();
  }

  [[nodiscard]] WeighedTurns result_of(const VarianceFit& fit) const {
    const bool by_rests = fit.theta.size() > 1;
    WeighedTurns result{.step = to_parameters_ * fit.estimate,
                        .sd_rad = std::sqrt(fit.theta(0) + (by_rests ? 2.0 * fit.theta(1) : 0.0)),
                        .rest_sd_rad = by_rests ? std::sqrt(fit.theta(1)) : 0.0,
                        .covariance = of_parameters(fit.scatter()),
                        .interval_95 = Eigen::VectorXd(parameters),
                        .interval_dof = Eigen::VectorXd(parameters)};
    Eigen::Index at = fit.estimate.size() - problem_.prior;
    Eigen::MatrixXd by_bias = Eigen::MatrixXd::Zero(parameters, parameters);
    if (bias_columns_ > 0) {
      by_bias = share_of_prior(fit, at, bias_columns_);
      at += bias_columns_;
      result.components.push_back(
          {.name = "bias",
           .sd = rests_.bias_covariance.diagonal().cwiseSqrt(),
           .unit = {},
           .covariance = by_bias,
           .degrees_of_freedom = std::min(rests_.degrees_of_freedom, as_good_as_infinite)});
    }
    // The component "rests" is the change of the bias between periods of rest.
    Eigen::MatrixXd by_rest = Eigen::MatrixXd::Zero(parameters, parameters);
    if (bias_columns_ > 0 && rests_.between_rests.maxCoeff() > 0.0) {
      for (Eigen::Index k = 0; k < 3; ++k) {
        by_rest(4 * k, 4 * k) = rests_.between_rests(k) * rests_.between_rests(k);
      }
      result.components.push_back(
          {.name = "rests",
           .sd = rests_.between_rests,
           .unit = {},
           .covariance = by_rest,
           .degrees_of_freedom = rests_.between_degrees_of_freedom.minCoeff()});
    }
    for (Eigen::Index i = 0; i < parameters; ++i) {
      const CombinedUncertainty interval = interval_of(fit, i, by_bias(i, i), by_rest(i, i));
      result.interval_95(i) = interval.expanded;
      result.interval_dof(i) = interval.degrees_of_freedom;
      if (i % 4 > 0) {  // a sensitivity
        result.degrees_of_freedom =
            std::min(result.degrees_of_freedom, interval.degrees_of_freedom);
      }
    }
    result.covariance += by_bias + by_rest;
    add_sources(fit, at, result.sources);
    return result;
  }

  [[nodiscard]] CombinedUncertainty interval_of(const VarianceFit& fit,
                                                Eigen::Index parameter,
                                                double by_bias,
                                                double by_rest) const {
    Eigen::VectorXd h(fit.theta.size());
    for (Eigen::Index q = 0; q < h.size(); ++q) {
      const Eigen::RowVectorXd row = to_parameters_.row(parameter);
      h(q) = row.dot(fit.unit_shares[static_cast<std::size_t>(q)] * row.transpose());
    }
    VarianceShares shares;
    shares.components.push_back(
        {.variance = h.dot(fit.theta), .degrees_of_freedom = fit.degrees_of_freedom_of(h)});
    if (by_bias > 0.0) {
      shares.components.push_back(
          {.variance = by_bias, .degrees_of_freedom = rests_.degrees_of_freedom});
    }
    if (by_rest > 0.0) {
      shares.components.push_back(
          {.variance = by_rest,
           .degrees_of_freedom = rests_.between_degrees_of_freedom(parameter / 4)});
    }
    return combine(shares);
  }

  void add_sources(const VarianceFit& fit,
                   Eigen::Index at,
                   std::vector<UncertaintySource>& sources) const {
    const auto add = [&](std::string name, double u, std::string unit, Eigen::MatrixXd covariance) {
      sources.push_back({.name = std::move(name),
                         .type = "B",
                         .distribution = "normal",
                         .input_u = u,
                         .input_unit = std::move(unit),
                         .degrees_of_freedom = std::numeric_limits<double>::infinity(),
                         .covariance = std::move(covariance)});
    };
    for (const SharedErrors& shared : shared_) {
      add(shared.name, shared.input_u, shared.unit, share_of_prior(fit, at, shared.columns.cols()));
      at += shared.columns.cols();
    }
    if (system_.sampling.size() > 0) {
      VarianceProblem sampled = problem_;
      sampled.y = apart(by_units(system_.sampling));
      if (const auto moved = fit_at_variances(sampled, fit.theta)) {
        const Eigen::VectorXd change = to_parameters_ * moved->estimate;
        add("sampling",
            std::sqrt(system_.sampling.squaredNorm() /
                      static_cast<double>(system_.sampling.size())),
            "rad", change * change.transpose());
      }
    }
  }

  const TurnSystem& system_;
  const RestFit& rests_;
  std::vector<std::pair<Eigen::Index, Eigen::Index>> units_;
  std::vector<SharedErrors> shared_;
  Eigen::Index rows_ = 0;  // number of rows of each unit; shorter units end with rows of zeros
  std::vector<Eigen::MatrixXd> to_apart_;
  VarianceProblem problem_;
  Eigen::Index bias_columns_ = 0;
  Eigen::MatrixXd to_parameters_;  // 12 x unknowns
};

}  // namespace

WeighedTurns weigh_turns(const TurnSystem& system,
                         const RestFit& rests,
                         const TurnFitOptions& options,
                         double start_sd_rad) {
  return TurnWeighing(system, rests, options).weighed(start_sd_rad);
}

RestFit without_earth(RestFit rests, const Eigen::Matrix3d& B) {
  const Eigen::Vector3d per_rate = B.inverse().rowwise().norm();
  for (int k = 0; k < 3; ++k) {
    // The largest effect of the Earth's rotation on this component of the bias.
    const double of_earth = earth_rate_rad_per_s * per_rate(k);
    const double square = rests.between_rests(k) * rests.between_rests(k) - of_earth * of_earth;
    rests.between_rests(k) = std::sqrt(std::max(square, 0.0));
  }
  return rests;
}

}  // namespace axiscal
