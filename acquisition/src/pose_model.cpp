// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/pose_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/QR>

#include "axiscal/core/error.hpp"

namespace axiscal {
namespace {

// Another pose is reported if PoseJudgement::log_ratio exceeds this value. log_ratio contains only
// chi^2, not the normalising factors of the probability densities. These factors favour the pose
// with the more certain prediction. On a level table, the readings before and after half a turn of
// the cube about the vertical are equal, so they would be mistaken for readings in the same pose.
constexpr double telling_log_ratio = 9.0;
// A pose does not fit if the chi^2 of three axes exceeds this value (about 5 standard deviations).
constexpr double fitting_misfit = 40.0;
constexpr double no_pose_misfit = 200.0;
constexpr std::size_t readings_to_rely_on = 9;
constexpr int rounds = 6;
constexpr double wide = 10.0;  // relative prior standard deviation of unknown biases and scales
constexpr double far_direction_rad = 0.3;
constexpr double telling_contrast = 0.5;  // smallest useful result of least_contrast()

// Returns the directions of the field from which the fits start.
std::vector<Eigen::Vector3d> starts_of(const PoseModelSetup& setup) {
  const Eigen::Vector3d expected =
      setup.field.in_table.value_or(Eigen::Vector3d::UnitZ()).normalized();
  if (setup.direction_sd_rad < far_direction_rad) {
    return {expected};
  }
  std::vector<Eigen::Vector3d> starts;
  if (setup.direction_sd_rad < any_direction_rad) {  // only the heading of the table is unknown
    constexpr int headings = 12;
    for (int i = 0; i < headings; ++i) {
      starts.emplace_back(
          Eigen::AngleAxisd(2.0 * std::numbers::pi * i / headings, Eigen::Vector3d::UnitZ()) *
          expected);
    }
    return starts;
  }
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        if (x != 0 || y != 0 || z != 0) {
          starts.emplace_back(Eigen::Vector3d(x, y, z).normalized());
        }
      }
    }
  }
  return starts;
}

// Returns two unit vectors that are perpendicular to a vector and to each other.
Eigen::Matrix<double, 3, 2> tangents_of(const Eigen::Vector3d& vector) {
  Eigen::Matrix<double, 3, 2> tangents;
  tangents.col(0) = vector.normalized().unitOrthogonal();
  if (vector.head<2>().norm() < 1e-3 * vector.norm()) {
    tangents.col(0) = (Eigen::Vector3d::UnitX() - vector * vector.x() / vector.squaredNorm());
    tangents.col(0).normalize();
  }
  tangents.col(1) = vector.normalized().cross(tangents.col(0));
  return tangents;
}

// Returns the derivative of a reading with respect to the parameters: bias (m), sensitivity by rows
// (3 m), direction of the field (2) and common scale (1). The column of the common scale is zero,
// because only the prior depends on that scale.
// @param rotation  rotation from the table's frame to the sensor's frame, times the field level.
Eigen::MatrixXd derivative_of_reading(const PoseModelFit& fit, const Eigen::Matrix3d& rotation) {
  const Eigen::Index m = fit.response.bias.size();
  const Eigen::Vector3d in_sensor = rotation * fit.field_in_table;
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(m, 4 * m + 3);
  J.leftCols(m).setIdentity();
  J.middleCols<2>(4 * m) = fit.response.sensitivity * rotation * fit.field_by_tangents;
  for (Eigen::Index k = 0; k < m; ++k) {
    J.block<1, 3>(k, m + 3 * k) = in_sensor.transpose();
  }
  return J;
}

