// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/reading_uncertainty.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/units.hpp"
#include "calib/apply/src/reduced_results.hpp"
#include "calib/record/parameter_names.hpp"
#include "calib/regression/factor.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Adds the variances of `more` to those of `shares`, source by source. Both arguments must have the
// same sources.
void add(const VarianceShares& more, VarianceShares& shares) {
  for (std::size_t i = 0; i < shares.axes.size(); ++i) {
    shares.axes[i].variance += more.axes[i].variance;
  }
  for (std::size_t i = 0; i < shares.components.size(); ++i) {
    shares.components[i].variance += more.components[i].variance;
  }
  shares.others += more.others;
}

double variance_of(const VarianceShares& shares) {
  double sum = shares.others;
  for (const auto* const all : {&shares.axes, &shares.components}) {
    for (const VarianceShare& share : *all) {
      sum += share.variance;
    }
  }
  return sum;
}

// Returns the uncertainty of the elevation of an axis [rad] if the measured component along the
// axis exceeds F. The derivative cannot be used there, because the argument of the arcsine is
// clamped. The result is approximately the angle whose cosine is 1 - u / F: the angle between the
// axis and a field of length F whose component along the axis is F - u.
double angle_at_pole(double u, double F) {
  return std::sqrt(2.0 * u / F);
}

}  // namespace

ReadingNoise stated_noise(const Calibration& calibration) {
  ReadingNoise noise;
  if (calibration.fit.uncertainty) {
    noise.resolution = calibration.fit.uncertainty->resolution;
    noise.temperature_u = calibration.fit.uncertainty->temperature_u;
  }
  return noise;
}

Eigen::MatrixXd change_with_parameters(const Calibration& calibration,
                                       const Eigen::Vector3d& field,
                                       const ReadingContext& context) {
  if (!calibration.fit.statistics) {
    throw DomainError("change_with_parameters: the record lacks statistics");
  }
  const FitStatistics& statistics = *calibration.fit.statistics;
  const Eigen::Index m = calibration.sensor.instrument.axis_count();
  Eigen::MatrixXd B =
      Eigen::MatrixXd::Zero(m, static_cast<Eigen::Index>(statistics.parameter_names.size()));
  const auto put = [&](Eigen::Index axis, const std::string& what, double value) {
    const std::string name =
        calibration.sensor.instrument.axes[static_cast<std::size_t>(axis)] + what;
    if (const auto at = statistics.position_of(name)) {
      B(axis, *at) = value;
    }
  };
  const auto& terms = calibration.sensor.temperature;
  const std::optional<SensorTemperature>& temperature = context.temperature;
  for (Eigen::Index k = 0; k < m; ++k) {
    const double scale = terms && temperature ? terms->scale_at(k, temperature->of(k)) : 1.0;
    put(k, ".bias", 1.0);
    for (int j = 0; j < 3; ++j) {
      const std::string component(1, "xyz"[j]);
      put(k, ".sensitivity." + component, scale * field(j));
      for (const AlsoResponse& also : calibration.sensor.also) {
        put(k, formatted(".{}.{}", also.kind, component), context.up ? (*context.up)(j) : 0.0);
      }
    }
    double power = 1.0;
    for (Eigen::Index j = 0; terms && temperature && j < terms->bias.cols(); ++j) {
      power *= temperature->of(k) - terms->span_of(k).reference;
      const std::string suffix = power_suffix(static_cast<int>(j) + 1);
      put(k, ".bias" + suffix, power);
      put(k, ".scale" + suffix, power * calibration.sensor.response.sensitivity.row(k).dot(field));
    }
  }
  return B;
}

ReadingPropagation::ReadingPropagation(const Calibration& calibration,
                                       const Reducer& reducer,
                                       const ReadingNoise& noise,
                                       double factor,
                                       double probability)
    : calibration_(calibration),
      reducer_(reducer),
      noise_(noise),
      factor_(factor),
      factors_(probability) {
  const Eigen::Index m = calibration.sensor.instrument.axis_count();
  covariance_ = parameter_covariance(calibration);
  if (covariance_.size() == 0 || !covariance_.allFinite()) {
    throw DomainError(
        "the record lacks the covariance of its coefficients (zero degrees of freedom), so the "
        "uncertainty cannot be propagated; calibrate with more readings");
  }
  if (calibration.fit.uncertainty) {
    for (const UncertaintySource& source : calibration.fit.uncertainty->sources) {
      if (source.name == field_magnitude_source) {
        covariance_ -= source.covariance;
        component_u_ = calibration.sensor.field.magnitude_u / calibration.sensor.field.magnitude;
      }
    }
  }
  of_readings_ = calibration.fit.statistics->covariance_of_readings();
  of_inputs_ = covariance_ - calibration.fit.statistics->covariance;
  for (const ScatterComponent& component : calibration.fit.statistics->components) {
    components_.push_back(
        {.covariance = component.covariance, .degrees_of_freedom = component.degrees_of_freedom});
  }
  sd_ = noise.sd.value_or(calibration.fit.statistics->residual_sd);
  if (sd_.size() != m || !(sd_.array() >= 0.0).all()) {
    throw DomainError(
        "the scatter of a reading is not known; give the standard deviation of a reading for each "
        "axis");
  }
  find_scatter_of_blocks();
}

