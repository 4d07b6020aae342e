// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/field_size.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/LU>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/input_quantities.hpp"
#include "axiscal/calib/linearised_run.hpp"
#include "axiscal/calib/method_kind.hpp"

namespace axiscal {
namespace {

constexpr Eigen::Index most_readings = 240;

bool can_be_checked(const Experiment& experiment,
                    const ReadingSet& set,
                    const TableField& field,
                    const Calibration& calibration) {
  return set.axis_count() == 3 && !set.leaves_out() && !set.field.is_sum() && !set.robust &&
         !experiment.instrument.one_sided && set.also_in_table.empty() && set.seen.cols() == 0 &&
         field.has_vectors() && !set.rotation_sensor_from_table.empty() && set.field_then.empty() &&
         set.size() <= most_readings &&
         (calibration.fit.statistics->residual_sd.array() > 0.0).all() &&
         std::none_of(set.readings.begin(), set.readings.end(),
                      [&](const Reading& reading) { return field.is_dark(reading.level); });
}

// Scatter of a reading of each axis, and by how many numbers it is known.
struct Noise {
  Eigen::VectorXd sd;
  double degrees_of_freedom = 0.0;
  bool by_repeats = false;  // else by the residuals that the lengths are a part of
};

Noise noise_of(const FitStatistics& statistics) {
  Noise own{.sd = statistics.residual_sd,
            .degrees_of_freedom = statistics.degrees_of_freedom.sum()};
  Noise repeats{.sd = own.sd, .by_repeats = !statistics.lack_of_fit.empty()};
  constexpr double enough = 5.0;
  for (std::size_t k = 0; k < statistics.lack_of_fit.size(); ++k) {
    const LackOfFit& test = statistics.lack_of_fit[k];
    repeats.by_repeats =
        repeats.by_repeats && test.pure_error_dof >= enough && test.pure_error_sd > 0.0;
    repeats.sd(static_cast<Eigen::Index>(k)) = test.pure_error_sd;
    repeats.degrees_of_freedom += test.pure_error_dof;
  }
  return repeats.by_repeats ? repeats : own;
}

// That the lengths scatter so much more than expected by chance. Lengths that are a part of the
// residuals are held against the rest of them.
double p_of(double ratio, double own_dof, const Noise& noise, bool noise_alone) {
  const double rest = noise.degrees_of_freedom - own_dof;
  if (noise.by_repeats || !noise_alone || !(rest >= 1.0)) {
    return noise.degrees_of_freedom > 0.0
               ? f_upper_p(std::max(ratio, 1e-12), own_dof, noise.degrees_of_freedom)
               : 1.0;
  }
  const double left = noise.degrees_of_freedom - own_dof * ratio;
  return left > 0.0 ? f_upper_p(std::max(ratio * rest / left, 1e-12), own_dof, rest) : 0.0;
}

}  // namespace

std::optional<FieldSizeCheck> check_field_size(const Experiment& experiment,
                                               StateOfRun& of,
                                               Method method,
                                               const TableField& field,
                                               const Calibration& calibration) {
  const ReadingSet& set = of.set();
  if (!calibration.fit.statistics || !can_be_checked(experiment, set, field, calibration)) {
    return std::nullopt;
  }
  const bool known = method_kind(method).directions_known;
  const Eigen::Index n = set.size();
  const Eigen::Index m = set.axis_count();
  const LinearisedRun run(of, field, calibration.fit.statistics->residual_sd);
  if (!run.is_determined()) {
    return std::nullopt;
  }

  // Changes of the lengths with the readings, in units of each one's own scatter.
  const Eigen::Matrix3d inverse =
      Eigen::Matrix3d(calibration.sensor.response.sensitivity).inverse();
  Eigen::MatrixXd A(n, m);  // of each reading by its own numbers alone
  const std::vector<InputQuantity> inputs = input_quantities(experiment, set, known, field);
  double squares = 0.0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Eigen::Vector3d met = set.rotation_sensor_from_table[at] * set.field_in_table(i, field);
    Eigen::Vector3d above;
    for (Eigen::Index k = 0; k < m; ++k) {
      const Eigen::Index row = run.row_of(i, k);
      const double noise = run.sigma(k) / (set.scale(i, k) * std::sqrt(set.weights(i, k)));
      above(k) = run.residuals()(row) * noise;
      A(i, k) = met.normalized().dot(inverse.col(k)) * noise;
    }
    squares += std::pow((met + inverse * above).norm() - met.norm(), 2);
  }
  // A P, P = 1 - K K^T what the fit leaves of readings: with B = A K and K_k^T K_k = [1, 0; 0,
  // P_k^T P_k] of an axis, (A_k - B K_k^T)(A_k - B K_k^T)^T = A_k^2 + X B^T + B X^T, where X is -B
  // / 2 in its own columns and B P_k^T P_k / 2 - A_k P_k in the shared.
  const Eigen::MatrixXd B = run.combined_basis(A);
  const Noise noise = noise_of(*calibration.fit.statistics);
  const Eigen::VectorXd pure = noise.sd.cwiseQuotient(calibration.fit.statistics->residual_sd);
  const Eigen::MatrixXd changes = change_of_readings(inputs, run, field);
  const Eigen::Index D = run.shared();
  Eigen::MatrixXd X = B;
  X.rightCols(D).setZero();
  Eigen::MatrixXd by_inputs = Eigen::MatrixXd::Zero(n, changes.cols());
  for (Eigen::Index k = 0; k < m; ++k) {
    const double variance = pure(k) * pure(k);
    const Eigen::MatrixXd& Q = run.basis_of_axis(k);
    const Eigen::Index first = run.column_of(k, 0);
    X.middleCols(first, Q.cols()) *= -0.5 * variance;
    const Eigen::MatrixXd P = run.shared_basis_of_axis(k);
    if (D > 0) {
      X.rightCols(D) += 0.5 * variance * B.rightCols(D) * (P.transpose() * P);
      X.rightCols(D) -= variance * A.col(k).asDiagonal() * P;
    }
    if (!inputs.empty()) {
      const Eigen::MatrixXd of_axis = changes(run.rows_of_axis(k), Eigen::all);
      by_inputs += A.col(k).asDiagonal() * of_axis;
      by_inputs -= B.middleCols(first, Q.cols()) * (Q.transpose() * of_axis) +
                   B.rightCols(D) * (P.transpose() * of_axis);
    }
  }
  Eigen::MatrixXd of_noise = X * B.transpose();
  of_noise += of_noise.transpose().eval();
  of_noise.diagonal() += A.cwiseAbs2() * pure.cwiseAbs2();
  const double by_noise = of_noise.trace();
  Eigen::MatrixXd V = std::move(of_noise);
  if (!inputs.empty()) {
    V += by_inputs * by_inputs.transpose();
  }
  const double expected = V.trace();
  if (!(expected > 0.0)) {
    return std::nullopt;
  }
  // As chi^2 of the mean and variance of a sum of squares (Satterthwaite).
  const double own_dof = expected * expected / V.squaredNorm();
  const double F = field.magnitude();
  const auto rms = [&](double sum) { return std::sqrt(sum / static_cast<double>(n)) / F; };
  return FieldSizeCheck{.orientations = static_cast<int>(n),
                        .relative_sd = rms(squares),
                        .by_noise = rms(by_noise),
                        .by_inputs = rms(by_inputs.squaredNorm()),
                        .degrees_of_freedom = own_dof,
                        .p_value = p_of(squares / expected, own_dof, noise, inputs.empty())};
}

}  // namespace axiscal
