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

/// A turn: one rotation of a three-axis gyroscope, between two rests (periods without motion).
struct AXISCAL_EXPORT GyroscopeTurn {
  std::array<std::span<const double>, 3> readings;  ///< raw readings, n for each axis [unit]
  std::span<const double> time_s;                   ///< n times, ascending
  /// The upward vertical in the sensor's frame at the rests before and after the turn, for example
  /// the mean readings of an accelerometer. The vectors may have any length.
  Eigen::Vector3d up_before = Eigen::Vector3d::Zero();
  Eigen::Vector3d up_after = Eigen::Vector3d::Zero();
  /// The rotation from the sensor's frame after the turn to the sensor's frame before it, if the
  /// seats are known: R_sp R_b^T R_a R_sp^T. R_b and R_a rotate the positioner's frame to the
  /// table's before and after the turn; R_sp rotates the positioner's frame to the sensor's.
  std::optional<Eigen::Matrix3d> rotation_before_from_after;
  /// The known part of the Earth's rotation rate, in the sensor's frame at the rest before the turn
  /// [rad/s].
  Eigen::Vector3d earth_rate_in_sensor = Eigen::Vector3d::Zero();
  /// The effects of q independent errors that all turns share; each error has variance 1. Both
  /// matrices are 3 x q, with the same q for all turns. Column j is the effect of error j at the
  /// rest before the turn (errors_before) or after it (errors_after), in the sensor's frame at that
  /// rest. The effect is a change of the upward vertical or, if the seats are known, a change of
  /// the attitude, as a rotation vector [rad].
  Eigen::Matrix3Xd errors_before, errors_after;
  /// True if the turn begins at the rest at which the previous turn ended; the error of this rest
  /// then affects both turns.
  bool follows = true;
};

/// Sets the upward vertical at the rests before and after a turn from readings of an accelerometer.
/// Also sets errors_before and errors_after from the uncertainty of the accelerometer's
/// calibration.
/// @param mean_before, mean_after  mean readings of the accelerometer at these rests.
AXISCAL_EXPORT void between_directions(const Calibration& accelerometer,
                                       const Eigen::Vector3d& mean_before,
                                       const Eigen::Vector3d& mean_after,
                                       GyroscopeTurn& turn);

/// Sets the rotation of a turn from one seat of a cube to another. Also sets errors_before and
/// errors_after from the uncertainty of the face normals.
AXISCAL_EXPORT void set_turn_between_seats(const Positioner& positioner,
                                           const Eigen::Matrix3d& rotation_sensor_from_positioner,
                                           const DesignPoint& before,
                                           const DesignPoint& after,
                                           GyroscopeTurn& turn);

struct TurnFitOptions;

/// Sets the known part of the Earth's rotation in the turns, and its uncertainty in the options.
/// With a site, the vertical component is known and the heading is not. Without a site, only the
/// magnitude is known.
AXISCAL_EXPORT void set_earth_rotation(const std::optional<Site>& site,
                                       std::vector<GyroscopeTurn>& turns,
                                       TurnFitOptions& options);

/// The result of fit_rests(): the bias of a gyroscope, and the change of the bias with gravity.
struct AXISCAL_EXPORT RestFit {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  Eigen::Matrix3d bias_covariance = Eigen::Matrix3d::Zero();
  double degrees_of_freedom =
      std::numeric_limits<double>::infinity();  ///< degrees of freedom of bias_covariance
  /// standard deviation of the mean reading at a rest, for each axis [unit]
  Eigen::Vector3d sd = Eigen::Vector3d::Zero();
  /// Standard deviation of the bias from rest to rest. The noise of the rests' means is subtracted
  /// if it is known. 0: unknown or not significant.
  Eigen::Vector3d between_rests = Eigen::Vector3d::Zero();
  Eigen::Vector3d between_degrees_of_freedom = Eigen::Vector3d::Ones();
  /// Derivative of the bias with respect to the vectors `ups` of fit_rests(); one row for each axis
  /// [unit of the readings per unit of `ups`]
  std::optional<Eigen::Matrix3d> g_sensitivity;
  std::optional<Eigen::Matrix3d> g_sensitivity_se;
  /// p-value of the test that the axis has no g-sensitivity, for each axis
  Eigen::Vector3d p_value = Eigen::Vector3d::Ones();
  /// a text if the biases drift or are correlated between rests; otherwise empty
  std::string remark;
};

/// Computes the mean of the biases at the rests, and the change of the bias with gravity. If the
/// biases drift, or if the biases of consecutive rests are correlated, the covariance of the mean
/// includes this effect.
///
/// @param means   mean readings of the gyroscope at the rests, in time order, n x 3.
/// @param ups     the upward vertical at each rest, in the sensor's frame, n x 3.
/// @param mean_u  standard uncertainties of the means from the noise within each rest, n x 3. If
///                empty, the noise is unknown, and the bias is assumed to be equal at all rests.
[[nodiscard]] AXISCAL_EXPORT RestFit fit_rests(const Eigen::MatrixX3d& means,
                                               const Eigen::MatrixX3d& ups,
                                               const Eigen::MatrixX3d& mean_u = {});

