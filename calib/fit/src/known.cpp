// SPDX-License-Identifier: Apache-2.0
#include "axis_regression.hpp"
#include "axiscal/calib/design_advice.hpp"
#include "axiscal/calib/estimation.hpp"
#include "axiscal/calib/transfer.hpp"
#include "opposite_pairs.hpp"

namespace axiscal {

Estimate estimate_known(const ReadingSet& set, const TableField& field) {
  const Eigen::MatrixXd design = field_design(set, field);
  const Eigen::Matrix3Xd seen = seen_directions(set, design);
  if (seen.cols() > 0) {
    Estimate estimate = estimate_transfer(set, design, seen);
    estimate.field = field;
    return estimate;
  }
  if (set.visible.empty()) {
    require_determined(set, design,
                       field.has_vectors() ? rows_of_points(set, field) : RowsForPoint());
  }
  require_response(set);
  const AxisDesigns designs(set, field);
  AxisRegressor regressor(set.robust);
  std::vector<AxisRegression> axes;
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    axes.push_back(regressor.fit(
        set.all_columns(designs.of(k), k), set.response.col(k), set.weights.col(k),
        [&set, k] { return set.names_of_axis(k); }, set.rounding(k)));
  }
  Estimate estimate = summarize(set, axes, rows_of_readings(set));
  estimate.mean_field = design.middleCols<3>(1).rowwise().norm().mean();
  estimate.field = field;
  if (field.has_vectors() && !set.field.is_sum() && !set.leaves_out()) {
    estimate.levelness =
        levelness_of(set, find_opposite_pairs(set).pairs, estimate, field.magnitude());
  }
  return estimate;
}

}  // namespace axiscal
