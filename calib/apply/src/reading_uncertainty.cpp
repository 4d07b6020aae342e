// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/reading_uncertainty.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "axiscal/calib/parameter_names.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/units.hpp"
#include "reduced_results.hpp"

namespace axiscal {
namespace {

// Change of the results from `below` to `above`, which are `step` away on either side of `at`. Next
// to where an angle gives way to another only one side has it.
Eigen::VectorXd slope(const Reducer& reducer,
                      const Eigen::VectorXd& below,
                      const Eigen::VectorXd& at,
                      const Eigen::VectorXd& above,
                      double step) {
  Eigen::VectorXd result(at.size());
  for (Eigen::Index r = 0; r < at.size(); ++r) {
    const bool angle = result_is_angle(reducer, r);
    if (std::isnan(at(r))) {
      result(r) = not_a_number;
    } else if (std::isnan(below(r))) {
      result(r) = difference_of_results(above(r), at(r), angle) / step;
    } else if (std::isnan(above(r))) {
      result(r) = difference_of_results(at(r), below(r), angle) / step;
    } else {
      result(r) = (difference_of_results(above(r), at(r), angle) +
                   difference_of_results(at(r), below(r), angle)) /
                  (2.0 * step);
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
        put(k, formatted(".{}.{}", also.kind, component), up != nullptr ? (*up)(j) : 0.0);
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

}  // namespace axiscal
