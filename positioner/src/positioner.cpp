// SPDX-License-Identifier: Apache-2.0
#include "axiscal/positioner/positioner.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "axiscal/core/error.hpp"
#include "axiscal/positioner/design.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Tolerance: a ball that extends beyond a plane by less than this counts as touching the plane.
constexpr double touching_m = 1e-9;

PositionerDescription description_of(const FaceNormals& normals, std::string id) {
  PositionerDescription description{.id = std::move(id)};
  for (const Face face : all_faces) {
    const auto at = static_cast<std::size_t>(face);
    description.faces[at].normal = normals[at];
  }
  return description;
}

PositionerDescription description_of(const CubeFeet& feet, Surface surface, std::string id) {
  PositionerDescription description{.id = std::move(id), .surface = std::move(surface)};
  for (std::size_t face = 0; face < feet.size(); ++face) {
    description.faces[face].feet = feet[face];
  }
  return description;
}

FaceNormals nominal_normals() {
  FaceNormals normals;
  std::transform(all_faces.begin(), all_faces.end(), normals.begin(), nominal_normal);
  return normals;
}

std::string of_face(Face face) {
  return formatted("of face {}", face_name(face));
}

// Computes the cube's rotation from the normals of two faces (method.md, section 2).
Eigen::Matrix3d rotation_by_normals(const Eigen::Vector3d& rest, const Eigen::Vector3d& fence) {
  const Eigen::Vector3d z = -rest;
  const Eigen::Vector3d y = (fence - fence.dot(z) * z).normalized();
  Eigen::Matrix3d R;
  R.row(0) = y.cross(z);
  R.row(1) = y;
  R.row(2) = z;
  return R.array() + 0.0;  // + 0.0 replaces -0 by 0
}

// Returns true if the cube's centre is above the triangle of the rest face's contact points.
bool stands(const Feet& feet, const Eigen::Vector3d& normal) {
  int positive = 0;
  int negative = 0;
  for (std::size_t i = 0; i < feet.size(); ++i) {
    const Eigen::Vector3d& from = feet[i].centre_m;
    const Eigen::Vector3d& to = feet[(i + 1) % feet.size()].centre_m;
    // Each ball touches the table directly below its centre, so the centres can replace the contact
    // points.
    const double side = normal.dot(from.cross(to));
    positive += side > 0.0 ? 1 : 0;
    negative += side < 0.0 ? 1 : 0;
  }
  return positive == 0 || negative == 0;
}

// Throws if balls of two faces overlap.
void check_neighbours(const std::array<FaceDescription, all_faces.size()>& faces) {
  for (const Face one : all_faces) {
    for (const Face other : all_faces) {
      const std::optional<Feet>& a = faces[static_cast<std::size_t>(one)].feet;
      const std::optional<Feet>& b = faces[static_cast<std::size_t>(other)].feet;
      if (one >= other || !a || !b) {
        continue;
      }
      for (const Ball& p : *a) {
        for (const Ball& q : *b) {
          if ((p.centre_m - q.centre_m).norm() < p.radius_m + q.radius_m) {
            throw DomainError(
                formatted("the feet {} and those {} overlap", of_face(one), of_face(other)));
          }
        }
      }
    }
  }
}

}  // namespace

void check_normal_covariance(const NormalCovariance& C) {
  const double size = C.cwiseAbs().maxCoeff();
  const double rounding = 1e-9 * size;
  // The Cholesky factorisation succeeds if every eigenvalue of C is above -rounding.
  Eigen::MatrixXd raised = C;
  raised.diagonal().array() += rounding;
  if (!C.allFinite() || !((C - C.transpose()).cwiseAbs().maxCoeff() <= rounding) ||
      (size > 0.0 && Eigen::LLT<Eigen::MatrixXd>(raised).info() != Eigen::Success)) {
    throw DomainError("normal_covariance must be symmetric without negative eigenvalues");
  }
}

std::string defect_of_normal(Face face, const Eigen::Vector3d& normal) {
  constexpr double largest_tilt_rad = 0.2;
  if (!(std::abs(normal.norm() - 1.0) <= 1e-6)) {
    return "must have unit length to 1e-6";
  }
  if (!(normal.dot(nominal_normal(face)) >= std::cos(largest_tilt_rad))) {
    return formatted(
        "is more than 0.2 rad from the nominal direction {}: are faces mixed up, or the axes "
        "left-handed?",
        face_name(face));
  }
  return "";
}

Positioner::Positioner()
    : description_(description_of(nominal_normals(), "")),
      normals_(nominal_normals()),
      nominal_(true) {
  // The seats are computed only once, because they are the same for all nominal cubes.
  static const std::shared_ptr<const std::vector<Seat>> seats = find_seats();
  seats_ = seats;
}

Positioner::Positioner(const FaceNormals& normals, std::string id)
    : Positioner(description_of(normals, std::move(id))) {}

Positioner::Positioner(const CubeFeet& feet, const Surface& surface, std::string id)
    : Positioner(description_of(feet, surface, std::move(id))) {}

