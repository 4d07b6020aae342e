// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/seats.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include <Eigen/Geometry>

#include "axiscal/core/error.hpp"
#include "axiscal/core/median.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/positioner/positioner.hpp"
#include "calib/regression/factor.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

std::string rest_name(std::size_t rest) {
  return formatted("rest {}", rest + 1);
}

std::string seen_name(const std::optional<Face>& face) {
  return face ? "rest " + std::string(face_name(*face))
              : "no face, because the cube lies on an edge";
}

// @return the two fence faces that the standard design has for a rest face. These are the faces +
//         and - of the next axis.
std::array<Face, 2> standard_fences(Face rest) {
  const int next = (axis_of(rest) + 1) % 3;
  return {face_of(next, true), face_of(next, false)};
}

std::vector<DesignPoint> points_of(const std::optional<Face>& rest) {
  std::vector<DesignPoint> points;
  for (const Face r : all_faces) {
    for (const Face f : all_faces) {
      if (axis_of(r) != axis_of(f) && (!rest || *rest == r)) {
        points.emplace_back(r, f);
      }
    }
  }
  return points;
}

Eigen::Matrix3d rotation_positioner_from_table(const DesignPoint& point) {
  return Positioner().rotation_table_from_positioner(point).transpose();
}

// @param face   face on the table at a rest; nullopt if not known.
// @param first  label of the same rest; nullopt if not known.
// @return `first` if known; otherwise a label with the rest face `face`; nullopt if neither is
//         known.
std::optional<DesignPoint> start_of(const std::optional<Face>& face,
                                    const std::optional<DesignPoint>& first) {
  if (first) {
    return first;
  }
  if (!face) {
    return std::nullopt;
  }
  return DesignPoint(*face, standard_fences(*face).front());
}

}  // namespace

Eigen::MatrixX3d approximate_up_directions(const Eigen::MatrixX3d& means) {
  const Eigen::RowVector3d high = means.colwise().maxCoeff();
  const Eigen::RowVector3d low = means.colwise().minCoeff();
  return (means.rowwise() - 0.5 * (high + low)).array().rowwise() / (0.5 * (high - low)).array();
}

void assume_level_table(double magnitude,
                        const std::vector<std::optional<Face>>& faces,
                        Observations& observations) {
  observations.has_fence = false;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (faces[i]) {
      const bool is_plus = static_cast<int>(*faces[i]) % 2 == 0;
      observations.readings[i].field_in_sensor =
          (is_plus ? -magnitude : magnitude) * Eigen::Vector3d::Unit(axis_of(*faces[i]));
    }
  }
}

std::vector<std::optional<Face>> resting_faces(const Eigen::MatrixX3d& means) {
  if (means.rows() < 2) {
    throw RefusedError(
        "the resting faces cannot be found from one rest: rests on opposite faces are needed");
  }
  const Eigen::Vector3d range = means.colwise().maxCoeff() - means.colwise().minCoeff();
  for (int axis = 0; axis < 3; ++axis) {
    if (!(range(axis) > 0.5 * range.maxCoeff())) {
      throw RefusedError(
          formatted("the rests do not show which face was down: axis {} has no rests in both "
                    "directions, up and down; lay the cube on all six faces",
                    "xyz"[axis]));
    }
  }
  // With rests on all six faces, all vectors have a length of about 1. If an axis did not point
  // both up and down, the midpoint of its extremes is not its bias, and the vectors are longer.
  const Eigen::MatrixX3d ups = approximate_up_directions(means);
  const Eigen::VectorXd lengths = ups.rowwise().norm();
  if (upper_median({lengths.begin(), lengths.end()}) > 1.3) {
    throw RefusedError(
        "the rests do not show which face was down, because opposite faces are missing; lay the "
        "cube on all six faces");
  }
  std::vector<std::optional<Face>> faces;
  for (Eigen::Index i = 0; i < ups.rows(); ++i) {
    const Eigen::Vector3d up = ups.row(i);
    Eigen::Index axis = 0;
    const double largest = up.cwiseAbs().maxCoeff(&axis);
    faces.push_back(largest < 0.85 * up.norm()
                        ? std::nullopt
                        : std::optional(face_of(static_cast<int>(axis), up(axis) < 0.0)));
  }
  return faces;
}