// Writes the prior of bias, sensitivity, field direction and common scale to J and r as weighted
// equations of the least-squares problem. The first equation is in row `row`.
void put_expectations(const PoseModelSetup& setup,
                      const Eigen::MatrixXd& nominal_axes,
                      double scale,
                      const PoseModelFit& fit,
                      const Eigen::Vector2d& tilt,
                      double common_scale,
                      Eigen::Index row,
                      Eigen::MatrixXd& J,
                      Eigen::VectorXd& r) {
  const LinearResponse& response = fit.response;
  const Eigen::Index m = response.bias.size();
  const Eigen::Index tangent = 4 * m;
  const Eigen::Index common = tangent + 2;
  const double unit = scale / setup.field.magnitude;
  const double expected_scale = setup.nominal_sensitivity.value_or(0.0);
  const double bias_sd = setup.nominal_sensitivity ? 0.3 * scale : wide * scale;
  for (Eigen::Index k = 0; k < m; ++k, ++row) {
    J(row, k) = 1.0 / bias_sd;
    r(row) = -response.bias(k) / bias_sd;
  }
  const double sensitivity_sd = setup.misalignment_sd * unit;
  for (Eigen::Index k = 0; k < m; ++k) {
    for (Eigen::Index j = 0; j < 3; ++j, ++row) {
      J(row, m + 3 * k + j) = 1.0 / sensitivity_sd;
      J(row, common) = -nominal_axes(k, j) / sensitivity_sd;
      r(row) = -(response.sensitivity(k, j) - common_scale * nominal_axes(k, j)) / sensitivity_sd;
    }
  }
  for (Eigen::Index j = 0; j < 2; ++j, ++row) {
    J(row, tangent + j) = 1.0 / setup.direction_sd_rad;
    r(row) = -tilt(j) / setup.direction_sd_rad;
  }
  const double common_sd = setup.nominal_sensitivity ? 0.1 * unit : wide * unit;
  J(row, common) = 1.0 / common_sd;
  r(row) = (expected_scale - common_scale) / common_sd;
}

}  // namespace

PoseModel::PoseModel(PoseModelSetup setup)
    : setup_(std::move(setup)), directions_(starts_of(setup_)) {
  if (setup_.nominal_axes.rows() != setup_.instrument.axis_count()) {
    throw DomainError(
        "PoseModel: the number of nominal axes must equal the number of the instrument's axes");
  }
}

bool PoseModel::is_usable() const {
  // For a sum of fields the magnitude is unknown, and the direction depends on the level.
  return !setup_.instrument.one_sided && setup_.field.parts.empty() &&
         setup_.nominal_axes.rowwise().norm().minCoeff() > 0.0 && setup_.field.magnitude > 0.0;
}

// Returns the matrix that converts PoseModelSetup::field, in the table's frame, to the field that
// acts on the sensor, in the sensor's frame, if the reading was taken at `point`. It is the product
// of the field level, the rotation from table to sensor, and PlacedReading::field_turn.
Eigen::Matrix3d PoseModel::rotation_at(const PlacedReading& reading,
                                       const DesignPoint& point) const {
  return reading.entry.level.of_all() * setup_.rotation_sensor_from_positioner *
         setup_.positioner.rotation_table_from_positioner(point).transpose() * reading.field_turn;
}

// Returns the nominal response of the axes, for a sensitivity of 1, to a field of magnitude 1 that
// has the given direction in the table's frame.
Eigen::VectorXd PoseModel::seen(const PlacedReading& reading,
                                const Eigen::Vector3d& direction) const {
  const Eigen::VectorXd along =
      setup_.nominal_axes * rotation_at(reading, reading.entry.point) * direction;
  return setup_.instrument.one_sided ? along.cwiseMax(0.0).eval() : along;
}

double PoseModel::least_contrast(const PlacedReading& one,
                                 const PlacedReading& other,
                                 const std::vector<PoseModelFit>& fits) const {
  if (!setup_.field.parts.empty()) {
    return 0.0;
  }
  double least = std::numeric_limits<double>::infinity();
  const auto look = [&](const Eigen::Vector3d& direction) {
    least = std::min(least, (seen(one, direction) - seen(other, direction)).norm());
  };
  for (const PoseModelFit& fit : fits) {
    look(fit.field_in_table.normalized());
  }
  if (fits.empty()) {
    std::for_each(directions_.begin(), directions_.end(), look);
  }
  return least;
}

// True if the readings determine the scale for every possible direction of the field. False, for
// example, if an axis is perpendicular to the field in all readings, or if the turntable was at
// rest in all readings.
bool PoseModel::shows_scale(const std::vector<PlacedReading>& readings) const {
  return std::all_of(directions_.begin(), directions_.end(), [&](const Eigen::Vector3d& direction) {
    std::vector<Eigen::VectorXd> all;
    double largest = 0.0;
    for (const PlacedReading& reading : readings) {
      all.push_back(seen(reading, direction));
      for (const Eigen::VectorXd& before : all) {
        largest = std::max(largest, (all.back() - before).norm());
      }
    }
    return largest > telling_contrast;
  });
}

