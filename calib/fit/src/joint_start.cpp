// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/src/joint_start.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <optional>
#include <utility>

#include "axiscal/core/rotation.hpp"
#include "calib/regression/factor.hpp"

namespace axiscal {
namespace {

// Returns those of the given rows whose readings the axis uses.
std::vector<Eigen::Index> used_rows(const ReadingSet& set,
                                    const std::vector<Eigen::Index>& rows,
                                    Eigen::Index axis) {
  std::vector<Eigen::Index> used;
  std::copy_if(rows.begin(), rows.end(), std::back_inserter(used),
               [&](Eigen::Index i) { return set.weights(i, axis) > 0.0; });
  return used;
}

// Returns the direction with a sign that agrees with the stated direction. If no direction is
// stated, the largest component becomes positive.
Eigen::Vector3d with_sign(const Eigen::Vector3d& direction, const FieldDescription& part) {
  const double given = direction.dot(part.start.sign_by);
  Eigen::Index largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  return std::copysign(1.0, given != 0.0 ? given : direction(largest)) * direction;
}

// Computes the field by linear regression, up to its sign. If the table has its own slope in each
// block, the field has a direction for each block. A block whose readings do not determine its
// direction gets the direction from all readings. Returns nullopt if all readings together do not
// determine the directions.
std::optional<TableField> linear_start(const ReadingSet& set) {
  if (set.field.turns()) {
    return {};  // on a rotating table the response is not linear in the directions
  }
  const std::vector<FieldDescription>& parts = set.field.parts();
  std::vector<Eigen::Index> all(static_cast<std::size_t>(set.size()));
  std::iota(all.begin(), all.end(), 0);
  const Eigen::VectorXd common = linear_directions(set, all);
  if (common.size() == 0) {
    return {};
  }
  std::vector<Eigen::Vector3d> vectors;
  if (set.field.is_sum()) {
    // A part with known magnitude determines the magnitudes of the other parts.
    double scale = 0.0;
    for (std::size_t p = 0; p < parts.size() && scale == 0.0; ++p) {
      if (!parts[p].free_length) {
        scale = parts[p].magnitude / common.segment<3>(3 * static_cast<Eigen::Index>(p)).norm();
      }
    }
    for (std::size_t p = 0; p < parts.size(); ++p) {
      const Eigen::Vector3d part = common.segment<3>(3 * static_cast<Eigen::Index>(p));
      vectors.emplace_back(parts[p].free_length ? scale * part
                                                : parts[p].magnitude * part.normalized());
    }
    return set.field.with(std::move(vectors));
  }
  const double F = parts.front().magnitude;
  vectors.assign(set.field.blocks().size(), F * with_sign(common, parts.front()));
  for (std::size_t s = 0; vectors.size() > 1 && s < vectors.size(); ++s) {
    std::vector<Eigen::Index> rows;
    std::copy_if(all.begin(), all.end(), std::back_inserter(rows),
                 [&](Eigen::Index i) { return set.tilt_of(static_cast<std::size_t>(i)) == s; });
    const Eigen::VectorXd own = linear_directions(set, rows);
    if (own.size() > 0) {
      vectors[s] = std::copysign(F, own.dot(vectors[s])) * own;
    }
  }
  return set.field.with(std::move(vectors));
}

// Returns the rows W^1/2 [1, vec R_i, ...] of the readings that an axis uses. W contains the
// weights. R_i is the rotation from the table's frame to the sensor's frame.
Eigen::MatrixXd design_of_directions(const ReadingSet& set,
                                     const std::vector<Eigen::Index>& used,
                                     Eigen::Index k) {
  const auto parts = static_cast<Eigen::Index>(set.field.parts().size());
  const Eigen::Index unknowns = 1 + 9 * parts;
  const Eigen::Index others = 3 * static_cast<Eigen::Index>(set.also_in_table.size());
  const auto n = static_cast<Eigen::Index>(used.size());
  Eigen::MatrixXd Z(n, unknowns + others + set.temperature.order);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(used[static_cast<std::size_t>(i)]);
    const Eigen::Matrix3d R = set.met_of_field(at);
    Z(i, 0) = 1.0;
    for (Eigen::Index p = 0; p < parts; ++p) {
      const auto part = static_cast<std::size_t>(p);
      const bool seen = set.sees(k, static_cast<Eigen::Index>(at), part);
      const double factor = seen ? set.field.factor_of(part, set.readings[at].level) : 0.0;
      Z.row(i).segment<9>(1 + 9 * p) = factor * R.reshaped().transpose();
    }
    Z.row(i).segment(unknowns, others) = set.design_row(R, Eigen::Vector3d::Zero()).tail(others);
    for (int j = 0; j < set.temperature.order; ++j) {
      Z(i, unknowns + others + j) =
          std::pow(set.temperature.d(static_cast<Eigen::Index>(at), k), j + 1);
    }
  }
  return set.weights.col(k)(used).cwiseSqrt().asDiagonal() * Z;
}

}  // namespace

