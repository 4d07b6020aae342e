// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// How a gyroscope of three axes was turned from one rest to the next.
struct GyroscopeTurn {
  std::array<std::span<const double>, 3> readings;  ///< raw, n samples of each axis [unit]
  std::span<const double> time_s;                   ///< n times, ascending
  /// Up in the sensor's frame at the rests before and after, any length: an accelerometer's means.
  Eigen::Vector3d up_before = Eigen::Vector3d::Zero();
  Eigen::Vector3d up_after = Eigen::Vector3d::Zero();
  /// Where the seats are known: to the sensor's frame before from that after, R_sp R_a R_b^T
  /// R_sp^T.
  std::optional<Eigen::Matrix3d> rotation_before_from_after;
  /// The Earth's rotation in the sensor's frame at the rest before [rad/s]; 0: left out.
  Eigen::Vector3d earth_rate_in_sensor = Eigen::Vector3d::Zero();
};

struct TurnFitOptions {
  /// rad/s per unit of the readings, roughly; default: found among the usual ones.
  std::optional<double> rate_per_unit;
  std::optional<Eigen::Matrix3d> start;  ///< B of a fit that is near, instead
  /// Whether the turns determine the bias too, instead of the rests. For logs in which it wanders,
  /// or the rests are short.
  bool fit_bias = false;
  /// Relative change of B at which the search ends. 1e-4 is enough to compare fits: what the
  /// residuals say is then exact to 1e-8.
  double tolerance = 1e-10;
};

/// A gyroscope's calibration from turns.
struct TurnFit {
  LinearResponse response;  ///< [unit, unit per rad/s]
  Eigen::Matrix3d inverse =
      Eigen::Matrix3d::Identity();  ///< B = S^-1: w = B (v - b) [rad/s per unit]
  /// Of the parameters x.bias, x.sensitivity.x, ...: 12 x 12. The rests' share of the bias
  /// included.
  Eigen::MatrixXd covariance;
  double degrees_of_freedom = 0.0;
  double residual_sd_rad = 0.0;            ///< scatter of one component of a turn's attitude error
  std::vector<Eigen::Vector3d> residuals;  ///< attitude error of each turn [rad], frame before
  double most_revolutions = 0.0;  ///< that one turn makes by the fit, there and back counted both
  int rounds = 0;
  bool converged = false;
  bool has_rotations = false;  ///< whether all three components of each turn counted
};

/// Gyroscope scale factors and misalignments from turns between rests, without a rate table.
///
///     dR/dt = R [w cross],   w = B (v - b)
///     residual = log(R_known R(T)^T), or R(T) up_after - up_before: 3 or 2 numbers a turn
///
/// Gauss-Newton in B = S^-1, with the analytic derivative -integral of R(t) e_p (v - b)_q dt.
///
/// @param turns            three or more about different axes.
/// @param bias             of the rests [unit].
/// @param bias_covariance  of their mean, 3 x 3 [unit^2]; 0: it is exact. Else the turns may move
/// the
///                         bias within it, as its error shows in their residuals too (method.md,
///                         section 8).
/// @throws RefusedError, RankDeficientError  for too few turns, turns about too few axes (the
/// message
///         names what stays open), or where no scale fits (the message says how far off it is), or
///         one that makes more than 20 revolutions of a turn, unless it was stated (rate_per_unit).
/// @par Source
/// method.md, section 4, turns; D. Tedaldi, A. Pretto, E. Menegatti, ICRA 2014.
[[nodiscard]] TurnFit fit_turns(std::span<const GyroscopeTurn> turns,
                                const Eigen::Vector3d& bias,
                                const Eigen::Matrix3d& bias_covariance,
                                const TurnFitOptions& options = {});

/// The record of a gyroscope that was calibrated from turns: field `induced_rotation` of 1 rad/s.
/// @param instrument  its kind, axes, unit.
/// @param rest_sd     scatter of the rests' means, of each axis [unit].
[[nodiscard]] Calibration turn_calibration(const TurnFit& fit,
                                           const Instrument& instrument,
                                           const Eigen::Vector3d& rest_sd);

/// @return R(T) of each turn by a fit: to the sensor's frame before from that after.
[[nodiscard]] std::vector<Eigen::Matrix3d> integrated_rotations(
    std::span<const GyroscopeTurn> turns, const TurnFit& fit);

}  // namespace axiscal
