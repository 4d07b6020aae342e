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

/// The rotation of a sensor in the model or vehicle whose angles are measured, with its
/// uncertainty.
///
/// An error of the calibration turns the references and the later readings by the same amount, so
/// it partly cancels. The rotation's share of this error, -K dtheta, is stored with its sign.
///
/// @par Source
/// method.md, section 11.
struct AXISCAL_EXPORT BodyRotation {
  Eigen::Matrix3d rotation_model_from_sensor = Eigen::Matrix3d::Identity();
  /// Total covariance of the rotation's error about the model's axes [rad^2].
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  /// Of it what the references and the readings of them make, without the calibration.
  Eigen::Matrix3d covariance_of_references = Eigen::Matrix3d::Zero();
  double degrees_of_freedom = 0.0;  ///< of that; infinite where it is stated, not seen
  /// K, 3 x p: derivative of the rotation with respect to the calibration's parameters [rad per
  /// unit of each].
  Eigen::MatrixXd by_parameters;
  std::vector<std::string> parameter_names;  ///< p
  int readings = 0;                          ///< of the references
  double residual_sd_rad = 0.0;              ///< scatter of a direction about the references
  std::string created;                       ///< ISO 8601, UTC
  std::string record;         ///< file of the calibration that it was made with; may be empty
  std::string record_sha256;  ///< of that file; empty where it is not known
  double tare_rad = 0.0;      ///< by how much a tare turned it; 0 without one
};

/// One reading at a reference: an attitude of the model, or one of its faces on a table.
struct ReferenceReading {
  int row = 0;  ///< its place in its file, for messages
  Eigen::VectorXd readings;
  std::optional<SensorTemperature> temperature;
  std::optional<StatedAttitude> attitude;  ///< of the model; its heading is not looked at
  std::optional<Face> flat;                ///< the face that lies on the table, in some heading
};

struct BodyOptions {
  /// Standard uncertainty of the references' directions [rad]; not stated: as they scatter.
  std::optional<double> reference_u_rad;
  /// For tared(): true if the rotation was found with the same record; otherwise the two are
  /// independent.
  bool same_record = true;
};

/// Reads references from a table: the record's axes (or SLOT.axis), `pitch_deg` and `roll_deg` or
/// `flat`, the name of a face; without either all are at pitch and roll 0, as a tare's.
///
/// @throws DataError  as read_observations(); for a row that is at both or at neither.
[[nodiscard]] AXISCAL_EXPORT std::vector<ReferenceReading> read_references(
    CsvReader& csv, const Calibration& calibration);

/// Finds how a sensor sits in its model, by readings at references: sum |u_i - R f_i|^2 is least.
///
/// A face on a table, in several headings evenly around, says where its normal points, whatever the
/// table's slope; at least two.
///
/// @param calibration  of gravity, three axes or more.
/// @throws RefusedError  if the references leave a turn open (it is named), their number is too
///                       small to see their scatter, or they contradict each other.
/// @throws DomainError   for another calibration, or readings of other than its axes.
/// @par Source
/// Wahba, SIAM Review 7 (1965) 409; method.md, section 11.
[[nodiscard]] AXISCAL_EXPORT BodyRotation
find_body_rotation(const Calibration& calibration,
                   const std::vector<ReferenceReading>& references,
                   const BodyOptions& options = {});

/// Turns the rotation by the smallest angle that makes it agree with readings in one attitude of
/// the model.
///
/// It sets two angles; the turn about the vertical stays, without references as well as a mounting
/// by eye is known, 1 degree. A bias that shifted looks the same there,
/// and is then wrong in other attitudes: two attitudes half a turn of roll apart tell them apart.
///
/// @param tare  one reading or more in one attitude; level where none is stated.
/// @throws RefusedError  if it would turn by more than 0.2 rad: the model was not in that attitude.
[[nodiscard]] AXISCAL_EXPORT BodyRotation tared(const Calibration& calibration,
                                                BodyRotation body,
                                                const std::vector<ReferenceReading>& tare,
                                                const BodyOptions& options = {});

/// The calibration in the model's axes: everything that is derived from it is then the model's, and
/// its uncertainty holds the rotation's, correlated with the calibration's where the rotation was
/// found with the same record.
///
/// @param same_record  whether it is the record that the rotation was found with.
/// @throws DomainError  for other than three axes or more.
[[nodiscard]] AXISCAL_EXPORT Calibration in_model_frame(Calibration calibration,
                                                        const BodyRotation& body,
                                                        bool same_record);

/// @return the file's text (formats.md, Rotation of a body).
[[nodiscard]] AXISCAL_EXPORT std::string body_rotation_json(const BodyRotation& body);

/// @throws DataError  if the text is no such file.
[[nodiscard]] AXISCAL_EXPORT BodyRotation parse_body_rotation(std::string_view text,
                                                              const std::string& path);
[[nodiscard]] AXISCAL_EXPORT BodyRotation read_body_rotation(const std::string& path);

/// The turn between two instruments on the two sides of a mechanical joint in a model, from one
/// reading of each instrument.
struct JointMovement {
  double angle_rad = 0.0;  ///< between the verticals that they say
  double u_rad = 0.0;      ///< its standard uncertainty; NaN where a record states none
  double p_value = 1.0;    ///< probability of such an angle by chance; NaN if not tested
};

/// @param first, second        the fields that they say, in the model's axes.
/// @param first_covariance, .. theirs; none where a record states none.
/// @param degrees_of_freedom   of the scatter that these rest on.
/// @par Source
/// method.md, section 11: F of rank 2, as the turn about the vertical is never seen.
[[nodiscard]] AXISCAL_EXPORT JointMovement
joint_movement(const Eigen::Vector3d& first,
               const std::optional<Eigen::Matrix3d>& first_covariance,
               const Eigen::Vector3d& second,
               const std::optional<Eigen::Matrix3d>& second_covariance,
               double degrees_of_freedom);

/// The difference between a rotation and an earlier one. If both have the same calibration, its
/// error cancels as far as the references were the same; the comparison leaves this error out.
struct BodyChange {
  Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero();  ///< about the model's x, y, z
  Eigen::Vector3d u_rad = Eigen::Vector3d::Zero();
  double p_value = 1.0;  ///< that it is by chance
};

/// @throws RefusedError  if the uncertainty about an axis is zero for both.
[[nodiscard]] AXISCAL_EXPORT BodyChange compare_rotations(const BodyRotation& before,
                                                          const BodyRotation& after);

}  // namespace axiscal
