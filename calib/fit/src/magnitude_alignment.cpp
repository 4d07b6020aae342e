// SPDX-License-Identifier: Apache-2.0
#include <limits>
#include <numeric>

#include <Eigen/LU>

#include "axiscal/calib/magnitude.hpp"
#include "axiscal/calib/parameter_names.hpp"
#include "axiscal/core/rotation.hpp"
#include "joint_start.hpp"

namespace axiscal {
namespace {

// The covariance of [b_k, S_k] of each axis in another frame: f_new = R f.
Eigen::MatrixXd turned(const Eigen::Matrix3d& R, const Eigen::MatrixXd& covariance) {
  Eigen::MatrixXd T = Eigen::MatrixXd::Identity(covariance.rows(), covariance.rows());
  for (Eigen::Index first = 0; first < covariance.rows(); first += 4) {
    T.block<3, 3>(first + 1, first + 1) = R;
  }
  return T * covariance * T.transpose();
}

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
  Eigen::Vector3d in_table =
      F * (linear.size() == 3 ? Eigen::Vector3d(linear) : Eigen::Vector3d::UnitZ());
  const Eigen::MatrixXd measured = fields_of_readings(estimate.response, set.response);
  // Either end of the axis that the points show; the better one is where the field points.
  Eigen::Matrix3d best = Eigen::Matrix3d::Identity();
  double least = std::numeric_limits<double>::infinity();
  for (const double sign : {1.0, -1.0}) {
    Eigen::Vector3d table = sign * in_table;
    Eigen::Matrix3d Q = Eigen::Matrix3d::Identity();
    double sum = 0.0;
    for (int round = 0; round < 200; ++round) {
      Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
      for (Eigen::Index i = 0; i < set.size(); ++i) {
        M += set.met_of_field(static_cast<std::size_t>(i)) * table * measured.row(i);
      }
      Q = nearest_rotation(M);
      Eigen::Vector3d next = Eigen::Vector3d::Zero();
      sum = 0.0;
      for (Eigen::Index i = 0; i < set.size(); ++i) {
        const Eigen::Matrix3d R = set.met_of_field(static_cast<std::size_t>(i));
        const Eigen::Vector3d turned = Q * measured.row(i).transpose();
        next += R.transpose() * turned;
        sum += (turned - R * table).squaredNorm();
      }
      next = F * next.normalized();
      const double change = (next - table).norm();
      table = next;
      if (change < 1e-14 * F) {
        break;
      }
    }
    if (sum < least) {
      least = sum;
      best = Q;
      in_table = table;
    }
  }
  estimate.response.sensitivity *= best.transpose();
  turn_frame(best, estimate.statistics);
  estimate.field = set.field.with_all(in_table);
}

}  // namespace axiscal
