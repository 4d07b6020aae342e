// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>

#include <Eigen/Core>

#include "axiscal/positioner/design_point.hpp"

namespace axiscal {

/// What is wrong with the measured normal of a face.
///
/// @return "" for a good one; else why it cannot be: not of unit length to 1e-6, or more than
///         0.2 rad from the face's nominal direction (a face mixed up, a left-handed frame).
[[nodiscard]] std::string defect_of_normal(Face face, const Eigen::Vector3d& normal);

/// The cube that holds the instrument: its six face normals and how they make it lie.
///
/// @code
/// const axiscal::Positioner cube;  // the nominal one
/// cube.rotation_table_from_positioner({axiscal::Face::minus_z, axiscal::Face::plus_y});  // 1
/// @endcode
class Positioner {
 public:
  /// The nominal cube.
  Positioner();

  /// A cube whose faces were measured.
  ///
  /// @param normals  outward unit normals in the order of Face, frame positioner.
  /// @param id       the cube's name.
  /// @throws DomainError  if a normal has a defect_of_normal().
  explicit Positioner(const std::array<Eigen::Vector3d, 6>& normals, std::string id = "");

  /// @return outward unit normal of a face, frame positioner.
  [[nodiscard]] const Eigen::Vector3d& normal(Face face) const {
    return normals_[static_cast<std::size_t>(face)];
  }

  /// How the cube lies at a design point.
  ///
  /// With n_r and n_f the normals of rest and fence face: z = -n_r, y = n_f - (n_f . z) z
  /// normalised, x = y cross z; the rotation has rows x, y, z. z is exact for measured normals; y
  /// is so only where n_f is square to n_r, else the heading is off by about that angle. For the
  /// nominal cube the entries are exactly 0, 1 and -1.
  /// @par Source
  /// METHOD section 2.
  [[nodiscard]] Eigen::Matrix3d rotation_table_from_positioner(const DesignPoint& point) const;

  [[nodiscard]] bool is_nominal() const { return nominal_; }
  [[nodiscard]] const std::string& id() const { return id_; }

 private:
  std::array<Eigen::Vector3d, 6> normals_;
  std::string id_;
  bool nominal_;
};

}  // namespace axiscal
