// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/body.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/reading_uncertainty.hpp"
#include "axiscal/calib/reduction.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/instruments/inclination.hpp"
#include "calib/apply/src/changed_parameters.hpp"
#include "calib/regression/factor.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// A stated direction of the field in the model, and the measured direction in the sensor.
struct Direction {
  std::vector<int> rows;
  Eigen::Vector3d in_model;       // unit length
  Eigen::Vector3d in_sensor;      // mean of the reduced readings, unit length
  Eigen::MatrixXd by_parameters;  // 3 x p: derivative of the direction with respect to the
                                  // parameters, frame sensor
};

// Converts readings to directions of the field, with their derivatives and noise.
class Directions {
 public:
  explicit Directions(const Calibration& calibration)
      : calibration_(calibration), reducer_(calibration, {}, Force::yes) {
    const SensorModel& sensor = calibration.sensor;
    if (!field_kind(sensor.field.kind).vertical || !reducer_.gives_components() ||
        !sensor.also.empty() || !gives_field(calibration)) {
      throw DomainError(
          "the attitude of a model requires an instrument with at least three axes that was "
          "calibrated against gravity, without a second field ('also'); this instrument is of "
          "kind " +
          sensor.instrument.kind);
    }
    if (!calibration.fit.statistics || calibration.fit.statistics->covariance.size() == 0) {
      throw DomainError("the record does not contain the covariance of its coefficients");
    }
    inverse_ = pseudo_inverse(sensor.response.sensitivity) / sensor.field.magnitude;
    const Eigen::VectorXd& sd = calibration.fit.statistics->residual_sd;
    noise_variance_ =
        sd.allFinite() ? (inverse_ * sd.asDiagonal()).squaredNorm() / 3.0 : not_a_number;
  }

  // Variance of a direction due to the noise of one reading [rad^2]; NaN if the noise is unknown.
  [[nodiscard]] double noise_variance() const { return noise_variance_; }

  [[nodiscard]] Direction of(const ReferenceReading& reading,
                             const Eigen::Vector3d& in_model) const {
    const ReadingContext context{.temperature = reading.temperature};
    const std::vector<double> values(reading.readings.begin(), reading.readings.end());
    const Eigen::Vector3d field = reducer_.reduce(values, context).field_in_sensor;
    if (!(field.norm() > 0.0)) {
      throw DomainError(
          formatted("row {}: the readings give a field of 0, which has no direction", reading.row));
    }
    return {.rows = {reading.row},
            .in_model = in_model.normalized(),
            .in_sensor = field.normalized(),
            .by_parameters = -inverse_ * change_with_parameters(calibration_, field, context)};
  }

 private:
  const Calibration& calibration_;
  Reducer reducer_;
  Eigen::MatrixXd inverse_;  // S^-1 / F
  double noise_variance_ = 0.0;
};

Eigen::Vector3d up_of(const StatedAttitude& attitude, AxisConvention convention) {
  return rotation_sensor_from_level(attitude.pitch_rad, attitude.roll_rad, 0.0, convention).col(2);
}

Direction mean_of(const std::vector<Direction>& all) {
  Direction mean = all.front();
  mean.rows.clear();
  mean.in_sensor.setZero();
  mean.by_parameters.setZero();
  for (const Direction& one : all) {
    mean.rows.insert(mean.rows.end(), one.rows.begin(), one.rows.end());
    mean.in_sensor += one.in_sensor;
    mean.by_parameters += one.by_parameters / static_cast<double>(all.size());
  }
  mean.in_sensor.normalize();
  return mean;
}

std::string rows_text(const std::vector<int>& rows) {
  std::vector<std::string> names;
  for (const int row : rows) {
    names.push_back(std::to_string(row));
  }
  return (rows.size() == 1 ? "row " : "rows ") + joined(names);
}