Eigen::VectorXd ReadingPropagation::reading_variance(
    const Eigen::Vector3d& field, const std::optional<SensorTemperature>& temperature) const {
  Eigen::VectorXd variance = sd_.cwiseAbs2();
  // The variance is at least that of rounding, because rounded readings may show no scatter.
  const double steps = noise_.resolution * noise_.resolution / 12.0;
  variance = variance.cwiseMax(steps);
  const auto& terms = calibration_.sensor.temperature;
  if (terms && temperature && noise_.temperature_u > 0.0) {
    const double h = noise_.temperature_u;
    const Eigen::VectorXd change =
        0.5 * (response_at(calibration_.sensor, field, temperature->changed_by(h)) -
               response_at(calibration_.sensor, field, temperature->changed_by(-h)));
    variance += change.cwiseAbs2();
  }
  return variance;
}

Eigen::VectorXd ReadingPropagation::between_blocks(const Eigen::Vector3d& field) const {
  Eigen::VectorXd variance = block_variance_.col(0);
  for (int l = 0; l < 3; ++l) {
    variance += field(l) * field(l) * block_variance_.col(1 + l);
  }
  return variance;
}

void ReadingPropagation::find_scatter_of_blocks() {
  const CalibrationConditions& conditions = calibration_.fit.conditions;
  const std::vector<std::string>& axes = calibration_.sensor.instrument.axes;
  const auto m = static_cast<Eigen::Index>(axes.size());
  block_variance_ = Eigen::MatrixXd::Zero(m, 4);
  const double B = conditions.blocks;
  const auto put = [&](Eigen::Index k, Eigen::Index j, const std::string& name, double square) {
    const auto at =
        calibration_.fit.statistics->position_of(axes[static_cast<std::size_t>(k)] + name);
    // The noise of the readings contributes to the scatter of the block means, so it is subtracted.
    const double by_noise = at ? B * of_readings_(*at, *at) : 0.0;
    block_variance_(k, j) = std::max(square - by_noise, 0.0);
  };
  for (Eigen::Index k = 0; k < m && conditions.block_mean_square.size() == m; ++k) {
    put(k, 0, ".bias", conditions.block_mean_square(k));
    block_freedom_ = conditions.block_degrees_of_freedom;
  }
  for (Eigen::Index k = 0; k < m && conditions.sensitivity_mean_square.rows() == m; ++k) {
    for (int l = 0; l < 3; ++l) {
      put(k, 1 + l, formatted(".sensitivity.{}", "xyz"[l]),
          conditions.sensitivity_mean_square(k, l));
    }
    block_freedom_ = conditions.sensitivity_degrees_of_freedom;
  }
}

void ReadingPropagation::add_blocks(const Eigen::RowVectorXd& gradient,
                                    const Eigen::VectorXd& between,
                                    VarianceShares& shares) const {
  const double variance = gradient.cwiseAbs2().dot(between);
  if (block_freedom_ > 0.0) {
    shares.components.push_back({.variance = variance, .degrees_of_freedom = block_freedom_});
  }
}

Eigen::MatrixXd ReadingPropagation::change_with_readings(std::span<const double> readings,
                                                         const ReadingContext& context,
                                                         const Eigen::VectorXd& step) const {
  const std::size_t derived = derived_count(reducer_, context.up.has_value());
  std::vector<double> moved(readings.begin(), readings.end());
  const auto at = [&](std::size_t k, double by) {
    moved[k] = readings[k] + by;
    Eigen::VectorXd results = results_of(reducer_.reduce(moved, context), derived);
    moved[k] = readings[k];
    return results;
  };
  const Eigen::VectorXd here = at(0, 0.0);
  Eigen::MatrixXd G(here.size(), static_cast<Eigen::Index>(readings.size()));
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    const double smallest = 1e-7 * calibration_.sensor.response.sensitivity.row(axis).norm() *
                            calibration_.sensor.field.magnitude;
    const double h = std::max(step(axis), smallest);
    G.col(axis) = slope_of_results(reducer_, at(k, -h), here, at(k, h), h);
  }
  return G;
}