Eigen::VectorXd linear_directions(const ReadingSet& set, const std::vector<Eigen::Index>& rows) {
  const auto parts = static_cast<Eigen::Index>(set.field.parts().size());
  // The matrices M_k of linear_directions(), one below the other, for those axes whose readings
  // determine M_k.
  Eigen::MatrixXd M(3 * set.axis_count(), 3 * parts);
  Eigen::Index axes = 0;
  for (Eigen::Index first = 0; first < set.axis_count();) {
    const Eigen::Index end = set.end_of_alike(first, set.weights);
    const std::vector<Eigen::Index> used = used_rows(set, rows, first);
    const Eigen::MatrixXd design = design_of_directions(set, used, first);
    // Limit of a pivot, relative to the largest one. Smaller pivots are rounding errors.
    constexpr double smallest_pivot = 1e-13;
    std::optional<Factor> qr;
    if (design.rows() >= design.cols()) {
      qr.emplace(design, smallest_pivot);
    }
    if (qr && qr->has_full_rank()) {
      for (Eigen::Index k = first; k < end; ++k, ++axes) {
        const Eigen::VectorXd x =
            qr->solve(set.weights.col(k)(used).cwiseSqrt().cwiseProduct(set.response.col(k)(used)));
        for (Eigen::Index p = 0; p < parts; ++p) {
          M.block<3, 3>(3 * axes, 3 * p) = x.segment<9>(1 + 9 * p).reshaped(3, 3);
        }
      }
    }
    first = end;
  }
  if (axes == 0) {
    return {};
  }
  const Eigen::MatrixXd rows_of_axes = M.topRows(3 * axes);
  return singular_values(rows_of_axes).V.col(0);
}

std::vector<TableField> start_fields(const ReadingSet& set) {
  if (std::optional<TableField> linear = linear_start(set)) {
    return {std::move(*linear)};
  }
  // Make all combinations of the possible directions of the parts.
  const TableField stated = set.field.as_stated();
  std::vector<std::vector<Eigen::Vector3d>> all(1);
  for (std::size_t p = 0; p < set.field.parts().size(); ++p) {
    const FieldDescription& part = set.field.parts()[p];
    const Eigen::Vector3d value = stated.vector(p);
    // The direction of a stated vector is a starting direction. Its length is used only if the
    // magnitude is not known.
    const double length = part.free_length ? value.norm() : part.magnitude;
    const std::vector<Eigen::Vector3d> directions =
        part.in_table && part.start.has_heading ? std::vector<Eigen::Vector3d>{value.normalized()}
                                                : directions_on_sphere(set.field.is_sum() ? 8 : 26);
    std::vector<std::vector<Eigen::Vector3d>> longer;
    for (const std::vector<Eigen::Vector3d>& begun : all) {
      for (const Eigen::Vector3d& direction : directions) {
        longer.push_back(begun);
        longer.back().emplace_back(length * direction);
      }
    }
    all = std::move(longer);
  }
  std::vector<TableField> starts;
  for (std::vector<Eigen::Vector3d>& vectors : all) {
    starts.push_back(set.field.is_sum() ? set.field.with(std::move(vectors))
                                        : set.field.with_all(vectors.front()));
  }
  return starts;
}

}  // namespace axiscal
