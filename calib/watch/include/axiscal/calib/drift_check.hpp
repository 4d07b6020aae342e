// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// One coefficient then and now.
struct ParameterChange {
  std::string parameter;
  double old_value = 0.0;
  double new_value = 0.0;
  double u = 0.0;    ///< standard uncertainty of the difference
  double z = 0.0;    ///< difference / u
  double e_n = 0.0;  ///< for intrinsic parameters, see e_n_score(); else NaN
};

/// Checks if a calibration is still valid.
struct DriftCheck {
  bool drifted = false;
  double p_value = 1.0;                    ///< that all coefficients differ so much by chance
  double alpha = 0.01;                     ///< below which it has drifted
  std::vector<ParameterChange> changes;    ///< one for every coefficient
  std::vector<ParameterChange> intrinsic;  ///< one for each that does not depend on the mounting
  double pitch_error_deg = 0.0;    ///< largest error of the pitch (up to 80 degrees) that the old
                                   ///< record now makes; of instruments without a pitch, of the
                                   ///< field's direction
  double pitch_error_u_deg = 0.0;  ///< its standard uncertainty, there
  /// Half width of its 95 % interval, as the largest over all directions, which without any drift
  /// is about 1.8 u already.
  double pitch_error_expanded_deg = 0.0;
  std::vector<std::string> notes;
};

/// Holds a fresh calibration against an old one: per axis Hotelling's T^2 of its coefficients with
/// both covariances, put together by Fisher's method, so that scatters estimated with few degrees
/// of freedom are paid for.
///
/// Errors that both share (the cube's normals of one positioner, the field's magnitude of one
/// model) do not count as a difference.
///
/// @param fresh  of the same axes; its field's unit is converted.
/// @throws DomainError  if axes or fields are not the same, or neither states a covariance.
/// @par Source
/// method.md, section 8; Hotelling (1931); Fisher (1932).
[[nodiscard]] AXISCAL_EXPORT DriftCheck check_drift(const Calibration& old,
                                                    const Calibration& fresh,
                                                    double alpha = 0.01);

/// Compares fresh biases with those of a record of method bias whose biases contain the field
/// (gives_field()). Each axis is compared at the fresh readings' temperature; Fisher's method
/// combines them. Such a record lacks directions, so the instrument must be in its former
/// orientation.
///
/// @param fresh        by method bias, of readings taken to the old record's reference
///                     (at_reference_temperature()), without temperature terms.
/// @param temperature  mean of the fresh readings'; nothing: they count as at the reference.
/// @throws DomainError  if the axes are not the same, or one states no covariance.
[[nodiscard]] AXISCAL_EXPORT DriftCheck
check_biases(const Calibration& old,
             const Calibration& fresh,
             const std::optional<SensorTemperature>& temperature,
             double alpha = 0.01);

/// Readings that were taken at some temperature, as a calibration with temperature terms expects
/// them at its reference; so a short run at room temperature can be held against it.
[[nodiscard]] AXISCAL_EXPORT Observations at_reference_temperature(Observations observations,
                                                                   const Calibration& calibration);

/// A static reading in use, in whatever attitude.
struct InSituReading {
  int run = 1;
  double residual = 0.0;  ///< |f_hat| - F [field unit]
  double limit = 0.0;     ///< control limit of its size
  bool within = true;
};

/// Static readings against the control limits of their residuals (method.md, section 5, residual
/// RSS).
struct InSituCheck {
  bool drifted = false;
  double p_value = 1.0;  ///< that the residuals are so large by chance
  double rss = 0.0;      ///< root of the sum of their squares [field unit]
  double expected_rss = 0.0;
  std::vector<InSituReading> readings;
};

/// Readings within 5 degrees are one pose; the poses' means are held against what the calibration's
/// whole covariance and the readings' noise allow, all together, with four fifths of alpha. The
/// worst reading alone has the rest. One pose cannot tell more than the calibration is known by,
/// however many the readings.
///
/// @param observations  readings of all axes at rest; labels are not needed.
/// @param alpha  of the run as a whole; each reading's limit is set for a fifth of alpha / n.
/// @throws DomainError  for fewer than three axes, or a record without covariance.
[[nodiscard]] AXISCAL_EXPORT InSituCheck check_in_situ(const Calibration& calibration,
                                                       const Observations& observations,
                                                       double alpha = 0.01);

/// The largest error of an angle, and where it is made.
struct AXISCAL_EXPORT WorstAngle {
  double error_deg = 0.0;
  Eigen::Vector3d field = Eigen::Vector3d::UnitZ();  ///< where [field unit]
};

/// The largest error of the pitch (up to 80 degrees), or of the field's direction for instruments
/// without a pitch, that readings of one response make when they are reduced with another.
///
/// @param used  what reduces them.
/// @param now   what the instrument answers.
[[nodiscard]] AXISCAL_EXPORT WorstAngle worst_angle(const Calibration& used,
                                                    const Calibration& now);

}  // namespace axiscal