VarianceShares ReadingPropagation::shares_of(const Eigen::RowVectorXd& gradient,
                                             const Eigen::MatrixXd& B,
                                             const Eigen::VectorXd& reading_variance) const {
  const Eigen::VectorXd& nu = calibration_.fit.statistics->degrees_of_freedom;
  const Eigen::RowVectorXd g = gradient * B;
  const auto variance = [&](const Eigen::MatrixXd& covariance) {
    return g.dot(covariance * g.transpose());
  };
  VarianceShares shares{.others = variance(of_inputs_)};
  for (const Part& part : components_) {
    shares.components.push_back(
        {.variance = variance(part.covariance), .degrees_of_freedom = part.degrees_of_freedom});
  }
  // The fitted direction of the field is common to all axes, so their errors are correlated.
  // Therefore the total variance is divided among the axes, in proportion to the variances that the
  // axes would have without correlation.
  const Eigen::VectorXd own =
      gradient.transpose().cwiseAbs2().cwiseProduct((B * of_readings_ * B.transpose()).diagonal());
  const double factor = own.sum() > 0.0 ? variance(of_readings_) / own.sum() : 0.0;
  for (Eigen::Index k = 0; k < own.size(); ++k) {
    const double reading = gradient(k) * gradient(k) * reading_variance(k);
    // Stated noise has an infinite number of degrees of freedom.
    shares.others += noise_.sd ? reading : 0.0;
    shares.axes.push_back(
        {.variance = factor * own(k) + (noise_.sd ? 0.0 : reading), .degrees_of_freedom = nu(k)});
  }
  return shares;
}

ReducedUncertainty ReadingPropagation::at(std::span<const double> readings,
                                          const ReadingContext& context) const {
  const ReducedReading reduced = reducer_.reduce(readings, context);
  const Eigen::Vector3d field = reduced.field_in_sensor / factor_;
  const Eigen::MatrixXd B = change_with_parameters(field, context);
  const Eigen::VectorXd own = reading_variance(field, context.temperature);
  const Eigen::VectorXd u_readings =
      ((B * covariance_ * B.transpose()).diagonal() + own).cwiseSqrt();
  const Eigen::MatrixXd G = change_with_readings(readings, context, u_readings);
  const Eigen::VectorXd between = between_blocks(field);
  std::vector<VarianceShares> shares;
  for (Eigen::Index r = 0; r < G.rows(); ++r) {
    shares.push_back(shares_of(G.row(r), B, own));
    add_blocks(G.row(r), between, shares.back());
  }
  if (context.up && context.up_covariance) {
    const Eigen::Vector3d& up = *context.up;
    const Eigen::Matrix3d& up_covariance = *context.up_covariance;
    const std::size_t derived = derived_count(reducer_, true);
    const Eigen::VectorXd here = results_of(reduced, derived);
    Eigen::MatrixXd by_up(here.size(), 3);
    for (int j = 0; j < 3; ++j) {
      const double h = std::max(std::sqrt(up_covariance(j, j)), 1e-7 * up.norm());
      const auto with_up = [&](double by) {
        const ReadingContext moved{.up = up + by * Eigen::Vector3d::Unit(j),
                                   .temperature = context.temperature,
                                   .up_covariance = {}};
        return results_of(reducer_.reduce(readings, moved), derived);
      };
      by_up.col(j) = slope_of_results(reducer_, with_up(-h), here, with_up(h), h);
    }
    Eigen::VectorXd more = (by_up * up_covariance).cwiseProduct(by_up).rowwise().sum();
    for (const CubeError& error : cube_errors_) {
      const Eigen::VectorXd by_field = G * (error.of_sensitivity * field);
      more += 2.0 * by_field.cwiseProduct(by_up * (error.of_field * up));
    }
    for (Eigen::Index r = 0; r < more.size(); ++r) {
      double& others = shares[static_cast<std::size_t>(r)].others;
      others = std::max(others + more(r), 0.0);
    }
  }
  add_magnitude(reduced, readings, context, shares);
  ReducedUncertainty result;
  result.derived.fill(not_a_number);
  result.expanded.derived.fill(not_a_number);
  for (std::size_t r = 0; r < shares.size(); ++r) {
    const double u = std::sqrt(variance_of(shares[r]));
    const double U = factors_.expanded(shares[r]);
    if (r < 3) {
      result.field_in_sensor(static_cast<Eigen::Index>(r)) = u;
      result.expanded.field_in_sensor(static_cast<Eigen::Index>(r)) = U;
    } else if (r == 3) {
      result.residual = u;
      result.expanded.residual = U;
    } else {
      result.derived[r - fixed_results] = u;
      result.expanded.derived[r - fixed_results] = U;
    }
  }
  if (reduced.derived.clamped && reducer_.kind().has_axis_elevation) {
    put_pole(result);
  }
  return result;
}