SeatLabels label_by_sheet(const std::vector<std::optional<Face>>& faces,
                          const std::vector<RunSheetRow>& sheet) {
  const std::size_t n = faces.size();
  const std::size_t m = sheet.size();
  // cost[i][j] is the smallest cost of aligning the first i rests with the first j rows. Each rest
  // or row that is left out costs 1. Each rest whose face differs from that of its row costs 1.5.
  const auto misfit = [&](std::size_t i, std::size_t j) {
    return faces[i] == sheet[j].entry.point.rest() ? 0.0 : 1.5;
  };
  std::vector<std::vector<double>> cost(n + 1, std::vector<double>(m + 1, 0.0));
  for (std::size_t i = 0; i <= n; ++i) {
    for (std::size_t j = 0; j <= m; ++j) {
      if (i == 0 || j == 0) {
        cost[i][j] = static_cast<double>(i + j);
        continue;
      }
      cost[i][j] = std::min(
          {cost[i - 1][j - 1] + misfit(i - 1, j - 1), cost[i - 1][j] + 1.0, cost[i][j - 1] + 1.0});
    }
  }
  SeatLabels labels{.points = std::vector<std::optional<DesignPoint>>(n),
                    .rows = std::vector<std::optional<std::size_t>>(n)};
  std::vector<std::string> messages;  // in order from the last rest to the first
  std::size_t i = n;
  std::size_t j = m;
  while (i > 0 || j > 0) {
    if (i > 0 && j > 0 && cost[i][j] == cost[i - 1][j - 1] + misfit(i - 1, j - 1)) {
      --i;
      --j;
      labels.points[i] = sheet[j].entry.point;
      labels.rows[i] = j;
      if (misfit(i, j) > 0.0) {
        messages.push_back(formatted(
            "run {} ({}): the sheet states {}, the accelerometer shows {}; was the cube laid down "
            "as planned?",
            sheet[j].run, rest_name(i), sheet[j].entry.point.name(), seen_name(faces[i])));
      }
    } else if (i > 0 && cost[i][j] == cost[i - 1][j] + 1.0) {
      --i;
      messages.push_back(formatted("{} ({}) agrees with no row of the sheet and is left out",
                                   rest_name(i), seen_name(faces[i])));
    } else {
      --j;
      messages.push_back(formatted(
          "run {} of the sheet ({}) is not in the log: was this run skipped, or was its rest too "
          "short?",
          sheet[j].run, sheet[j].entry.point.name()));
    }
  }
  labels.messages.assign(messages.rbegin(), messages.rend());
  return labels;
}

std::optional<double> misfit_of_order(const Eigen::MatrixXd& means,
                                      const std::vector<RunSheetRow>& sheet) {
  Eigen::MatrixXd J(means.rows(), 10);
  for (Eigen::Index i = 0; i < means.rows(); ++i) {
    const DesignEntry& entry = sheet[static_cast<std::size_t>(i)].entry;
    const Eigen::Matrix3d R = entry.level.of_all() * rotation_positioner_from_table(entry.point);
    J.row(i) << 1.0, R.reshaped().transpose();
  }
  const auto [inverse, rank] = pseudo_inverse_with_rank(J);
  const Eigen::Index left = means.rows() - rank;
  const double range = (means.colwise().maxCoeff() - means.colwise().minCoeff()).maxCoeff();
  if (left < 1 || !(range > 0.0)) {
    return std::nullopt;
  }
  const Eigen::MatrixXd residuals = means - J * (inverse * means);
  return std::sqrt(residuals.squaredNorm() / static_cast<double>(left * means.cols())) / range;
}

namespace {

SeatLabels label_in_order(const std::vector<RunSheetRow>& sheet) {
  SeatLabels labels;
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    labels.points.emplace_back(sheet[i].entry.point);
    labels.rows.emplace_back(i);
  }
  return labels;
}

// @return labels from the rest faces, if the columns can be those of an accelerometer and at least
//         three quarters of the faces agree with the sheet; otherwise nullopt.
std::optional<SeatLabels> labels_by_most_faces(const Eigen::MatrixXd& means,
                                               const std::vector<RunSheetRow>& sheet) {
  if (means.cols() != 3) {
    return std::nullopt;
  }
  std::vector<std::optional<Face>> faces;
  try {
    faces = resting_faces(means);
  } catch (const RefusedError&) {
    return std::nullopt;  // the columns are not those of an accelerometer
  }
  SeatLabels labels = label_by_sheet(faces, sheet);
  std::size_t agree = 0;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    agree += labels.points[i] && faces[i] == labels.points[i]->rest() ? 1U : 0U;
  }
  return 4 * agree >= 3 * std::min(faces.size(), sheet.size()) ? std::optional(std::move(labels))
                                                               : std::nullopt;
}

}  // namespace

SeatLabels label_by_plan(const Eigen::MatrixXd& means,
                         const std::vector<RunSheetRow>& sheet,
                         bool is_accelerometer) {
  if (is_accelerometer) {
    return label_by_sheet(resting_faces(means), sheet);
  }
  constexpr double largest_misfit = 0.02;
  const bool as_many = static_cast<std::size_t>(means.rows()) == sheet.size();
  // If the order cannot be tested, `misfit` is NaN, and the faces determine the labels.
  const double misfit =
      as_many ? misfit_of_order(means, sheet).value_or(not_a_number) : not_a_number;
  std::optional<SeatLabels> by_faces = labels_by_most_faces(means, sheet);
  if (misfit < largest_misfit && !(by_faces && !by_faces->messages.empty())) {
    return label_in_order(sheet);
  }
  if (by_faces) {
    return *std::move(by_faces);
  }
  if (as_many) {
    SeatLabels labels = label_in_order(sheet);
    if (misfit >= largest_misfit) {
      labels.messages.push_back(formatted(
          "the rests do not agree with the order of the sheet: even for the best constant field, "
          "the readings deviate by {} % of their range from the expected readings; was the order "
          "or the level of the field different in some rests?",
          number_text(100.0 * misfit, 2)));
    }
    return labels;
  }
  throw RefusedError(formatted(
      "the log has {} rests, but the sheet has {} rows, and the columns do not show which row was "
      "skipped; name the columns of an accelerometer in this log, or remove the skipped row from "
      "the sheet",
      means.rows(), sheet.size()));
}

