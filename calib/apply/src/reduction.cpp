// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/reduction.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/kernels/reduce_columns.hpp"
#include "calib/regression/factor.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns a weight for each row of S, from the scatter of the axis. All weights are 1 if the
// scatter is unknown or if there are at most three axes.
Eigen::VectorXd row_weights(const Calibration& calibration) {
  const Eigen::Index m = calibration.sensor.response.bias.size();
  if (m > 3 && calibration.fit.statistics) {
    const Eigen::VectorXd& sd = calibration.fit.statistics->residual_sd;
    if ((sd.array() > 0.0).all()) {
      return sd.cwiseInverse() / sd.cwiseInverse().maxCoeff();
    }
  }
  return Eigen::VectorXd::Ones(m);
}

}  // namespace

Reducer::Reducer(const SensorModel& sensor, const ReductionOptions& options)
    : Reducer(sensor,
              Knowledge{.weights = Eigen::VectorXd::Ones(sensor.response.bias.size())},
              options) {}

Reducer::Reducer(const Calibration& calibration, const ReductionOptions& options, Force force)
    : Reducer(
          (require_unrefused(calibration, force), calibration.sensor),
          Knowledge{.weights = row_weights(calibration), .gives_field = gives_field(calibration)},
          options) {}

Reducer::Reducer(const SensorModel& sensor,
                 const Knowledge& knowledge,
                 const ReductionOptions& options)
    : kind_(&find_instrument_kind(sensor.instrument.kind)),
      magnitude_(options.magnitude.value_or(sensor.field.magnitude)),
      inclination_(options.inclination),
      gives_field_(knowledge.gives_field),
      range_(sensor.instrument.range),
      factor_(options.factor),
      declination_rad_(options.declination_rad) {
  inclination_.convention = sensor.instrument.convention;
  if (!(magnitude_ > 0.0) || !std::isfinite(magnitude_)) {
    throw DomainError("Reducer: the field's magnitude must be positive");
  }
  const SensitivityMatrix& S = sensor.response.sensitivity;
  const Eigen::Index m = S.rows();
  if (m == 0 || sensor.response.bias.size() != m || sensor.instrument.axis_count() != m) {
    throw DomainError("Reducer: bias, sensitivity and axes must have the same number of axes");
  }
  for (Eigen::Index k = 0; k < m; ++k) {
    bias_.push_back(sensor.response.bias(k));
    length_.push_back(S.row(k).norm());
    if (!(length_.back() > 0.0)) {
      throw DomainError(formatted("Reducer: axis '{}' has zero sensitivity",
                                  sensor.instrument.axes[static_cast<std::size_t>(k)]));
    }
  }
  constexpr Eigen::Index most_one_sided = 64;
  if (sensor.also.size() > 1 || (m < 3 && !sensor.also.empty()) ||
      (sensor.instrument.one_sided && m > most_one_sided)) {
    throw DomainError(
        "Reducer: at most one second field is allowed, and only with at least three axes; at most "
        "64 axes may be one-sided");
  }
  one_sided_ = sensor.instrument.one_sided;
  temperature_ = sensor.temperature;
  const Eigen::VectorXd& weights = knowledge.weights;
  const PseudoInverseWithRank of_weighted = pseudo_inverse_with_rank(weights.asDiagonal() * S);
  if (m >= 3 && of_weighted.rank < 3) {
    throw DomainError(
        "Reducer: the axes' sensitivities lie in one plane, so that readings do not determine the "
        "field");
  }
  const Eigen::MatrixXd inverse = of_weighted.inverse * weights.asDiagonal();
  for (Eigen::Index k = 0; k < m; ++k) {
    inverse_.emplace_back(factor_ * inverse.col(k));
    length_[static_cast<std::size_t>(k)] /= factor_;
    if (one_sided_ || (temperature_ && m > 3)) {
      rows_.emplace_back(S.row(k).transpose() / factor_);
      weights_.push_back(weights(k) * weights(k));
    }
  }
  if (m == 2 && kind_->sees_one_side && gives_field_) {
    const Eigen::Vector3d across = Eigen::Vector3d(S.row(0)).cross(Eigen::Vector3d(S.row(1)));
    constexpr double parallel = 1e-6;
    if (across.norm() > parallel * S.row(0).norm() * S.row(1).norm()) {
      open_direction_ = across.normalized();
    }
  }
  for (const AlsoResponse& also : sensor.also) {
    also_.emplace_back(factor_ * (inverse * also.sensitivity));
  }
}