// Adds the uncertainty of the field's magnitude. An error of the magnitude at the calibration
// scales the components. Residuals and angles also depend on F, the magnitude at the place of the
// readings.
void ReadingPropagation::add_magnitude(const ReducedReading& reduced,
                                       std::span<const double> readings,
                                       const ReadingContext& context,
                                       std::vector<VarianceShares>& shares) const {
  for (int j = 0; j < 3; ++j) {
    shares[static_cast<std::size_t>(j)].others +=
        std::pow(component_u_ * reduced.field_in_sensor(j), 2);
  }
  const double ratio = ratio_u_;
  shares[3].others += std::pow(ratio * reduced.field_in_sensor.norm(), 2);
  if (!(ratio > 0.0) || shares.size() <= fixed_results) {
    return;
  }
  // A relative error of F has the same effect on the angles, except for the sign, as an equal
  // relative change of the measured field.
  const std::size_t derived = derived_count(reducer_, context.up.has_value());
  const auto scaled = [&](double factor) {
    const Eigen::VectorXd v = response_at(
        calibration_.sensor, factor * reduced.field_in_sensor / factor_, context.temperature);
    return results_of(reducer_.reduce({v.data(), static_cast<std::size_t>(v.size())}, context),
                      derived);
  };
  const Eigen::VectorXd here = results_of(reducer_.reduce(readings, context), derived);
  const Eigen::VectorXd change =
      slope_of_results(reducer_, scaled(1.0 - ratio), here, scaled(1.0 + ratio), 1.0);
  for (Eigen::Index r = fixed_results; r < change.size(); ++r) {
    shares[static_cast<std::size_t>(r)].others += change(r) * change(r);
  }
}

void ReadingPropagation::put_pole(ReducedUncertainty& result) const {
  const auto angle_deg = [&](double u) {
    return angle_at_pole(u, reducer_.magnitude()) * deg_per_rad;
  };
  result.derived[0] = std::max(result.derived[0], angle_deg(result.field_in_sensor.x()));
  result.expanded.derived[0] =
      std::max(result.expanded.derived[0], angle_deg(result.expanded.field_in_sensor.x()));
}

void ReadingPropagation::share_cube() {
  cube_errors_.clear();
  if (!calibration_.fit.uncertainty) {
    return;
  }
  const auto& sources = calibration_.fit.uncertainty->sources;
  const auto source =
      std::find_if(sources.begin(), sources.end(),
                   [](const UncertaintySource& one) { return one.name == "positioner"; });
  if (source == sources.end() || source->covariance.size() == 0) {
    return;
  }
  const SensitivityMatrix& S = calibration_.sensor.response.sensitivity;
  std::vector<Eigen::Index> places;
  for (const std::string& axis : calibration_.sensor.instrument.axes) {
    for (const char component : {'x', 'y', 'z'}) {
      const auto at =
          calibration_.fit.statistics->position_of(formatted("{}.sensitivity.{}", axis, component));
      if (!at) {
        return;
      }
      places.push_back(*at);
    }
  }
  const Eigen::MatrixXd root = covariance_root(source->covariance(places, places));
  const Eigen::MatrixXd inverse = pseudo_inverse(S);
  for (Eigen::Index j = 0; j < root.cols(); ++j) {
    CubeError error{.of_sensitivity = SensitivityMatrix(S.rows(), 3), .of_field = {}};
    for (Eigen::Index k = 0; k < S.rows(); ++k) {
      error.of_sensitivity.row(k) = root.col(j).segment<3>(3 * k).transpose();
    }
    error.of_field = inverse * error.of_sensitivity;
    cube_errors_.push_back(error);
  }
}

ReadingPropagation::LengthChange ReadingPropagation::length_change(
    std::span<const double> readings, const std::optional<SensorTemperature>& temperature) const {
  const ReadingContext context{.temperature = temperature};
  const Eigen::Vector3d field = reducer_.reduce(readings, context).field_in_sensor / factor_;
  const Eigen::MatrixXd B = change_with_parameters(field, context);
  const Eigen::VectorXd own = reading_variance(field, temperature);
  const Eigen::MatrixXd G =
      change_with_readings(readings, context, own.cwiseSqrt()).topRows<3>() / factor_;
  LengthChange change{.length = field.norm(), .direction = field.normalized()};
  const Eigen::RowVectorXd by_readings = change.direction.transpose() * G;
  change.by_parameters = -by_readings * B;
  change.reading_variance = by_readings.cwiseAbs2().dot(own);
  return change;
}

