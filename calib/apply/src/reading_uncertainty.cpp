// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/reading_uncertainty.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "axiscal/calib/covariance_root.hpp"
#include "axiscal/calib/parameter_names.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/units.hpp"

namespace axiscal {
namespace {

constexpr const char* field_magnitude_source = "field magnitude";

// What a reading says, as one vector: components, residual, derived values.
constexpr Eigen::Index fixed_results = 4;

Eigen::VectorXd results_of(const ReducedReading& reduced, std::size_t derived) {
  Eigen::VectorXd results(fixed_results + static_cast<Eigen::Index>(derived));
  results.head<3>() = reduced.field_in_sensor;
  results(3) = reduced.residual;
  for (std::size_t j = 0; j < derived; ++j) {
    results(fixed_results + static_cast<Eigen::Index>(j)) = reduced.derived.values[j];
  }
  return results;
}

std::size_t derived_count(const Reducer& reducer, bool has_up) {
  const InstrumentKind& kind = reducer.kind();
  const bool derives = kind.derive != nullptr && (has_up || !kind.derives_with_attitude);
  return derives ? kind.derived_names.size() : 0;
}

std::vector<std::string> result_names(const Reducer& reducer) {
  std::vector<std::string> names = {"field_x", "field_y", "field_z", "residual"};
  for (std::size_t j = 0; j < derived_count(reducer, false); ++j) {
    names.emplace_back(reducer.kind().derived_names[j]);
  }
  return names;
}

// a - b; of angles, which names ending in _deg are, the short way round.
double difference(double a, double b, bool angle) {
  return angle ? std::remainder(a - b, 360.0) : a - b;
}

bool is_angle(const Reducer& reducer, Eigen::Index result) {
  return result >= fixed_results &&
         reducer.kind().derived_names[static_cast<std::size_t>(result - fixed_results)].ends_with(
             "_deg");
}

// Change of the results from `below` to `above`, which are `step` away on either side of `at`. Next
// to where an angle gives way to another only one side has it.
Eigen::VectorXd slope(const Reducer& reducer,
                      const Eigen::VectorXd& below,
                      const Eigen::VectorXd& at,
                      const Eigen::VectorXd& above,
                      double step) {
  Eigen::VectorXd result(at.size());
  for (Eigen::Index r = 0; r < at.size(); ++r) {
    const bool angle = is_angle(reducer, r);
    if (std::isnan(at(r))) {
      result(r) = not_a_number;
    } else if (std::isnan(below(r))) {
      result(r) = difference(above(r), at(r), angle) / step;
    } else if (std::isnan(above(r))) {
      result(r) = difference(at(r), below(r), angle) / step;
    } else {
      result(r) =
          (difference(above(r), at(r), angle) + difference(at(r), below(r), angle)) / (2.0 * step);
    }
  }
  return result;
}

}  // namespace

ReadingNoise stated_noise(const Calibration& calibration) {
  ReadingNoise noise;
  if (calibration.uncertainty) {
    noise.resolution = calibration.uncertainty->resolution;
    noise.temperature_u = calibration.uncertainty->temperature_u;
  }
  return noise;
}

ReadingPropagation::ReadingPropagation(const Calibration& calibration,
                                       const Reducer& reducer,
                                       const ReadingNoise& noise,
                                       double factor)
    : calibration_(calibration), reducer_(reducer), noise_(noise), factor_(factor) {
  const Eigen::Index m = calibration.instrument.axis_count();
  covariance_ = parameter_covariance(calibration);
  if (covariance_.size() == 0 || !covariance_.allFinite()) {
    throw DomainError(
        "the record states no covariance of its coefficients (no degrees of freedom were left), so "
        "there is no uncertainty to propagate; calibrate with more readings");
  }
  if (calibration.uncertainty) {
    for (const UncertaintySource& source : calibration.uncertainty->sources) {
      if (source.name == field_magnitude_source) {
        covariance_ -= source.covariance;
        relative_magnitude_u_ = calibration.field.magnitude_u / calibration.field.magnitude;
      }
    }
  }
  sd_ = noise.sd.value_or(calibration.statistics->residual_sd);
  if (sd_.size() != m || !(sd_.array() >= 0.0).all()) {
    throw DomainError(
        "the scatter of a reading is not known; state the standard deviation of a reading for each "
        "axis");
  }
}

Eigen::MatrixXd ReadingPropagation::change_with_parameters(
    const Eigen::Vector3d& field,
    const Eigen::Vector3d* up,
    std::optional<double> temperature) const {
  const FitStatistics& statistics = *calibration_.statistics;
  const Eigen::Index m = calibration_.instrument.axis_count();
  Eigen::MatrixXd B =
      Eigen::MatrixXd::Zero(m, static_cast<Eigen::Index>(statistics.parameter_names.size()));
  const auto put = [&](Eigen::Index axis, const std::string& what, double value) {
    const std::string name = calibration_.instrument.axes[static_cast<std::size_t>(axis)] + what;
    if (const auto at = statistics.position_of(name)) {
      B(axis, *at) = value;
    }
  };
  const auto& terms = calibration_.temperature;
  for (Eigen::Index k = 0; k < m; ++k) {
    const double scale = terms && temperature ? terms->scale_at(k, *temperature) : 1.0;
    put(k, ".bias", 1.0);
    for (int j = 0; j < 3; ++j) {
      const std::string component(1, "xyz"[j]);
      put(k, ".sensitivity." + component, scale * field(j));
      for (const AlsoResponse& also : calibration_.also) {
        put(k, "." + also.kind + "." + component, up != nullptr ? (*up)(j) : 0.0);
      }
    }
    double power = 1.0;
    for (Eigen::Index j = 0; terms && temperature && j < terms->bias.cols(); ++j) {
      power *= *temperature - terms->reference;
      const std::string suffix = power_suffix(static_cast<int>(j) + 1);
      put(k, ".bias" + suffix, power);
      put(k, ".scale" + suffix, power * calibration_.response.sensitivity.row(k).dot(field));
    }
  }
  return B;
}

Eigen::VectorXd ReadingPropagation::reading_variance(const Eigen::Vector3d& field,
                                                     std::optional<double> temperature) const {
  Eigen::VectorXd variance = sd_.cwiseAbs2();
  // A scatter that is smaller than the steps does not show what rounding hides.
  const double steps = noise_.resolution * noise_.resolution / 12.0;
  variance = variance.cwiseMax(steps);
  const auto& terms = calibration_.temperature;
  if (terms && temperature && noise_.temperature_u > 0.0) {
    const double h = noise_.temperature_u;
    const Eigen::VectorXd change = 0.5 * (response_at(calibration_, field, *temperature + h) -
                                          response_at(calibration_, field, *temperature - h));
    variance += change.cwiseAbs2();
  }
  return variance;
}

Eigen::MatrixXd ReadingPropagation::change_with_readings(std::span<const double> readings,
                                                         const Eigen::Vector3d* up,
                                                         std::optional<double> temperature,
                                                         const Eigen::VectorXd& step) const {
  const std::size_t derived = derived_count(reducer_, up != nullptr);
  std::vector<double> moved(readings.begin(), readings.end());
  const auto at = [&](std::size_t k, double by) {
    moved[k] = readings[k] + by;
    Eigen::VectorXd results = results_of(reducer_.reduce(moved, up, temperature), derived);
    moved[k] = readings[k];
    return results;
  };
  const Eigen::VectorXd here = at(0, 0.0);
  Eigen::MatrixXd G(here.size(), static_cast<Eigen::Index>(readings.size()));
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    const double smallest =
        1e-7 * calibration_.response.sensitivity.row(axis).norm() * calibration_.field.magnitude;
    const double h = std::max(step(axis), smallest);
    G.col(axis) = slope(reducer_, at(k, -h), here, at(k, h), h);
  }
  return G;
}

