// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "axiscal/core/random.hpp"
#include "axiscal/field/table_field.hpp"
#include "axiscal/positioner/design.hpp"
#include "axiscal/positioner/positioner.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal::test {

/// A field of gravity in the table, in the form that fits use.
inline TableField gravity_in_table(const Eigen::Vector3d& in_table) {
  FieldDescription gravity;
  gravity.kind = "gravity";
  gravity.unit = "g";
  gravity.magnitude = in_table.norm();
  gravity.in_table = in_table;
  return TableField({gravity}).as_stated();
}

/// Gravity in the table's frame [g]. The table slopes by 3 and 2 mrad.
inline const Eigen::Vector3d sloping_gravity(0.003, -0.002, 1.0);

inline LinearResponse some_response() {
  return {.bias = Eigen::Vector3d(0.1, -0.2, 0.3),
          .sensitivity = 2.0 * Eigen::Matrix3d::Identity() + 0.02 * Eigen::Matrix3d::Ones()};
}

/// Simulated readings at the design points, in the form that fits use.
/// @param noise_sd  standard deviation of the white noise of each axis.
inline ReadingSet labelled_set(const LinearResponse& truth,
                               const TableField& field,
                               const std::vector<DesignEntry>& design,
                               double noise_sd,
                               std::uint64_t seed) {
  const auto n = static_cast<Eigen::Index>(design.size());
  const Eigen::Index m = truth.bias.size();
  RandomStream random(seed);
  ReadingSet set;
  set.response.resize(n, m);
  set.weights = Eigen::MatrixXd::Ones(n, m);
  set.field = field;
  for (Eigen::Index k = 0; k < m; ++k) {
    set.axes.emplace_back(1, "xyz"[k]);
    set.nominal.emplace_back(static_cast<int>(k));
  }
  set.orientation = [](const DesignPoint& point) {
    return Eigen::Matrix3d(Positioner().rotation_table_from_positioner(point).transpose());
  };
  for (Eigen::Index i = 0; i < n; ++i) {
    const DesignPoint& point = design[static_cast<std::size_t>(i)].point;
    set.readings.push_back(Reading{.run = static_cast<int>(i) + 1, .point = point});
    set.rotation_sensor_from_table.push_back(set.orientation(point));
    Eigen::VectorXd v = truth.at(set.rotation_sensor_from_table.back() * field.vector(0));
    for (double& value : v) {
      value += noise_sd * random.normal();
    }
    set.response.row(i) = v;
  }
  return set;
}

/// Design matrix n x 4 with the rows [1, f], computed without the fit's code.
inline Eigen::MatrixXd rows_of(const ReadingSet& set, const Eigen::Vector3d& in_table) {
  Eigen::MatrixXd X(set.size(), 4);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    X(i, 0) = 1.0;
    X.row(i).tail<3>() =
        (set.rotation_sensor_from_table[static_cast<std::size_t>(i)] * in_table).transpose();
  }
  return X;
}

}  // namespace axiscal::test