double Reducer::bias_corrected(std::size_t axis,
                               double reading,
                               const std::optional<SensorTemperature>& temperature) const noexcept {
  if (!temperature_ || !temperature) {
    return reading - bias_[axis];
  }
  const auto k = static_cast<Eigen::Index>(axis);
  return temperature_->bias_corrected(k, reading, bias_[axis], temperature->of(k));
}

// Computes the field for more than three axes with temperature terms. The weights of the equations
// depend on the scales of the axes, which depend on the temperature.
bool Reducer::solve_scaled(std::span<const double> readings,
                           const std::optional<SensorTemperature>& temperature,
                           Eigen::Vector3d& field) const noexcept {
  Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
  Eigen::Vector3d c = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    const double scale = temperature ? temperature_->scale_at(axis, temperature->of(axis)) : 1.0;
    const double weight = weights_[k] * scale * scale;
    N += weight * rows_[k] * rows_[k].transpose();
    c += weight * bias_corrected(k, readings[k], temperature) * rows_[k];
  }
  field = N.inverse() * c;
  return field.allFinite();
}

// Solves by least squares, using only the axes that face the light. The first round uses the axes
// whose readings are clearly above the dark reading. Each further round uses the axes that face the
// field found in the previous round.
bool Reducer::solve_light(std::span<const double> readings,
                          const std::optional<SensorTemperature>& temperature,
                          Eigen::Vector3d& field) const noexcept {
  constexpr std::uint64_t one = 1;
  const std::size_t m = std::min<std::size_t>(rows_.size(), 64);
  constexpr double dimmest = 0.02;  // an axis below this fraction of the brightest axis is dark
  double brightest = 0.0;
  for (std::size_t k = 0; k < m; ++k) {
    brightest = std::max(brightest, bias_corrected(k, readings[k], temperature) / length_[k]);
  }
  std::uint64_t lit = 0;
  for (std::size_t k = 0; k < m; ++k) {
    lit |= bias_corrected(k, readings[k], temperature) > dimmest * length_[k] * brightest ? one << k
                                                                                          : 0;
  }
  constexpr int most_rounds = 8;
  for (int round = 0; round < most_rounds; ++round) {
    Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
    Eigen::Vector3d c = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < m; ++k) {
      if ((lit & (one << k)) != 0) {
        N += weights_[k] * rows_[k] * rows_[k].transpose();
        c += weights_[k] * bias_corrected(k, readings[k], temperature) * rows_[k];
      }
    }
    Eigen::Matrix3d inverse;
    bool invertible = false;
    constexpr double singular = 1e-9;
    const double size = std::max(N.trace(), 1e-300);
    (N / size).computeInverseWithCheck(inverse, invertible, singular);
    if (!invertible) {
      return false;
    }
    field = inverse * (c / size);
    std::uint64_t seen = 0;
    for (std::size_t k = 0; k < m; ++k) {
      seen |= rows_[k].dot(field) > dimmest * length_[k] * brightest ? one << k : 0;
    }
    if (seen == lit) {
      break;
    }
    lit = seen;
  }
  return true;
}

double ReducedReading::operator[](std::string_view name) const {
  constexpr std::array<std::string_view, 3> components = {"x", "y", "z"};
  for (std::size_t i = 0; i < components.size(); ++i) {
    if (name == components[i]) {
      return field_in_sensor(static_cast<Eigen::Index>(i));
    }
  }
  if (name == "residual") {
    return residual;
  }
  std::vector<std::string> known = {"x", "y", "z", "residual"};
  for (std::size_t i = 0; i < derived_names.size(); ++i) {
    if (name == derived_names[i]) {
      return derived.values[i];
    }
    known.emplace_back(derived_names[i]);
  }
  throw DomainError(formatted("'{}' is not a value of a reduced reading; the values are {}", name,
                              joined(known)));
}

void Reducer::require_components(Eigen::Index readings) const {
  if (readings != std::ssize(bias_) || !gives_components()) {
    throw DomainError(formatted(
        "Reducer::reduce: the instrument must have at least three axes, and the reading must have "
        "{} values (one for each axis), not {}",
        bias_.size(), readings));
  }
}

bool Reducer::solve(std::span<const double> readings,
                    const ReadingContext& context,
                    Eigen::Vector3d& field) const noexcept {
  const std::optional<SensorTemperature>& temperature = context.temperature;
  field.setZero();
  bool determined = true;
  if (one_sided_) {
    determined = solve_light(readings, temperature, field);
  } else if (!rows_.empty()) {
    determined = solve_scaled(readings, temperature, field);
  } else {
    for (std::size_t k = 0; k < bias_.size(); ++k) {
      field += inverse_[k] * bias_corrected(k, readings[k], temperature);
    }
  }
  if (context.up) {
    for (const Eigen::Matrix3d& also : also_) {
      field -= also * *context.up;
    }
  }
  return determined;
}

