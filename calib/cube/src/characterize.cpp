// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/characterize.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <set>

#include <Eigen/Geometry>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/settings.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/median.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/version.hpp"
#include "axiscal/field/field_kind.hpp"
#include "calib/cube/src/characterize_checks.hpp"
#include "calib/cube/src/solid_fit.hpp"
#include "calib/regression/factor.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr double misfit_below = 0.005;
constexpr double same_orientation_rad = 0.1;

double calibration_dof(const Calibration& calibration) {
  if (!calibration.fit.statistics) {
    return 0.0;
  }
  const double sum = calibration.fit.statistics->degrees_of_freedom.sum();
  return sum > 0.0 ? sum : 0.0;  // also 0 if the sum is NaN
}

Eigen::MatrixXd calibration_covariance(const Calibration& calibration) {
  const Eigen::Index parameters = 4 * calibration.sensor.response.bias.size();
  if (!calibration.fit.statistics || calibration.fit.statistics->covariance.rows() != parameters ||
      !calibration.fit.statistics->covariance.allFinite()) {
    return Eigen::MatrixXd::Zero(parameters, parameters);
  }
  return calibration.fit.statistics->covariance;
}

// Returns the sign of the field along the table's normal. The sign is 1 for a vertical field such
// as gravity; for other fields it is the sign of the recorded component z.
double sign_along_normal(const FieldDescription& field) {
  return !field_kind(field.kind).vertical && field.in_table && field.in_table->z() < 0.0 ? -1.0
                                                                                         : 1.0;
}

std::vector<SolidReference> solid_references(const std::vector<Reference>& references,
                                             const CharacterizeOptions& options) {
  std::vector<SolidReference> solid;
  std::map<std::string, std::size_t> instruments;
  for (const Reference& reference : references) {
    if (std::find(options.leave_out.begin(), options.leave_out.end(), reference.slot) !=
        options.leave_out.end()) {
      continue;
    }
    const std::size_t instrument =
        instruments.emplace(reference.instrument, instruments.size()).first->second;
    SolidReference& own = solid.emplace_back(
        SolidReference{.slot = reference.slot,
                       .run = reference.observations,
                       .calibrated = reference.calibration.sensor.response,
                       .covariance = calibration_covariance(reference.calibration),
                       .calibration_dof = calibration_dof(reference.calibration),
                       .F = reference.calibration.sensor.field.magnitude,
                       .sign = sign_along_normal(reference.calibration.sensor.field),
                       .instrument = instrument,
                       .root_weights = {},
                       .levels = {}});
    std::map<int, std::size_t> blocks;
    for (const Reading& reading : own.run.readings) {
      const int block = options.level_by == LevelBy::block ? reading.block : 1;
      own.levels.push_back(blocks.emplace(block, blocks.size()).first->second);
    }
    own.level_count = blocks.size();
    const std::optional<Eigen::VectorXd>& samples = reference.observations.samples;
    for (Eigen::Index i = 0; i < reference.observations.size(); ++i) {
      own.root_weights.push_back(samples ? std::sqrt((*samples)(i) / samples->mean()) : 1.0);
    }
    require_opposites(own);
  }
  return solid;
}

// Returns the effective degrees of freedom of a sum of variances.
// @param parts  pairs of a variance and its degrees of freedom. 0 degrees of freedom mean that the
//               variance is exact.
double effective_dof(const std::vector<std::pair<double, double>>& parts) {
  double sum = 0.0;
  double over = 0.0;
  for (const auto& [variance, dof] : parts) {
    sum += variance;
    over += dof > 0.0 ? variance * variance / dof : 0.0;
  }
  return over > 0.0 ? sum * sum / over : std::numeric_limits<double>::infinity();
}

// Returns the probability that the normals from one instrument and the normals from all other
// instruments differ this much by chance.
double p_of_difference(const SolidSolution& one, const SolidSolution& others) {
  Eigen::Matrix<double, 18, 1> difference;
  for (std::size_t face = 0; face < 6; ++face) {
    difference.segment<3>(3 * static_cast<Eigen::Index>(face)) =
        one.state.normals[face] - others.state.normals[face];
  }
  const Eigen::Matrix<double, 9, 1> d = others.basis.transpose() * difference;
  // Adds both covariances in the basis of `others`. The bases differ because the normals differ.
  const Eigen::Matrix<double, 9, 9> to = others.basis.transpose() * one.basis;
  const Eigen::Matrix<double, 9, 9> V =
      to * (one.noise + one.handed_on) * to.transpose() + others.noise + others.handed_on;
  const double rounding = 1e-26;
  const double Q =
      d.dot(solve_symmetric(V + rounding * Eigen::Matrix<double, 9, 9>::Identity(), d).col(0));
  const double dof = effective_dof({{one.noise.trace(), one.degrees_of_freedom},
                                    {one.handed_on.trace(), one.calibration_dof},
                                    {others.noise.trace(), others.degrees_of_freedom},
                                    {others.handed_on.trace(), others.calibration_dof}});
  return std::isinf(dof) ? chi_squared_upper_p(Q, 9.0) : f_upper_p(Q / 9.0, 9.0, dof);
}