ReducedUncertainty ReadingPropagation::at(std::span<const double> readings,
                                          const Eigen::Vector3d* up,
                                          std::optional<double> temperature,
                                          const Eigen::Matrix3d* up_covariance) const {
  const ReducedReading reduced = reducer_.reduce(readings, up, temperature);
  const Eigen::Vector3d field = reduced.field_in_sensor / factor_;
  const Eigen::MatrixXd B = change_with_parameters(field, up, temperature);
  Eigen::MatrixXd C = B * covariance_ * B.transpose();
  C.diagonal() += reading_variance(field, temperature);
  const Eigen::MatrixXd G =
      change_with_readings(readings, up, temperature, C.diagonal().cwiseSqrt());
  Eigen::VectorXd variance = (G * C).cwiseProduct(G).rowwise().sum();
  if (up != nullptr && up_covariance != nullptr) {
    const std::size_t derived = derived_count(reducer_, true);
    const Eigen::VectorXd here = results_of(reduced, derived);
    Eigen::MatrixXd by_up(here.size(), 3);
    for (int j = 0; j < 3; ++j) {
      const double h = std::max(std::sqrt((*up_covariance)(j, j)), 1e-7 * up->norm());
      const Eigen::Vector3d above = *up + h * Eigen::Vector3d::Unit(j);
      const Eigen::Vector3d below = *up - h * Eigen::Vector3d::Unit(j);
      by_up.col(j) =
          slope(reducer_, results_of(reducer_.reduce(readings, &below, temperature), derived), here,
                results_of(reducer_.reduce(readings, &above, temperature), derived), h);
    }
    variance += (by_up * *up_covariance).cwiseProduct(by_up).rowwise().sum();
  }
  variance.head<3>() += (relative_magnitude_u_ * reduced.field_in_sensor).cwiseAbs2();
  if (reducer_.magnitude() != factor_ * calibration_.field.magnitude) {
    // Readings in a field of another place: only theirs is scaled by the calibration's error.
    variance(3) += std::pow(relative_magnitude_u_ * reduced.field_in_sensor.norm(), 2);
  }
  ReducedUncertainty result;
  result.derived.fill(not_a_number);
  result.field_in_sensor = variance.head<3>().cwiseSqrt();
  result.residual = std::sqrt(variance(3));
  for (Eigen::Index r = fixed_results; r < variance.size(); ++r) {
    result.derived[static_cast<std::size_t>(r - fixed_results)] = std::sqrt(variance(r));
  }
  if (reduced.derived.clamped && reducer_.kind().has_axis_elevation) {
    // Beyond F the arcsine stands still: what is left open there is the angle that u of f_x makes
    // at the pole, cos(angle) = 1 - u / F.
    const double pole_deg =
        std::sqrt(2.0 * result.field_in_sensor.x() / reducer_.magnitude()) * deg_per_rad;
    result.derived[0] = std::max(result.derived[0], pole_deg);
  }
  return result;
}