// Returns the effect of the field on a reading: sensitivity times field magnitude [unit]. If the
// nominal sensitivity is unknown, the effect is computed from differences between readings, because
// biases may be far larger than the effect. Returns nullopt if the readings do not determine it.
std::optional<double> PoseModel::scale_of(const std::vector<PlacedReading>& readings) const {
  if (setup_.nominal_sensitivity) {
    return std::abs(*setup_.nominal_sensitivity) * setup_.field.magnitude;
  }
  if (!shows_scale(readings)) {
    return std::nullopt;
  }
  double largest = 0.0;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Eigen::VectorXd difference = readings[i].mean - readings[j].mean;
      largest = std::max(largest, difference.norm() / std::numbers::sqrt2);
    }
  }
  return largest > 0.0 ? std::optional(largest) : std::nullopt;
}

std::vector<PoseModelFit> PoseModel::fits(const std::vector<PlacedReading>& known) const {
  if (known.empty() || !is_usable()) {
    return {};
  }
  const std::optional<double> scale = scale_of(known);
  return scale ? fits(known, *scale) : std::vector<PoseModelFit>();
}

std::optional<PoseModelFit> PoseModel::fit(const std::vector<PlacedReading>& known) const {
  std::vector<PoseModelFit> all = fits(known);
  return all.empty() ? std::nullopt : std::optional(std::move(all.front()));
}

std::vector<PoseModelFit> PoseModel::fits(const std::vector<PlacedReading>& known,
                                          double scale) const {
  std::vector<PoseModelFit> all;
  for (const Eigen::Vector3d& direction : directions_) {
    if (std::optional<PoseModelFit> one = fit_from(known, scale, direction)) {
      all.push_back(std::move(*one));
    }
  }
  std::sort(all.begin(), all.end(),
            [](const PoseModelFit& a, const PoseModelFit& b) { return a.cost < b.cost; });
  const auto too_bad = std::find_if(all.begin(), all.end(), [&](const PoseModelFit& one) {
    return one.cost > all.front().cost + fitting_misfit * all.front().variance_factor;
  });
  all.erase(too_bad, all.end());
  return all;
}

// Returns the standard deviation of the cube's orientation in a pose [rad]. It is larger for
// instruments with fewer than three axes, because their first readings determine only the product
// of slope and cross-axis sensitivity, not the two factors.
double PoseModel::placement_sd() const {
  constexpr double of_few_axes = 0.02;
  return setup_.instrument.axis_count() < 3 ? std::hypot(setup_.placement_sd_rad, of_few_axes)
                                            : setup_.placement_sd_rad;
}