// Returns the references of one instrument or, if `without` is true, the references of all other
// instruments. In the result the instruments are numbered from 0 again.
std::vector<SolidReference> part_of(const std::vector<SolidReference>& references,
                                    std::size_t instrument,
                                    bool without) {
  std::vector<SolidReference> part;
  for (const SolidReference& reference : references) {
    if ((reference.instrument == instrument) != without) {
      part.push_back(reference);
      std::size_t& number = part.back().instrument;
      number = without ? number - (number > instrument ? 1 : 0) : 0;
    }
  }
  return part;
}

// For each instrument, compares the cube that it measured with the cube that all other instruments
// measured.
void compare_instruments(const std::vector<SolidReference>& references,
                         const CharacterizeOptions& options,
                         Characterization& result) {
  // All slots of the instrument, separated by commas.
  std::map<std::size_t, std::string> slot_of_instrument;
  for (const SolidReference& reference : references) {
    std::string& slots = slot_of_instrument[reference.instrument];
    slots += (slots.empty() ? "" : ",") + reference.slot;
  }
  result.p_value = not_a_number;
  for (ReferenceResult& reference : result.references) {
    reference.p_value = not_a_number;
  }
  if (slot_of_instrument.size() < 2) {
    return;
  }
  double smallest = 2.0;
  for (const auto& [instrument, slot] : slot_of_instrument) {
    const std::vector<SolidReference> own = part_of(references, instrument, false);
    const std::vector<SolidReference> others = part_of(references, instrument, true);
    double p = not_a_number;
    try {
      require_faces(own);
      require_faces(others);
      p = p_of_difference(SolidFit(own, options.drawing, options.free_bias_and_scale).solve(),
                          SolidFit(others, options.drawing, options.free_bias_and_scale).solve());
    } catch (const RefusedError&) {
      continue;  // one of the two parts does not determine the cube
    }
    for (std::size_t k = 0; k < references.size(); ++k) {
      if (references[k].instrument == instrument) {
        result.references[k].p_value = p;
      }
    }
    if (p < smallest) {
      smallest = p;
      result.suspect = slot;
    }
  }
  if (smallest > 1.0) {
    result.suspect.clear();
    return;
  }
  const bool two = slot_of_instrument.size() == 2;
  const double tests = two ? 1.0 : static_cast<double>(slot_of_instrument.size());
  result.p_value = std::min(1.0, tests * smallest);
  result.consistent = !(result.p_value < misfit_below);
  if (result.consistent || two) {
    result.suspect.clear();
  }
}

double rotation_between(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return std::abs(Eigen::AngleAxisd(Eigen::Matrix3d(a * b.transpose())).angle());
}

// Estimates the scatter between mounts, for each instrument that has several mounts in nearly the
// same orientation.
std::vector<MountRepeatability> find_repeatability(const std::vector<SolidReference>& references,
                                                   const std::vector<std::string>& names,
                                                   const SolidSolution& solution) {
  std::vector<MountRepeatability> found;
  std::vector<bool> used(references.size(), false);
  for (std::size_t a = 0; a < references.size(); ++a) {
    std::vector<Eigen::Matrix3d> mounts;
    std::vector<std::string> slots;
    double fit_variance = 0.0;
    for (std::size_t b = a; b < references.size() && !used[a]; ++b) {
      if (!used[b] && references[b].instrument == references[a].instrument &&
          rotation_between(solution.state.mounts[a], solution.state.mounts[b]) <
              same_orientation_rad) {
        mounts.push_back(solution.state.mounts[b]);
        slots.push_back(references[b].slot);
        fit_variance += solution.mount_noise[b].trace() / 3.0;
        used[b] = b != a;
      }
    }
    if (mounts.size() > 1) {
      MountRepeatability& own = found.emplace_back(
          estimate_repeatability(mounts, fit_variance / static_cast<double>(mounts.size())));
      own.instrument = names[a];
      own.slots = slots;
    }
  }
  return found;
}

