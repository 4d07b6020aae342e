// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "axiscal/calib/reading_uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "calib/apply/src/reduced_results.hpp"
#include "calib/record/linear_propagation.hpp"
#include "calib/regression/factor.hpp"

namespace axiscal {
namespace {

// Compares the linear propagation of a quantity with its simulated errors. Sorts `errors`.
MonteCarloCheck check_of(const AttitudeQuantity& quantity, std::vector<double>& errors) {
  const auto trials = static_cast<Eigen::Index>(errors.size());
  const Eigen::Map<const Eigen::VectorXd> all(errors.data(), trials);
  MonteCarloCheck check{.name = quantity.name,
                        .linear_u = quantity.uncertainty.u,
                        .linear_expanded = quantity.uncertainty.expanded,
                        .mean_error = all.mean()};
  check.sd =
      std::sqrt((all.array() - check.mean_error).square().sum() / static_cast<double>(trials - 1));
  std::sort(errors.begin(), errors.end());
  const auto quantile = [&](double p) {
    return errors[static_cast<std::size_t>(p * static_cast<double>(trials - 1))];
  };
  check.low_95 = quantile(0.025);
  check.high_95 = quantile(0.975);
  // Largest accepted difference between an end of the simulated interval and -U or +U, as a
  // fraction of the expanded uncertainty U. The approximation by effective degrees of freedom can
  // cause differences of up to 5 %.
  constexpr double tolerance = 0.1;
  check.agrees =
      std::abs(check.low_95 + check.linear_expanded) <= tolerance * check.linear_expanded &&
      std::abs(check.high_95 - check.linear_expanded) <= tolerance * check.linear_expanded;
  return check;
}

}  // namespace

/// Builds a budget from the propagated uncertainties.
class AttitudeBudgetMaker {
 public:
  AttitudeBudgetMaker(const Calibration& calibration,
                      const ReductionOptions& options,
                      const ReadingNoise& noise,
                      const Eigen::Vector3d& field,
                      std::optional<SensorTemperature> temperature)
      : calibration_(calibration),
        reducer_(calibration, one_pair_of_angles(calibration, options, field), Force::yes),
        propagation_(calibration, reducer_, noise, options.factor),
        noise_(noise),
        field_(field),
        temperature_(std::move(temperature)) {
    if (!reducer_.gives_components()) {
      throw DomainError("attitude_budget: the instrument must have at least three axes");
    }
    if (calibration.sensor.temperature && !temperature_) {
      temperature_ = calibration.sensor.temperature->reference();
    }
    const Eigen::VectorXd v = response_at(calibration.sensor, field, temperature_);
    readings_.assign(v.begin(), v.end());
  }

  [[nodiscard]] AttitudeBudget budget() const {
    AttitudeBudget result;
    const bool has_budget = calibration_.fit.uncertainty.has_value();
    if (has_budget) {
      for (const UncertaintySource& source : calibration_.fit.uncertainty->sources) {
        result.sources.push_back(source.name);
      }
    } else {
      result.sources.emplace_back("fit");
    }
    result.sources.emplace_back("reading");
    // A later reading belongs to a new block, not to a block of the record.
    const bool has_blocks = propagation_.block_freedom_ > 0.0;
    if (has_blocks) {
      result.sources.emplace_back("later block");
    }
    const Eigen::VectorXd between = propagation_.between_blocks(field_);
    const Eigen::MatrixXd B =
        propagation_.change_with_parameters(field_, {.temperature = temperature_});
    const Eigen::VectorXd own = propagation_.reading_variance(field_, temperature_);
    const Eigen::MatrixXd C = B * propagation_.covariance_ * B.transpose();
    const Eigen::MatrixXd G = propagation_.change_with_readings(
        readings_, {.temperature = temperature_}, (C.diagonal() + own).cwiseSqrt());
    const Eigen::VectorXd here = results_of(
        reducer_.reduce(readings_, {.temperature = temperature_}), derived_count(reducer_, false));
    const std::vector<std::string> names = names_of_results(reducer_);
    const LinearPropagation inheritance(calibration_);
    for (Eigen::Index r = 0; r < here.size(); ++r) {
      if (std::isnan(here(r))) {
        continue;
      }
      AttitudeQuantity quantity{.name = names[static_cast<std::size_t>(r)], .value = here(r)};
      // The sign is negative, because a larger parameter gives a smaller field for the same
      // reading.
      const bool free_of_magnitude = r >= 3;
      const Eigen::RowVectorXd gradient = -G.row(r) * B;
      std::vector<double> by_source;
      VarianceShares shares = inheritance.all(gradient, by_source);
      if (free_of_magnitude && has_budget) {
        drop_magnitude(gradient, by_source, shares);
      }
      const Eigen::VectorXd by_reading = G.row(r).transpose().cwiseAbs2().cwiseProduct(own);
      add_readings(by_reading, shares);
      propagation_.add_blocks(G.row(r), between, shares);
      quantity.uncertainty = combine(shares);
      quantity.uncertainty.by_source = std::move(by_source);
      quantity.uncertainty.by_source.push_back(std::sqrt(by_reading.sum()));
      if (has_blocks) {
        quantity.uncertainty.by_source.push_back(std::sqrt(G.row(r).cwiseAbs2().dot(between)));
      }
      result.quantities.push_back(std::move(quantity));
    }
    return result;
  }

