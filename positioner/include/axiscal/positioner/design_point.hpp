// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/core/version.hpp"

namespace axiscal {

/// A face of the cube, named by its outward normal in the positioner's frame.
enum class Face : std::uint8_t { plus_x, minus_x, plus_y, minus_y, plus_z, minus_z };

inline constexpr std::array all_faces = {Face::plus_x,  Face::minus_x, Face::plus_y,
                                         Face::minus_y, Face::plus_z,  Face::minus_z};

/// @return 0, 1, 2 if the face's normal is along x, y, z.
[[nodiscard]] constexpr int axis_of(Face face) {
  return static_cast<int>(face) / 2;
}

/// @return true if the face's normal points in the positive direction of its axis.
[[nodiscard]] constexpr bool is_positive(Face face) {
  return static_cast<int>(face) % 2 == 0;
}

/// @return the face on the opposite side of the cube.
[[nodiscard]] constexpr Face opposite(Face face) {
  return static_cast<Face>(static_cast<int>(face) ^ 1);
}

/// @return the face whose normal is along an axis (0, 1, 2), in its positive or negative direction.
[[nodiscard]] constexpr Face face_of(int axis, bool positive) {
  return static_cast<Face>(2 * axis + (positive ? 0 : 1));
}

/// @return the outward normal of the nominal cube's face; its entries are 0, 1 and -1.
[[nodiscard]] AXISCAL_EXPORT Eigen::Vector3d nominal_normal(Face face);

/// @return "+X", "-X", ...
[[nodiscard]] AXISCAL_EXPORT std::string_view face_name(Face face);

/// @param text  e.g. "+X", "X+", "+x" or "x+".
/// @return the face of that name; nullopt for another text.
[[nodiscard]] AXISCAL_EXPORT std::optional<Face> parse_face(std::string_view text) noexcept;

/// One of the 24 ways to lay the cube down: the face on the table and the face at the fence.
class AXISCAL_EXPORT DesignPoint {
 public:
  /// @throws DomainError  if `rest` and `fence` are the same or opposite faces.
  DesignPoint(Face rest, Face fence);

  [[nodiscard]] Face rest() const { return rest_; }
  [[nodiscard]] Face fence() const { return fence_; }

  /// @return the point with the same rest face and the opposite face at the fence.
  [[nodiscard]] DesignPoint turned_round() const { return {rest_, opposite(fence_)}; }

  /// @return the name, for example "rest +X, fence -Y".
  [[nodiscard]] std::string name() const;

  // NOLINTNEXTLINE(modernize-use-nullptr): clang-tidy 14 mistakes a compared 0 for a null pointer
  auto operator<=>(const DesignPoint&) const = default;

 private:
  Face rest_;
  Face fence_;
};

}  // namespace axiscal
