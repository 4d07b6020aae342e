// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The change of one coefficient from the old record to the fresh one.
struct ParameterChange {
  std::string parameter;
  double old_value = 0.0;
  double new_value = 0.0;
  double u = 0.0;    ///< standard uncertainty of the difference
  double z = 0.0;    ///< difference / u
  double e_n = 0.0;  ///< see e_n_score(); NaN if the parameter is not intrinsic
};

/// The result of a test of whether a calibration is still valid.
struct DriftCheck {
  bool drifted = false;
  double p_value = 1.0;  ///< probability of such large changes without a drift
  /// Significance level: `drifted` is true if p_value < alpha.
  double alpha = 0.01;
  std::vector<ParameterChange> changes;    ///< one for each coefficient
  std::vector<ParameterChange> intrinsic;  ///< one for each of intrinsic_parameters()
  /// The largest error of the pitch (for pitches up to 80 degrees) if new readings are reduced with
  /// the old record. For an instrument without a pitch it is the largest error of the field's
  /// direction.
  double pitch_error_deg = 0.0;
  double pitch_error_u_deg = 0.0;  ///< standard uncertainty of pitch_error_deg
  /// Half width of the 95 % interval of pitch_error_deg. The interval is valid for the largest
  /// error over all directions, not only for the error in one direction. Even without a drift, this
  /// largest error is about 1.8 times pitch_error_u_deg.
  double pitch_error_expanded_deg = 0.0;
  std::vector<std::string> notes;
};

/// Compares a fresh calibration with an old one. Hotelling's T^2 tests the coefficients of each
/// axis with the covariances of both records. Fisher's method combines the axes. The test takes the
/// degrees of freedom of the estimated scatters into account.
///
/// Errors that both records share cancel, so the uncertainties of these errors are left out. The
/// errors of the face normals are shared if both records used the same positioner. The error of the
/// field's magnitude is shared if both records took the magnitude from the same source.
///
/// @param fresh  a calibration with the same axes as `old`. Its values are converted to the field
///               unit of `old`.
/// @throws DomainError  if the axes or the fields are not the same, or if neither record states a
/// covariance.
/// @par Source
/// method.md, section 8; Hotelling (1931); Fisher (1932).
[[nodiscard]] AXISCAL_EXPORT DriftCheck check_drift(const Calibration& old,
                                                    const Calibration& fresh,
                                                    double alpha = 0.01);

/// Compares fresh biases with a record of method `bias` whose biases include the response to the
/// field (gives_field() is false). Each axis is compared at the temperature of the fresh readings.
/// Fisher's method combines the p-values of the axes. The record does not determine the directions
/// of the axes, so the instrument must be in the same orientation as for the record.
///
/// @param fresh        a calibration by method `bias` without temperature terms. Its readings must
///                     be converted to the reference temperature of `old` by
///                     at_reference_temperature().
/// @param temperature  the mean temperature of the fresh readings; nullopt: the reference
///                     temperature.
/// @throws DomainError  if the axes are not the same, or if a record states no covariance.
[[nodiscard]] AXISCAL_EXPORT DriftCheck
check_biases(const Calibration& old,
             const Calibration& fresh,
             const std::optional<SensorTemperature>& temperature,
             double alpha = 0.01);

/// Converts readings to the reference temperature of a calibration with temperature terms, so that
/// a short run at room temperature can be compared with this calibration.
[[nodiscard]] AXISCAL_EXPORT Observations at_reference_temperature(Observations observations,
                                                                   const Calibration& calibration);

/// The residual of one static reading in any attitude.
struct InSituReading {
  int run = 1;
  double residual = 0.0;  ///< measured minus stated magnitude of the field [field unit]
  double limit = 0.0;     ///< control limit of |residual| [field unit]
  bool within = true;
};

/// The result of check_in_situ().
struct InSituCheck {
  bool drifted = false;
  double p_value = 1.0;  ///< probability of such residuals without a drift
  double rss = 0.0;      ///< root of the sum of the squared residuals [field unit]
  double expected_rss = 0.0;
  std::vector<InSituReading> readings;
};

/// Tests whether the field magnitudes computed from static readings agree with the stated magnitude
/// (docs/method/watching.md).
///
/// Readings whose field directions differ by less than 5 degrees form one group. The first test
/// compares the mean residuals of all groups with the covariance of the calibration and the noise
/// of the readings. Its significance level is 4/5 alpha. The second test is of the reading whose
/// residual is largest relative to its uncertainty, at the level 1/5 alpha. A drift that is smaller
/// than the uncertainty of the calibration cannot be detected by more readings in one orientation.
///
/// @param observations  readings of all axes at rest; their poses need not be stated.
/// @param alpha  the probability of a false alarm for the run. Without a drift, each of the n
///               readings exceeds its limit with the probability alpha / (5 n).
/// @throws DomainError  if there are fewer than three axes, or if the record has no covariance.
[[nodiscard]] AXISCAL_EXPORT InSituCheck check_in_situ(const Calibration& calibration,
                                                       const Observations& observations,
                                                       double alpha = 0.01);

/// The largest error of an angle, and the field at which it occurs.
struct AXISCAL_EXPORT WorstAngle {
  double error_deg = 0.0;
  Eigen::Vector3d field = Eigen::Vector3d::UnitZ();  ///< in the sensor frame [field unit]
};

/// Returns the largest error that arises if readings follow one calibration and are reduced with
/// another. This is the error of the pitch, for pitches up to 80 degrees. For instruments without a
/// pitch, the error of the field's direction is returned.
///
/// @param used  the calibration with which the readings are reduced.
/// @param now   the calibration that describes the actual response of the instrument.
[[nodiscard]] AXISCAL_EXPORT WorstAngle worst_angle(const Calibration& used,
                                                    const Calibration& now);

}  // namespace axiscal
