// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "axiscal/core/rotation.hpp"
#include "calib/mistakes/src/mistake_kind.hpp"

namespace axiscal {
namespace {

constexpr std::array table_moved_advice = {
    MistakeAdvice{.code = WarningCode::table_moved,
                  .one = "Make sure that nothing moves the table, and take all readings again. Or "
                         "give the readings before and after the move different block numbers, and "
                         "fit one slope of the table for each block ('level_by')."}};

// Returns the derivative of one reading with respect to a rotation of the field in the table's
// frame, about two axes perpendicular to the field. Each axis of the instrument has one row.
Eigen::MatrixX2d table_rows(const SuspectRun& run,
                            std::size_t i,
                            const TableField& field,
                            const Eigen::MatrixXd& coefficients) {
  const std::size_t tilt = run.set().tilt_of(i);
  // The tangents are taken at the field of the plain fit, because the basis of tangents_of() is
  // discontinuous at some directions.
  const Eigen::Matrix<double, 3, 2> change = run.set().readings[i].level.of_all() *
                                             field.vector(tilt).norm() * run.set().met_of_field(i) *
                                             tangents_of(run.plain().field.vector(tilt));
  return coefficients.middleRows<3>(1).transpose().lazyProduct(change);
}

// Returns the two columns for a change of the field's direction in the table frame. Only the
// readings from index `cut` of run.order() to the end of the run have entries other than 0.
Eigen::MatrixXd table_columns(const SuspectRun& run,
                              std::size_t cut,
                              const TableField& field,
                              const Eigen::MatrixXd& coefficients) {
  Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(run.n() * run.m(), 2);
  for (std::size_t at = cut; at < run.count(); ++at) {
    const std::size_t i = run.order()[at];
    const Eigen::MatrixX2d rows = table_rows(run, i, field, coefficients);
    for (Eigen::Index k = 0; k < run.m(); ++k) {
      Z.row(run.n() * k + static_cast<Eigen::Index>(i)) = rows.row(k);
    }
  }
  return Z;
}

// Returns for each cut the reduction of the sum of squares, to first order. A cut is the index in
// run.order() of the first reading after a movement of the table. The columns of a cut cover one
// reading more than the columns of the next cut. Therefore their products with the basis and with
// the residuals are computed as running sums.
std::vector<double> drops_with_table_moved(const SuspectRun& run, const HypothesisFit& fit) {
  std::vector<double> drops(run.count(), 0.0);
  Eigen::MatrixXd in_basis = Eigen::MatrixXd::Zero(fit.fit->column_count(), 2);
  Eigen::Matrix2d ZtZ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d Zte = Eigen::Vector2d::Zero();
  for (std::size_t cut = run.count() - 1; cut > 0; --cut) {
    const std::size_t i = run.order()[cut];
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::MatrixX2d Z = table_rows(run, i, fit.field, fit.coefficients);
    for (Eigen::Index k = 0; k < run.m(); ++k) {
      const Eigen::RowVector2d z =
          std::sqrt(run.set().weights(row, k)) / run.fitter().scale()(k) * Z.row(k);
      fit.fit->add_in_basis(k, row, z, in_basis);
      ZtZ += z.transpose() * z;
      Zte += z.transpose() * fit.residuals(row, k);
    }
    const Eigen::Matrix2d left = ZtZ - in_basis.transpose() * in_basis;
    drops[cut] = squares_by(left, Zte, 1e-9 * ZtZ.diagonal().maxCoeff());
  }
  return drops;
}

// Returns the cuts to fit, as indices in run.order() of the first reading after a possible movement
// of the table. If a run has too many cuts, only those that reduce the sum of squares most are
// returned. If the field is known, the result is empty.
std::vector<std::size_t> cuts_of(const SuspectRun& run) {
  std::vector<std::size_t> all;
  for (std::size_t cut = 1; cut < run.count() && !run.fitter().known_field(); ++cut) {
    all.push_back(cut);
  }
  if (all.size() > SuspectRun::each_is_fitted) {
    const std::vector<double> drops = drops_with_table_moved(run, run.plain());
    std::stable_sort(all.begin(), all.end(),
                     [&](std::size_t a, std::size_t b) { return drops[a] > drops[b]; });
    all.resize(run.max_candidate_fits());
    std::sort(all.begin(), all.end());
  }
  return all;
}

HypothesisFit fit_table_moved(const SuspectRun& run, std::size_t cut) {
  return run.fitter().fit(run.set(), {},
                          [&, cut](const TableField& field, const Eigen::MatrixXd& c) {
                            return table_columns(run, cut, field, c);
                          });
}

double quick_p_of_cuts(const SuspectRun& run, const HypothesisFit& fit) {
  if (run.fitter().known_field()) {
    return 1.0;
  }
  const std::vector<double> drops = drops_with_table_moved(run, fit);
  return static_cast<double>(run.n() - 1) *
         nested_f_p(fit.total(), fit.dof(), *std::max_element(drops.begin(), drops.end()), 2.0);
}

void detect_cuts(const SuspectRun& run, const Consider& consider) {
  // The number of independent tests, as a fraction of the number of cuts. It is below 1, because
  // neighbouring cuts give nearly the same result.
  constexpr double independent = 0.3;
  for (const std::size_t cut : cuts_of(run)) {
    const HypothesisFit moved = fit_table_moved(run, cut);
    consider(moved, {.tests = independent * static_cast<double>(run.n() - 1),
                     .of_few = true,
                     .at_least = nested_p_across_field(run, moved)});
  }
}

void explain_by_table(const SuspectRun& run, Explanations& found) {
  for (const std::size_t cut : cuts_of(run)) {
    Correction correction =
        about(run, WarningCode::table_moved, {run.order()[cut - 1], run.order()[cut]});
    found.add(fit_table_moved(run, cut), {angle_range_rad, angle_range_rad},
              static_cast<double>(run.n() - 1), std::move(correction),
              "with the table moved between them");
  }
}

}  // namespace

MistakeKind table_moved_kind() {
  return {.advice = table_moved_advice,
          .of_run = explain_by_table,
          .quick_p = quick_p_of_cuts,
          .detect = detect_cuts};
}

}  // namespace axiscal
