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

/// An experiment before the experiment.
struct AXISCAL_EXPORT ForecastSetup {
  SensorModel nominal;              ///< instrument, field and response as expected
  std::vector<DesignEntry> design;  ///< one replicate
  int replicates = 1;
  Method method = Method::paired;
  double noise_sd = 0.0;      ///< scatter of one sample [unit of the readings]
  int samples = 1;            ///< averaged at each point, independent
  Positioner positioner;      ///< its normal_covariance counts where there is one
  double normal_u_rad = 0.0;  ///< more uncertainty of each face normal, two directions, independent
  double level_u_rad = 0.0;   ///< `known`: of the table's slope along x and y; others measure it
  Mount mount;                ///< the instrument's orientation; its repeatability counts
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< the expected slope of the table
  World world;  ///< the errors of the readings besides white noise; each replicate is a block
};

/// An instrument as an experiment describes it: no bias, no cross-axis terms, and on each axis the
/// sensitivity that it should have.
///
/// @throws SetupError  as make_field_description().
[[nodiscard]] AXISCAL_EXPORT SensorModel nominal_sensor(const Experiment& experiment,
                                                        double sensitivity);

/// The inputs of a forecast for one replicate of an experiment's design. Noise, samples and the
/// uncertainties of face normals and levelness must still be stated.
///
/// Where the experiment states no method it is the one that calibrate() would choose; with fewer
/// than ten points, which leave the field's direction open, a table known to be level.
///
/// @param sensitivity  of each axis, not 0.
/// @throws SetupError  as make_field_description(), mount_rotation().
[[nodiscard]] AXISCAL_EXPORT ForecastSetup forecast_setup(const Experiment& experiment,
                                                          std::vector<DesignEntry> design,
                                                          double sensitivity = 1.0);

/// The expected uncertainty of a calibration: root mean square errors, as covariances by source.
struct Forecast {
  Eigen::MatrixXd noise;       ///< covers b, S by axis (as FitStatistics::covariance), 4m x 4m
  Eigen::MatrixXd positioner;  ///< replicates do not average it
  Eigen::MatrixXd level;
  Eigen::MatrixXd mount;               ///< the part of its repeatability; a refit would average it
  Eigen::MatrixXd world;               ///< the part of the world
  Eigen::VectorXd degrees_of_freedom;  ///< per axis, of the residual scatter
  LinearResponse response;             ///< the nominal one
  double magnitude = 1.0;              ///< F [field unit]

  [[nodiscard]] Eigen::MatrixXd covariance() const {
    return noise + positioner + level + mount + world;
  }
};

/// Propagates noise, face normals, levelness and the mount's repeatability to the coefficients by
/// the method's own linear map from readings to coefficients.
///
/// The forecast counts the entries of a world that scatter: block_sd, seat_rad, mount_rad,
/// remount_rad, gain, jitter, wander, ends, ar, ar_white, walk_sd, round and periodic, in random
/// order. A drift, k2 and k3 are not scatter; use study() for them.
///
/// One levelness for the run is assumed. The figures are root mean squares over many
/// calibrations; the mean of the standard errors that they will state is lower, by 11 % at 2
/// degrees of freedom and 3 % at 7.
/// @throws DomainError         if the noise is negative, or replicates or samples are below 1.
/// @throws RankDeficientError  if the design does not determine the coefficients.
/// @throws RefusedError        if the cube cannot lie at a point, or no opposites suit `paired`.
/// @par Source
/// method.md, sections 8 and 10; JCGM 100.
[[nodiscard]] AXISCAL_EXPORT Forecast forecast(const ForecastSetup& setup);

/// The expected uncertainty of calibrated readings in an attitude.
struct AngleUncertainty {
  double pitch_rad = 0.0;  ///< standard uncertainty that the calibration alone leaves
  double roll_rad = 0.0;   ///< grows as 1 / cos(pitch)
};

/// @param covariance  of b, S by axis: Forecast::covariance(), or a block.
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

/// @return the largest standard uncertainty of the field's direction as calibrated readings give
/// it, over all attitudes and both ways in which it can be off [rad].
/// @throws DomainError  as forecast_angles().
[[nodiscard]] AXISCAL_EXPORT double largest_angle_uncertainty(const Forecast& forecast,
                                                              const Eigen::MatrixXd& covariance);

/// Replicates for a wanted uncertainty.
///
/// @param wanted_rad  largest_angle_uncertainty() to be reached.
/// @return the number of replicates (of setup.samples each) that is enough, an integer, up to 1e15;
///         nullopt if no number is enough, because positioner or level alone exceed the limit.
/// @throws DomainError  if `wanted_rad` is not positive; else as forecast().
[[nodiscard]] AXISCAL_EXPORT std::optional<double> replicates_for_angle(const ForecastSetup& setup,
                                                                        double wanted_rad);

}  // namespace axiscal