Eigen::Matrix3d ReadingPropagation::field_covariance(std::span<const double> readings,
                                                     std::optional<double> temperature) const {
  const Eigen::Vector3d reduced = reducer_.reduce(readings, nullptr, temperature).field_in_sensor;
  const Eigen::Vector3d field = reduced / factor_;
  const Eigen::MatrixXd B = change_with_parameters(field, nullptr, temperature);
  Eigen::MatrixXd C = B * covariance_ * B.transpose();
  C.diagonal() += reading_variance(field, temperature);
  const Eigen::MatrixXd G =
      change_with_readings(readings, nullptr, temperature, C.diagonal().cwiseSqrt()).topRows<3>();
  return G * C * G.transpose() +
         relative_magnitude_u_ * relative_magnitude_u_ * reduced * reduced.transpose();
}

ReadingPropagation::Axis ReadingPropagation::at_axis(std::size_t axis,
                                                     double reading,
                                                     std::optional<double> temperature) const {
  const auto k = static_cast<Eigen::Index>(axis);
  const ReducedAxis reduced = reducer_.reduce_axis(axis, reading, temperature);
  const double component = reduced.component / factor_;
  const double F = calibration_.field.magnitude;
  const Eigen::Vector3d S = calibration_.response.sensitivity.row(k);
  const Eigen::Vector3d along = S.normalized();
  // The field across the axis may point anywhere: the mean over its directions.
  const double across = std::sqrt(std::max(0.0, 0.5 * (F * F - component * component)));
  const Eigen::Vector3d first = along.unitOrthogonal();
  const Eigen::Vector3d second = along.cross(first);
  double variance = 0.0;
  const Eigen::RowVectorXd b =
      change_with_parameters(component * along, nullptr, temperature).row(k);
  variance += b.dot(covariance_ * b.transpose());
  const Eigen::RowVectorXd zero =
      change_with_parameters(Eigen::Vector3d::Zero(), nullptr, temperature).row(k);
  for (const Eigen::Vector3d& side : {first, second}) {
    const Eigen::RowVectorXd c =
        change_with_parameters(across * side, nullptr, temperature).row(k) - zero;
    variance += c.dot(covariance_ * c.transpose());
  }
  variance += reading_variance(component * along, temperature)(k);
  const double scale = calibration_.temperature && temperature
                           ? calibration_.temperature->scale_at(k, *temperature)
                           : 1.0;
  const double u = std::sqrt(variance) / (std::abs(scale) * S.norm());
  Axis result;
  result.component = factor_ * std::hypot(u, relative_magnitude_u_ * std::abs(component));
  // Over a step of its uncertainty, as beyond F there is no angle.
  const double high = elevation_of_axis(component + u, F).angle_rad;
  const double low = elevation_of_axis(component - u, F).angle_rad;
  result.angle_rad = 0.5 * (high - low);
  return result;
}

