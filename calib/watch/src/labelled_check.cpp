// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/labelled_check.hpp"

#include <algorithm>
#include <cmath>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/reading_uncertainty.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/rotation.hpp"
#include "calib/regression/factor.hpp"
#include "calib/regression/gauss_newton.hpp"
#include "calib/watch/src/block_changes.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// The result of a generalised least-squares fit of the columns of A to e, whose errors have the
// covariance V.
struct WeighedFit {
  Eigen::VectorXd estimate;
  Eigen::MatrixXd covariance;
  Eigen::VectorXd left;        // residuals of e, whitened
  Eigen::VectorXd left_share;  // 1 - leverage of each entry of e
};

WeighedFit fit_weighed(const Eigen::VectorXd& e,
                       const Eigen::MatrixXd& A,
                       const Eigen::MatrixXd& V) {
  const Whitening whitening(V);
  const Eigen::MatrixXd WA = whitening.times(A);
  const Eigen::VectorXd We = whitening.times(e);
  const Factor qr(WA);
  WeighedFit fit;
  fit.covariance = qr.covariance();
  fit.estimate = qr.solve(We);
  fit.left = We - WA * fit.estimate;
  fit.left_share = Eigen::VectorXd::Ones(e.size()) - qr.leverage();
  return fit;
}

// Returns the readings to compare with the record.
Observations wanted_of(const Experiment& experiment, const Observations& observations) {
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    const Reading& reading = observations.readings[i];
    const std::vector<int>& out = experiment.leave_out;
    if (!reading.confirm && std::find(out.begin(), out.end(), reading.run) == out.end()) {
      rows.push_back(i);
    }
  }
  return select_rows(observations, rows);
}

// Returns the standard deviation [rad] with which the cube's orientation varies about each axis
// when the cube is placed again; 0 if the record does not state this scatter separately.
double seat_scatter_rad(const Calibration& record) {
  for (const ScatterComponent& component : record.fit.statistics->components) {
    if (component.name == "seats" && component.sd.size() > 0) {
      return component.sd(0);
    }
  }
  return 0.0;
}

// Adds the p-value of each axis's residuals to `tests`.
// @param degrees_of_freedom  degrees of freedom of each axis's scatter in the record.
void add_residuals(const WeighedFit& fit,
                   const Eigen::VectorXd& degrees_of_freedom,
                   FisherSum& tests) {
  constexpr double fewest_left = 0.5;
  const Eigen::Index m = degrees_of_freedom.size();
  for (Eigen::Index k = 0; k < m; ++k) {
    double squares = 0.0;
    double q = 0.0;
    for (Eigen::Index i = k; i < fit.left.size(); i += m) {
      squares += fit.left(i) * fit.left(i);
      q += fit.left_share(i);
    }
    if (q > fewest_left) {
      tests.add(f_upper_p(std::max(squares / q, 1e-12), q, degrees_of_freedom(k)));
    }
  }
}

// Adds the p-value of the change of each bias to `tests`. The variance of a change is the sum of
// the variances from the noise and from the scatter between blocks. Satterthwaite's formula gives
// its degrees of freedom.
void add_changes_of_biases(const WeighedFit& shifted,
                           const std::vector<BlockScatter>& blocks,
                           const Eigen::VectorXd& degrees_of_freedom,
                           FisherSum& tests) {
  for (Eigen::Index k = 0; k < degrees_of_freedom.size(); ++k) {
    const BlockScatter& scatter = blocks[static_cast<std::size_t>(k)];
    const double by_noise = shifted.covariance(2 + k, 2 + k);
    const double between = scatter.of_another_block();
    const double share = by_noise / (by_noise + between);
    const double nu =
        1.0 / (share * share / degrees_of_freedom(k) +
               (between > 0.0 ? (1.0 - share) * (1.0 - share) / scatter.degrees_of_freedom : 0.0));
    tests.add(student_t_two_sided_p(shifted.estimate(2 + k) / std::sqrt(by_noise + between), nu));
  }
}

// The readings minus the values that a record predicts for a field in the table frame.
struct Deviations : Linearised {
  Eigen::VectorXd e;  // n m deviations, ordered by reading [unit of the readings]
  // Derivative of the predictions with respect to a small rotation of the field [unit/rad].
  Eigen::MatrixXd A;
  Eigen::MatrixXd V;  // covariance of e, without the scatter of blocks
};

