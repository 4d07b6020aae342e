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
  const ScatterComponent* const seats = record.fit.statistics->find_component("seats");
  return seats != nullptr && seats->sd.size() > 0 ? seats->sd(0) : 0.0;
}

// Returns the variances with which the sensitivities of a new block scatter about those of the
// record, m x 3; 0 x 3 if the record does not show that sensitivities differ between blocks.
SensitivityMatrix gain_variance_of(const Calibration& record) {
  const CalibrationConditions& conditions = record.fit.conditions;
  const bool differ = record.fit.statistics->find_component("block_sensitivities") != nullptr;
  return differ && conditions.sensitivity_degrees_of_freedom > 0.0
             ? SensitivityMatrix(conditions.sensitivity_mean_square *
                                 (1.0 + 1.0 / static_cast<double>(conditions.blocks)))
             : SensitivityMatrix(0, 3);
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

// The changes of the biases, in units of the noise of one block of the record.
struct BiasChanges {
  Eigen::VectorXd change;           // m
  Eigen::MatrixXd by_noise;         // m x m: covariance of the changes from the noise
  Eigen::ArrayXd ratios;            // m estimates of r, the variance of the bias of a block
  double degrees_of_freedom = 0.0;  // of each ratio
  double blocks = 1.0;              // number B of blocks of the record
};

BiasChanges changes_of_biases(const WeighedFit& shifted,
                              const std::vector<BlockScatter>& blocks,
                              const Eigen::VectorXd& noise_of_block) {
  const auto m = std::ssize(blocks);
  double largest = 1e-300;
  for (const BlockScatter& scatter : blocks) {
    largest = std::max(largest, scatter.mean_square);
  }
  // The noise of an exact record may be 0.
  const Eigen::VectorXd noise = noise_of_block.cwiseMax(1e-9 * largest);
  const Eigen::VectorXd per_sd = noise.cwiseSqrt().cwiseInverse();
  BiasChanges changes{.change = per_sd.cwiseProduct(shifted.estimate.tail(m)),
                      .by_noise = per_sd.asDiagonal() * shifted.covariance.bottomRightCorner(m, m) *
                                  per_sd.asDiagonal(),
                      .ratios = Eigen::ArrayXd(m),
                      .degrees_of_freedom = blocks.front().degrees_of_freedom,
                      .blocks = blocks.front().blocks};
  for (Eigen::Index k = 0; k < m; ++k) {
    changes.ratios(k) = blocks[static_cast<std::size_t>(k)].mean_square / noise(k);
  }
  return changes;
}

// Returns the mean of p_at(between) over the values of r, at least 1, from which the estimate
// `ratio` may come. `between` is the variance of a change from the scatter between blocks,
// (1 + 1 / B) (r - 1).
template <typename P>
double mean_p(double ratio, double degrees_of_freedom, double blocks, const P& p_at) {
  constexpr int points = 100;
  const double sum_of_squares = degrees_of_freedom * std::max(ratio, 1e-6);
  const double highest = 1.0 - chi_squared_upper_p(sum_of_squares, degrees_of_freedom);
  constexpr double computable = 1e-12;
  if (!(highest > computable)) {
    return p_at(0.0);  // the estimate is far below the noise
  }
  double sum = 0.0;
  for (int point = 0; point < points; ++point) {
    const double u = highest * (point + 0.5) / points;
    const double r = sum_of_squares / chi_squared_quantile(u, degrees_of_freedom);
    sum += p_at((1.0 + 1.0 / blocks) * std::max(r - 1.0, 0.0));
  }
  return sum / points;
}

// Returns the p-value of the changes of the biases. The record has an estimate of the scatter
// between blocks with few degrees of freedom, so p-values are means over the values that the
// scatter may have. The changes are tested one by one, because the axes may scatter differently,
// and together, because few degrees of freedom of one axis hide all but very large changes.
double p_of_biases(const BiasChanges& changes, const Eigen::VectorXd& degrees_of_freedom) {
  FisherSum one_by_one;
  for (Eigen::Index k = 0; k < changes.change.size(); ++k) {
    one_by_one.add(
        mean_p(changes.ratios(k), changes.degrees_of_freedom, changes.blocks, [&](double between) {
          return student_t_two_sided_p(
              changes.change(k) / std::sqrt(changes.by_noise(k, k) + between),
              degrees_of_freedom(k));
        }));
  }
  // Satterthwaite's number of axes. It is smaller than m if the axes scatter differently.
  const auto m = static_cast<double>(changes.ratios.size());
  const double alike = std::pow(changes.ratios.sum(), 2) / changes.ratios.square().sum();
  const double together =
      mean_p(changes.ratios.mean(), alike * changes.degrees_of_freedom, changes.blocks,
             [&](double between) {
               Eigen::MatrixXd V = changes.by_noise;
               V.diagonal().array() += between;
               const double T = Whitening(V).times(changes.change).squaredNorm();
               return chi_squared_upper_p(std::max(T * alike / m, 1e-12), alike);
             });
  return std::min(1.0, 2.0 * std::min(one_by_one.p_value(), together));
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
        gain_variance_(gain_variance_of(record)),
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
    add_gains_of_block(field, linear);
    const Whitening whitening(linear.V);
    linear.residuals = whitening.times(linear.e);
    linear.jacobian = -whitening.times(linear.A);
  }

  // Returns the variance of the bias in one block of the record from the noise, m entries.
  [[nodiscard]] Eigen::VectorXd noise_of_block() const {
    const Eigen::Index m = record_.sensor.response.bias.size();
    const Eigen::Index p = covariance_.rows() / m;
    return static_cast<double>(record_.fit.conditions.blocks) *
           covariance_.diagonal()(Eigen::seqN(0, m, p));
  }

  // Returns the degrees of freedom of each axis's scatter. They are those of the sensitivities if
  // these differ between blocks.
  [[nodiscard]] Eigen::VectorXd degrees_of_freedom() const {
    const Eigen::VectorXd& of_noise = record_.fit.statistics->degrees_of_freedom;
    return gain_variance_.rows() == 0 ? of_noise
                                      : Eigen::VectorXd(of_noise.cwiseMin(
                                            record_.fit.conditions.sensitivity_degrees_of_freedom));
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

  // Adds the covariance of the sensitivities in a new block to V. All readings share these
  // sensitivities.
  void add_gains_of_block(const Eigen::Vector3d& field, Deviations& linear) const {
    const Eigen::Index n = observations_.size();
    for (Eigen::Index k = 0; k < gain_variance_.rows(); ++k) {
      for (Eigen::Index j = 0; j < 3; ++j) {
        Eigen::VectorXd met = Eigen::VectorXd::Zero(linear.V.rows());
        for (Eigen::Index i = 0; i < n; ++i) {
          met(gain_variance_.rows() * i + k) =
              rotations_[static_cast<std::size_t>(i)].row(j).dot(field);
        }
        linear.V += gain_variance_(k, j) * met * met.transpose();
      }
    }
  }

  const Calibration& record_;
  const Observations& observations_;
  Eigen::MatrixXd covariance_;
  SensitivityMatrix gain_variance_;  // m x 3; empty if the sensitivities do not differ
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
  const Eigen::VectorXd freedom = problem.degrees_of_freedom();
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
    const double of_biases =
        p_of_biases(changes_of_biases(shifted, blocks, problem.noise_of_block()), freedom);
    check.p_value = std::min(1.0, 2.0 * std::min(tests.p_value(), of_biases));
  } else {
    add_residuals(fit_weighed(at.e, at.A, at.V), freedom, tests);
    check.p_value = tests.p_value();
  }
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
