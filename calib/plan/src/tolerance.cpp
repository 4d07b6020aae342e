// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/tolerance.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include <Eigen/LU>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/forecast.hpp"
#include "axiscal/calib/simulate.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/parallel.hpp"
#include "axiscal/core/rotation.hpp"
#include "calib/regression/factor.hpp"

namespace axiscal {
namespace {

void check(const ToleranceStudy& study) {
  const Tolerances& t = study.tolerances;
  for (const double value : {t.foot_height_m, t.ball_radius_m, t.squareness_rad, t.fence_rad}) {
    if (!(value >= 0.0) || !std::isfinite(value)) {
      throw DomainError("study_tolerances: a tolerance must not be negative");
    }
  }
  if (study.trials < 1 || study.nominal.response.bias.size() < 3) {
    throw DomainError("study_tolerances: at least one trial and three axes are needed");
  }
}

// Sums of squared errors, as in CalibrationErrors.
struct Sums {
  double bias = 0.0;
  double main = 0.0;
  double cross = 0.0;
  double angle = 0.0;
};

// The error of each coefficient, divided by the length of its axis's sensitivity: m x 4.
using RelativeErrors = Eigen::Matrix<double, Eigen::Dynamic, 4>;

Sums squares_of(const RelativeErrors& errors, const SensitivityMatrix& sensitivity, double F) {
  Sums sums;
  const auto m = static_cast<double>(errors.rows());
  for (Eigen::Index k = 0; k < errors.rows(); ++k) {
    Eigen::Index main = 0;
    sensitivity.row(k).cwiseAbs().maxCoeff(&main);
    const Eigen::RowVector3d S = errors.row(k).tail<3>();
    sums.bias += errors(k, 0) * errors(k, 0) / m;
    sums.main += S(main) * S(main) / m;
    sums.cross += (S.squaredNorm() - S(main) * S(main)) / (2.0 * m);
  }
  // If b and S have the errors db and dS, a field F u with |u| = 1 is measured with the relative
  // error -E u - e, where E = S^-1 dS and e = S^-1 db / F. The part of this error that is
  // perpendicular to u has two components. The mean square of one component over all u is half of
  // 2/3 |e|^2 + 1/3 |E|^2 - (tr(E)^2 + |E|^2 + tr(E E)) / 15.
  Eigen::MatrixXd scaled(errors.rows(), 4);
  for (Eigen::Index k = 0; k < errors.rows(); ++k) {
    scaled.row(k) = errors.row(k) * sensitivity.row(k).norm();
  }
  const Eigen::MatrixXd inverse = pseudo_inverse(sensitivity);
  const Eigen::Vector3d e = inverse * scaled.col(0) / F;
  const Eigen::Matrix3d E = inverse * scaled.rightCols<3>();
  const double across = 2.0 / 3.0 * e.squaredNorm() + E.squaredNorm() / 3.0 -
                        (E.trace() * E.trace() + E.squaredNorm() + (E * E).trace()) / 15.0;
  sums.angle = 0.5 * across;
  return sums;
}

CalibrationErrors errors_from(const Sums& sums, double count) {
  return {.bias = std::sqrt(sums.bias / count),
          .sensitivity = std::sqrt(sums.main / count),
          .cross_axis = std::sqrt(sums.cross / count),
          .angle_rad = std::sqrt(sums.angle / count)};
}

// Returns the largest angle, over all attitudes, between the true field and the field from the
// calibrated readings.
double worst_angle(const LinearResponse& found, const LinearResponse& truth, double F) {
  const Eigen::MatrixXd inverse = pseudo_inverse(found.sensitivity);
  const Eigen::Vector3d e = inverse * (truth.bias - found.bias);
  const Eigen::Matrix3d E = inverse * (truth.sensitivity - found.sensitivity);
  constexpr int directions = 200;
  double largest = 0.0;
  for (const Eigen::Vector3d& u : directions_on_sphere(directions)) {
    const Eigen::Vector3d off = e / F + E * u;
    largest = std::max(largest, (off - off.dot(u) * u).norm());
  }
  return largest;
}

CalibrationErrors closed_form(const ToleranceStudy& study, Method method) {
  ForecastSetup setup;
  setup.nominal = study.nominal;
  setup.design = study.design;
  setup.method = method;
  PositionerDescription description = Positioner(study.drawing, study.surface).description();
  description.normal_covariance = normal_covariance_of(study.drawing, study.tolerances);
  setup.positioner = Positioner(std::move(description));
  const Forecast result = forecast(setup);
  // The expected square of each error is the sum of the squares of its contributions from the
  // principal components of the covariance.
  const SymmetricEigen eigen = symmetric_eigen(result.positioner);
  Sums sums;
  const SensitivityMatrix& S = study.nominal.response.sensitivity;
  for (Eigen::Index i = 0; i < eigen.values.size(); ++i) {
    const Eigen::VectorXd error = std::sqrt(std::max(eigen.values(i), 0.0)) * eigen.vectors.col(i);
    RelativeErrors relative(S.rows(), 4);
    for (Eigen::Index k = 0; k < S.rows(); ++k) {
      relative.row(k) = error.segment<4>(4 * k).transpose() / S.row(k).norm();
    }
    const Sums part = squares_of(relative, S, study.nominal.field.magnitude);
    sums.bias += part.bias;
    sums.main += part.main;
    sums.cross += part.cross;
    sums.angle += part.angle;
  }
  return errors_from(sums, 1.0);
}

Experiment experiment_of(const ToleranceStudy& study, Method method) {
  Experiment experiment;
  experiment.instrument = study.nominal.instrument;
  experiment.field = setup_of(study.nominal.field, true);
  experiment.fit.method = method;
  experiment.positioner = Positioner(study.drawing, study.surface);  // the cube of the drawing
  experiment.fit.search_for_mistakes = false;  // the errors are in the cube, not in the readings
  return experiment;
}

ToleranceEffect effect_of(const ToleranceStudy& study, Method method) {
  ToleranceEffect effect;
  effect.method = method;
  effect.closed_form = closed_form(study, method);
  const Experiment experiment = experiment_of(study, method);
  const std::vector<RunSheetRow> sheet = make_run_sheet(study.design, 1, study.seed);
  const LinearResponse& truth = study.nominal.response;
  const double F = study.nominal.field.magnitude;
  std::vector<std::optional<LinearResponse>> responses(static_cast<std::size_t>(study.trials));
  for_each_in_parallel(responses.size(), [&](std::size_t trial) {
    // The random cube depends only on the number of the trial, so all methods get the same cubes.
    RandomStream random(study.seed, static_cast<std::uint32_t>(trial) + 16);
    try {
      const Positioner cube =
          random_positioner(study.drawing, study.surface, study.tolerances, random);
      responses[trial] = calibrate(experiment, simulate(study.nominal, sheet,
                                                        {.slope = study.slope, .positioner = cube}))
                             .sensor.response;
    } catch (const Error&) {  // the balls do not form a cube, or it cannot lie at a point
    }
  });
  Sums sums;
  std::vector<double> worst;
  for (const std::optional<LinearResponse>& found : responses) {
    if (!found) {
      ++effect.unusable;
      continue;
    }
    const LinearResponse& response = *found;
    RelativeErrors relative(truth.bias.size(), 4);
    for (Eigen::Index k = 0; k < truth.bias.size(); ++k) {
      const double length = truth.sensitivity.row(k).norm();
      relative(k, 0) = (response.bias(k) - truth.bias(k)) / length;
      relative.row(k).tail<3>() = (response.sensitivity.row(k) - truth.sensitivity.row(k)) / length;
    }
    const Sums part = squares_of(relative, truth.sensitivity, F);
    sums.bias += part.bias;
    sums.main += part.main;
    sums.cross += part.cross;
    sums.angle += part.angle;
    worst.push_back(worst_angle(response, truth, F));
  }
  if (worst.empty()) {
    throw RefusedError("the tolerances are so wide that no cube could be used");
  }
  effect.simulated = errors_from(sums, static_cast<double>(worst.size()));
  const auto at = static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(worst.size() - 1));
  std::nth_element(worst.begin(), worst.begin() + at, worst.end());
  effect.worst_angle_95_rad = worst[static_cast<std::size_t>(at)];
  return effect;
}

}  // namespace