// Returns one direction for each reading with an attitude, and one mean direction for each face
// that lay on a table.
std::vector<Direction> directions_of(const Calibration& calibration,
                                     const Directions& directions,
                                     const std::vector<ReferenceReading>& references) {
  std::vector<Direction> all;
  std::map<Face, std::vector<Direction>> flats;
  for (const ReferenceReading& reading : references) {
    if (reading.attitude) {
      all.push_back(directions.of(
          reading, up_of(*reading.attitude, calibration.sensor.instrument.convention)));
    } else if (reading.flat) {
      flats[*reading.flat].push_back(directions.of(reading, -nominal_normal(*reading.flat)));
    } else {
      throw DomainError(formatted(
          "row {}: give an attitude, or the face that lies on the table ('flat')", reading.row));
    }
  }
  for (const auto& [face, headings] : flats) {
    if (headings.size() < 2) {
      throw RefusedError(
          formatted("face {} lies on the table in only one heading ({}), so the table's slope is "
                    "not determined; take another reading on this face after a turn of 180 degrees "
                    "about the vertical",
                    face_name(face), rows_text(headings.front().rows)));
    }
    all.push_back(mean_of(headings));
  }
  return all;
}

std::string axis_text(const Eigen::Vector3d& axis) {
  Eigen::Index largest = 0;
  constexpr double nearly = 0.99;
  if (axis.cwiseAbs().maxCoeff(&largest) > nearly) {
    return formatted("the model's {} axis", "xyz"[largest]);
  }
  return formatted("the model's direction ({:.2f}, {:.2f}, {:.2f})", axis.x(), axis.y(), axis.z());
}

// Returns the sum of I - u u^T over the unit directions u, where I is the identity matrix. It is
// the information matrix of a small rotation about the model's axes if each direction has the
// variance 1.
Eigen::Matrix3d sight_of(const std::vector<Direction>& all) {
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  for (const Direction& one : all) {
    M += Eigen::Matrix3d::Identity() - one.in_model * one.in_model.transpose();
  }
  return M;
}

void require_all_turns(const std::vector<Direction>& all) {
  const SymmetricEigen eigen = symmetric_eigen(sight_of(all));
  // Lower limit of the smallest eigenvalue, divided by the number of directions. It is the squared
  // sine of 0.6 degrees, the smallest accepted rms angle between the directions and one line.
  constexpr double open_below = 1e-4;
  if (eigen.values(0) > open_below * static_cast<double>(all.size())) {
    return;
  }
  throw RefusedError(formatted(
      "the references do not determine the rotation about {}, because this axis is vertical in all "
      "references; add a reference with a pitch or roll of 30 degrees or more, or on another face",
      axis_text(eigen.vectors.col(0))));
}

double residual_of(const Direction& one, const Eigen::Matrix3d& R) {
  return (one.in_model - R * one.in_sensor).norm();
}

void put_total_covariance(const Calibration& calibration, BodyRotation& body) {
  body.covariance = body.covariance_of_references + body.by_parameters *
                                                        parameter_covariance(calibration) *
                                                        body.by_parameters.transpose();
}

// Returns the variance of each direction relative to its reference [rad^2], from the noise of the
// readings and the stated uncertainty of the references.
std::vector<double> stated_variances(const std::vector<Direction>& all,
                                     double noise_variance,
                                     double reference_u_rad) {
  std::vector<double> variances;
  for (const Direction& one : all) {
    variances.push_back(noise_variance / static_cast<double>(one.rows.size()) +
                        reference_u_rad * reference_u_rad);
  }
  return variances;
}

}  // namespace