struct AXISCAL_EXPORT TurnFitOptions {
  /// Approximate scale [rad/s per unit of the readings]. Default: the best of the usual scales; if
  /// none fits, the best of a grid of scales.
  std::optional<double> rate_per_unit;
  std::optional<Eigen::Matrix3d> start;  ///< approximate B = S^-1, used instead of rate_per_unit
  /// True: the bias is fitted to the turns, which suits logs with a wandering bias or with short
  /// rests. False: the bias of the rests is used.
  bool fit_bias = false;
  /// The search ends if the relative change of B is below this number. 1e-4 is enough to compare
  /// fits, because the sum of squares is then exact to 1e-8.
  double tolerance = 1e-10;
  /// Standard uncertainties of GyroscopeTurn::earth_rate_in_sensor [rad/s]: earth_up_u for the
  /// vertical component, earth_across_u for each of the two horizontal components.
  double earth_up_u = 0.0;
  double earth_across_u = 0.0;
  /// True: the uncertainty includes all sources (errors of the rests, sampling, the Earth's
  /// rotation, the directions). False is sufficient for a comparison of fits.
  bool whole_budget = true;
  /// True: only approximate rotations are needed (integrated_rotations()), and the uncertainty is
  /// not computed. If the turns leave unknowns undetermined, all axes get one scale.
  bool rotations_only = false;
};

/// A gyroscope's calibration from turns.
struct AXISCAL_EXPORT TurnFit {
  LinearResponse response;  ///< [unit, unit per rad/s]
  Eigen::Matrix3d inverse =
      Eigen::Matrix3d::Identity();  ///< B = S^-1: w = B (v - b) [rad/s per unit]
  /// The covariance (12 x 12), the half widths of the 95 % intervals, and the degrees of freedom of
  /// these intervals. The order of the parameters is x.bias, x.sensitivity.x, ... All three include
  /// all scatter, but not the uncertainties in `sources`.
  Eigen::MatrixXd covariance;
  Eigen::VectorXd interval_95;
  Eigen::VectorXd interval_dof;
  double degrees_of_freedom = 0.0;  ///< smallest degrees of freedom of a sensitivity
  /// Parts of the covariance besides the scatter of the turns: `bias` from the uncertainty of the
  /// mean bias at the rests, and `rests` from the change of the bias between rests.
  std::vector<ScatterComponent> components;
  /// Sources of uncertainty that scatter cannot show: `directions` or `positioner`, `rotation of
  /// the Earth`, `sampling`.
  std::vector<UncertaintySource> sources;
  double residual_sd_rad = 0.0;  ///< scatter of one component of a turn's attitude error
  /// scatter of the error of a rest, which affects the turn before and the turn after it
  double rest_sd_rad = 0.0;
  /// attitude error of each turn [rad], in the sensor's frame before the turn
  std::vector<Eigen::Vector3d> residuals;
  /// largest number of revolutions in one turn; motions in both directions are added
  double most_revolutions = 0.0;
  int rounds = 0;
  bool converged = false;
  bool has_rotations = false;  ///< true if all three components of each turn entered the fit
};

/// Fits scale factors and misalignments of a gyroscope to turns between rests. No rate table is
/// needed.
///
///     dR/dt = R [w cross],   w = B (v - b)
///     residual = log(R_known R(T)^T), or up_before - R(T) up_after
///
/// R(t) is the rotation since the start of the turn, and T is the time of its end. The first
/// residual is used if the seats are known; R_known is then
/// GyroscopeTurn::rotation_before_from_after. This residual has 3 independent components for each
/// turn. The second residual has 2.
///
/// The unknowns are the entries of B = S^-1. They are fitted by Gauss-Newton, with the analytic
/// derivative of the residual: -integral of R(t) e_p (v - b)_q dt for the entry B_pq.
///
/// The residual of a turn contains three errors: the error of the turn itself, and the errors of
/// the rests before and after it. The error of a rest also affects the other turn that borders on
/// this rest. Restricted likelihood estimates the variances of both kinds of errors. With fewer
/// than 18 degrees of freedom, the errors of the rests are ignored. Other errors that turns share,
/// such as the error of the bias at the rests, also affect the residuals. They are fitted as
/// unknowns with a prior (method.md, section 8).
///
/// @param turns  turns about three or more different axes.
/// @param rests  the result of fit_rests(). Only the bias, its covariance (0: the bias is exact),
///               the degrees of freedom of the covariance, and the scatter between rests are used.
/// @throws RefusedError, RankDeficientError  for too few turns; for turns about too few axes (the
///                                           message names the undetermined unknowns); if no scale
///                                           fits (the message gives the attitude error); or if a
///                                           turn has more than 20 revolutions, unless
///                                           rate_per_unit is stated.
/// @par Source
/// method.md, section 4, turns; D. Tedaldi, A. Pretto, E. Menegatti, ICRA 2014.
[[nodiscard]] AXISCAL_EXPORT TurnFit fit_turns(std::span<const GyroscopeTurn> turns,
                                               const RestFit& rests,
                                               const TurnFitOptions& options = {});

/// Creates the record of a gyroscope that was calibrated from turns. The record's field is
/// `induced_rotation` with the magnitude 1 rad/s.
/// @param instrument  the gyroscope; kind, axes and unit must be set.
/// @param rest_sd     standard deviation of the rests' means, for each axis [unit].
[[nodiscard]] AXISCAL_EXPORT Calibration turn_calibration(const TurnFit& fit,
                                                          const Instrument& instrument,
                                                          const Eigen::Vector3d& rest_sd);

/// @return the rotation matrix of each turn, computed with the fitted bias and B. It rotates the
///         sensor's frame after the turn to the sensor's frame before it.
[[nodiscard]] AXISCAL_EXPORT std::vector<Eigen::Matrix3d> integrated_rotations(
    std::span<const GyroscopeTurn> turns, const TurnFit& fit);

}  // namespace axiscal