Positioner random_positioner(const CubeFeet& drawing,
                             const Surface& surface,
                             const Tolerances& tolerances,
                             RandomStream& random) {
  CubeFeet made = drawing;
  for (const Face face : all_faces) {
    Feet& feet = made[static_cast<std::size_t>(face)];
    const Eigen::Vector3d normal = nominal_normal(face);
    for (Ball& ball : feet) {
      ball.centre_m += tolerances.foot_height_m * random.normal() * normal;
      ball.radius_m = std::max(0.0, ball.radius_m + tolerances.ball_radius_m * random.normal());
    }
    const Eigen::Matrix<double, 3, 2> T = tangents_of(normal);
    const double first = random.normal();
    const double second = random.normal();
    feet = feet_rotated(
        feet, rotation_by(tolerances.squareness_rad * (T.col(0) * first + T.col(1) * second)));
  }
  Surface leaning = surface;
  leaning.fence_lean_rad += tolerances.fence_rad * random.normal();
  return Positioner(made, leaning);
}

NormalCovariance normal_covariance_of(const CubeFeet& drawing, const Tolerances& tolerances) {
  NormalCovariance C = NormalCovariance::Zero();
  for (const Face face : all_faces) {
    const Feet& feet = drawing[static_cast<std::size_t>(face)];
    const Eigen::Vector3d n = contact_plane(face, feet).normal;
    const Eigen::Matrix<double, 3, 2> T = tangents_of(n);
    // A plane h = h_0 + g_a a + g_b b is fitted to the heights h_i of the feet, where a and b are
    // the coordinates along the face's tangents. The normal n rotates by -(g_a, g_b).
    Eigen::Matrix3d positions;
    for (int i = 0; i < 3; ++i) {
      positions.row(i) << 1.0,
          (T.transpose() * feet[static_cast<std::size_t>(i)].centre_m).transpose();
    }
    const Eigen::Matrix<double, 2, 3> gradient = positions.inverse().bottomRows<2>();
    const double height = tolerances.foot_height_m * tolerances.foot_height_m +
                          tolerances.ball_radius_m * tolerances.ball_radius_m;
    const Eigen::Matrix2d own =
        height * gradient * gradient.transpose() +
        tolerances.squareness_rad * tolerances.squareness_rad * Eigen::Matrix2d::Identity();
    const Eigen::Index at = 3 * static_cast<Eigen::Index>(face);
    C.block<3, 3>(at, at) = T * own * T.transpose();
  }
  return C;
}

std::vector<ToleranceEffect> study_tolerances(const ToleranceStudy& study) {
  check(study);
  std::vector<ToleranceEffect> effects;
  for (const Method method : {Method::paired, Method::joint, Method::known}) {
    try {
      static_cast<void>(
          forecast({.nominal = study.nominal, .design = study.design, .method = method}));
    } catch (const RefusedError&) {
      continue;  // the design does not allow this method
    }
    effects.push_back(effect_of(study, method));
  }
  return effects;
}

}  // namespace axiscal
