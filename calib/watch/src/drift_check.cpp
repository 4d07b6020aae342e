// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/drift_check.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/intrinsic.hpp"
#include "axiscal/calib/minimum_norm.hpp"
#include "axiscal/calib/parameter_names.hpp"
#include "axiscal/calib/reading_uncertainty.hpp"
#include "axiscal/calib/reduction.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"

namespace axiscal {
namespace {

bool states_covariance(const Calibration& calibration) {
  return calibration.statistics && calibration.statistics->covariance.size() > 0 &&
         calibration.statistics->covariance.allFinite();
}

// The record without the sources that both have in common.
Calibration without_common(Calibration calibration,
                           bool same_positioner,
                           bool same_field,
                           std::vector<std::string>& notes) {
  if (!calibration.uncertainty) {
    return calibration;
  }
  const auto drop = [&](const char* name, const char* note) {
    auto& sources = calibration.uncertainty->sources;
    const auto before = sources.size();
    std::erase_if(sources, [&](const UncertaintySource& source) { return source.name == name; });
    if (sources.size() < before && std::find(notes.begin(), notes.end(), note) == notes.end()) {
      notes.emplace_back(note);
    }
  };
  if (same_positioner) {
    drop("positioner", "both runs used one positioner: its normals count as the same");
  }
  if (same_field) {
    drop(field_magnitude_source,
         "both runs took the field from one source: its magnitude counts as the same");
  }
  return calibration;
}

// Covariance of some parameters; 0 where the record states none.
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
      const auto a = calibration.statistics->position_of(names[static_cast<std::size_t>(i)]);
      const auto b = calibration.statistics->position_of(names[static_cast<std::size_t>(j)]);
      if (a && b) {
        result(i, j) = all(*a, *b);
      }
    }
  }
  return result;
}

// The part of an axis's covariance that is of its scatter, and that scatter's degrees of freedom.
struct Scatter {
  double share = 0.0;  // in the difference's covariance, mean over its parameters
  double degrees_of_freedom = 0.0;
};

Scatter scatter_of(const Calibration& calibration,
                   const std::vector<std::string>& names,
                   Eigen::Index axis,
                   const Eigen::VectorXd& variances) {
  if (!states_covariance(calibration)) {
    return {};
  }
  Scatter scatter{.degrees_of_freedom = calibration.statistics->degrees_of_freedom(axis)};
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (const auto at = calibration.statistics->position_of(names[i])) {
      scatter.share += calibration.statistics->covariance(*at, *at) /
                       variances(static_cast<Eigen::Index>(i)) / static_cast<double>(names.size());
    }
  }
  return scatter;
}

// Where the scatters of an axis do not differ they are of one instrument: both records then count
// with the pooled one and all its degrees of freedom.
void pool_scatters(Calibration& a, Calibration& b) {
  if (!states_covariance(a) || !states_covariance(b)) {
    return;
  }
  for (Eigen::Index k = 0; k < a.instrument.axis_count(); ++k) {
    FitStatistics& one = *a.statistics;
    FitStatistics& two = *b.statistics;
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
    const std::string prefix = a.instrument.axes[static_cast<std::size_t>(k)] + ".";
    const auto rescale = [&](FitStatistics& statistics, double factor) {
      for (std::size_t i = 0; i < statistics.parameter_names.size(); ++i) {
        if (statistics.parameter_names[i].starts_with(prefix)) {
          const auto at = static_cast<Eigen::Index>(i);
          statistics.covariance.row(at) *= factor;
          statistics.covariance.col(at) *= factor;
        }
      }
      statistics.residual_sd(k) = std::sqrt(pooled);
      statistics.degrees_of_freedom(k) = nu1 + nu2;
    };
    rescale(one, std::sqrt(pooled / s1));
    rescale(two, std::sqrt(pooled / s2));
  }
}

// Bias and sensitivity as at another temperature.
Calibration at_temperature(Calibration calibration, double t) {
  if (calibration.temperature) {
    TemperatureResponse& terms = *calibration.temperature;
    for (Eigen::Index k = 0; k < calibration.response.bias.size(); ++k) {
      calibration.response.bias(k) += terms.bias_shift(k, t);
      calibration.response.sensitivity.row(k) *= terms.scale_at(k, t);
    }
  }
  return calibration;
}

double pitch_rad(const Eigen::Vector3d& field) {
  return std::atan2(field.x(), std::hypot(field.y(), field.z()));
}