BodyRotation find_body_rotation(const Calibration& calibration,
                                const std::vector<ReferenceReading>& references,
                                const BodyOptions& options) {
  const Directions directions(calibration);
  const std::vector<Direction> all = directions_of(calibration, directions, references);
  if (all.empty()) {
    throw RefusedError("the run contains no reference readings");
  }
  require_all_turns(all);
  Eigen::Matrix3d profile = Eigen::Matrix3d::Zero();
  for (const Direction& one : all) {
    profile += one.in_model * one.in_sensor.transpose();
  }
  BodyRotation body{.rotation_model_from_sensor = nearest_rotation(profile),
                    .parameter_names = calibration.fit.statistics->parameter_names,
                    .readings = static_cast<int>(references.size()),
                    .created = output_timestamp()};
  const Eigen::Matrix3d& R = body.rotation_model_from_sensor;
  const Eigen::Matrix3d inverse = sight_of(all).inverse();
  const double dof = 2.0 * static_cast<double>(all.size()) - 3.0;
  double squares = 0.0;
  body.by_parameters =
      Eigen::MatrixXd::Zero(3, static_cast<Eigen::Index>(body.parameter_names.size()));
  for (const Direction& one : all) {
    squares += std::pow(residual_of(one, R), 2);
    body.by_parameters += inverse * cross_matrix(one.in_model) * R * one.by_parameters;
  }
  body.residual_sd_rad = std::sqrt(squares / std::max(dof, 1.0));
  if (!options.reference_u_rad) {
    constexpr double fewest = 2.0;
    if (dof < fewest) {
      throw RefusedError(
          formatted("{} references are too few to determine their scatter: take three or more, or "
                    "give their standard uncertainty (direction_u)",
                    all.size()));
    }
    body.covariance_of_references = body.residual_sd_rad * body.residual_sd_rad * inverse;
    body.degrees_of_freedom = dof;
  } else {
    const std::vector<double> variances =
        stated_variances(all, directions.noise_variance(), *options.reference_u_rad);
    Eigen::Matrix3d middle = Eigen::Matrix3d::Zero();
    double chi_squared = 0.0;
    std::size_t worst = 0;
    const auto pull = [&](std::size_t i) {
      return std::pow(residual_of(all[i], R), 2) / variances[i];
    };
    for (std::size_t i = 0; i < all.size(); ++i) {
      middle += variances[i] *
                (Eigen::Matrix3d::Identity() - all[i].in_model * all[i].in_model.transpose());
      chi_squared += pull(i);
      worst = pull(i) > pull(worst) ? i : worst;
    }
    constexpr double by_chance = 1e-4;
    const double nu = calibration.fit.statistics->degrees_of_freedom.sum();
    if (dof > 0.0 && f_upper_p(std::max(chi_squared / dof, 1e-12), dof, nu) < by_chance) {
      throw RefusedError(formatted(
          "the references disagree by more than their stated standard uncertainty (direction_u): "
          "the deviation of {} is {} degrees; check the attitude that is stated there, or give a "
          "larger uncertainty",
          rows_text(all[worst].rows), number_text(residual_of(all[worst], R) * deg_per_rad, 2)));
    }
    body.covariance_of_references = inverse * middle * inverse;
    body.degrees_of_freedom = std::numeric_limits<double>::infinity();
  }
  put_total_covariance(calibration, body);
  return body;
}

