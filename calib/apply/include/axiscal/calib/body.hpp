// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The rotation between a sensor and the model or vehicle in which it is mounted, with its
/// uncertainty.
///
/// An error dtheta of the calibration's parameters changes the field computed from the reference
/// readings and the field computed from later readings in similar ways, so its effect on the angles
/// partly cancels. To compute this, the matrix K is stored: the error dtheta changes the rotation
/// by the small rotation -K dtheta.
///
/// @par Source
/// method.md, section 11.
struct AXISCAL_EXPORT BodyRotation {
  Eigen::Matrix3d rotation_model_from_sensor = Eigen::Matrix3d::Identity();
  /// Total covariance of the rotation's error about the model's axes [rad^2].
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  /// The part of `covariance` that is due to the references and their readings. The rest is due to
  /// the calibration.
  Eigen::Matrix3d covariance_of_references = Eigen::Matrix3d::Zero();
  /// Degrees of freedom of covariance_of_references; infinite if the references have a stated
  /// uncertainty.
  double degrees_of_freedom = 0.0;
  /// K, 3 x p: derivative of the rotation with respect to the calibration's parameters [rad per
  /// unit of the parameter].
  Eigen::MatrixXd by_parameters;
  std::vector<std::string> parameter_names;  ///< names of the p parameters
  int readings = 0;                          ///< number of readings at references
  /// Standard deviation of the difference between a measured and a stated direction, for each of
  /// the two components perpendicular to the stated direction.
  double residual_sd_rad = 0.0;
  std::string created;        ///< time of the computation, ISO 8601, UTC
  std::string record;         ///< file with the calibration that was used; may be empty
  std::string record_sha256;  ///< SHA-256 digest of `record`; empty if it is unknown
  /// Angle of the correction that the last tare made to the rotation [rad]; 0 without a tare.
  double tare_rad = 0.0;
};

/// One reading in a known position: at a stated attitude of the model, or with one of the model's
/// faces on a table.
struct ReferenceReading {
  int row = 0;  ///< row number in the file, from 1, for messages
  Eigen::VectorXd readings;
  std::optional<SensorTemperature> temperature;
  std::optional<StatedAttitude> attitude;  ///< attitude of the model; its heading is not used
  std::optional<Face> flat;                ///< face of the model that lies on the table
};

struct BodyOptions {
  /// Standard uncertainty of the references' directions [rad]. If it is nullopt, it is estimated
  /// from the scatter of the directions.
  std::optional<double> reference_u_rad;
  /// For corrected_by_tare(): true if the rotation was found with the same calibration record. If
  /// false, the errors of the rotation and of the record are taken as independent.
  bool same_record = true;
};

/// Reads references from a table. The table has one column for each axis of the record, named AXIS
/// or SLOT.AXIS. The attitude of a row is stated in the columns `pitch_deg` and `roll_deg`, or in
/// the column `flat` as the name of a face. If the table lacks all three columns, the attitudes are
/// unknown; corrected_by_tare() then takes pitch and roll as 0.
///
/// @throws DataError  for the same reasons as read_observations(). Also if a row states both an
///                    attitude and a face, or if a row states neither although the table has one of
///                    the three columns.
[[nodiscard]] AXISCAL_EXPORT std::vector<ReferenceReading> read_references(
    CsvReader& csv, const Calibration& calibration);

/// Finds the rotation R from a sensor to its model, from readings at references. R minimises the
/// sum of |u_i - R f_i|^2. The unit vectors u_i and f_i are the stated direction of the field in
/// the model, and the measured direction in the sensor.
///
/// If a face lies on a table in two or more evenly spaced headings, the mean of the measured
/// directions is the direction of the face's normal, for any slope of the table.
///
/// @param calibration  a calibration of three axes or more whose field is gravity.
/// @throws RefusedError  if the references do not determine the rotation about an axis (the message
///                       names the axis), if they are too few to determine their scatter, or if
///                       they contradict each other.
/// @throws DomainError   if the calibration is of another kind, or if a reference does not have one
///                       reading for each axis.
/// @par Source
/// Wahba, SIAM Review 7 (1965) 409; method.md, section 11.
[[nodiscard]] AXISCAL_EXPORT BodyRotation
find_body_rotation(const Calibration& calibration,
                   const std::vector<ReferenceReading>& references,
                   const BodyOptions& options = {});