// The problem for gauss_newton() that fits the direction of the field in the table.
class DirectionProblem {
 public:
  using State = Eigen::Vector3d;
  using Linear = Deviations;

  // `record` and `observations` must outlive the problem.
  DirectionProblem(const Calibration& record,
                   const Experiment& experiment,
                   const Observations& observations)
      : record_(record),
        observations_(observations),
        covariance_(covariance_within_blocks(record)),
        seat_rad_(seat_scatter_rad(record)) {
    for (const Reading& reading : observations.readings) {
      rotations_.emplace_back(
          experiment.rotation_sensor_from_positioner *
          experiment.positioner.rotation_table_from_positioner(*reading.point).transpose() *
          reading.level.of_all());
    }
  }

  void linearise(const Eigen::Vector3d& field, Deviations& linear) const {
    const Eigen::Index n = observations_.size();
    const LinearResponse& response = record_.sensor.response;
    const Eigen::Index m = response.bias.size();
    const Eigen::Matrix<double, 3, 2> tangents = tangents_of(field);
    linear.e = deviations(field);
    linear.A.resize(n * m, 2);
    Eigen::MatrixXd J(n * m, covariance_.rows());
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Matrix3d& R = rotations_[static_cast<std::size_t>(i)];
      J.middleRows(m * i, m) = change_with_parameters(record_, R * field, {});
      linear.A.middleRows(m * i, m) = response.sensitivity * R * tangents * field.norm();
    }
    linear.V = J * covariance_ * J.transpose();
    add_scatter(field, linear);
    const Whitening whitening(linear.V);
    linear.residuals = whitening.times(linear.e);
    linear.jacobian = -whitening.times(linear.A);
  }

  [[nodiscard]] static Eigen::Vector3d moved(const Eigen::Vector3d& field,
                                             const Eigen::VectorXd& step) {
    return field.norm() * (field + field.norm() * (tangents_of(field) * step)).normalized();
  }

  [[nodiscard]] double cost(const Eigen::Vector3d& field, const Deviations& linear) const {
    return Whitening(linear.V).times(deviations(field)).squaredNorm();
  }

  [[nodiscard]] static double length(const Eigen::Vector3d& /*field*/,
                                     const Eigen::VectorXd& step,
                                     const Deviations& /*linear*/) {
    return step.norm();
  }

 private:
  [[nodiscard]] Eigen::VectorXd deviations(const Eigen::Vector3d& field) const {
    const Eigen::Index m = record_.sensor.response.bias.size();
    Eigen::VectorXd e(observations_.size() * m);
    for (Eigen::Index i = 0; i < observations_.size(); ++i) {
      e.segment(m * i, m) =
          observations_.response.row(i).transpose() -
          record_.sensor.response.at(rotations_[static_cast<std::size_t>(i)] * field);
    }
    return e;
  }

  // Adds two variances to V: that of the readings' noise, and that of the cube's orientation, which
  // varies each time the cube is placed again.
  void add_scatter(const Eigen::Vector3d& field, Deviations& linear) const {
    const Eigen::Index n = observations_.size();
    const LinearResponse& response = record_.sensor.response;
    const Eigen::Index m = response.bias.size();
    const Eigen::VectorXd& sd = record_.fit.statistics->residual_sd;
    Eigen::MatrixXd& V = linear.V;
    for (Eigen::Index i = 0; i < n * m; ++i) {
      V(i, i) += std::max(sd(i % m) * sd(i % m), 1e-300);
    }
    for (Eigen::Index i = 0; i < n && seat_rad_ > 0.0; ++i) {
      const Eigen::MatrixXd turned = seat_rad_ * response.sensitivity *
                                     rotations_[static_cast<std::size_t>(i)] * cross_matrix(field);
      V.block(m * i, m * i, m, m) += turned * turned.transpose();
    }
  }

  const Calibration& record_;
  const Observations& observations_;
  Eigen::MatrixXd covariance_;
  double seat_rad_;
  std::vector<Eigen::Matrix3d> rotations_;
};

}  // namespace

