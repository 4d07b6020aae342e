// SPDX-License-Identifier: Apache-2.0
#include "suspect_run.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <Eigen/Cholesky>

#include "axiscal/calib/reading_step.hpp"
#include "axiscal/core/rotation.hpp"

namespace axiscal {
namespace {

constexpr std::size_t fitted_of_many = 48;

}  // namespace

std::vector<std::size_t> first_of(const std::vector<std::size_t>& order, std::size_t count) {
  return {order.begin(),
          order.begin() + static_cast<std::ptrdiff_t>(std::min(count, order.size()))};
}

SuspectRun::SuspectRun(const ReadingSet& set, const Estimate& estimate, bool known_field)
    : set_(set),
      fitter_(estimate.field,
              known_field,
              set.noise_ratio.size() > 0
                  ? set.noise_ratio
                  : Eigen::VectorXd(Eigen::VectorXd::Ones(set.axis_count()))),
      stated_ratio_(set.noise_ratio.size() > 0),
      order_(static_cast<std::size_t>(set.size())),
      plain_(fitter_.fit(set)) {
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  std::stable_sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) {
    return set.readings[a].run < set.readings[b].run;
  });
}

void SuspectRun::delete_each() {
  deletions_.assign(count(), {});
  by_deletion_.resize(count());
  std::iota(by_deletion_.begin(), by_deletion_.end(), std::size_t{0});
  std::vector<double> left(count());  // without each
  std::vector<std::size_t> fitted = by_deletion_;
  const auto sort_by_left = [&](std::vector<std::size_t>& readings) {
    std::stable_sort(readings.begin(), readings.end(),
                     [&](std::size_t a, std::size_t b) { return left[a] < left[b]; });
  };
  if (count() > each_is_fitted) {
    for (std::size_t i = 0; i < count(); ++i) {
      left[i] = plain_.total() - drop_without(plain_, {i});
    }
    sort_by_left(fitted);
    fitted.resize(fitted_of_many);
  }
  for (const std::size_t i : fitted) {
    deletions_[i] = fitter_.fit(set_, {i});
    deletions_[i].forget_readings();
    left[i] =
        deletions_[i].fitted ? deletions_[i].total() : std::numeric_limits<double>::infinity();
  }
  // Behind those that were fitted: the others are judged to first order only.
  sort_by_left(fitted);
  std::vector<bool> is_fitted(count(), false);
  for (const std::size_t i : fitted) {
    is_fitted[i] = true;
  }
  std::erase_if(by_deletion_, [&](std::size_t i) { return is_fitted[i]; });
  by_deletion_.insert(by_deletion_.begin(), fitted.begin(), fitted.end());
}

// Two readings deleted: all pairs where they are few, else of those that count most.
void SuspectRun::delete_pairs() {
  constexpr std::size_t few = 14;
  std::vector<std::size_t> candidates = by_deletion_;
  if (candidates.size() > few) {
    const std::vector<std::size_t> large = largest_residuals(few / 2);
    candidates.resize(few / 2);
    for (const std::size_t i : large) {
      if (std::find(candidates.begin(), candidates.end(), i) == candidates.end()) {
        candidates.push_back(i);
      }
    }
  }
  best_pair_ = {};
  for (std::size_t a = 0; a < candidates.size(); ++a) {
    for (std::size_t b = a + 1; b < candidates.size(); ++b) {
      HypothesisFit fit = fitter_.fit(set_, {candidates[a], candidates[b]});
      fit.forget_readings();
      if (fit.fitted && (!best_pair_.fitted || fit.total() < best_pair_.total())) {
        best_pair_ = std::move(fit);
        pair_ = {candidates[a], candidates[b]};
      }
    }
  }
}

void SuspectRun::weigh_axes_by(const HypothesisFit& clean) {
  const Eigen::VectorXd own =
      (clean.rss.array() / clean.degrees_of_freedom.array().max(0.5)).sqrt();
  fitter_ = HypothesisFitter(clean.field, fitter_.known_field(),
                             fitter_.scale().cwiseProduct(own / own.maxCoeff()));
  plain_ = fitter_.fit(set_);
  if (plain_.fitted) {
    delete_each();
    delete_pairs();
  }
}

bool SuspectRun::only_rounding() const {
  for (Eigen::Index k = 0; k < m(); ++k) {
    if (plain_.rss(k) > 4.0 * std::pow(set_.rounding(k), 2) * static_cast<double>(n())) {
      return false;
    }
  }
  return true;
}

std::vector<std::size_t> SuspectRun::largest_residuals(std::size_t most) const {
  std::vector<std::size_t> all(count());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const Eigen::VectorXd size = plain_.residuals.rowwise().squaredNorm();
  std::stable_sort(all.begin(), all.end(), [&](std::size_t a, std::size_t b) {
    return size(static_cast<Eigen::Index>(a)) > size(static_cast<Eigen::Index>(b));
  });
  return first_of(all, most);
}

