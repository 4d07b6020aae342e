// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/world.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/instruments/inclination.hpp"
#include "axiscal/positioner/design.hpp"
#include "axiscal/positioner/positioner.hpp"

namespace axiscal {

/// The settings of a forecast.
struct AXISCAL_EXPORT ForecastSetup {
  SensorModel nominal;              ///< the expected instrument, field and response
  std::vector<DesignEntry> design;  ///< the design points of one replicate
  int replicates = 1;
  Method method = Method::paired;
  double noise_sd = 0.0;  ///< scatter of one sample [unit of the readings]
  int samples = 1;        ///< independent samples that are averaged at each point
  Positioner positioner;  ///< the cube; its normal_covariance is used if it is stated
  /// Additional standard uncertainty of each face normal, for each of its two components.
  double normal_u_rad = 0.0;
  /// Standard uncertainty of the table's slope, for each of x and y. Only for method `known`.
  double level_u_rad = 0.0;
  Mount mount;  ///< the instrument's orientation and its repeatability
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< the expected slope of the table
  World world;  ///< errors of the readings in addition to white noise; each replicate is a block
};

/// @return the nominal instrument of an experiment: without bias and cross-axis terms, and with the
///         same sensitivity for each axis.
///
/// @throws SetupError  as make_field_description().
[[nodiscard]] AXISCAL_EXPORT SensorModel nominal_sensor(const Experiment& experiment,
                                                        double sensitivity);

/// The settings of a forecast for one replicate of an experiment's design. The caller must still
/// set the noise, the samples and the uncertainties of face normals and levelness.
///
/// If the experiment states no method, the method is the one that calibrate() would choose. If the
/// design has fewer than ten points, the method is `known` instead of `joint`, because such a
/// design does not determine the field's direction.
///
/// @param sensitivity  sensitivity of each axis [unit of the readings per field unit], not 0.
/// @throws SetupError  as make_field_description(), mount_rotation().
[[nodiscard]] AXISCAL_EXPORT ForecastSetup forecast_setup(const Experiment& experiment,
                                                          std::vector<DesignEntry> design,
                                                          double sensitivity = 1.0);

/// The expected uncertainty of a calibration, as one covariance of the coefficients for each
/// source. Each covariance is 4m x 4m, in the order of FitStatistics::covariance (b and S of each
/// axis).
struct Forecast {
  Eigen::MatrixXd noise;
  Eigen::MatrixXd positioner;          ///< from errors of the face normals; equal in all replicates
  Eigen::MatrixXd level;               ///< from the uncertainty of the table's slope
  Eigen::MatrixXd mount;               ///< from the mount's repeatability
  Eigen::MatrixXd world;               ///< from the simulated errors in ForecastSetup::world
  Eigen::VectorXd degrees_of_freedom;  ///< degrees of freedom of each axis's residual scatter
  LinearResponse response;             ///< the nominal response
  double magnitude = 1.0;              ///< F [field unit]

  [[nodiscard]] Eigen::MatrixXd covariance() const {
    return noise + positioner + level + mount + world;
  }
};

/// Propagates the noise and the uncertainties of face normals, levelness and mount to the
/// coefficients. The method's linear map from readings to coefficients is used.
///
/// The forecast includes these members of World: block_sd, seat_rad, mount_rad, remount_rad,
/// gain, jitter, wander, ends, ar, ar_white, walk_sd, round and periodic. It assumes that the
/// readings are in random order. Use run_study() for the other entries, for example drift, k2 and
/// k3.
///
/// The forecast assumes one slope of the table for the whole run. A forecast uncertainty is the
/// root mean square of the standard errors that many such calibrations state. The mean of these
/// standard errors is lower, by 11 % at 2 degrees of freedom and by 3 % at 7.
/// @throws DomainError         if the noise is negative, or replicates or samples are below 1.
/// @throws RankDeficientError  if the design does not determine the coefficients.
/// @throws RefusedError        if the cube cannot lie at a point, or if the method is `paired` and
///                             the design has no two points with the same rest face and opposite
///                             fence faces.
/// @par Source
/// method.md, sections 8 and 10; JCGM 100.
[[nodiscard]] AXISCAL_EXPORT Forecast forecast(const ForecastSetup& setup);

/// The expected uncertainty of pitch and roll from calibrated readings in one attitude.
struct AngleUncertainty {
  double pitch_rad = 0.0;  ///< standard uncertainty of the pitch, from the calibration only
  double roll_rad = 0.0;   ///< standard uncertainty of the roll; it grows as 1 / cos(pitch)
};

/// Computes the standard uncertainties of pitch and roll from the covariance of the coefficients.
/// @param covariance           covariance of biases and sensitivities, axis by axis:
///                             Forecast::covariance() or one of its parts.
/// @param pitch_rad, roll_rad  the attitude; axes forward-left-up.
/// @throws DomainError  if the instrument does not determine the field (fewer than three axes).
/// @par Source
/// method.md, section 7.
[[nodiscard]] AXISCAL_EXPORT AngleUncertainty
forecast_angles(const Forecast& forecast,
                const Eigen::MatrixXd& covariance,
                double pitch_rad,
                double roll_rad,
                PitchFormula formula = PitchFormula::arcsine);

/// @return the largest standard uncertainty of the field's direction from calibrated readings, over
///         all attitudes and all directions perpendicular to the field [rad].
/// @throws DomainError  as forecast_angles().
[[nodiscard]] AXISCAL_EXPORT double largest_angle_uncertainty(const Forecast& forecast,
                                                              const Eigen::MatrixXd& covariance);

/// Finds the smallest number of replicates of the design that gives a wanted uncertainty.
///
/// @param wanted_rad  the wanted largest_angle_uncertainty().
/// @return the number of replicates, each with setup.samples samples at a point: an integer up to
///         1e15. nullopt if no number is enough, because the uncertainty without noise already
///         exceeds `wanted_rad`.
/// @throws DomainError  if `wanted_rad` is not positive, and as forecast().
[[nodiscard]] AXISCAL_EXPORT std::optional<double> replicates_for_angle(const ForecastSetup& setup,
                                                                        double wanted_rad);

}  // namespace axiscal
