// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/drift_check.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/intrinsic.hpp"
#include "axiscal/calib/reading_uncertainty.hpp"
#include "axiscal/calib/reduction.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"
#include "calib/record/parameter_names.hpp"
#include "calib/regression/factor.hpp"
#include "calib/watch/src/block_changes.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

bool states_covariance(const Calibration& calibration) {
  return calibration.fit.statistics && calibration.fit.statistics->covariance.size() > 0 &&
         calibration.fit.statistics->covariance.allFinite();
}

// Returns the record without the sources of uncertainty that both records share.
Calibration without_common(Calibration calibration,
                           bool same_positioner,
                           bool same_field,
                           std::vector<std::string>& notes) {
  if (!calibration.fit.uncertainty) {
    return calibration;
  }
  const auto drop = [&](const char* name, const char* note) {
    auto& sources = calibration.fit.uncertainty->sources;
    const auto before = sources.size();
    std::erase_if(sources, [&](const UncertaintySource& source) { return source.name == name; });
    if (sources.size() < before && std::find(notes.begin(), notes.end(), note) == notes.end()) {
      notes.emplace_back(note);
    }
  };
  if (same_positioner) {
    drop("positioner", "both runs used the same positioner: errors of its face normals cancel");
  }
  if (same_field) {
    drop(field_magnitude_source,
         "both runs took the field from the same source: errors of its magnitude cancel");
  }
  return calibration;
}

// Returns the covariance of the parameters `names`; zero if the record states no covariance.
Eigen::MatrixXd covariance_of(const Calibration& calibration,
                              const std::vector<std::string>& names) {
  const auto p = static_cast<Eigen::Index>(names.size());
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(p, p);
  if (!states_covariance(calibration)) {
    return result;
  }
  const Eigen::MatrixXd all = parameter_covariance(calibration);
  for (Eigen::Index i = 0; i < p; ++i) {
    for (Eigen::Index j = 0; j < p; ++j) {
      const auto a = calibration.fit.statistics->position_of(names[static_cast<std::size_t>(i)]);
      const auto b = calibration.fit.statistics->position_of(names[static_cast<std::size_t>(j)]);
      if (a && b) {
        result(i, j) = all(*a, *b);
      }
    }
  }
  return result;
}

// The contributions of one record to the variance of the difference between two records. They come
// from the scatter of the readings and from each scatter component. Each is a fraction of the
// variance, averaged over the parameters of an axis.
struct Scatter {
  VarianceShare readings;
  std::vector<VarianceShare> components;
};

Scatter scatter_of(const Calibration& calibration,
                   const std::vector<std::string>& names,
                   Eigen::Index axis,
                   const Eigen::VectorXd& variances) {
  if (!states_covariance(calibration)) {
    return {};
  }
  const FitStatistics& statistics = *calibration.fit.statistics;
  const auto share_of = [&](const Eigen::MatrixXd& covariance) {
    double share = 0.0;
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (const auto at = statistics.position_of(names[i])) {
        share += covariance(*at, *at) / variances(static_cast<Eigen::Index>(i)) /
                 static_cast<double>(names.size());
      }
    }
    return share;
  };
  Scatter scatter{.readings = {.variance = share_of(statistics.covariance),
                               .degrees_of_freedom = statistics.degrees_of_freedom(axis)}};
  for (const ScatterComponent& component : statistics.components) {
    const double share = share_of(component.covariance);
    scatter.readings.variance -= share;
    scatter.components.push_back(
        {.variance = share, .degrees_of_freedom = component.degrees_of_freedom});
  }
  constexpr double rounding = 1e-12;
  if (scatter.readings.variance < rounding) {
    scatter.readings.variance = 0.0;
  }
  return scatter;
}

// Returns the degrees of freedom of a difference, by Welch and Satterthwaite's formula.
double freedom_of_difference(const Scatter& before, const Scatter& after, bool pooled) {
  std::vector<VarianceShare> shares = before.components;
  shares.insert(shares.end(), after.components.begin(), after.components.end());
  if (pooled) {  // both records have the same pooled scatter
    shares.push_back({.variance = before.readings.variance + after.readings.variance,
                      .degrees_of_freedom = before.readings.degrees_of_freedom});
  } else {
    shares.push_back(before.readings);
    shares.push_back(after.readings);
  }
  double inverse = 0.0;
  for (const VarianceShare& share : shares) {
    if (share.variance > 0.0) {
      inverse += share.variance * share.variance / share.degrees_of_freedom;
    }
  }
  constexpr double as_good_as_infinite = 1e6;
  return inverse > 0.0 ? 1.0 / inverse : as_good_as_infinite;
}