Eigen::Matrix3d ReadingPropagation::field_covariance(
    std::span<const double> readings, const std::optional<SensorTemperature>& temperature) const {
  const ReadingContext context{.temperature = temperature};
  const Eigen::Vector3d reduced = reducer_.reduce(readings, context).field_in_sensor;
  const Eigen::Vector3d field = reduced / factor_;
  const Eigen::MatrixXd B = change_with_parameters(field, context);
  Eigen::MatrixXd C = B * covariance_ * B.transpose();
  C.diagonal() += reading_variance(field, temperature) + between_blocks(field);
  const Eigen::MatrixXd G =
      change_with_readings(readings, context, C.diagonal().cwiseSqrt()).topRows<3>();
  return G * C * G.transpose() + component_u_ * component_u_ * reduced * reduced.transpose();
}

ReadingPropagation::Axis ReadingPropagation::at_axis(
    std::size_t axis, double reading, const std::optional<SensorTemperature>& temperature) const {
  const auto k = static_cast<Eigen::Index>(axis);
  const ReducedAxis reduced = reducer_.reduce_axis(axis, reading, temperature);
  const double component = reduced.component / factor_;
  const double F = reducer_.magnitude() / factor_;  // magnitude at the place of the reading
  const Eigen::Vector3d S = calibration_.sensor.response.sensitivity.row(k);
  const Eigen::Vector3d along = S.normalized();
  // The direction of the field's component across the axis is unknown, so the variance that this
  // component causes is averaged over all directions.
  const double across = std::sqrt(std::max(0.0, 0.5 * (F * F - component * component)));
  const Eigen::Vector3d first = along.unitOrthogonal();
  const Eigen::Vector3d second = along.cross(first);
  const Eigen::RowVectorXd unit =
      Eigen::RowVectorXd::Unit(calibration_.sensor.instrument.axis_count(), k);
  VarianceShares shares =
      shares_of(unit, change_with_parameters(component * along, {.temperature = temperature}),
                reading_variance(component * along, temperature));
  const Eigen::MatrixXd zero =
      change_with_parameters(Eigen::Vector3d::Zero(), {.temperature = temperature});
  const Eigen::VectorXd no_noise = Eigen::VectorXd::Zero(unit.size());
  for (const Eigen::Vector3d& side : {first, second}) {
    add(shares_of(unit, change_with_parameters(across * side, {.temperature = temperature}) - zero,
                  no_noise),
        shares);
  }
  add_blocks(unit, between_blocks(component * along), shares);
  const double variance = variance_of(shares);
  const double scale = calibration_.sensor.temperature && temperature
                           ? calibration_.sensor.temperature->scale_at(k, temperature->of(k))
                           : 1.0;
  const double u = std::sqrt(variance) / (std::abs(scale) * S.norm());
  Axis result;
  result.component = factor_ * std::hypot(u, component_u_ * std::abs(component));
  result.coverage_factor = variance > 0.0
                               ? factors_.expanded(shares) / std::sqrt(variance)
                               : factors_.at(calibration_.fit.statistics->degrees_of_freedom(k));
  // The derivative of the arcsine is infinite if the component is F. Therefore the angle's
  // uncertainty is half the difference between the angles for the component plus and minus its
  // uncertainty.
  const double of_angle = std::hypot(u, ratio_u_ * component);
  const double high = elevation_of_axis(component + of_angle, F).angle_rad;
  const double low = elevation_of_axis(component - of_angle, F).angle_rad;
  result.angle_rad = 0.5 * (high - low);
  if (std::abs(component) >= F) {
    result.angle_rad = std::max(result.angle_rad, angle_at_pole(of_angle, F));
  }
  return result;
}

double direction_uncertainty_deg(const Calibration& calibration,
                                 const ReadingPropagation& propagation,
                                 const Eigen::Vector3d& direction) {
  const double F = calibration.sensor.field.magnitude;
  const Eigen::VectorXd v = response_at(calibration.sensor, F * direction, std::nullopt);
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - direction * direction.transpose();
  const Eigen::Matrix3d covariance =
      across * propagation.field_covariance({v.data(), static_cast<std::size_t>(v.size())}) *
      across;
  const double variance = symmetric_eigen(covariance).values.maxCoeff();
  const double k = calibration.fit.statistics->coverage_factor.maxCoeff();
  return k * std::sqrt(std::max(0.0, variance)) / F * deg_per_rad;
}

}  // namespace axiscal
