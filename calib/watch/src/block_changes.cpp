// SPDX-License-Identifier: Apache-2.0
#include "calib/watch/src/block_changes.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "calib/record/parameter_names.hpp"

namespace axiscal {
namespace {

// Sums over the parameters of a class, which are tested together. The classes are the biases, the
// sensitivities along the axes and the cross-axis sensitivities. Squares and variances are in units
// of the variance that the noise of the readings causes.
struct ParameterClass {
  FisherSum parameters;  // combines the p-values of the tests against the noise
  // Combines one p-value for each parameter. It is the larger of two p-values: that of the test
  // against the noise, and that of the test against the scatter between blocks.
  FisherSum by_one;
  double squares = 0.0;  // sum of the squared differences
  double scatter = 0.0;  // sum of the variances from the scatter between blocks
  double scatter_squared = 0.0;
  double degrees_of_freedom = 0.0;  // degrees of freedom of one parameter's mean square

  void add(double p_by_noise) { parameters.add(p_by_noise); }
  void add_blocks(double square, double mean_square, double freedom, double p_by_noise) {
    const double t = std::sqrt(square / std::max(mean_square, 1e-300));
    by_one.add(std::max(student_t_two_sided_p(t, freedom), p_by_noise));
    squares += square;
    scatter += mean_square;
    scatter_squared += mean_square * mean_square;
    degrees_of_freedom = freedom;
  }
  // Returns the larger p-value of the tests against the noise and against the scatter of blocks.
  [[nodiscard]] double p() const {
    if (!(parameters.count() > 0.0)) {
      return 1.0;
    }
    const double by_noise = parameters.p_value();
    if (!(degrees_of_freedom > 0.0) || !(scatter > 0.0)) {
      return by_noise;
    }
    // The effective number of parameters, by Satterthwaite's formula. It is smaller than the actual
    // number if the parameters scatter differently.
    const double alike = scatter * scatter / scatter_squared;
    const double together =
        f_upper_p(std::max(squares / scatter, 1e-300), alike, alike * degrees_of_freedom);
    // by_one combines a test of each parameter, which detects small changes of all parameters
    // better. `together` tests the sum of squares, which detects a large change of one parameter
    // better.
    return std::max(by_noise, std::min(1.0, 2.0 * std::min(together, by_one.p_value())));
  }
};

BlockScatter pooled(const BlockScatter& one, const BlockScatter& other) {
  const double free = one.degrees_of_freedom + other.degrees_of_freedom;
  return {.mean_square = free > 0.0 ? (one.degrees_of_freedom * one.mean_square +
                                       other.degrees_of_freedom * other.mean_square) /
                                          free
                                    : 0.0,
          .degrees_of_freedom = free,
          .blocks = 1.0 / (1.0 / one.blocks + 1.0 / other.blocks)};
}

}  // namespace

BlockScatter scatter_of_blocks(const Calibration& record, const std::string& parameter) {
  const CalibrationConditions& conditions = record.fit.conditions;
  const std::vector<std::string>& axes = record.sensor.instrument.axes;
  BlockScatter result{.blocks = std::max(static_cast<double>(conditions.blocks), 1.0)};
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    const std::vector<std::string> names = parameter_names({axes[k]});
    const auto at = std::find(names.begin(), names.end(), parameter);
    const auto j = static_cast<Eigen::Index>(at - names.begin());
    if (at == names.end()) {
      continue;
    }
    if (j == 0 && row < conditions.block_mean_square.size()) {
      result.mean_square = conditions.block_mean_square(row);
      result.degrees_of_freedom = conditions.block_degrees_of_freedom;
    } else if (j > 0 && row < conditions.sensitivity_mean_square.rows()) {
      result.mean_square = conditions.sensitivity_mean_square(row, j - 1);
      result.degrees_of_freedom = conditions.sensitivity_degrees_of_freedom;
    }
  }
  return result;
}

Eigen::MatrixXd covariance_within_blocks(const Calibration& record) {
  Eigen::MatrixXd C = parameter_covariance(record);
  for (const ScatterComponent& component : record.fit.statistics->components) {
    if (component.name == "blocks" || component.name == "block_sensitivities") {
      C -= component.covariance;
    }
  }
  return C;
}

std::optional<double> p_of_block_changes(const Calibration& old,
                                         const Calibration& fresh,
                                         std::vector<std::string>& notes) {
  const auto states = [](const Calibration& record) {
    return record.fit.statistics && record.fit.statistics->covariance.size() > 0 &&
           record.fit.statistics->covariance.allFinite();
  };
  if (!states(old) || !states(fresh)) {
    return std::nullopt;
  }
  const Eigen::MatrixXd C_old = covariance_within_blocks(old);
  const Eigen::MatrixXd C_fresh = covariance_within_blocks(fresh);
  ParameterClass biases;
  ParameterClass mains;
  ParameterClass crosses;
  double fewest = 1e9;
  const Eigen::Index m = old.sensor.instrument.axis_count();
  for (Eigen::Index k = 0; k < m; ++k) {
    const std::vector<std::string> names =
        parameter_names({old.sensor.instrument.axes[static_cast<std::size_t>(k)]});
    Eigen::Index main = 0;
    old.sensor.response.sensitivity.row(k).cwiseAbs().maxCoeff(&main);
    for (std::size_t i = 0; i < names.size(); ++i) {
      const auto a = old.fit.statistics->position_of(names[i]);
      const auto b = fresh.fit.statistics->position_of(names[i]);
      if (!a || !b) {
        continue;
      }
      const double d =
          parameter_value(fresh.sensor, names[i]) - parameter_value(old.sensor, names[i]);
      const double size = old.sensor.response.sensitivity.row(k).norm() *
                          (i == 0 ? old.sensor.field.magnitude : 1.0);
      const double within = C_old(*a, *a) + C_fresh(*b, *b) + std::pow(1e-12 * size, 2);
      const double nu =
          old.fit.statistics->degrees_of_freedom(k) + fresh.fit.statistics->degrees_of_freedom(k);
      const auto component = static_cast<Eigen::Index>(i) - 1;
      ParameterClass& all = i == 0 ? biases : component == main ? mains : crosses;
      const double p_by_noise = student_t_two_sided_p(d / std::sqrt(within), nu);
      all.add(p_by_noise);
      const BlockScatter blocks =
          pooled(scatter_of_blocks(old, names[i]), scatter_of_blocks(fresh, names[i]));
      if (blocks.degrees_of_freedom > 0.0) {
        fewest = std::min(fewest, blocks.degrees_of_freedom);
        // If the parameter were fitted to a single block, the noise alone would cause this
        // variance.
        const double unit = within * blocks.blocks;
        all.add_blocks(d * d * blocks.blocks / unit, blocks.mean_square / unit,
                       blocks.degrees_of_freedom, p_by_noise);
      }
    }
  }
  if (fewest > 1e8) {
    return std::nullopt;
  }
  if (fewest < 2.0) {
    notes.emplace_back(
        "one record has two blocks and the other has one: almost no change can be detected. A "
        "record of four blocks detects a change of five times the difference between blocks");
  }
  constexpr double tests = 3.0;
  return std::min(1.0, tests * std::min({biases.p(), mains.p(), crosses.p()}));
}

}  // namespace axiscal