// Pools the residual scatters of two records, axis by axis. If the two scatters of an axis do not
// differ significantly, both records get the pooled scatter and the sum of the degrees of freedom.
void pool_scatters(Calibration& a, Calibration& b) {
  if (!states_covariance(a) || !states_covariance(b)) {
    return;
  }
  for (Eigen::Index k = 0; k < a.sensor.instrument.axis_count(); ++k) {
    FitStatistics& one = *a.fit.statistics;
    FitStatistics& two = *b.fit.statistics;
    const double s1 = std::pow(one.residual_sd(k), 2);
    const double s2 = std::pow(two.residual_sd(k), 2);
    const double nu1 = one.degrees_of_freedom(k);
    const double nu2 = two.degrees_of_freedom(k);
    if (!(s1 > 0.0) || !(s2 > 0.0) || !(nu1 > 0.0) || !(nu2 > 0.0)) {
      continue;
    }
    const double p = s1 > s2 ? f_upper_p(s1 / s2, nu1, nu2) : f_upper_p(s2 / s1, nu2, nu1);
    constexpr double differ_below = 0.025;
    if (p < differ_below) {
      continue;
    }
    const double pooled = (nu1 * s1 + nu2 * s2) / (nu1 + nu2);
    const std::string prefix = a.sensor.instrument.axes[static_cast<std::size_t>(k)] + ".";
    const auto rescale = [&](FitStatistics& statistics, double factor) {
      const Eigen::MatrixXd of_readings = statistics.covariance_of_readings();
      const Eigen::MatrixXd of_components = statistics.covariance - of_readings;
      statistics.covariance = of_readings;
      for (std::size_t i = 0; i < statistics.parameter_names.size(); ++i) {
        if (statistics.parameter_names[i].starts_with(prefix)) {
          const auto at = static_cast<Eigen::Index>(i);
          statistics.covariance.row(at) *= factor;
          statistics.covariance.col(at) *= factor;
        }
      }
      statistics.covariance += of_components;
      statistics.residual_sd(k) = std::sqrt(pooled);
      statistics.degrees_of_freedom(k) = nu1 + nu2;
    };
    rescale(one, std::sqrt(pooled / s1));
    rescale(two, std::sqrt(pooled / s2));
  }
}

// Returns the calibration with its bias and sensitivity at the temperature t.
Calibration at_temperature(Calibration calibration, const SensorTemperature& t) {
  if (calibration.sensor.temperature) {
    TemperatureResponse& terms = *calibration.sensor.temperature;
    for (Eigen::Index k = 0; k < calibration.sensor.response.bias.size(); ++k) {
      calibration.sensor.response.bias(k) += terms.bias_shift(k, t.of(k));
      calibration.sensor.response.sensitivity.row(k) *= terms.scale_at(k, t.of(k));
    }
  }
  return calibration;
}

double pitch_rad(const Eigen::Vector3d& field) {
  return std::atan2(field.x(), std::hypot(field.y(), field.z()));
}

// Throws DomainError unless the records have the same axes, kind of instrument, field and unit, and
// at least one of them states a covariance.
void require_comparable(const Calibration& old_record, const Calibration& fresh_record) {
  if (old_record.sensor.instrument.axes != fresh_record.sensor.instrument.axes) {
    throw DomainError(formatted("the records have different axes: {} and {}",
                                joined(old_record.sensor.instrument.axes),
                                joined(fresh_record.sensor.instrument.axes)));
  }
  if (old_record.sensor.instrument.kind != fresh_record.sensor.instrument.kind) {
    throw DomainError(formatted("the records are of different kinds of instrument: {} and {}",
                                old_record.sensor.instrument.kind,
                                fresh_record.sensor.instrument.kind));
  }
  if (old_record.sensor.field.kind != fresh_record.sensor.field.kind ||
      old_record.sensor.instrument.unit != fresh_record.sensor.instrument.unit) {
    throw DomainError(
        formatted("the records have different fields or units: field {} with readings in {}, and "
                  "field {} with readings in {}",
                  old_record.sensor.field.kind, old_record.sensor.instrument.unit,
                  fresh_record.sensor.field.kind, fresh_record.sensor.instrument.unit));
  }
  if (!states_covariance(old_record) && !states_covariance(fresh_record)) {
    throw DomainError("neither record contains a covariance, so their difference cannot be tested");
  }
}

// Returns the parameters of an axis that both records determine. A calibration does not determine
// the sensitivity to directions that are perpendicular to all of its fields.
std::vector<std::string> names_in_both(const Calibration& old,
                                       const Calibration& fresh,
                                       Eigen::Index k) {
  std::vector<std::string> names =
      parameter_names({old.sensor.instrument.axes[static_cast<std::size_t>(k)]});
  for (const Calibration* const record : {&old, &fresh}) {
    if (states_covariance(*record)) {
      std::erase_if(names, [record](const std::string& name) {
        return !record->fit.statistics->position_of(name);
      });
    }
  }
  return names;
}

