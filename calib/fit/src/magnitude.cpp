// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/magnitude.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>

#include "axis_regression.hpp"
#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/gauss_newton.hpp"
#include "axiscal/calib/joint_fit.hpp"
#include "axiscal/calib/least_squares.hpp"
#include "axiscal/calib/magnitude_fit.hpp"
#include "axiscal/calib/minimum_norm.hpp"
#include "axiscal/calib/robust.hpp"
#include "axiscal/calib/scaled_qr.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/rotation.hpp"

namespace axiscal {
namespace {

constexpr Eigen::Index parameter_count = 9;  // b, and six entries of A = S^-1

using EllipsoidParameters = Eigen::Matrix<double, parameter_count, 1>;

// Where the six entries stand: on and above the diagonal.
constexpr std::array<std::array<int, 2>, 6> entries = {
    {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}};

// f = A (v - b), for readings that were centred and scaled so that all numbers are near 1.
struct Ellipsoid {
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  Eigen::Matrix3d A = Eigen::Matrix3d::Identity();
};

// The readings in units in which the field has length 1, about their middle.
struct Cloud {
  Eigen::MatrixXd v;             // n x 3
  Eigen::VectorXd root_weights;  // n
  Eigen::Matrix3d noise;         // covariance up to a factor
  MagnitudeShape shape = MagnitudeShape::symmetric;
  std::vector<std::string> names;  // what the parameters are called in errors

  [[nodiscard]] Eigen::Index size() const { return v.rows(); }
};

Ellipsoid moved(const Ellipsoid& from, const EllipsoidParameters& step, MagnitudeShape shape) {
  Ellipsoid to = from;
  to.b += step.head<3>();
  for (std::size_t e = 0; e < entries.size(); ++e) {
    const auto [i, j] = entries[e];
    to.A(i, j) += step(3 + static_cast<Eigen::Index>(e));
    if (i != j && shape == MagnitudeShape::symmetric) {
      to.A(j, i) = to.A(i, j);
    }
  }
  return to;
}

// Deviations |f| - 1 and what changes them, in units of a reading's noise.
struct Linear : Linearised<parameter_count> {
  Eigen::VectorXd scale;  // n: 1 / standard deviation of |f|, for noise of 1
};

// By columns, so that all of it is arithmetic on whole arrays.
void linearise(const Cloud& cloud, const Ellipsoid& at, Linear& result) {
  using Columns = Eigen::Array<double, Eigen::Dynamic, 3>;
  const Eigen::Matrix3d C = at.A * cloud.noise * at.A.transpose();
  const Columns d = (cloud.v.rowwise() - at.b.transpose()).array();
  Columns u(d.rows(), 3);
  for (int j = 0; j < 3; ++j) {
    u.col(j) = at.A(j, 0) * d.col(0) + at.A(j, 1) * d.col(1) + at.A(j, 2) * d.col(2);
  }
  const Eigen::ArrayXd length = (u.col(0).square() + u.col(1).square() + u.col(2).square()).sqrt();
  u.colwise() /= length;
  result.scale =
      cloud.root_weights.array() /
      (C(0, 0) * u.col(0).square() + C(1, 1) * u.col(1).square() + C(2, 2) * u.col(2).square() +
       2.0 * (C(0, 1) * u.col(0) * u.col(1) + C(0, 2) * u.col(0) * u.col(2) +
              C(1, 2) * u.col(1) * u.col(2)))
          .sqrt();
  result.residuals = result.scale.array() * (length - 1.0);
  u.colwise() *= result.scale.array();
  result.jacobian.resize(d.rows(), parameter_count);
  for (int j = 0; j < 3; ++j) {
    result.jacobian.col(j) =
        -(at.A(0, j) * u.col(0) + at.A(1, j) * u.col(1) + at.A(2, j) * u.col(2));
  }
  for (std::size_t e = 0; e < entries.size(); ++e) {
    const auto [j, k] = entries[e];
    auto column = result.jacobian.col(3 + static_cast<Eigen::Index>(e));
    column = u.col(j) * d.col(k);
    if (j != k && cloud.shape == MagnitudeShape::symmetric) {
      column.array() += u.col(k) * d.col(j);
    }
  }
}

Linear linearise(const Cloud& cloud, const Ellipsoid& at) {
  Linear result;
  linearise(cloud, at, result);
  return result;
}

// Sum of squares with the weights of another place.
double cost_at(const Cloud& cloud, const Ellipsoid& at, const Eigen::VectorXd& scale) {
  Eigen::ArrayXd squares = Eigen::ArrayXd::Zero(cloud.size());
  for (int j = 0; j < 3; ++j) {
    squares += (at.A(j, 0) * (cloud.v.col(0).array() - at.b(0)) +
                at.A(j, 1) * (cloud.v.col(1).array() - at.b(1)) +
                at.A(j, 2) * (cloud.v.col(2).array() - at.b(2)))
                   .square();
  }
  return (scale.array() * (squares.sqrt() - 1.0)).square().sum();
}

// The weights are fixed within a step. `robust` weights multiply those of the readings; empty: all
// 1.
class EllipsoidProblem {
 public:
  using State = Ellipsoid;
  using Linear = axiscal::Linear;

