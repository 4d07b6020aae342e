// SPDX-License-Identifier: Apache-2.0
#include "axis_regression.hpp"
#include "design_advice.hpp"
#include "estimation.hpp"
#include "opposite_pairs.hpp"

namespace axiscal {

Estimate estimate_known(const ReadingSet& set, const std::optional<Eigen::Vector3d>& in_table) {
  Eigen::MatrixXd design(set.size(), 4);
  RowsForPoint rows_for;
  if (in_table) {
    design = field_design(set, {*in_table});
    rows_for = [&](const DesignPoint& point) {
      Eigen::RowVector4d row;
      row << 1.0, (set.orientation(point) * *in_table).transpose();
      return row;
    };
  } else {
    design.col(0).setOnes();
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      const Reading& reading = set.readings[static_cast<std::size_t>(i)];
      design.row(i).tail<3>() = *reading.field_in_sensor;
    }
  }
  require_determined(set, design, rows_for);
  require_response(set);
  std::vector<AxisRegression> axes;
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    axes.push_back(regress_axis(design, set.response.col(k), set.weights.col(k),
                                parameter_names({set.axes[static_cast<std::size_t>(k)]}),
                                set.robust, set.rounding(k)));
  }
  Estimate estimate = summarize(set, axes, rows_of_readings(set));
  estimate.mean_field = design.rightCols<3>().rowwise().norm().mean();
  if (in_table) {
    estimate.fields = {*in_table};
    estimate.levelness = estimate_levelness(set, find_opposite_pairs(set).pairs,
                                            estimate.response.sensitivity, in_table->norm());
  }
  return estimate;
}

}  // namespace axiscal