// Rows of some readings among all rows, which are by axis.
std::vector<Eigen::Index> SuspectRun::rows_of(const std::vector<std::size_t>& readings) const {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index k = 0; k < m(); ++k) {
    for (const std::size_t i : readings) {
      rows.push_back(n() * k + static_cast<Eigen::Index>(i));
    }
  }
  return rows;
}

// What leaving readings out takes from the sum of squares, to first order.
double SuspectRun::drop_without(const HypothesisFit& fit,
                                const std::vector<std::size_t>& readings) const {
  const std::vector<Eigen::Index> rows = rows_of(readings);
  const Eigen::MatrixXd Q = fit.basis(rows, Eigen::seqN(0, fit.basis.cols()));
  const Eigen::VectorXd e = fit.residuals.reshaped()(rows);
  const auto size = static_cast<Eigen::Index>(rows.size());
  const Eigen::MatrixXd M = Eigen::MatrixXd::Identity(size, size) - Q * Q.transpose();
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(M);
  // A reading that alone determines something has no residual to tell by.
  return ldlt.vectorD().minCoeff() > 1e-9 ? e.dot(ldlt.solve(e)) : 0.0;
}

// What added columns take from it.
double SuspectRun::drop_with(const HypothesisFit& fit, const Eigen::MatrixXd& columns) const {
  Eigen::MatrixXd Z = columns;
  for (Eigen::Index k = 0; k < m(); ++k) {
    Z.middleRows(n() * k, n()) =
        (set_.weights.col(k).cwiseSqrt() / fitter_.scale()(k)).asDiagonal() *
        Z.middleRows(n() * k, n());
  }
  const Eigen::MatrixXd P = Z - fit.basis * (fit.basis.transpose() * Z);
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(P.transpose() * P);
  const Eigen::VectorXd c = P.transpose() * fit.residuals.reshaped().matrix();
  const double size = Z.colwise().squaredNorm().maxCoeff();
  return ldlt.vectorD().minCoeff() > 1e-9 * size ? c.dot(ldlt.solve(c)) : 0.0;
}

// What the table moved after each reading takes from the sum of squares, to first order; by cut.
// The columns of one cut are those of the next and one reading more, so their products with the
// basis and the residuals are running sums.
std::vector<double> SuspectRun::drops_with_table_moved(const HypothesisFit& fit) const {
  std::vector<double> drops(count(), 0.0);
  const Eigen::VectorXd residuals = fit.residuals.reshaped();
  const Eigen::VectorXd along = fit.basis.transpose() * residuals;
  Eigen::MatrixXd in_basis = Eigen::MatrixXd::Zero(fit.basis.cols(), 2);
  Eigen::Matrix2d ZtZ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d Zte = Eigen::Vector2d::Zero();
  for (std::size_t cut = count() - 1; cut > 0; --cut) {
    const std::size_t i = order_[cut];
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::MatrixXd Z = table_rows(i, fit.field, fit.coefficients);
    for (Eigen::Index k = 0; k < m(); ++k) {
      const Eigen::RowVector2d z = std::sqrt(set_.weights(row, k)) / fitter_.scale()(k) * Z.row(k);
      in_basis += fit.basis.row(n() * k + row).transpose() * z;
      ZtZ += z.transpose() * z;
      Zte += z.transpose() * residuals(n() * k + row);
    }
    const Eigen::Matrix2d left = ZtZ - in_basis.transpose() * in_basis;
    const Eigen::LDLT<Eigen::Matrix2d> ldlt(left);
    const Eigen::Vector2d c = Zte - in_basis.transpose() * along;
    const double size = ZtZ.diagonal().maxCoeff();
    drops[cut] = ldlt.vectorD().minCoeff() > 1e-9 * size ? c.dot(ldlt.solve(c)) : 0.0;
  }
  return drops;
}

// The cuts that are fitted: all, or of many those that count most.
std::vector<std::size_t> SuspectRun::cuts() const {
  std::vector<std::size_t> all;
  for (std::size_t cut = 1; cut < count() && !fitter_.known_field(); ++cut) {
    all.push_back(cut);
  }
  if (all.size() > each_is_fitted) {
    const std::vector<double> drops = drops_with_table_moved(plain_);
    std::stable_sort(all.begin(), all.end(),
                     [&](std::size_t a, std::size_t b) { return drops[a] > drops[b]; });
    all.resize(fitted_of_many);
    std::sort(all.begin(), all.end());
  }
  return all;
}

// The field turned in the table for all readings behind a cut of the run's order.
Eigen::MatrixXd SuspectRun::table_columns(std::size_t cut,
                                          const TableField& field,
                                          const Eigen::MatrixXd& coefficients) const {
  Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(n() * m(), 2);
  for (std::size_t at = cut; at < count(); ++at) {
    const std::size_t i = order_[at];
    const Eigen::MatrixXd rows = table_rows(i, field, coefficients);
    for (Eigen::Index k = 0; k < m(); ++k) {
      Z.row(n() * k + static_cast<Eigen::Index>(i)) = rows.row(k);
    }
  }
  return Z;
}

