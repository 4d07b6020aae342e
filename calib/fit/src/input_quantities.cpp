// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/input_quantities.hpp"

#include <limits>
#include <utility>

#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/rotation.hpp"
#include "calib/regression/factor.hpp"

namespace axiscal {

Eigen::Matrix<double, 3, 18> change_with_normals(
    const Eigen::Matrix3d& rotation_table_from_positioner,
    const DesignPoint& point,
    const Eigen::Vector3d& field_in_table) {
  const Eigen::Vector3d x = rotation_table_from_positioner.row(0);
  const Eigen::Vector3d y = rotation_table_from_positioner.row(1);
  const Eigen::Vector3d z = rotation_table_from_positioner.row(2);
  const Eigen::Vector3d& f = field_in_table;
  Eigen::Matrix<double, 3, 18> change = Eigen::Matrix<double, 3, 18>::Zero();
  change.middleCols<3>(3 * static_cast<Eigen::Index>(point.rest())) =
      -f.z() * Eigen::Matrix3d::Identity() + f.y() * z * y.transpose() + f.x() * z * x.transpose();
  change.middleCols<3>(3 * static_cast<Eigen::Index>(point.fence())) =
      f.y() * x * x.transpose() - f.x() * y * x.transpose();
  return change;
}

std::vector<InputQuantity> input_quantities(const Experiment& experiment,
                                            const ReadingSet& set,
                                            bool known_field,
                                            const TableField& field) {
  std::vector<InputQuantity> inputs;
  if (!field.has_vectors()) {
    return inputs;
  }
  const auto& covariance = experiment.positioner.description().normal_covariance;
  if (covariance && !covariance->isZero(0.0)) {
    inputs.push_back({.name = "positioner",
                      .u = not_a_number,
                      .parts = covariance->cols(),
                      .change = [&set, &positioner = experiment.positioner,
                                 &mount = experiment.rotation_sensor_from_positioner,
                                 root = covariance_root(*covariance)](
                                    Eigen::Index i, Eigen::Index k, const TableField& f) {
                        const DesignPoint& point = *set.readings[static_cast<std::size_t>(i)].point;
                        return Eigen::Matrix3Xd(
                            mount *
                            change_with_normals(positioner.rotation_table_from_positioner(point),
                                                point, set.seen_in_table(k, i, f)) *
                            root);
                      }});
  }
  const auto add_turns = [&](const char* name, double u, const Eigen::Matrix<double, 3, 2>& axes) {
    inputs.push_back(
        {.name = name,
         .u = u,
         .unit = "rad",
         .parts = axes.cols(),
         .change = [&set, u, axes](Eigen::Index i, Eigen::Index k, const TableField& f) {
           const Eigen::Vector3d met = set.seen_in_table(k, i, f);
           // A small rotation w changes the field f by w cross f = -(f cross w).
           return Eigen::Matrix3Xd(set.rotation_sensor_from_table[static_cast<std::size_t>(i)] *
                                   (-u * cross_matrix(met) * axes));
         }});
  };
  if (known_field && experiment.stated.slope_u > 0.0) {
    // An error of the slope rotates the field about the axes x and y of the table.
    add_turns("levelness", experiment.stated.slope_u, Eigen::Matrix<double, 3, 2>::Identity());
  }
  if (known_field && experiment.stated.direction_u_rad > 0.0) {
    add_turns("field direction", experiment.stated.direction_u_rad, tangents_of(field.vector(0)));
  }
  return inputs;
}

InputQuantity mount_quantity(double u_rad, const ReadingSet& set) {
  return {.name = "mount",
          .u = u_rad,
          .unit = "rad",
          .parts = 3,
          .change = [&set, u_rad](Eigen::Index i, Eigen::Index k, const TableField& f) {
            const Eigen::Vector3d met =
                set.rotation_sensor_from_table[static_cast<std::size_t>(i)] *
                set.seen_in_table(k, i, f);
            return Eigen::Matrix3Xd(-u_rad * cross_matrix(met));
          }};
}

Eigen::MatrixXd input_error_jacobian(const std::vector<InputQuantity>& inputs,
                                     const Fit& run,
                                     const TableField& field) {
  Eigen::Index count = 0;
  for (const InputQuantity& input : inputs) {
    count += input.parts;
  }
  Eigen::MatrixXd changes(run.row_count(), count);
  for (Eigen::Index i = 0; i < run.readings(); ++i) {
    for (Eigen::Index k = 0; k < run.axes(); ++k) {
      const Eigen::RowVector3d by_field = run.change_with_field(i, k);
      Eigen::Index first = 0;
      for (const InputQuantity& input : inputs) {
        changes.block(run.row_of(i, k), first, 1, input.parts) =
            by_field * input.change(i, k, field);
        first += input.parts;
      }
    }
  }
  return changes;
}

std::vector<UncertaintySource> sources_of(const std::vector<InputQuantity>& inputs,
                                          std::vector<Eigen::MatrixXd> shares) {
  std::vector<UncertaintySource> sources;
  for (std::size_t s = 0; s < inputs.size(); ++s) {
    sources.push_back({.name = inputs[s].name,
                       .type = "B",
                       .distribution = inputs[s].distribution,
                       .input_u = inputs[s].u,
                       .input_unit = inputs[s].unit,
                       .degrees_of_freedom = std::numeric_limits<double>::infinity(),
                       .covariance = std::move(shares[s])});
  }
  return sources;
}

}  // namespace axiscal