// Appends the changes of an axis's parameters.
// @return the p-value of these changes.
double compare_axis(const Calibration& old,
                    const Calibration& fresh,
                    Eigen::Index k,
                    std::vector<ParameterChange>& changes) {
  const std::vector<std::string> names = names_in_both(old, fresh, k);
  Eigen::MatrixXd C = covariance_of(old, names) + covariance_of(fresh, names);
  Eigen::VectorXd difference(C.rows());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double a = parameter_value(old.sensor, names[i]);
    const double b = parameter_value(fresh.sensor, names[i]);
    difference(row) = b - a;
    // This term allows for rounding errors if neither record has noise.
    const double size =
        old.sensor.response.sensitivity.row(k).norm() * (i == 0 ? old.sensor.field.magnitude : 1.0);
    C(row, row) += std::pow(1e-12 * size, 2);
    changes.push_back({.parameter = names[i],
                       .old_value = a,
                       .new_value = b,
                       .u = std::sqrt(C(row, row)),
                       .z = (b - a) / std::sqrt(C(row, row)),
                       .e_n = not_a_number});
  }
  const double t2 = difference.dot(solve_symmetric(C, difference).col(0));
  const Scatter before = scatter_of(old, names, k, C.diagonal());
  const Scatter after = scatter_of(fresh, names, k, C.diagonal());
  const bool pooled = before.readings.variance > 0.0 && after.readings.variance > 0.0 &&
                      old.fit.statistics->residual_sd(k) == fresh.fit.statistics->residual_sd(k);
  const double nu = freedom_of_difference(before, after, pooled);
  const auto q = static_cast<double>(names.size());
  return f_upper_p(std::max(t2 / q, 1e-300), q, nu);
}

std::vector<ParameterChange> intrinsic_changes(const Calibration& old, const Calibration& fresh) {
  std::vector<ParameterChange> changes;
  const IntrinsicParameters then = intrinsic_parameters(old);
  const IntrinsicParameters now = intrinsic_parameters(fresh);
  for (std::size_t i = 0; i < then.names.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    ParameterChange change{
        .parameter = then.names[i], .old_value = then.values(row), .new_value = now.values(row)};
    const auto u_of = [&](const IntrinsicParameters& one) {
      return one.uncertainty.empty() ? CombinedUncertainty{} : one.uncertainty[i];
    };
    change.u = std::hypot(u_of(then).u, u_of(now).u);
    change.z = (change.new_value - change.old_value) / change.u;
    change.e_n =
        e_n_score(change.new_value, u_of(now).expanded, change.old_value, u_of(then).expanded);
    changes.push_back(std::move(change));
  }
  return changes;
}

// Splits the variance of the largest angle error into the contributions of the sources of
// uncertainty in both records. The instrument must have three axes or more.
VarianceShares shares_of_error(const Calibration& old,
                               const Calibration& fresh,
                               const WorstAngle& worst) {
  const Eigen::MatrixXd inverse = pseudo_inverse(old.sensor.response.sensitivity);
  const Eigen::Vector3d f = worst.field / worst.field.norm();
  const Eigen::Vector3d across =
      (Eigen::Vector3d::UnitX() - f.x() * f).squaredNorm() > 1e-9
          ? Eigen::Vector3d((Eigen::Vector3d::UnitX() - f.x() * f).normalized())
          : f.unitOrthogonal();
  Eigen::Vector4d by_axis;
  by_axis << 1.0, worst.field;
  by_axis /= worst.field.norm();
  VarianceShares shares;
  for (const Calibration* const record : {&old, &fresh}) {
    if (!states_covariance(*record)) {
      continue;
    }
    const FitStatistics& statistics = *record->fit.statistics;
    Eigen::RowVectorXd gradient = Eigen::RowVectorXd::Zero(statistics.covariance.rows());
    for (Eigen::Index k = 0; k < old.sensor.instrument.axis_count(); ++k) {
      const std::vector<std::string> names =
          parameter_names({old.sensor.instrument.axes[static_cast<std::size_t>(k)]});
      for (std::size_t i = 0; i < names.size(); ++i) {
        if (const auto at = statistics.position_of(names[i])) {
          gradient(*at) = across.dot(inverse.col(k)) * by_axis(static_cast<Eigen::Index>(i));
        }
      }
    }
    VarianceShares own;
    static_cast<void>(propagate(*record, gradient, &own));
    shares += own;
  }
  return shares;
}

