// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/response_system.hpp"

namespace axiscal {

FieldChanges field_direction_derivatives(const ReadingSet& set,
                                         const TableField& field,
                                         const std::vector<TableField::Tangents>& tangents,
                                         Eigen::Index axis) {
  Eigen::Index directions = 0;
  for (const TableField::Tangents& own : tangents) {
    directions += own.cols();
  }
  FieldChanges changes(3 * set.size(), directions);
  std::vector<Eigen::Matrix3Xd> steps;
  for (std::size_t s = 0; s < field.size(); ++s) {
    steps.emplace_back(field.step_unit(s) * tangents[s]);
  }
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    auto all = changes.middleRows<3>(3 * i);
    Eigen::Index first = 0;
    for (std::size_t s = 0; s < field.size(); ++s) {
      auto own = all.middleCols(first, tangents[s].cols());
      first += tangents[s].cols();
      if (set.sees(axis, i, s)) {
        const Eigen::Matrix3d met = set.rotation_sensor_from_table[static_cast<std::size_t>(i)] *
                                    set.field_change(i, field, s);
        own.noalias() = met.lazyProduct(steps[s]);
      } else {
        own.setZero();
      }
    }
  }
  return changes;
}

Eigen::MatrixXd response_changes(const ReadingSet& set,
                                 Eigen::Index axis,
                                 const Eigen::RowVector3d& S,
                                 const FieldChanges& changes) {
  Eigen::MatrixXd rows(set.size(), changes.cols());
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const Eigen::RowVector3d by_field = set.scale(i, axis) * S;
    rows.row(i).noalias() = by_field.lazyProduct(changes.middleRows<3>(3 * i));
  }
  return rows;
}

Eigen::MatrixXd stacked_by_axis(const std::vector<Eigen::MatrixXd>& own,
                                const std::vector<Eigen::MatrixXd>& shared) {
  const auto m = static_cast<Eigen::Index>(own.size());
  const Eigen::Index n = own.front().rows();
  const Eigen::Index p = own.front().cols();
  const Eigen::Index q = shared.front().cols();
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(n * m, p * m + q);
  for (Eigen::Index k = 0; k < m; ++k) {
    const auto axis = static_cast<std::size_t>(k);
    all.block(n * k, p * k, n, p) = own[axis];
    all.block(n * k, p * m, n, q) = shared[axis];
  }
  return all;
}

}  // namespace axiscal
