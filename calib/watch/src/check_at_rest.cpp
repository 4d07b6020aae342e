// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <vector>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/drift_check.hpp"
#include "axiscal/calib/reading_uncertainty.hpp"
#include "axiscal/calib/reduction.hpp"
#include "axiscal/core/error.hpp"
#include "calib/regression/factor.hpp"

namespace axiscal {
namespace {

// The probability of a false alarm is divided between the test of all poses and the test of the
// worst reading.
constexpr double share_of_poses = 0.8;
constexpr double share_of_readings = 0.2;

// Sums over the readings with nearly the same field direction.
struct Pose {
  double count = 0.0;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  double residual = 0.0;
  double reading_variance = 0.0;
  Eigen::RowVectorXd by_parameters;
};

// Returns the pose that is nearest to a direction, if the angle between them is less than 5 degrees
// or if the list is full. Otherwise appends a new pose and returns this pose.
Pose& pose_of(std::vector<Pose>& poses, const Eigen::Vector3d& direction) {
  constexpr double near = 0.9962;  // cosine of 5 degrees
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

// One term of the covariance matrix of the poses' mean residuals, with its degrees of freedom.
struct PosePart {
  Eigen::MatrixXd covariance;
  double degrees_of_freedom = 0.0;
};

// The scatter between the blocks of a calibration, expressed as an error of the measured field
// along each axis.
struct BlockOffset {
  // M (1 + 1 / B) [field unit squared], where M is the mean square between the B blocks of the
  // record.
  double variance = 0.0;
  double degrees_of_freedom = 0.0;
  double gain_variance = 0.0;  // relative variance of the sensitivities in another block
};

std::optional<BlockOffset> offset_of_block(const Calibration& calibration) {
  const CalibrationConditions& conditions = calibration.fit.conditions;
  const Eigen::Index m = calibration.sensor.response.bias.size();
  if (m != 3 || conditions.block_mean_square.size() != m ||
      !(conditions.block_degrees_of_freedom > 0.0)) {
    return std::nullopt;
  }
  const double B = conditions.blocks;
  const Eigen::MatrixXd of_readings = calibration.fit.statistics->covariance_of_readings();
  double sum = 0.0;
  for (Eigen::Index k = 0; k < m; ++k) {
    const auto at = calibration.fit.statistics->position_of(
        calibration.sensor.instrument.axes[static_cast<std::size_t>(k)] + ".bias");
    const double by_noise = at ? B * of_readings(*at, *at) : 0.0;
    const double scale = calibration.sensor.response.sensitivity.row(k).squaredNorm();
    sum += std::max(conditions.block_mean_square(k), by_noise) / scale;
  }
  double gains = 0.0;
  for (Eigen::Index k = 0; k < conditions.sensitivity_mean_square.rows(); ++k) {
    Eigen::Index main = 0;
    const double size = calibration.sensor.response.sensitivity.row(k).cwiseAbs().maxCoeff(&main);
    gains += conditions.sensitivity_mean_square(k, main) / (size * size) / 3.0;
  }
  return BlockOffset{.variance = sum / 3.0 * (1.0 + 1.0 / B),
                     .degrees_of_freedom = 3.0 * conditions.block_degrees_of_freedom,
                     .gain_variance = gains * (1.0 + 1.0 / B)};
}

// Returns the p-value of the poses' mean residuals. A common offset of the field vector is tested
// against the scatter between blocks. The remaining residuals are tested against the noise.
// Fisher's method combines the two tests.
double p_with_offset(const std::vector<Pose>& poses,
                     const Eigen::VectorXd& mean,
                     const Eigen::MatrixXd& by_noise,
                     double nu_of_noise,
                     double magnitude,
                     const BlockOffset& blocks) {
  const auto P = static_cast<Eigen::Index>(poses.size());
  Eigen::MatrixXd u(P, 3);
  for (Eigen::Index p = 0; p < P; ++p) {
    u.row(p) = poses[static_cast<std::size_t>(p)].direction.normalized().transpose();
  }
  // A relative change g of the sensitivity of axis k changes |f| by g |f| u_k^2, where u is the
  // direction of the field.
  const Eigen::MatrixXd squares = magnitude * u.cwiseAbs2();
  const Eigen::MatrixXd V = by_noise + blocks.gain_variance * squares * squares.transpose();
  const double share_of_noise = solve_symmetric(V, by_noise).trace() / static_cast<double>(P);
  const double nu = 1.0 / (share_of_noise * share_of_noise / nu_of_noise +
                           std::pow(1.0 - share_of_noise, 2) / blocks.degrees_of_freedom);
  const auto freedom = [&](double share) {
    return 1.0 / (share * share / nu + (1.0 - share) * (1.0 - share) / blocks.degrees_of_freedom);
  };
  const Whitening whitening(V);
  const Eigen::MatrixXd W = whitening.times(u);
  const Eigen::VectorXd y = whitening.times(mean);
  const Eigen::MatrixXd information = W.transpose() * W;
  const Eigen::VectorXd directions = symmetric_eigen(information).values;
  constexpr double open_below = 1e-6;
  if (P < 3 || directions.minCoeff() < open_below * directions.maxCoeff()) {
    // The poses do not determine the offset, so there is only one test. Its covariance includes the
    // noise and the scatter between blocks.
    const Eigen::MatrixXd all = V + blocks.variance * u * u.transpose();
    const double share = solve_symmetric(all, V).trace() / static_cast<double>(P);
    return f_upper_p(
        std::max(mean.dot(solve_symmetric(all, mean).col(0)) / static_cast<double>(P), 1e-300),
        static_cast<double>(P), freedom(share));
  }
  const Eigen::Matrix3d C = inverse_of(information);
  const Eigen::Vector3d beta = C * (W.transpose() * y);
  const Eigen::Matrix3d both = C + blocks.variance * Eigen::Matrix3d::Identity();
  const double share = solve_symmetric(both, C).trace() / 3.0;
  const double of_offset = f_upper_p(
      std::max(beta.dot(solve_symmetric(both, beta).col(0)) / 3.0, 1e-300), 3.0, freedom(share));
  if (P == 3) {
    return of_offset;
  }
  const auto others = static_cast<double>(P - 3);
  const double left = (y - W * beta).squaredNorm() / others;
  FisherSum tests;
  tests.add(of_offset);
  tests.add(f_upper_p(std::max(left, 1e-300), others, nu));
  return tests.p_value();
}

// Returns the p-value of the mean residuals m of the P poses. Without a drift, T = m' V^-1 m / P
// has the distribution F(P, nu), where V is the covariance of m. nu is the effective number of
// degrees of freedom of the parts of V that were estimated from scatter.
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
  const std::optional<BlockOffset> blocks = offset_of_block(calibration);
  std::vector<PosePart> parts;
  for (const ScatterComponent& component : statistics.components) {
    if (blocks && component.name == "blocks") {
      continue;
    }
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
      // An error of the field's magnitude cancels, because the calibrated sensitivity contains the
      // same relative error.
      if (source.covariance.size() > 0 && source.name != field_magnitude_source) {
        V += G * source.covariance * G.transpose();
      }
    }
  }
  if (blocks) {
    return p_with_offset(poses, mean, V, statistics.degrees_of_freedom.minCoeff(),
                         calibration.sensor.field.magnitude, *blocks);
  }
  const double statistic = mean.dot(solve_symmetric(V, mean).col(0)) / static_cast<double>(count);
  double inverse = 0.0;
  for (const PosePart& part : parts) {
    const double share = solve_symmetric(V, part.covariance).trace() / static_cast<double>(count);
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
  const Reducer reducer(calibration, {}, Force::yes);
  if (!reducer.gives_components()) {
    throw DomainError(
        "the check requires at least three axes, because fewer axes do not give a "
        "residual");
  }
  const ReadingPropagation propagation(calibration, reducer, stated_noise(calibration));
  InSituCheck check;
  std::vector<Pose> poses;
  const auto n = static_cast<double>(observations.size());
  // The degrees of freedom of a reading's uncertainty are at most those of the scatter between
  // blocks.
  const std::optional<BlockOffset> blocks = offset_of_block(calibration);
  const double of_readings = calibration.fit.statistics->degrees_of_freedom.minCoeff();
  const double nu = blocks ? std::min(of_readings, blocks->degrees_of_freedom) : of_readings;
  const double factor = student_t_factor(1.0 - share_of_readings * alpha / n, nu);
  double sum = 0.0;
  double expected = 0.0;
  double furthest = 0.0;  // largest |residual| / u
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
