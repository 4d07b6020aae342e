// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/companion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/LU>

#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/calib/orientation_quality.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/field/geomagnetic_field.hpp"
#include "calib/fit/magnitude.hpp"
#include "calib/record/calibration_warning.hpp"
#include "calib/record/parameter_names.hpp"
#include "calib/regression/factor.hpp"
#include "calib/regression/jackknife.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

Eigen::MatrixXd fields_of(const Calibration& calibration, const Observations& observations) {
  if (calibration.sensor.response.bias.size() != 3 || observations.response.cols() != 3) {
    throw DomainError("align_with_companion: both instruments need three axes");
  }
  return fields_of_readings(calibration.sensor.response, observations.response);
}

std::string degrees(double angle_rad) {
  return number_text(std::round(angle_rad * deg_per_rad * 1e3) * 1e-3);
}

// Returns the companion's coefficients plus random errors that are drawn from their covariance. If
// the record lacks a covariance, no errors are added.
LinearResponse drawn(const Calibration& companion, RandomStream& random) {
  LinearResponse response = companion.sensor.response;
  if (!companion.fit.statistics || companion.fit.statistics->covariance.rows() != 12 ||
      !companion.fit.statistics->covariance.allFinite()) {
    return response;
  }
  Eigen::VectorXd z(12);
  for (double& value : z) {
    value = random.normal();
  }
  const Eigen::VectorXd change = covariance_root(companion.fit.statistics->covariance) * z;
  for (Eigen::Index k = 0; k < 3; ++k) {
    response.bias(k) += change(4 * k);
    response.sensitivity.row(k) += change.segment<3>(4 * k + 1).transpose();
  }
  return response;
}

// Computes the covariance of b and S in the instrument's own frame, including the error of the
// rotation to the companion's frame. Fit and alignment are simulated together (JCGM 101), because
// both use the same readings. The companion's coefficients get random errors with the covariance in
// the companion's record. The noise of the companion's readings is estimated from the scatter of
// the angle between the two fields.
Eigen::MatrixXd covariance_by_simulation(const Calibration& calibration,
                                         const Eigen::MatrixXd& readings,
                                         const Calibration& companion,
                                         const Eigen::MatrixXd& companions,
                                         const Alignment& alignment) {
  // Largest number of readings to simulate. The covariance is proportional to 1 / n for n readings,
  // so the covariance of fewer readings can be scaled to all readings.
  constexpr Eigen::Index most_rows = 1000;
  const Eigen::Index step = 1 + (readings.rows() - 1) / most_rows;
  const Eigen::Index n = (readings.rows() + step - 1) / step;
  const Eigen::MatrixXd v = readings(Eigen::seqN(0, n, step), Eigen::seqN(0, readings.cols()));
  const Eigen::MatrixXd w = companions(Eigen::seqN(0, n, step), Eigen::seqN(0, companions.cols()));
  const double F = calibration.sensor.field.magnitude;
  const LinearResponse& own = calibration.sensor.response;
  const Eigen::MatrixXd u = fields_of_readings(own, v).rowwise().normalized();
  const Eigen::MatrixXd exact =
      (F * u * own.sensitivity.transpose()).rowwise() + own.bias.transpose();
  const Eigen::Matrix3d R0 =
      align_by_constant_angle(u, fields_of_readings(companion.sensor.response, w))
          .rotation_companion_from_sensor;
  const Eigen::VectorXd& sd = calibration.fit.statistics->residual_sd;
  const auto noisy = [](Eigen::MatrixXd rows, const Eigen::VectorXd& noise, RandomStream& stream) {
    for (Eigen::Index k = 0; k < rows.cols(); ++k) {
      for (Eigen::Index i = 0; i < rows.rows(); ++i) {
        rows(i, k) += noise(k) * stream.normal();
      }
    }
    return rows;
  };
  // `theirs` is the standard deviation of the companion's noise. The variance of this noise is the
  // total variance of the angle minus the variance of this instrument's noise.
  const double own_noise = sd.norm() / (F * own.sensitivity.norm());
  const double in_all = alignment.residual_sd / std::max(std::sin(alignment.angle_rad), 1e-3);
  const double theirs = std::sqrt(std::max(0.0, in_all * in_all - own_noise * own_noise));
  constexpr int trials = 200;
  RandomStream random(1, 7);
  Eigen::MatrixXd draws(trials, 12);
  for (int t = 0; t < trials; ++t) {
    const Eigen::MatrixXd made = noisy(exact, sd, random);
    const LinearResponse again = refit_magnitude(made, F, MagnitudeShape::symmetric, own);
    const Eigen::MatrixXd g =
        noisy(fields_of_readings(drawn(companion, random), w).rowwise().normalized(),
              Eigen::Vector3d::Constant(theirs), random);
    const Eigen::Matrix3d R =
        align_by_constant_angle(fields_of_readings(again, made), g).rotation_companion_from_sensor;
    const Eigen::Matrix3d S = again.sensitivity * R.transpose() * R0;
    for (Eigen::Index k = 0; k < 3; ++k) {
      draws.row(t).segment<4>(4 * k) << again.bias(k), S.row(k);
    }
  }
  const Eigen::MatrixXd centred = draws.rowwise() - draws.colwise().mean();
  return static_cast<double>(n) / static_cast<double>(readings.rows()) * centred.transpose() *
         centred / (trials - 1);
}

