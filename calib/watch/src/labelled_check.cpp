// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/labelled_check.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/reading_uncertainty.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/rotation.hpp"
#include "block_changes.hpp"

namespace axiscal {
namespace {

// Generalised least squares of e on the columns of A with errors of covariance V.
struct WeighedFit {
  Eigen::VectorXd estimate;
  Eigen::MatrixXd covariance;
  Eigen::VectorXd left;        // of e, in units of its scatter
  Eigen::VectorXd left_share;  // of each, what the fit leaves of its variance
};

WeighedFit fit_weighed(const Eigen::VectorXd& e,
                       const Eigen::MatrixXd& A,
                       const Eigen::MatrixXd& V) {
  const Eigen::LLT<Eigen::MatrixXd> root(V);
  const Eigen::MatrixXd WA = root.matrixL().solve(A);
  const Eigen::VectorXd We = root.matrixL().solve(e);
  WeighedFit fit;
  fit.covariance = (WA.transpose() * WA).inverse();
  fit.estimate = fit.covariance * (WA.transpose() * We);
  fit.left = We - WA * fit.estimate;
  fit.left_share =
      Eigen::VectorXd::Ones(e.size()) - (WA * fit.covariance).cwiseProduct(WA).rowwise().sum();
  return fit;
}

// The readings that are to be held against the record.
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

// Satterthwaite's degrees of freedom of an axis's share, part of it by the scatter of blocks.
double freedom_with_blocks(const Eigen::MatrixXd& V,
                           const Eigen::MatrixXd& within,
                           Eigen::Index axis,
                           Eigen::Index m,
                           double nu,
                           double of_blocks) {
  if (!(of_blocks > 0.0)) {
    return nu;
  }
  const auto rows = Eigen::seq(axis, V.rows() - 1, m);
  const Eigen::MatrixXd own = V(rows, rows);
  const double share =
      Eigen::LDLT<Eigen::MatrixXd>(own).solve(Eigen::MatrixXd(within(rows, rows))).trace() /
      static_cast<double>(own.rows());
  return 1.0 / (share * share / nu + (1.0 - share) * (1.0 - share) / of_blocks);
}

// By how much the cube turns each time it is laid, about each axis, as far as the record tells it
// from other scatter [rad]; 0 if it does not.
double seat_scatter_rad(const Calibration& record) {
  for (const ScatterComponent& component : record.fit.statistics->components) {
    if (component.name == "seats" && component.sd.size() > 0) {
      return component.sd(0);
    }
  }
  return 0.0;
}

// That what is left is by chance: each axis has its own scatter, known from the calibration by its
// own degrees of freedom; Fisher's method puts them together.
double p_of(const WeighedFit& fit, const Eigen::VectorXd& degrees_of_freedom) {
  const Eigen::Index m = degrees_of_freedom.size();
  FisherSum axes;
  for (Eigen::Index k = 0; k < m; ++k) {
    double squares = 0.0;
    double q = 0.0;
    for (Eigen::Index i = k; i < fit.left.size(); i += m) {
      squares += fit.left(i) * fit.left(i);
      q += fit.left_share(i);
    }
    axes.add(f_upper_p(std::max(squares / q, 1e-12), q, degrees_of_freedom(k)));
  }
  return axes.p_value();
}

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
    throw DomainError("the record states no covariance to hold readings against");
  }
  if (!sensor.field.parts.empty() || !sensor.also.empty() || sensor.instrument.one_sided) {
    throw RefusedError(
        "a few readings are held against a record of one field and plain axes; take a whole "
        "design");
  }
  if (observations.response.cols() != m || n * m < m + 3) {
    throw RefusedError(
        formatted("{} readings say nothing beyond the field's direction and the "
                  "biases: take {} or more at different faces",
                  n, (m + 3 + m - 1) / m));
  }
  if (!observations.has_fence) {
    throw RefusedError(
        "the readings say which face was down, but not how the cube lay on it: a few of them need "
        "the column fence");
  }
  const FieldDescription here = make_field_description(experiment);
  if (here.unit != sensor.field.unit) {
    throw RefusedError(
        formatted("the record's field is in {}, the readings' in {}: state the "
                  "field's size here in the record's unit",
                  sensor.field.unit, here.unit));
  }
  std::vector<Eigen::Matrix3d> R;
  for (const Reading& reading : observations.readings) {
    R.emplace_back(
        experiment.rotation_sensor_from_positioner *
        experiment.positioner.rotation_table_from_positioner(*reading.point).transpose() *
        reading.level.of_all());
  }
  const Eigen::MatrixXd C = covariance_within_blocks(record);
  const Eigen::VectorXd& sd = record.fit.statistics->residual_sd;
  Eigen::Vector3d field = here.in_table.value_or(here.magnitude * Eigen::Vector3d::UnitZ());
  Eigen::VectorXd e(n * m);
  Eigen::MatrixXd J(n * m, C.rows());
  Eigen::MatrixXd A(n * m, 2);
  Eigen::MatrixXd V;
  Eigen::VectorXd freedom = record.fit.statistics->degrees_of_freedom;
  const double seat_rad = seat_scatter_rad(record);
  WeighedFit fit;
  constexpr int most_rounds = 20;
  bool still = false;
  for (int round = 0; round < most_rounds && !still; ++round) {
    const Eigen::Matrix<double, 3, 2> tangents = tangents_of(field);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const Eigen::Vector3d met = R[at] * field;
      e.segment(m * i, m) = observations.response.row(i).transpose() - sensor.response.at(met);
      J.middleRows(m * i, m) = change_with_parameters(record, met, {});
      A.middleRows(m * i, m) = sensor.response.sensitivity * R[at] * tangents * field.norm();
    }
    V = J * C * J.transpose();
    for (Eigen::Index i = 0; i < n * m; ++i) {
      V(i, i) += std::max(sd(i % m) * sd(i % m), 1e-300);
    }
    // A record that knows how the cube turns each time it is laid has a residual sd without that.
    for (Eigen::Index i = 0; i < n && seat_rad > 0.0; ++i) {
      const Eigen::MatrixXd turned = seat_rad * sensor.response.sensitivity *
                                     R[static_cast<std::size_t>(i)] * cross_matrix(field);
      V.block(m * i, m * i, m, m) += turned * turned.transpose();
    }
    const Eigen::MatrixXd within = V;
    // They are of another block than the record's: each axis may be off by as much as blocks are.
    for (Eigen::Index k = 0; k < m; ++k) {
      const BlockScatter blocks =
          scatter_of_blocks(record, sensor.instrument.axes[static_cast<std::size_t>(k)] + ".bias");
      const double between = blocks.mean_square * (1.0 + 1.0 / blocks.blocks);
      for (Eigen::Index i = k; blocks.degrees_of_freedom > 0.0 && i < n * m; i += m) {
        for (Eigen::Index j = k; j < n * m; j += m) {
          V(i, j) += between;
        }
      }
      // How much of what is judged is of blocks decides by how many of their degrees of freedom.
      freedom(k) = freedom_with_blocks(
          V, within, k, m, record.fit.statistics->degrees_of_freedom(k), blocks.degrees_of_freedom);
    }
    fit = fit_weighed(e, A, V);
    field = field.norm() * (field + field.norm() * (tangents * fit.estimate)).normalized();
    constexpr double still_rad = 1e-9;
    still = fit.estimate.norm() < still_rad;
  }
  // With a change of each bias.
  Eigen::MatrixXd with_biases(n * m, 2 + m);
  with_biases << A, Eigen::MatrixXd::Identity(m, m).replicate(n, 1);
  if (!still || with_biases.colPivHouseholderQr().rank() < with_biases.cols()) {
    throw RefusedError(
        "the readings do not tell the field's direction in the table and the biases apart; take "
        "them at different faces");
  }
  DriftCheck check{.alpha = alpha,
                   .pitch_error_deg = not_a_number,
                   .pitch_error_u_deg = not_a_number,
                   .pitch_error_expanded_deg = not_a_number};
  check.p_value = p_of(fit, freedom);
  check.drifted = check.p_value < alpha;
  const WeighedFit shifted = fit_weighed(e, with_biases, V);
  for (Eigen::Index k = 0; k < m; ++k) {
    const double change = shifted.estimate(2 + k);
    const double u = std::sqrt(shifted.covariance(2 + k, 2 + k));
    check.changes.push_back(
        {.parameter = sensor.instrument.axes[static_cast<std::size_t>(k)] + ".bias",
         .old_value = sensor.response.bias(k),
         .new_value = sensor.response.bias(k) + change,
         .u = u,
         .z = change / u,
         .e_n = not_a_number});
  }
  check.notes.push_back(formatted(
      "the {} readings are held against the values that the record predicts for them, with "
      "the field's direction in the table fitted; the changes are those of the biases, "
      "with the sensitivities as they were",
      n));
  return check;
}

}  // namespace axiscal