std::string significant(double value) {
  return number_text(value, 3);
}

std::string micro(double radian) {
  return significant(1e6 * radian);
}

// Returns the scatter of the readings in an instrument's calibration [field unit]; NaN if the
// record does not state it.
double scatter_of_record(const Calibration& calibration) {
  if (!calibration.fit.statistics ||
      calibration.fit.statistics->residual_sd.size() != calibration.sensor.response.bias.size()) {
    return not_a_number;
  }
  const Eigen::VectorXd relative = calibration.fit.statistics->residual_sd.cwiseQuotient(
      calibration.sensor.response.sensitivity.rowwise().norm());
  return std::sqrt(relative.cwiseAbs2().mean());
}

// Warns of references with a large scatter. A mistake in one reference increases its scatter, but
// the test between the instruments does not always detect it.
void warn_of_scatter(const std::vector<Reference>& references, Characterization& result) {
  constexpr double suspicious = 5.0;  // a scatter above 5 times the expected one gives a warning
  for (const ReferenceResult& own : result.references) {
    std::vector<double> others;
    for (const ReferenceResult& other : result.references) {
      if (&other != &own) {
        others.push_back(other.residual_sd);
      }
    }
    const auto reference = std::find_if(references.begin(), references.end(),
                                        [&](const Reference& one) { return one.slot == own.slot; });
    double expected = scatter_of_record(reference->calibration);
    if (!others.empty()) {
      expected = std::fmax(expected, upper_median(others));
    }
    if (own.residual_sd > suspicious * expected &&
        own.residual_sd > 1e-12 * reference->calibration.sensor.field.magnitude) {
      result.warnings.push_back(formatted(
          "slot {}: its readings scatter by {} {}, {} times the expected scatter, and run {} has "
          "the largest residual; look for a wrong label, a loose instrument, readings of another "
          "instrument, or a table that was moved (then fit one slope for each block, 'level_by')",
          own.slot, significant(own.residual_sd), reference->calibration.sensor.field.unit,
          significant(own.residual_sd / expected), own.worst_run));
    }
  }
}

void find_warnings(const std::vector<Reference>& references, Characterization& result) {
  warn_of_scatter(references, result);
  if (!result.consistent) {
    const std::string p = formatted(" (p = {})", significant(result.p_value));
    result.warnings.push_back(
        result.suspect.empty()
            ? formatted("the two instruments give different face normals of the "
                        "cube{}; measure with a third instrument to find out "
                        "which one is wrong",
                        p)
            : formatted("slot {} gives different face normals of the cube than the other slots{}; "
                        "calibrate the instrument in this slot again, or leave the slot out",
                        result.suspect, p));
  }
}

void check_left_out(const std::vector<Reference>& references, const CharacterizeOptions& options) {
  for (const std::string& slot : options.leave_out) {
    if (std::none_of(references.begin(), references.end(),
                     [&](const Reference& reference) { return reference.slot == slot; })) {
      throw SetupError(formatted("slot '{}' cannot be left out: it does not exist", slot),
                       {settings::leave_out});
    }
  }
}

std::set<DesignPoint> points_of(const std::vector<SolidReference>& solid) {
  std::set<DesignPoint> points;
  for (const SolidReference& reference : solid) {
    for (const Reading& reading : reference.run.readings) {
      points.insert(*reading.point);
    }
  }
  return points;
}

// Adds notes that explain the uncertainties to the description of the positioner.
void describe_in_notes(const CharacterizeOptions& options,
                       const Characterization& result,
                       bool all_have_covariance,
                       PositionerDescription& description) {
  description.notes.push_back(formatted(
      "standard uncertainty of a normal's component: {} urad ({} urad from the scatter of the "
      "readings, {} urad from the calibrations of the instruments)",
      micro(result.normal_u_rad), micro(result.noise_rad), micro(result.transferred_rad)));
  description.notes.emplace_back(
      "an error that the calibrations of all instruments share, for example from the same cube or "
      "method, does not average out, and the covariance does not include it");
  const bool has_feet = std::all_of(all_faces.begin(), all_faces.end(), [&](Face face) {
    return options.drawing.feet(face).has_value();
  });
  if (!has_feet) {
    description.notes.emplace_back(
        "no drawing with feet was given, so the seats are computed only from the face normals. If "
        "the cube has feet or the fence leans, this causes errors of about (slope of the table) x "
        "(deviation of the faces from squareness)");
  }
  if (!all_have_covariance) {
    description.notes.emplace_back(
        "a record does not contain a covariance, so its coefficients are taken as exact");
  }
}

}  // namespace