ReducedReading Reducer::reduce(std::span<const double> readings,
                               const ReadingContext& context) const {
  require_components(std::ssize(readings));
  ReducedReading result;
  result.determined = solve(readings, context, result.field_in_sensor);
  result.extrapolated =
      temperature_ && context.temperature && temperature_->is_extrapolated(*context.temperature);
  if (!gives_field_) {
    result.residual = not_a_number;
    result.derived.values.fill(not_a_number);
    return result;
  }
  result.residual = result.field_in_sensor.norm() - magnitude_;
  if (kind_->derive != nullptr && (context.up || !kind_->derives_with_attitude)) {
    result.derived_names = kind_->derived_names;
    result.derived = kind_->derive({.field_in_sensor = result.field_in_sensor,
                                    .magnitude = magnitude_,
                                    .inclination = inclination_,
                                    .up = context.up,
                                    .declination_rad = declination_rad_});
  }
  return result;
}

void Reducer::reduce_plain(const Eigen::Ref<const Eigen::MatrixXd>& readings,
                           Eigen::MatrixX3d& fields) const {
  ColumnReduction reduction{.magnitude = magnitude_};
  ReadColumns read;
  WrittenColumns written;
  const auto n = static_cast<std::size_t>(readings.rows());
  for (std::size_t k = 0; k < 3; ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    reduction.bias[k] = bias_[k];
    for (std::size_t j = 0; j < 3; ++j) {
      reduction.inverse[3 * j + k] = inverse_[k](static_cast<Eigen::Index>(j));
    }
    read[k] = {readings.col(column).data(), n};
    written[k] = {fields.col(column).data(), n};
  }
  reduce_columns(reduction, read, written);
}

Eigen::MatrixX3d Reducer::reduce_rows(const Eigen::Ref<const Eigen::MatrixXd>& readings,
                                      const Eigen::Ref<const Eigen::MatrixXd>& temperatures) const {
  require_components(readings.cols());
  const Eigen::Index given = temperatures.cols();
  if (temperatures.size() > 0 &&
      (temperatures.rows() != readings.rows() || (given != 1 && given != readings.cols()))) {
    throw DomainError(
        formatted("Reducer::reduce_rows: the temperatures must have {} rows (one for each reading) "
                  "and one column, or one column for each axis; their size is {} x {}",
                  readings.rows(), temperatures.rows(), given));
  }
  Eigen::MatrixX3d fields(readings.rows(), 3);
  if (std::ssize(bias_) == 3 && !one_sided_ && !temperature_) {
    reduce_plain(readings, fields);
    return fields;
  }
  std::vector<double> row(bias_.size());
  ReadingContext context;
  Eigen::Vector3d field;
  for (Eigen::Index i = 0; i < readings.rows(); ++i) {
    Eigen::VectorXd::Map(row.data(), readings.cols()) = readings.row(i);
    if (given == 1) {
      context.temperature = temperatures(i, 0);
    } else if (given > 1) {
      const Eigen::VectorXd own = temperatures.row(i);
      context.temperature = SensorTemperature(std::vector<double>(own.begin(), own.end()));
    }
    const bool determined = solve(row, context, field);
    fields.row(i) = determined ? field : Eigen::Vector3d::Constant(not_a_number);
  }
  return fields;
}

ReducedAxis Reducer::reduce_axis(
    std::size_t axis,
    double reading,
    const std::optional<SensorTemperature>& temperature) const noexcept {
  ReducedAxis result{.component = bias_corrected(axis, reading, temperature) / length_[axis]};
  result.extrapolated = temperature_ && temperature && temperature_->is_extrapolated(*temperature);
  if (!gives_field_) {
    result.angle_rad = not_a_number;
  } else if (kind_->has_axis_elevation) {
    const AxisElevation elevation = elevation_of_axis(result.component, magnitude_);
    result.angle_rad = elevation.angle_rad;
    result.clamped = elevation.clamped;
  }
  return result;
}

Reducer::ClosedField Reducer::closed_field(
    double first, double second, const std::optional<SensorTemperature>& temperature) const {
  if (!open_direction_) {
    throw DomainError("Reducer::closed_field: needs two axes of a one-sided instrument");
  }
  const Eigen::Vector3d seen = inverse_[0] * bias_corrected(0, first, temperature) +
                               inverse_[1] * bias_corrected(1, second, temperature);
  const double left = magnitude_ * magnitude_ - seen.squaredNorm();
  return {.in_sensor = seen + std::sqrt(std::max(0.0, left)) * *open_direction_,
          .clamped = left < 0.0};
}

}  // namespace axiscal