// Warns if the angle between the two fields differs from the true angle at the site, which is known
// only if the field was computed by a model. Mirrored axes fit equally well, but the angle is then
// 180 degrees minus the true angle.
void warn_of_mirrored_axes(Calibration& calibration,
                           const Calibration& companion,
                           const Alignment& alignment) {
  const FieldDescription& field = calibration.sensor.field;
  if (!field.site || field.model.empty() || !field_kind(companion.sensor.field.kind).vertical ||
      !field_kind(field.kind).dated) {
    return;
  }
  const double year = decimal_year_of(parse_date(field.date).value_or(output_seconds()));
  const Eigen::Vector3d value = GeomagneticModel(field.model).value_in_enu_nT(*field.site, year);
  const double expected_rad = std::acos(value.normalized().z());
  constexpr double close_rad = 15.0 * rad_per_deg;
  if (std::abs(alignment.angle_rad - expected_rad) < close_rad) {
    return;
  }
  const bool mirrored = std::abs(std::numbers::pi - alignment.angle_rad - expected_rad) < close_rad;
  add_warning(calibration,
              {.code = WarningCode::alignment,
               .runs = {},
               .message = formatted(
                   "the angle between the two fields is {} degrees, but at the site it is {}{}",
                   degrees(alignment.angle_rad), degrees(expected_rad),
                   mirrored ? ": an axis of one instrument is reversed, or two axes are exchanged "
                              "(a left-handed frame); correct the sign or the columns"
                            : "; check the site, look for iron nearby, and check that both "
                              "instruments were read at the same times")});
}

// Returns the rows whose readings are usable for both instruments.
std::vector<Eigen::Index> used_of_both(const Calibration& calibration,
                                       const Calibration& companion,
                                       const Observations& companions) {
  std::vector<Eigen::Index> used;
  for (std::size_t i = 0; i < calibration.fit.residuals.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const auto& range = companion.sensor.instrument.range;
    const auto companion_row = companions.response.row(row).array();
    const bool saturated =
        (companions.saturated && companions.saturated->row(row).any()) ||
        (range && ((companion_row <= range->low).any() || (companion_row >= range->high).any()));
    if (calibration.fit.residuals[i].used && !saturated) {
      used.push_back(static_cast<Eigen::Index>(i));
    }
  }
  return used;
}

