// SPDX-License-Identifier: Apache-2.0
#include "calib/record/src/statistics_members.hpp"

#include <array>
#include <cstddef>

#include "axiscal/core/not_a_number.hpp"
#include "calib/record/parameter_names.hpp"
#include "calib/record/src/scatter_words.hpp"

namespace axiscal {
namespace {

// Reads or writes a matrix with m columns. In the file, each element of a list contains one row of
// the matrix.
class RowVectors {
 public:
  RowVectors(const char* key, Eigen::MatrixXd& matrix, Eigen::Index m)
      : key_(key), matrix_(matrix), m_(m) {}

  [[nodiscard]] const char* key() const { return key_; }
  [[nodiscard]] bool is_empty() const { return matrix_.size() == 0; }

  void put_or_take(JsonMembers& io, Eigen::Index row) {
    if (!io.reads()) {
      of_row_.setConstant(m_, not_a_number);
      if (row < matrix_.rows()) {
        of_row_ = matrix_.row(row).transpose();
      }
    }
    io.vector(key_, of_row_, m_);
    if (io.reads()) {
      taken_.insert(taken_.end(), of_row_.begin(), of_row_.end());
    }
  }

  // Sets the matrix from the rows that were read, if each element of the list contained a row.
  void finish(std::size_t rows) {
    if (rows > 0 && taken_.size() == rows * static_cast<std::size_t>(m_)) {
      using ByRow = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      matrix_ = Eigen::Map<const ByRow>(taken_.data(), static_cast<Eigen::Index>(rows), m_);
    }
  }