// Throws DomainError unless the records are of one kind of instrument, field and unit, and one of
// them states a covariance.
void require_comparable(const Calibration& old_record, const Calibration& fresh_record) {
  if (old_record.instrument.axes != fresh_record.instrument.axes) {
    throw DomainError(formatted("the records are of different axes: {} and {}",
                                joined(old_record.instrument.axes),
                                joined(fresh_record.instrument.axes)));
  }
  if (old_record.instrument.kind != fresh_record.instrument.kind) {
    throw DomainError(formatted("the records are of different kinds of instrument: {} and {}",
                                old_record.instrument.kind, fresh_record.instrument.kind));
  }
  if (old_record.field.kind != fresh_record.field.kind ||
      old_record.instrument.unit != fresh_record.instrument.unit) {
    throw DomainError(formatted("the records are of field {} in unit {} and of field {} in unit {}",
                                old_record.field.kind, old_record.instrument.unit,
                                fresh_record.field.kind, fresh_record.instrument.unit));
  }
  if (!states_covariance(old_record) && !states_covariance(fresh_record)) {
    throw DomainError(
        "neither record states a covariance, so nothing says how much they may differ");
  }
}

// Appends an axis's changes.
// @return the probability of differences as large as these where nothing changed.
double compare_axis(const Calibration& old,
                    const Calibration& fresh,
                    Eigen::Index k,
                    std::vector<ParameterChange>& changes) {
  const std::vector<std::string> names =
      parameter_names({old.instrument.axes[static_cast<std::size_t>(k)]});
  Eigen::MatrixXd C = covariance_of(old, names) + covariance_of(fresh, names);
  Eigen::Vector4d difference;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double a = parameter_value(old, names[i]);
    const double b = parameter_value(fresh, names[i]);
    difference(row) = b - a;
    // Numbers agree to some digits even without noise.
    const double size =
        old.response.sensitivity.row(k).norm() * (i == 0 ? old.field.magnitude : 1.0);
    C(row, row) += std::pow(1e-12 * size, 2);
    changes.push_back({.parameter = names[i],
                       .old_value = a,
                       .new_value = b,
                       .u = std::sqrt(C(row, row)),
                       .z = (b - a) / std::sqrt(C(row, row)),
                       .e_n = not_a_number});
  }
  const double t2 = difference.dot(C.ldlt().solve(difference));
  const Scatter before = scatter_of(old, names, k, C.diagonal());
  const Scatter after = scatter_of(fresh, names, k, C.diagonal());
  // Of one pooled scatter both shares are the same quantity; else Welch and Satterthwaite.
  const bool pooled = before.share > 0.0 && after.share > 0.0 &&
                      old.statistics->residual_sd(k) == fresh.statistics->residual_sd(k);
  double inverse = 0.0;
  if (pooled) {
    inverse = std::pow(before.share + after.share, 2) / before.degrees_of_freedom;
  } else {
    for (const Scatter& scatter : {before, after}) {
      if (scatter.share > 0.0) {
        inverse += scatter.share * scatter.share / scatter.degrees_of_freedom;
      }
    }
  }
  const double nu = inverse > 0.0 ? 1.0 / inverse : 1e6;
  return f_upper_p(std::max(t2 / 4.0, 1e-300), 4.0, nu);
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

// Where the error of an angle is largest, what both covariances leave open of it; three axes.
double u_of_error_deg(const Calibration& old, const Calibration& fresh, const WorstAngle& worst) {
  const Eigen::Index m = old.instrument.axis_count();
  const Eigen::MatrixXd inverse = pseudo_inverse(old.response.sensitivity);
  const Eigen::Vector3d f = worst.field / worst.field.norm();
  const Eigen::Vector3d across =
      (Eigen::Vector3d::UnitX() - f.x() * f).squaredNorm() > 1e-9
          ? Eigen::Vector3d((Eigen::Vector3d::UnitX() - f.x() * f).normalized())
          : f.unitOrthogonal();
  double variance = 0.0;
  for (Eigen::Index k = 0; k < m; ++k) {
    const std::vector<std::string> names =
        parameter_names({old.instrument.axes[static_cast<std::size_t>(k)]});
    const Eigen::MatrixXd C = covariance_of(old, names) + covariance_of(fresh, names);
    Eigen::Vector4d g;
    g << 1.0, worst.field;
    g *= across.dot(inverse.col(k)) / worst.field.norm();
    variance += g.dot(C * g);
  }
  return std::sqrt(variance) * deg_per_rad;
}

}  // namespace

