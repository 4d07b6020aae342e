// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/positioner/positioner.hpp"

namespace axiscal {

/// A calibrated instrument's readings in the positioner that is to be measured.
struct Reference {
  std::string slot;  ///< name of its mount, each its own
  /// The instrument. References with equal names are one instrument that was mounted again.
  std::string instrument;
  Calibration calibration;    ///< its record, three axes or more
  Observations observations;  ///< its readings, with design points
};

struct CharacterizeOptions {
  std::string id;  ///< the name of the new positioner
  /// Bias and length of each sensing axis are fitted with the rest, as the parts along the normals
  /// determine them: only the angles between the axes are taken from the records.
  bool free_bias_and_scale = true;
  LevelBy level_by = LevelBy::run;     ///< one slope of the table for each reference, or each block
  std::vector<std::string> leave_out;  ///< slots not used
  /// The cube as drawn: with its feet the seats' headings are exact, and they go into the result.
  Positioner drawing;
};

/// The result for one reference.
struct AXISCAL_EXPORT ReferenceResult {
  std::string slot;
  Eigen::Matrix3d rotation_sensor_from_positioner = Eigen::Matrix3d::Identity();
  Eigen::Vector3d mount_se_rad = Eigen::Vector3d::Zero();  ///< about the sensor's axes
  double residual_sd = 0.0;  ///< scatter of a reading, all axes alike [field unit]
  int worst_run = 0;         ///< the reading that is furthest from the fit
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< slope of the table, mean over its blocks
  /// Probability that this instrument's normals differ so much from the others' by chance; NaN if
  /// there is only one instrument.
  double p_value = 0.0;
};

/// The effect of remounting an instrument.
struct MountRepeatability {
  std::string instrument;
  std::vector<std::string> slots;   ///< its mounts of nearly one orientation
  double sd_rad = 0.0;              ///< the scatter of each small rotation, without the fit's noise
  double degrees_of_freedom = 0.0;  ///< 3 (mounts - 1)
};

/// A measured positioner and how far it can be trusted.
struct Characterization {
  Positioner positioner;  ///< normals with covariance, mounts
  std::vector<ReferenceResult> references;
  std::vector<MountRepeatability> repeatability;
  double normal_u_rad = 0.0;     ///< standard uncertainty of a normal, either way; rms over faces
  double noise_rad = 0.0;        ///< the part of it that comes from the readings' scatter
  double transferred_rad = 0.0;  ///< the part that the instruments' own calibrations hand on
  double p_value = 0.0;  ///< that the instruments agree no better by chance; NaN for a single one
  /// Slots, parted by commas, of the instrument that disagrees (p < 0.005); of two instruments
  /// nobody knows which, so empty.
  std::string suspect;
  bool consistent = true;
  std::vector<std::string> warnings;  ///< warnings, a sentence each
};

/// The scatter of refits of one instrument: rotations of nearly one orientation.
///
/// @param mounts        rotation_sensor_from_positioner of each, two or more, within 0.1 rad.
/// @param fit_variance  mean variance of a mount's rotation about one axis, of the fit [rad^2].
/// @return sd_rad = sqrt(max(0, variance between the mounts - fit_variance)).
/// @throws DomainError  for fewer than two, or ones further apart.
[[nodiscard]] AXISCAL_EXPORT MountRepeatability
estimate_repeatability(const std::vector<Eigen::Matrix3d>& mounts, double fit_variance);

/// Measures a cube with calibrated instruments: six face normals with their covariance, and mounts.
///
/// Each reference k takes the design points, several times. The model of a reading is
///
///     v = b + (1 + scale) S M_k R_i(n)^T f_table,   R_i the seat by the normals n,
///
/// with unknown normals n, mounts M_k, a slope of the table for each run and, by default, bias and
/// scale of each axis. The start is a generalised Procrustes fit of the averages over opposite
/// points. Gauss-Newton then uses all readings, weighted by each reference's scatter, so the
/// table's tilt does not matter. Gauge: among all frames, the one that fits the nominal cube best
/// (sum of e_r cross n_r is 0). The records' covariances are propagated to the normals. The
/// uncertainty from K independent calibrations decreases as 1 / sqrt(K). Their shared errors (one
/// reference cube, the error of one method) remain and are not in the covariance. An instrument
/// that was also fitted in a mount turned by more than 0.5 rad determines the angles between its
/// axes too.
///
/// @param references  one or more, each with all six rest faces between them, and opposite
/// readings.
/// @throws RefusedError  if there are none left, a field is not along the table's normal, an
///                       instrument has fewer than three axes, a face was never the rest face, or
///                       the readings do not determine the cube.
/// @throws DomainError   if a slot lacks a name or two slots share one, or if readings and record
///         differ in their number of axes.
/// @throws SetupError    if leave_out names a slot that is not there.
/// @par Source
/// method.md, section 9; US 7,467,536; beyond it.
[[nodiscard]] AXISCAL_EXPORT Characterization characterize(const std::vector<Reference>& references,
                                                           const CharacterizeOptions& options = {});

}  // namespace axiscal