// Returns Scheffe's coverage factor for six parameters. The angle error as a function of the
// direction has about six free parameters, so the interval with this factor is valid for the
// direction with the largest error.
double factor_of_largest_error(double degrees_of_freedom) {
  constexpr double parameters = 6.0;
  constexpr double as_good_as_infinite = 1e6;
  return std::sqrt(
      parameters *
      f_quantile(0.95, parameters, std::clamp(degrees_of_freedom, 1.0, as_good_as_infinite)));
}

}  // namespace

WorstAngle worst_angle(const Calibration& used, const Calibration& now) {
  WorstAngle worst;
  if (used.sensor.response.sensitivity.rows() < 3) {
    worst.error_deg = not_a_number;
    return worst;
  }
  const Eigen::MatrixXd inverse = pseudo_inverse(used.sensor.response.sensitivity);
  const bool has_pitch = find_instrument_kind(used.sensor.instrument.kind).has_axis_elevation;
  constexpr double highest_rad = 80.0 * rad_per_deg;
  constexpr int directions = 1200;
  for (const Eigen::Vector3d& u : directions_on_sphere(directions)) {
    const Eigen::Vector3d field = used.sensor.field.magnitude * u;
    if (has_pitch && std::abs(pitch_rad(field)) > highest_rad) {
      continue;
    }
    const Eigen::Vector3d read =
        inverse * (now.sensor.response.at(field) - used.sensor.response.bias);
    const double error = has_pitch ? std::abs(pitch_rad(read) - pitch_rad(field))
                                   : std::atan2(read.cross(field).norm(), read.dot(field));
    if (error * deg_per_rad > worst.error_deg) {
      worst = {.error_deg = error * deg_per_rad, .field = field};
    }
  }
  return worst;
}

DriftCheck check_drift(const Calibration& old_record,
                       const Calibration& fresh_record,
                       double alpha) {
  require_comparable(old_record, fresh_record);
  DriftCheck check{.alpha = alpha};
  const std::string& then_serial = old_record.sensor.instrument.serial;
  const std::string& now_serial = fresh_record.sensor.instrument.serial;
  if (!then_serial.empty() && !now_serial.empty() && then_serial != now_serial) {
    check.notes.push_back(
        formatted("the records have different serial numbers: {} and {}", then_serial, now_serial));
  }
  const bool same_positioner =
      old_record.provenance.positioner == fresh_record.provenance.positioner &&
      old_record.provenance.slot == fresh_record.provenance.slot;
  const bool same_field =
      old_record.sensor.field.model == fresh_record.sensor.field.model &&
      old_record.sensor.field.magnitude_u == fresh_record.sensor.field.magnitude_u;
  Calibration old = without_common(old_record, same_positioner, same_field, check.notes);
  Calibration fresh = without_common(
      converted(fresh_record,
                field_conversion(fresh_record.sensor.field, old_record.sensor.field.unit)),
      same_positioner, same_field, check.notes);
  if (old.sensor.temperature && fresh.sensor.temperature) {
    fresh = at_temperature(std::move(fresh), old.sensor.temperature->reference());
  } else if (old.sensor.temperature || fresh.sensor.temperature) {
    check.notes.emplace_back(
        "only one record has temperature terms: the coefficients are compared without them");
  }
  if (!states_covariance(old)) {
    check.notes.emplace_back(
        "the old record does not contain a covariance, so its coefficients "
        "are taken as exact");
  }
  FisherSum axes;
  const Eigen::Index m = old.sensor.instrument.axis_count();
  // This test uses the scatter of each record, so it must come before pool_scatters().
  const std::optional<double> p_of_blocks = p_of_block_changes(old, fresh, check.notes);
  pool_scatters(old, fresh);
  for (Eigen::Index k = 0; k < m; ++k) {
    axes.add(compare_axis(old, fresh, k, check.changes));
  }
  check.p_value = p_of_blocks.value_or(axes.p_value());
  check.drifted = check.p_value < alpha;

  check.intrinsic = intrinsic_changes(old, fresh);
  const WorstAngle worst = worst_angle(old, fresh);
  check.pitch_error_deg = worst.error_deg;
  check.pitch_error_u_deg = not_a_number;
  check.pitch_error_expanded_deg = not_a_number;
  if (m >= 3) {
    const VarianceShares shares = shares_of_error(old, fresh, worst);
    check.pitch_error_u_deg = combine(shares).u * deg_per_rad;
    check.pitch_error_expanded_deg =
        factor_of_largest_error(welch_degrees_of_freedom(shares)) * check.pitch_error_u_deg;
  }
  return check;
}

Observations at_reference_temperature(Observations observations, const Calibration& calibration) {
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    observations.response.row(row) = reading_at_reference(
        calibration.sensor, observations.response.row(row), observations.readings[i].temperature);
  }
  return observations;
}

}  // namespace axiscal
