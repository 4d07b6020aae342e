// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/transfer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/SVD>

#include "axis_regression.hpp"
#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"

namespace axiscal {
namespace {

// Orthonormal columns of the same span; the sensor's axes where they span it too.
Eigen::Matrix3Xd along_axes(const Eigen::Matrix3Xd& directions) {
  const Eigen::Matrix3d onto = directions * directions.transpose();
  constexpr double same = 1e-9;
  Eigen::Matrix3Xd axes(3, 0);
  for (int j = 0; j < 3; ++j) {
    if (std::abs(onto(j, j) - 1.0) < same) {
      axes.conservativeResize(Eigen::NoChange, axes.cols() + 1);
      axes.rightCols<1>() = Eigen::Vector3d::Unit(j);
    }
  }
  return axes.cols() == directions.cols() ? axes : directions;
}

// Whether the squared field bends the response, by the field along one direction.
std::optional<CurvatureTest> curvature_along(const ReadingSet& set,
                                             const Eigen::MatrixXd& columns,
                                             const Eigen::VectorXd& along,
                                             const LeastSquaresFit& straight) {
  constexpr double fewest_left = 2.0;
  if (set.robust || !(straight.degrees_of_freedom > fewest_left) ||
      !(straight.residual_sd > 2.0 * set.rounding(0))) {
    return std::nullopt;
  }
  const double largest = along.cwiseAbs().maxCoeff();
  Eigen::MatrixXd bent(columns.rows(), columns.cols() + 1);
  bent << columns, (along / largest).cwiseAbs2();
  try {
    const LeastSquaresFit fit =
        LeastSquaresDesign(bent, set.weights.col(0)).fit(set.response.col(0));
    const Eigen::Index last = columns.cols();
    const double t = fit.estimate(last) / std::sqrt(fit.covariance(last, last));
    return CurvatureTest{.p_value = student_t_two_sided_p(t, fit.degrees_of_freedom),
                         .bends = fit.estimate.tail<1>()};
  } catch (const RankDeficientError&) {
    return std::nullopt;  // two levels lie on any line
  }
}

}  // namespace

Eigen::Matrix3Xd seen_directions(const ReadingSet& set, const Eigen::MatrixXd& design) {
  if (set.axis_count() != 1 || !set.also_in_table.empty()) {
    return Eigen::Matrix3Xd(3, 0);
  }
  const Eigen::MatrixXd fields =
      set.weights.col(0).cwiseSqrt().asDiagonal() * design.middleCols<3>(1);
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(fields, Eigen::ComputeThinV);
  constexpr double none = 1e-6;  // of the largest
  const Eigen::VectorXd& size = svd.singularValues();
  const auto count = static_cast<Eigen::Index>((size.array() > none * size(0)).count());
  if (count == 3 || !(size(0) > 0.0)) {
    return Eigen::Matrix3Xd(3, 0);
  }
  return along_axes(svd.matrixV().leftCols(count));
}

Estimate estimate_transfer(const ReadingSet& given,
                           const Eigen::MatrixXd& design,
                           const Eigen::Matrix3Xd& seen) {
  ReadingSet set = given;
  set.seen = seen;
  require_response(set);
  const Eigen::MatrixXd map = set.map_of_seen();
  const Eigen::MatrixXd columns = set.seen_columns(design, 0);
  const std::vector<std::string> all_names = set.names_of_axis(0);
  std::vector<std::string> names(static_cast<std::size_t>(1 + seen.cols()),
                                 set.axes.front() + ".sensitivity");
  names.front() = all_names.front();
  names.insert(names.end(), all_names.begin() + 4, all_names.end());
  const FactoredDesign factored(columns, set.weights.col(0), [&] { return names; });
  AxisRegression axis = std::move(regress({.set = set,
                                           .factored = factored,
                                           .design = columns,
                                           .weights = set.weights.col(0),
                                           .responses = set.response.leftCols(1),
                                           .names = [&](Eigen::Index) { return names; }})
                                      .front());
  std::optional<CurvatureTest> curvature;
  if (seen.cols() == 1) {
    curvature = curvature_along(set, columns, columns.col(1), axis.fit);
  }
  axis.fit.estimate = map * axis.fit.estimate;
  axis.fit.covariance = map * axis.fit.covariance * map.transpose();
  axis.variance_inflation = Eigen::VectorXd::Constant(map.rows(), not_a_number);
  Estimate estimate = summarize(set, {axis}, rows_of_readings(set));
  estimate.mean_field = design.middleCols<3>(1).rowwise().norm().mean();
  estimate.curvature = std::move(curvature);
  estimate.seen = seen;
  return estimate;
}

void forget_unseen(const Eigen::Matrix3Xd& seen, Calibration& calibration) {
  const std::string& axis = calibration.sensor.instrument.axes.front();
  FitStatistics& statistics = *calibration.fit.statistics;
  std::vector<Eigen::Index> kept;
  std::vector<std::string> names;
  std::vector<std::string> lost;
  for (std::size_t p = 0; p < statistics.parameter_names.size(); ++p) {
    const std::string& name = statistics.parameter_names[p];
    const std::size_t component = std::string("xyz").find(name.back());
    const bool is_sensitivity = name.starts_with(axis + ".sensitivity.");
    constexpr double nothing = 1e-9;
    if (is_sensitivity && seen.row(static_cast<Eigen::Index>(component)).norm() < nothing) {
      lost.push_back(name);
      statistics.sensitivity_se(0, static_cast<Eigen::Index>(component)) = not_a_number;
    } else {
      kept.push_back(static_cast<Eigen::Index>(p));
      names.push_back(name);
    }
  }
  statistics.parameter_names = names;
  const auto keep = [&kept](Eigen::MatrixXd& covariance) {
    if (covariance.size() > 0) {
      covariance = Eigen::MatrixXd(covariance(kept, kept));
    }
  };
  keep(statistics.covariance);
  statistics.interval_95 = Eigen::VectorXd(statistics.interval_95(kept));
  statistics.interval_dof = Eigen::VectorXd(statistics.interval_dof(kept));
  for (ScatterComponent& component : statistics.components) {
    keep(component.covariance);
  }
  for (UncertaintySource& source : calibration.fit.uncertainty->sources) {
    keep(source.covariance);
  }
  calibration.findings.notes.push_back(
      {NoteCode::unseen,
       lost.empty()
           ? formatted(
                 "the fields of the readings lie in one {}: what axis {} answers to across it "
                 "is not seen, and taken as 0",
                 seen.cols() == 1 ? "line" : "plane", axis)
           : formatted("the fields of the readings have no part along the directions of {}: these "
                       "are not seen, and taken as 0",
                       joined(lost))});
}

}  // namespace axiscal