// The rows of one reading in them, one for each axis.
Eigen::MatrixXd SuspectRun::table_rows(std::size_t i,
                                       const TableField& field,
                                       const Eigen::MatrixXd& coefficients) const {
  const Eigen::Vector3d& vector = field.vector(set_.tilt_of(i));
  const Eigen::Matrix<double, 3, 2> change =
      set_.readings[i].level.of_all() * vector.norm() * set_.met_of_field(i) * tangents_of(vector);
  return coefficients.middleRows<3>(1).transpose() * change;
}

Eigen::MatrixXd SuspectRun::drift_columns() const {
  Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(n() * m(), m());
  for (std::size_t at = 0; at < count(); ++at) {
    const double along =
        static_cast<double>(at) / std::max(1.0, static_cast<double>(n() - 1)) - 0.5;
    for (Eigen::Index k = 0; k < m(); ++k) {
      Z(n() * k + static_cast<Eigen::Index>(order_[at]), k) = along;
    }
  }
  return Z;
}

// The readings at one end of an axis's range.
std::vector<std::size_t> SuspectRun::extremes(Eigen::Index axis,
                                              bool top,
                                              const HypothesisFit& fit) const {
  std::vector<double> sensed;
  const Eigen::MatrixXd base = field_design(set_, fit.field);
  for (Eigen::Index i = 0; i < n(); ++i) {
    sensed.push_back((top ? 1.0 : -1.0) *
                     base.row(i).segment<3>(1).dot(fit.coefficients.col(axis).segment<3>(1)));
  }
  const double end = *std::max_element(sensed.begin(), sensed.end());
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < count(); ++i) {
    if (sensed[i] > 0.9 * end) {
      found.push_back(i);
    }
  }
  return found;
}

Eigen::MatrixXd SuspectRun::extreme_columns(Eigen::Index axis,
                                            bool top,
                                            const HypothesisFit& fit) const {
  Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(n() * m(), 1);
  for (const std::size_t i : extremes(axis, top, fit)) {
    Z(n() * axis + static_cast<Eigen::Index>(i), 0) = 1.0;
  }
  return Z;
}

HypothesisFit SuspectRun::table_moved(std::size_t cut) const {
  return fitter_.fit(set_, {}, [&, cut](const TableField& field, const Eigen::MatrixXd& c) {
    return table_columns(cut, field, c);
  });
}

HypothesisFit SuspectRun::drifted() const {
  return fitter_.fit(set_, {}, [&](const auto&, const auto&) { return drift_columns(); });
}

HypothesisFit SuspectRun::saturated(Eigen::Index axis, bool top) const {
  const Eigen::MatrixXd Z = extreme_columns(axis, top, plain_);
  HypothesisFit fit = fitter_.fit(set_, {}, [&](const auto&, const auto&) { return Z; });
  // Readings at an end share a digit, and with it an error of half a step; those at the other end
  // may have the opposite one.
  constexpr double both_ends = 1.5;
  const double step = step_of_readings(set_.readings_of_axis(axis), 0.0).value_or(0.0);
  if (fit.fitted && !(std::abs(fit.added(0)) > both_ends * step)) {
    return {};
  }
  return fit;
}

HypothesisFit SuspectRun::tilted(std::size_t i) const {
  const auto row = static_cast<Eigen::Index>(i);
  if (set_.field.is_dark(set_.readings[i].level)) {
    return {};  // no field, no tilt in it
  }
  return fitter_.fit(
      set_, {}, [&, i, row](const TableField& field, const Eigen::MatrixXd& c) -> Eigen::MatrixXd {
        const Eigen::Vector3d met =
            set_.rotation_sensor_from_table[i] * set_.field_in_table(row, field);
        Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(n() * m(), 2);
        const Eigen::Matrix<double, 3, 2> change = met.norm() * tangents_of(met);
        for (Eigen::Index k = 0; k < m(); ++k) {
          Z.row(n() * k + row) = c.col(k).segment<3>(1).transpose() * change;
        }
        return Z;
      });
}

// A value for each of these readings, or for one of its axes, that may be anything.
HypothesisFit SuspectRun::arbitrary(const std::vector<std::size_t>& readings,
                                    std::optional<Eigen::Index> axis) const {
  std::vector<Eigen::Index> rows = rows_of(readings);
  if (axis) {
    rows = {n() * *axis + static_cast<Eigen::Index>(readings.front())};
  }
  Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(n() * m(), static_cast<Eigen::Index>(rows.size()));
  for (std::size_t j = 0; j < rows.size(); ++j) {
    Z(rows[j], static_cast<Eigen::Index>(j)) = 1.0;
  }
  return fitter_.fit(set_, {}, [&](const auto&, const auto&) { return Z; });
}

}  // namespace axiscal