  [[nodiscard]] std::vector<MonteCarloCheck> monte_carlo(int trials, std::uint64_t seed) const;

 private:
  // Returns the simulated errors of each result, one for each trial; empty if the result is NaN.
  [[nodiscard]] std::vector<std::vector<double>> drawn_errors(int trials, std::uint64_t seed) const;

  // Returns options that fix whether roll or yaw is computed, so that all trials give the same one
  // of these two angles.
  static ReductionOptions one_pair_of_angles(const Calibration& calibration,
                                             ReductionOptions options,
                                             const Eigen::Vector3d& field) {
    const bool yaw = std::abs(field.x()) >= calibration.sensor.field.magnitude *
                                                std::sin(options.inclination.yaw_above_rad);
    options.inclination.yaw_above_rad = yaw ? 0.0 : 2.0;
    return options;
  }

  void drop_magnitude(const Eigen::RowVectorXd& gradient,
                      std::vector<double>& by_source,
                      VarianceShares& shares) const {
    const auto& sources = calibration_.fit.uncertainty->sources;
    for (std::size_t s = 0; s < sources.size(); ++s) {
      if (sources[s].name == field_magnitude_source) {
        shares.others -= gradient.dot(sources[s].covariance * gradient.transpose());
        by_source[s] = 0.0;
      }
    }
    shares.others = std::max(shares.others, 0.0);
  }

  // Adds the variances due to the noise of the readings. Noise that is estimated from the scatter
  // of the fit has the degrees of freedom of the fit.
  void add_readings(const Eigen::VectorXd& by_reading, VarianceShares& shares) const {
    if (noise_.sd) {
      shares.others += by_reading.sum();
    } else {
      for (std::size_t k = 0; k < shares.axes.size(); ++k) {
        shares.axes[k].variance += by_reading(static_cast<Eigen::Index>(k));
      }
    }
  }