MountRepeatability estimate_repeatability(const std::vector<Eigen::Matrix3d>& mounts,
                                          double fit_variance) {
  if (mounts.size() < 2) {
    throw DomainError("estimate_repeatability: at least two mounts are needed");
  }
  Eigen::Matrix3Xd vectors(3, static_cast<Eigen::Index>(mounts.size()));
  for (std::size_t j = 0; j < mounts.size(); ++j) {
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(mounts[j] * mounts.front().transpose()));
    if (!(std::abs(turn.angle()) < same_orientation_rad)) {
      throw DomainError("estimate_repeatability: the mounts must lie within 0.1 rad of each other");
    }
    vectors.col(static_cast<Eigen::Index>(j)) = turn.angle() * turn.axis();
  }
  const Eigen::Vector3d mean = vectors.rowwise().mean();
  const double dof = 3.0 * static_cast<double>(mounts.size() - 1);
  const double between = (vectors.colwise() - mean).squaredNorm() / dof;
  return {.instrument = {},
          .slots = {},
          .sd_rad = std::sqrt(std::max(0.0, between - fit_variance)),
          .degrees_of_freedom = dof};
}

Characterization characterize(const std::vector<Reference>& references,
                              const CharacterizeOptions& options) {
  check_references(references);
  check_left_out(references, options);
  const std::vector<SolidReference> solid = solid_references(references, options);
  if (solid.empty()) {
    throw RefusedError("all slots were left out, so no instrument is left to measure the cube");
  }
  require_faces(solid);
  const SolidFit fit(solid, options.drawing, options.free_bias_and_scale);
  const SolidSolution solution = fit.solve();

  Characterization result;
  const Eigen::Matrix<double, 9, 9> total = solution.noise + solution.handed_on;
  result.noise_rad = std::sqrt(solution.noise.trace() / 12.0);
  result.transferred_rad = std::sqrt(solution.handed_on.trace() / 12.0);
  result.normal_u_rad = std::sqrt(total.trace() / 12.0);
  std::vector<std::string> instruments;
  PositionerDescription description = fit.positioner_of(solution.state.normals).description();
  description.id = options.id;
  description.created = output_timestamp();
  description.software = software_name();
  const NormalCovariance covariance = solution.basis * total * solution.basis.transpose();
  description.normal_covariance = 0.5 * (covariance + covariance.transpose());
  description.mounts.clear();
  bool all_have_covariance = true;
  for (std::size_t k = 0; k < solid.size(); ++k) {
    const auto reference =
        std::find_if(references.begin(), references.end(),
                     [&](const Reference& one) { return one.slot == solid[k].slot; });
    instruments.push_back(reference->instrument);
    all_have_covariance = all_have_covariance && !solid[k].covariance.isZero(0.0);
    Eigen::Vector2d slope = Eigen::Vector2d::Zero();
    for (const Eigen::Vector3d& field : solution.state.fields[k]) {
      slope += field.head<2>() / (solid[k].F * static_cast<double>(solid[k].level_count));
    }
    result.references.push_back({.slot = solid[k].slot,
                                 .rotation_sensor_from_positioner = solution.state.mounts[k],
                                 .mount_se_rad = solution.mount_noise[k].diagonal().cwiseSqrt(),
                                 .residual_sd = solution.sigma[k],
                                 .worst_run = solution.worst_runs[k],
                                 .slope = slope});
    description.mounts.push_back(
        {.slot = solid[k].slot, .rotation_sensor_from_positioner = solution.state.mounts[k]});
    description.from.push_back({.slot = solid[k].slot, .record = reference->instrument});
  }
  result.repeatability = find_repeatability(solid, instruments, solution);
  for (const MountRepeatability& repeatability : result.repeatability) {
    for (Mount& mount : description.mounts) {
      if (std::find(repeatability.slots.begin(), repeatability.slots.end(), mount.slot) !=
          repeatability.slots.end()) {
        mount.repeatability_rad = repeatability.sd_rad;
      }
    }
  }
  describe_in_notes(options, result, all_have_covariance, description);
  compare_instruments(solid, options, result);
  find_warnings(references, result);
  for (const std::string& warning : result.warnings) {
    description.notes.push_back(warning);
  }
  const Positioner positioner(std::move(description));
  description = positioner.description();
  for (std::string& remark : rocking_remarks(positioner, points_of(solid))) {
    description.notes.push_back(std::move(remark));
  }
  result.positioner = Positioner(std::move(description));
  return result;
}

}  // namespace axiscal