/// Corrects a rotation by the smallest rotation that makes it agree with readings in one attitude
/// of the model (a tare).
///
/// The rotation about the vertical is not corrected. If the rotation was not found from references,
/// the standard uncertainty about the vertical is 1 degree, as after mounting by eye. In the
/// attitude of the tare, a shift of a bias has the same effect as a change of the mounting. If a
/// bias has shifted, the tare makes other attitudes wrong. Readings in two attitudes that differ by
/// half a turn of roll distinguish the two causes.
///
/// @param tare  one reading or more in one attitude. If the attitude is not stated, pitch and roll
///              are taken as 0.
/// @throws RefusedError  if the correction is above 0.2 rad, because the stated attitude is then
///                       probably wrong.
[[nodiscard]] AXISCAL_EXPORT BodyRotation
corrected_by_tare(const Calibration& calibration,
                  BodyRotation body,
                  const std::vector<ReferenceReading>& tare,
                  const BodyOptions& options = {});

/// Converts a calibration to the model's axes, so that it gives the field and the angles of the
/// model. The uncertainty then includes the uncertainty of the rotation, and the correlation
/// between the errors of the calibration and of the rotation.
///
/// @param same_record  true if the rotation was found with this record. If false, the errors of the
///                     rotation and of the record are taken as independent.
/// @throws DomainError  for fewer than three axes.
[[nodiscard]] AXISCAL_EXPORT Calibration in_model_frame(Calibration calibration,
                                                        const BodyRotation& body,
                                                        bool same_record);

/// @return the text of the rotation file (formats.md, Rotation of a body).
[[nodiscard]] AXISCAL_EXPORT std::string body_rotation_json(const BodyRotation& body);

/// Reads a rotation from the text of a rotation file.
/// @param path  the file's name for messages.
/// @throws DataError  if the text is not a valid rotation file.
[[nodiscard]] AXISCAL_EXPORT BodyRotation parse_body_rotation(std::string_view text,
                                                              const std::string& path);
[[nodiscard]] AXISCAL_EXPORT BodyRotation read_body_rotation(const std::string& path);

/// The angle by which a mechanical joint of a model has moved, from one reading of each of two
/// instruments on the two sides of the joint.
struct JointMovement {
  double angle_rad = 0.0;  ///< angle between the verticals that the two instruments measure
  /// Standard uncertainty of angle_rad; NaN if a record states no covariance.
  double u_rad = 0.0;
  /// Probability of an angle at least as large if the joint did not move; NaN if not tested.
  double p_value = 1.0;
};

/// Computes the angle between the verticals that two instruments measure, and tests whether the
/// joint between them has moved.
///
/// @param first, second        the fields measured by both instruments, in the model's axes.
/// @param first_covariance, .. covariances of the fields; nullopt if a record states none.
/// @param degrees_of_freedom   degrees of freedom of the sum of the two covariances.
/// @par Source
/// method.md, section 11. The F test has 2 numerator degrees of freedom, because gravity does not
/// determine the rotation about the vertical.
[[nodiscard]] AXISCAL_EXPORT JointMovement
joint_movement(const Eigen::Vector3d& first,
               const std::optional<Eigen::Matrix3d>& first_covariance,
               const Eigen::Vector3d& second,
               const std::optional<Eigen::Matrix3d>& second_covariance,
               double degrees_of_freedom);

/// The change from one rotation to a later one. If both were found with the same record, the error
/// of the calibration is ignored, because it cancels if the reference attitudes are the same.
struct BodyChange {
  Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero();  ///< rotation vector, in the model's axes
  Eigen::Vector3d u_rad = Eigen::Vector3d::Zero();
  double p_value = 1.0;  ///< probability that a change at least as large occurs by chance
};

/// Computes the change from the rotation `before` to the rotation `after`, and tests whether it can
/// be due to chance.
/// @throws RefusedError  if both rotations have zero uncertainty about the same axis.
[[nodiscard]] AXISCAL_EXPORT BodyChange compare_rotations(const BodyRotation& before,
                                                          const BodyRotation& after);

}  // namespace axiscal
