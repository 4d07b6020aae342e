// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/choices.hpp"
#include "axiscal/calib/fit_statistics.hpp"
#include "axiscal/calib/levelness.hpp"
#include "axiscal/calib/sensor_temperature.hpp"
#include "axiscal/calib/uncertainty_budget.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/field/field_level.hpp"
#include "axiscal/instruments/polar_form.hpp"
#include "axiscal/positioner/design_point.hpp"

namespace axiscal {

/// The residual of one reading.
struct ReadingResidual {
  int run = 1;
  std::optional<DesignPoint> point;
  std::optional<FieldLevel> level;
  std::optional<int> block;
  std::optional<SensorTemperature> temperature;
  Eigen::VectorXd response;  ///< response minus the fit, m entries [unit]
  /// |f_hat| - F [field unit]. f_hat is the field computed from the reading, and F is the magnitude
  /// of the reference field. NaN for m < 3.
  double magnitude = 0.0;
  bool used = true;  ///< false if the reading was left out of the fit for all axes
};

/// The fit of one axis in polar form: bias, sensitivity, coning angle and azimuth (method.md,
/// section 3.1).
struct PolarFit {
  double bias = 0.0;  ///< bias of the axis [unit of the readings]
  PolarForm form;
  double residual_sd = 0.0;  ///< scatter of one reading [unit]; NaN for 0 degrees of freedom
  int rounds = 0;            ///< number of Gauss-Newton iterations
  bool converged = false;
};

/// Describes how well readings in arbitrary orientations cover the sphere, and how well the fit
/// agrees with them. Here f is the field computed from a reading, and F is the magnitude of the
/// reference field. The programs magneto and MotionCal show the same figures.
struct AXISCAL_EXPORT OrientationQuality {
  double fit_error = 0.0;         ///< rms of |f| - F over the calibrated readings f, divided by F
  double magnitude_spread = 0.0;  ///< standard deviation of |f|, divided by F
  double coverage = 0.0;          ///< share of the sphere that is within 30 degrees of a reading
  double largest_gap_rad = 0.0;   ///< largest angle between a direction and its nearest reading
  /// Direction of the largest gap, in the sensor's frame.
  Eigen::Vector3d gap = Eigen::Vector3d::UnitZ();
};

/// The rotation between two instruments that were recorded together.
struct AXISCAL_EXPORT Alignment {
  Eigen::Matrix3d rotation_companion_from_sensor = Eigen::Matrix3d::Identity();
  /// Standard errors of the rotation about the companion's axes x, y, z.
  Eigen::Vector3d standard_error_rad = Eigen::Vector3d::Zero();
  /// Angle between the fields of the two instruments. For gravity and the Earth's magnetic field,
  /// this angle is the dip plus 90 degrees.
  double angle_rad = 0.0;
  double angle_se_rad = 0.0;
  double residual_sd = 0.0;  ///< scatter of the cosine of angle_rad
};

/// The rotation between the instrument's frame and the frame of a companion in the same recording.
struct CompanionAlignment {
  std::string record;  ///< name of the companion's record, as given
  Alignment alignment;
};

/// The rotation between the frames of two instruments of one assembly.
struct AXISCAL_EXPORT SlotAlignment {
  std::string slot;  ///< slot of the other instrument
  Eigen::Matrix3d rotation_other_from_sensor = Eigen::Matrix3d::Identity();
  /// Standard uncertainties of the rotation about x, y, z.
  Eigen::Vector3d u_rad = Eigen::Vector3d::Zero();
  /// Half widths of the 95 % intervals of the rotation about x, y, z.
  Eigen::Vector3d expanded_rad = Eigen::Vector3d::Zero();
};

/// A check of the stated uncertainties of cube and table. The calibrated instrument measures the
/// field's magnitude in every orientation. The true magnitude is the same in all orientations, so
/// the uncertainties should explain the scatter of the measured magnitudes.
struct FieldSizeCheck {
  int orientations = 0;           ///< number of readings
  double relative_sd = 0.0;       ///< relative scatter of the measured magnitudes
  double by_noise = 0.0;          ///< expected relative_sd from the noise of the readings
  double by_inputs = 0.0;         ///< expected relative_sd from the stated uncertainties
  double degrees_of_freedom = 0;  ///< degrees of freedom of relative_sd
  double p_value = 1.0;           ///< probability that noise and inputs cause at least this scatter
};

/// The procedure and the quality of a sensor's fit.
struct CalibrationFit {
  std::optional<Method> method;  ///< nullopt if other software made the fit
  Weighting weights = Weighting::none;
  bool robust = false;
  bool level_by_block = false;          ///< true if a slope of the table was fitted for each block
  std::vector<int> left_out;            ///< run numbers of the readings that are not used
  std::vector<PolarFit> polar_fit;      ///< the polar fit of each axis, if it was requested
  std::optional<MagnitudeShape> shape;  ///< shape of the sensitivity matrix; only method magnitude
  std::optional<FitStatistics> statistics;
  std::optional<UncertaintyBudget> uncertainty;    ///< nullopt without statistics
  CalibrationConditions conditions;                ///< measurement conditions of the readings
  std::optional<OrientationQuality> orientations;  ///< only for method magnitude
  /// The attitude error after each turn [rad], in the sensor's frame before the turn. Only for
  /// method turns.
  std::vector<Eigen::Vector3d> turn_errors_rad;
  std::optional<CompanionAlignment> alignment;  ///< rotation to the companion instrument
  std::vector<SlotAlignment> slot_alignments;   ///< rotations to the assembly's other instruments
  /// Check of the field's magnitude; nullopt without three axes or without design points.
  std::optional<FieldSizeCheck> field_size;
  std::optional<Levelness> levelness;
  std::vector<ReadingResidual> residuals;
};

}  // namespace axiscal