// ---- budgets ----

/// Puts a budget together from what the propagation knows.
class AttitudeBudgetMaker {
 public:
  AttitudeBudgetMaker(const Calibration& calibration,
                      const ReductionOptions& options,
                      const ReadingNoise& noise,
                      const Eigen::Vector3d& field,
                      std::optional<double> temperature)
      : calibration_(calibration),
        reducer_(calibration, one_pair_of_angles(calibration, options, field)),
        propagation_(calibration, reducer_, noise, options.factor),
        noise_(noise),
        field_(field),
        temperature_(temperature) {
    if (!reducer_.gives_components()) {
      throw DomainError("attitude_budget: fewer than three axes give angles of each axis only");
    }
    if (calibration.temperature && !temperature_) {
      temperature_ = calibration.temperature->reference;
    }
    const Eigen::VectorXd v = response_at(calibration, field, temperature_);
    readings_.assign(v.begin(), v.end());
  }

  [[nodiscard]] AttitudeBudget budget() const {
    AttitudeBudget result;
    const bool has_budget = calibration_.uncertainty.has_value();
    if (has_budget) {
      for (const UncertaintySource& source : calibration_.uncertainty->sources) {
        result.sources.push_back(source.name);
      }
    } else {
      result.sources.emplace_back("fit");
    }
    result.sources.emplace_back("reading");
    const Eigen::MatrixXd B = propagation_.change_with_parameters(field_, nullptr, temperature_);
    const Eigen::VectorXd own = propagation_.reading_variance(field_, temperature_);
    const Eigen::MatrixXd C = B * propagation_.covariance_ * B.transpose();
    const Eigen::MatrixXd G = propagation_.change_with_readings(readings_, nullptr, temperature_,
                                                                (C.diagonal() + own).cwiseSqrt());
    const Eigen::VectorXd here = results_of(reducer_.reduce(readings_, nullptr, temperature_),
                                            derived_count(reducer_, false));
    const std::vector<std::string> names = result_names(reducer_);
    for (Eigen::Index r = 0; r < here.size(); ++r) {
      if (std::isnan(here(r))) {
        continue;
      }
      AttitudeQuantity quantity{.name = names[static_cast<std::size_t>(r)], .value = here(r)};
      VarianceShares shares;
      // A larger parameter makes the same reading mean less field.
      const bool free_of_magnitude = r >= 3;
      const Calibration& used = calibration_;
      CombinedUncertainty from_calibration = propagate(used, -G.row(r) * B, &shares);
      if (free_of_magnitude && has_budget) {
        drop_magnitude(-G.row(r) * B, from_calibration, shares);
      }
      const Eigen::VectorXd by_reading = G.row(r).transpose().cwiseAbs2().cwiseProduct(own);
      add_readings(by_reading, shares);
      quantity.uncertainty = combine(shares, calibration_.statistics->degrees_of_freedom);
      quantity.uncertainty.by_source = std::move(from_calibration.by_source);
      quantity.uncertainty.by_source.push_back(std::sqrt(by_reading.sum()));
      result.quantities.push_back(std::move(quantity));
    }
    return result;
  }

