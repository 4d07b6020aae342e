// SPDX-License-Identifier: Apache-2.0
#include <numeric>
#include <utility>

#include <Eigen/LU>

#include "axiscal/core/rotation.hpp"
#include "calib/fit/magnitude.hpp"
#include "calib/fit/src/joint_start.hpp"
#include "calib/record/parameter_names.hpp"
#include "calib/regression/gauss_newton.hpp"

namespace axiscal {
namespace {

// Transforms the covariance of the biases and sensitivities to another frame, in which a field f
// has the coordinates R f.
Eigen::MatrixXd turned(const Eigen::Matrix3d& R, const Eigen::MatrixXd& covariance) {
  Eigen::MatrixXd T = Eigen::MatrixXd::Identity(covariance.rows(), covariance.rows());
  for (Eigen::Index first = 0; first < covariance.rows(); first += 4) {
    T.block<3, 3>(first + 1, first + 1) = R;
  }
  return T * covariance * T.transpose();
}

// The unknowns of the alignment: the rotation Q of the measured fields to the sensor's frame, and
// the field in the table's frame.
struct PointAlignment {
  Eigen::Matrix3d Q;
  Eigen::Vector3d in_table;
};

// Finds the rotation Q and the field f in the table's frame that best satisfy Q f_i = R_i f. f has
// the known magnitude F. f_i are the measured fields. R_i is the rotation from the table's frame to
// the sensor's frame.
class AlignmentProblem {
 public:
  using State = PointAlignment;
  using Linear = Linearised;

  // @param set       must outlive the problem.
  // @param measured  f_i, n x 3.
  AlignmentProblem(const ReadingSet& set, Eigen::MatrixXd measured, double F)
      : set_(set), measured_(std::move(measured)), F_(F) {}

  // Returns the best Q for a given field in the table's frame (Wahba's problem).
  [[nodiscard]] PointAlignment start(const Eigen::Vector3d& in_table) const {
    Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
    for (Eigen::Index i = 0; i < set_.size(); ++i) {
      M += set_.met_of_field(static_cast<std::size_t>(i)) * in_table * measured_.row(i);
    }
    return {.Q = nearest_rotation(M), .in_table = in_table};
  }

  void linearise(const PointAlignment& at, Linearised& linear) const {
    const Eigen::Index n = set_.size();
    linear.residuals = residuals(at);
    linear.jacobian.resize(3 * n, 5);
    const Eigen::Matrix<double, 3, 2> tangents = F_ * tangents_of(at.in_table);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Vector3d turned = at.Q * measured_.row(i).transpose();
      linear.jacobian.block<3, 3>(3 * i, 0) = -cross_matrix(turned);
      linear.jacobian.block<3, 2>(3 * i, 3) =
          -set_.met_of_field(static_cast<std::size_t>(i)) * tangents;
    }
  }

  [[nodiscard]] PointAlignment moved(const PointAlignment& at, const Eigen::VectorXd& step) const {
    const Eigen::Vector3d moved = at.in_table + F_ * tangents_of(at.in_table) * step.tail<2>();
    return {.Q = rotation_by(step.head<3>()) * at.Q, .in_table = F_ * moved.normalized()};
  }

  [[nodiscard]] double cost(const PointAlignment& at, const Linearised& /*linear*/) const {
    return residuals(at).squaredNorm();
  }

  [[nodiscard]] static double length(const PointAlignment& /*at*/,
                                     const Eigen::VectorXd& step,
                                     const Linearised& /*linear*/) {
    return step.norm();
  }

 private:
  [[nodiscard]] Eigen::VectorXd residuals(const PointAlignment& at) const {
    Eigen::VectorXd all(3 * set_.size());
    for (Eigen::Index i = 0; i < set_.size(); ++i) {
      all.segment<3>(3 * i) = at.Q * measured_.row(i).transpose() -
                              set_.met_of_field(static_cast<std::size_t>(i)) * at.in_table;
    }
    return all;
  }

  const ReadingSet& set_;
  Eigen::MatrixXd measured_;
  double F_;
};

}  // namespace

Eigen::MatrixXd fields_of_readings(const LinearResponse& response,
                                   const Eigen::MatrixXd& readings) {
  const Eigen::Matrix3d inverse = Eigen::Matrix3d(response.sensitivity).inverse();
  return (readings.rowwise() - response.bias.transpose()) * inverse.transpose();
}

void turn_frame(const Eigen::Matrix3d& R, LinearResponse& response, Eigen::MatrixXd& covariance) {
  response.sensitivity *= R.transpose();
  covariance = turned(R, covariance);
}

void turn_frame(const Eigen::Matrix3d& R, FitStatistics& statistics) {
  statistics.covariance = turned(R, statistics.covariance);
  for (ScatterComponent& component : statistics.components) {
    component.covariance = turned(R, component.covariance);
  }
  if (statistics.interval_dof.size() > 0) {
    put_intervals(statistics);
  }
}

void align_by_points(const ReadingSet& set, double F, Estimate& estimate) {
  std::vector<Eigen::Index> all(static_cast<std::size_t>(set.size()));
  std::iota(all.begin(), all.end(), 0);
  const Eigen::VectorXd linear = linear_directions(set, all);
  const Eigen::Vector3d in_table =
      F * (linear.size() == 3 ? Eigen::Vector3d(linear) : Eigen::Vector3d::UnitZ());
  const AlignmentProblem problem(set, fields_of_readings(estimate.response, set.response), F);
  // The design points determine the direction of the field only up to its sign. The sign with the
  // smaller sum of squares is used.
  PointAlignment best = gauss_newton(problem, problem.start(in_table)).state;
  const PointAlignment other = gauss_newton(problem, problem.start(-in_table)).state;
  if (problem.cost(other, {}) < problem.cost(best, {})) {
    best = other;
  }
  estimate.response.sensitivity *= best.Q.transpose();
  turn_frame(best.Q, estimate.statistics);
  estimate.field = set.field.with_all(best.in_table);
}

}  // namespace axiscal
