// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/transfer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "calib/fit/src/axis_regression.hpp"
#include "calib/regression/factor.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns orthonormal columns with the same span as `directions`. If some of the sensor's axes have
// the same span, the columns are the unit vectors of these axes. Otherwise they are `directions`.
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

// Tests for curvature of the response, by a term with the squared field along one direction.
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
    return std::nullopt;  // two levels do not determine a squared term
  }
}

}  // namespace

Eigen::Matrix3Xd seen_directions(const ReadingSet& set,
                                 const TableField& field,
                                 const Eigen::MatrixXd& design) {
  const Eigen::Matrix3Xd all(3, 0);
  if (!set.also_in_table.empty()) {
    return all;
  }
  // The mean is subtracted from the fields. A component that is equal in all fields, for example if
  // the fields lie on a cone about an axis, cannot be distinguished from the biases.
  const Eigen::ArrayXd used = (set.weights.array() > 0.0).rowwise().any().cast<double>();
  Eigen::MatrixXd fields = design.middleCols<3>(1);
  const double size = fields.norm();
  const Eigen::RowVector3d mean =
      (fields.array().colwise() * used).colwise().sum().matrix() / used.sum();
  fields.rowwise() -= mean;
  fields.array().colwise() *= used;
  const SingularValues svd = singular_values(fields);
  constexpr double none = 1e-6;  // limit of a singular value, relative to the largest one
  const Eigen::VectorXd& values = svd.values;
  const auto count = static_cast<Eigen::Index>((values.array() > none * values(0)).count());
  if (count == 3 || !(values(0) > 1e-9 * size)) {
    return all;
  }
  const Eigen::Matrix3Xd seen = along_axes(svd.V.leftCols(count));
  if (field.has_vectors() && set.axis_count() > 1) {
    // If an axis has a nominal direction outside the span of the fields, the cube was placed on too
    // few faces. The result is then empty, and the error message of the fit names the faces to add.
    for (const std::optional<int>& nominal : set.nominal) {
      if (nominal && seen.row(*nominal).norm() < 1.0 - 1e-9) {
        return all;
      }
    }
  }
  return seen;
}

double mean_length_of_fields(const Eigen::MatrixXd& design) {
  const Eigen::VectorXd lengths = design.middleCols<3>(1).rowwise().norm();
  const auto met = static_cast<double>((lengths.array() > 0.0).count());
  return lengths.sum() / std::max(met, 1.0);
}

Estimate estimate_transfer(const ReadingSet& given,
                           const Eigen::MatrixXd& design,
                           const Eigen::Matrix3Xd& seen) {
  ReadingSet set = given;
  set.seen = seen;
  require_response(set);
  const Eigen::MatrixXd map = set.observable_column_map();
  const Eigen::Index m = set.axis_count();
  const auto names_of = [&](Eigen::Index axis) {
    const std::vector<std::string> all_names = set.names_of_axis(axis);
    std::vector<std::string> names(
        static_cast<std::size_t>(1 + seen.cols()),
        formatted("{}.sensitivity", set.axes[static_cast<std::size_t>(axis)]));
    names.front() = all_names.front();
    names.insert(names.end(), all_names.begin() + 4, all_names.end());
    return names;
  };
  std::vector<AxisRegression> axes;
  std::optional<CurvatureTest> curvature;
  for (Eigen::Index first = 0; first < m;) {
    const Eigen::Index count = set.end_of_alike(first, set.weights) - first;
    const Eigen::MatrixXd columns = set.observable_columns(design, first);
    const FactoredDesign factored(columns, set.weights.col(first), [&] { return names_of(first); });
    std::vector<AxisRegression> alike = regress({.set = set,
                                                 .first = first,
                                                 .factored = factored,
                                                 .design = columns,
                                                 .weights = set.weights.col(first),
                                                 .responses = set.response.middleCols(first, count),
                                                 .names = names_of});
    if (seen.cols() == 1 && m == 1) {
      curvature = curvature_along(set, columns, columns.col(1), alike.front().fit);
    }
    for (AxisRegression& axis : alike) {
      axis.fit.estimate = map * axis.fit.estimate;
      axis.fit.covariance = map * axis.fit.covariance * map.transpose();
      axis.variance_inflation = Eigen::VectorXd::Constant(map.rows(), not_a_number);
      axes.push_back(std::move(axis));
    }
    first += count;
  }
  Estimate estimate = summarize(set, axes, rows_of_readings(set));
  estimate.mean_field = mean_length_of_fields(design);
  estimate.curvature = std::move(curvature);
  estimate.sight.seen = seen;
  return estimate;
}

void drop_unobserved_parameters(const Eigen::Matrix3Xd& seen, Calibration& calibration) {
  const std::vector<std::string>& axes = calibration.sensor.instrument.axes;
  FitStatistics& statistics = *calibration.fit.statistics;
  std::vector<Eigen::Index> kept;
  std::vector<std::string> names;
  std::vector<std::string> lost;
  for (std::size_t p = 0; p < statistics.parameter_names.size(); ++p) {
    const std::string& name = statistics.parameter_names[p];
    const std::size_t component = std::string("xyz").find(name.back());
    const bool is_sensitivity = std::any_of(axes.begin(), axes.end(), [&](const std::string& axis) {
      return name.starts_with(axis + ".sensitivity.");
    });
    constexpr double nothing = 1e-9;
    if (is_sensitivity && seen.row(static_cast<Eigen::Index>(component)).norm() < nothing) {
      lost.push_back(name);
      statistics.sensitivity_se.col(static_cast<Eigen::Index>(component)).setConstant(not_a_number);
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
           ? formatted("the fields of the readings lie in one {}: the response of {} {} to fields "
                       "perpendicular to it is not known, and is taken as 0",
                       seen.cols() == 1 ? "line" : "plane", axes.size() == 1 ? "axis" : "axes",
                       joined(axes))
           : formatted("the sensitivities {} are unknown and are taken as 0, because the field has "
                       "no component in their direction in any reading",
                       joined(lost))});
}

}  // namespace axiscal
