// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/noise_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/QR>

#include "axiscal/core/error.hpp"

namespace axiscal {
namespace {

constexpr std::size_t kinds = all_noise_kinds.size();

// Non-negative weighted least squares by trying every set of columns: there are 31. A further kind
// of noise must earn its place: flicker and random walk, say, fit a few uncertain points alike.
constexpr double price_of_a_kind = 4.0;  // in chi^2

struct Solution {
  Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(kinds));
  Eigen::VectorXd standard_errors = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(kinds));
  double cost = std::numeric_limits<double>::infinity();
};

Solution solve_not_negative(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  Solution best;
  for (unsigned set = 1; set < (1U << kinds); ++set) {
    std::vector<Eigen::Index> columns;
    for (std::size_t k = 0; k < kinds; ++k) {
      if ((set >> k & 1U) != 0) {
        columns.push_back(static_cast<Eigen::Index>(k));
      }
    }
    const auto p = static_cast<Eigen::Index>(columns.size());
    if (p > A.rows()) {
      continue;
    }
    Eigen::MatrixXd part = A(Eigen::seqN(0, A.rows()), columns);
    const Eigen::VectorXd lengths = part.colwise().norm();
    part = part * lengths.cwiseInverse().asDiagonal();
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(part);
    if (qr.rank() < p) {
      continue;
    }
    const Eigen::VectorXd x = qr.solve(b).cwiseQuotient(lengths);
    if ((x.array() < 0.0).any()) {
      continue;
    }
    const double cost = (A(Eigen::seqN(0, A.rows()), columns) * x - b).squaredNorm() +
                        price_of_a_kind * static_cast<double>(p);
    if (cost < best.cost) {
      best.cost = cost;
      best.coefficients.setZero();
      best.standard_errors.setZero();
      const Eigen::MatrixXd inverse = qr.solve(Eigen::MatrixXd::Identity(part.rows(), part.rows()));
      for (Eigen::Index j = 0; j < p; ++j) {
        best.coefficients(columns[static_cast<std::size_t>(j)]) = x(j);
        best.standard_errors(columns[static_cast<std::size_t>(j)]) =
            inverse.row(j).norm() / lengths(j);
      }
    }
  }
  return best;
}

}  // namespace

std::string noise_name(NoiseKind kind) {
  static constexpr std::array<const char*, kinds> names = {
      "quantisation", "white", "bias_instability", "random_walk", "ramp"};
  return names[static_cast<std::size_t>(kind)];
}

double allan_variance_of(NoiseKind kind, double tau_s) {
  switch (kind) {
    case NoiseKind::quantisation:
      return 3.0 / (tau_s * tau_s);
    case NoiseKind::white:
      return 1.0 / tau_s;
    case NoiseKind::bias_instability:
      return 2.0 * std::numbers::ln2 / std::numbers::pi;
    case NoiseKind::random_walk:
      return tau_s / 3.0;
    case NoiseKind::ramp:
      break;
  }
  return 0.5 * tau_s * tau_s;
}

double NoiseModel::coefficient(NoiseKind kind) const {
  return coefficients.at(static_cast<std::size_t>(kind)).value;
}

double NoiseModel::deviation_at(double tau_s) const {
  double variance = 0.0;
  for (const NoiseCoefficient& one : coefficients) {
    variance += one.value * one.value * allan_variance_of(one.kind, tau_s);
  }
  return std::sqrt(variance);
}

NoiseModel fit_noise(std::span<const AllanPoint> curve) {
  if (curve.size() < 3) {
    throw DomainError("fit_noise: three points of the curve or more are needed");
  }
  const auto n = static_cast<Eigen::Index>(curve.size());
  Eigen::MatrixXd A(n, static_cast<Eigen::Index>(kinds));
  Eigen::VectorXd variance(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const AllanPoint& point = curve[static_cast<std::size_t>(i)];
    variance(i) = std::max(point.deviation * point.deviation, 1e-300);
    for (std::size_t k = 0; k < kinds; ++k) {
      A(i, static_cast<Eigen::Index>(k)) = allan_variance_of(all_noise_kinds[k], point.tau_s);
    }
  }
  // Weights by the curve itself first, then by the fit: else points that happen to be low count
  // more. At the start those of few degrees of freedom, which may be very low, hardly count.
  constexpr double well_known = 10.0;  // degrees of freedom
  Eigen::VectorXd expected = variance;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (curve[static_cast<std::size_t>(i)].degrees_of_freedom < well_known) {
      expected(i) = 1e3 * variance.maxCoeff();
    }
  }
  Solution solution;
  for (int round = 0; round < 5; ++round) {
    Eigen::VectorXd root_weights(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double nu = std::max(curve[static_cast<std::size_t>(i)].degrees_of_freedom, 1.0);
      root_weights(i) = std::sqrt(0.5 * nu) / expected(i);
    }
    solution =
        solve_not_negative(root_weights.asDiagonal() * A, root_weights.cwiseProduct(variance));
    expected = (A * solution.coefficients).cwiseMax(1e-3 * variance);
  }
  constexpr double coverage = 2.0 * 1.959963984540054;
  NoiseModel model;
  for (std::size_t k = 0; k < kinds; ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    const double square = solution.coefficients(at);
    const double se = coverage * solution.standard_errors(at);
    NoiseCoefficient one{.kind = all_noise_kinds[k], .value = std::sqrt(square)};
    if (square > 0.0) {
      one.low = std::sqrt(std::max(0.0, square - se));
      one.high = std::sqrt(square + se);
    } else {
      // Where it would reach half of the curve's lowest share, it would be seen.
      one.high = std::sqrt((0.5 * variance.cwiseQuotient(A.col(at))).minCoeff());
    }
    model.coefficients.push_back(one);
  }
  return model;
}

double coefficient_by_slope(NoiseKind kind, std::span<const AllanPoint> points) {
  if (points.empty()) {
    throw DomainError("coefficient_by_slope: points of the curve are needed");
  }
  double sum = 0.0;
  for (const AllanPoint& point : points) {
    sum += std::log(point.deviation) - 0.5 * std::log(allan_variance_of(kind, point.tau_s));
  }
  return std::exp(sum / static_cast<double>(points.size()));
}

Dwell best_dwell(const NoiseModel& model, double longest_s) {
  Dwell dwell{.deviation = std::numeric_limits<double>::infinity()};
  constexpr double ratio = 1.02;
  const double shortest_s = 1e-6 * longest_s;
  for (double tau = longest_s; tau > shortest_s; tau /= ratio) {
    const double deviation = model.deviation_at(tau);
    if (deviation < dwell.deviation) {
      dwell.deviation = deviation;
      dwell.best_s = tau;
    }
  }
  dwell.beyond_record = dwell.best_s > longest_s / (1.5 * ratio);
  for (double tau = dwell.best_s;
       tau > shortest_s && model.deviation_at(tau) <= 1.1 * dwell.deviation; tau /= ratio) {
    dwell.sensible_s = tau;
  }
  dwell.sensible_deviation = model.deviation_at(dwell.sensible_s);
  return dwell;
}

}  // namespace axiscal
