// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/orientation_quality.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>

#include "axiscal/calib/least_squares.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/positioner/design.hpp"
#include "calib/regression/gauss_newton.hpp"

namespace axiscal {
namespace {

Eigen::MatrixXd unit_rows(const Eigen::MatrixXd& rows) {
  return rows.rowwise().normalized();
}

// The rotation between the instruments, and the cosine of the angle between their fields.
struct AngleFit {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  double cosine = 0.0;
};

Eigen::MatrixXd angle_jacobian(const Eigen::MatrixXd& turned, const Eigen::MatrixXd& companion) {
  Eigen::MatrixXd J(turned.rows(), 4);
  for (Eigen::Index i = 0; i < turned.rows(); ++i) {
    const Eigen::Vector3d f = turned.row(i);
    const Eigen::Vector3d g = companion.row(i);
    J.row(i) << f.cross(g).transpose(), -1.0;
  }
  return J;
}

// The problem for gauss_newton(). The unknowns are the rotation between the instruments, and the
// cosine of the angle between their fields.
class AngleProblem {
 public:
  using State = AngleFit;
  using Linear = Linearised;

  AngleProblem(const Eigen::MatrixXd& f, const Eigen::MatrixXd& g) : f_(f), g_(g) {}

  [[nodiscard]] Eigen::VectorXd cosines(const Eigen::Matrix3d& R) const {
    return (f_ * R.transpose()).cwiseProduct(g_).rowwise().sum();
  }
  [[nodiscard]] double cost(const AngleFit& at) const {
    return (cosines(at.R).array() - at.cosine).square().sum();
  }

  void linearise(const AngleFit& at, Linear& linear) const {
    linear.residuals = (cosines(at.R).array() - at.cosine).matrix();
    linear.jacobian = angle_jacobian(f_ * at.R.transpose(), g_);
  }
  [[nodiscard]] static AngleFit moved(const AngleFit& at, const Eigen::VectorXd& step) {
    return {.R = rotation_by(step.head<3>()) * at.R, .cosine = at.cosine + step(3)};
  }
  [[nodiscard]] double cost(const AngleFit& at, const Linear& /*before*/) const { return cost(at); }
  [[nodiscard]] static double length(const AngleFit& /*at*/,
                                     const Eigen::VectorXd& step,
                                     const Linear& /*there*/) {
    return step.norm();
  }

 private:
  const Eigen::MatrixXd& f_;
  const Eigen::MatrixXd& g_;
};

}  // namespace

OrientationQuality orientation_quality(const Eigen::MatrixXd& fields, double magnitude) {
  if (fields.rows() < 1 || fields.cols() != 3) {
    throw DomainError("orientation_quality: at least one reading of three components is needed");
  }
  OrientationQuality quality;
  const Eigen::ArrayXd lengths = fields.rowwise().norm();
  quality.fit_error = std::sqrt((lengths - magnitude).square().mean()) / magnitude;
  quality.magnitude_spread = std::sqrt((lengths - lengths.mean()).square().mean()) / magnitude;
  const Eigen::MatrixXd directions = unit_rows(fields);
  constexpr int samples = 2000;
  const double near = std::cos(30.0 * rad_per_deg);
  int covered = 0;
  double farthest = 2.0;
  for (const Eigen::Vector3d& direction : directions_on_sphere(samples)) {
    const double nearest = (directions * direction).maxCoeff();
    covered += nearest >= near ? 1 : 0;
    if (nearest < farthest) {
      farthest = nearest;
      quality.gap = direction;
    }
  }
  quality.coverage = static_cast<double>(covered) / samples;
  quality.largest_gap_rad = std::acos(std::clamp(farthest, -1.0, 1.0));
  return quality;
}

std::string direction_in_words(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d unit = direction.normalized();
  constexpr double worth_naming = 0.38;  // sine of 22.5 degrees
  std::string words;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(unit(axis)) > worth_naming) {
      words += std::string(words.empty() ? "" : " ") + (unit(axis) < 0.0 ? "-" : "+") +
               std::string(1, "xyz"[axis]);
    }
  }
  return words;
}

Alignment align_by_constant_angle(const Eigen::MatrixXd& fields, const Eigen::MatrixXd& companion) {
  if (fields.rows() != companion.rows() || fields.cols() != 3 || companion.cols() != 3 ||
      fields.rows() < 5) {
    throw DomainError(
        "align_by_constant_angle: needs the same number of readings from both sensors, five or "
        "more, with three components each");
  }
  const Eigen::MatrixXd f = unit_rows(fields);
  const Eigen::MatrixXd g = unit_rows(companion);
  const AngleProblem problem(f, g);
  AngleFit best;
  double least = std::numeric_limits<double>::infinity();
  for (const DesignEntry& entry : standard_design(24)) {
    // The search starts from each of the 24 rotations of a cube, which exchange or reverse axes.
    Eigen::Matrix3d R;
    R.col(0) = nominal_normal(entry.point.rest());
    R.col(1) = nominal_normal(entry.point.fence());
    R.col(2) = R.col(0).cross(R.col(1));
    const AngleFit fit = gauss_newton(problem, {.R = R, .cosine = problem.cosines(R).mean()}).state;
    if (const double rss = problem.cost(fit); rss < least) {
      best = fit;
      least = rss;
    }
  }
  const Eigen::MatrixXd J = angle_jacobian(f * best.R.transpose(), g);
  const Eigen::MatrixXd scaled =
      J * J.colwise().norm().cwiseMax(1e-300).cwiseInverse().asDiagonal();
  if (!undetermined_columns(scaled).empty() || J.leftCols<3>().colwise().norm().minCoeff() < 1e-6) {
    throw RefusedError(
        "the orientations do not determine the rotation between the two instruments: the fields "
        "that they measure are parallel, or there are too few different orientations");
  }
  const LeastSquaresDesign design(J);
  Alignment alignment{.rotation_companion_from_sensor = best.R};
  alignment.angle_rad = std::acos(std::clamp(best.cosine, -1.0, 1.0));
  alignment.residual_sd = std::sqrt(least / static_cast<double>(J.rows() - 4));
  const Eigen::VectorXd se =
      alignment.residual_sd * design.unscaled_covariance().diagonal().cwiseSqrt();
  alignment.standard_error_rad = se.head<3>();
  alignment.angle_se_rad = se(3) / std::max(std::sin(alignment.angle_rad), 1e-12);
  return alignment;
}

}  // namespace axiscal