DriftCheck check_labelled(const Calibration& record,
                          const Experiment& experiment,
                          const Observations& given,
                          double alpha) {
  const SensorModel& sensor = record.sensor;
  const Observations observations = wanted_of(experiment, given);
  const Eigen::Index n = observations.size();
  const Eigen::Index m = sensor.response.bias.size();
  if (!record.fit.statistics || record.fit.statistics->covariance.size() == 0) {
    throw DomainError("the record lacks the covariance, so readings cannot be compared with it");
  }
  if (!sensor.field.parts.empty() || !sensor.also.empty() || sensor.instrument.one_sided) {
    throw RefusedError(
        "a few readings cannot be compared with a record that has several fields or one-sided "
        "axes; take the readings of a whole design");
  }
  if (observations.response.cols() != m || n * m < m + 3) {
    throw RefusedError(formatted(
        "too few readings ({}): they are just enough to compute the field's direction and the "
        "biases, and none is left to check the record. Take {} readings or more on different faces",
        n, (m + 3 + m - 1) / m));
  }
  if (!observations.has_fence) {
    throw RefusedError(
        "the readings name the face on the table, but not the face at the fence: add the column "
        "'fence'");
  }
  const FieldDescription here = make_field_description(experiment);
  if (here.unit != sensor.field.unit) {
    throw RefusedError(
        formatted("the field is in {} in the record, but in {} for the readings: give the "
                  "magnitude of the field in the unit of the record",
                  sensor.field.unit, here.unit));
  }
  const DirectionProblem problem(record, experiment, observations);
  const GaussNewtonResult<Eigen::Vector3d> found =
      gauss_newton(problem, here.in_table.value_or(here.magnitude * Eigen::Vector3d::UnitZ()));
  Deviations at;
  problem.linearise(found.state, at);
  Eigen::MatrixXd with_biases(n * m, 2 + m);
  with_biases << at.A, Eigen::MatrixXd::Identity(m, m).replicate(n, 1);
  if (!found.converged || Factor(with_biases).rank() < with_biases.cols()) {
    throw RefusedError(
        "the readings do not separate the field's direction in the table's frame from the biases; "
        "take readings on more faces");
  }
  DriftCheck check{.alpha = alpha,
                   .pitch_error_deg = not_a_number,
                   .pitch_error_u_deg = not_a_number,
                   .pitch_error_expanded_deg = not_a_number};
  const WeighedFit shifted = fit_weighed(at.e, with_biases, at.V);
  const Eigen::VectorXd& freedom = record.fit.statistics->degrees_of_freedom;
  // The new readings form a different block from those of the record. The offset of this block
  // has few degrees of freedom and the residuals have many, so the two are tested separately.
  std::vector<BlockScatter> blocks;
  for (const std::string& axis : sensor.instrument.axes) {
    blocks.push_back(scatter_of_blocks(record, axis + ".bias"));
  }
  FisherSum tests;
  if (std::any_of(blocks.begin(), blocks.end(),
                  [](const BlockScatter& one) { return one.degrees_of_freedom > 0.0; })) {
    add_residuals(shifted, freedom, tests);
    add_changes_of_biases(shifted, blocks, freedom, tests);
  } else {
    add_residuals(fit_weighed(at.e, at.A, at.V), freedom, tests);
  }
  check.p_value = tests.p_value();
  check.drifted = check.p_value < alpha;
  for (Eigen::Index k = 0; k < m; ++k) {
    const double change = shifted.estimate(2 + k);
    const double u = std::sqrt(shifted.covariance(2 + k, 2 + k) +
                               blocks[static_cast<std::size_t>(k)].of_another_block());
    check.changes.push_back(
        {.parameter = sensor.instrument.axes[static_cast<std::size_t>(k)] + ".bias",
         .old_value = sensor.response.bias(k),
         .new_value = sensor.response.bias(k) + change,
         .u = u,
         .z = change / u,
         .e_n = not_a_number});
  }
  check.notes.push_back(formatted(
      "the {} readings are compared with the predictions of the record, after a fit of the field's "
      "direction in the table's frame. The changes of the biases are valid only if the "
      "sensitivities have not changed",
      n));
  return check;
}

}  // namespace axiscal