SeatLabels label_by_turns(const std::vector<std::optional<Face>>& faces,
                          const std::vector<Eigen::Matrix3d>& turns,
                          const std::optional<DesignPoint>& first) {
  constexpr double farthest_rad = 30.0 * rad_per_deg;
  SeatLabels labels{.points = std::vector<std::optional<DesignPoint>>(faces.size())};
  std::optional<DesignPoint> last;
  // Rotation from the sensor's frame at the current rest to its frame at the last labelled rest.
  Eigen::Matrix3d since = Eigen::Matrix3d::Identity();
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (i > 0) {
      since = since * turns[i - 1];
    }
    if (!last) {
      last = start_of(faces[i], first);
      labels.points[i] = last;
      since.setIdentity();
      continue;
    }
    double least = std::numeric_limits<double>::infinity();
    std::optional<DesignPoint> best;
    for (const DesignPoint& point : points_of(faces[i])) {
      const Eigen::Matrix3d known =
          rotation_positioner_from_table(*last) * rotation_positioner_from_table(point).transpose();
      const double angle = Eigen::AngleAxisd(Eigen::Matrix3d(known.transpose() * since)).angle();
      if (angle < least) {
        least = angle;
        best = point;
      }
    }
    if (!best || least > farthest_rad) {
      labels.messages.push_back(formatted(
          "the design point of {} ({}) is unknown: according to the gyroscope, the cube is {} "
          "degrees from the nearest possible design point",
          rest_name(i), seen_name(faces[i]), number_text(least * deg_per_rad, 3)));
      continue;
    }
    labels.points[i] = best;
    last = best;
    since.setIdentity();
  }
  return labels;
}

namespace {

std::string unknown_face(std::size_t rest, const std::optional<Face>& face) {
  return formatted("the design point of {} is unknown: the accelerometer shows {}", rest_name(rest),
                   seen_name(face));
}

}  // namespace

SeatLabels label_by_heading(const std::vector<std::optional<Face>>& faces,
                            const Eigen::MatrixX3d& ups,
                            const Eigen::MatrixX3d& fields,
                            const std::optional<DesignPoint>& first) {
  constexpr double farthest_rad = 30.0 * rad_per_deg;
  SeatLabels labels{.points = std::vector<std::optional<DesignPoint>>(faces.size())};
  std::optional<double> azimuth;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::Vector3d up = ups.row(row).transpose().normalized();
    const Eigen::Vector3d field = fields.row(row).transpose();
    const auto azimuth_at = [&](const DesignPoint& point) {
      const Eigen::Vector3d in_table =
          rotation_positioner_from_table(point).transpose() * (field - up.dot(field) * up);
      return std::atan2(in_table.x(), in_table.y());
    };
    if (!azimuth) {
      labels.points[i] = start_of(faces[i], first);
      if (labels.points[i]) {
        azimuth = azimuth_at(*labels.points[i]);
      }
      continue;
    }
    double least = std::numeric_limits<double>::infinity();
    for (const DesignPoint& point : points_of(faces[i])) {
      const double off =
          std::abs(std::remainder(azimuth_at(point) - *azimuth, 2.0 * std::numbers::pi));
      if (off < least) {
        least = off;
        labels.points[i] = point;
      }
    }
    if (!faces[i]) {
      labels.messages.push_back(unknown_face(i, faces[i]));
    } else if (least > farthest_rad) {
      labels.points[i].reset();
      labels.messages.push_back(
          formatted("the design point of {} ({}) is unknown: according to the magnetometer, the "
                    "heading is {} degrees from that of the nearest possible design point",
                    rest_name(i), seen_name(faces[i]), number_text(least * deg_per_rad, 3)));
    }
  }
  return labels;
}

SeatLabels label_by_order(const std::vector<std::optional<Face>>& faces) {
  SeatLabels labels;
  std::map<Face, std::size_t> times;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (!faces[i]) {
      labels.points.emplace_back();
      labels.messages.push_back(unknown_face(i, faces[i]));
      continue;
    }
    labels.points.emplace_back(
        DesignPoint(*faces[i], standard_fences(*faces[i])[times[*faces[i]]++ % 2]));
  }
  return labels;
}

}  // namespace axiscal