WorstAngle worst_angle(const Calibration& used, const Calibration& now) {
  WorstAngle worst;
  if (used.response.sensitivity.rows() < 3) {
    worst.error_deg = not_a_number;
    return worst;
  }
  const Eigen::MatrixXd inverse = pseudo_inverse(used.response.sensitivity);
  const bool has_pitch = find_instrument_kind(used.instrument.kind).has_axis_elevation;
  constexpr double highest_rad = 80.0 * rad_per_deg;
  constexpr int directions = 1200;
  for (const Eigen::Vector3d& u : directions_on_sphere(directions)) {
    const Eigen::Vector3d field = used.field.magnitude * u;
    if (has_pitch && std::abs(pitch_rad(field)) > highest_rad) {
      continue;
    }
    const Eigen::Vector3d read = inverse * (now.response.at(field) - used.response.bias);
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
  const std::string& then_serial = old_record.instrument.serial;
  const std::string& now_serial = fresh_record.instrument.serial;
  if (!then_serial.empty() && !now_serial.empty() && then_serial != now_serial) {
    check.notes.push_back(
        formatted("the records are of different units: {} and {}", then_serial, now_serial));
  }
  const bool same_positioner =
      old_record.positioner == fresh_record.positioner && old_record.slot == fresh_record.slot;
  const bool same_field = old_record.field.model == fresh_record.field.model &&
                          old_record.field.magnitude_u == fresh_record.field.magnitude_u;
  Calibration old = without_common(old_record, same_positioner, same_field, check.notes);
  Calibration fresh = without_common(
      converted(fresh_record, field_conversion(fresh_record.field, old_record.field.unit, {})),
      same_positioner, same_field, check.notes);
  if (old.temperature && fresh.temperature) {
    fresh = at_temperature(std::move(fresh), old.temperature->reference);
  } else if (old.temperature || fresh.temperature) {
    check.notes.emplace_back(
        "only one record has temperature terms: the coefficients are compared as they are stated");
  }
  if (!states_covariance(old)) {
    check.notes.emplace_back("the old record states no covariance and counts as exact");
  }
  double sum = 0.0;
  const Eigen::Index m = old.instrument.axis_count();
  pool_scatters(old, fresh);
  for (Eigen::Index k = 0; k < m; ++k) {
    const double p = compare_axis(old, fresh, k, check.changes);
    sum -= 2.0 * std::log(std::max(p, 1e-300));
  }
  check.p_value = chi_squared_upper_p(std::max(sum, 1e-12), 2.0 * static_cast<double>(m));
  check.drifted = check.p_value < alpha;

  check.intrinsic = intrinsic_changes(old, fresh);
  const WorstAngle worst = worst_angle(old, fresh);
  check.pitch_error_deg = worst.error_deg;
  check.pitch_error_u_deg = m >= 3 ? u_of_error_deg(old, fresh, worst) : not_a_number;
  return check;
}

Observations at_reference_temperature(Observations observations, const Calibration& calibration) {
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    observations.response.row(row) = reading_at_reference(
        calibration, observations.response.row(row), observations.readings[i].temperature);
  }
  return observations;
}

InSituCheck check_in_situ(const Calibration& calibration,
                          const Observations& observations,
                          double alpha) {
  const Reducer reducer(calibration);
  if (!reducer.gives_components()) {
    throw DomainError("fewer than three axes leave no residual to check");
  }
  const ReadingPropagation propagation(calibration, reducer, stated_noise(calibration));
  InSituCheck check;
  const auto n = static_cast<double>(observations.size());
  const double nu = calibration.statistics->degrees_of_freedom.minCoeff();
  double sum = 0.0;
  double expected = 0.0;
  double chi2 = 0.0;
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    const Reading& reading = observations.readings[i];
    const Eigen::VectorXd v = observations.response.row(static_cast<Eigen::Index>(i));
    const std::span<const double> readings(v.data(), static_cast<std::size_t>(v.size()));
    const double residual = reducer.reduce(readings, nullptr, reading.temperature).residual;
    const double u = propagation.at(readings, nullptr, reading.temperature).residual;
    const double limit = student_t_factor(1.0 - alpha / n, nu) * u;
    check.readings.push_back({.run = reading.run,
                              .residual = residual,
                              .limit = limit,
                              .within = std::abs(residual) <= limit});
    sum += residual * residual;
    expected += u * u;
    chi2 += residual * residual / (u * u);
  }
  check.rss = std::sqrt(sum);
  check.expected_rss = std::sqrt(expected);
  check.p_value = f_upper_p(chi2 / n, n, nu);
  check.drifted = check.p_value < alpha ||
                  std::any_of(check.readings.begin(), check.readings.end(),
                              [](const InSituReading& reading) { return !reading.within; });
  return check;
}

}  // namespace axiscal