BodyRotation corrected_by_tare(const Calibration& calibration,
                               BodyRotation body,
                               const std::vector<ReferenceReading>& tare,
                               const BodyOptions& options) {
  const Directions directions(calibration);
  if (tare.empty()) {
    throw RefusedError("the run contains no readings for the tare");
  }
  std::vector<Direction> all;
  for (const ReferenceReading& reading : tare) {
    if (reading.flat) {
      throw RefusedError(formatted(
          "row {}: a tare requires an attitude (pitch_deg, roll_deg), not a face on the table "
          "('flat'), because one heading does not determine the table's slope; give the attitude, "
          "or use the method 'attitude' with references in several headings",
          reading.row));
    }
    const StatedAttitude attitude = reading.attitude.value_or(StatedAttitude{});
    all.push_back(
        directions.of(reading, up_of(attitude, calibration.sensor.instrument.convention)));
    constexpr double same_rad = 1e-9;
    if ((all.back().in_model - all.front().in_model).norm() > same_rad) {
      throw RefusedError(formatted(
          "row {}: all readings of a tare must be in one attitude, but the earlier rows have "
          "another attitude; use the method 'attitude' for readings in several attitudes",
          reading.row));
    }
  }
  const Direction mean = mean_of(all);
  const Eigen::Vector3d n = mean.in_model;
  const Eigen::Vector3d read = body.rotation_model_from_sensor * mean.in_sensor;
  const double angle_rad = std::atan2(read.cross(n).norm(), read.dot(n));
  constexpr double largest_rad = 0.2;
  if (!(angle_rad <= largest_rad)) {
    throw RefusedError(
        formatted("the correction by the tare would be {} degrees, but at most {} degrees are "
                  "allowed: the attitude stated in {} is wrong, or the sensor was mounted again; "
                  "use the method 'attitude' with references in several attitudes",
                  number_text(angle_rad * deg_per_rad, 3),
                  number_text(largest_rad * deg_per_rad, 2), rows_text(mean.rows)));
  }
  body.rotation_model_from_sensor = smallest_rotation(read, n) * body.rotation_model_from_sensor;
  const Eigen::Matrix3d along = n * n.transpose();
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - along;
  const std::vector<std::string>& names = calibration.fit.statistics->parameter_names;
  if (body.readings == 0) {
    constexpr double by_eye_rad = 1.0 * rad_per_deg;
    body.covariance_of_references = by_eye_rad * by_eye_rad * Eigen::Matrix3d::Identity();
    body.degrees_of_freedom = std::numeric_limits<double>::infinity();
  } else if (!options.same_record || body.parameter_names != names) {
    body.covariance_of_references = body.covariance;
    body.by_parameters.resize(0, 0);
  }
  if (body.by_parameters.size() == 0) {
    body.parameter_names = names;
    body.by_parameters = Eigen::MatrixXd::Zero(3, static_cast<Eigen::Index>(names.size()));
  }
  const double variance =
      stated_variances({mean}, directions.noise_variance(), options.reference_u_rad.value_or(0.0))
          .front();
  body.covariance_of_references = along * body.covariance_of_references * along + variance * across;
  body.by_parameters = along * body.by_parameters +
                       cross_matrix(n) * body.rotation_model_from_sensor * mean.by_parameters;
  body.tare_rad = angle_rad;
  body.readings += static_cast<int>(tare.size());
  body.created = output_timestamp();
  put_total_covariance(calibration, body);
  return body;
}

Calibration in_model_frame(Calibration calibration, const BodyRotation& body, bool same_record) {
  SensorModel& sensor = calibration.sensor;
  const Eigen::Matrix3d R = body.rotation_model_from_sensor;
  if (sensor.response.bias.size() < 3) {
    throw DomainError(
        "a rotation to a model's axes requires an instrument with at least three "
        "axes");
  }
  const bool correlated = same_record && calibration.fit.statistics &&
                          body.parameter_names == calibration.fit.statistics->parameter_names;
  sensor.rotation_sensor_from_assembly = R.transpose();
  calibration = in_assembly_frame(std::move(calibration));
  if (!calibration.fit.statistics) {
    return calibration;
  }
  // An error d of the rotation (a rotation vector) changes the sensitivity vector s of each axis by
  // the cross product of d and s.
  FitStatistics& statistics = *calibration.fit.statistics;
  const auto count = static_cast<Eigen::Index>(statistics.parameter_names.size());
  Eigen::MatrixXd D = Eigen::MatrixXd::Zero(count, 3);
  for (std::size_t k = 0; k < sensor.instrument.axes.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    if (const auto at = statistics.position_of(sensor.instrument.axes[k] + ".sensitivity.x")) {
      D.middleRows<3>(*at) =
          -cross_matrix(Eigen::Vector3d(sensor.response.sensitivity.row(row).transpose()));
    }
  }
  if (correlated) {
    // An error dtheta of the parameters also changes the rotation, by -K dtheta. T converts the
    // parameters to the model's frame.
    Eigen::MatrixXd T = Eigen::MatrixXd::Identity(count, count);
    for (std::size_t k = 0; k < sensor.instrument.axes.size(); ++k) {
      if (const auto at = statistics.position_of(sensor.instrument.axes[k] + ".sensitivity.x")) {
        T.block<3, 3>(*at, *at) = R;
      }
    }
    transform_parameters(
        Eigen::MatrixXd::Identity(count, count) - D * body.by_parameters * T.transpose(),
        calibration.fit);
  }
  const Eigen::MatrixXd own =
      D * (correlated ? body.covariance_of_references : body.covariance) * D.transpose();
  statistics.covariance += own;
  statistics.components.push_back({.name = "body",
                                   .sd = Eigen::VectorXd(body.covariance.diagonal().cwiseSqrt()),
                                   .unit = "rad",
                                   .covariance = own,
                                   .degrees_of_freedom = body.degrees_of_freedom});
  return calibration;
}

