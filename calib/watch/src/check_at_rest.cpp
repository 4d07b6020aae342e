// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/drift_check.hpp"
#include "axiscal/calib/reading_uncertainty.hpp"
#include "axiscal/calib/reduction.hpp"
#include "axiscal/core/error.hpp"

namespace axiscal {
namespace {

// Two tests share the probability of a false alarm: of all poses, and of the worst reading.
constexpr double share_of_poses = 0.8;
constexpr double share_of_readings = 0.2;

// Readings in about one attitude.
struct Pose {
  double count = 0.0;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  // sum
  double residual = 0.0;                                // sum
  double reading_variance = 0.0;                        // sum
  Eigen::RowVectorXd by_parameters;                     // sum
};

// The pose of a direction: the nearest, if it is near enough, or there are too many for a new one.
Pose& pose_of(std::vector<Pose>& poses, const Eigen::Vector3d& direction) {
  constexpr double near = 0.9962;  // 5 degrees
  constexpr std::size_t most = 100;
  Pose* nearest = nullptr;
  double largest = -2.0;
  for (Pose& pose : poses) {
    const double along = pose.direction.normalized().dot(direction);
    if (along > largest) {
      largest = along;
      nearest = &pose;
    }
  }
  return nearest != nullptr && (largest > near || poses.size() >= most) ? *nearest
                                                                        : poses.emplace_back();
}

// A part of the poses' covariance with its degrees of freedom.
struct PosePart {
  Eigen::MatrixXd covariance;
  double degrees_of_freedom = 0.0;
};

// How likely means of poses are so far from F by chance: T = m' V^-1 m / P, by F(P, nu), where the
// parts of V that are of scatter bring the degrees of freedom by their share in it.
double p_value_of(const Calibration& calibration, const std::vector<Pose>& poses) {
  const auto count = static_cast<Eigen::Index>(poses.size());
  const FitStatistics& statistics = *calibration.fit.statistics;
  Eigen::VectorXd mean(count);
  Eigen::VectorXd noise(count);
  Eigen::MatrixXd G(count, statistics.covariance.rows());
  for (Eigen::Index p = 0; p < count; ++p) {
    const Pose& pose = poses[static_cast<std::size_t>(p)];
    mean(p) = pose.residual / pose.count;
    noise(p) = pose.reading_variance / (pose.count * pose.count);
    G.row(p) = pose.by_parameters / pose.count;
  }
  std::vector<PosePart> parts;
  for (const ScatterComponent& component : statistics.components) {
    parts.push_back({.covariance = G * component.covariance * G.transpose(),
                     .degrees_of_freedom = component.degrees_of_freedom});
  }
  parts.push_back({.covariance = G * statistics.covariance_of_readings() * G.transpose(),
                   .degrees_of_freedom = statistics.degrees_of_freedom.minCoeff()});
  parts.back().covariance.diagonal() += noise;
  Eigen::MatrixXd V = Eigen::MatrixXd::Zero(count, count);
  for (const PosePart& part : parts) {
    V += part.covariance;
  }
  if (calibration.fit.uncertainty) {
    for (const UncertaintySource& source : calibration.fit.uncertainty->sources) {
      // An error of the field's magnitude is in the sensitivity too, and cancels.
      if (source.covariance.size() > 0 && source.name != field_magnitude_source) {
        V += G * source.covariance * G.transpose();
      }
    }
  }
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(V);
  const double statistic = mean.dot(ldlt.solve(mean)) / static_cast<double>(count);
  double inverse = 0.0;
  for (const PosePart& part : parts) {
    const double share = ldlt.solve(part.covariance).trace() / static_cast<double>(count);
    inverse += share * share / part.degrees_of_freedom;
  }
  constexpr double as_good_as_infinite = 1e6;
  return f_upper_p(std::max(statistic, 1e-300), static_cast<double>(count),
                   inverse > 1.0 / as_good_as_infinite ? 1.0 / inverse : as_good_as_infinite);
}

}  // namespace

InSituCheck check_in_situ(const Calibration& calibration,
                          const Observations& observations,
                          double alpha) {
  const Reducer reducer(calibration);
  if (!reducer.gives_components()) {
    throw DomainError("fewer than three axes leave no residual to check");
  }
  const ReadingPropagation propagation(calibration, reducer, stated_noise(calibration));
  InSituCheck check;
  std::vector<Pose> poses;
  const auto n = static_cast<double>(observations.size());
  const double nu = calibration.fit.statistics->degrees_of_freedom.minCoeff();
  const double factor = student_t_factor(1.0 - share_of_readings * alpha / n, nu);
  double sum = 0.0;
  double expected = 0.0;
  double furthest = 0.0;  // in its standard uncertainty
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    const Reading& reading = observations.readings[i];
    const Eigen::VectorXd v = observations.response.row(static_cast<Eigen::Index>(i));
    const std::span<const double> readings(v.data(), static_cast<std::size_t>(v.size()));
    const double residual = reducer.reduce(readings, {.temperature = reading.temperature}).residual;
    const double u = propagation.at(readings, {.temperature = reading.temperature}).residual;
    const double limit = factor * u;
    check.readings.push_back({.run = reading.run,
                              .residual = residual,
                              .limit = limit,
                              .within = std::abs(residual) <= limit});
    sum += residual * residual;
    expected += u * u;
    furthest = std::max(furthest, std::abs(residual) / u);
    const ReadingPropagation::LengthChange change =
        propagation.length_change(readings, reading.temperature);
    Pose& pose = pose_of(poses, change.direction);
    if (pose.count == 0.0) {
      pose.by_parameters = Eigen::RowVectorXd::Zero(change.by_parameters.size());
    }
    pose.count += 1.0;
    pose.direction += change.direction;
    pose.residual += residual;
    pose.reading_variance += change.reading_variance;
    pose.by_parameters += change.by_parameters;
  }
  check.rss = std::sqrt(sum);
  check.expected_rss = std::sqrt(expected);
  check.p_value = std::min({1.0, p_value_of(calibration, poses) / share_of_poses,
                            n * student_t_two_sided_p(furthest, nu) / share_of_readings});
  check.drifted = check.p_value < alpha;
  return check;
}

}  // namespace axiscal
