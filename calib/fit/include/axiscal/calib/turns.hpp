// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/field/site.hpp"
#include "axiscal/positioner/positioner.hpp"

namespace axiscal {

/// The turn of a three-axis gyroscope from one rest to the next.
struct AXISCAL_EXPORT GyroscopeTurn {
  std::array<std::span<const double>, 3> readings;  ///< raw, n samples of each axis [unit]
  std::span<const double> time_s;                   ///< n times, ascending
  /// Up in the sensor's frame at the rests before and after, any length: an accelerometer's means.
  Eigen::Vector3d up_before = Eigen::Vector3d::Zero();
  Eigen::Vector3d up_after = Eigen::Vector3d::Zero();
  /// Where the seats are known: to the sensor's frame before from that after, R_sp R_a R_b^T
  /// R_sp^T.
  std::optional<Eigen::Matrix3d> rotation_before_from_after;
  /// The Earth's rotation in the sensor's frame at the rest before [rad/s], as far as it is known.
  Eigen::Vector3d earth_rate_in_sensor = Eigen::Vector3d::Zero();
  /// Effect of shared errors of variance 1 on the known quantities at the rests, 3 x q. The
  /// quantity is the direction up or, if the seats are known, the attitude as a rotation vector
  /// [rad]; both are in the sensor's frame at the rest. All turns have the same q.
  Eigen::Matrix3Xd errors_before, errors_after;
  /// True if the turn begins at the rest that ended the turn before it; the two turns then share
  /// the error of that rest.
  bool follows = true;
};

/// Sets the directions up at the rests before and after the turn from an accelerometer, with the
/// uncertainty left by its calibration.
/// @param mean_before, mean_after  its readings there.
AXISCAL_EXPORT void between_directions(const Calibration& accelerometer,
                                       const Eigen::Vector3d& mean_before,
                                       const Eigen::Vector3d& mean_after,
                                       GyroscopeTurn& turn);

/// Sets the rotation between two seats of a cube, with the uncertainty left by its face normals.
AXISCAL_EXPORT void between_seats(const Positioner& positioner,
                                  const Eigen::Matrix3d& rotation_sensor_from_positioner,
                                  const DesignPoint& before,
                                  const DesignPoint& after,
                                  GyroscopeTurn& turn);

struct TurnFitOptions;

/// Puts in the Earth's rotation: along up it is known where the site is; no heading is known, and
/// without a site no more than its size.
AXISCAL_EXPORT void take_out_earth(const std::optional<Site>& site,
                                   std::vector<GyroscopeTurn>& turns,
                                   TurnFitOptions& options);

/// The result of the rests of a gyroscope: its bias, and the change of the bias with gravity.
struct AXISCAL_EXPORT RestFit {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  Eigen::Matrix3d bias_covariance = Eigen::Matrix3d::Zero();
  double degrees_of_freedom = std::numeric_limits<double>::infinity();  ///< of the covariance
  Eigen::Vector3d sd = Eigen::Vector3d::Zero();  ///< standard deviation of a rest's mean
  /// Standard deviation of the bias from rest to rest beyond the noise of the means; 0: not known.
  Eigen::Vector3d between_rests = Eigen::Vector3d::Zero();
  Eigen::Vector3d between_degrees_of_freedom = Eigen::Vector3d::Ones();
  std::optional<Eigen::Matrix3d> g_sensitivity;  ///< [unit per length of the directions]
  std::optional<Eigen::Matrix3d> g_sensitivity_se;
  Eigen::Vector3d p_value = Eigen::Vector3d::Ones();  ///< that an axis has none
  std::string remark;  ///< where rests drift or are alike; else empty
};

/// The mean bias of the rests. If the rests drift, or if consecutive ones are correlated, its
/// covariance allows for it.
///
/// @param means   of the gyroscope at the rests, in their order, n x 3.
/// @param ups     the directions up there, n x 3.
/// @param mean_u  standard uncertainties of the means by the noise within each rest, n x 3; empty:
///                unknown, and the bias is taken as the same at all rests.
[[nodiscard]] AXISCAL_EXPORT RestFit fit_rests(const Eigen::MatrixX3d& means,
                                               const Eigen::MatrixX3d& ups,
                                               const Eigen::MatrixX3d& mean_u = {});

struct AXISCAL_EXPORT TurnFitOptions {
  /// rad/s per unit of the readings, roughly; default: found among the usual ones.
  std::optional<double> rate_per_unit;
  std::optional<Eigen::Matrix3d> start;  ///< B of a fit that is near, instead
  /// True if the turns determine the bias too, instead of the rests. Use it for logs with a
  /// wandering bias or with short rests.
  bool fit_bias = false;
  /// Relative change of B at which the search ends. 1e-4 is enough to compare fits: the sum of
  /// squares is then exact to 1e-8.
  double tolerance = 1e-10;
  /// Standard uncertainties of the Earth's rotation that the turns state [rad/s]: along up, and
  /// along each of two horizontal directions.
  double earth_up_u = 0.0;
  double earth_across_u = 0.0;
  /// True if the uncertainty includes all its sources: errors of the rests, sampling, the Earth,
  /// the directions. A comparison of fits does not need them.
  bool whole_budget = true;
  /// Whether no more is asked for than roughly how it was turned (integrated_rotations()): then the
  /// turns may leave a part open, one scale is taken for all axes then, and no uncertainty is said.
  bool rotations_only = false;
};

/// A gyroscope's calibration from turns.
struct AXISCAL_EXPORT TurnFit {
  LinearResponse response;  ///< [unit, unit per rad/s]
  Eigen::Matrix3d inverse =
      Eigen::Matrix3d::Identity();  ///< B = S^-1: w = B (v - b) [rad/s per unit]
  /// For the parameters x.bias, x.sensitivity.x, ..., from all scatter: the 12 x 12 covariance, the
  /// half widths of the 95 % intervals, and their degrees of freedom.
  Eigen::MatrixXd covariance;
  Eigen::VectorXd interval_95;
  Eigen::VectorXd interval_dof;
  double degrees_of_freedom = 0.0;  ///< of the turns' scatter: the least of a sensitivity
  /// Parts of the covariance besides the turns' scatter: `bias` comes from the scatter of the
  /// rests.
  std::vector<ScatterComponent> components;
  /// Parts that scatter cannot show: `directions` or `positioner`, `rotation of the Earth`,
  /// `sampling`.
  std::vector<UncertaintySource> sources;
  double residual_sd_rad = 0.0;            ///< scatter of one component of a turn's attitude error
  double rest_sd_rad = 0.0;                ///< of it that of a rest, which two turns share
  std::vector<Eigen::Vector3d> residuals;  ///< attitude error of each turn [rad], frame before
  double most_revolutions = 0.0;  ///< that one turn makes by the fit, there and back counted both
  int rounds = 0;
  bool converged = false;
  bool has_rotations = false;  ///< true if all three components of each turn entered the fit
};

/// Gyroscope scale factors and misalignments from turns between rests, without a rate table.
///
///     dR/dt = R [w cross],   w = B (v - b)
///     residual = log(R_known R(T)^T), or R(T) up_after - up_before: 3 or 2 numbers a turn
///
/// Gauss-Newton in B = S^-1, with the analytic derivative -integral of R(t) e_p (v - b)_q dt.
///
/// A turn has errors of its own. It also has the errors of the rests at its ends; the turns before
/// and after share them (from 18 degrees of freedom on). Restricted likelihood estimates both
/// variances. Other shared errors, above all the bias at the rests, are unknowns with a prior,
/// because the residuals show them too (method.md, section 8).
///
/// @param turns  three or more about different axes.
/// @param rests  bias, covariance of their mean, 0: it is exact, and its degrees of freedom count.
/// @throws RefusedError, RankDeficientError  for too few turns, turns about too few axes (the
///                                           message names what stays open), or where no scale fits
///                                           (the message says how far off it is), or one that
///                                           makes more than 20 revolutions of a turn, unless it
///                                           was stated (rate_per_unit).
/// @par Source
/// method.md, section 4, turns; D. Tedaldi, A. Pretto, E. Menegatti, ICRA 2014.
[[nodiscard]] AXISCAL_EXPORT TurnFit fit_turns(std::span<const GyroscopeTurn> turns,
                                               const RestFit& rests,
                                               const TurnFitOptions& options = {});

/// The record of a gyroscope that was calibrated from turns: field `induced_rotation` of 1 rad/s.
/// @param instrument  its kind, axes, unit.
/// @param rest_sd     scatter of the rests' means, of each axis [unit].
[[nodiscard]] AXISCAL_EXPORT Calibration turn_calibration(const TurnFit& fit,
                                                          const Instrument& instrument,
                                                          const Eigen::Vector3d& rest_sd);

/// @return R(T) of each turn by a fit: to the sensor's frame before from that after.
[[nodiscard]] AXISCAL_EXPORT std::vector<Eigen::Matrix3d> integrated_rotations(
    std::span<const GyroscopeTurn> turns, const TurnFit& fit);

}  // namespace axiscal