  [[nodiscard]] std::vector<MonteCarloCheck> monte_carlo(int trials, std::uint64_t seed) const;

 private:
  // Roll and yaw must not take turns around an attitude.
  static ReductionOptions one_pair_of_angles(const Calibration& calibration,
                                             ReductionOptions options,
                                             const Eigen::Vector3d& field) {
    const bool yaw = std::abs(field.x()) >=
                     calibration.field.magnitude * std::sin(options.inclination.yaw_above_rad);
    options.inclination.yaw_above_rad = yaw ? 0.0 : 2.0;
    return options;
  }

  void drop_magnitude(const Eigen::RowVectorXd& gradient,
                      CombinedUncertainty& from_calibration,
                      VarianceShares& shares) const {
    const auto& sources = calibration_.uncertainty->sources;
    for (std::size_t s = 0; s < sources.size(); ++s) {
      if (sources[s].name == field_magnitude_source) {
        shares.others -= gradient.dot(sources[s].covariance * gradient.transpose());
        from_calibration.by_source[s] = 0.0;
      }
    }
    shares.others = std::max(shares.others, 0.0);
  }

  // Noise that the fit's scatter tells shares its degrees of freedom.
  void add_readings(const Eigen::VectorXd& by_reading, VarianceShares& shares) const {
    if (noise_.sd) {
      shares.others += by_reading.sum();
    } else {
      shares.by_axis += by_reading;
    }
  }

  const Calibration& calibration_;
  Reducer reducer_;
  ReadingPropagation propagation_;
  ReadingNoise noise_;
  Eigen::Vector3d field_;
  std::optional<double> temperature_;
  std::vector<double> readings_;
};

