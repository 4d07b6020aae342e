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

/// The readings of a calibrated instrument in the positioner that is measured.
struct Reference {
  std::string slot;  ///< unique name of the instrument's mount
  /// The instrument. References with equal names are one instrument that was mounted again.
  std::string instrument;
  Calibration calibration;    ///< the instrument's record, with three axes or more
  Observations observations;  ///< the instrument's readings, with design points
};

struct CharacterizeOptions {
  std::string id;  ///< the name of the new positioner
  /// If true, the bias and the sensitivity |S_k| of each axis are fitted too, from the readings of
  /// the six faces. Only the angles between the axes then come from the records.
  bool free_bias_and_scale = true;
  /// States whether one slope of the table is fitted for each reference or for each block of a
  /// reference.
  LevelBy level_by = LevelBy::run;
  std::vector<std::string> leave_out;  ///< slots that are not used
  /// The cube of the drawing. If it has feet, the cube's heading at each design point follows
  /// exactly from the feet that touch the fence, and the measured positioner gets these feet.
  Positioner drawing;
};

/// The result for one reference.
struct AXISCAL_EXPORT ReferenceResult {
  std::string slot;
  Eigen::Matrix3d rotation_sensor_from_positioner = Eigen::Matrix3d::Identity();
  /// Standard uncertainty of the mount's rotation about the sensor's axes x, y, z.
  Eigen::Vector3d mount_se_rad = Eigen::Vector3d::Zero();
  double residual_sd = 0.0;  ///< scatter of a reading, pooled over the axes [field unit]
  int worst_run = 0;         ///< run number of the reading with the largest residual
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< slope of the table, mean of all blocks
  /// The probability that the normals from this instrument differ this much, by chance alone, from
  /// the normals from the other instruments; NaN if there is only one instrument.
  double p_value = 0.0;
};

/// The repeatability of the orientation if an instrument is mounted again.
struct MountRepeatability {
  std::string instrument;
  std::vector<std::string> slots;  ///< slots with nearly the same orientation of the instrument
  /// Standard deviation of the rotation about each axis between mounts, without the fit's noise.
  double sd_rad = 0.0;
  double degrees_of_freedom = 0.0;  ///< degrees of freedom of sd_rad: 3 (mounts - 1)
};

/// A measured positioner, with its uncertainty and the tests of the instruments.
struct Characterization {
  Positioner positioner;  ///< face normals with their covariance, and mounts
  std::vector<ReferenceResult> references;
  std::vector<MountRepeatability> repeatability;
  double normal_u_rad = 0.0;     ///< rms standard uncertainty of the normals' components
  double noise_rad = 0.0;        ///< the part of normal_u_rad from the scatter of the readings
  double transferred_rad = 0.0;  ///< the part of normal_u_rad from the instruments' calibrations
  /// Probability that the instruments differ this much by chance; NaN for one instrument.
  double p_value = 0.0;
  /// Slots, separated by commas, of the instrument that disagrees with the others (p < 0.005). The
  /// text is empty if there are only two instruments, because either of them may be wrong.
  std::string suspect;
  bool consistent = true;
  std::vector<std::string> warnings;  ///< one sentence each
};

/// Estimates the scatter between mounts of one instrument in nearly the same orientation.
///
/// @param mounts        rotation_sensor_from_positioner of each mount. At least two mounts are
///                      needed, and their orientations must agree within 0.1 rad.
/// @param fit_variance  mean variance that the noise of the fit causes in a mount's rotation about
///                      one axis [rad^2].
/// @return sd_rad = sqrt(max(0, variance between the mounts - fit_variance)).
/// @throws DomainError  for fewer than two mounts, or if they differ by more than 0.1 rad.
[[nodiscard]] AXISCAL_EXPORT MountRepeatability
estimate_repeatability(const std::vector<Eigen::Matrix3d>& mounts, double fit_variance);

/// Measures a cube with calibrated instruments: six face normals with their covariance, and mounts.
///
/// Each reference k has readings at the design points. The model of a reading is
///
///     v = b + (1 + scale) S M_k R_i(n)^T f_table
///
/// b is the bias, S the sensitivity and f_table the field in the table's frame. R_i(n) is the
/// rotation of the cube in its seat, which depends on the normals n. The unknowns are the normals
/// n, the mounts M_k, a slope of the table for each run and, by default, bias and scale of each
/// axis. The starting values are a generalised Procrustes fit of each face's mean reading. A
/// Gauss-Newton fit then uses all readings, weighted by each reference's scatter. In the frame of
/// the result, the normals fit the nominal cube best: the sum of e_r cross n_r over the faces r is
/// 0, where e_r is the nominal and n_r the measured normal.
///
/// The records' covariances are propagated to the normals. The uncertainty from K independent
/// calibrations decreases as 1 / sqrt(K). Errors that the calibrations share (one reference cube,
/// the error of one method) do not decrease and are not in the covariance. If an instrument has a
/// second mount whose orientation differs by more than 0.5 rad, the fit also determines the angles
/// between the instrument's axes.
///
/// @param references  one reference or more. For each slope of the table, a reference needs
///                    readings at two design points with the same rest face and opposite fence
///                    faces. Together, the references need all six rest faces.
/// @throws RefusedError  if no reference is left, a field is not along the table's normal, an
///                       instrument has fewer than three axes, a face was never the rest face, or
///                       the readings do not determine the cube.
/// @throws DomainError   if a slot lacks a name or two slots share one, or if readings and record
///         differ in their number of axes.
/// @throws SetupError    if leave_out names a slot that does not exist.
/// @par Source
/// method.md, section 9, which extends US 7,467,536.
[[nodiscard]] AXISCAL_EXPORT Characterization characterize(const std::vector<Reference>& references,
                                                           const CharacterizeOptions& options = {});

}  // namespace axiscal