Positioner::Positioner(PositionerDescription description)
    : description_(std::move(description)), nominal_(false) {
  for (const Face face : all_faces) {
    FaceDescription& known = description_.faces[static_cast<std::size_t>(face)];
    Eigen::Vector3d& normal = normals_[static_cast<std::size_t>(face)];
    if (!known.normal && !known.feet) {
      throw DomainError(formatted("face {} needs a normal or feet", face_name(face)));
    }
    if (known.feet) {
      if (const std::string defect = defect_of_feet(face, *known.feet); !defect.empty()) {
        throw DomainError(formatted("the feet {} {}", of_face(face), defect));
      }
      normal = contact_plane(face, *known.feet).normal;
    }
    if (known.normal) {
      if (const std::string defect = defect_of_normal(face, *known.normal); !defect.empty()) {
        throw DomainError(formatted("the normal {} {}", of_face(face), defect));
      }
      normal = known.normal->normalized();
      if (known.feet) {
        known.feet = feet_turned_to(face, *known.feet, normal);
      }
    }
  }
  check_neighbours(description_.faces);
  if (description_.normal_covariance) {
    check_normal_covariance(*description_.normal_covariance);
  }
  description_.mounts = checked_mounts(std::move(description_.mounts));
  if (!(std::abs(description_.surface.fence_lean_rad) <= 0.5)) {
    throw DomainError("the fence must lean by at most 0.5 rad");
  }
  seats_ = find_seats();
}

std::shared_ptr<const std::vector<Seat>> Positioner::find_seats() const {
  auto seats = std::make_shared<std::vector<Seat>>(all_faces.size() * all_faces.size());
  for (const DesignEntry& entry : standard_design(24)) {
    const auto at = static_cast<std::size_t>(entry.point.rest()) * all_faces.size() +
                    static_cast<std::size_t>(entry.point.fence());
    (*seats)[at] = find_seat(entry.point);
  }
  return seats;
}

Seat Positioner::find_seat(const DesignPoint& point) const {
  const Eigen::Vector3d& rest = normal(point.rest());
  Seat seat{.rotation_table_from_positioner = rotation_by_normals(rest, normal(point.fence()))};
  const std::optional<Feet>& rest_feet = feet(point.rest());
  const std::optional<Feet>& fence_feet = feet(point.fence());
  if (rest_feet && !stands(*rest_feet, rest)) {
    seat.defect = "the cube would tip: its centre is not above the triangle of its feet";
    return seat;
  }
  if (fence_feet) {
    seat =
        seat_at_fence(seat.rotation_table_from_positioner, *fence_feet, surface().fence_lean_rad);
    if (!seat.defect.empty()) {
      return seat;
    }
  }
  const double lean = surface().fence_lean_rad;
  const Eigen::Vector3d to_fence = seat.rotation_table_from_positioner.transpose() *
                                   Eigen::Vector3d(0.0, std::cos(lean), std::sin(lean));
  const auto passes = [](const Ball& ball, const Eigen::Vector3d& direction, const Ball& plane) {
    return direction.dot(ball.centre_m - plane.centre_m) + ball.radius_m - plane.radius_m >
           touching_m;
  };
  for (const Face face : all_faces) {
    if (!feet(face)) {
      continue;
    }
    for (const Ball& ball : *feet(face)) {
      if (rest_feet && face != point.rest() && passes(ball, rest, rest_feet->front())) {
        seat.defect = formatted("a foot {} reaches below the table", of_face(face));
      } else if (fence_feet && face != point.fence() &&
                 passes(ball, to_fence,
                        (*fence_feet)[static_cast<std::size_t>(seat.contacts.front())])) {
        seat.defect = formatted("a foot {} reaches through the fence", of_face(face));
      }
    }
  }
  return seat;
}

const Seat& Positioner::seat(const DesignPoint& point) const {
  return (*seats_)[static_cast<std::size_t>(point.rest()) * all_faces.size() +
                   static_cast<std::size_t>(point.fence())];
}

const Eigen::Matrix3d& Positioner::rotation_table_from_positioner(const DesignPoint& point) const {
  const Seat& found = seat(point);
  if (!found.defect.empty()) {
    throw RefusedError(formatted("{}: the cube{} cannot lie in this way: {}", point.name(),
                                 id().empty() ? "" : " " + id(), found.defect));
  }
  return found.rotation_table_from_positioner;
}

std::optional<Mount> Positioner::mount(const std::string& slot) const {
  const auto found = std::find_if(mounts().begin(), mounts().end(),
                                  [&](const Mount& mount) { return mount.slot == slot; });
  return found == mounts().end() ? std::nullopt : std::optional(*found);
}

CubeFeet Positioner::drawing() const {
  CubeFeet drawing = feet_of_frame({});
  for (const Face face : all_faces) {
    if (feet(face)) {
      drawing[static_cast<std::size_t>(face)] = *feet(face);
    }
  }
  return drawing;
}

Positioner Positioner::with_mounts(std::vector<Mount> mounts) const {
  Positioner changed = *this;
  changed.description_.mounts = checked_mounts(std::move(mounts));
  return changed;
}

Positioner Positioner::with_normal_u(double u_rad) const {
  if (!(u_rad >= 0.0)) {
    throw DomainError("Positioner::with_normal_u: the uncertainty must not be negative");
  }
  Positioner changed = *this;
  NormalCovariance C = description_.normal_covariance.value_or(NormalCovariance::Zero());
  for (const Face face : all_faces) {
    const Eigen::Vector3d& n = normal(face);
    const Eigen::Index at = 3 * static_cast<Eigen::Index>(face);
    C.block<3, 3>(at, at) += u_rad * u_rad * (Eigen::Matrix3d::Identity() - n * n.transpose());
  }
  changed.description_.normal_covariance = C;
  return changed;
}

std::vector<std::string> rocking_remarks(const Positioner& positioner,
                                         const std::set<DesignPoint>& points) {
  std::vector<std::string> remarks;
  for (const DesignPoint& point : points) {
    if (positioner.seat(point).rocks) {
      remarks.push_back(
          point.name() +
          ": the cube rocks at the fence, because the middle foot of the fence face protrudes; the "
          "calculation uses the position nearer to the fence, so always push the cube into this "
          "position");
    }
  }
  return remarks;
}

}  // namespace axiscal