  EllipsoidProblem(const Cloud& cloud, const Eigen::VectorXd& robust)
      : cloud_(cloud), root_(robust.cwiseSqrt()) {}

  void linearise(const Ellipsoid& at, Linear& linear) const {
    axiscal::linearise(cloud_, at, linear);
    if (root_.size() > 0) {
      linear.residuals.array() *= root_.array();
      linear.jacobian.array().colwise() *= root_.array();
      linear.scale.array() *= root_.array();
    }
  }
  [[nodiscard]] Ellipsoid moved(const Ellipsoid& at, const EllipsoidParameters& step) const {
    return axiscal::moved(at, step, cloud_.shape);
  }
  [[nodiscard]] double cost(const Ellipsoid& at, const Linear& before) const {
    return at.A.determinant() > 0.0 ? cost_at(cloud_, at, before.scale) : not_a_number;
  }
  [[nodiscard]] static double length(const Ellipsoid& /*at*/, const EllipsoidParameters& step) {
    return step.norm();
  }

 private:
  const Cloud& cloud_;
  Eigen::VectorXd root_;
};

Ellipsoid converged(const Cloud& cloud, const Ellipsoid& start, const Eigen::VectorXd& robust) {
  return gauss_newton(EllipsoidProblem(cloud, robust), start).state;
}

// The symmetric or triangular A of an ellipsoid d^T M d = 1.
Eigen::Matrix3d root_of(const Eigen::Matrix3d& M, MagnitudeShape shape) {
  if (shape == MagnitudeShape::triangular) {
    // M = A^T A with A upper triangular: Cholesky's M = L L^T, A = L^T.
    return Eigen::LLT<Eigen::Matrix3d>(M).matrixL().transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(M, Eigen::ComputeFullU);
  return svd.matrixU() * svd.singularValues().cwiseSqrt().asDiagonal() * svd.matrixU().transpose();
}

// Least squares for a start: by the normal equations where they are well conditioned.
template <int columns>
Eigen::Matrix<double, columns, 1> roughly_solved(
    const Eigen::Matrix<double, Eigen::Dynamic, columns>& A, const Eigen::VectorXd& b) {
  using Square = Eigen::Matrix<double, columns, columns>;
  using Unknowns = Eigen::Matrix<double, columns, 1>;
  const Unknowns per_length = A.colwise().norm().cwiseMax(1e-300).cwiseInverse().transpose();
  const Square N = per_length.asDiagonal() * Square(A.transpose() * A) * per_length.asDiagonal();
  const Eigen::LLT<Square> cholesky(N);
  constexpr double smallest_pivot = 1e-4;
  if (cholesky.info() == Eigen::Success &&
      cholesky.matrixLLT().diagonal().minCoeff() > smallest_pivot) {
    const Unknowns projected = A.transpose() * b;
    return per_length.cwiseProduct(cholesky.solve(per_length.cwiseProduct(projected)));
  }
  return minimum_norm_solution(A, b);
}

// The quadric through the readings by linear least squares, if it is an ellipsoid; else a sphere.
Ellipsoid algebraic_start(const Cloud& cloud) {
  const Eigen::Index n = cloud.size();
  const Eigen::Array<double, Eigen::Dynamic, 3> v = cloud.v.array();
  Eigen::Matrix<double, Eigen::Dynamic, 9> D(n, 9);
  D.leftCols<3>() = v.square();
  D.col(3) = 2.0 * v.col(0) * v.col(1);
  D.col(4) = 2.0 * v.col(0) * v.col(2);
  D.col(5) = 2.0 * v.col(1) * v.col(2);
  D.rightCols<3>() = 2.0 * v;
  const Eigen::Matrix<double, 9, 1> q = roughly_solved<9>(D, Eigen::VectorXd::Ones(n));
  Eigen::Matrix3d Q;
  Q << q(0), q(3), q(4), q(3), q(1), q(5), q(4), q(5), q(2);
  const Eigen::LLT<Eigen::Matrix3d> cholesky(Q);
  constexpr double longest_axis = 100.0;  // a good ellipsoid's axes are all near 1
  if (cholesky.info() == Eigen::Success) {
    const Eigen::Vector3d centre = -cholesky.solve(q.tail<3>());
    const double size = 1.0 + centre.dot(Q * centre);
    const Eigen::Matrix3d A = root_of(Q / size, cloud.shape);
    if (A.inverse().norm() < longest_axis) {
      return {.b = centre, .A = A};
    }
  }
  Eigen::Matrix<double, Eigen::Dynamic, 4> B(n, 4);
  B << 2.0 * cloud.v, Eigen::VectorXd::Ones(n);
  const Eigen::Vector4d sphere = roughly_solved<4>(B, v.square().rowwise().sum().matrix());
  Ellipsoid start{.b = sphere.head<3>()};
  start.A /= std::sqrt(std::max(sphere(3) + start.b.squaredNorm(), 1e-6));
  return start;
}

// Statistics at a solution.
struct Fit {
  Ellipsoid at;
  Linear linear;
  Eigen::MatrixXd unscaled_covariance;  // 9 x 9
  Eigen::VectorXd leverage;             // n
  Eigen::VectorXd robust;               // n
  double condition_number = 1.0;
  double sd = 0.0;  // scatter of a reading of weight 1, in the cloud's units
  double dof = 0.0;
};

std::vector<std::string> names_of(const ReadingSet& set) {
  std::vector<std::string> names;
  for (const std::string& axis : set.axes) {
    names.push_back(axis + ".bias");
  }
  for (const auto& [i, j] : entries) {
    names.push_back(set.axes[static_cast<std::size_t>(i)] + ".sensitivity." +
                    std::string(1, "xyz"[j]));
  }
  return names;
}

void require_open_nothing(const ReadingSet& set, const Linear& linear) {
  std::vector<std::string> open =
      names_of_open(confounded_columns(linear.jacobian, 1e-6, 1e-3), names_of(set));
  if (!open.empty()) {
    const std::string list = joined(open);
    throw RankDeficientError(
        "the orientations do not determine " + list +
            "; method magnitude needs nine directions or more that lie on no other quadric: a "
            "level cube gives six, so add oblique orientations, or give the design points",
        std::move(open));
  }
}

Fit describe(const Cloud& cloud, const Ellipsoid& at, const Eigen::VectorXd& robust) {
  Fit fit{.at = at, .linear = linearise(cloud, at), .robust = robust};
  const LeastSquaresDesign design(fit.linear.jacobian, Eigen::VectorXd(), cloud.names);
  fit.unscaled_covariance = design.unscaled_covariance();
  fit.leverage = design.leverage();
  fit.condition_number = design.condition_number();
  fit.dof = static_cast<double>(cloud.size() - parameter_count);
  fit.sd = std::sqrt(fit.linear.residuals.squaredNorm() / fit.dof);
  return fit;
}

Fit fit_cloud(const Cloud& cloud, bool robust) {
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(cloud.size());
  Ellipsoid at = converged(cloud, algebraic_start(cloud), weights);
  if (!robust) {
    return describe(cloud, at, weights);
  }
  BisquareWeights bisquare;
  weights = reweight_until_still(
      cloud.size(), 1,
      [&] {
        const Fit now = describe(cloud, at, weights);
        bisquare = bisquare_weights(now.linear.residuals, now.leverage,
                                    static_cast<double>(parameter_count), 1e-15);
        return bisquare.weights;
      },
      [&](const Eigen::MatrixXd& robust_weights) { at = converged(cloud, at, robust_weights); });
  Fit fit = describe(cloud, at, weights);
  fit.sd = bisquare.scale * std::sqrt(bisquare.variance_factor);
  return fit;
}

// The readings as the fit says they would be without noise.
Eigen::MatrixXd on_the_ellipsoid(const Cloud& cloud, const Ellipsoid& at) {
  const Eigen::Matrix3d S = at.A.inverse();
  Eigen::MatrixXd exact(cloud.size(), 3);
  for (Eigen::Index i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d f = at.A * (cloud.v.row(i).transpose() - at.b);
    exact.row(i) = at.b + S * f.normalized();
  }
  return exact;
}

// Noise of standard deviation 1 for a reading of weight 1.
Eigen::MatrixXd noise_of(const Cloud& cloud, RandomStream& random) {
  const Eigen::Matrix3d root = Eigen::LLT<Eigen::Matrix3d>(cloud.noise).matrixL();
  Eigen::MatrixXd noise(cloud.size(), 3);
  for (Eigen::Index i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d e = random.normals<3>();
    noise.row(i) = root * e / cloud.root_weights(i);
  }
  return noise;
}

// Mean of refits to readings made from the fit, less the fit: the estimate's bias of order sigma^2.
EllipsoidParameters bias_by_bootstrap(const Cloud& all, const Fit& fit) {
  constexpr int pairs = 40;
  // The bias does not depend on how often the same directions are taken; so many are enough.
  constexpr Eigen::Index most_rows = 2000;
  const Eigen::Index step = 1 + (all.size() - 1) / most_rows;
  Cloud cloud = all;
  const Eigen::Index rows = (all.size() + step - 1) / step;
  cloud.v = all.v(Eigen::seqN(0, rows, step), Eigen::all);
  cloud.root_weights = all.root_weights(Eigen::seqN(0, rows, step));
  const Eigen::MatrixXd exact = on_the_ellipsoid(cloud, fit.at);
  RandomStream random(1, 0);
  Cloud made = cloud;
  EllipsoidParameters sum = EllipsoidParameters::Zero();
  for (int t = 0; t < pairs; ++t) {
    // Noise of either sign: what is odd in it cancels, and the bias of order sigma^2 is left.
    const Eigen::MatrixXd noise = fit.sd * noise_of(cloud, random);
    for (const double sign : {1.0, -1.0}) {
      made.v = exact + sign * noise;
      const Ellipsoid again = converged(made, fit.at, {});
      sum.head<3>() += again.b - fit.at.b;
      for (std::size_t e = 0; e < entries.size(); ++e) {
        const auto [i, j] = entries[e];
        sum(3 + static_cast<Eigen::Index>(e)) += again.A(i, j) - fit.at.A(i, j);
      }
    }
  }
  return sum / (2.0 * pairs);
}

// Whether residuals may be independent normal noise: neither do neighbours resemble each other, as
// when an instrument is turned by hand, nor does one stand out.
bool is_plain_noise(const Fit& fit) {
  const Eigen::VectorXd& r = fit.linear.residuals;
  const auto n = static_cast<double>(r.size());
  const double together = r.head(r.size() - 1).dot(r.tail(r.size() - 1)) / r.squaredNorm();
  constexpr double beyond_chance = 3.5;  // standard deviations
  const double largest = r.cwiseAbs().maxCoeff() / fit.sd;
  return std::abs(together) * std::sqrt(n) < beyond_chance &&
         n * student_t_two_sided_p(largest, fit.dof) > 1e-3;
}

// Columns: change of b and of S, row by row, with b and the entries of A; 12 x 9.
Eigen::MatrixXd change_of_response(const Ellipsoid& at, MagnitudeShape shape) {
  const Eigen::Matrix3d S = at.A.inverse();
  Eigen::MatrixXd T = Eigen::MatrixXd::Zero(12, parameter_count);
  for (int k = 0; k < 3; ++k) {
    T(4 * k, k) = 1.0;
  }
  for (std::size_t e = 0; e < entries.size(); ++e) {
    const auto [i, j] = entries[e];
    Eigen::Matrix3d dA = Eigen::Matrix3d::Zero();
    dA(i, j) = 1.0;
    if (shape == MagnitudeShape::symmetric) {
      dA(j, i) = 1.0;
    }
    const Eigen::Matrix3d dS = -S * dA * S;
    for (int k = 0; k < 3; ++k) {
      T.block<3, 1>(4 * k + 1, 3 + static_cast<Eigen::Index>(e)) = dS.row(k).transpose();
    }
  }
  return T;
}

// A few orientations that are close together, or all in one plane, fit many ellipsoids.
void require_good_orientations(const Fit& fit, double bias_in_se) {
  constexpr double largest_relative_se = 0.1;
  constexpr double largest_bias_in_se = 1.5;  // a correction beyond that is no small one
  const Eigen::VectorXd se = fit.sd * fit.unscaled_covariance.diagonal().cwiseSqrt();
  const double size = fit.at.A.norm() / std::sqrt(3.0);
  const double worst = std::max(se.head<3>().maxCoeff() * size, se.tail<6>().maxCoeff() / size);
  if (worst > largest_relative_se || bias_in_se > largest_bias_in_se) {
    throw RefusedError(
        "method magnitude: the orientations cover too little of the sphere (or an axis is dead) to "
        "tell bias from sensitivity: " +
        (worst > largest_relative_se
             ? "standard errors of " + number_text(std::round(100.0 * worst)) + " % of the field"
             : "a bias of " + number_text(std::round(10.0 * bias_in_se) / 10.0) +
                   " standard errors by the noise alone") +
        "; turn the instrument so that each side meets the field");
  }
}

}  // namespace

Estimate estimate_magnitude(const ReadingSet& set,
                            double F,
                            MagnitudeShape shape,
                            const Eigen::Matrix3d& noise) {
  if (set.axis_count() != 3) {
    throw RefusedError("method magnitude needs an instrument of three axes, not " +
                       std::to_string(set.axis_count()));
  }
  if (set.size() < parameter_count + 1) {
    throw RefusedError(
        "method magnitude needs ten readings or more in different orientations, not " +
        std::to_string(set.size()));
  }
  require_response(set);
  const Eigen::Vector3d lowest = set.response.colwise().minCoeff();
  const Eigen::Vector3d highest = set.response.colwise().maxCoeff();
  const Eigen::Vector3d middle = 0.5 * (lowest + highest);
  const double size = 0.5 * (highest - lowest).maxCoeff();
  Cloud cloud{.v = (set.response.rowwise() - middle.transpose()) / size,
              .root_weights = set.weights.col(0).cwiseSqrt(),
              .noise = 3.0 / noise.trace() * noise,
              .shape = shape,
              .names = names_of(set)};
  require_open_nothing(set, linearise(cloud, algebraic_start(cloud)));
  Fit fit = fit_cloud(cloud, set.robust);
  require_open_nothing(set, fit.linear);
  const Eigen::VectorXd se = fit.sd * fit.unscaled_covariance.diagonal().cwiseSqrt();
  const EllipsoidParameters bias = bias_by_bootstrap(cloud, fit);
  const double bias_in_se = (bias.array().abs() / se.array().max(1e-300)).maxCoeff();
  constexpr double worth_correcting = 0.1;  // standard errors
  constexpr double rounding = 1e-12;  // in parts of the field: less is no noise, and makes no bias
  const bool plain_noise = fit.sd > rounding && !set.robust && is_plain_noise(fit);
  const bool correct = bias_in_se > worth_correcting && plain_noise;
  require_good_orientations(fit, plain_noise ? bias_in_se : 0.0);
  if (correct) {
    fit.at = moved(fit.at, -bias, shape);
  }

  Estimate estimate;
  if (bias_in_se > worth_correcting && fit.sd > rounding) {
    const std::string size_in_se = number_text(std::round(bias_in_se * 100.0) / 100.0);
    estimate.notes.push_back(
        correct ? "corrected for the estimate's bias of order sigma^2, up to " + size_in_se +
                      " standard errors (parametric bootstrap)"
                : "not corrected for the estimate's bias of order sigma^2, which would be up to " +
                      size_in_se +
                      " standard errors if the residuals were independent noise; they are not");
  }
  RegressionRows rows = rows_of_readings(set);
  estimate.statistics = blank_statistics(set, rows);
  FitStatistics& statistics = estimate.statistics;
  const Eigen::Matrix3d S = fit.at.A.inverse();
  estimate.response.bias = middle + size * fit.at.b;
  estimate.response.sensitivity = size / F * S;
  const Eigen::MatrixXd T = change_of_response(fit.at, shape);
  Eigen::VectorXd units(12);
  for (int k = 0; k < 3; ++k) {
    units.segment<4>(4 * k) << size, size / F, size / F, size / F;
  }
  statistics.covariance = fit.sd * fit.sd * units.asDiagonal() * T * fit.unscaled_covariance *
                          T.transpose() * units.asDiagonal();
  statistics.degrees_of_freedom.setConstant(fit.dof);
  statistics.residual_sd = size * fit.sd * cloud.noise.diagonal().cwiseSqrt();
  statistics.r_squared.setConstant(not_a_number);
  statistics.variance_inflation.setConstant(not_a_number);
  statistics.condition_number = fit.condition_number;
  const ResidualDiagnostics diagnostics =
      set.robust ? scale_residuals(fit.linear.residuals, fit.leverage, fit.sd,
                                   static_cast<double>(parameter_count))
                 : diagnose_residuals(fit.linear.residuals, fit.leverage, fit.dof,
                                      static_cast<double>(parameter_count));
  for (Eigen::Index k = 0; k < 3; ++k) {
    put_diagnostics(statistics, k, fit.leverage, diagnostics,
                    set.robust ? fit.robust : Eigen::VectorXd());
  }
  return estimate;
}

MagnitudeFit fit_magnitude(const Eigen::Ref<const Eigen::MatrixX3d>& readings,
                           double F,
                           MagnitudeShape shape,
                           const Eigen::Ref<const Eigen::VectorXd>& weights) {
  if (readings.rows() <= parameter_count || !readings.allFinite()) {
    throw RefusedError("fit_magnitude needs ten finite readings or more, not " +
                       std::to_string(readings.rows()));
  }
  const Eigen::Vector3d lowest = readings.colwise().minCoeff();
  const Eigen::Vector3d highest = readings.colwise().maxCoeff();
  const Eigen::Vector3d middle = 0.5 * (lowest + highest);
  const double size = 0.5 * (highest - lowest).maxCoeff();
  Cloud cloud{.v = (readings.rowwise() - middle.transpose()) / size,
              .root_weights = Eigen::VectorXd::Ones(readings.rows()),
              .noise = Eigen::Matrix3d::Identity(),
              .shape = shape};
  if (weights.size() > 0) {
    cloud.root_weights = weights.cwiseSqrt();
  }
  const Ellipsoid at = converged(cloud, algebraic_start(cloud), {});
  MagnitudeFit fit;
  fit.response = {.bias = middle + size * at.b, .sensitivity = size / F * at.A.inverse()};
  fit.degrees_of_freedom = static_cast<double>(readings.rows() - parameter_count);
  // Of |f|, with the weights of the readings alone.
  const double rss = F * F * cost_at(cloud, at, cloud.root_weights);
  fit.residual_sd = std::sqrt(rss / fit.degrees_of_freedom);
  return fit;
}

LinearResponse refit_magnitude(const Eigen::MatrixXd& readings,
                               double F,
                               MagnitudeShape shape,
                               const LinearResponse& start) {
  const double size = F * start.sensitivity.norm();
  Cloud cloud{.v = readings / size,
              .root_weights = Eigen::VectorXd::Ones(readings.rows()),
              .noise = Eigen::Matrix3d::Identity(),
              .shape = shape};
  Ellipsoid at{.b = start.bias / size};
  at.A = (Eigen::Matrix3d(start.sensitivity) * (F / size)).inverse();
  at = converged(cloud, at, {});
  return {.bias = size * at.b, .sensitivity = size / F * at.A.inverse()};
}

Eigen::MatrixXd fields_of_readings(const LinearResponse& response,
                                   const Eigen::MatrixXd& readings) {
  const Eigen::Matrix3d inverse = Eigen::Matrix3d(response.sensitivity).inverse();
  return (readings.rowwise() - response.bias.transpose()) * inverse.transpose();
}

void turn_frame(const Eigen::Matrix3d& R, LinearResponse& response, Eigen::MatrixXd& covariance) {
  response.sensitivity *= R.transpose();
  const Eigen::Index m = response.bias.size();
  Eigen::MatrixXd T = Eigen::MatrixXd::Identity(4 * m, 4 * m);
  for (Eigen::Index k = 0; k < m; ++k) {
    T.block<3, 3>(4 * k + 1, 4 * k + 1) = R;
  }
  covariance = T * covariance * T.transpose();
}

void align_by_points(const ReadingSet& set, double F, Estimate& estimate) {
  std::vector<Eigen::Index> all(static_cast<std::size_t>(set.size()));
  std::iota(all.begin(), all.end(), 0);
  const Eigen::VectorXd linear = linear_directions(set, all);
  Eigen::Vector3d in_table =
      F * (linear.size() == 3 ? Eigen::Vector3d(linear) : Eigen::Vector3d::UnitZ());
  const Eigen::MatrixXd measured = fields_of_readings(estimate.response, set.response);
  // Either end of the axis that the points show; the better one is where the field points.
  Eigen::Matrix3d best = Eigen::Matrix3d::Identity();
  double least = std::numeric_limits<double>::infinity();
  for (const double sign : {1.0, -1.0}) {
    Eigen::Vector3d table = sign * in_table;
    Eigen::Matrix3d Q = Eigen::Matrix3d::Identity();
    double sum = 0.0;
    for (int round = 0; round < 200; ++round) {
      Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
      for (Eigen::Index i = 0; i < set.size(); ++i) {
        M += set.rotation_sensor_from_table[static_cast<std::size_t>(i)] * table * measured.row(i);
      }
      Q = nearest_rotation(M);
      Eigen::Vector3d next = Eigen::Vector3d::Zero();
      sum = 0.0;
      for (Eigen::Index i = 0; i < set.size(); ++i) {
        const Eigen::Matrix3d& R = set.rotation_sensor_from_table[static_cast<std::size_t>(i)];
        const Eigen::Vector3d turned = Q * measured.row(i).transpose();
        next += R.transpose() * turned;
        sum += (turned - R * table).squaredNorm();
      }
      next = F * next.normalized();
      const double change = (next - table).norm();
      table = next;
      if (change < 1e-14 * F) {
        break;
      }
    }
    if (sum < least) {
      least = sum;
      best = Q;
      in_table = table;
    }
  }
  turn_frame(best, estimate.response, estimate.statistics.covariance);
  estimate.fields = {in_table};
}

}  // namespace axiscal