std::vector<MonteCarloCheck> AttitudeBudgetMaker::monte_carlo(int trials,
                                                              std::uint64_t seed) const {
  const FitStatistics& statistics = *calibration_.statistics;
  const Eigen::MatrixXd B = propagation_.change_with_parameters(field_, nullptr, temperature_);
  const Eigen::VectorXd own = propagation_.reading_variance(field_, temperature_).cwiseSqrt();
  const Eigen::Index m = own.size();
  // The fit's part as t of each axis's degrees of freedom; all else normal.
  Eigen::MatrixXd fit = statistics.covariance;
  Eigen::MatrixXd others = propagation_.covariance_ - fit;
  const Eigen::MatrixXd fit_root = covariance_root(B * fit * B.transpose());
  const Eigen::MatrixXd others_root = covariance_root(B * others * B.transpose());
  const std::size_t derived = derived_count(reducer_, false);
  const Eigen::VectorXd here =
      results_of(reducer_.reduce(readings_, nullptr, temperature_), derived);
  std::vector<std::vector<double>> errors(static_cast<std::size_t>(here.size()));
  RandomStream random(seed);
  const auto normals = [&](Eigen::Index n) {
    Eigen::VectorXd z(n);
    for (double& value : z) {
      value = random.normal();
    }
    return z;
  };
  // sqrt(nu / chi^2) turns a normal into t; nu need not be whole, so chi^2 by its quantile.
  const auto t_factor = [&](Eigen::Index k) {
    const double nu = statistics.degrees_of_freedom(k);
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
      factor(k) = t_factor(k);
    }
    Eigen::VectorXd change = factor.cwiseProduct(fit_root * normals(m));
    change += others_root * normals(m);
    const Eigen::VectorXd noise = own.cwiseProduct(normals(m));
    change += noise_.sd ? noise : Eigen::VectorXd(factor.cwiseProduct(noise));
    for (std::size_t k = 0; k < moved.size(); ++k) {
      moved[k] = readings_[k] + change(static_cast<Eigen::Index>(k));
    }
    const Eigen::VectorXd results =
        results_of(reducer_.reduce(moved, nullptr, temperature_), derived);
    for (Eigen::Index r = 0; r < here.size(); ++r) {
      errors[static_cast<std::size_t>(r)].push_back(
          difference(results(r), here(r), is_angle(reducer_, r)));
    }
  }
  std::vector<MonteCarloCheck> checks;
  std::size_t at = 0;
  const AttitudeBudget linear = budget();
  for (Eigen::Index r = 0; r < here.size(); ++r) {
    std::vector<double>& own_errors = errors[static_cast<std::size_t>(r)];
    if (std::isnan(here(r))) {
      continue;
    }
    const AttitudeQuantity& quantity = linear.quantities[at++];
    const Eigen::Map<const Eigen::VectorXd> all(own_errors.data(), trials);
    MonteCarloCheck check{.name = quantity.name,
                          .linear_u = quantity.uncertainty.u,
                          .linear_expanded = quantity.uncertainty.expanded,
                          .mean_error = all.mean()};
    check.sd = std::sqrt((all.array() - check.mean_error).square().sum() / (trials - 1));
    std::sort(own_errors.begin(), own_errors.end());
    const auto quantile = [&](double p) {
      return own_errors[static_cast<std::size_t>(p * (trials - 1))];
    };
    check.low_95 = quantile(0.025);
    check.high_95 = quantile(0.975);
    constexpr double tolerance =
        0.1;  // in parts of U; effective degrees of freedom alone make up to 5 %
    check.agrees =
        std::abs(check.low_95 + check.linear_expanded) <= tolerance * check.linear_expanded &&
        std::abs(check.high_95 - check.linear_expanded) <= tolerance * check.linear_expanded;
    checks.push_back(check);
  }
  return checks;
}

AttitudeBudget attitude_budget(const Calibration& calibration,
                               const ReductionOptions& options,
                               const ReadingNoise& noise,
                               const Eigen::Vector3d& field_in_sensor,
                               std::optional<double> temperature) {
  return AttitudeBudgetMaker(calibration, options, noise, field_in_sensor, temperature).budget();
}

Eigen::Vector3d field_of_attitude(const Calibration& calibration,
                                  double pitch_rad,
                                  double roll_rad) {
  const double c = std::cos(pitch_rad);
  const Eigen::Vector3d up(std::sin(pitch_rad), c * std::sin(roll_rad), c * std::cos(roll_rad));
  const bool frd = calibration.instrument.convention == AxisConvention::forward_right_down;
  return calibration.field.magnitude * (frd ? Eigen::Vector3d(up.x(), -up.y(), -up.z()) : up);
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
    throw DomainError("check_by_monte_carlo: at least 1000 trials tell anything");
  }
  return AttitudeBudgetMaker(calibration, options, noise, field_in_sensor, temperature)
      .monte_carlo(trials, seed);
}

}  // namespace axiscal