JointMovement joint_movement(const Eigen::Vector3d& first,
                             const std::optional<Eigen::Matrix3d>& first_covariance,
                             const Eigen::Vector3d& second,
                             const std::optional<Eigen::Matrix3d>& second_covariance,
                             double degrees_of_freedom) {
  const Eigen::Vector3d a = first.normalized();
  const Eigen::Vector3d b = second.normalized();
  JointMovement movement{.angle_rad = std::atan2(a.cross(b).norm(), a.dot(b)),
                         .u_rad = not_a_number,
                         .p_value = not_a_number};
  if (!first_covariance || !second_covariance) {
    return movement;
  }
  const Eigen::Matrix<double, 3, 2> across = tangents_of(a);
  const Eigen::Vector2d difference = across.transpose() * b;
  const Eigen::Matrix2d covariance =
      across.transpose() *
      (*first_covariance / first.squaredNorm() + *second_covariance / second.squaredNorm()) *
      across;
  const Eigen::Vector2d along =
      difference.norm() > 0.0 ? Eigen::Vector2d(difference.normalized()) : Eigen::Vector2d::UnitX();
  movement.u_rad = std::sqrt(along.dot(covariance * along));
  movement.p_value =
      f_upper_p(std::max(0.5 * difference.dot(covariance.inverse() * difference), 1e-12), 2.0,
                degrees_of_freedom);
  return movement;
}

BodyChange compare_rotations(const BodyRotation& before, const BodyRotation& after) {
  const Eigen::AngleAxisd turn(after.rotation_model_from_sensor *
                               before.rotation_model_from_sensor.transpose());
  const bool same_record =
      !before.record_sha256.empty() && before.record_sha256 == after.record_sha256;
  const Eigen::Matrix3d first = same_record ? before.covariance_of_references : before.covariance;
  const Eigen::Matrix3d second = same_record ? after.covariance_of_references : after.covariance;
  const Eigen::Matrix3d covariance = first + second;
  const PositiveFactor factor(covariance);
  if (!factor.is_determined()) {
    throw RefusedError(
        "both rotations have zero uncertainty about one of the axes, so the rotations cannot be "
        "compared");
  }
  BodyChange change{.turn_rad = turn.angle() * turn.axis(),
                    .u_rad = covariance.diagonal().cwiseSqrt()};
  // Effective degrees of freedom by the formula of Welch and Satterthwaite, with the traces of the
  // covariances as variances.
  const double nu =
      std::pow(covariance.trace(), 2) / (std::pow(first.trace(), 2) / before.degrees_of_freedom +
                                         std::pow(second.trace(), 2) / after.degrees_of_freedom);
  change.p_value = f_upper_p(
      std::max(change.turn_rad.dot(factor.solve(change.turn_rad).col(0)) / 3.0, 1e-12), 3.0, nu);
  return change;
}

}  // namespace axiscal
