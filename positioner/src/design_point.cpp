// SPDX-License-Identifier: Apache-2.0
#include "axiscal/positioner/design_point.hpp"

#include "axiscal/core/error.hpp"
#include "core/formatted.hpp"

namespace axiscal {

Eigen::Vector3d nominal_normal(Face face) {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  normal(axis_of(face)) = is_positive(face) ? 1.0 : -1.0;
  return normal;
}

std::string_view face_name(Face face) {
  static constexpr std::array<std::string_view, 6> names = {"+X", "-X", "+Y", "-Y", "+Z", "-Z"};
  return names[static_cast<std::size_t>(face)];
}

std::optional<Face> parse_face(std::string_view text) noexcept {
  if (text.size() != 2) {
    return std::nullopt;
  }
  const bool sign_first = text[0] == '+' || text[0] == '-';
  const char sign = sign_first ? text[0] : text[1];
  const std::size_t axis = std::string_view("xyzXYZ").find(sign_first ? text[1] : text[0]);
  if ((sign != '+' && sign != '-') || axis == std::string_view::npos) {
    return std::nullopt;
  }
  return face_of(static_cast<int>(axis % 3), sign == '+');
}

DesignPoint::DesignPoint(Face rest, Face fence) : rest_(rest), fence_(fence) {
  if (axis_of(rest) == axis_of(fence)) {
    throw DomainError(
        formatted("DesignPoint: rest {} and fence {} lie on one axis; they must be neighbours",
                  face_name(rest), face_name(fence)));
  }
}

std::string DesignPoint::name() const {
  return formatted("rest {}, fence {}", face_name(rest_), face_name(fence_));
}

}  // namespace axiscal
