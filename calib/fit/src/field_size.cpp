// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/field_size.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/LU>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "calib/fit/fit.hpp"
#include "calib/fit/input_quantities.hpp"

namespace axiscal {
namespace {

constexpr Eigen::Index most_readings = 240;

bool can_be_checked(const Experiment& experiment,
                    const ReadingSet& set,
                    const TableField& field,
                    const Calibration& calibration) {
  return set.axis_count() == 3 && !set.has_excluded_readings() && !set.field.is_sum() &&
         !set.robust && !experiment.instrument.one_sided && set.also_in_table.empty() &&
         set.seen.cols() == 0 && field.has_vectors() && !set.rotation_sensor_from_table.empty() &&
         set.field_then.empty() && set.size() <= most_readings &&
         (calibration.fit.statistics->residual_sd.array() > 0.0).all() &&
         std::none_of(set.readings.begin(), set.readings.end(),
                      [&](const Reading& reading) { return field.is_dark(reading.level); });
}

// The standard deviation of a reading for each axis, and its degrees of freedom.
struct Noise {
  Eigen::VectorXd sd;
  double degrees_of_freedom = 0.0;
  bool by_repeats = false;  // true if estimated from repeats, false if from the fit's residuals
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

// Returns the probability that the measured magnitudes of the field scatter this much by chance. If
// the noise was estimated from the residuals, the residuals include the deviations of the
// magnitudes. These deviations are then compared with the rest of the residuals.
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

// The scatter of the measured magnitudes of the field, and the parts that the readings' noise and
// errors of the inputs are expected to cause.
struct LengthScatter {
  double squares = 0.0;    // sum of the squared deviations of the magnitudes
  double by_noise = 0.0;   // expected sum of squares from the noise
  double by_inputs = 0.0;  // expected sum of squares from errors of the inputs
  double of_square = 0.0;  // sum of the squared elements of the magnitudes' covariance

  [[nodiscard]] double expected() const { return by_noise + by_inputs; }
};

// The field with which the readings of a run are compared, and the noise of the axes.
struct LengthSetup {
  const ReadingSet& set;
  const TableField& field;
  const Eigen::Matrix3d inverse;  // inverse of the sensitivity S
  const Eigen::Vector3d pure;     // noise of each axis, divided by residual_sd of the fit
  const Eigen::MatrixXd changes;  // derivatives of the readings with respect to the c errors of the
                                  // inputs, (n m) x c; m rows for each reading
};

LengthScatter scatter_of_lengths(const Fit& run, const LengthSetup& setup) {
  const ReadingSet& set = setup.set;
  const Eigen::Index n = set.size();
  LengthScatter scatter;
  // Derivatives of the magnitudes with respect to the readings. The unit of each reading is the
  // standard deviation of its noise.
  Eigen::MatrixX3d A(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Eigen::Vector3d met =
        set.rotation_sensor_from_table[at] * set.field_in_table(i, setup.field);
    const Eigen::RowVector3d along = met.normalized().transpose() * setup.inverse;
    Eigen::Vector3d above;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double noise = run.sigma(k) / (set.scale(i, k) * std::sqrt(set.weights(i, k)));
      above(k) = run.residual(i, k) * noise;
      A(i, k) = along(k) * noise;
    }
    scatter.squares += std::pow((met + setup.inverse * above).norm() - met.norm(), 2);
  }
  // The covariance of the magnitudes is A (1 - K K^T) V (1 - K K^T) A^T. V is the covariance of the
  // noise, and K K^T is the hat matrix of the fit. Axis k has the rows K_k = [Q_k, P_k] of K, with
  // Q_k^T Q_k = 1 and Q_k^T P_k = 0.
  Eigen::MatrixXd in_shared = Eigen::MatrixXd::Zero(n, run.shared_basis_of_axis(0).cols());
  const bool shares = in_shared.cols() > 0;
  for (Eigen::Index k = 0; k < 3 && shares; ++k) {
    in_shared += A.col(k).asDiagonal() * run.shared_basis_of_axis(k);
  }
  const Eigen::Index p = run.basis_of_axis(0).cols();
  Eigen::MatrixXd in_own(n, 3 * p);
  Eigen::MatrixXd across = Eigen::MatrixXd::Zero(n, in_shared.cols());
  Eigen::VectorXd of_noise = Eigen::VectorXd::Zero(n);
  Eigen::MatrixXd by_inputs = Eigen::MatrixXd::Zero(n, setup.changes.cols());
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double variance = setup.pure(k) * setup.pure(k);
    of_noise += variance * A.col(k).cwiseAbs2();
    const auto& Q = run.basis_of_axis(k);
    in_own.middleCols(p * k, p) = (setup.pure(k) * A.col(k)).asDiagonal() * Q;
    if (shares) {
      const Eigen::MatrixXd P = run.shared_basis_of_axis(k);
      across += (variance * A.col(k)).asDiagonal() * P;
      across -= 0.5 * variance * in_shared * (P.transpose() * P);
    }
    if (setup.changes.cols() > 0) {
      const Eigen::MatrixXd of_axis = setup.changes(Eigen::seqN(k, n, 3), Eigen::all);
      by_inputs += A.col(k).asDiagonal() * (of_axis - Q * (Q.transpose() * of_axis));
      by_inputs -= in_shared * (run.shared_basis_of_axis(k).transpose() * of_axis);
    }
  }
  Eigen::MatrixXd covariance = of_noise.asDiagonal();
  covariance -= in_own * in_own.transpose();
  if (in_shared.cols() > 0) {
    const Eigen::MatrixXd taken = across * in_shared.transpose();
    covariance -= taken + taken.transpose();
  }
  scatter.by_noise = covariance.trace();
  scatter.by_inputs = by_inputs.squaredNorm();
  covariance += by_inputs * by_inputs.transpose();
  scatter.of_square = covariance.squaredNorm();
  return scatter;
}

}  // namespace