std::optional<PoseModelFit> PoseModel::fit_from(const std::vector<PlacedReading>& known,
                                                double scale,
                                                const Eigen::Vector3d& start) const {
  const Eigen::Index m = setup_.instrument.axis_count();
  const auto n = static_cast<Eigen::Index>(known.size());
  const Eigen::Index unknowns = 4 * m + 3;
  const Eigen::Index tangent = 4 * m;
  const Eigen::Index common = tangent + 2;
  const double magnitude = setup_.field.magnitude;
  const double unit = scale / magnitude;
  const double placement = placement_sd() * scale;
  PoseModelFit fit;
  fit.field_in_table = start.normalized() * magnitude;
  fit.response.bias = Eigen::VectorXd::Zero(m);
  fit.response.sensitivity = unit * setup_.nominal_axes;
  double common_scale = setup_.nominal_sensitivity.value_or(unit);
  const Eigen::Vector3d home = fit.field_in_table;
  const Eigen::Matrix<double, 3, 2> tangents = tangents_of(home);
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();
  Eigen::MatrixXd factor;
  for (int round = 0; round < rounds; ++round) {
    const Eigen::Index rows = n * m + 4 * m + 3;
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(rows, unknowns);
    Eigen::VectorXd r = Eigen::VectorXd::Zero(rows);
    const Eigen::Vector3d raw = home + magnitude * tangents * tilt;
    const Eigen::Matrix3d onto_sphere =
        magnitude / raw.norm() *
        (Eigen::Matrix3d::Identity() - raw * raw.transpose() / raw.squaredNorm());
    fit.field_by_tangents = onto_sphere * (magnitude * tangents);
    for (Eigen::Index i = 0; i < n; ++i) {
      const PlacedReading& reading = known[static_cast<std::size_t>(i)];
      const Eigen::Matrix3d R = rotation_at(reading, reading.entry.point);
      const Eigen::VectorXd weight =
          (reading.u.array().square() + placement * placement).rsqrt().matrix();
      J.middleRows(i * m, m) = weight.asDiagonal() * derivative_of_reading(fit, R);
      r.segment(i * m, m) =
          weight.cwiseProduct(reading.mean - fit.response.at(R * fit.field_in_table));
    }
    put_expectations(setup_, setup_.nominal_axes, scale, fit, tilt, common_scale, n * m, J, r);
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(J);
    factor = qr.matrixQR().topRows(unknowns).triangularView<Eigen::Upper>();
    const Eigen::VectorXd step = qr.solve(r);
    if (!step.allFinite()) {
      return {};
    }
    fit.cost = r.squaredNorm();
    fit.response.bias += step.head(m);
    for (Eigen::Index k = 0; k < m; ++k) {
      fit.response.sensitivity.row(k) += step.segment<3>(m + 3 * k).transpose();
    }
    // Limits the change of the field's direction to the range in which the model is nearly linear.
    tilt += step.segment<2>(tangent) /
            std::max(1.0, step.segment<2>(tangent).norm() / far_direction_rad);
    common_scale += step(common);
    fit.field_in_table = (home + magnitude * tangents * tilt).normalized() * magnitude;
  }
  const Eigen::MatrixXd inverse =
      factor.triangularView<Eigen::Upper>().solve(Eigen::MatrixXd::Identity(unknowns, unknowns));
  // Increases the covariance if the residuals are larger than the stated uncertainties.
  const double contradiction = n > 2 ? fit.cost / static_cast<double>(n * m) : 1.0;
  fit.variance_factor = std::max(1.0, contradiction);
  fit.covariance = fit.variance_factor * (inverse * inverse.transpose());
  const Eigen::Matrix3d in_table =
      tangents * fit.covariance.block<2, 2>(tangent, tangent) * tangents.transpose();
  fit.slope_u = in_table.diagonal().head<2>().cwiseMax(0.0).cwiseSqrt();
  return fit;
}

std::optional<PoseJudgement> PoseModel::judge(const std::vector<PlacedReading>& known,
                                              const PlacedReading& reading) const {
  if (!is_usable() || (known.empty() && !setup_.nominal_sensitivity)) {
    return {};
  }
  std::vector<PlacedReading> all = known;
  all.push_back(reading);
  const std::optional<double> scale = scale_of(all);
  if (!scale) {
    return {};
  }
  const std::vector<PoseModelFit> models = fits(known, *scale);
  if (models.empty()) {
    return {};
  }
  const double placement = placement_sd() * *scale;
  // The fits differ in the direction of the field. The misfit of a pose is the smallest misfit over
  // all fits, so that a pose is rejected only if it contradicts every fit.
  const auto misfit_of = [&](const DesignPoint& point) {
    const Eigen::Matrix3d R = rotation_at(reading, point);
    double least = std::numeric_limits<double>::infinity();
    for (const PoseModelFit& model : models) {
      const Eigen::MatrixXd J = derivative_of_reading(model, R);
      Eigen::MatrixXd C = J * model.covariance * J.transpose();
      C.diagonal().array() +=
          model.variance_factor * (reading.u.array().square() + placement * placement);
      const Eigen::VectorXd difference = reading.mean - model.response.at(R * model.field_in_table);
      least = std::min(least, (model.cost - models.front().cost) / models.front().variance_factor +
                                  difference.dot(C.llt().solve(difference)));
    }
    return least;
  };
  PoseJudgement judgement{
      .best = reading.entry.point, .log_ratio = 0.0, .misfit = misfit_of(reading.entry.point)};
  judgement.best_misfit = judgement.misfit;
  for (const DesignEntry& entry : standard_design(24)) {
    const double misfit = misfit_of(entry.point);
    if (misfit < judgement.best_misfit) {
      judgement.best = entry.point;
      judgement.best_misfit = misfit;
    }
  }
  judgement.log_ratio = 0.5 * (judgement.misfit - judgement.best_misfit);
  judgement.looks_like_another =
      judgement.log_ratio > telling_log_ratio && judgement.best_misfit < fitting_misfit;
  judgement.fits_none = !judgement.looks_like_another && known.size() >= readings_to_rely_on &&
                        judgement.misfit > no_pose_misfit && judgement.best_misfit > fitting_misfit;
  return judgement;
}

}  // namespace axiscal