 private:
  const char* key_;
  Eigen::MatrixXd& matrix_;
  Eigen::Index m_;
  Eigen::VectorXd of_row_;
  std::vector<double> taken_;
};

void row_members(JsonMembers& io, FitStatistics& statistics, Eigen::Index m) {
  std::array always = {RowVectors("leverage", statistics.leverage, m),
                       RowVectors("studentized", statistics.studentized, m),
                       RowVectors("cooks_distance", statistics.cooks_distance, m)};
  RowVectors robust("robust_weight", statistics.robust_weight, m);
  io.table("rows", statistics.rows, [&](JsonMembers& one, RegressionRow& row) {
    const auto number = static_cast<Eigen::Index>(&row - statistics.rows.data());
    one.value("runs", row.runs);
    point_members(one, row.point);
    one.value("block", row.block);
    for (RowVectors& vectors : always) {
      vectors.put_or_take(one, number);
    }
    if (one.has(robust.key(), !robust.is_empty())) {
      robust.put_or_take(one, number);
    }
  });
  if (io.reads()) {
    for (RowVectors& vectors : always) {
      vectors.finish(statistics.rows.size());
    }
    robust.finish(statistics.rows.size());
  }
}

void members(JsonMembers& io, LackOfFit& test) {
  io.number("pure_error_sd", test.pure_error_sd);
  io.number("pure_error_dof", test.pure_error_dof);
  io.number("lack_of_fit_dof", test.lack_of_fit_dof);
  io.number("f", test.f);
  io.number("p_value", test.p_value);
}

void error_members(JsonMembers& io, FitStatistics& statistics, Eigen::Index m) {
  if (io.reads()) {
    statistics.bias_se = Eigen::VectorXd::Constant(m, not_a_number);
    statistics.sensitivity_se = Eigen::MatrixXd::Constant(m, 3, not_a_number);
  }
  io.object("standard_error", true, [&](JsonMembers& errors) {
    errors.vector("bias", statistics.bias_se, m);
    errors.matrix("sensitivity", statistics.sensitivity_se, m, 3);
  });
  io.vector("coverage_factor_95", statistics.coverage_factor, m);
}

// Reads or writes the intervals. Records of version 0.1 lack `interval_dof`; the degrees of freedom
// of each axis are then used.
void interval_members(JsonMembers& io, FitStatistics& statistics, Eigen::Index m) {
  const Eigen::Index count = statistics.covariance.rows();
  const Eigen::Index p = m > 0 ? count / m : 0;
  if (!io.reads()) {
    io.vector("interval_dof", statistics.interval_dof, count);
  } else if (io.from().find("interval_dof")) {
    io.vector("interval_dof", statistics.interval_dof, count);
    put_intervals(statistics);
  } else {
    fill_intervals(statistics);
  }
  if (p < 1 || statistics.interval_95.size() != count) {
    return;
  }
  // The number of sensitivity parameters of each axis. It is usually 3, but 0 for method `bias`. It
  // is less than 3 if the fields span fewer than three directions.
  Eigen::Index sensitivities = 0;
  while (1 + sensitivities < p &&
         statistics.parameter_names[static_cast<std::size_t>(1 + sensitivities)].find(
             ".sensitivity.") != std::string::npos) {
    ++sensitivities;
  }
  const bool has_sensitivity = sensitivities == 3;
  auto by_axis = statistics.interval_95.reshaped(p, m);
  Eigen::VectorXd bias = by_axis.row(0).transpose();
  Eigen::MatrixXd sensitivity = Eigen::MatrixXd::Constant(m, 3, not_a_number);
  if (has_sensitivity) {
    sensitivity = by_axis.middleRows<3>(1).transpose();
  }
  // The other intervals, for additional fields and temperature terms, are in the parameters' order.
  const Eigen::Index first_other = has_sensitivity ? 4 : 1;
  Eigen::MatrixXd others = by_axis.bottomRows(p - first_other).transpose();
  io.object("interval_95", true, [&](JsonMembers& intervals) {
    intervals.vector("bias", bias, m);
    intervals.matrix("sensitivity", sensitivity, m, 3);
    if (others.cols() > 0 && intervals.has("others", true)) {
      intervals.matrix("others", others, m, others.cols());
    }
  });
  if (io.reads()) {
    by_axis.row(0) = bias.transpose();
    by_axis.bottomRows(p - first_other) = others.transpose();
    if (has_sensitivity) {
      by_axis.middleRows<3>(1) = sensitivity.transpose();
    }
  }
}

void members(JsonMembers& io, ScatterComponent& component, Eigen::Index parameters) {
  io.need("name", component.name);
  if (io.reads()) {
    component.sd = io.from().at("sd").vector_or_nan();
  } else {
    io.put("sd", component.sd);
  }
  io.value_if_any("unit", component.unit);
  if (!io.reads()) {
    io.put("meaning", meaning_of_scatter(component.name));
  }
  io.number("degrees_of_freedom", component.degrees_of_freedom);
  io.need_matrix("covariance", component.covariance, parameters, parameters);
}

}  // namespace

void point_members(JsonMembers& io, std::optional<DesignPoint>& point) {
  if (!io.reads()) {
    if (point) {
      io.put("rest", face_name(point->rest()));
      io.put("fence", face_name(point->fence()));
    }
    return;
  }
  const std::optional<JsonValue> rest = io.from().find("rest");
  const std::optional<JsonValue> fence = io.from().find("fence");
  if (!rest || !fence) {
    return;
  }
  const std::optional<Face> rest_face = parse_face(rest->text());
  const std::optional<Face> fence_face = parse_face(fence->text());
  if (!rest_face || !fence_face || axis_of(*rest_face) == axis_of(*fence_face)) {
    io.from().fail("rest and fence must be faces (+X -X +Y -Y +Z -Z) on different axes");
  }
  point = DesignPoint(*rest_face, *fence_face);
}

void members(JsonMembers& io, FitStatistics& statistics, Eigen::Index m) {
  io.value("observations", statistics.observations);
  io.vector("degrees_of_freedom", statistics.degrees_of_freedom, m);
  io.vector("residual_sd", statistics.residual_sd, m);
  io.vector("r_squared", statistics.r_squared, m);
  error_members(io, statistics, m);
  io.value("parameter_names", statistics.parameter_names);
  // A covariance without parameter names has no meaning, so it is not read.
  const auto parameters = static_cast<Eigen::Index>(statistics.parameter_names.size());
  if (parameters > 0) {
    io.matrix("covariance", statistics.covariance, parameters, parameters);
  } else if (!io.reads()) {
    io.matrix("covariance", statistics.covariance, statistics.covariance.rows(),
              statistics.covariance.cols());
  }
  interval_members(io, statistics, m);
  io.list_if_any("components", statistics.components,
                 [parameters](JsonMembers& one, ScatterComponent& component) {
                   members(one, component, parameters);
                 });
  io.number("condition_number", statistics.condition_number);
  io.matrix("variance_inflation", statistics.variance_inflation, m, 3);
  io.list_if_any("lack_of_fit", statistics.lack_of_fit,
                 [](JsonMembers& one, LackOfFit& test) { members(one, test); });
  io.value_if_any("observations_per_axis", statistics.observations_per_axis);
  row_members(io, statistics, m);
}

}  // namespace axiscal