  const Calibration& calibration_;
  Reducer reducer_;
  ReadingPropagation propagation_;
  ReadingNoise noise_;
  Eigen::Vector3d field_;
  std::optional<SensorTemperature> temperature_;
  std::vector<double> readings_;
};

std::vector<MonteCarloCheck> AttitudeBudgetMaker::monte_carlo(int trials,
                                                              std::uint64_t seed) const {
  std::vector<std::vector<double>> errors = drawn_errors(trials, seed);
  std::vector<MonteCarloCheck> checks;
  std::size_t at = 0;
  const AttitudeBudget linear = budget();
  for (std::vector<double>& own : errors) {
    if (!own.empty()) {
      checks.push_back(check_of(linear.quantities[at++], own));
    }
  }
  return checks;
}

std::vector<std::vector<double>> AttitudeBudgetMaker::drawn_errors(int trials,
                                                                   std::uint64_t seed) const {
  const FitStatistics& statistics = *calibration_.fit.statistics;
  const Eigen::MatrixXd B =
      propagation_.change_with_parameters(field_, {.temperature = temperature_});
  const Eigen::VectorXd own = propagation_.reading_variance(field_, temperature_).cwiseSqrt();
  const Eigen::Index m = own.size();
  // Errors due to the scatter of the fit have Student's t distribution with the degrees of freedom
  // of each axis. Errors due to differences between blocks or between placements of the cube have
  // Student's t distribution with the degrees of freedom of that component. All other errors are
  // normal.
  const Eigen::MatrixXd fit_root = covariance_root(B * propagation_.of_readings_ * B.transpose());
  const Eigen::MatrixXd others_root = covariance_root(B * propagation_.of_inputs_ * B.transpose());
  const Eigen::VectorXd between = propagation_.between_blocks(field_).cwiseSqrt();
  std::vector<Eigen::MatrixXd> component_roots;
  for (const ReadingPropagation::Part& part : propagation_.components_) {
    component_roots.push_back(covariance_root(B * part.covariance * B.transpose()));
  }
  const std::size_t derived = derived_count(reducer_, false);
  const Eigen::VectorXd here =
      results_of(reducer_.reduce(readings_, {.temperature = temperature_}), derived);
  std::vector<std::vector<double>> errors(static_cast<std::size_t>(here.size()));
  RandomStream random(seed);
  const auto normals = [&](Eigen::Index n) {
    Eigen::VectorXd z(n);
    for (double& value : z) {
      value = random.normal();
    }
    return z;
  };
  // Draws sqrt(nu / chi^2), where chi^2 has nu degrees of freedom. A normal number times this
  // factor has Student's t distribution. chi^2 is a sum of squared normal numbers. If nu is not an
  // integer, the last square is multiplied by the fractional part of nu.
  const auto t_factor = [&](double nu) {
    double chi2 = 0.0;
    double left = nu;
    for (; left >= 1.0; left -= 1.0) {
      const double z = random.normal();
      chi2 += z * z;
    }
    const double z = random.normal();
    chi2 += left * z * z;
    return std::sqrt(nu / std::max(chi2, 1e-12));
  };
  std::vector<double> moved(readings_.size());
  for (int trial = 0; trial < trials; ++trial) {
    Eigen::VectorXd factor(m);
    for (Eigen::Index k = 0; k < m; ++k) {
      factor(k) = t_factor(statistics.degrees_of_freedom(k));
    }
    Eigen::VectorXd change = factor.cwiseProduct(fit_root * normals(m));
    for (std::size_t c = 0; c < component_roots.size(); ++c) {
      change += t_factor(propagation_.components_[c].degrees_of_freedom) *
                (component_roots[c] * normals(m));
    }
    if (propagation_.block_freedom_ > 0.0) {
      change += t_factor(propagation_.block_freedom_) * between.cwiseProduct(normals(m));
    }
    change += others_root * normals(m);
    const Eigen::VectorXd noise = own.cwiseProduct(normals(m));
    change += noise_.sd ? noise : Eigen::VectorXd(factor.cwiseProduct(noise));
    for (std::size_t k = 0; k < moved.size(); ++k) {
      moved[k] = readings_[k] + change(static_cast<Eigen::Index>(k));
    }
    const Eigen::VectorXd results =
        results_of(reducer_.reduce(moved, {.temperature = temperature_}), derived);
    for (Eigen::Index r = 0; r < here.size(); ++r) {
      if (!std::isnan(here(r))) {
        errors[static_cast<std::size_t>(r)].push_back(
            difference_of_results(results(r), here(r), result_is_angle(reducer_, r)));
      }
    }
  }
  return errors;
}

AttitudeBudget attitude_budget(const Calibration& calibration,
                               const ReductionOptions& options,
                               const ReadingNoise& noise,
                               const Eigen::Vector3d& field_in_sensor,
                               std::optional<double> temperature) {
  if (!gives_field(calibration)) {
    throw DomainError(
        "the record's biases include the response to the field, so an attitude cannot be computed "
        "from readings");
  }
  return AttitudeBudgetMaker(calibration, options, noise, field_in_sensor, temperature).budget();
}

Eigen::Vector3d field_of_attitude(const SensorModel& sensor, double pitch_rad, double roll_rad) {
  const Eigen::Matrix3d R =
      rotation_sensor_from_level(pitch_rad, roll_rad, 0.0, sensor.instrument.convention);
  return sensor.field.magnitude * R.col(2);
}

std::vector<MonteCarloCheck> check_by_monte_carlo(const Calibration& calibration,
                                                  const ReductionOptions& options,
                                                  const ReadingNoise& noise,
                                                  const Eigen::Vector3d& field_in_sensor,
                                                  int trials,
                                                  std::uint64_t seed,
                                                  std::optional<double> temperature) {
  constexpr int fewest = 1000;
  if (trials < fewest) {
    throw DomainError("check_by_monte_carlo: at least 1000 trials are needed");
  }
  return AttitudeBudgetMaker(calibration, options, noise, field_in_sensor, temperature)
      .monte_carlo(trials, seed);
}

}  // namespace axiscal