// Rotates the response, its covariance and the sources of uncertainty to the companion's frame.
// @param simulated  the covariance from covariance_by_simulation(); nullopt if it was not
//                   simulated.
void turn_to_companion(const Alignment& alignment,
                       const std::optional<Eigen::MatrixXd>& simulated,
                       Calibration& calibration) {
  const Eigen::Matrix3d& R = alignment.rotation_companion_from_sensor;
  if (calibration.fit.uncertainty) {
    for (UncertaintySource& source : calibration.fit.uncertainty->sources) {
      if (source.covariance.rows() == 12) {
        LinearResponse response = calibration.sensor.response;
        turn_frame(R, response, source.covariance);
      }
    }
  }
  Eigen::MatrixXd covariance = simulated.value_or(Eigen::MatrixXd::Zero(12, 12));
  turn_frame(R, calibration.sensor.response, covariance);
  if (!calibration.fit.statistics) {
    return;
  }
  FitStatistics& statistics = *calibration.fit.statistics;
  turn_frame(R, statistics);
  if (!simulated) {
    calibration.findings.notes.push_back(
        {NoteCode::mount,
         "the standard errors do not include the error of the rotation to the other instrument's "
         "frame"});
  } else if (statistics.components.empty()) {
    statistics.covariance = covariance;
  } else {
    // The simulation assumes white noise. If the noise of the readings is correlated, the variances
    // in `statistics` may be larger. The larger variance is used.
    const Eigen::VectorXd variances =
        covariance.diagonal().cwiseMax(statistics.covariance.diagonal());
    statistics.covariance = rescaled_covariance(covariance, variances.cwiseSqrt());
    statistics.components.front().covariance = statistics.covariance;
  }
  put_intervals(statistics);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::Vector4d se = statistics.covariance.diagonal().segment<4>(4 * k).cwiseSqrt();
    statistics.bias_se(k) = se(0);
    statistics.sensitivity_se.row(k) = se.tail<3>().transpose();
  }
}

}  // namespace

void align_with_companion(Calibration& calibration,
                          const Observations& observations,
                          const Calibration& companion,
                          const Observations& companions,
                          const std::string& record) {
  const bool has_labels =
      std::any_of(calibration.fit.residuals.begin(), calibration.fit.residuals.end(),
                  [](const ReadingResidual& r) { return r.point.has_value(); });
  if (!method_kind(calibration.fit.method).by_magnitude || has_labels) {
    throw SetupError(
        "align: the instrument must be calibrated by the method 'magnitude' without design points");
  }
  if (calibration.fit.shape == MagnitudeShape::triangular) {
    throw SetupError(
        "align: requires the shape 'symmetric' (the default), because the result is in the other "
        "instrument's frame");
  }
  const Eigen::MatrixXd all = fields_of(calibration, observations);
  const Eigen::MatrixXd all_of_companion = fields_of(companion, companions);
  if (all.rows() != all_of_companion.rows()) {
    throw DomainError(
        "align_with_companion: both instruments must have the same number of readings");
  }
  const std::vector<Eigen::Index> used = used_of_both(calibration, companion, companions);
  const Alignment alignment =
      align_by_constant_angle(all(used, Eigen::seqN(0, all.cols())),
                              all_of_companion(used, Eigen::seqN(0, all_of_companion.cols())));
  std::optional<Eigen::MatrixXd> simulated;
  if (calibration.fit.statistics && calibration.fit.shape == MagnitudeShape::symmetric &&
      calibration.fit.statistics->residual_sd.allFinite()) {
    simulated = covariance_by_simulation(
        calibration, observations.response(used, Eigen::seqN(0, observations.response.cols())),
        companion, companions.response(used, Eigen::seqN(0, companions.response.cols())),
        alignment);
  }
  turn_to_companion(alignment, simulated, calibration);
  if (calibration.fit.orientations) {
    calibration.fit.orientations->gap =
        alignment.rotation_companion_from_sensor * calibration.fit.orientations->gap;
  }
  for (CalibrationWarning& warning : calibration.findings.warnings) {
    warning.message += warning.code == WarningCode::coverage
                           ? " (directions are in the sensor's axes before the alignment)"
                           : "";
  }
  warn_of_mirrored_axes(calibration, companion, alignment);
  calibration.fit.alignment = CompanionAlignment{.record = record, .alignment = alignment};
  const double largest_rad = alignment.standard_error_rad.maxCoeff();
  constexpr double largest_good_rad = 0.02;
  if (!(largest_rad < largest_good_rad)) {
    add_warning(
        calibration,
        {.code = WarningCode::alignment,
         .runs = {},
         .message = formatted("the rotation between the two instruments is uncertain (angle "
                              "between the two fields: {} degrees; standard error of the rotation: "
                              "up to {} degrees); take more orientations, or give the design "
                              "points (labels)",
                              degrees(alignment.angle_rad), degrees(largest_rad))});
  }
}

}  // namespace axiscal