std::optional<FieldSizeCheck> check_field_size(const Experiment& experiment,
                                               const SolvedReadings& of,
                                               Method method,
                                               const TableField& field,
                                               const Calibration& calibration) {
  const ReadingSet& set = of.set();
  if (!calibration.fit.statistics || !can_be_checked(experiment, set, field, calibration)) {
    return std::nullopt;
  }
  const bool known = method_kind(method).directions_known;
  const FitStatistics& statistics = *calibration.fit.statistics;
  const std::vector<InputQuantity> inputs = input_quantities(experiment, set, known, field);
  const Noise noise = noise_of(statistics);
  const auto setup_of = [&](const Eigen::MatrixXd& changes) -> LengthSetup {
    return {.set = set,
            .field = field,
            .inverse = Eigen::Matrix3d(calibration.sensor.response.sensitivity).inverse(),
            .pure = noise.sd.cwiseQuotient(statistics.residual_sd),
            .changes = changes};
  };
  const Fit run(of, field, statistics.residual_sd);
  if (!run.is_determined()) {
    return std::nullopt;
  }
  const LengthScatter scatter =
      scatter_of_lengths(run, setup_of(input_error_jacobian(inputs, run, field)));
  const double expected = scatter.expected();
  if (!(expected > 0.0)) {
    return std::nullopt;
  }
  // Satterthwaite's approximation: the degrees of freedom of the scaled chi^2 distribution that has
  // the mean and the variance of the sum of squares.
  const double own_dof = expected * expected / scatter.of_square;
  const double F = field.magnitude();
  const auto rms = [&](double sum) { return std::sqrt(sum / static_cast<double>(set.size())) / F; };
  return FieldSizeCheck{
      .orientations = static_cast<int>(set.size()),
      .relative_sd = rms(scatter.squares),
      .by_noise = rms(scatter.by_noise),
      .by_inputs = rms(scatter.by_inputs),
      .degrees_of_freedom = own_dof,
      .p_value = p_of(scatter.squares / expected, own_dof, noise, inputs.empty())};
}

}  // namespace axiscal
