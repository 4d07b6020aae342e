// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/positioner/design_point.hpp"
#include "axiscal/positioner/feet.hpp"
#include "axiscal/positioner/mount.hpp"
#include "axiscal/positioner/seat.hpp"
#include "axiscal/positioner/surface.hpp"

namespace axiscal {

/// Checks a face's measured normal.
///
/// @return "" if it is valid, else the reason: its length differs from 1 by more than 1e-6, or it
///         is more than 0.2 rad from the face's nominal normal. (Then faces were probably mixed up,
///         or the axes are left-handed.)
[[nodiscard]] AXISCAL_EXPORT std::string defect_of_normal(Face face, const Eigen::Vector3d& normal);

/// Outward unit normals in the order of Face, frame positioner.
using FaceNormals = std::array<Eigen::Vector3d, all_faces.size()>;

/// @throws DomainError  unless the matrix is symmetric without negative eigenvalues.
AXISCAL_EXPORT void check_normal_covariance(const Eigen::Matrix<double, 18, 18>& covariance);

/// Covariance of the 18 components of the six normals [rad^2]: x, y, z of each face, in the order
/// of Face.
using NormalCovariance = Eigen::Matrix<double, 18, 18>;

/// The measured data of a face: feet, normal, or both.
///
/// If both are known, the normal defines the face's direction. The three feet are turned together
/// until their contact plane has that normal, and define only the contact points.
struct FaceDescription {
  std::optional<Eigen::Vector3d> normal;  ///< outward, unit length
  std::optional<Feet> feet;
};

/// A calibrated instrument whose readings were used to measure a positioner.
struct MeasuredFrom {
  std::string slot;          ///< slot in which the instrument was mounted
  std::string record;        ///< file with the instrument's calibration record
  std::string observations;  ///< file with the instrument's readings in this positioner
};

/// The content of a positioner file (formats.md, Positioner).
struct PositionerDescription {
  std::string id;
  std::array<FaceDescription, all_faces.size()> faces;
  std::optional<NormalCovariance> normal_covariance;
  std::vector<Mount> mounts;
  Surface surface;
  std::string created;   ///< time of the measurement, ISO 8601; may be empty
  std::string software;  ///< program that computed the measurement; may be empty
  std::vector<MeasuredFrom> from;
  std::vector<std::string> notes;  ///< remarks on the measurement
};

/// The cube that contains the instrument: its faces or feet, and its orientation at each design
/// point.
///
/// @code
/// const axiscal::Positioner cube;  // the nominal cube
/// // The next call returns the identity.
/// cube.rotation_table_from_positioner({axiscal::Face::minus_z, axiscal::Face::plus_y});
/// @endcode
class AXISCAL_EXPORT Positioner {
 public:
  /// The nominal cube.
  Positioner();

  /// A cube whose faces were measured.
  ///
  /// @param normals  outward unit normals in the order of Face, frame positioner.
  /// @param id       the cube's name.
  /// @throws DomainError  if a normal has a defect_of_normal().
  explicit Positioner(const FaceNormals& normals, std::string id = "");

  /// A cube on feet. `surface` states the lean of the fence.
  ///
  /// @throws DomainError  if the feet of a face have a defect_of_feet(), or balls of different
  ///                      faces overlap.
  explicit Positioner(const CubeFeet& feet, const Surface& surface = {}, std::string id = "");

  /// @throws DomainError  if a face has neither normal nor feet, a normal or a foot has a defect,
  ///                      the fence leans too much, or the covariance or the mounts are not valid.
  explicit Positioner(PositionerDescription description);

  /// @return outward unit normal of a face, frame positioner.
  [[nodiscard]] const Eigen::Vector3d& normal(Face face) const {
    return normals_[static_cast<std::size_t>(face)];
  }
  [[nodiscard]] const FaceNormals& normals() const { return normals_; }

  /// @return the feet of a face, or nullopt if only its normal is known.
  [[nodiscard]] const std::optional<Feet>& feet(Face face) const {
    return description_.faces[static_cast<std::size_t>(face)].feet;
  }

  /// @return the feet of all faces, from which a similar cube can be made. A face with unknown feet
  ///         gets the feet of the default BallFrame.
  [[nodiscard]] CubeFeet drawing() const;

  /// The orientation of the cube at a design point.
  ///
  /// The rows of the rotation are the table's axes x, y and z in the positioner's frame. They
  /// follow from the normals n_r of the rest face and n_f of the fence face: z = -n_r,
  /// y = n_f - (n_f . z) z normalised, x = y cross z. The direction of z is exact. If the feet of
  /// the fence face are known, seat_at_fence() makes the turn about z exact too. Otherwise, if the
  /// angle between n_f and n_r differs from 90 degrees, the heading has an error of about this
  /// difference. The rotations of the nominal cube have only the entries 0, 1 and -1.
  /// @par Source
  /// method.md, sections 2 and 9.
  [[nodiscard]] const Seat& seat(const DesignPoint& point) const;

  /// @return the rotation of seat(). Its rows are the table's axes x, y and z.
  /// @throws RefusedError  if the seat has a defect.
  [[nodiscard]] const Eigen::Matrix3d& rotation_table_from_positioner(
      const DesignPoint& point) const;

  /// @return the mount of the slot with this name; nullopt if there is no such slot.
  [[nodiscard]] std::optional<Mount> mount(const std::string& slot) const;

  /// @return a copy of this cube with other mounts.
  [[nodiscard]] Positioner with_mounts(std::vector<Mount> mounts) const;

  /// @param u_rad  standard uncertainty of the tilt of each face about any axis that lies in the
  ///               face [rad]. Its variance is added to the stated normal_covariance.
  /// @return a copy of this cube with a larger normal_covariance.
  /// @throws DomainError  if `u_rad` is negative.
  [[nodiscard]] Positioner with_normal_u(double u_rad) const;

  [[nodiscard]] bool is_nominal() const { return nominal_; }
  [[nodiscard]] const std::string& id() const { return description_.id; }
  [[nodiscard]] const PositionerDescription& description() const { return description_; }
  [[nodiscard]] const std::vector<Mount>& mounts() const { return description_.mounts; }
  [[nodiscard]] const Surface& surface() const { return description_.surface; }

 private:
  [[nodiscard]] std::shared_ptr<const std::vector<Seat>> find_seats() const;
  [[nodiscard]] Seat find_seat(const DesignPoint& point) const;

  PositionerDescription description_;
  FaceNormals normals_;
  std::shared_ptr<const std::vector<Seat>> seats_;  // at the index 6 * rest face + fence face
  bool nominal_;
};

/// @return one sentence for each of the points at which the cube rocks.
[[nodiscard]] AXISCAL_EXPORT std::vector<std::string> rocking_remarks(
    const Positioner& positioner, const std::set<DesignPoint>& points);

}  // namespace axiscal
